//! Causes that the catalogue does not have, to see whether a diagnosis says so instead of naming something.
//!
//! Each is one file, with its size as a number that is zero for "not at all". It acts where the virtual rig's effects do
//! ([`Effect`]), or at one of the further places of [`Outside`].
//!
//! None is an effect of the catalogue under another name, with two exceptions by degree. `row-sag` is a set of element gains,
//! and a small `bowed-array` nearly one of element phases: what tells them from a random scatter is the order in which the
//! elements stand. `crosstalk` comes near gains and phases taken together.

mod bowed_array;
mod coarse_converter;
mod crosstalk;
mod gain_jump;
mod hot_plume;
mod lead_screw;
mod row_sag;
mod scatterer;
mod screen;
mod side_wall;
mod temperature_step;
mod tilted_receiver;
mod wind_onset;

use std::sync::Arc;

use num_complex::Complex64;

use super::causes::Parameters;
use super::dice::Dice;
use super::laboratory::Laboratory;
use fieldgap_acoustics::{Element, Vec3};
use fieldgap_virtual_rig::effects::Effect;

/// One cause outside the catalogue. Every method but the first two is a place where it may act.
pub(super) trait Outside: std::fmt::Debug + Send + Sync {
    /// What it is called in the answers.
    fn name(&self) -> &'static str;

    /// Its parameters, for the answers.
    fn parameters(&self) -> Parameters;

    /// What it does at the places where effects of the catalogue act.
    fn effect(&self) -> Option<(&'static str, Box<dyn Effect>)> {
        None
    }

    /// Effects of the catalogue that set in at some time, s, and stay until the next change.
    fn changes(&self) -> Vec<(f64, Vec<(&'static str, Parameters)>)> {
        Vec::new()
    }

    /// Changes what the elements emit.
    fn emit(&self, _weights: &mut [Complex64], _elements: &[Element]) {}

    /// Places whose field, times a factor, is heard at `at_m` besides its own.
    fn echoes(&self, _at_m: Vec3, _wavenumber_rad_m: f64) -> Vec<(Vec3, Complex64)> {
        Vec::new()
    }

    /// What becomes of a reading, V, behind everything else.
    fn read_v(&self, reading_v: f64) -> f64 {
        reading_v
    }
}

/// A cause but for its size, which goes from zero to [`Draw::largest`].
pub(super) struct Draw {
    /// The largest size that is still physical, or still the same cause.
    pub largest: f64,
    /// The cause of a size.
    pub of_size: Box<dyn Fn(f64) -> Arc<dyn Outside>>,
}

impl Draw {
    fn new<C: Outside + 'static>(largest: f64, of_size: impl Fn(f64) -> C + 'static) -> Self {
        Self { largest, of_size: Box::new(move |size| Arc::new(of_size(size))) }
    }
}

type Drawing = fn(&Laboratory, &mut Dice) -> Draw;

/// Every cause outside the catalogue, by its name.
pub(super) const OUTSIDE: [(&str, Drawing); 13] = [
    (bowed_array::NAME, bowed_array::draw),
    (coarse_converter::NAME, coarse_converter::draw),
    (crosstalk::NAME, crosstalk::draw),
    (gain_jump::NAME, gain_jump::draw),
    (hot_plume::NAME, hot_plume::draw),
    (lead_screw::NAME, lead_screw::draw),
    (row_sag::NAME, row_sag::draw),
    (scatterer::NAME, scatterer::draw),
    (screen::NAME, screen::draw),
    (side_wall::NAME, side_wall::draw),
    (temperature_step::NAME, temperature_step::draw),
    (tilted_receiver::NAME, tilted_receiver::draw),
    (wind_onset::NAME, wind_onset::draw),
];
