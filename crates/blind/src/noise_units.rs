//! The size of a gap: root mean square over the readings, each in standard deviations of its noise.

use nalgebra::{SMatrix, SVector};
use num_complex::Complex64;

use super::causes::Causes;
use super::laboratory::{Laboratory, NoiseOfReadings};
use super::world::World;
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::counter_rng::CounterRng;

/// The shift that remains after a careful set-up, m. A smaller one is no gap.
const SMALL_SHIFT_M: f64 = 0.1e-3;

/// Step of the numerical gradient, m.
const STEP_M: f64 = 0.02e-3;

/// Gain, gain times shift, and turn of the phase, which amplitudes do not have.
type Unknowns = SVector<f64, 5>;
type Normal = SMatrix<f64, 5, 5>;

/// The expected readings of a laboratory without causes, and their gradient.
pub(super) struct Believed {
    /// Numbers of the stops that are used.
    pub chosen: Vec<usize>,
    /// Reading for a field of 1/m, V.
    pub volts: f64,
    readings_v: Vec<Complex64>,
    slopes_v_m: Vec<[Complex64; 3]>,
    noise: NoiseOfReadings,
}

impl Believed {
    /// The field without causes, at the gain that gives the expected peak. `rng` is that of the scan, whose imperfections it draws.
    pub fn new(laboratory: &Laboratory, rng: CounterRng) -> Self {
        let none = Causes::none();
        let world = World::new(laboratory, &none, 1.0, rng);
        let stops = &laboratory.survey.stops;
        let driven = (0..stops.len()).filter(|&n| stops[n].focus.is_some());
        let chosen: Vec<usize> = driven.step_by(laboratory.survey.gap_of_one_in).collect();
        let read_v = |by_m: Vec3, volts: f64| -> Vec<Complex64> {
            let phasors = world.phasors_beside_v(&chosen, by_m).into_iter();
            let read = |(phasor, &n)| world.noiseless_v(&stops[n], volts * phasor);
            phasors.zip(&chosen).map(read).collect()
        };
        let largest = world.phasors_v(&chosen).iter().map(|p| p.norm()).fold(0.0, f64::max);
        let volts = laboratory.peak_v / largest;
        let readings_v = read_v(Vec3::zeros(), volts);
        let beside = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| read_v(STEP_M * axis, volts));
        let slopes_v_m = (0..readings_v.len())
            .map(|n| [0, 1, 2].map(|axis| (beside[axis][n] - readings_v[n]) / STEP_M))
            .collect();
        Self { chosen, volts, readings_v, slopes_v_m, noise: laboratory.noise() }
    }

    /// The gap of the true readings without noise, at the best gain, the best small shift and the best constant phase, in standard
    /// deviations of each reading's noise. Where phases are measured, each reading counts twice: along its phasor and across it.
    pub fn gap(&self, true_v: &[Complex64]) -> f64 {
        let rows = self.rows(true_v);
        // A little more than nothing on the diagonal: amplitudes do not determine the turn.
        let mut matrix = Normal::zeros();
        let mut side = Unknowns::zeros();
        for (row, target) in &rows {
            matrix += row * row.transpose();
            side += row * *target;
        }
        if matrix[(4, 4)] == 0.0 {
            matrix[(4, 4)] = 1.0;
        }
        let residual = |unknowns: Unknowns| {
            let squares = rows.iter().map(|(row, target)| (target - row.dot(&unknowns)).powi(2));
            (squares.sum::<f64>() / rows.len() as f64).sqrt()
        };
        let gain_alone = || side[0] / matrix[(0, 0)];
        let Some(best) = matrix.cholesky().map(|cholesky| cholesky.solve(&side)) else {
            return residual(gain_alone() * Unknowns::ith(0, 1.0));
        };
        let shift_m = best.fixed_rows::<3>(1) / best[0];
        if shift_m.norm() <= SMALL_SHIFT_M {
            return residual(best);
        }
        // Too large: take the largest allowed shift in that direction, and fit gain and turn again.
        let shift_m = shift_m * (SMALL_SHIFT_M / shift_m.norm());
        let gain = Unknowns::from([1.0, shift_m.x, shift_m.y, shift_m.z, 0.0]);
        let turn = Unknowns::ith(4, 1.0);
        let product = |a: &Unknowns, b: &Unknowns| (a.transpose() * matrix * b)[0];
        let (gg, gt, tt) = (product(&gain, &gain), product(&gain, &turn), product(&turn, &turn));
        let (g, t) = (gain.dot(&side), turn.dot(&side));
        let determinant = gg * tt - gt * gt;
        residual(((tt * g - gt * t) * gain + (gg * t - gt * g) * turn) / determinant)
    }

    /// Rows of the least-squares problem and their targets, in standard deviations.
    fn rows(&self, true_v: &[Complex64]) -> Vec<(Unknowns, f64)> {
        let pairs = || self.readings_v.iter().zip(&self.slopes_v_m).zip(true_v);
        // The turn is small once the mean phase is taken out.
        let mean: Complex64 = match self.noise.phase_rad {
            Some(_) => pairs().map(|((believed, _), truly)| believed.conj() * truly).sum(),
            None => Complex64::ZERO,
        };
        let back = Complex64::from_polar(1.0, -mean.arg());
        let mut rows = Vec::with_capacity(2 * true_v.len());
        for ((believed, slopes), truly) in pairs() {
            let (level_v, sigma_v) = (truly.norm(), self.noise.at_v(truly.norm()));
            let Some(across_v) = self.noise.across_v(level_v) else {
                // The gradient of a magnitude: that of the phasor along itself.
                let along =
                    |slope: &Complex64| (slope * believed.conj()).re / believed.norm().max(1e-300);
                let [x, y, z] = [along(&slopes[0]), along(&slopes[1]), along(&slopes[2])];
                let row = Unknowns::from([believed.norm(), x, y, z, 0.0]);
                rows.push((row / sigma_v, level_v / sigma_v));
                continue;
            };
            let turned = Complex64::from_polar(1.0, -(truly * back).arg());
            let own = |v: &Complex64| v * turned;
            let (here, slopes) = (own(believed), slopes.map(|slope| own(&slope)));
            let turn = Complex64::i() * here;
            let part = |of: fn(Complex64) -> f64| {
                Unknowns::from([of(here), of(slopes[0]), of(slopes[1]), of(slopes[2]), of(turn)])
            };
            rows.push((part(|v| v.re) / sigma_v, level_v / sigma_v));
            rows.push((part(|v| v.im) / across_v, 0.0));
        }
        rows
    }
}

/// The gap of a world against the expected readings.
pub(super) fn gap_of(world: &World<'_>, laboratory: &Laboratory, believed: &Believed) -> f64 {
    let phasors_v = world.phasors_v(&believed.chosen);
    let stops = &laboratory.survey.stops;
    let read_v: Vec<Complex64> = believed
        .chosen
        .iter()
        .zip(phasors_v)
        .map(|(&n, phasor_v)| world.noiseless_v(&stops[n], phasor_v))
        .collect();
    believed.gap(&read_v)
}

#[cfg(test)]
mod tests {
    use super::super::random_sequence::RandomSequence;
    use super::super::reception::PhaseReading;
    use super::super::varied;
    use super::*;
    use fieldgap_records::PhaseConvention;

    fn believed() -> (Laboratory, Believed) {
        let laboratory = Laboratory::draw(&mut RandomSequence::new(CounterRng::new(6)));
        let believed = Believed::new(&laboratory, CounterRng::new(0));
        (laboratory, believed)
    }

    #[test]
    fn a_gain_and_a_small_shift_are_no_gap_and_a_larger_shift_is_one() {
        let (laboratory, believed) = believed();
        let shifted = |by_mm: f64| {
            let offset = toml::toml! { x_mm = (by_mm) y_mm = 0.0 z_mm = 0.0 };
            let causes = Causes::of_catalogue(vec![("offset", offset)]);
            // Another gain than the laboratory's.
            let world = World::new(&laboratory, &causes, 1.3 * believed.volts, CounterRng::new(0));
            gap_of(&world, &laboratory, &believed)
        };
        assert!(shifted(0.0) < 1e-9);
        assert!(shifted(0.08) < 0.03, "{}", shifted(0.08));
        assert!(shifted(1.0) > 0.3 && shifted(2.0) > 2.0 * shifted(1.0));
    }

    #[test]
    fn what_a_set_up_has_anyway_is_no_gap_and_a_small_cause_beside_it_is_a_small_one() {
        for seed in 0..12 {
            let mut random = RandomSequence::new(CounterRng::new(seed));
            let mut laboratory = varied::laboratory(&[], &mut random);
            varied::make_imperfect(&mut laboratory, &[], &mut random);
            let rng = CounterRng::new(7);
            let believed = Believed::new(&laboratory, rng);
            let gap = |causes: &Causes| {
                let world = World::new(&laboratory, causes, believed.volts, rng);
                gap_of(&world, &laboratory, &believed)
            };
            assert!(gap(&Causes::none()) < 1e-9, "{seed}");
            let faint = |ratio: f64| {
                gap(&Causes::of_catalogue(vec![("pitch", toml::toml! { ratio = (ratio) })]))
            };
            let (less, more) = (faint(1.0001), faint(1.0002));
            assert!((more / less - 2.0).abs() < 0.1, "{seed}: {less} {more}");
            let ideal = Laboratory { imperfections: Vec::new(), ..laboratory.clone() };
            let ideal = Believed::new(&ideal, rng);
            let none = Causes::none();
            let world = World::new(&laboratory, &none, believed.volts, rng);
            assert!(gap_of(&world, &laboratory, &ideal) > 0.05, "{seed}");
        }
    }

    #[test]
    fn the_phase_of_a_complex_reading_shows_what_its_magnitude_does_not() {
        let (laboratory, magnitudes) = believed();
        let mut complex = laboratory.clone();
        complex.reception.phase = Some(PhaseReading {
            noise_rad: 0.02,
            offset_rad: 1.0,
            drift_rad: 0.0,
            convention: PhaseConvention::MinusIwt,
        });
        let phasors = Believed::new(&complex, CounterRng::new(0));
        let tilted: Vec<Complex64> = phasors
            .readings_v
            .iter()
            .enumerate()
            .map(|(n, v)| v * Complex64::from_polar(1.0, 0.7 + if n % 2 == 0 { 0.1 } else { -0.1 }))
            .collect();
        // Half of the rows are across the phasors: each a sine of 0.1 rad times the level.
        let noise = complex.noise();
        let across = |level: f64| 0.1f64.sin() * level / (0.02 * level).hypot(noise.additive_v);
        let squares = phasors.readings_v.iter().map(|v| across(v.norm()).powi(2));
        let expected = (0.5 * squares.sum::<f64>() / tilted.len() as f64).sqrt();
        let gap = phasors.gap(&tilted);
        assert!((gap / expected - 1.0).abs() < 0.02, "{gap} {expected}");
        assert!(magnitudes.gap(&tilted) < 1e-9);
    }

    #[test]
    fn a_ripple_of_one_deviation_is_a_gap_of_one() {
        let (_, believed) = believed();
        let ripple = |n: usize| if n.is_multiple_of(2) { 1.0 } else { -1.0 };
        let levels = believed.readings_v.iter().map(|v| v.norm()).enumerate();
        let read_v: Vec<Complex64> =
            levels.map(|(n, v)| (v + 0.3 * ripple(n) * believed.noise.at_v(v)).into()).collect();
        assert!((believed.gap(&read_v) - 0.3).abs() < 0.02, "{}", believed.gap(&read_v));
    }
}
