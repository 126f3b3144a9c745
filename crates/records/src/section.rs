//! Keys of a TOML section that go together: which are needed, which do not belong.

use std::ops::Range;

use toml::Spanned;

use fieldgap_input::{Fault, TomlSource};

/// A key that may be left out, and where its value stands.
pub type Key<T> = Option<Spanned<T>>;

/// Where the value of a key stands.
pub fn place<T>(key: &Key<T>) -> Option<Range<usize>> {
    key.as_ref().map(Spanned::span)
}

/// A value that stands in no file: for writing.
pub fn written<T>(value: T) -> Key<T> {
    Some(Spanned::new(0..0, value))
}

/// One section of a file, of one kind (a square array, a focus at a point), that needs some keys and refuses others.
pub struct Section<'s> {
    source: &'s TomlSource,
    at: Range<usize>,
    kind: &'static str,
    needs: String,
}

impl<'s> Section<'s> {
    /// A section at a byte range; `kind` is what it describes ("a square array"), `needs` names all its keys.
    pub fn new(
        source: &'s TomlSource,
        at: Range<usize>,
        kind: &'static str,
        needs: impl Into<String>,
    ) -> Self {
        Self { source, at, kind, needs: needs.into() }
    }

    /// The value of a key that must be there.
    ///
    /// # Errors
    /// A [`Fault`] at the section that names the missing key.
    pub fn need<T: Clone>(&self, name: &str, key: &Key<T>) -> Result<T, Fault> {
        key.as_ref().map(|value| value.get_ref().clone()).ok_or_else(|| {
            self.fault(format!("{} needs the key `{name}`, which is missing", self.kind))
        })
    }

    /// Makes sure that a key is not there.
    ///
    /// # Errors
    /// A [`Fault`] at the key's value.
    pub fn refuse<T>(&self, name: &str, key: &Key<T>) -> Result<(), Fault> {
        self.refuse_at(name, place(key))
    }

    /// Makes sure that a key, whose value stands at `place`, is not there.
    ///
    /// # Errors
    /// A [`Fault`] at the key's value.
    pub fn refuse_at(&self, name: &str, place: Option<Range<usize>>) -> Result<(), Fault> {
        match place {
            None => Ok(()),
            Some(place) => Err(self.source.fault(
                place,
                format!("`{name}` does not belong to {}", self.kind),
                format!("take the key out; {} has {}", self.kind, self.needs),
            )),
        }
    }

    /// A fault of the section as a whole.
    pub fn fault(&self, problem: impl Into<String>) -> Fault {
        self.source.fault(self.at.clone(), problem, format!("{} has {}", self.kind, self.needs))
    }
}
