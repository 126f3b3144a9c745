//! The main lobe along one arm of a cross.

use fieldgap_acoustics::least_squares::{Linearisation, Parameter, Stopping, minimise};

/// Fewest readings for a fit: three parameters, and three more to estimate the scatter.
const FEWEST: usize = 6;

/// Smallest ratio of the level of a lobe to the scatter of the readings.
const OVER_SCATTER: f64 = 5.0;

/// The main lobe along a straight arm: `level · exp(-(s - centre)² / 2 width²)`.
///
/// Near its peak any lobe has this shape. Deviations are the same on both sides and do not shift the centre, as long as the
/// arm extends equally far to either side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobe {
    /// Position of the peak along the arm, m.
    pub centre_m: f64,
    /// Standard error of `centre_m`, m, from the scatter about the fitted lobe.
    pub centre_error_m: f64,
    /// Width (standard deviation of the Gaussian), m.
    pub width_m: f64,
    /// Level at the peak, in the receiver's unit.
    pub level: f64,
}

/// Why no lobe could be fitted.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LobeFault {
    /// Too few readings.
    #[error("{0} readings are too few for a fit; at least {FEWEST} are needed")]
    TooFew(usize),
    /// The readings show no peak.
    #[error("the level along the arm has no peak: it lies between {least:.4} and {largest:.4}")]
    NoTop {
        /// The lowest reading.
        least: f64,
        /// The highest.
        largest: f64,
    },
}

/// Fits a lobe to readings along an arm, given as (position in m, level), by unweighted least squares.
///
/// # Errors
/// [`LobeFault`] if there are too few readings or they show no lobe.
pub fn fit_lobe(readings: &[(f64, f64)]) -> Result<Lobe, LobeFault> {
    if readings.len() < FEWEST {
        return Err(LobeFault::TooFew(readings.len()));
    }
    let (least, largest) = readings
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |range, r| (range.0.min(r.1), range.1.max(r.1)));
    let none = LobeFault::NoTop { least, largest };
    let &(top_m, top) = readings.iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("there are some");
    let length_m = (readings[readings.len() - 1].0 - readings[0].0).abs();
    let free = |start: f64, scale: f64| Parameter { start, scale, prior: None, range: None };
    if !(top > 0.0 && length_m > 0.0 && top.is_finite()) {
        return Err(none);
    }
    let parameters =
        [free(top, top), free(top_m, length_m / 10.0), free(length_m / 2.0, length_m / 10.0)];
    let residuals = |at: &[f64]| -> Vec<f64> {
        readings.iter().map(|&(place_m, level)| gaussian(at, place_m).0 - level).collect()
    };
    let fit = minimise(&parameters, Stopping::default(), residuals, |at| {
        let mut columns = vec![Vec::new(); 3];
        let mut residuals = Vec::with_capacity(readings.len());
        for &(place_m, level) in readings {
            let (value, slopes) = gaussian(at, place_m);
            residuals.push(value - level);
            for (column, slope) in columns.iter_mut().zip(slopes) {
                column.push(slope);
            }
        }
        Linearisation { residuals, columns }
    });
    let freedom = (readings.len() - parameters.len()) as f64;
    let scatter = (fit.cost / freedom).sqrt();
    let variance = fit.covariance.as_ref().map(|covariance| covariance[(1, 1)]).ok_or(none)?;
    let lobe = Lobe {
        centre_m: fit.parameters[1],
        centre_error_m: variance.sqrt() * scatter,
        width_m: fit.parameters[2].abs(),
        level: fit.parameters[0],
    };
    let rises = (largest - least) > OVER_SCATTER * scatter && lobe.level > OVER_SCATTER * scatter;
    // A slope without a peak gives a Gaussian that is far away or very wide.
    let within = (lobe.centre_m - top_m).abs() < length_m && lobe.width_m < 2.0 * length_m;
    if rises && within && lobe.centre_error_m.is_finite() { Ok(lobe) } else { Err(none) }
}

/// The Gaussian at a position, and its derivatives by level, centre and width.
fn gaussian(at: &[f64], place_m: f64) -> (f64, [f64; 3]) {
    let (level, away, width) = (at[0], place_m - at[1], at[2]);
    let shape = (-0.5 * (away / width).powi(2)).exp();
    let value = level * shape;
    (value, [shape, value * away / width.powi(2), value * away.powi(2) / width.powi(3)])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    /// |sinc| with its first null at 13.6 mm: the lobe of a straight aperture of 63 mm at 100 mm and 40 kHz.
    fn aperture_lobe(away_m: f64) -> f64 {
        let x = std::f64::consts::PI * away_m / 13.6e-3;
        if x == 0.0 { 1.0 } else { (x.sin() / x).abs() }
    }

    fn arm(centre_m: f64, mut reading: impl FnMut(f64) -> f64) -> Vec<(f64, f64)> {
        (-7..=7)
            .map(|step| centre_m + f64::from(step) * 1e-3)
            .map(|at_m| (at_m, reading(at_m)))
            .collect()
    }

    #[test]
    fn the_lobe_of_an_aperture_has_its_centre_where_it_is() {
        let lobe = fit_lobe(&arm(3e-3, |at_m| 2.0 * aperture_lobe(at_m - 3e-3))).expect("a lobe");
        assert!((lobe.centre_m - 3e-3).abs() < 1e-9, "{lobe:?}");
        assert!((lobe.level - 2.0).abs() < 0.03, "{lobe:?}");
    }

    #[test]
    fn standard_errors_are_those_of_many_draws() {
        let noise = Normal::new(0.0, 0.02).expect("a normal");
        let mut draws = ChaCha8Rng::seed_from_u64(7);
        let bell_mm = |at_m: f64| (-0.5 * (at_m / 6e-3).powi(2)).exp();
        let lobes: Vec<Lobe> = (0..400)
            .map(|_| fit_lobe(&arm(0.0, |at_m| bell_mm(at_m) + noise.sample(&mut draws))))
            .map(|lobe| lobe.expect("a lobe"))
            .collect();
        let count = lobes.len() as f64;
        let spread = (lobes.iter().map(|lobe| lobe.centre_m.powi(2)).sum::<f64>() / count).sqrt();
        let told = lobes.iter().map(|lobe| lobe.centre_error_m).sum::<f64>() / count;
        assert!((told / spread - 1.0).abs() < 0.1, "{told} told, {spread} seen");
    }

    #[test]
    fn readings_without_a_peak_give_no_lobe() {
        assert_eq!(fit_lobe(&[(0.0, 1.0); 5]), Err(LobeFault::TooFew(5)));
        assert!(fit_lobe(&arm(0.0, |_| 0.0)).is_err());
        let noise = Normal::<f64>::new(0.01, 0.01).expect("a normal");
        let mut draws = ChaCha8Rng::seed_from_u64(1);
        let found =
            (0..200).filter(|_| fit_lobe(&arm(0.0, |_| noise.sample(&mut draws).abs())).is_ok());
        assert!(found.count() < 4, "noise is hardly ever taken for a lobe");
    }

    proptest! {
        #[test]
        fn a_lobe_off_the_arms_middle_is_found(offset_mm in -4.0..4.0f64, width_mm in 3.0..9.0f64, level in 0.01..10.0f64) {
            let (centre_m, width_m) = (offset_mm * 1e-3, width_mm * 1e-3);
            let shape = |at_m: f64| level * (-0.5 * ((at_m - centre_m) / width_m).powi(2)).exp();
            let lobe = fit_lobe(&arm(0.0, shape)).expect("a lobe");
            prop_assert!((lobe.centre_m - centre_m).abs() < 1e-7, "{:?}", lobe);
            prop_assert!((lobe.width_m - width_m).abs() < 1e-6);
        }

        #[test]
        fn no_readings_make_it_panic(readings in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 0..20)) {
            let _ = fit_lobe(&readings);
        }
    }
}
