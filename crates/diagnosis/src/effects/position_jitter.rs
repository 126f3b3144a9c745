//! The robot's position scatters at random from reading to reading: a normal displacement along each axis, new for every reading.
//!
//! Loose belts, a vibrating frame and missed microsteps displace the nozzle by some hundredths to some tenths of a millimetre. A reading
//! at x is |p(x + δ)| with normal δ of standard deviations σ. Its mean and its scatter follow from the mean of p, of |p|² and of p² over
//! the displacement. Each is taken along one axis at a time by Gauss and Hermite's rule of three points, 0 and ±√3 σ with weights
//! 2/3 and 1/6 (Abramowitz and Stegun, section 25.4.46), which is exact for polynomials up to the fifth degree; what depends on two
//! axes at once is left out, of the order of (k σ)⁴.
//!
//! It is fitted as the variances σ², mm², in which it is linear when small; slightly negative ones stand for the noise of that
//! estimate.

use fieldgap_acoustics::{Simulator, Vec3};
use num_complex::Complex64;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, FieldAt, Finding, Parameter, PerElement, Stage,
    Timing,
};
use crate::model::instance::Setting;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;
use crate::statistics::fluctuation::Fluctuation;
use crate::statistics::scatter::Scatter;

/// The effect.
pub(crate) struct PositionJitter;

impl Effect for PositionJitter {
    fn id(&self) -> EffectId {
        EffectId::PositionJitter
    }

    fn parameters(&self) -> &'static [Parameter] {
        const AXIS: Parameter =
            Parameter { neutral: 0.0, scale: 2e-3, least: -0.02, most: MOST_VARIANCE_MM2 };
        &[AXIS, AXIS, AXIS]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Turbulence],
            independent_check: Some(
                "a dial gauge at one place, approached repeatedly, measures the scatter",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "tighten the robot's belts and screws, damp vibrations, and scan more slowly",
        )
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        [0.05f64, 0.2].map(|sigma_mm| vec![sigma_mm * sigma_mm; 3]).to_vec()
    }

    /// It changes how readings scatter, too, which no slope says.
    fn begins_flat(&self, _context: &Context) -> bool {
        true
    }

    fn scatters_repeats(&self) -> bool {
        true
    }

    fn changes_scatter(&self, at: Setting<'_>) -> bool {
        at.values.iter().any(|variance_mm2| *variance_mm2 != 0.0)
    }

    /// Along x and y: a displacement along z hardly changes a magnitude.
    fn fluctuation(&self, values: &[f64], _choice: &Choice) -> Option<(f64, Fluctuation)> {
        Some(((0.5 * (values[0] + values[1])).max(0.0).sqrt(), Fluctuation::OfPosition))
    }

    fn most(&self, scatter: &Scatter, _context: &Context) -> Vec<f64> {
        // Repeats bound the mean of both variances.
        vec![2.0 * scatter.most_jitter_mm.powi(2); 2]
    }

    fn scattered_position(
        &self,
        at: Setting<'_>,
        points_m: &[Vec3],
        field: &FieldAt<'_>,
    ) -> Option<Vec<Pressure>> {
        if !self.changes_scatter(at) {
            return None;
        }
        let here = field(points_m);
        let mut means: Vec<Moments> = here.iter().map(Moments::of).collect();
        for (axis, variance_mm2) in at.values.iter().enumerate() {
            let step_m = Vec3::ith(axis, 1e-3 * (3.0 * variance_mm2.abs()).sqrt());
            // A negative variance takes away what a positive one adds.
            let weight = variance_mm2.signum() / 6.0;
            for side in [-1.0, 1.0] {
                let displaced: Vec<Vec3> =
                    points_m.iter().map(|at_m| at_m + side * step_m).collect();
                for ((mean, there), here) in means.iter_mut().zip(field(&displaced)).zip(&here) {
                    mean.add(weight, &there, here);
                }
            }
        }
        Some(means.iter().map(Moments::pressure).collect())
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _context: &Context) -> Finding {
        let [x, y, z] = [0, 1, 2].map(|axis| deviation_mm(fitted[axis]));
        let sentence = format!(
            "the robot's position scatters from reading to reading by {:.3} ± {:.3} mm along x, {:.3} ± {:.3} along y and {:.3} ± {:.3} along z",
            x.value, x.error, y.value, y.error, z.value, z.error
        );
        Finding::new([("x_mm", x.real()), ("y_mm", y.real()), ("z_mm", z.real())], sentence)
    }
}

/// Largest plausible variance, mm²: a robot that scatters by more than two millimetres is broken.
const MOST_VARIANCE_MM2: f64 = 4.0;

/// A variance, mm², as a standard deviation, mm. Where the variance is not told from zero, its root's error is that of a deviation as
/// large as the variance's own error allows.
fn deviation_mm(variance_mm2: Estimate) -> Estimate {
    let value = variance_mm2.value.max(0.0).sqrt();
    let error = match variance_mm2.value > variance_mm2.error {
        true => 0.5 * variance_mm2.error / value,
        false => variance_mm2.error.sqrt(),
    };
    Estimate { value, error }
}

/// Means over the displacement: of the pressure, of its squared magnitude, and of its square.
#[derive(Clone, Copy)]
struct Moments {
    pressure: Complex64,
    power: f64,
    square: Complex64,
}

impl Moments {
    fn of(pressure: &Pressure) -> Self {
        let coherent = pressure.coherent;
        Self {
            pressure: coherent,
            power: coherent.norm_sqr() + pressure.speckle,
            square: coherent * coherent + pressure.speckle_square,
        }
    }

    fn add(&mut self, weight: f64, there: &Pressure, here: &Pressure) {
        let (there, here) = (Self::of(there), Self::of(here));
        self.pressure += weight * (there.pressure - here.pressure);
        self.power += weight * (there.power - here.power);
        self.square += weight * (there.square - here.square);
    }

    fn pressure(&self) -> Pressure {
        let coherent = self.pressure;
        Pressure {
            coherent,
            speckle: self.power - coherent.norm_sqr(),
            speckle_square: self.square - coherent * coherent,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    /// Repeats bound the mean of both variances: along one axis alone the place may scatter by as much as makes that mean.
    #[test]
    fn along_one_axis_a_place_may_scatter_by_all_that_repeats_allow() {
        let bench = Bench::new();
        let scatter = Scatter { most_jitter_mm: 0.3, ..Scatter::default() };
        let most = PositionJitter.most(&scatter, &bench.context);
        for alone in [[most[0], 0.0, 0.0], [0.0, most[1], 0.0]] {
            let found = PositionJitter.fluctuation(&alone, &Choice::None).expect("it scatters").0;
            assert!((found - 0.3).abs() < 1e-12, "{found}");
        }
    }

    /// |a + b x|² has the mean |a|² + |b|² σ²; a plane wave exp(ikx) has the mean exp(-k² σ²/2).
    #[test]
    fn a_linear_field_scatters_by_its_slope_and_a_plane_wave_fades() {
        let bench = Bench::new();
        let scattered = |values: &[f64], field: &FieldAt<'_>| {
            let at = bench.at(values);
            PositionJitter.scattered_position(at, &[Vec3::zeros()], field).expect("it scatters")[0]
        };
        let linear = |points: &[Vec3]| -> Vec<Pressure> {
            let at = |p: &Vec3| Pressure::steady(Complex64::new(1.0, 300.0 * p.x - 100.0 * p.y));
            points.iter().map(at).collect()
        };
        let found = scattered(&[0.04, 0.01, 1.0], &linear);
        assert!((found.coherent - 1.0).norm() < 1e-12);
        let variance = (300.0 * 0.2e-3f64).powi(2) + (100.0 * 0.1e-3f64).powi(2);
        let [along, across] = found.speckle_along_and_across();
        assert!(along.abs() < 1e-12 && (across / variance - 1.0).abs() < 1e-6, "{along} {across}");
        let wave = |points: &[Vec3]| -> Vec<Pressure> {
            points.iter().map(|p| Pressure::steady(Complex64::cis(732.0 * p.x))).collect()
        };
        let found = scattered(&[0.04, 0.0, 0.0], &wave);
        let faded = (-0.5 * (732.0 * 0.2e-3f64).powi(2)).exp();
        assert!((found.coherent.re - faded).abs() < 1e-6, "{found:?}");
        // What fades turns up again as scatter: the magnitude itself is the same everywhere.
        assert!((found.coherent.norm_sqr() + found.speckle - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_variance_that_is_not_told_from_zero_has_the_error_that_its_own_error_allows() {
        let told = deviation_mm(Estimate { value: 0.04, error: 0.004 });
        assert!((told.value - 0.2).abs() < 1e-12 && (told.error - 0.01).abs() < 1e-12);
        let not_told = deviation_mm(Estimate { value: -1e-4, error: 0.01 });
        assert_eq!((not_told.value, not_told.error), (0.0, 0.1));
    }
}
