//! Whether a few readings are farther off than a set expects.
//!
//! The kurtosis of the residuals tells. Where the field fluctuates by as much as its own level, a magnitude is not normal: between lobes it has Rayleigh's
//! distribution. So the kurtosis is compared with that of readings which are drawn from the set itself (a parametric bootstrap: B. Efron and R. J. Tibshirani,
//! *An Introduction to the Bootstrap*, 1993, section 6.5). The residuals are in proportion to the readings, since those of a logarithm have a long tail below.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::fit::joint_fit::Fit;
use crate::model::effect::Context;
use crate::model::observations::{Observations, ObservedScan, Visit};
use crate::model::pressure::Pressure;
use crate::statistics::significance::z_of_kurtosis;

/// Sets of readings that are drawn: their mean and standard deviation are then known to a tenth of the latter.
const DRAWS: u64 = 60;

/// A reading and what a set expects of it.
struct Reading<'o> {
    scan: &'o ObservedScan,
    visit: &'o Visit,
    /// The pressure times the gain.
    level: Pressure,
    reading: f64,
    mean: f64,
    deviation: f64,
}

/// The deviate of the kurtosis of the residuals of a fit beside that of readings drawn from it; of readings that end at a full scale, beside that of normal ones.
pub(super) fn z_of_few_far(fit: &Fit, observations: &Observations, context: &Context) -> f64 {
    let model = fit.model(context);
    let levels = model.levels(observations, &fit.nuisance);
    let scans = observations.scans.iter();
    let drives = scans.flat_map(|scan| scan.drives.iter().map(move |drive| (scan, drive)));
    let readings = drives.flat_map(|(scan, drive)| {
        drive
            .visits
            .iter()
            .zip(&drive.readings)
            .map(move |(visit, reading)| (scan, visit, *reading))
    });
    let readings: Vec<Reading<'_>> = readings
        .zip(levels)
        .map(|((scan, visit, reading), level)| {
            let expected = model.expected(&level, 1.0, visit.progress, scan);
            let ratio = (expected.variance_ratio * visit.variance).sqrt();
            let deviation = scan.scale.deviation(expected.reading) * ratio;
            Reading { scan, visit, level, reading, mean: expected.reading, deviation }
        })
        .collect();
    let observed = readings.iter().map(|one| (one.reading - one.mean) / one.deviation);
    let observed = z_of_kurtosis(&observed.collect::<Vec<f64>>());
    if model.clips() {
        return observed;
    }
    let drawn = |seed: u64| {
        let mut lots = StandardNormal.sample_iter(ChaCha8Rng::seed_from_u64(seed));
        let residuals = readings.iter().map(|one| {
            let lots = std::array::from_fn(|_| lots.next().expect("without end"));
            let reading = model.drawn(&one.level, one.visit.progress, one.scan, lots);
            (reading - one.mean) / one.deviation
        });
        z_of_kurtosis(&residuals.collect::<Vec<f64>>())
    };
    let drawn: Vec<f64> = (0..DRAWS).into_par_iter().map(drawn).collect();
    let mean = drawn.iter().sum::<f64>() / DRAWS as f64;
    let variance = drawn.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / (DRAWS - 1) as f64;
    // Of normal readings the deviate is normal already.
    (observed - mean) / variance.sqrt().max(1.0)
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Array, Excitation, Vec3};

    use super::*;
    use crate::effect_id::EffectId;
    use crate::effects::effect;
    use crate::effects::testing::{Bench, nuisance};
    use crate::effects::turbulence;
    use crate::model::instance::Instance;

    /// Readings of a field with a random part in both quadratures, then one in a hundred of them five times as large.
    #[test]
    fn strong_turbulence_is_not_a_few_readings_far_off() {
        const RAD: f64 = 2.0;
        let bench = Bench::of(Array::square(8, 8, 10e-3).expect("not empty"), Excitation::Uniform);
        let places = (0..1600).map(|n| {
            let (x, y, z) = (n % 20, n / 20 % 20, n / 400);
            Vec3::new(f64::from(x) - 9.5, f64::from(y) - 9.5, f64::from(z))
                .component_mul(&Vec3::new(6e-3, 6e-3, 20e-3))
                + Vec3::z() * 0.1
        });
        let places: Vec<Vec3> = places.collect();
        let mut observations = bench.observations(&[(Excitation::Uniform, places.clone())]);
        let instance =
            Instance { effect: effect(EffectId::Turbulence), choice: turbulence::OF_PATHS };
        let fit = Fit {
            instances: vec![instance],
            values: vec![vec![RAD]],
            spreads: vec![f64::NAN],
            ..Fit::of_nothing(vec![nuisance()])
        };
        let model = fit.model(&bench.context);
        let levels = model.levels(&observations, &fit.nuisance);
        let mut random = StandardNormal.sample_iter(ChaCha8Rng::seed_from_u64(4));
        let scan = &mut observations.scans[0];
        for (n, level) in levels.iter().enumerate() {
            // By the central limit theorem normal in both quadratures, of different widths.
            let [along, across] = level.speckle_along_and_across().map(|square: f64| {
                let lot: f64 = random.next().expect("without end");
                square.sqrt() * lot
            });
            let lots: [f64; 3] = std::array::from_fn(|_| random.next().expect("without end"));
            let magnitude =
                (level.coherent.norm() + along + 0.01 * lots[0]).hypot(across + 0.01 * lots[1]);
            let reading = magnitude * (1.0 + 0.02 * lots[2]);
            scan.drives[0].readings[n] = reading;
            scan.drives[0].stabilised[n] = scan.scale.of(reading);
        }
        let z = |observations: &Observations| z_of_few_far(&fit, observations, &bench.context);
        // On the scale of the residuals, on which strong turbulence has a long tail, normal numbers would be as rare as these.
        let pressures = model.pressures(&observations, &fit.nuisance);
        let residuals = model.residuals(&observations, &pressures, &fit.nuisance).scaled;
        assert!(z_of_kurtosis(&residuals) > 4.0);
        assert!(z(&observations).abs() < 3.0, "{}", z(&observations));
        let scan = &mut observations.scans[0];
        for n in (0..1600).step_by(100) {
            scan.drives[0].readings[n] *= 5.0;
            scan.drives[0].stabilised[n] = scan.scale.of(scan.drives[0].readings[n]);
        }
        assert!(z(&observations) > 4.0, "{}", z(&observations));
    }
}
