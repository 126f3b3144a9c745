//! `fieldgap characterize`: decay, directivity and axis of a single transducer from a scan of it.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, WrapErr, miette};

use super::output::{fresh_folder, print, print_json, say};
use super::simulate::positive;
use super::study::ConventionName;
use fieldgap_characterization::{
    CharacterizationError, Readings, appendix_a, characterize, text, text_of_appendix_a,
};
use fieldgap_input::Positive;
use fieldgap_records::RecordedScan;
use fieldgap_records::import::{ThesisLog, ThesisLogSetup, TransducerAxis};
use fieldgap_report::write_transducer;

/// The `characterize` command.
#[derive(Debug, Args)]
pub(super) struct Characterize {
    /// Log of the thesis's robot, or folder of a recorded scan of one transducer
    log: PathBuf,
    /// Method: `as-written` repeats the script of the thesis and writes no files
    #[arg(long, value_enum, value_name = "CONVENTION", default_value = "corrected")]
    convention: ConventionName,
    /// Name of the transducer [default: as the log]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Ignore readings nearer to the transducer face than this
    #[arg(long, value_name = "MM", default_value = "20", value_parser = positive)]
    from_mm: Positive,
    /// Folder for tables, pictures and the transducer file [default: out/transducer-NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Also write the transducer file here, such as rigs/transducers/NAME.toml; existing files are not overwritten
    #[arg(long, value_name = "FILE")]
    transducer: Option<PathBuf>,
    /// Print the result as JSON and write no files
    #[arg(long, conflicts_with_all = ["out", "transducer"])]
    json: bool,
}

impl Characterize {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let name = match &self.name {
            Some(name) => name.clone(),
            None => self
                .log
                .file_stem()
                .map_or_else(|| "transducer".to_owned(), |stem| stem.to_string_lossy().into()),
        };
        let scan = read(&self.log, &name)?;
        if let ConventionName::AsWritten = self.convention {
            let found = appendix_a(&scan)
                .map_err(|refused| miette!("{}: {refused}", self.log.display()))?;
            if self.json {
                print_json(&found)?
            } else {
                print(&text_of_appendix_a(&found))?
            }
            return Ok(ExitCode::SUCCESS);
        }
        if let Some(file) = self.transducer.as_ref().filter(|file| file.exists()) {
            return Err(miette!(
                help = "choose another file, or remove that one",
                "{} exists already",
                file.display()
            ));
        }
        let of_log = |refused: CharacterizationError| {
            let help = "a scan of one transducer needs at least four heights with nine points each; --from-mm excludes lower heights";
            miette!(help = help, "{}: {refused}", self.log.display())
        };
        let readings = Readings::of(&scan, self.from_mm.get()).map_err(of_log)?;
        let found = characterize(&readings).map_err(of_log)?;
        if self.json {
            print_json(&found)?;
            return Ok(ExitCode::SUCCESS);
        }
        let text = text(&found, &readings);
        print(&text)?;
        let source = format!(
            "fitted by fieldgap {} to {} readings of {}",
            env!("CARGO_PKG_VERSION"),
            readings.values.len(),
            self.log.file_name().map_or_else(String::new, |name| name.to_string_lossy().into())
        );
        let file = found.transducer_file(&name, &source);
        let folder =
            self.out.clone().unwrap_or_else(|| fresh_folder(&format!("transducer-{name}")));
        let files = write_transducer(&folder, &found, &readings, &file, &text).into_diagnostic()?;
        say(format!("transducer file: {}", files.transducer.display()));
        if let Some(path) = &self.transducer {
            let cannot = || format!("cannot write {}", path.display());
            std::fs::write(path, file.text()).into_diagnostic().wrap_err_with(cannot)?;
            say(format!("transducer file: {}", path.display()));
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Reads a folder as a recorded scan, and a file as a log.
fn read(log: &Path, name: &str) -> miette::Result<RecordedScan> {
    if log.is_dir() {
        return Ok(RecordedScan::open(log)?);
    }
    // Positions stay as logged, because the position of the axis is fitted.
    let setup = ThesisLogSetup {
        axis: TransducerAxis::At([0.0; 2]),
        ..ThesisLogSetup::of_thesis(name, jiff::Timestamp::UNIX_EPOCH)
    };
    Ok(ThesisLog::read(log)?.into_scan(setup))
}
