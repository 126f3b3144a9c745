//! Unmodelled causes: they are not in the catalogue, so a diagnosis should report `unexplained`.
//!
//! Each is one file with a size; size zero means no effect. It is an effect of the virtual rig ([`Draw::of_truth`]), or acts through the
//! methods of [`Unmodelled`].
//!
//! Some are close to effects of the catalogue. `row-sag` is a set of element gains, and a small `bowed-array` nearly one of
//! element phases; they differ from random ones by their spatial order. `crosstalk` is close to gains and phases together.

mod bent_cable;
mod bent_rail;
mod coarse_converter;
mod failing_elements;
mod fog;
mod gain_jump;
mod held_readings;
mod hot_plume;
mod lost_steps;
mod mains_hum;
mod missed_commands;
mod row_sag;
mod scattered_readings;
mod screen;
mod second_source;
mod swaying_gantry;
mod temperature_step;
mod tilted_receiver;
mod wind_onset;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use num_complex::Complex64;

use super::laboratory::Laboratory;
use super::parameters::Parameters;
use super::random_sequence::RandomSequence;
use super::survey::Stop;
use fieldgap_acoustics::Vec3;

/// One unmodelled cause. Each method after the first two is a place where it can act.
pub(super) trait Unmodelled: std::fmt::Debug + Send + Sync {
    /// Its name in the answers.
    fn name(&self) -> &'static str;

    /// Its parameters, for the answers.
    fn parameters(&self) -> Parameters;

    /// Whether it is an effect of the virtual rig, which a truth file states by its name and parameters.
    fn is_of_truth(&self) -> bool {
        false
    }

    /// Effects of the catalogue that start at a time, s, and last until the next change.
    fn changes(&self) -> Vec<(f64, Vec<(&'static str, Parameters)>)> {
        Vec::new()
    }

    /// The number of the stop whose field the `n`th reading is of.
    fn reads_stop(&self, n: usize) -> usize {
        n
    }

    /// Whether all elements sound in phase at the `n`th reading, in place of its drive.
    fn is_unfocused(&self, _n: usize) -> bool {
        false
    }

    /// How far the receiver is from where it should be, mm.
    fn displacement_mm(&self, _stop: &Stop) -> Vec3 {
        Vec3::zeros()
    }

    /// Another wave at a point, in units of the field, 1/m.
    fn beside(&self, _at_m: Vec3, _wavenumber_rad_m: f64) -> Complex64 {
        Complex64::ZERO
    }

    /// A factor on the level.
    fn gain(&self, _stop: &Stop) -> f64 {
        1.0
    }

    /// Changes a reading, V, after everything else.
    fn read_v(&self, reading_v: f64) -> f64 {
        reading_v
    }
}

/// A cause as a function of its size, which goes from zero to [`Draw::largest`].
pub(super) struct Draw {
    /// The largest size that is physical and still the same cause.
    pub largest: f64,
    /// The cause at a size.
    pub of_size: Box<dyn Fn(f64) -> Arc<dyn Unmodelled>>,
}

impl Draw {
    /// An effect of the virtual rig, whose parameters follow from its size.
    fn of_truth(
        name: &'static str,
        largest: f64,
        parameters: impl Fn(f64) -> Parameters + 'static,
    ) -> Self {
        Self::new(largest, move |size| OfTruth { name, parameters: parameters(size) })
    }

    fn new<C: Unmodelled + 'static>(largest: f64, of_size: impl Fn(f64) -> C + 'static) -> Self {
        Self { largest, of_size: Box::new(move |size| Arc::new(of_size(size))) }
    }
}

/// An effect of the virtual rig.
#[derive(Debug)]
struct OfTruth {
    name: &'static str,
    parameters: Parameters,
}

impl Unmodelled for OfTruth {
    fn name(&self) -> &'static str {
        self.name
    }

    fn parameters(&self) -> Parameters {
        self.parameters.clone()
    }

    fn is_of_truth(&self) -> bool {
        true
    }
}

type Drawing = fn(&Laboratory, &mut RandomSequence) -> Draw;

/// Every unmodelled cause with its name.
pub(super) const UNMODELLED: [(&str, Drawing); 18] = [
    (bent_cable::NAME, bent_cable::draw),
    (bent_rail::NAME, bent_rail::draw),
    (coarse_converter::NAME, coarse_converter::draw),
    (failing_elements::NAME, failing_elements::draw),
    (fog::NAME, fog::draw),
    (gain_jump::NAME, gain_jump::draw),
    (held_readings::NAME, held_readings::draw),
    (hot_plume::NAME, hot_plume::draw),
    (lost_steps::NAME, lost_steps::draw),
    (mains_hum::NAME, mains_hum::draw),
    (missed_commands::NAME, missed_commands::draw),
    (row_sag::NAME, row_sag::draw),
    (screen::NAME, screen::draw),
    (second_source::NAME, second_source::draw),
    (swaying_gantry::NAME, swaying_gantry::draw),
    (temperature_step::NAME, temperature_step::draw),
    (tilted_receiver::NAME, tilted_receiver::draw),
    (wind_onset::NAME, wind_onset::draw),
];
