//! A plane anywhere beside the field returns an image of the array (Pierce, *Acoustics*, section 1-4): a wall, a rail, a screen.
//!
//! A shift of the plane mainly turns the phase of the image. The fit works on the coefficient with the turn over the path from the image of the array's
//! centre to the middle of the field taken out.

use fieldgap_acoustics::{Simulator, Vec3};
use num_complex::Complex64;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search, Stage,
    SurroundingField, Timing,
};
use crate::model::instance::Setting;
use crate::model::mirror::Mirror;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Wall;

const PART: Parameter = Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 };

/// Azimuth and elevation of a plane's normal, rad, and its distance, mm.
fn mirror(values: &[f64]) -> Mirror {
    let ((sin, cos), (up, across)) = (values[0].sin_cos(), values[1].sin_cos());
    Mirror { normal: Vec3::new(across * cos, across * sin, up), distance_m: 1e-3 * values[2] }
}

/// The turn of an image's phase on its way to the middle of the field.
fn turn(mirror: &Mirror, context: &Context) -> Complex64 {
    let middle_m = Vec3::z() * 0.7 * context.highest_m;
    let way_m = (middle_m - mirror.of_place(&Vec3::zeros())).norm();
    Complex64::cis(context.believed.medium.wavenumber_rad_m(context.believed.frequency_hz) * way_m)
}

impl Wall {
    /// The plane whose normal has this azimuth and elevation, rad, at a distance from the array's centre.
    pub fn facing(direction: [f64; 2], distance_m: f64) -> Mirror {
        mirror(&[direction[0], direction[1], 1e3 * distance_m])
    }

    /// That plane, which returns so much, as the numbers that a fit works on.
    pub fn returning(
        [azimuth_rad, elevation_rad]: [f64; 2],
        distance_m: f64,
        coefficient: Complex64,
        context: &Context,
    ) -> Vec<f64> {
        let mut values = vec![azimuth_rad, elevation_rad, 1e3 * distance_m];
        let turned = coefficient * turn(&mirror(&values), context);
        values.extend([turned.re, turned.im]);
        values
    }
}

impl Effect for Wall {
    fn id(&self) -> EffectId {
        EffectId::Wall
    }

    /// Beyond an elevation of 0.9 rad it is a plane above the field.
    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.002, least: -7.0, most: 7.0 },
            Parameter { neutral: 0.0, scale: 0.002, least: -0.9, most: 0.9 },
            Parameter { neutral: 0.0, scale: 0.05, least: 1.0, most: 1500.0 },
            PART,
            PART,
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[],
            independent_check: Some("a board of foam in front of the wall changes the readings"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators model a free field only; cover the wall with absorber, or move the array away from it",
        )
    }

    fn search(&self) -> Search {
        Search::Walls
    }

    fn added_waves(
        &self,
        at: Setting<'_>,
        field: &dyn SurroundingField,
        pressures: &mut [Pressure],
    ) {
        let mirror = mirror(at.values);
        let turned = Complex64::new(at.values[3], at.values[4]);
        let coefficient = turned * turn(&mirror, at.context).conj();
        for (pressure, image) in pressures.iter_mut().zip(field.images(&mirror)) {
            pressure.coherent += coefficient * image;
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, believed: &Context) -> Finding {
        let values: Vec<f64> = fitted.iter().map(|estimate| estimate.value).collect();
        let mirror = mirror(&values);
        let turned = Complex64::new(values[3], values[4]);
        let value = turned * turn(&mirror, believed).conj();
        let size = value.norm();
        // The turn by the error of the distance is one at right angles to the coefficient.
        let size_error = (values[3] * fitted[3].error).hypot(values[4] * fitted[4].error)
            / size.max(f64::MIN_POSITIVE);
        let wavenumber = believed.believed.medium.wavenumber_rad_m(believed.believed.frequency_hz);
        let across = (fitted[3].error.hypot(fitted[4].error) / std::f64::consts::SQRT_2)
            .hypot(size * 2e-3 * wavenumber * fitted[2].error);
        let unit = value / size.max(f64::MIN_POSITIVE);
        let error = |along: f64, other: f64| (along * size_error).hypot(other * across);
        let coefficient = FittedParameter::Complex {
            value: [value.re, value.im],
            standard_error: [error(unit.re, unit.im), error(unit.im, unit.re)],
        };
        let normal = mirror.normal;
        let sentence = format!(
            "a wall {:.1} ± {:.1} mm from the array's centre, towards ({:.2}, {:.2}, {:.2}), reflects {:.0} % of the pressure",
            values[2],
            fitted[2].error,
            normal.x,
            normal.y,
            normal.z,
            100.0 * size
        );
        let normal = FittedParameter::Each {
            value: normal.iter().copied().collect(),
            standard_error: vec![
                fitted[0].error * normal.y.abs(),
                fitted[0].error * normal.x.abs(),
                fitted[1].error,
            ],
        };
        Finding::new(
            [("normal", normal), ("distance_mm", fitted[2].real()), ("coefficient", coefficient)],
            sentence,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, nuisance, visit};
    use crate::model::forward_model::ForwardModel;
    use crate::model::observations::Visit;

    /// What a perfect wall returns to a place is what the array sends to the image of the place.
    #[test]
    fn a_perfect_wall_adds_the_field_of_the_mirrored_point() {
        let bench = Bench::new();
        let pressure = |model: &ForwardModel<'_>, at_m: Vec3| {
            let visit = Visit { at_m, ..visit() };
            model.pressures_at(bench.believed(), &[visit], &nuisance())[0].coherent
        };
        let values = Wall::returning([0.4, 0.0], 0.07, Complex64::ONE, &bench.context);
        let at_m = Vec3::new(0.01, -0.004, 0.12);
        let walled = pressure(&bench.model(EffectId::Wall, &values), at_m);
        let believed = ForwardModel::believed();
        let normal = Vec3::new(0.4f64.cos(), 0.4f64.sin(), 0.0);
        let image_m = at_m + 2.0 * (0.07 - normal.dot(&at_m)) * normal;
        let expected = pressure(&believed, at_m) + pressure(&believed, image_m);
        assert!((walled - expected).norm() < 1e-6 * expected.norm(), "{walled} {expected}");
    }
}
