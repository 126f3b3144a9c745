//! A TOML value that is one number or a list of them.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::F64Deserializer;
use serde::de::{Deserialize, Deserializer, IntoDeserializer, SeqAccess, Visitor};

/// One number, or a list of numbers, each of a quantity with a checked range.
///
/// The errors of an untagged enum would contain neither the number at fault nor the reason.
#[derive(Debug)]
pub(super) struct OneOrMany<T>(pub Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Numbers(PhantomData))
    }
}

struct Numbers<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Numbers<T> {
    type Value = OneOrMany<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number or a list of numbers")
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<OneOrMany<T>, E> {
        let deserializer: F64Deserializer<E> = number.into_deserializer();
        Ok(OneOrMany(vec![T::deserialize(deserializer)?]))
    }

    fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<OneOrMany<T>, E> {
        self.visit_f64(number as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<OneOrMany<T>, A::Error> {
        let mut many = Vec::new();
        while let Some(number) = numbers.next_element()? {
            many.push(number);
        }
        Ok(OneOrMany(many))
    }
}
