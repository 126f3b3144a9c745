//! A measured complex plane and its simulation, brought back to the plane of the elements.
//!
//! Both are brought back by the same sum from the same points, so that what the edge of the measured plane and its height do to one they do to the
//! other. Their ratio at an element is what that element emits beside what it should.

use num_complex::Complex64;

use super::comparison::ComparedMap;
use super::phase_figures::{EmittedBeside, Hologram};
use super::pose::Pose;
use fieldgap_acoustics::angular_spectrum::PlaneField;
use fieldgap_acoustics::{Simulation, Vec3};

/// Least share of the grid whose phase is known.
const LEAST_KNOWN: f64 = 0.95;

/// Largest distance of elements from one plane, and of their axes from its normal (its cosine).
const FLAT_M: f64 = 5e-4;
const UPRIGHT: f64 = 0.999;

/// Lines of the picture in a wavelength.
const LINES_IN_WAVELENGTH: f64 = 6.0;

/// Share of the largest simulated amplitude below which an element's ratio says nothing.
const LEAST_SHARE: f64 = 0.1;

/// The hologram of a plane at height `z_m`; `back` turns the phases of the scan by the constant of the reference. `None` where the elements are in no
/// plane parallel to it, or where the grid is coarser than half a wavelength, has gaps, or lies below the elements.
pub(super) fn hologram(
    z_m: f64,
    map: &ComparedMap,
    readings: &[Option<Complex64>],
    simulated: &[Complex64],
    back: Complex64,
    simulation: &Simulation,
    pose: &Pose,
) -> Option<Hologram> {
    let wavelength_m = simulation.medium.wavelength_m(simulation.frequency_hz);
    let elements = simulation.array.elements();
    let centres: Vec<Vec3> = elements.iter().map(|e| pose.to_scan(&e.centre_m)).collect();
    let height_m = z_m - centres.iter().map(|centre| centre.z).sum::<f64>() / centres.len() as f64;
    let flat = centres.iter().all(|centre| (z_m - centre.z - height_m).abs() <= FLAT_M)
        && elements.iter().all(|element| element.normal.z >= UPRIGHT);
    let fine = |along: &[f64]| {
        along.len() >= 2
            && (along[along.len() - 1] - along[0]) / (along.len() - 1) as f64 <= 0.5 * wavelength_m
    };
    let known = readings.iter().flatten().count() as f64;
    if !flat
        || height_m < wavelength_m
        || !fine(&map.x_m)
        || !fine(&map.y_m)
        || known < LEAST_KNOWN * readings.len() as f64
    {
        return None;
    }
    // What was not measured is left out of both.
    let scan: Vec<Complex64> = readings.iter().map(|r| r.unwrap_or_default() * back).collect();
    let simulated: Vec<Complex64> = simulated
        .iter()
        .zip(readings)
        .map(|(s, r)| if r.is_some() { *s } else { Complex64::ZERO })
        .collect();
    let radius_m = elements.iter().map(|element| element.radius_m).fold(0.0, f64::max);
    let lines = |axis: usize| {
        let at = || centres.iter().map(|centre| centre[axis]);
        let (from, to) =
            at().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), m| (a.min(m), b.max(m)));
        let (from, to) = (from - 2.0 * radius_m, to + 2.0 * radius_m);
        let count = ((to - from) / wavelength_m * LINES_IN_WAVELENGTH).ceil().max(2.0);
        let step = (to - from) / count;
        (0..=count as usize).map(|n| from + n as f64 * step).collect::<Vec<f64>>()
    };
    let (x_m, y_m) = (lines(0), lines(1));
    let wavenumber = std::f64::consts::TAU / wavelength_m;
    let at_elements = |values: &[Complex64]| {
        let plane = PlaneField { x_m: &map.x_m, y_m: &map.y_m, values };
        plane.propagated(wavenumber, -height_m, (&x_m, &y_m))
    };
    let (scan, simulated) = (at_elements(&scan)?, at_elements(&simulated)?);
    let over_face = |field: &[Complex64], centre: &Vec3| -> Complex64 {
        let rows = y_m.iter().zip(field.chunks(x_m.len()));
        let on_face = rows.flat_map(|(y, row)| x_m.iter().zip(row).map(move |(x, v)| (x, y, v)));
        let on_face =
            on_face.filter(|(x, y, _)| (**x - centre.x).hypot(**y - centre.y) <= radius_m);
        on_face.map(|(_, _, value)| value).sum()
    };
    let emitted: Vec<[Complex64; 2]> = centres
        .iter()
        .map(|centre| [over_face(&scan, centre), over_face(&simulated, centre)])
        .collect();
    let largest = emitted.iter().map(|[_, simulated]| simulated.norm()).fold(0.0, f64::max);
    let beside = |(element, [scan, simulated]): (usize, &[Complex64; 2])| {
        let says = simulated.norm() > LEAST_SHARE * largest;
        let ratio = if says { scan / simulated } else { Complex64::new(f64::NAN, f64::NAN) };
        let at_m = [centres[element].x, centres[element].y];
        let radius_m = elements[element].radius_m;
        EmittedBeside { element, at_m, radius_m, ratio: ratio.norm(), phase_rad: ratio.arg() }
    };
    let half_m = |along: &[f64]| 0.5 * (along[along.len() - 1] - along[0]);
    let half_m = half_m(&map.x_m).min(half_m(&map.y_m));
    Some(Hologram {
        height_m,
        resolution_m: 0.5 * wavelength_m * height_m.hypot(half_m) / half_m,
        scan: scan.iter().map(|value| value.norm()).collect(),
        difference_rad: scan.iter().zip(&simulated).map(|(a, b)| (a * b.conj()).arg()).collect(),
        simulation: simulated.iter().map(|value| value.norm()).collect(),
        elements: emitted.iter().enumerate().map(beside).collect(),
        x_m,
        y_m,
    })
}
