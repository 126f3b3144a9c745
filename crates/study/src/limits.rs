//! What theory says of a set-up before anything is simulated.

use serde::Serialize;

use fieldgap_acoustics::limits::{critical_pitch_m, near_field_limit_m, steering_rad};
use fieldgap_acoustics::{Array, Excitation, Medium};
use fieldgap_records::{ArraySection, Layout, Rims};

/// Lengths that theory gives for a set-up, millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limits {
    /// Wavelength.
    pub wavelength_mm: f64,
    /// Distance between the centres of the nearest neighbours; none for a lone element.
    pub pitch_mm: Option<f64>,
    /// Angle at which the farthest edge sees the focus, degrees; none without a focus before the array.
    pub steering_deg: Option<f64>,
    /// Largest pitch without a grating lobe at that angle, `λ/(1 + sin θ)`.
    pub critical_pitch_mm: Option<f64>,
    /// Where the near field of the largest element's face ends.
    pub element_near_field_mm: f64,
    /// Where the near field of the whole array ends: beyond, it cannot focus.
    pub array_near_field_mm: f64,
}

impl Limits {
    /// The limits of an array in a medium, told something.
    pub fn of(section: &ArraySection, medium: &Medium, excitation: &Excitation) -> Self {
        let array = section.array();
        let rims = rims(section.layout());
        let wavelength_m = medium.wavelength_m(section.frequency_hz());
        let face_m = array.elements().iter().map(|e| e.radius_m).fold(0.0, f64::max);
        let beyond_m = rims.map_or(face_m, |rims| 0.5e-3 * rims.diameter_mm.get());
        let half_size_m = [0, 1].map(|axis| {
            let reach = array.elements().iter().map(|e| e.centre_m[axis].abs());
            reach.fold(0.0, f64::max) + beyond_m
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

/// The smallest distance between two elements, metres. Sorted along x, each is only held against those not farther along.
fn nearest_m(array: &Array) -> Option<f64> {
    let mut places: Vec<_> = array.elements().iter().map(|element| element.centre_m).collect();
    places.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut nearest = f64::INFINITY;
    for (index, place) in places.iter().enumerate() {
        for other in &places[index + 1..] {
            if other.x - place.x >= nearest {
                break;
            }
            nearest = nearest.min((other - place).norm());
        }
    }
    nearest.is_finite().then_some(nearest)
}
