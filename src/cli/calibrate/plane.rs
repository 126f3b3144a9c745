//! A calibration from a record of planes: all elements driven at once, by one or a few drives.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use miette::{IntoDiagnostic, miette};
use serde::Serialize;

use super::{Calibrate, FILE, RESULT, file_with, uncalibrated, write};
use crate::cli::output::{fresh_folder, print, print_json};
use fieldgap_calibration::plane::{
    ElementFound, Group, GroupFound, HeldOutBlocks, PlaneCalibration, SharedNumber,
    calibrate_planes,
};
use fieldgap_calibration::verification::Gap;
use fieldgap_calibration::{CodedReadings, difference};
use fieldgap_comparison::{Mirror, Registering, register_scan};
use fieldgap_records::{CalibratedChannel, ChannelState, RecordedScan};
use fieldgap_text::{paragraph, percent, significant, table};

/// The result, for programs.
#[derive(Debug, Serialize)]
struct PlaneReport {
    file: PathBuf,
    registration: String,
    readings: usize,
    residual: f64,
    /// Relative to the rms of the readings: at no level, and relative to the level.
    noise: [f64; 2],
    readings_of_one: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    map_noise: Option<MapNoise>,
    mirror: Mirror,
    shared: Vec<SharedNumber>,
    groups: Vec<GroupFound>,
    held_out: Vec<HeldOutBlocks>,
    #[serde(skip_serializing_if = "Option::is_none")]
    check: Option<Gap>,
    #[serde(skip_serializing_if = "Option::is_none")]
    since_earlier: Option<difference::Difference>,
    ambiguities: Vec<String>,
    elements: Vec<Element>,
}

/// Noise that the maps show without any model.
#[derive(Debug, Serialize)]
struct MapNoise {
    relative: f64,
    is_bound: bool,
}

/// An element.
#[derive(Debug, Serialize)]
struct Element {
    state: String,
    gain: f64,
    gain_error: f64,
    phase_deg: f64,
    phase_error_deg: f64,
    #[serde(flatten)]
    found: ElementFound,
}

impl Element {
    fn of((channel, found): (&CalibratedChannel, &ElementFound)) -> Self {
        Self {
            state: channel.state.to_string(),
            gain: channel.gain,
            gain_error: channel.gain_error,
            phase_deg: channel.phase_rad.to_degrees(),
            phase_error_deg: channel.phase_error_rad.to_degrees(),
            found: *found,
        }
    }
}

impl Calibrate {
    /// Finds the calibration from a record of planes.
    pub(super) fn of_planes(
        &self,
        scan: &RecordedScan,
        readings: &CodedReadings,
    ) -> miette::Result<ExitCode> {
        let setup = &scan.setup;
        let simulator = self.simulator(setup.array.transducer_file().is_some());
        let simulation = uncalibrated(setup, simulator);
        let registration = register_scan(scan, simulator, Registering::Auto).into_diagnostic()?;
        let found = calibrate_planes(&simulation, readings, &registration).into_diagnostic()?;
        let folder = self.folder(&setup.name)?;
        let path = folder.join(FILE);
        let noise = found.noise[0].hypot(found.noise[1]);
        let speed_of_sound_m_s = simulation.medium.speed_of_sound_m_s;
        let summary = super::Summary {
            readings: found.used,
            noise,
            residual: found.residual,
            speed_of_sound_m_s,
        };
        let hashed = setup.to_toml().into_diagnostic()?;
        let file = file_with(found.channels.clone(), setup, &hashed, &summary);
        write(&path, file.text())?;
        let check = self.check_of(|checked| found.gap(&simulation, checked), setup)?;
        let report =
            PlaneReport::of(&found, registration.why, path, check, self.since_earlier(&file)?);
        write(&folder.join(RESULT), &serde_json::to_string_pretty(&report).into_diagnostic()?)?;
        match self.showing.prints_json() {
            true => print_json(&report)?,
            false => print(&report.in_words())?,
        }
        Ok(ExitCode::SUCCESS)
    }

    /// The folder of the result.
    pub(super) fn folder(&self, name: &str) -> miette::Result<PathBuf> {
        let folder = self.out.clone();
        let folder = folder.unwrap_or_else(|| fresh_folder(&format!("{name}-calibration")));
        std::fs::create_dir_all(&folder).into_diagnostic()?;
        Ok(folder)
    }

    /// The gap on the record that was given to check, if one was.
    pub(super) fn check_of(
        &self,
        gap: impl FnOnce(&CodedReadings) -> Gap,
        setup: &fieldgap_records::ScanSetup,
    ) -> miette::Result<Option<Gap>> {
        let Some(folder) = &self.check else { return Ok(None) };
        let scan = RecordedScan::open(folder)?;
        if scan.setup.array != setup.array {
            return Err(miette!(
                help = "give another record of the same array",
                "{} is of another array: it cannot check this calibration",
                folder.display()
            ));
        }
        let readings = CodedReadings::of(&scan);
        if readings.rms() <= 0.0 {
            return Err(miette!(
                help = "give a record with the array driven",
                "{} has no reading of the driven array: it checks nothing",
                folder.display()
            ));
        }
        Ok(Some(gap(&readings)))
    }
}

impl PlaneReport {
    fn of(
        found: &PlaneCalibration,
        registration: String,
        file: PathBuf,
        check: Option<Gap>,
        since_earlier: Option<difference::Difference>,
    ) -> Self {
        let map_noise = found.map_noise;
        Self {
            file,
            registration,
            readings: found.used,
            residual: found.residual,
            noise: found.noise,
            readings_of_one: found.readings_of_one,
            map_noise: map_noise.map(|n| MapNoise { relative: n.relative, is_bound: n.is_bound }),
            mirror: found.mirror,
            shared: found.shared.clone(),
            groups: found.groups.clone(),
            held_out: found.held_out.clone(),
            check,
            since_earlier,
            ambiguities: found.ambiguities.clone(),
            elements: found.channels.iter().zip(&found.elements).map(Element::of).collect(),
        }
    }

    fn in_words(&self) -> String {
        let [additive, relative] = self.noise;
        let mut text = paragraph(
            &format!(
                "{} elements from {} readings of planes. The fit leaves {} of their rms: {} at no level and {} of the level; {:.1} neighbours \
                 tell as much as one.",
                self.elements.len(),
                self.readings,
                percent(self.residual),
                percent(additive),
                percent(relative),
                self.readings_of_one
            ),
            0,
            0,
        );
        if let Some(noise) = &self.map_noise {
            let most = if noise.is_bound { "at most " } else { "" };
            let _ = writeln!(text, "\nnoise by the map alone: {most}{}", percent(noise.relative));
        }
        let _ = write!(text, "\n{}\n", paragraph(&self.registration, 0, 0));
        text += &self.groups_in_words();
        text += "\n";
        let mut rows = vec![["shared", "value", "standard error"].map(str::to_owned)];
        for number in &self.shared {
            let value = significant(number.value, 4);
            let error = significant(number.standard_error, 2);
            rows.push([number.name.to_owned(), value, error]);
        }
        text += &table(&rows);
        if !self.held_out.is_empty() {
            text += "\nevery fifth block held out of a fit of the others:\n";
            let head = ["points", "mm", "wavelengths", "before", "left", "expected by its errors"];
            let mut rows = vec![head.map(str::to_owned)];
            for block in &self.held_out {
                rows.push([
                    format!("{0} x {0}", block.points),
                    format!("{:.1}", block.width_mm),
                    format!("{:.1}", block.wavelengths),
                    percent(block.before),
                    percent(block.residual),
                    percent(block.expected),
                ]);
            }
            text += &table(&rows);
        }
        if let Some(gap) = &self.check {
            let _ = writeln!(
                text,
                "\ncheck, {} readings of another record: the gap fell from {} to {} (noise {})",
                gap.readings,
                percent(gap.before),
                percent(gap.after),
                percent(gap.noise)
            );
        }
        text += "\n";
        let sound = ChannelState::Sound.to_string();
        let faults = self.elements.iter().enumerate().filter(|(_, e)| e.state != sound);
        for (channel, Element { state, gain, phase_deg, gain_error, phase_error_deg, .. }) in faults
        {
            let _ = writeln!(
                text,
                "channel {channel} is {state}: gain {gain:.2} ± {gain_error:.2}, phase {phase_deg:.0}° ± {phase_error_deg:.0}°"
            );
        }
        if self.elements.iter().all(|element| element.state == sound) {
            text += "all channels are sound\n";
        }
        if let Some(change) = &self.since_earlier {
            text += &super::text::since(change);
        }
        for ambiguity in &self.ambiguities {
            let _ = write!(text, "\n{}", paragraph(ambiguity, 0, 0));
        }
        let _ = writeln!(text, "\ncalibration: {}", self.file.display());
        text
    }

    fn groups_in_words(&self) -> String {
        let head = ["of each element", "spread", "determined", "log evidence"];
        let mut rows = vec![head.map(str::to_owned)];
        for group in &self.groups {
            let (name, spread) = match group.group {
                Group::Gain => ("gain", percent(group.spread)),
                Group::Phase => ("phase", format!("{:.1}°", group.spread.to_degrees())),
                Group::Place => ("place", format!("{:.2} mm", group.spread)),
                Group::Lean => ("lean of its lobe", format!("{:.2}", group.spread)),
            };
            let kept = if group.is_kept { "" } else { ", left out" };
            rows.push([
                name.to_owned(),
                spread,
                format!("{:.0} of {}", group.determined, group.numbers),
                format!("{:.1}{kept}", group.log_evidence),
            ]);
        }
        table(&rows)
    }
}

/// Whether a record is of planes: few drives at many places, read with a receiver that moves.
pub(super) fn is_of_planes(readings: &CodedReadings) -> bool {
    !readings.is_coded()
}

/// Refuses further records.
pub(super) fn one_record(inputs: &[PathBuf]) -> miette::Result<()> {
    match inputs {
        [_] => Ok(()),
        _ => Err(miette!(
            help = "give one record; it may hold several planes, and another one can check it: --check RECORD",
            "each record of planes has a pose of its own: several are not fitted together"
        )),
    }
}
