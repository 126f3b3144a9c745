//! A calibration from recorded scans.

use std::process::ExitCode;

use miette::{IntoDiagnostic, miette};
use serde::Serialize;

use super::plane::{is_of_planes, one_record};
use super::{Calibrate, CalibrationReport, FILE, file_of, uncalibrated, write};
use fieldgap_calibration::{CodedReadings, Options, calibrate, verification};
use fieldgap_records::RecordedScan;
use fieldgap_text::percent;

/// What the fit leaves of readings that it did not see.
#[derive(Debug, Serialize)]
pub(super) struct HeldOut {
    /// How they were chosen.
    by: String,
    readings: usize,
    /// Rms, relative to that of these readings.
    residual: f64,
}

impl HeldOut {
    pub(super) fn in_words(&self) -> String {
        format!(
            "held out: {}, {} readings; the fit leaves {} of them",
            self.by,
            self.readings,
            percent(self.residual)
        )
    }
}

impl Calibrate {
    /// Finds the calibration from records of one array.
    pub(super) fn of_records(&self) -> miette::Result<ExitCode> {
        let mut scans = Vec::with_capacity(self.inputs.len());
        for folder in &self.inputs {
            scans.push(RecordedScan::open(folder)?);
        }
        let first = &scans[0].setup;
        for (scan, folder) in scans.iter().zip(&self.inputs) {
            if scan.setup.array != first.array || scan.setup.unit != first.unit {
                return Err(miette!(
                    help = "calibrate each array, and each receiver, by itself",
                    "{} is of another array or unit than {}",
                    folder.display(),
                    self.inputs[0].display()
                ));
            }
        }
        let readings = CodedReadings::joined(scans.iter().map(CodedReadings::of));
        if is_of_planes(&readings) {
            one_record(&self.inputs)?;
            return self.of_planes(&scans[0], &readings);
        }
        let simulation =
            uncalibrated(first, self.simulator(first.array.transducer_file().is_some()));
        let options = Options { seed: self.seed, ..Options::default() };
        let found = calibrate(&simulation, &readings, options).into_diagnostic()?;
        let held_out = held_out(&simulation, &readings, options);
        let file = file_of(&found, first, &first.to_toml().into_diagnostic()?);
        let folder = self.folder(&first.name)?;
        let path = folder.join(FILE);
        write(&path, file.text())?;
        let mut report = CalibrationReport::of(&found, &readings, first, path);
        report.since_earlier = self.since_earlier(&file)?;
        report.held_out = held_out;
        let gap = |checked: &CodedReadings| verification::gap(&found, &simulation, checked);
        report.gap = self.check_of(gap, first)?;
        self.show(&report, &folder)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Every fifth drive is kept out of a second fit.
fn held_out(
    simulation: &fieldgap_acoustics::Simulation,
    readings: &CodedReadings,
    options: Options,
) -> Option<HeldOut> {
    let (fitted, kept) = readings.split(|reading| reading.drive % 5 == 4);
    let found = calibrate(simulation, &fitted, Options { more_starts: 0, ..options }).ok()?;
    let gap = verification::gap(&found, simulation, &kept);
    (gap.readings > 0).then(|| HeldOut {
        by: "every fifth drive".to_owned(),
        readings: gap.readings,
        residual: gap.after,
    })
}
