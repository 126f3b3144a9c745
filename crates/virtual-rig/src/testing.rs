//! A world for the firmwares' tests: the thesis's array with a nozzle 100 mm above its centre.

use std::path::Path;
use std::sync::{Arc, Mutex};

use nalgebra::Vector3;

use super::clock::{Clock, Pace};
use super::trajectory::Trajectory;
use super::truth::Truth;
use super::world::{Believed, World};
use fieldgap_acoustics::{Array, Medium, Vec3};
use fieldgap_input::TomlSource;

/// What the laboratory believes.
pub fn believed() -> Believed {
    Believed {
        array: Array::square(6, 6, 10.5e-3).expect("not empty"),
        medium: Medium { speed_of_sound_m_s: 343.0 },
        frequency_hz: 40e3,
        array_origin_m: Vec3::new(0.15, 0.15, -0.02),
    }
}

/// The truth of a text.
pub fn truth(text: &str) -> Truth {
    Truth::from_source(&TomlSource::new(Path::new("truth.toml"), text)).expect("a valid truth")
}

/// A world at a pace.
pub fn world(text: &str, pace: Pace) -> (Arc<World>, Arc<Mutex<Trajectory>>) {
    let parked_mm = Vector3::new(150.0, 150.0, 80.0);
    let travel_mm = Vector3::new(300.0, 300.0, 250.0);
    let trajectory = Arc::new(Mutex::new(Trajectory::new(parked_mm, travel_mm)));
    let clock = Arc::new(Clock::new(pace));
    let world = World::new(&believed(), truth(text), 1, trajectory.clone(), clock);
    (Arc::new(world.expect("the truth fits the array")), trajectory)
}
