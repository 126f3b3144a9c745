//! The maps as the page's script reads them.

use std::f64::consts::TAU;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::simulated_map::SimulatedMap;
use crate::worst_plane::worst_plane;
use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{Comparison, PlaneComparison};

/// Points of a page of a simulation, at most.
const MOST_POINTS: f64 = 1e6;

/// All maps of a report.
#[derive(Serialize)]
pub(super) struct Maps<'a> {
    /// Unit of the amplitudes; empty for the simulator's own, or the receiver's.
    unit: &'a str,
    /// What is shown first: the worst height, or that of the focus.
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

/// The maps of one drive and height, row by row.
#[derive(Serialize)]
struct Plane {
    drive: usize,
    z_mm: f64,
    x_mm: Vec<f64>,
    y_mm: Vec<f64>,
    /// Little-endian 32-bit floats in base64; NaN where nothing was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    scan: Option<String>,
    simulation: String,
    /// The simulated phase in 256ths of a turn from minus half a turn on, one byte each, in base64.
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<String>,
    /// The focus over this plane, if it has one.
    focus_mm: Option<[f64; 2]>,
    /// Its absolute level, where it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    level: Option<Level>,
}

/// What makes pascals of the values of a plane.
#[derive(Serialize)]
struct Level {
    /// Pascals rms per unit of the amplitudes.
    pa_per_unit: f64,
    /// Expanded uncertainty of the level of the scan's peak, k = 2, dB.
    expanded_db: f64,
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
                planes: comparison.planes.iter().filter_map(|of| plane(of, comparison)).collect(),
            })
            .collect();
        let drawn = comparisons.iter().any(|comparison| !comparison.planes.is_empty());
        drawn.then_some(Self { unit, start, comparisons })
    }

    /// Whether an absolute level is known.
    pub(super) fn has_levels(&self) -> bool {
        self.comparisons.iter().flat_map(|one| &one.planes).any(|plane| plane.level.is_some())
    }

    /// The maps of simulated planes; `None` if there is none.
    pub(super) fn of_simulation(simulator: Simulator, planes: &[SimulatedMap]) -> Option<Self> {
        let distance = |plane: &&SimulatedMap| {
            plane.focus_m.map_or(f64::INFINITY, |focus_m| (focus_m.z - plane.grid.z_m).abs())
        };
        let first = planes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let start = Some(Start { drive: first.drive, z_mm: rounded_mm(first.grid.z_m) });
        let points = planes.iter().map(|plane| plane.amplitude.len()).sum();
        let simulated = Simulated {
            simulator: simulator.to_string(),
            noise: [0.0; 2],
            planes: planes.iter().map(|plane| simulated(plane, stride(points))).collect(),
        };
        Some(Self { unit: "", start, comparisons: vec![simulated] })
    }
}

/// Every how many columns and rows are in the page, of so many points in all: pages of more points open slowly.
pub(super) fn stride(points: usize) -> usize {
    (points as f64 / MOST_POINTS).sqrt().ceil().max(1.0) as usize
}

fn simulated(map: &SimulatedMap, stride: usize) -> Plane {
    let thinned = |along_m: &[f64]| -> Vec<f64> {
        along_m.iter().step_by(stride).map(|m| rounded_mm(*m)).collect()
    };
    let columns = map.grid.x_m.len().max(1);
    let values = |of: &[f64]| -> Vec<f64> {
        let rows = of.chunks(columns).step_by(stride);
        rows.flat_map(|row| row.iter().step_by(stride).copied()).collect()
    };
    Plane {
        drive: map.drive,
        z_mm: rounded_mm(map.grid.z_m),
        x_mm: thinned(&map.grid.x_m),
        y_mm: thinned(&map.grid.y_m),
        scan: None,
        simulation: packed(&values(&map.amplitude)),
        phase: Some(packed_phase(&values(&map.phase_rad))),
        focus_mm: map.focus_m.map(|at| [rounded_mm(at.x), rounded_mm(at.y)]),
        level: None,
    }
}

fn plane(plane: &PlaneComparison, comparison: &Comparison) -> Option<Plane> {
    let map = plane.map.as_ref()?;
    let millimetres = |along_m: &[f64]| along_m.iter().map(|m| rounded_mm(*m)).collect();
    Some(Plane {
        drive: plane.focus,
        z_mm: rounded_mm(plane.z_m),
        x_mm: millimetres(&map.x_m),
        y_mm: millimetres(&map.y_m),
        scan: Some(packed(&map.scan)),
        simulation: packed(&map.simulation),
        phase: map.phase_rad.as_deref().map(packed_phase),
        focus_mm: plane.target_in_scan_m.map(|at| [rounded_mm(at.x), rounded_mm(at.y)]),
        level: comparison.levels.as_ref().and_then(|levels| {
            let of = levels.of_plane(plane)?;
            Some(Level { pa_per_unit: levels.rms_pa_in(of), expanded_db: of.expanded_db })
        }),
    })
}

/// A length in millimetres to the micrometre, which is enough for a picture.
fn rounded_mm(metres: f64) -> f64 {
    (metres * 1e6).round() / 1e3
}

fn packed_phase(phases_rad: &[f64]) -> String {
    // 256 steps are finer than a colour scale shows.
    let step = |phase: &f64| ((phase / TAU + 0.5) * 256.0).round().rem_euclid(256.0) as u8;
    STANDARD.encode(phases_rad.iter().map(step).collect::<Vec<u8>>())
}

fn packed(values: &[f64]) -> String {
    let bytes: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    STANDARD.encode(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_are_bytes_from_minus_half_a_turn_on() {
        let bytes = STANDARD.decode(packed_phase(&[-0.5 * TAU, 0.0, 0.25 * TAU, 0.4999 * TAU]));
        assert_eq!(bytes.expect("base64"), [0, 128, 192, 0]);
    }

    #[test]
    fn large_simulations_are_thinned() {
        assert_eq!(
            (stride(0), stride(1_000_000), stride(1_000_001), stride(9_000_000)),
            (1, 1, 2, 3)
        );
    }

    #[test]
    fn values_are_little_endian_floats() {
        let bytes = STANDARD.decode(packed(&[1.0, f64::NAN])).expect("base64");
        assert_eq!(bytes[..4], [0, 0, 0x80, 0x3f]);
        assert!(f32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]).is_nan());
    }
}
