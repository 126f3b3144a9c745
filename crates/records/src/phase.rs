//! The phase beside a reading: its reference and its sign convention, `[phase]` of a `scan.toml`.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use fieldgap_input::NonNegative;

/// Standard uncertainty of the reference's drift over a scan where nothing is stated, rad. Set by judgement: an electret or a piezoelectric
/// receiver turns by some degrees where the air warms by some kelvins.
const USUAL_DRIFT_RAD: f64 = 0.1;

/// What the phase of a reading is measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PhaseReference {
    /// The clock that the drives are made from: one unknown constant for the whole scan.
    DriveSync,
    /// A signal that starts anew with each drive: an unknown constant for each of them.
    EachDrive,
}

/// How the state of a reading of amplitude A and phase φ turns in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum PhaseConvention {
    /// Re A exp(iφ) exp(-iωt): the phase grows with the distance from the source. That of this program.
    MinusIwt,
    /// Re A exp(iφ) exp(+iωt): the phase falls with the distance. That of most lock-in amplifiers.
    PlusIwt,
}

impl PhaseConvention {
    const ALL: [Self; 2] = [Self::MinusIwt, Self::PlusIwt];

    /// As a file states it.
    pub fn name(self) -> &'static str {
        match self {
            Self::MinusIwt => "exp(-iwt)",
            Self::PlusIwt => "exp(+iwt)",
        }
    }

    /// A phase in this convention as one of exp(-iωt), and back.
    pub fn turned(self, phase_rad: f64) -> f64 {
        match self {
            Self::MinusIwt => phase_rad,
            Self::PlusIwt => -phase_rad,
        }
    }
}

/// Another text than the names of the conventions.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no convention; exp(-iwt) is one, by which the phase grows with the distance from the source, and exp(+iwt) the other"
)]
pub struct UnknownConvention(String);

impl FromStr for PhaseConvention {
    type Err = UnknownConvention;

    fn from_str(text: &str) -> Result<Self, UnknownConvention> {
        let known = Self::ALL.into_iter().find(|convention| convention.name() == text.trim());
        known.ok_or_else(|| UnknownConvention(text.to_owned()))
    }
}

impl TryFrom<String> for PhaseConvention {
    type Error = UnknownConvention;

    fn try_from(text: String) -> Result<Self, UnknownConvention> {
        text.parse()
    }
}

impl From<PhaseConvention> for String {
    fn from(convention: PhaseConvention) -> Self {
        convention.name().to_owned()
    }
}

/// What the phases of a record mean, `[phase]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhaseSection {
    /// What they are measured against.
    pub reference: PhaseReference,
    /// Which way they turn.
    pub convention: PhaseConvention,
    /// Standard uncertainty of the reference's drift from the first reading to the last, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift_u_rad: Option<NonNegative>,
}

impl PhaseSection {
    /// Against the clock of the drives, with the usual drift.
    pub fn of_drive_sync(convention: PhaseConvention) -> Self {
        Self { reference: PhaseReference::DriveSync, convention, drift_u_rad: None }
    }

    /// Reference and convention as a file states them.
    pub fn named(&self) -> (&'static str, &'static str) {
        let reference = match self.reference {
            PhaseReference::DriveSync => "drive-sync",
            PhaseReference::EachDrive => "each-drive",
        };
        (reference, self.convention.name())
    }

    /// Standard uncertainty of the reference's drift from the first reading to the last, rad.
    pub fn drift_u_rad(&self) -> f64 {
        self.drift_u_rad.map_or(USUAL_DRIFT_RAD, NonNegative::get)
    }
}
