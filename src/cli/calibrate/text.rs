//! A calibration in words.

use std::fmt::Write as _;

use super::{CalibrationReport, Fault};
use fieldgap_calibration::design::Design;
use fieldgap_calibration::difference::Difference;
use fieldgap_calibration::{Calibration, CodedReadings};
use fieldgap_records::{CalibratedChannel, ChannelState, ScanSetup};
use fieldgap_text::{paragraph, percent, table};

/// Changed channels that are listed.
const LISTED: usize = 10;

impl CalibrationReport {
    /// The report of a fit, without a check.
    pub(super) fn of(
        found: &Calibration,
        readings: &CodedReadings,
        setup: &ScanSetup,
        file: std::path::PathBuf,
    ) -> Self {
        let sound: Vec<&CalibratedChannel> =
            found.channels.iter().filter(|c| c.state == ChannelState::Sound).collect();
        let rms = |of: &dyn Fn(&CalibratedChannel) -> f64| {
            let squares: f64 = sound.iter().map(|channel| of(channel).powi(2)).sum();
            (squares / sound.len().max(1) as f64).sqrt()
        };
        let mean_gain = sound.iter().map(|c| c.gain).sum::<f64>() / sound.len().max(1) as f64;
        let fault = |(channel, c): (usize, &CalibratedChannel)| Fault {
            channel,
            state: c.state.to_string(),
            drives: c.drives,
            gain: c.gain,
            phase_deg: c.phase_rad.to_degrees(),
        };
        let setting = found.setting();
        Self {
            file,
            elements: found.channels.len(),
            readings: found.used,
            warming_up: found.left_out,
            outliers: found.outliers,
            places: readings.places_m.len(),
            drives: readings.drives.len(),
            noise: found.relative_noise,
            residual: found.residual,
            chi_square: found.chi_square,
            gain_spread: rms(&|c| c.gain - mean_gain),
            gain_error: rms(&|c| c.gain_error),
            phase_spread_deg: rms(&|c| c.phase_rad).to_degrees(),
            phase_error_deg: rms(&|c| c.phase_error_rad).to_degrees(),
            faults: found.faults().map(fault).collect(),
            offset_mm: (setting.offset_m * 1e3).into(),
            speed_of_sound_m_s: setup.medium.medium().speed_of_sound_m_s * (1.0 + setting.speed),
            further_starts: found.starts.clone(),
            ambiguities: found.ambiguities.clone(),
            held_out: None,
            gap: None,
            focus: None,
            since_earlier: None,
        }
    }
}

/// What will be measured.
pub(super) fn of_design(design: &Design, about_s: f64) -> String {
    let places: Vec<String> = design
        .places_m
        .iter()
        .map(|at| format!("({:.1}, {:.1}, {:.1})", at.x * 1e3, at.y * 1e3, at.z * 1e3))
        .collect();
    let promise = &design.promise;
    format!(
        "{} coded drives at {} mm, about {:.1} minutes on the robot's clock.\n\
         Chosen for the least mean variance (A-optimal): with noise of 2 % phases to {:.2}°, gains to {}; log determinant of the information \
         (D) {:.2} per element.",
        design.drives.len(),
        places.join(", "),
        about_s / 60.0,
        promise.phase_rad.to_degrees(),
        percent(promise.gain),
        promise.log_determinant,
    )
}

/// The result.
pub(super) fn in_words(report: &CalibrationReport) -> String {
    let CalibrationReport { elements, readings, places, drives, .. } = report;
    let mut text = paragraph(
        &format!(
            "{elements} elements from {readings} readings of {drives} drives at {places} places; {} left out while the array warmed up, {} far \
             off. The fit leaves {}; noise {}.",
            report.warming_up,
            report.outliers,
            percent(report.residual),
            percent(report.noise)
        ),
        0,
        0,
    );
    text += "\n\n";
    text += &table(&[
        ["".to_owned(), "spread".to_owned(), "standard error".to_owned()],
        ["gain".to_owned(), percent(report.gain_spread), percent(report.gain_error)],
        [
            "phase".to_owned(),
            format!("{:.2}°", report.phase_spread_deg),
            format!("{:.2}°", report.phase_error_deg),
        ],
    ]);
    let [x, y, z] = report.offset_mm;
    let _ = writeln!(
        text,
        "\noffset of the receiver ({x:.2}, {y:.2}, {z:.2}) mm, speed of sound {:.2} m/s: fitted beside them",
        report.speed_of_sound_m_s
    );
    if report.faults.is_empty() {
        text += "all channels are sound\n";
    }
    for Fault { channel, state, drives, gain, phase_deg } in &report.faults {
        let what = match &state[..] {
            "swapped" => format!("swapped: it drives element {drives}"),
            "dead" => "dead".to_owned(),
            other => format!("{other}: gain {gain:.2}, phase {phase_deg:.0}°"),
        };
        let _ = writeln!(text, "channel {channel} is {what}");
    }
    if let Some(held_out) = &report.held_out {
        let _ = writeln!(text, "{}", held_out.in_words());
    }
    if let Some(gap) = &report.gap {
        let _ = writeln!(
            text,
            "\ncheck, {} readings that the fit never saw: the gap fell from {} to {} (noise {})",
            gap.readings,
            percent(gap.before),
            percent(gap.after),
            percent(gap.noise)
        );
    }
    if let Some(focus) = &report.focus {
        let [x, y, z] = focus.at_mm;
        let _ = writeln!(
            text,
            "\nfocus at ({x:.0}, {y:.0}, {z:.0}) mm, drive as it was and compensated:"
        );
        let mm =
            |radius: Option<f64>| radius.map_or("-".to_owned(), |m| format!("{:.2} mm", m * 1e3));
        let lobe = |lobe: Option<f64>| lobe.map_or("-".to_owned(), percent);
        let mut rows = vec![["along", "peak", "radius", "side lobe"].map(str::to_owned)];
        for (axis, [before, after]) in ["x", "y"].iter().zip(&focus.lines) {
            rows.push([
                (*axis).to_owned(),
                format!("{:+.1} %", (after.peak / before.peak - 1.0) * 100.0),
                format!("{} to {}", mm(before.radius_m), mm(after.radius_m)),
                format!("{} to {}", lobe(before.side_lobe), lobe(after.side_lobe)),
            ]);
        }
        text += &table(&rows);
    }
    if let Some(change) = &report.since_earlier {
        text += &since(change);
    }
    for ambiguity in &report.ambiguities {
        text += "\n";
        text += &paragraph(ambiguity, 0, 0);
        text += "\n";
    }
    let _ = writeln!(text, "\ncalibration: {}", report.file.display());
    text
}

/// What changed since an earlier calibration.
pub(super) fn since(change: &Difference) -> String {
    let mut text = format!(
        "\nsince the earlier calibration, {:.1} days: gains changed by {} rms (expected from errors {}), phases by {:.2}° ({:.2}°)\n",
        change.days,
        percent(change.gain_rms),
        percent(change.gain_expected),
        change.phase_rms_rad.to_degrees(),
        change.phase_expected_rad.to_degrees(),
    );
    for c in change.changed.iter().take(LISTED) {
        let _ = writeln!(
            text,
            "channel {}: gain x {:.3}, phase {:+.1}°, {:.1} standard errors; {} before, {} now",
            c.channel,
            c.gain_ratio,
            c.phase_rad.to_degrees(),
            c.sigma,
            c.states[0],
            c.states[1]
        );
    }
    if change.changed.len() > LISTED {
        let _ = writeln!(text, "and {} more channels", change.changed.len() - LISTED);
    }
    text
}
