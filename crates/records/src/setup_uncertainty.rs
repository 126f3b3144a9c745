//! How well a set-up is known, `[uncertainty]`.

use serde::{Deserialize, Serialize};

use fieldgap_input::{Fraction, Length, Positive};

/// Standard uncertainties (GUM, JCGM 100:2008, 2.3.1) of what a set-up states. What is not given is taken as stated.
///
/// A diagnosis lets the set-up depart so far from what is stated before it looks for causes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetupUncertainty {
    /// Relative standard deviation of the elements' amplitudes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element_gain: Option<Fraction>,
    /// Standard deviation of their phases, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element_phase_rad: Option<Positive>,
    /// Of each coordinate of the scan's origin, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin_mm: Option<Length>,
    /// Of the temperature of the air, K.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<Positive>,
    /// Of the relative change of the level from the first reading to the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level_drift: Option<Fraction>,
    /// A plane parallel to the array that reflects a little.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflection: Option<PossibleReflection>,
}

/// A plane parallel to the array, such as a ceiling, whose reflection is not known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PossibleReflection {
    /// Its height above the array by a tape measure, mm.
    pub height_mm: Length,
    /// Root mean square of the magnitude of its reflection coefficient, for pressure.
    pub coefficient: Fraction,
}
