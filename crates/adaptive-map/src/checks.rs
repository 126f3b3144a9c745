//! Whether stated errors hold: readings that were foretold before they were taken.
//!
//! A reading's departure from what was foretold has the variance ν² n² + κ² v: noise n, and the error v of the map's square, each too small or
//! too large by a factor. Each new round tests the map of the round before for free. ν and κ are the values with the greatest likelihood beside
//! priors about one; where κ exceeds one, the stated errors are made larger by it. They are never made smaller.

use crate::estimate::Foretold;

/// Standard deviations of ln κ and ln ν before any check. Set by judgement: two hundred checks then decide. The noise is known better.
const WITHIN: f64 = 0.4;
const NOISE_WITHIN: f64 = 0.15;

/// Factors that are tried: from 1 to 6; and of the noise, from two thirds to one and a half.
const TRIED: i32 = 60;
const STEP: f64 = 0.03;
const NOISE_TRIED: i32 = 8;
const NOISE_STEP: f64 = 0.05;

/// Departures of more standard deviations count as so many: a single reading that went wrong is no scale.
const MOST_DEPARTURE: f64 = 4.0;

/// How readings turned out that were foretold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checks {
    /// How many.
    pub readings: usize,
    /// Root mean square of their departures, in their stated standard deviations, those of the noise included; one where all holds.
    pub rms: f64,
    /// The factor on the map's standard errors that they call for; at least one.
    pub factor: f64,
}

/// Of readings and what was foretold of each.
pub(crate) fn checks(pairs: &[(f64, Foretold)]) -> Checks {
    let standardised = |(reading, foretold): &(f64, Foretold), noise: f64, factor: f64| {
        let deviation = (noise * foretold.noise).hypot(factor * foretold.standard_error);
        let deviation = deviation.max(f64::MIN_POSITIVE);
        let departure = (reading - foretold.reading) / deviation;
        (departure.clamp(-MOST_DEPARTURE, MOST_DEPARTURE), deviation)
    };
    let cost = |log_noise: f64, log_factor: f64| -> f64 {
        let each = pairs.iter().map(|pair| {
            let (departure, deviation) = standardised(pair, log_noise.exp(), log_factor.exp());
            departure * departure + 2.0 * deviation.ln()
        });
        each.sum::<f64>() + (log_factor / WITHIN).powi(2) + (log_noise / NOISE_WITHIN).powi(2)
    };
    let logs = (-NOISE_TRIED..=NOISE_TRIED).flat_map(|noise| {
        (0..TRIED).map(move |n| (NOISE_STEP * f64::from(noise), STEP * f64::from(n)))
    });
    let best = logs.min_by(|a, b| cost(a.0, a.1).total_cmp(&cost(b.0, b.1)));
    let best = best.map_or(0.0, |(_, factor)| factor);
    let squares = pairs.iter().map(|pair| standardised(pair, 1.0, 1.0).0.powi(2)).sum::<f64>();
    let readings = pairs.len();
    let rms = if readings == 0 { 1.0 } else { (squares / readings as f64).sqrt() };
    Checks { readings, rms, factor: best.exp() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Readings whose map is wrong by so many of its standard errors.
    fn drawn(wrong: f64) -> Checks {
        let mut draws = ChaCha8Rng::seed_from_u64(4);
        let mut normal = || -> f64 { StandardNormal.sample(&mut draws) };
        let foretold = Foretold { reading: 1.0, standard_error: 0.02, noise: 0.02 };
        let pairs: Vec<_> =
            (0..400).map(|_| (1.0 + 0.02 * wrong * normal() + 0.02 * normal(), foretold)).collect();
        checks(&pairs)
    }

    #[test]
    fn errors_that_are_stated_too_small_are_made_larger() {
        let (right, wrong) = (drawn(1.0), drawn(3.0));
        assert!((0.93..1.07).contains(&right.rms) && right.factor < 1.15, "{right:?}");
        // Variance 10 over the stated 2.
        assert!((2.0..2.4).contains(&wrong.rms), "{wrong:?}");
        assert!((2.6..3.4).contains(&wrong.factor), "{wrong:?}");
        assert_eq!(drawn(0.3).factor, 1.0);
    }

    #[test]
    fn without_checks_the_errors_stand() {
        assert_eq!(checks(&[]), Checks { readings: 0, rms: 1.0, factor: 1.0 });
    }
}
