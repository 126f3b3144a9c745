//! `fieldgap study`: how peak, focal radius and sub-peaks depend on a parameter; the thesis's table and Figs. 13 to 15.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use miette::{IntoDiagnostic, miette};
use serde::Serialize;

use super::on::{OnArgs, batch_beside};
use super::output::{fresh_folder, print, print_json, say};
use super::picture_args::PictureArgs;
use super::study_cells::StudyCells;
use fieldgap_acoustics::Simulator;
use fieldgap_input::TomlSource;
use fieldgap_report::write_study;
use fieldgap_study::{Limits, Observation, Onset, Row, Study, StudyResult, onsets, run, text};

/// The `study` command.
#[derive(Debug, Args)]
pub(super) struct StudyCommand {
    /// Name of a study of the thesis (shape, height, count, spacing, comparison), or a study file
    #[arg(value_name = "STUDY")]
    study: String,
    /// Simulator and definitions to use [default: as in the study file; `corrected` for the studies of the thesis]
    #[arg(long, value_enum, value_name = "CONVENTION")]
    convention: Option<ConventionName>,
    /// Override a key of the study, such as `array.columns=8`, `map.step_mm=0.5`, `draws=1000`; repeatable
    #[arg(long, value_name = "KEY=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,
    /// Also draw the field of every combination of values
    #[arg(long, conflicts_with = "on")]
    maps: bool,
    /// Folder for tables and pictures [default: out/study-NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the figures as JSON and write no files
    #[arg(long, conflicts_with_all = ["out", "maps"])]
    json: bool,
    /// Print the study file, as a template for your own
    #[arg(long, conflicts_with_all = ["out", "maps", "json"])]
    show: bool,
    #[command(flatten)]
    pictures: PictureArgs,
    #[command(flatten)]
    on: OnArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum ConventionName {
    /// As in the listings of the thesis, with their bugs
    AsWritten,
    /// With these bugs fixed
    Corrected,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct StudyJson<'a> {
    study: &'a str,
    rows: Vec<RowJson<'a>>,
    onsets: &'a [Onset],
}

#[derive(Debug, Serialize)]
struct RowJson<'a> {
    values: serde_json::Map<String, serde_json::Value>,
    simulator: Simulator,
    elements: usize,
    z_mm: f64,
    limits: &'a Limits,
    draws: Vec<DrawJson<'a>>,
}

#[derive(Debug, Serialize)]
struct DrawJson<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    seed: Option<u32>,
    #[serde(flatten)]
    observation: &'a Observation,
}

impl StudyCommand {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let pictures = self.pictures.style()?;
        let study = self.read()?;
        if self.show {
            print(study.source().text())?;
            return Ok(ExitCode::SUCCESS);
        }
        let result = match self.on.is_given() {
            false => run(&study, self.maps)?,
            true => match self.in_shards(&study)? {
                Some(result) => result,
                None => return Ok(ExitCode::SUCCESS),
            },
        };
        let onsets = onsets(&study, &result);
        if self.json {
            print_json(&json(&study, &result, &onsets))?;
            return Ok(ExitCode::SUCCESS);
        }
        let text = text(&study, &result, &onsets);
        print(&text)?;
        let folder = self.out.unwrap_or_else(|| fresh_folder(&format!("study-{}", study.name)));
        let files = write_study(&folder, &study, &result, &text, pictures).into_diagnostic()?;
        say(format!("tables and {} pictures: {}", files.pictures.len(), folder.display()));
        Ok(ExitCode::SUCCESS)
    }

    /// The result of the study as a batch; `None` if it was sent away.
    fn in_shards(&self, study: &Study) -> miette::Result<Option<StudyResult>> {
        study.check()?;
        let beside = match &self.out {
            Some(out) => out.clone(),
            None => Path::new("out").join(format!("study-{}", study.name)),
        };
        let cells = StudyCells::of(study)?;
        match self.on.run(&cells, &batch_beside(&beside), "combinations")? {
            Some(batch) => Ok(Some(cells.result(&batch)?)),
            None => Ok(None),
        }
    }

    fn read(&self) -> miette::Result<Study> {
        let mut study = Study::read(source(&self.study)?)?;
        if let Some(convention) = self.convention {
            study = study.with_simulator(match convention {
                ConventionName::AsWritten => Simulator::AsWritten,
                ConventionName::Corrected => Simulator::Corrected,
            })?;
        }
        for (key, value) in &self.set {
            study = study.with(key, value)?;
        }
        Ok(study)
    }
}

/// Finds a study of the thesis by name, or else reads a file.
fn source(study: &str) -> miette::Result<TomlSource> {
    let path = Path::new(study);
    let unknown = match Study::of_thesis(study) {
        Ok(source) => return Ok(source),
        Err(unknown) => unknown,
    };
    if path.extension().is_none() && !path.exists() {
        return Err(miette!(help = "or name a file, such as my-study.toml", "{unknown}"));
    }
    Ok(TomlSource::read(path)?)
}

fn json<'a>(study: &'a Study, result: &'a StudyResult, onsets: &'a [Onset]) -> StudyJson<'a> {
    let row = |row: &'a Row| RowJson {
        values: study
            .sweeps
            .iter()
            .zip(&row.values)
            .map(|(sweep, &index)| {
                let value = &sweep.values[index];
                let shown = value.number.map_or_else(
                    || serde_json::Value::from(value.label.as_str()),
                    serde_json::Value::from,
                );
                (sweep.name(), shown)
            })
            .collect(),
        simulator: row.simulator,
        elements: row.elements,
        z_mm: row.z_mm,
        limits: &row.limits,
        draws: row
            .draws
            .iter()
            .map(|(seed, observation)| DrawJson { seed: *seed, observation })
            .collect(),
    };
    StudyJson { study: &study.name, rows: result.rows.iter().map(row).collect(), onsets }
}

fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("expected a key and a value, as array.columns=8".to_owned()),
    }
}
