//! The maps as the page's script reads them.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::worst_plane::worst_plane;
use fieldgap_comparison::{Comparison, PlaneComparison};

/// All maps of a report.
#[derive(Serialize)]
pub(super) struct Maps<'a> {
    unit: &'a str,
    /// What is shown first: the worst height.
    start: Option<Start>,
    comparisons: Vec<Simulated>,
}

/// A drive and a height.
#[derive(Serialize)]
struct Start {
    drive: usize,
    z_mm: f64,
}

/// The maps against one simulator.
#[derive(Serialize)]
struct Simulated {
    simulator: String,
    /// Standard deviation of a reading: constant part in the unit, and part in proportion to the level.
    noise: [f64; 2],
    planes: Vec<Plane>,
}

/// The two maps of one drive and height, row by row.
#[derive(Serialize)]
struct Plane {
    drive: usize,
    z_mm: f64,
    x_mm: Vec<f64>,
    y_mm: Vec<f64>,
    /// Little-endian 32-bit floats in base64; NaN where nothing was measured.
    scan: String,
    simulation: String,
    /// The focus over this plane, if it has one.
    focus_mm: Option<[f64; 2]>,
}

impl<'a> Maps<'a> {
    /// The maps of comparisons of one scan; `None` if there is none.
    pub(super) fn of(comparisons: &'a [Comparison]) -> Option<Self> {
        let first = comparisons.first()?;
        let unit = &first.reading_unit;
        let start = worst_plane(first)
            .map(|(_, plane)| Start { drive: plane.focus, z_mm: rounded_mm(plane.z_m) });
        let comparisons: Vec<Simulated> = comparisons
            .iter()
            .map(|comparison| Simulated {
                simulator: comparison.simulator.to_string(),
                noise: [comparison.noise.additive, comparison.noise.multiplicative],
                planes: comparison.planes.iter().filter_map(plane).collect(),
            })
            .collect();
        let drawn = comparisons.iter().any(|comparison| !comparison.planes.is_empty());
        drawn.then_some(Self { unit, start, comparisons })
    }
}

fn plane(plane: &PlaneComparison) -> Option<Plane> {
    let map = plane.map.as_ref()?;
    let millimetres = |along_m: &[f64]| along_m.iter().map(|m| rounded_mm(*m)).collect();
    Some(Plane {
        drive: plane.focus,
        z_mm: rounded_mm(plane.z_m),
        x_mm: millimetres(&map.x_m),
        y_mm: millimetres(&map.y_m),
        scan: packed(&map.scan),
        simulation: packed(&map.simulation),
        focus_mm: plane.target_in_scan_m.map(|at| [rounded_mm(at.x), rounded_mm(at.y)]),
    })
}

/// A length in millimetres to the micrometre, which is enough for a picture.
fn rounded_mm(metres: f64) -> f64 {
    (metres * 1e6).round() / 1e3
}

fn packed(values: &[f64]) -> String {
    let bytes: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    STANDARD.encode(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_little_endian_floats() {
        let bytes = STANDARD.decode(packed(&[1.0, f64::NAN])).expect("base64");
        assert_eq!(bytes[..4], [0, 0, 0x80, 0x3f]);
        assert!(f32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]).is_nan());
    }
}
