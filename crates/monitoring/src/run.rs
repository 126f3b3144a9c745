//! One run of a cell: its figures with standard errors.

use std::collections::BTreeMap;

use fieldgap_text::Uncertain;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

/// What one run of a cell gave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// The cell: one combination of focus, temperature and other settings, under a name that stays the same.
    pub cell: String,
    /// When it was measured.
    pub at: Timestamp,
    /// The air's temperature, °C; without it nothing is corrected for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<Uncertain>,
    /// Figures by their names, each in a unit that does not change from run to run. A standard error that is not finite or not
    /// above zero counts as not stated: scatter from run to run then takes its place.
    pub figures: BTreeMap<String, Uncertain>,
}
