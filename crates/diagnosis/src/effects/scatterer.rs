//! A rigid ball in the field scatters the waves of all elements.
//!
//! The wave of an element is taken for that of a point with the pressure that the element has at the ball: [`rigid_ball`](super::rigid_ball).

use fieldgap_acoustics::{Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::effects::rigid_ball::ScatteredWave;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search, Stage,
    SurroundingField, Timing,
};
use crate::model::instance::Setting;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Scatterer;

/// Place of the ball's centre, mm.
const PLACE: Parameter = Parameter { neutral: 0.0, scale: 0.05, least: -400.0, most: 400.0 };

impl Scatterer {
    /// A ball whose scattered wave has this strength, the pressure at one metre over the incident one, m.
    pub fn of_strength(at_m: Vec3, strength_m: f64, wavenumber_rad_m: f64) -> Vec<f64> {
        // A large ball scatters as half its radius; a small one as k²a³/2 sidewards (Morse and Ingard).
        let large_m = 2.0 * strength_m;
        let small_m = (2.0 * strength_m / wavenumber_rad_m.powi(2)).cbrt();
        let at_mm = 1e3 * at_m;
        vec![at_mm.x, at_mm.y, at_mm.z, 1e3 * large_m.max(small_m).min(0.03)]
    }
}

impl Effect for Scatterer {
    fn id(&self) -> EffectId {
        EffectId::Scatterer
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[PLACE, PLACE, PLACE, Parameter { neutral: 0.0, scale: 0.05, least: 0.05, most: 40.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[],
            independent_check: Some("look for an object in the path of the sound, and remove it"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual("the simulators model a free field only; remove the object")
    }

    fn search(&self) -> Search {
        Search::Objects
    }

    fn added_waves(
        &self,
        at: Setting<'_>,
        field: &dyn SurroundingField,
        pressures: &mut [Pressure],
    ) {
        let centre_m = 1e-3 * Vec3::new(at.values[0], at.values[1], at.values[2]);
        let radius_m = 1e-3 * at.values[3];
        let sources = field.waves_at(&centre_m);
        ScatteredWave::new(centre_m, radius_m, field.wavenumber_rad_m(), &sources)
            .add_to(pressures, field.points_m());
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [x, y, z, radius] = [fitted[0], fitted[1], fitted[2], fitted[3]];
        let sentence = format!(
            "an object scatters like a rigid ball of {:.2} ± {:.2} mm radius at ({:.1}, {:.1}, {:.1}) mm in the array's frame",
            radius.value, radius.error, x.value, y.value, z.value
        );
        Finding::new(
            [
                ("x_mm", x.real()),
                ("y_mm", y.real()),
                ("z_mm", z.real()),
                ("radius_mm", radius.real()),
            ],
            sentence,
        )
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::mirror::Mirror;

    /// One source and some places.
    struct Beside {
        source_m: Vec3,
        points_m: Vec<Vec3>,
    }

    const K: f64 = 733.0;

    impl SurroundingField for Beside {
        fn points_m(&self) -> &[Vec3] {
            &self.points_m
        }
        fn wavenumber_rad_m(&self) -> f64 {
            K
        }
        fn images(&self, _mirror: &Mirror) -> Vec<Complex64> {
            Vec::new()
        }
        fn waves_at(&self, at_m: &Vec3) -> Vec<(Vec3, Complex64)> {
            let distance_m = (at_m - self.source_m).norm();
            vec![(self.source_m, Complex64::cis(K * distance_m) / distance_m)]
        }
    }

    fn scattered(source_m: Vec3, points_m: Vec<Vec3>, radius_mm: f64) -> Vec<Complex64> {
        let bench = Bench::new();
        let mut pressures = vec![Pressure::steady(Complex64::ZERO); points_m.len()];
        let field = Beside { source_m, points_m };
        Scatterer.added_waves(bench.at(&[0.0, 0.0, 0.0, radius_mm]), &field, &mut pressures);
        pressures.iter().map(|pressure| pressure.coherent).collect()
    }

    /// On the surface of a rigid ball the air does not move: the slopes of both waves along the radius cancel.
    #[test]
    fn the_air_stands_still_at_the_surface() {
        let (radius_mm, step_m) = (5.0, 1e-6);
        let source_m = Vec3::new(0.0, 0.02, -0.06);
        for direction in [Vec3::z(), -Vec3::z(), Vec3::new(0.6, 0.0, 0.8), Vec3::y()] {
            let at_m = |beyond: f64| direction * (1e-3 * radius_mm + beyond);
            let [near, far] = [1.0, 3.0].map(|n| at_m(n * step_m));
            let incident = |at_m: Vec3| {
                let distance_m = (at_m - source_m).norm();
                Complex64::cis(K * distance_m) / distance_m
            };
            let waves = scattered(source_m, vec![near, far], radius_mm);
            let slope = |near: Complex64, far: Complex64| (far - near) / (2.0 * step_m);
            let [of_incident, of_scattered] =
                [slope(incident(near), incident(far)), slope(waves[0], waves[1])];
            let left = (of_incident + of_scattered).norm();
            assert!(left < 0.01 * K * incident(near).norm(), "{direction}: {left}");
        }
    }

    /// Far from a small ball, and far from the source, the scattered wave is k²a³/3 (1 - 3/2 cos θ) of the incident one over the distance, in opposite phase, with θ the
    /// angle by which it is deflected (Rayleigh; Morse and Ingard, eq. 8.2.18).
    #[test]
    fn a_small_ball_scatters_as_rayleigh_says() {
        let (radius_m, far_m) = (1e-4, 30.0);
        for theta in [0.0, 1.0, 2.0, 3.1f64] {
            let at_m = Vec3::new(theta.sin(), 0.0, theta.cos()) * far_m;
            let source_m = -Vec3::z() * far_m;
            let wave = scattered(source_m, vec![at_m], 1e3 * radius_m)[0];
            let incident = Complex64::cis(K * far_m) / far_m;
            let strength = -K * K * radius_m.powi(3) / 3.0 * (1.0 - 1.5 * theta.cos());
            let expected = incident * strength * Complex64::cis(K * far_m) / far_m;
            assert!(
                (wave - expected).norm() < 0.01 * expected.norm(),
                "{theta}: {wave} {expected}"
            );
        }
    }
}
