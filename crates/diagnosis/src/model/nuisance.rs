//! What is free in every fit: the gain, a small shift, and the elements' near field; and how far the set-up departs from what is stated.

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

use nalgebra::Vector3;

use fieldgap_acoustics::Vec3;

use super::instance::Instance;
use super::stated_uncertainty::StatedUncertainty;
use crate::effect_id::EffectId;

/// What is free in every fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Nuisances {
    scans: Vec<Nuisance>,
    /// The numbers of the set-up's departures within its stated uncertainty.
    pub departures: BTreeMap<EffectId, Vec<f64>>,
    /// Standard deviations of those of single elements, where readings told them.
    pub spreads: BTreeMap<EffectId, f64>,
}

impl Nuisances {
    /// The same with other numbers of the scans.
    pub fn with_scans(self, scans: Vec<Nuisance>) -> Self {
        Self { scans, ..self }
    }

    /// Beside these effects: what has no numbers yet is as it is stated, and an effect takes the place of a departure of its kind.
    pub fn beside(mut self, instances: &[Instance], stated: &StatedUncertainty) -> Self {
        let departures = stated.beside(instances).map(|departure| {
            let known = self.departures.remove(&departure.id());
            (departure.id(), known.unwrap_or_else(|| departure.means()))
        });
        self.departures = departures.collect();
        self
    }

    /// The same of the first scan alone.
    pub fn of_first(&self) -> Self {
        self.clone().with_scans(self.scans[..1].to_vec())
    }
}

impl From<Vec<Nuisance>> for Nuisances {
    /// The set-up as it is stated.
    fn from(scans: Vec<Nuisance>) -> Self {
        Self { scans, ..Self::default() }
    }
}

impl Deref for Nuisances {
    type Target = [Nuisance];

    fn deref(&self) -> &[Nuisance] {
        &self.scans
    }
}

impl DerefMut for Nuisances {
    fn deref_mut(&mut self) -> &mut [Nuisance] {
        &mut self.scans
    }
}

/// What is free in every scan, whatever the effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nuisance {
    /// Natural logarithm of the reading per unit of the simulation.
    pub log_gain: f64,
    /// Shift of the scan's coordinates, m.
    pub shift_m: Vector3<f64>,
    /// Share of a piston's near field that the elements show, 0 to 1; simulators leave it out.
    pub near_field: f64,
}

impl Nuisance {
    /// Numbers in it.
    pub const COUNT: usize = 5;

    /// What they are called.
    pub const NAMES: [&str; Self::COUNT] = [
        "the gain",
        "the place along x",
        "the place along y",
        "the place along z",
        "the near field",
    ];

    /// From its numbers: log gain, then x, y, z, then the near field.
    pub fn from_slice(numbers: &[f64]) -> Self {
        let shift_m = Vec3::new(numbers[1], numbers[2], numbers[3]);
        Self { log_gain: numbers[0], shift_m, near_field: numbers[4] }
    }
}
