//! `fieldgap calibrate level`: the sensitivity of the receiver, from readings with a sound calibrator on it.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, WrapErr, miette};
use serde::Serialize;

use crate::cli::output::{print, print_json, say};
use fieldgap_level::{Budget, CalibratedReceiver, Calibrator, Per, Relative};
use fieldgap_records::RecordedScan;
use fieldgap_text::significant;

/// The `calibrate level` command.
#[derive(Debug, Args)]
pub(in crate::cli) struct CalibrateLevel {
    /// Folders of records of readings in the calibrator, one for each time that it was put on the receiver
    #[arg(required = true, value_name = "RECORD")]
    records: Vec<PathBuf>,
    /// Level of the calibrator, dB re 20 µPa
    #[arg(long, value_name = "DB", value_parser = decibels)]
    db: f64,
    /// Standard uncertainty of this level, dB; half of the expanded one of a certificate
    #[arg(long, value_name = "DB", value_parser = uncertainty)]
    u_db: Option<f64>,
    /// Response of the receiver in the field at the array's frequency relative to that in the calibrator, dB; 0 for a calibrator that sounds at
    /// the array's frequency
    #[arg(long, value_name = "DB", value_parser = decibels, allow_hyphen_values = true)]
    response_db: Option<f64>,
    /// Standard uncertainty of this response, dB
    #[arg(long, value_name = "DB", value_parser = uncertainty, requires = "response_db")]
    response_u_db: Option<f64>,
    /// Of records that also have readings with the array driven, use those with it silent: the calibrator was on during these
    #[arg(long)]
    silent: bool,
    /// Write the lines for the rig file into this new file
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// The result, for programs.
#[derive(Debug, Serialize)]
struct Found<'a> {
    key: &'static str,
    sensitivity: f64,
    reading_unit: &'a str,
    readings: usize,
    placements: usize,
    mean: f64,
    scatter: f64,
    relative_standard_uncertainty: f64,
    budget: &'a Budget,
    unknown: &'a [&'static str],
}

fn decibels(text: &str) -> Result<f64, String> {
    let db: f64 = text.parse().map_err(|_| format!("{text} is not a number"))?;
    if (-200.0..=200.0).contains(&db) {
        Ok(db)
    } else {
        Err("a level within ±200 dB is expected".to_owned())
    }
}

fn uncertainty(text: &str) -> Result<f64, String> {
    let db = decibels(text)?;
    if (0.0..=6.0).contains(&db) {
        Ok(db)
    } else {
        Err("an uncertainty from 0 to 6 dB is expected".to_owned())
    }
}

impl CalibrateLevel {
    pub(in crate::cli) fn run(self) -> miette::Result<ExitCode> {
        let mut scans = Vec::with_capacity(self.records.len());
        for folder in &self.records {
            scans.push(RecordedScan::open(folder)?);
        }
        let unit = scans[0].setup.unit.clone();
        let mut placements = Vec::with_capacity(scans.len());
        for (scan, folder) in scans.iter().zip(&self.records) {
            if scan.setup.unit != unit {
                return Err(miette!(
                    help = "give records of one receiver, read in one unit",
                    "{} is in `{}`, and {} in `{unit}`",
                    folder.display(),
                    scan.setup.unit,
                    self.records[0].display()
                ));
            }
            placements.push(in_calibrator(scan, folder, self.silent)?);
        }
        let response = self.response_db.map(|db| Relative { db, u_db: self.response_u_db });
        let calibrator =
            Calibrator { level_db: self.db, level_u_db: self.u_db, carrier_response: response };
        let found = CalibratedReceiver::of(&placements, calibrator).map_err(|wrong| {
            miette!(
                help = "record again, with the calibrator on the receiver and sounding",
                "{wrong}"
            )
        })?;
        let lines = self.lines(&found, &unit, &scans[0]);
        if let Some(path) = &self.write {
            let file = std::fs::OpenOptions::new().write(true).create_new(true).open(path);
            file.and_then(|mut file| file.write_all(lines.as_bytes()))
                .into_diagnostic()
                .wrap_err_with(|| {
                    format!("{} cannot be written; an existing file is not changed", path.display())
                })?;
        }
        if self.json {
            let (key, sensitivity) = Per::of(found.readings_a_pa, &unit).key();
            print_json(&Found {
                key,
                sensitivity,
                reading_unit: &unit,
                readings: found.readings,
                placements: found.placements,
                mean: found.mean,
                scatter: found.scatter,
                relative_standard_uncertainty: found.budget.relative(),
                budget: &found.budget,
                unknown: &found.unknown,
            })?;
        } else {
            print(&self.in_words(&found, &unit, &lines))?;
        }
        if let Some(path) = &self.write {
            say(format!("written: {}", path.display()));
        }
        Ok(ExitCode::SUCCESS)
    }

    /// The lines for `[receiver]`. An uncertainty that is not complete is left to the person who knows the rest.
    fn lines(&self, found: &CalibratedReceiver, unit: &str, scan: &RecordedScan) -> String {
        let (key, value) = Per::of(found.readings_a_pa, unit).key();
        let percent = rounded(100.0 * found.budget.relative(), 2);
        let mut lines = format!(
            "# [receiver]: calibrated with {} dB, {} readings, record `{}` of {}\n",
            self.db, found.readings, scan.setup.name, scan.setup.recorded
        );
        let _ = writeln!(lines, "{key} = {}", rounded(value, 5));
        match found.unknown.is_empty() {
            true => {
                let _ = writeln!(lines, "sensitivity_u_percent = {percent}");
            }
            false => {
                let _ = writeln!(lines, "# not known: {}", found.unknown.join("; "));
                let _ = writeln!(
                    lines,
                    "# sensitivity_u_percent = {percent} without it: state the whole"
                );
            }
        }
        lines + "reads = \"rms\"\n"
    }

    fn in_words(&self, found: &CalibratedReceiver, unit: &str, lines: &str) -> String {
        let (_, value) = Per::of(found.readings_a_pa, unit).key();
        let per = if matches!(Per::of(1.0, unit), Per::Volt(_)) { "V" } else { unit };
        let times = if found.placements == 1 { "once" } else { "several times" };
        let mut text = format!(
            "{} readings at {} dB, calibrator put on {times}: mean {} {unit}, scatter {} {unit}\n\
             sensitivity {} {per}/Pa, relative standard uncertainty {} %\n\n",
            found.readings,
            self.db,
            significant(found.mean, 5),
            significant(found.scatter, 2),
            significant(value, 5),
            significant(100.0 * found.budget.relative(), 2)
        );
        text += &found.budget.to_text();
        for unknown in &found.unknown {
            let _ = writeln!(text, "  not in it: {unknown}");
        }
        let _ = write!(
            text,
            "\nlines for [receiver] of the rig file; remove `amplifier_gain_db`, as the readings contain the amplifier:\n\n{lines}"
        );
        text
    }
}

/// A number of some significant digits, as TOML has it.
fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// The readings in the calibrator.
fn in_calibrator(scan: &RecordedScan, folder: &Path, of_silent: bool) -> miette::Result<Vec<f64>> {
    if of_silent {
        return Ok(scan.silent().map(|sample| sample.reading).collect());
    }
    let silent = scan.silent().count();
    if silent > 0 && silent < scan.samples.len() {
        return Err(miette!(
            help = "give --silent if the calibrator was on the receiver while the array was silent",
            "{} has {silent} readings with the array silent and {} with it driven: which were taken in the calibrator is not known",
            folder.display(),
            scan.samples.len() - silent
        ));
    }
    Ok(scan.samples.iter().map(|sample| sample.reading).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_stay_numbers_of_toml() {
        for (value, shown) in
            [(0.002_434_712, "0.0024347"), (2.434_712e-5, "0.000024347"), (31_947.6, "31948")]
        {
            let text = format!("x = {}", rounded(value, 5));
            assert_eq!(text, format!("x = {shown}"));
            assert!(text.parse::<toml::Table>().is_ok());
        }
    }
}
