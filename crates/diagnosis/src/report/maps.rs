//! Scan and simulations height by height, as maps.

use fieldgap_acoustics::metrics::PlaneMap;
use fieldgap_comparison::Registration;
use fieldgap_comparison::{FieldFigures, Noise, NoiseSource};
use fieldgap_records::{OFF_LINE_MM, Plane, RecordedSample, plane_map};

use crate::model::observations::Observations;
use crate::model::planes::{by_height, is_flat};
use crate::result::DiagnosedPlane;

/// What is drawn of each reading.
pub(crate) struct Plotted<'d> {
    /// Expected by the believed set-up.
    pub before: &'d [f64],
    /// Expected by the best fit.
    pub after: &'d [f64],
    /// What each leaves, in standard deviations.
    pub residual_before: &'d [f64],
    pub residual_after: &'d [f64],
}

/// The maps of all planes whose points lie on a grid.
pub(crate) fn maps(
    observations: &Observations,
    registration: &Registration,
    plotted: &Plotted<'_>,
) -> Vec<DiagnosedPlane> {
    let mut planes = Vec::new();
    let mut first = 0;
    for (scan, observed) in observations.scans.iter().enumerate() {
        let noise = Noise {
            additive: observed.scatter.additive,
            multiplicative: observed.scatter.share,
            source: NoiseSource::Repeats,
        };
        for drive in &observed.drives {
            // Layers of scattered readings make no map.
            for own in by_height(drive).into_iter().filter(|own| is_flat(drive, own)) {
                let map_of = |values: &dyn Fn(usize) -> f64| -> Option<PlaneMap> {
                    let samples: Vec<RecordedSample> = own
                        .iter()
                        .map(|&i| {
                            let at_m = drive.visits[i].at_m;
                            RecordedSample::measured(0.0, Some(drive.focus), at_m, values(i), None)
                        })
                        .collect();
                    let samples = samples.iter().collect();
                    let plane = Plane { focus: drive.focus, z_mm: 0.0, samples };
                    plane_map(&plane, OFF_LINE_MM).ok().map(|mapped| mapped.map)
                };
                let of = |values: &[f64]| map_of(&|i| values[first + i]);
                let maps = (
                    map_of(&|i| drive.readings[i]),
                    of(plotted.before),
                    of(plotted.after),
                    of(plotted.residual_before),
                    of(plotted.residual_after),
                );
                let (Some(measured), Some(before), Some(after), Some(left), Some(left_after)) =
                    maps
                else {
                    continue;
                };
                let figures = FieldFigures::of_scan(&measured, &noise)
                    .zip(FieldFigures::of_simulation(&before, registration))
                    .zip(FieldFigures::of_simulation(&after, registration))
                    .map(|((measured, before), after)| [measured, before, after]);
                planes.push(DiagnosedPlane {
                    scan,
                    focus: drive.focus,
                    z_mm: (1e6 * drive.visits[own[0]].at_m.z).round() / 1e3,
                    x_m: measured.x_m().to_vec(),
                    y_m: measured.y_m().to_vec(),
                    measured: measured.values().to_vec(),
                    before: before.values().to_vec(),
                    after: after.values().to_vec(),
                    residual_before: left.values().to_vec(),
                    residual_after: left_after.values().to_vec(),
                    figures,
                });
            }
            first += drive.readings.len();
        }
    }
    planes
}
