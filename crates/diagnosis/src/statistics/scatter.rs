//! How the readings of a scan scatter about their mean.
//!
//! A level m reads |m + b (n₁ + i n₂)| (1 + a n₀) with standard normal n, so that a dark reading has Rayleigh's distribution and a
//! strong signal scatters by √(a² m² + b²). A floor that the detector adds in power makes √(reading² + floor²) of it before
//! the proportional noise, or after it: beside a floor quadrature noise is reduced, and proportional noise only if it comes in before. The same
//! holds of a detector that compresses.

use std::sync::Arc;

use crate::limits::{FEWEST_REPEATS, FLUCTUATION_SHOWN, USUAL_NOISE_WITHIN};
use crate::statistics::fluctuation::Fluctuation;
use crate::statistics::reading_pairs::{Pair, cost};
use crate::statistics::slow_level::SlowNoise;

/// The scatter of one reading.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scatter {
    /// Standard deviation of the proportional noise, relative to the level.
    pub share: f64,
    /// Slow noise of the level beside it; `None` where none is seen.
    pub slow: Option<SlowNoise>,
    /// Standard deviation of each quadrature of the additive noise, in the reading's unit.
    pub additive: f64,
    /// Fluctuation of the field that the repeats show, in the unit of its cause; zero for none.
    pub fluctuation: f64,
    /// Its cause.
    pub cause: Fluctuation,
    /// Nats by which repeats and dark readings prefer a fluctuating field to a steady one.
    pub prefers_fluctuation: f64,
    /// Whether the field is taken to fluctuate though they prefer that by little.
    pub may_fluctuate: bool,
    /// The most turbulence that the repeats allow, rad over one metre of path.
    pub most_turbulence: f64,
    /// The most scatter of the position that the repeats allow, mm.
    pub most_jitter_mm: f64,
    /// Floor that dark readings show, in the reading's unit.
    pub floor: f64,
    /// Whether noise comes in after the floor: it then scatters readings of the floor as it does others.
    pub floor_before_noise: bool,
    /// Whether noise in proportion to the level comes in before the detector, which then reduces it: silence lacks it, and compressed readings
    /// have less of it.
    pub detector_after_all_noise: bool,
    /// The largest floor that dark readings allow: nothing can read less than the floor.
    pub most_floor: f64,
    /// By how much dark readings prefer that floor to none, in nats.
    pub floor_evidence: f64,
    /// Repeats: differences of readings of one point.
    pub pairs: Arc<[Pair]>,
    /// Whether the maps of dense planes tell its noise, since repeats do not.
    pub told_by_map: bool,
}

impl Default for Scatter {
    fn default() -> Self {
        Self {
            share: 0.02,
            slow: None,
            additive: 0.0,
            fluctuation: 0.0,
            cause: Fluctuation::OfPaths,
            prefers_fluctuation: 0.0,
            may_fluctuate: false,
            most_turbulence: f64::INFINITY,
            most_jitter_mm: f64::INFINITY,
            floor: 0.0,
            floor_before_noise: false,
            detector_after_all_noise: false,
            most_floor: f64::INFINITY,
            floor_evidence: 0.0,
            pairs: Arc::new([]),
            told_by_map: false,
        }
    }
}

/// Prior of a part of the noise that usually is of this size, in nats.
pub(crate) fn against_unusual(part: f64, usual: f64) -> f64 {
    0.5 * ((part / usual).ln() / USUAL_NOISE_WITHIN.get()).powi(2)
}

impl Scatter {
    /// Whether there are enough repeats to determine it without a model.
    pub fn is_told_by_repeats(&self) -> bool {
        self.pairs.len() >= FEWEST_REPEATS
    }

    /// The squares of share, additive part and fluctuation.
    pub fn squares(&self) -> [f64; 3] {
        [self.share, self.additive, self.fluctuation].map(|root| root * root)
    }

    /// Standard deviation of the slow noise of the level, relative to it; zero where none is seen.
    pub fn slow_share(&self) -> f64 {
        self.slow.map_or(0.0, |slow| slow.share)
    }

    /// Proportional noise with the slow noise of the level, which repeats that are far apart in time show too.
    pub fn share_of_repeats(&self) -> f64 {
        self.share.hypot(self.slow_share())
    }

    /// Noise in proportion to the level that silent readings have, of this share.
    pub fn share_in_silence(&self, share: f64) -> f64 {
        if self.detector_after_all_noise { 0.0 } else { share }
    }

    /// The same with its proportional and its additive noise larger by a factor.
    pub fn times(self, factor: f64) -> Self {
        Self { share: factor * self.share, additive: factor * self.additive, ..self }
    }

    /// Nats by which the repeats prefer the fluctuation of this scatter to one of this size and cause.
    pub fn against(&self, fluctuation: f64, cause: Fluctuation) -> f64 {
        let share = self.share_of_repeats();
        let of = |fluctuation, cause| cost(&self.pairs, share, self.additive, fluctuation, cause);
        (of(fluctuation, cause) - of(self.fluctuation, self.cause)).max(0.0)
    }

    /// The same with the largest fluctuations that the repeats allow.
    pub fn with_limits(self) -> Self {
        let most_turbulence = self.most(&Fluctuation::OF_AIR);
        let most_jitter_mm = self.most(&[Fluctuation::OfPosition]);
        Self { most_turbulence, most_jitter_mm, ..self }
    }

    fn most(&self, causes: &[Fluctuation]) -> f64 {
        /// Where the search begins, rad over one metre or mm; and where it ends.
        const FROM: f64 = 0.01;
        const TO: f64 = 100.0;
        const FACTOR: f64 = 1.25;
        let mut most = match causes.contains(&self.cause) {
            true => self.fluctuation.max(FROM),
            false => FROM,
        };
        let against = |fluctuation| {
            let all = causes.iter().map(|cause| self.against(fluctuation, *cause));
            all.fold(f64::INFINITY, f64::min)
        };
        while most < TO && against(most) < FLUCTUATION_SHOWN.get() {
            most *= FACTOR;
        }
        most
    }
}
