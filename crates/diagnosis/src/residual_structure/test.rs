//! A test of the residuals.

use crate::limits::SINGLE_CAUSE_LIMIT;

/// A test of the residuals of a fit.
#[derive(Debug, Clone)]
pub(crate) struct Test {
    /// What is looked for.
    pub name: &'static str,
    /// Standard deviations from what noise alone gives; of a converter's steps, their rounding error.
    pub z: f64,
    /// The limit from which on it is structure.
    pub limit: f64,
    /// The interpretation, as far as the readings allow one.
    pub sign_of: Option<String>,
    /// What kind of structure it is.
    pub kind: Kind,
}

/// Kinds of structure, by what may account for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// In a gap many times the noise it may be an error of a formula.
    Pattern,
    /// No error of a formula accounts for it.
    NoFlaw,
    /// Rounding by the converter: it matters for a gap that is not much larger.
    Converter,
}

impl Test {
    /// A test for one cause that the catalogue does not have.
    pub fn of_one_thing(name: &'static str, z: f64, sign_of: Option<String>) -> Self {
        Self { name, z, limit: SINGLE_CAUSE_LIMIT.get(), sign_of, kind: Kind::Pattern }
    }

    /// Its result over its limit.
    pub fn over_limit(&self) -> f64 {
        self.z / self.limit
    }

    /// What it found, for a list: its name, its interpretation if there is one, its result.
    pub fn in_words(&self) -> String {
        let sign = self.sign_of.as_ref().map(|sign| format!(", {sign}"));
        let digits = if self.z < 1.0 { 1 } else { 0 };
        format!("{}: {:.digits$} σ{}", self.name, self.z, sign.unwrap_or_default())
    }

    /// Whether there is structure.
    pub fn fails(&self) -> bool {
        self.z > self.limit
    }
}
