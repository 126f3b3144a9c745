//! How well a simulation and a scan agree: gain, correlation, residual.

use super::comparison::Agreement;
use fieldgap_acoustics::least_squares::dot;

/// The gain that brings `simulated` nearest to `readings` in the least-squares sense; zero if nothing is simulated.
pub fn best_gain(simulated: &[f64], readings: &[f64]) -> f64 {
    let power = dot(simulated, simulated);
    if power > 0.0 { dot(simulated, readings) / power } else { 0.0 }
}

/// Pearson's correlation, -1 to 1; zero where one of the two does not vary.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (mean_a, mean_b) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - mean_a, b - mean_b);
        ab += a * b;
        aa += a * a;
        bb += b * b;
    }
    let scale = (aa * bb).sqrt();
    if scale > 0.0 { ab / scale } else { 0.0 }
}

impl Agreement {
    /// Compares readings with what is simulated for them, at a gain.
    pub fn of(simulated: &[f64], readings: &[f64], gain: f64) -> Self {
        let scan_rms = rms(readings.iter().copied());
        let residual =
            |gain: f64| rms(readings.iter().zip(simulated).map(move |(r, s)| r - gain * s));
        let own_gain = best_gain(simulated, readings);
        let residual_rms = residual(gain);
        Self {
            correlation: correlation(simulated, readings),
            residual_rms_ratio: residual_rms / scan_rms,
            residual_rms_ratio_own_gain: residual(own_gain) / scan_rms,
            gain_ratio: own_gain / gain,
            residual_rms,
            scan_rms,
            points: readings.len(),
        }
    }
}

/// Root mean square.
pub(super) fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_scan_that_is_its_simulation_times_a_gain_agrees() {
        let simulated = [1.0, 2.0, 0.5, 3.0];
        let readings = simulated.map(|s| 7.0 * s);
        let agreement = Agreement::of(&simulated, &readings, 7.0);
        assert!((agreement.correlation - 1.0).abs() < 1e-12);
        assert!(agreement.residual_rms_ratio < 1e-12 && (agreement.gain_ratio - 1.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_simulated_leaves_all_of_the_scan() {
        let agreement = Agreement::of(&[0.0; 3], &[1.0, 2.0, 2.0], 1.0);
        assert_eq!((agreement.correlation, agreement.residual_rms_ratio), (0.0, 1.0));
        assert_eq!(best_gain(&[0.0; 3], &[1.0, 2.0, 2.0]), 0.0);
    }

    proptest! {
        #[test]
        fn no_other_gain_leaves_less(
            pairs in prop::collection::vec((0.1..5.0f64, 0.1..5.0f64), 2..30), other in 0.1..10.0f64,
        ) {
            let (simulated, readings): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
            let agreement = Agreement::of(&simulated, &readings, other);
            prop_assert!(agreement.residual_rms_ratio_own_gain <= agreement.residual_rms_ratio + 1e-12);
            prop_assert!(agreement.correlation.abs() <= 1.0 + 1e-12);
        }
    }
}
