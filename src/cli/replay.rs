//! `fieldgap replay`: compare a recorded scan with its simulation and write a report.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::IntoDiagnostic;
use sha2::{Digest, Sha256};

use super::closed_loop::replay_rounds;
use super::compare::ComparisonArgs;
use super::output::{print, print_json, say};
use super::picture_args::PictureArgs;
use super::record_figures::keep_figures;
use super::rounds_page::write_rounds_page;
use fieldgap_acquisition::replay_wire;
use fieldgap_comparison::Comparison;
use fieldgap_input::{MOST_TABLE, read_bytes};
use fieldgap_records::{EventKind, Layout, RecordedScan, SAME_HEIGHT_MM, ScanState, read_events};
use fieldgap_report::{Cause, InputFile, PrintStyle, ReportContext, ReportFiles};

/// The `replay` command.
#[derive(Debug, Args)]
pub(super) struct Replay {
    /// Folder of the recorded scan
    folder: PathBuf,
    #[command(flatten)]
    comparison: ComparisonArgs,
    /// Folder for the report [default: report/ in the scan's folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Instead, run the drivers against the recorded device traffic (wire/ in the folder) and list what they do differently
    #[arg(long, conflicts_with = "out")]
    wire: bool,
    /// Instead, make every decision of a closed loop again from the record, and list what differs from rounds.jsonl
    #[arg(long, conflicts_with_all = ["out", "wire"])]
    rounds: bool,
    /// Print the comparison as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    pictures: PictureArgs,
}

impl Replay {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        if self.wire {
            return self.run_wire();
        }
        if self.rounds {
            return replay_rounds(&self.folder, self.json);
        }
        let out = self.out.clone().unwrap_or_else(|| self.folder.join("report"));
        let pictures = self.pictures.style()?;
        let comparisons = report_on(&self.folder, &self.comparison, &out, pictures)?;
        if self.json {
            print_json(&comparisons)?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn run_wire(&self) -> miette::Result<ExitCode> {
        let replayed = replay_wire(&self.folder)?;
        if self.json {
            print_json(&replayed)?;
        } else {
            let lines: Vec<String> = replayed.iter().map(ToString::to_string).collect();
            print(&(lines.join("\n") + "\n"))?;
        }
        let same = replayed.iter().all(|device| device.differences.is_empty());
        Ok(if same { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// Compares a recorded scan and writes its report. Prints the result and the path of the report on standard error.
pub(super) fn report_on(
    folder: &Path,
    comparison: &ComparisonArgs,
    out: &Path,
    pictures: PrintStyle,
) -> miette::Result<Vec<Comparison>> {
    let scan = RecordedScan::open(folder)?;
    let comparisons = comparison.compare(folder, &scan)?;
    let pages = write_rounds_page(folder, &scan, out)?.into_iter().collect();
    let report =
        Report { folder, scan: &scan, comparisons: &comparisons, cause: None, pages, pictures };
    let files = write_report(report, out)?;
    keep_figures(folder, &scan, &comparisons, None, out)?;
    show(&comparisons, comparison);
    say(format!("report: {}", files.index.display()));
    Ok(comparisons)
}

/// Prints comparisons on standard error.
pub(super) fn show(comparisons: &[Comparison], args: &ComparisonArgs) {
    for comparison in comparisons {
        say(format!("\n{}", args.text(comparison)));
    }
}

/// A report to be written.
pub(super) struct Report<'a> {
    /// The folder of the scan.
    pub(super) folder: &'a Path,
    pub(super) scan: &'a RecordedScan,
    pub(super) comparisons: &'a [Comparison],
    pub(super) cause: Option<Cause<'a>>,
    /// Title and address of the other pages of the record.
    pub(super) pages: Vec<(String, String)>,
    /// How its pictures are to be printed.
    pub(super) pictures: PrintStyle,
}

/// Writes a report into a folder, and prints its warnings on standard error.
pub(super) fn write_report(report: Report<'_>, out: &Path) -> miette::Result<ReportFiles> {
    let (pages, pictures) = (report.pages, report.pictures);
    let context = ReportContext { pages, pictures, ..context(report.folder, report.scan)? };
    let files = fieldgap_report::write(out, &context, report.comparisons, report.cause)
        .into_diagnostic()?;
    for warning in &context.warnings {
        say(warning);
    }
    Ok(files)
}

/// Origin of the data in a folder, for a report.
pub(super) fn context(folder: &Path, scan: &RecordedScan) -> miette::Result<ReportContext> {
    Ok(ReportContext {
        title: scan.setup.name.clone(),
        set_up: set_up(scan),
        software: concat!("fieldgap ", env!("CARGO_PKG_VERSION")).to_owned(),
        inputs: inputs(folder, scan)?,
        pages: Vec::new(),
        warnings: warnings(folder),
        pictures: PrintStyle::default(),
    })
}

fn set_up(scan: &RecordedScan) -> Vec<(String, String)> {
    let setup = &scan.setup;
    let heights: Vec<String> =
        scan.planes(SAME_HEIGHT_MM).iter().map(|plane| format!("{:.1}", plane.z_mm)).collect();
    let row = |label: &str, value: String| (label.to_owned(), value);
    let mut rows = vec![
        row("Recorded", setup.recorded.to_string()),
        row("Array", format!("{}, {} elements", setup.array.layout(), setup.array.array().len())),
        row("Frequency", format!("{} kHz", setup.array.frequency_hz() / 1e3)),
        row(
            "Nominal speed of sound",
            format!("{:.1} m/s", setup.medium.medium().speed_of_sound_m_s),
        ),
    ];
    rows.extend(setup.receiver.as_ref().map(|receiver| {
        let (key, value) = receiver.per().key();
        let unit = if key == "sensitivity_v_pa" { "V" } else { setup.unit.as_str() };
        let percent = 100.0 * receiver.relative();
        row(
            "Sensitivity of the receiver",
            format!("{value} {unit}/Pa ± {percent} % (one standard uncertainty)"),
        )
    }));
    rows.extend(
        setup
            .foci
            .iter()
            .enumerate()
            .map(|(number, focus)| row(&format!("Focus {number}"), focus.to_string())),
    );
    rows.push(row("Heights", format!("{} mm", heights.join(", "))));
    rows.push(row(
        "Readings",
        format!("{}, of these {} with the array silent", scan.samples.len(), scan.silent().count()),
    ));
    rows
}

/// The existing files that the comparison depends on.
fn inputs(folder: &Path, scan: &RecordedScan) -> miette::Result<Vec<InputFile>> {
    let elements = match scan.setup.array.layout() {
        Layout::Elements { file } => Some(file.as_str()),
        _ => None,
    };
    ["scan.toml", "samples.csv", "transducer.toml", "plan.toml", "rig.toml"]
        .into_iter()
        .chain(elements)
        .filter(|name| folder.join(name).is_file())
        .map(|name| input_file(folder, name))
        .collect()
}

/// A file of a record with its digest.
pub(super) fn input_file(folder: &Path, name: &str) -> miette::Result<InputFile> {
    let bytes = read_bytes(&folder.join(name), MOST_TABLE).into_diagnostic()?;
    let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(InputFile { name: name.to_owned(), sha256 })
}

/// Reservations about the readings of a scan.
fn warnings(folder: &Path) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Ok(Some(state @ (ScanState::Partial { .. } | ScanState::Scanning))) =
        ScanState::of(folder)
    {
        warnings.push(format!("This scan is not complete: it {state}."));
    }
    let spoilt = read_events(folder)
        .map(|events| events.iter().filter(|event| event.kind == EventKind::DeviceFault).count());
    if let Ok(spoilt @ 1..) = spoilt {
        warnings.push(format!(
            "{spoilt} readings were clipped, or had samples missing; events.jsonl names them."
        ));
    }
    warnings
}
