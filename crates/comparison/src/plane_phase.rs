//! Phases of scan and simulation, plane by plane.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::averaging::has_phases;
use super::comparison::{ComparedMap, PlaneComparison};
use super::hologram::hologram;
use super::phase_figures::PlanePhase;
use super::pose::Pose;
use fieldgap_acoustics::Simulation;
use fieldgap_records::{OFF_LINE_MM, PhaseReference, Plane, RecordedScan};

/// The complex readings of a plane on the grid of its map, in the convention exp(-iωt), repeats averaged; `None` where none was measured.
pub(super) fn complex_map(
    scan: &RecordedScan,
    plane: &Plane<'_>,
    map: &ComparedMap,
) -> Option<Vec<Option<Complex64>>> {
    let convention = scan.setup.phase.filter(|_| has_phases(scan))?.convention;
    let line = |along_m: &[f64], at_mm: f64| {
        along_m.iter().position(|m| (m * 1e3 - at_mm).abs() <= OFF_LINE_MM)
    };
    let mut sums = vec![(Complex64::ZERO, 0u32); map.x_m.len() * map.y_m.len()];
    for sample in &plane.samples {
        let Some(phase_rad) = sample.phase_rad else { continue };
        let at = sample.position_mm;
        if let (Some(column), Some(row)) = (line(&map.x_m, at.x), line(&map.y_m, at.y)) {
            let (sum, count) = &mut sums[row * map.x_m.len() + column];
            *sum += Complex64::from_polar(sample.reading, convention.turned(phase_rad));
            *count += 1;
        }
    }
    let mean = |(sum, count): (Complex64, u32)| (count > 0).then(|| sum / f64::from(count));
    Some(sums.into_iter().map(mean).collect())
}

/// The simulation on the grid of a map, as complex readings.
fn simulated(map: &ComparedMap) -> Option<Vec<Complex64>> {
    let phases = map.phase_rad.as_ref()?;
    Some(
        map.simulation
            .iter()
            .zip(phases)
            .map(|(r, phase)| Complex64::from_polar(*r, *phase))
            .collect(),
    )
}

/// Fills in the phases of compared planes, given the complex map of each.
pub(super) fn compare_phases(
    scan: &RecordedScan,
    planes: &mut [PlaneComparison],
    measured: &[Option<Vec<Option<Complex64>>>],
    pose: &Pose,
    simulation: impl Fn(usize) -> Option<Simulation>,
) {
    let each_drive =
        scan.setup.phase.is_some_and(|phase| phase.reference == PhaseReference::EachDrive);
    // Scan over simulation, each point by the power of both.
    let products = |plane: &PlaneComparison, measured: &Option<Vec<Option<Complex64>>>| {
        let simulated = simulated(plane.map.as_ref()?)?;
        let pairs = measured.as_ref()?.iter().zip(simulated);
        Some(pairs.map(|(m, s)| m.map(|m| m * s.conj())).collect::<Vec<_>>())
    };
    let products: Vec<Option<Vec<Option<Complex64>>>> =
        planes.iter().zip(measured).map(|(plane, measured)| products(plane, measured)).collect();
    let constant = |focus: usize| -> Complex64 {
        let of_reference = planes.iter().zip(&products);
        let of_reference = of_reference.filter(|(plane, _)| !each_drive || plane.focus == focus);
        of_reference.filter_map(|(_, products)| products.as_ref()).flatten().flatten().sum()
    };
    let constants: Vec<Complex64> = planes.iter().map(|plane| constant(plane.focus)).collect();
    let mut with_hologram: Vec<usize> = Vec::new();
    for (number, plane) in planes.iter_mut().enumerate() {
        let Some(products) = &products[number] else { continue };
        let back = constants[number].conj() / constants[number].norm().max(f64::MIN_POSITIVE);
        let turned: Vec<Option<Complex64>> =
            products.iter().map(|product| product.map(|product| product * back)).collect();
        let known = || turned.iter().flatten();
        let mean_rad = known().sum::<Complex64>().arg();
        let rms_about = |mean_rad: f64| {
            let (mut squares, mut powers) = (0.0, 0.0);
            for product in known() {
                let off = (product * Complex64::cis(-mean_rad)).arg();
                squares += product.norm() * off * off;
                powers += product.norm();
            }
            (squares / f64::max(powers, f64::MIN_POSITIVE)).sqrt()
        };
        let hologram = match (&plane.map, &measured[number]) {
            // (Planes of a drive stand by their height, the lowest first.)
            (Some(map), Some(readings)) if !with_hologram.contains(&plane.focus) => {
                simulation(plane.focus).and_then(|simulation| {
                    let simulated = simulated(map)?;
                    hologram(plane.z_m, map, readings, &simulated, back, &simulation, pose)
                })
            }
            _ => None,
        };
        if hologram.is_some() {
            with_hologram.push(plane.focus);
        }
        plane.phase = Some(PlanePhase {
            difference_rad: turned.iter().map(|p| p.map_or(f64::NAN, |p| p.arg())).collect(),
            mean_rad,
            rms_rad: rms_about(0.0),
            rms_about_mean_rad: rms_about(mean_rad),
            points: known().count(),
            hologram,
        });
    }
    debug_assert!(planes.iter().all(|p| p.phase.as_ref().is_none_or(|p| p.mean_rad.abs() <= PI)));
}
