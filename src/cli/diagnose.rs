//! `fieldgap diagnose`: why a recorded scan and its simulation differ.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::compare::write_change_page;
use super::output::{print, print_json, say};
use super::record_figures::keep_figures;
use super::replay::context;
use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{Registering, Scaling, change, compare, compare_by_amplitudes};
use fieldgap_correction::{Corrected, correct_recorded_scan, correct_rig_file};
use fieldgap_diagnosis::{
    Diagnosis, Options, diagnose_change, diagnose_change_by_amplitudes, diagnose_with,
};
use fieldgap_records::RecordedScan;
use fieldgap_report::ReportContext;

/// The `diagnose` command.
#[derive(Debug, Args)]
pub(super) struct Diagnose {
    /// The folders of one recorded scan, or of several of the same rig, which are then diagnosed together
    #[arg(required = true, value_name = "SCAN")]
    folders: Vec<PathBuf>,
    /// The simulator whose gap is in question (see `simulate --help`) [default: the first scan's own; with --change, that of the transducers that the array's file names, or of pistons]
    #[arg(long, value_name = "NAME")]
    simulator: Option<Simulator>,
    /// Write the diagnosis as a page into this folder
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Correct this set-up by the named cause, so that the next simulation includes it: a rig file, or the folder of a
    /// recorded scan
    ///
    /// A rig file is corrected for future scans: speed of sound, frequency, pitch, the array's centre, single elements (in
    /// a file beside it). In a recorded scan the set-up is corrected, also for the simulator's bugs; the emitted drives are
    /// kept as phases. Comments give the fitted values and the effects without a key in the file.
    #[arg(long, value_name = "RIG|SCAN", requires = "out")]
    apply: Option<PathBuf>,
    /// New rig file or folder for the corrected set-up; existing files are not overwritten
    #[arg(long, value_name = "PATH", requires = "apply")]
    out: Option<PathBuf>,
    /// Of two scans: which effect changed from the first to the second, both against one simulation
    #[arg(long, conflicts_with = "apply")]
    change: bool,
    /// Leave out the phases of readings that have one
    #[arg(long)]
    amplitude_only: bool,
    /// Print the diagnosis as JSON
    #[arg(long)]
    json: bool,
}

impl Diagnose {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let scans = self
            .folders
            .iter()
            .map(|folder| RecordedScan::open(folder))
            .collect::<Result<Vec<_>, _>>()?;
        if self.change {
            return self.changed(&scans);
        }
        let options = Options {
            simulator: self.simulator,
            amplitude_only: self.amplitude_only,
            ..Options::default()
        };
        let diagnosis = diagnose_with(&scans, &options).into_diagnostic()?;
        if self.json {
            print_json(&diagnosis)?;
        } else {
            print(&diagnosis.to_text())?;
        }
        if let Some(out) = &self.report {
            let page = write_page(out, &self.folders, &scans, &diagnosis, Vec::new())?;
            // Of several scans taken together there are no figures of one record.
            if let ([folder], [scan]) = (self.folders.as_slice(), scans.as_slice()) {
                let compare = match self.amplitude_only {
                    true => compare_by_amplitudes,
                    false => compare,
                };
                let compared = compare(scan, diagnosis.simulator, Registering::Auto);
                let comparison = compared.into_diagnostic()?;
                keep_figures(folder, scan, &[comparison], Some(&diagnosis), out)?;
            }
            say(format!("report: {}", page.display()));
        }
        if let (Some(set_up), Some(out)) = (&self.apply, &self.out) {
            let scanned = &scans[0].setup;
            let corrected = if set_up.is_dir() {
                correct_recorded_scan(&diagnosis, scanned, set_up, out)?
            } else {
                correct_rig_file(&diagnosis, scanned, set_up, out)?
            };
            tell(&corrected);
        }
        Ok(ExitCode::SUCCESS)
    }
}

impl Diagnose {
    /// Says what changed between two records.
    fn changed(&self, scans: &[RecordedScan]) -> miette::Result<ExitCode> {
        let [a, b] = scans else {
            return Err(miette!(
                help = "name the record before the change, then the one after it",
                "--change takes two scans; the number given is {}",
                scans.len()
            ));
        };
        let diagnose = match self.amplitude_only {
            true => diagnose_change_by_amplitudes,
            false => diagnose_change,
        };
        let diagnosis = diagnose(a, b, self.simulator).into_diagnostic()?;
        if self.json {
            print_json(&diagnosis)?;
        } else {
            print(&diagnosis.to_text())?;
        }
        if let Some(out) = &self.report {
            let scaling = match a.setup.unit == b.setup.unit {
                true => Scaling::AsRead,
                false => Scaling::Gain,
            };
            let change = change(a, b, scaling).into_diagnostic()?;
            let page = write_change_page(out, &self.folders, scans, &change, Some(&diagnosis))?;
            say(format!("report: {}", page.display()));
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Writes the diagnosis of the scans in `folders` as a page into the folder `out`, with links to other `pages`; gives the page.
pub(super) fn write_page(
    out: &Path,
    folders: &[PathBuf],
    scans: &[RecordedScan],
    diagnosis: &Diagnosis,
    pages: Vec<(String, String)>,
) -> miette::Result<PathBuf> {
    let context = ReportContext { pages, ..context_of_all(folders, scans)? };
    let files = fieldgap_report::write_diagnosis(out, &context, diagnosis).into_diagnostic()?;
    for warning in &context.warnings {
        say(warning);
    }
    Ok(files.index)
}

/// Says what a corrected set-up holds, what it does not, and where it is.
pub(super) fn tell(corrected: &Corrected) {
    for found in &corrected.written {
        say(format!("corrected for {found}"));
    }
    for effect in &corrected.unwritten {
        say(format!("not corrected for {effect}"));
    }
    for file in &corrected.files {
        say(format!("written: {}", file.display()));
    }
}

/// Where the data of all scans are from. Of several, each file and fact is given with its scan.
pub(super) fn context_of_all(
    folders: &[PathBuf],
    scans: &[RecordedScan],
) -> miette::Result<ReportContext> {
    let mut all = ReportContext::default();
    for (folder, scan) in folders.iter().zip(scans) {
        let one = context(folder, scan)?;
        if scans.len() == 1 {
            return Ok(one);
        }
        let name = &scan.setup.name;
        let of_scan = |words: &str| format!("{name}: {words}");
        let joint = if all.title.is_empty() { "" } else { ", " };
        all.title += &format!("{joint}{name}");
        all.software = one.software;
        all.set_up.extend(one.set_up.iter().map(|(label, value)| (of_scan(label), value.clone())));
        all.inputs.extend(one.inputs.into_iter().map(|file| fieldgap_report::InputFile {
            name: format!("{}/{}", folder.display(), file.name),
            ..file
        }));
        all.warnings.extend(one.warnings.iter().map(|warning| of_scan(warning)));
    }
    Ok(all)
}
