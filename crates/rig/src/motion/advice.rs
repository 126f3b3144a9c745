//! What a driver has found in its device and a person should know.

/// Something that makes scans poorer or less safe than they need be, and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advice {
    /// What was found.
    pub problem: String,
    /// What to do.
    pub remedy: &'static str,
}
