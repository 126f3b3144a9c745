//! Limits from theory for a set-up, before any simulation.

use serde::{Deserialize, Serialize};

use fieldgap_acoustics::limits::{critical_pitch_m, near_field_limit_m, steering_rad};
use fieldgap_acoustics::{Array, Excitation, Medium};
use fieldgap_records::{ArraySection, Layout, Rims};

/// Limits from theory for a set-up, millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Wavelength.
    pub wavelength_mm: f64,
    /// Smallest distance between the centres of two elements; `None` for a single element.
    pub pitch_mm: Option<f64>,
    /// Steering angle from the farthest edge to the focus, degrees; `None` without a focus in front of the array.
    pub steering_deg: Option<f64>,
    /// Largest pitch without a grating lobe at that steering angle, `λ/(1 + sin θ)`.
    pub critical_pitch_mm: Option<f64>,
    /// Near-field length of the largest element.
    pub element_near_field_mm: f64,
    /// Near-field length of the whole array; it cannot focus beyond.
    pub array_near_field_mm: f64,
}

impl Limits {
    /// The limits of an array in a medium, with an excitation.
    pub fn of(section: &ArraySection, medium: &Medium, excitation: &Excitation) -> Self {
        let array = section.array();
        let rims = rims(section.layout());
        let wavelength_m = medium.wavelength_m(section.frequency_hz());
        let face_m = array.elements().iter().map(|e| e.radius_m).fold(0.0, f64::max);
        let margin_m = rims.map_or(face_m, |rims| 0.5e-3 * rims.diameter_mm.get());
        let half_size_m = [0, 1].map(|axis| {
            let reach = array.elements().iter().map(|e| e.centre_m[axis].abs());
            reach.fold(0.0, f64::max) + margin_m
        });
        let steering = excitation
            .focus_m()
            .filter(|focus_m| focus_m.z > 0.0)
            .map(|focus_m| steering_rad(half_size_m, &focus_m));
        Self {
            wavelength_mm: wavelength_m * 1e3,
            pitch_mm: nearest_m(array).map(|pitch_m| pitch_m * 1e3),
            steering_deg: steering.map(f64::to_degrees),
            critical_pitch_mm: steering.map(|angle| critical_pitch_m(wavelength_m, angle) * 1e3),
            element_near_field_mm: near_field_limit_m(face_m, wavelength_m) * 1e3,
            array_near_field_mm: near_field_limit_m(
                half_size_m[0].max(half_size_m[1]),
                wavelength_m,
            ) * 1e3,
        }
    }
}

fn rims(layout: &Layout) -> Option<Rims> {
    match *layout {
        Layout::Square { rims, .. }
        | Layout::Linear { rims, .. }
        | Layout::Hexagonal { rims, .. }
        | Layout::HexagonalThesis { rims, .. }
        | Layout::Random { rims, .. } => Some(rims),
        Layout::Elements { .. } => None,
    }
}

/// The smallest distance between two elements, metres. They are sorted along x, so that few pairs need to be compared.
fn nearest_m(array: &Array) -> Option<f64> {
    let mut centres: Vec<_> = array.elements().iter().map(|element| element.centre_m).collect();
    centres.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut nearest = f64::INFINITY;
    for (index, centre) in centres.iter().enumerate() {
        for other in &centres[index + 1..] {
            if other.x - centre.x >= nearest {
                break;
            }
            nearest = nearest.min((other - centre).norm());
        }
    }
    nearest.is_finite().then_some(nearest)
}
