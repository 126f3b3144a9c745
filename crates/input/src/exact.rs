//! Lists of an exact length.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

use serde::de::{Error, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// `N` values, no more and no fewer. An array of its own would accept a longer list and drop the rest.
///
/// ```
/// use std::path::Path;
///
/// use fieldgap_input::{Exact, Finite, toml_text};
/// use serde::Deserialize;
///
/// #[derive(Debug, Deserialize)]
/// struct Box {
///     size_mm: Exact<Finite, 2>,
/// }
///
/// let path = Path::new("box.toml");
/// assert_eq!(toml_text::<Box>(path, "size_mm = [3, 4]")?.size_mm.map(Finite::get), [3.0, 4.0]);
/// let fault = toml_text::<Box>(path, "size_mm = [3, 4, 5]").unwrap_err();
/// assert_eq!(fault.problem(), "invalid length 3, expected 2 values");
/// # Ok::<(), fieldgap_input::Fault>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exact<T, const N: usize>([T; N]);

impl<T, const N: usize> From<[T; N]> for Exact<T, N> {
    fn from(values: [T; N]) -> Self {
        Self(values)
    }
}

impl<T: Default + Copy, const N: usize> Default for Exact<T, N> {
    fn default() -> Self {
        Self([T::default(); N])
    }
}

impl<T, const N: usize> Deref for Exact<T, N> {
    type Target = [T; N];
    fn deref(&self) -> &[T; N] {
        &self.0
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Exact<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Values(PhantomData))
    }
}

struct Values<T, const N: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for Values<T, N> {
    type Value = Exact<T, N>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{N} values")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
        let mut values = Vec::with_capacity(N);
        while let Some(value) = if values.len() < N { list.next_element()? } else { None } {
            values.push(value);
        }
        let mut given = values.len();
        while given >= N && list.next_element::<IgnoredAny>()?.is_some() {
            given += 1;
        }
        match values.try_into() {
            Ok(values) if given == N => Ok(Exact(values)),
            _ => Err(A::Error::invalid_length(given, &self)),
        }
    }
}
