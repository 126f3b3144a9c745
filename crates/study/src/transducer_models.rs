//! The transducer models held against the integral over a vibrating face, which takes nothing as far away.

use serde::Serialize;

use fieldgap_acoustics::rayleigh::{DiscRule, Piston};
use fieldgap_acoustics::{Array, Element, Excitation, Medium, Simulation, Simulator, Vec3};

/// Models and truth are made alike here, on the axis, metres: the gain from pressure to reading is free in every comparison.
const ALIKE_AT_M: f64 = 0.1;
/// Patches of the true face leave less than this, from a fifth of a radius on.
const TRUTH_TOLERANCE: f64 = 1e-7;
/// Heights on the axis, metres.
const AXIS_M: (f64, f64) = (5e-3, 0.3);
const STEPS: u32 = 118;
/// Distances at which lobes are looked at, metres.
pub const LOBE_DISTANCES_M: [f64; 3] = [0.02, 0.1, 0.3];

/// One model beside the truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelBesideIntegral {
    /// The simulator whose transducer it is.
    pub simulator: Simulator,
    /// Height (m), model and truth on the axis, times the height.
    pub on_axis: Vec<(f64, f64, f64)>,
    /// For each of [`LOBE_DISTANCES_M`]: angle (rad), model and truth over the truth on the axis at that distance.
    pub lobes: Vec<Vec<(f64, f64, f64)>>,
}

impl ModelBesideIntegral {
    /// Largest error on the axis between two heights (metres), relative to the truth there.
    pub fn on_axis_error(&self, from_m: f64, to_m: f64) -> f64 {
        let inside = self.on_axis.iter().filter(|(z, ..)| (from_m..=to_m).contains(z));
        inside.map(|(_, model, truth)| (model / truth - 1.0).abs()).fold(0.0, f64::max)
    }

    /// Largest error within an angle (rad), relative to the axis, at a distance of [`LOBE_DISTANCES_M`]; what is wrong on the
    /// axis is in it.
    pub fn lobe_error(&self, distance: usize, within_rad: f64) -> f64 {
        let inside = self.lobes[distance].iter().filter(|(angle, ..)| *angle <= within_rad + 1e-9);
        inside.map(|(_, model, truth)| (model - truth).abs()).fold(0.0, f64::max)
    }
}

/// Every model for a face of some radius, metres, in a medium, beside its integral. The thesis's models are of its own
/// transducer, whatever the radius.
pub fn models_beside_integral(
    radius_m: f64,
    medium: Medium,
    frequency_hz: f64,
) -> Vec<ModelBesideIntegral> {
    let wavenumber = medium.wavenumber_rad_m(frequency_hz);
    let rule = DiscRule::for_piston(wavenumber * radius_m, 1.0, TRUTH_TOLERANCE);
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
        beside(&simulation, &face, wavenumber)
    })
    .collect()
}

fn beside(simulation: &Simulation, face: &Piston, wavenumber: f64) -> ModelBesideIntegral {
    let pairs = |points: &[Vec3]| -> Vec<(f64, f64)> {
        let models = simulation.field(points).into_iter().map(|field| field.norm());
        let truths = points.iter().map(|&point| face.field(point, wavenumber).norm());
        models.zip(truths).collect()
    };
    let (model, truth) = pairs(&[Vec3::new(0.0, 0.0, ALIKE_AT_M)])[0];
    let gain = truth / model;
    let share = |step: u32| f64::from(step) / f64::from(STEPS);
    let heights: Vec<f64> =
        (0..=STEPS).map(|step| AXIS_M.0 + (AXIS_M.1 - AXIS_M.0) * share(step)).collect();
    let axis: Vec<Vec3> = heights.iter().map(|&z| Vec3::new(0.0, 0.0, z)).collect();
    let on_axis = heights
        .iter()
        .zip(pairs(&axis))
        .map(|(&z, (model, truth))| (z, gain * model * z, truth * z))
        .collect();
    let angles: Vec<f64> = (0..=STEPS).map(|step| 85f64.to_radians() * share(step)).collect();
    let lobe = |distance_m: f64| {
        let arc: Vec<Vec3> = angles
            .iter()
            .map(|angle| distance_m * Vec3::new(angle.sin(), 0.0, angle.cos()))
            .collect();
        let pairs = pairs(&arc);
        let on_axis = pairs[0].1;
        let relative = |(&angle, (model, truth)): (&f64, (f64, f64))| {
            (angle, gain * model / on_axis, truth / on_axis)
        };
        angles.iter().zip(pairs).map(relative).collect()
    };
    ModelBesideIntegral {
        simulator: simulation.simulator,
        on_axis,
        lobes: LOBE_DISTANCES_M.map(lobe).to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_model_is_as_right_as_it_is_said_to_be() {
        let medium = Medium { speed_of_sound_m_s: 343.0 };
        let found = models_beside_integral(4.5e-3, medium, 40e3);
        let of = |simulator: Simulator| {
            found.iter().find(|model| model.simulator == simulator).expect("every model")
        };
        let wide = 60f64.to_radians();
        assert!(of(Simulator::Rayleigh).on_axis_error(0.01, 0.3) < 3e-4);
        assert!(of(Simulator::Rayleigh).lobe_error(0, wide) < 3e-4);
        // The axis of the piston's integral: |p| d = 2/(k a²) |sin(k (R - z)/2)| · 2 z falls short of 1 by (k a²/z)²/96 at most.
        assert!(of(Simulator::Piston).on_axis_error(0.025, 0.3) < 0.02);
        assert!(of(Simulator::Piston).lobe_error(1, wide) < 0.01);
        assert!(of(Simulator::MultiGaussian).lobe_error(1, wide) < 0.015);
        assert!(of(Simulator::Corrected).on_axis_error(0.05, 0.3) > 0.2);
        assert!(of(Simulator::Gaussian).lobe_error(1, wide) > 0.1);
    }
}
