//! Whether all readings together show a fluctuating field: it scatters readings otherwise than steady noise does.
//!
//! Turbulence scatters most where levels are low; a scattered position where the field is steep.
//!
//! The likelihood of the residuals is Gaussian. Their variance is the sum of a proportional part s² m², a quadrature part a² and the
//! fluctuation's part. All three are found by Fisher's scoring; dark readings give information on a² (C. R. Rao, *Linear Statistical
//! Inference*, section 5g).

use nalgebra::{Matrix3, Vector3};

use fieldgap_comparison::DarkReadings;

use crate::limits::FLUCTUATION_SHOWN;
use crate::statistics::fluctuation::Fluctuation;
use crate::statistics::reading_pairs::Pair;
use crate::statistics::scatter::Scatter;

/// Iterations of the scoring, from no fluctuation.
const ROUNDS: usize = 8;

/// Most change of a variance in one round, as a factor.
const MOST_CHANGE: f64 = 3.0;

/// The scatter with a fluctuation, if the readings prefer it to steady scatter; else `None`.
pub(crate) fn fluctuating(
    readings: &[Pair],
    dark: &DarkReadings,
    steady: &Scatter,
) -> Option<Scatter> {
    let cost = |scatter: &Scatter| {
        let of_readings: f64 =
            readings.iter().map(|pair| pair.cost(scatter.squares(), scatter.cause)).sum();
        of_readings + dark.cost_without_floor(scatter.additive)
    };
    let found = Fluctuation::ALL.map(|cause| {
        let scatter = scored(readings, dark, &Scatter { cause, ..steady.clone() });
        (cost(&scatter), scatter)
    });
    let [first, others @ ..] = found;
    let (least, scatter) =
        others.into_iter().fold(first, |best, other| if other.0 < best.0 { other } else { best });
    (cost(steady) - least > FLUCTUATION_SHOWN.get()).then_some(scatter)
}

/// The likeliest scatter by driven and dark readings, starting from a steady one.
fn scored(readings: &[Pair], dark: &DarkReadings, steady: &Scatter) -> Scatter {
    let mut scatter = steady.clone();
    for round in 0..ROUNDS {
        let squares = scatter.squares();
        let (mut slope, mut information) = (Vector3::zeros(), Matrix3::zeros());
        for pair in readings {
            let (variance, by) = pair.variance_and_slopes(squares, scatter.cause);
            let by = Vector3::from(by) / variance;
            slope += 0.5 * (pair.square() / variance - 1.0) * by;
            information += 0.5 * by * by.transpose();
        }
        let (of_silence, known) = dark.slope_and_information(scatter.additive);
        slope[1] += of_silence;
        information[(1, 1)] += known;
        let Some(step) = information.cholesky().map(|cholesky| cholesky.solve(&slope)) else {
            break;
        };
        let next = |n: usize| {
            let (least, most) = (squares[n] / MOST_CHANGE, squares[n] * MOST_CHANGE);
            match n == 2 && round == 0 {
                true => step[n].max(0.0),
                false => (squares[n] + step[n]).clamp(least, most),
            }
        };
        scatter.share = next(0).sqrt();
        scatter.additive = next(1).sqrt();
        scatter.fluctuation = next(2).sqrt();
        if scatter.fluctuation == 0.0 {
            break;
        }
    }
    scatter
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::reading_pairs::{Compression, Detector, Level};
    use fieldgap_virtual_rig::counter_rng::CounterRng;

    const SHARE: f64 = 0.02;
    const ADDITIVE: f64 = 0.005;

    /// Readings from 0.08 to 1, far above noise and speckle of a mean square of 0.01 t² in each quadrature, as differences from what they
    /// should be, and dark readings.
    fn drawn(turbulence: f64) -> (Vec<Pair>, DarkReadings) {
        let rng = CounterRng::new(7);
        let dark: Vec<f64> =
            (0..64).map(|n| ADDITIVE * rng.normal(2 * n).hypot(rng.normal(2 * n + 1))).collect();
        let pairs = (0..5000u64).map(|n| {
            let reading = 0.08 * 12.5f64.powf(n as f64 / 5000.0);
            let level = Level {
                reading,
                by_turbulence: [0.01; 2],
                by_jitter: [0.0; 2],
                compression: Compression::NONE,
            };
            let variance = (SHARE * reading).powi(2) + ADDITIVE.powi(2) + 0.01 * turbulence.powi(2);
            Pair::new(
                level,
                1.0,
                Detector::default(),
                (2.0 * variance).sqrt() * rng.normal(1000 + n),
            )
        });
        (pairs.collect(), DarkReadings::of(&dark, 1.0).expect("enough"))
    }

    #[test]
    fn turbulence_is_told_from_noise_that_silence_knows() {
        let (pairs, dark) = drawn(0.1);
        // The fit of steady noise to the same readings: more than the dark readings show.
        let steady = Scatter { share: SHARE, additive: 0.0105, ..Scatter::default() };
        let found = fluctuating(&pairs, &dark, &steady).expect("it is seen");
        assert!((found.fluctuation / 0.1 - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.additive / ADDITIVE - 1.0).abs() < 0.2, "{found:?}");
        assert!((found.share / SHARE - 1.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn steady_noise_asks_for_none() {
        let (pairs, dark) = drawn(0.0);
        let steady = Scatter { share: SHARE, additive: ADDITIVE, ..Scatter::default() };
        assert_eq!(fluctuating(&pairs, &dark, &steady), None);
    }
}
