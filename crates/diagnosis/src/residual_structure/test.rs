//! A test of the residuals.

use crate::limits::SINGLE_CAUSE_LIMIT;

/// A test of what a fit leaves.
#[derive(Debug, Clone)]
pub(crate) struct Test {
    /// What is looked for.
    pub name: &'static str,
    /// Standard deviations from what noise alone gives; of a converter's steps, their rounding error.
    pub z: f64,
    /// From where on it is structure.
    pub limit: f64,
    /// What it is a sign of, as far as the readings say.
    pub sign_of: Option<String>,
    /// What kind of structure it is.
    pub kind: Kind,
}

/// Kinds of structure, by what may excuse it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Of a gap that is many times the noise it may be a formula's own error.
    Pattern,
    /// No formula is so wrong.
    NoFlaw,
    /// What the receiver's converter does to every reading: it matters to a gap that is not much larger.
    Converter,
}

impl Test {
    /// A test for one cause that the catalogue does not have.
    pub fn of_one_thing(name: &'static str, z: f64, sign_of: Option<String>) -> Self {
        Self { name, z, limit: SINGLE_CAUSE_LIMIT, sign_of, kind: Kind::Pattern }
    }

    /// Whether there is structure.
    pub fn fails(&self) -> bool {
        self.z > self.limit
    }
}
