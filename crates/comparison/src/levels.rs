//! Absolute levels of the peaks of a comparison, where the sensitivity of the receiver is known.

use super::comparison::{
    Comparison, Levels, NoiseSource, PeakLevel, PlaneComparison, PlaneLevels, Uncertain,
};
use super::reception::Reception;
use fieldgap_acoustics::Vec3;
use fieldgap_level::{Budget, DB_PER_NEPER, Kind, Line, Sensitivity, level_db};
use fieldgap_records::RecordedScan;

/// The levels of a comparison of `scan`; `None` if the sensitivity of its receiver is not known, or not for the unit of its readings.
pub fn levels_of(scan: &RecordedScan, comparison: &Comparison) -> Option<Levels> {
    let sensitivity = scan.setup.receiver.as_ref()?;
    let rms_pa_per_reading = sensitivity.rms_pa_of(&scan.setup.unit).ok()?;
    let planes = comparison
        .planes
        .iter()
        .filter_map(|plane| of_plane(scan, comparison, plane, sensitivity, rms_pa_per_reading));
    Some(Levels { rms_pa_per_reading, planes: planes.collect(), notes: notes(sensitivity) })
}

fn notes(sensitivity: &Sensitivity) -> Vec<String> {
    let mut notes = Vec::new();
    if sensitivity.response().is_none() && sensitivity.face_m().is_none() {
        notes.push(
            "Neither `response_db` nor `face_radius_mm` is stated: the receiver is taken as a point that hears all directions alike, \
             without an uncertainty for it."
                .to_owned(),
        );
    }
    if sensitivity.has_uncertain_amplifier() {
        notes.push("`amplifier_u_db` is not stated: the gain is taken as exact.".to_owned());
    }
    notes
}

fn of_plane(
    scan: &RecordedScan,
    comparison: &Comparison,
    plane: &PlaneComparison,
    sensitivity: &Sensitivity,
    rms_pa_per_reading: f64,
) -> Option<PlaneLevels> {
    let (peak, simulated) = (plane.scan.peak, plane.simulation.peak);
    let [x_m, y_m] = plane.scan.peak_position_m.map(|along| along.value);
    let is_level = |value: f64| value.is_finite() && value > 0.0;
    if !(is_level(peak.value) && is_level(simulated.value) && (x_m + y_m).is_finite()) {
        return None;
    }
    let in_scan = Vec3::new(x_m, y_m, plane.z_m);
    let at_m = comparison.registration.pose().to_array(&in_scan);
    let reception = Reception::at(&scan.setup, comparison.simulator, plane.focus, at_m)?;
    let heard_db = reception.heard_db(sensitivity);
    if !heard_db.is_finite() {
        return None;
    }
    let level = |reading: f64| {
        let rms_pa = reading * rms_pa_per_reading * 10f64.powf(-heard_db / 20.0);
        PeakLevel { rms_pa, level_db: level_db(rms_pa) }
    };
    let lines = [
        chain(sensitivity),
        reception.lines(sensitivity),
        vec![repeatability(peak, comparison.noise.source)],
    ];
    let budget = Budget::new(lines.concat());
    let ratio = plane.discrepancy.peak_ratio;
    Some(PlaneLevels {
        focus: plane.focus,
        z_m: plane.z_m,
        scan: level(peak.value),
        simulation: level(simulated.value),
        gap_db: Uncertain {
            value: 20.0 * ratio.value.log10(),
            standard_error: DB_PER_NEPER * ratio.standard_error / ratio.value,
        },
        residual_rms_pa: level(plane.agreement.residual_rms).rms_pa,
        // Not minus zero.
        reception_db: 0.0 - heard_db,
        expanded_db: budget.expanded_db(),
        budget,
    })
}

/// From the receiver to the reading.
fn chain(sensitivity: &Sensitivity) -> Vec<Line> {
    let receiver = Line::relative("receiver's sensitivity", Kind::B, sensitivity.relative());
    let amplifier = sensitivity.amplifier_db();
    let amplifier = amplifier.map(|u_db| Line::decibels("amplifier's gain", Kind::B, u_db));
    std::iter::once(receiver).chain(amplifier).collect()
}

fn repeatability(peak: Uncertain, source: NoiseSource) -> Line {
    let (what, kind) = match source {
        NoiseSource::Repeats => ("repeatability", Kind::A),
        NoiseSource::SilentReadings => ("noise, from silent readings", Kind::A),
        NoiseSource::Maps => ("noise, from the maps", Kind::A),
        NoiseSource::Residual => ("noise, at most: from the residual", Kind::B),
    };
    let relative = peak.standard_error / peak.value;
    let known = relative.is_finite();
    Line::relative(what, kind, if known { relative } else { 0.0 }).assumed_if(!known)
}
