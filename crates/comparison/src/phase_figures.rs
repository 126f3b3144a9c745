//! Phases of a comparison, as data.

use num_complex::Complex64;
use serde::Serialize;

/// Departure of an element's complex amplitude from the others' from which on it stands out, relative. A neighbour that is dead takes a quarter
/// where the measured plane resolves no single element. Set by judgement.
const OUT: f64 = 0.4;

/// Phase of the scan less that of the simulation in one plane. The constant phase of the reference, one for the scan or for each drive, is
/// taken out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanePhase {
    /// At every point of the grid, within half a turn of zero, radians; NaN where it was not measured.
    pub difference_rad: Vec<f64>,
    /// Mean over the plane, radians; each point counts by its power, as in the next.
    pub mean_rad: f64,
    /// Root mean square about zero, radians.
    pub rms_rad: f64,
    /// The same about the plane's own mean.
    pub rms_about_mean_rad: f64,
    /// Points of the grid whose phase is known.
    pub points: usize,
    /// Scan and simulation brought back to the plane of the elements; of the lowest plane of a drive that allows it.
    pub hologram: Option<Hologram>,
}

/// A plane brought back to the plane of the elements, in the coordinates of the scan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hologram {
    /// Height of the measured plane above the elements, metres.
    pub height_m: f64,
    /// What it resolves: half a wavelength over the sine of the angle under which half of the measured plane is seen, metres.
    pub resolution_m: f64,
    /// Columns, ascending, metres.
    pub x_m: Vec<f64>,
    /// Rows, ascending, metres.
    pub y_m: Vec<f64>,
    /// Amplitude of the scan, row by row, in its unit.
    pub scan: Vec<f64>,
    /// Phase of the scan less that of the simulation, the constant of the reference taken out, radians.
    pub difference_rad: Vec<f64>,
    /// Amplitude of the simulation, in the unit of the scan.
    pub simulation: Vec<f64>,
    /// What each element emits beside its simulation.
    pub elements: Vec<EmittedBeside>,
}

impl Hologram {
    /// The elements whose complex amplitude, over the simulated one, differs from that of the others by 0.4 of it or more; the one that is
    /// furthest out first.
    pub fn outstanding(&self) -> Vec<EmittedBeside> {
        let known = || self.elements.iter().filter(|element| element.ratio.is_finite());
        let mut ratios: Vec<f64> = known().map(|element| element.ratio).collect();
        ratios.sort_by(f64::total_cmp);
        let Some(&median) = ratios.get(ratios.len() / 2) else { return Vec::new() };
        let phasor = |e: &EmittedBeside| Complex64::from_polar(e.ratio / median, e.phase_rad);
        let mean = known().map(phasor).sum::<Complex64>();
        let back = mean.conj() / mean.norm().max(f64::MIN_POSITIVE);
        let departure = |element: &EmittedBeside| (phasor(element) * back - 1.0).norm();
        let mut out: Vec<EmittedBeside> =
            known().filter(|e| departure(e) >= OUT).copied().collect();
        out.sort_by(|a, b| departure(b).total_cmp(&departure(a)));
        out
    }
}

/// What an element emits beside its simulation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EmittedBeside {
    /// Number of the element.
    pub element: usize,
    /// Its centre in the coordinates of the scan (x, y), metres.
    pub at_m: [f64; 2],
    /// Radius of its face, metres.
    pub radius_m: f64,
    /// Amplitude over that of the simulation; NaN where the simulation emits next to nothing.
    pub ratio: f64,
    /// Phase less that of the simulation, radians; NaN in the same places.
    pub phase_rad: f64,
}
