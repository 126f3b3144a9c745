//! Transducer models compared with the Rayleigh integral over a vibrating face, which makes no far-field assumption.

use serde::Serialize;

use fieldgap_acoustics::rayleigh::{DiscRule, Piston};
use fieldgap_acoustics::{Array, Element, Excitation, Medium, Simulation, Simulator, Vec3};

/// Distance on the axis at which models and integral are normalised, metres: the gain is free in every comparison.
const NORMALISED_AT_M: f64 = 0.1;
/// Quadrature error of the integral, from a fifth of a radius on.
const INTEGRAL_TOLERANCE: f64 = 1e-7;
/// Heights on the axis, metres.
const AXIS_M: (f64, f64) = (5e-3, 0.3);
const STEPS: u32 = 118;
/// Distances at which lobes are compared, metres.
pub const LOBE_DISTANCES_M: [f64; 3] = [0.02, 0.1, 0.3];

/// One model and the integral.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelAgainstIntegral {
    /// The simulator with this model.
    pub simulator: Simulator,
    /// Height (m), model and integral on the axis, times the height.
    pub on_axis: Vec<(f64, f64, f64)>,
    /// For each of [`LOBE_DISTANCES_M`]: angle (rad), model and integral relative to the integral on the axis at that distance.
    pub lobes: Vec<Vec<(f64, f64, f64)>>,
}

impl ModelAgainstIntegral {
    /// Largest error on the axis between two heights (metres), relative to the integral.
    pub fn on_axis_error(&self, from_m: f64, to_m: f64) -> f64 {
        let inside = self.on_axis.iter().filter(|(z, ..)| (from_m..=to_m).contains(z));
        inside.map(|(_, model, integral)| (model / integral - 1.0).abs()).fold(0.0, f64::max)
    }

    /// Largest error within an angle (rad), relative to the axis, at a distance of [`LOBE_DISTANCES_M`]. It includes the error
    /// on the axis.
    pub fn lobe_error(&self, distance: usize, within_rad: f64) -> f64 {
        let inside = self.lobes[distance].iter().filter(|(angle, ..)| *angle <= within_rad + 1e-9);
        inside.map(|(_, model, integral)| (model - integral).abs()).fold(0.0, f64::max)
    }
}

/// Every model for a face of a given radius, metres, compared with its integral. The thesis's models describe its own
/// transducer for any radius.
pub fn models_against_integral(
    radius_m: f64,
    medium: Medium,
    frequency_hz: f64,
) -> Vec<ModelAgainstIntegral> {
    let wavenumber = medium.wavenumber_rad_m(frequency_hz);
    let rule = DiscRule::for_piston(wavenumber * radius_m, 1.0, INTEGRAL_TOLERANCE);
    let face = Piston::new(Vec3::zeros(), Vec3::z(), radius_m, &rule);
    let element = Element { radius_m, ..Element::at(0.0, 0.0) };
    [
        Simulator::Corrected,
        Simulator::Gaussian,
        Simulator::MultiGaussian,
        Simulator::Piston,
        Simulator::Rayleigh,
    ]
    .into_iter()
    .map(|simulator| {
        let simulation = Simulation {
            simulator,
            array: Array::from_elements(vec![element]).expect("one element"),
            medium,
            frequency_hz,
            excitation: Excitation::Uniform,
        };
        compared(&simulation, &face, wavenumber)
    })
    .collect()
}

fn compared(simulation: &Simulation, face: &Piston, wavenumber: f64) -> ModelAgainstIntegral {
    let pairs = |points: &[Vec3]| -> Vec<(f64, f64)> {
        let models = simulation.field(points).into_iter().map(|field| field.norm());
        let integrals = points.iter().map(|&point| face.field(point, wavenumber).norm());
        models.zip(integrals).collect()
    };
    let (model, integral) = pairs(&[Vec3::new(0.0, 0.0, NORMALISED_AT_M)])[0];
    let gain = integral / model;
    let share = |step: u32| f64::from(step) / f64::from(STEPS);
    let heights: Vec<f64> =
        (0..=STEPS).map(|step| AXIS_M.0 + (AXIS_M.1 - AXIS_M.0) * share(step)).collect();
    let axis: Vec<Vec3> = heights.iter().map(|&z| Vec3::new(0.0, 0.0, z)).collect();
    let on_axis = heights
        .iter()
        .zip(pairs(&axis))
        .map(|(&z, (model, integral))| (z, gain * model * z, integral * z))
        .collect();
    let angles: Vec<f64> = (0..=STEPS).map(|step| 85f64.to_radians() * share(step)).collect();
    let lobe = |distance_m: f64| {
        let arc: Vec<Vec3> = angles
            .iter()
            .map(|angle| distance_m * Vec3::new(angle.sin(), 0.0, angle.cos()))
            .collect();
        let pairs = pairs(&arc);
        let on_axis = pairs[0].1;
        let relative = |(&angle, (model, integral)): (&f64, (f64, f64))| {
            (angle, gain * model / on_axis, integral / on_axis)
        };
        angles.iter().zip(pairs).map(relative).collect()
    };
    ModelAgainstIntegral {
        simulator: simulation.simulator,
        on_axis,
        lobes: LOBE_DISTANCES_M.map(lobe).to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn model_errors_are_within_the_documented_limits() {
        let medium = Medium { speed_of_sound_m_s: 343.0 };
        let found = models_against_integral(4.5e-3, medium, 40e3);
        let of = |simulator: Simulator| {
            found.iter().find(|model| model.simulator == simulator).expect("every model")
        };
        let wide = 60f64.to_radians();
        assert!(of(Simulator::Rayleigh).on_axis_error(0.01, 0.3) < 3e-4);
        assert!(of(Simulator::Rayleigh).lobe_error(0, wide) < 3e-4);
        // The axis of the piston's integral: |p| d = 2/(k a²) |sin(k (R - z)/2)| · 2 z is below 1 by at most (k a²/z)²/96.
        assert!(of(Simulator::Piston).on_axis_error(0.025, 0.3) < 0.02);
        assert!(of(Simulator::Piston).lobe_error(1, wide) < 0.01);
        assert!(of(Simulator::MultiGaussian).lobe_error(1, wide) < 0.015);
        assert!(of(Simulator::Corrected).on_axis_error(0.05, 0.3) > 0.2);
        assert!(of(Simulator::Gaussian).lobe_error(1, wide) > 0.1);
    }
}
