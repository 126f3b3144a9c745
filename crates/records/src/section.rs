//! Keys of a TOML section: which are required, which are not allowed.

use std::ops::Range;

use toml::Spanned;

use fieldgap_input::{Fault, TomlSource};

/// A key that may be left out, with the position of its value in the file.
pub type Key<T> = Option<Spanned<T>>;

/// The position of a key's value.
pub fn place<T>(key: &Key<T>) -> Option<Range<usize>> {
    key.as_ref().map(Spanned::span)
}

/// A value to be written, without a position.
pub fn written<T>(value: T) -> Key<T> {
    Some(Spanned::new(0..0, value))
}

/// One section of a file, of one kind (a square array, a focus at a point), which requires some keys and refuses others.
pub struct Section<'s> {
    source: &'s TomlSource,
    at: Range<usize>,
    kind: &'static str,
    needs: String,
}

impl<'s> Section<'s> {
    /// A section at a byte range. `kind` is what it describes ("a square array"), `needs` lists all its keys.
    pub fn new(
        source: &'s TomlSource,
        at: Range<usize>,
        kind: &'static str,
        needs: impl Into<String>,
    ) -> Self {
        Self { source, at, kind, needs: needs.into() }
    }

    /// The value of a required key.
    ///
    /// # Errors
    /// A [`Fault`] at the section that names the missing key.
    pub fn need<T: Clone>(&self, name: &str, key: &Key<T>) -> Result<T, Fault> {
        key.as_ref().map(|value| value.get_ref().clone()).ok_or_else(|| {
            self.fault(format!("{} needs the key `{name}`, which is missing", self.kind))
        })
    }

    /// Refuses a key.
    ///
    /// # Errors
    /// A [`Fault`] at the key's value.
    pub fn refuse<T>(&self, name: &str, key: &Key<T>) -> Result<(), Fault> {
        self.refuse_at(name, place(key))
    }

    /// Refuses a key with its value at `place`.
    ///
    /// # Errors
    /// A [`Fault`] at the key's value.
    pub fn refuse_at(&self, name: &str, place: Option<Range<usize>>) -> Result<(), Fault> {
        match place {
            None => Ok(()),
            Some(place) => Err(self.source.fault(
                place,
                format!("`{name}` does not belong to {}", self.kind),
                format!("remove the key; {} has {}", self.kind, self.needs),
            )),
        }
    }

    /// A fault of the section as a whole.
    pub fn fault(&self, problem: impl Into<String>) -> Fault {
        self.source.fault(self.at.clone(), problem, format!("{} has {}", self.kind, self.needs))
    }
}
