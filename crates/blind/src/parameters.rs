//! Parameters of one effect, as a truth file has them.

/// By their keys.
pub(super) type Parameters = toml::Table;
