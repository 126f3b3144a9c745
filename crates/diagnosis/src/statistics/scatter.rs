//! How the readings of a scan scatter about their mean.
//!
//! A level m reads |m + b (n₁ + i n₂)| (1 + a n₀) with standard normal n, so that a dark reading has Rayleigh's distribution and a
//! strong signal scatters by √(a² m² + b²). A floor that the detector adds in power makes √(reading² + floor²) of it before
//! the share in proportion comes in: quadrature noise is the smaller beside a floor, and the share is not.

use std::sync::Arc;

use crate::limits::{FEWEST_REPEATS, TURBULENCE_EXCLUDED};
use crate::statistics::reading_pairs::{Pair, cost};
use crate::statistics::speckle::Speckle;

/// The scatter of one reading.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scatter {
    /// In proportion to the level.
    pub share: f64,
    /// Each quadrature of what does not depend on the level, in the reading's unit.
    pub additive: f64,
    /// Random phase over one metre of path that the repeats ask for, rad, and the kind of it.
    pub turbulence: f64,
    pub speckle: Speckle,
    /// The most of it that the repeats allow.
    pub most_turbulence: f64,
    /// Floor that silence shows, in the reading's unit.
    pub floor: f64,
    /// The largest floor that silence allows: nothing can read less than the floor.
    pub most_floor: f64,
    /// By how much silence prefers that floor to none, in nats.
    pub floor_evidence: f64,
    /// Visits that came again to a point, with what they differed by.
    pub pairs: Arc<[Pair]>,
}

impl Default for Scatter {
    fn default() -> Self {
        Self {
            share: 0.02,
            additive: 0.0,
            turbulence: 0.0,
            speckle: Speckle::OfPaths,
            most_turbulence: f64::INFINITY,
            floor: 0.0,
            most_floor: f64::INFINITY,
            floor_evidence: 0.0,
            pairs: Arc::new([]),
        }
    }
}

impl Scatter {
    /// Whether there are repeats enough to tell it, whatever the readings should have been.
    pub fn is_told_by_repeats(&self) -> bool {
        self.pairs.len() >= FEWEST_REPEATS
    }

    /// The squares of share, additive part and turbulence.
    pub fn squares(&self) -> [f64; 3] {
        [self.share, self.additive, self.turbulence].map(|root| root * root)
    }

    /// By how much the repeats speak against turbulence of so much, in nats, from the one that suits them best.
    pub fn against_turbulence(&self, turbulence: f64, speckle: Speckle) -> f64 {
        let of =
            |turbulence, speckle| cost(&self.pairs, self.share, self.additive, turbulence, speckle);
        (of(turbulence, speckle) - of(self.turbulence, self.speckle)).max(0.0)
    }

    pub fn with_most_turbulence(self) -> Self {
        /// Where the search for it begins, rad over √m, and the factor of its steps.
        const FROM: f64 = 0.01;
        const FACTOR: f64 = 1.25;
        let mut most_turbulence = self.turbulence.max(FROM);
        let against = |turbulence| {
            let kinds = Speckle::ALL.map(|speckle| self.against_turbulence(turbulence, speckle));
            kinds.into_iter().fold(f64::INFINITY, f64::min)
        };
        while most_turbulence < 100.0 && against(most_turbulence) < TURBULENCE_EXCLUDED {
            most_turbulence *= FACTOR;
        }
        Self { most_turbulence, ..self }
    }
}
