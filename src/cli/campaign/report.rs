//! `fieldgap campaign report`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use miette::IntoDiagnostic;

use super::status::overview_of;
use crate::cli::output::{print, print_json, say};
use fieldgap_campaign::{CellOverview, CellStatus, GAP, Overview};
use fieldgap_reanalysis::ReanalysisName;
use fieldgap_report::write_campaign;

/// The `report` command.
#[derive(Debug, Args)]
pub(super) struct Report {
    /// Folder of the campaign
    folder: PathBuf,
    /// Take the figures of this reanalysis (see `fieldgap reanalyse`) instead of those that the campaign compared
    #[arg(long, value_name = "NAME")]
    reanalysis: Option<ReanalysisName>,
    /// Output format
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// A table
    Text,
    /// One row for each cell, with every figure
    Csv,
    /// Everything
    Json,
}

impl Report {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let (_, overview) = overview_of(&self.folder, self.reanalysis.as_ref())?;
        let page = write_campaign(&overview).into_diagnostic()?;
        match self.format {
            Format::Text => print(&table(&overview))?,
            Format::Csv => print(&csv(&overview)?)?,
            Format::Json => print_json(&overview)?,
        }
        say(format!("page: {}", page.display()));
        Ok(ExitCode::SUCCESS)
    }
}

fn word(cell: &CellOverview) -> &'static str {
    match &cell.status {
        CellStatus::Open => "open",
        CellStatus::Scanning => "scanning",
        CellStatus::Measured => "measured",
        CellStatus::Done { changed: true, .. } => "changed",
        CellStatus::Done { problem: Some(_), .. } => "problem",
        CellStatus::Done { .. } => "done",
        CellStatus::Failed { .. } => "failed",
    }
}

fn table(overview: &Overview) -> String {
    let widest =
        overview.cells.iter().map(|cell| cell.id.chars().count()).max().unwrap_or(0).max(4);
    let mut text = format!(
        "{:<widest$}  {:>9}  {:>7}  {:>8}  {:<10}  alarm\n",
        "cell", "gap, %", "corr.", "change", "status"
    );
    for cell in &overview.cells {
        let figure = |name: &str| cell.run.as_ref().and_then(|run| run.figures.get(name));
        let gap = figure(GAP).map_or(String::new(), |gap| format!("{:.2}", gap.value * 100.0));
        let correlation =
            figure("correlation").map_or(String::new(), |one| format!("{:.4}", one.value));
        let change =
            cell.gap_change.map_or(String::new(), |change| format!("{:+.1} %", change * 100.0));
        let alarm = if cell.alarm { "ALARM" } else { "" };
        let line = format!(
            "{:<widest$}  {gap:>9}  {correlation:>7}  {change:>8}  {:<10}  {alarm}",
            cell.id,
            word(cell)
        );
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// A row for each cell; a column for every figure of any cell, and one for its standard error.
fn csv(overview: &Overview) -> miette::Result<String> {
    let mut figures: Vec<&String> = overview
        .cells
        .iter()
        .filter_map(|cell| cell.run.as_ref())
        .flat_map(|run| run.figures.keys())
        .collect();
    figures.sort_unstable();
    figures.dedup();
    let mut table = csv::Writer::from_writer(Vec::new());
    let fixed =
        ["cell", "round", "repeat", "setting", "status", "measured", "temperature_c", "gap_change"];
    let dimensions = overview.dimensions.iter().map(|dimension| dimension.name.clone());
    let of_figures =
        figures.iter().flat_map(|name| [(*name).clone(), format!("{name}.standard_error")]);
    let head = fixed.map(str::to_owned).into_iter().chain(dimensions).chain(of_figures);
    table.write_record(head).into_diagnostic()?;
    for cell in &overview.cells {
        let run = cell.run.as_ref();
        let number = |value: Option<f64>| {
            value.filter(|value| value.is_finite()).map_or(String::new(), |value| value.to_string())
        };
        let fixed = [
            cell.id.clone(),
            cell.round.to_string(),
            cell.repeat.to_string(),
            cell.setting.clone(),
            word(cell).to_owned(),
            run.map_or(String::new(), |run| run.at.to_string()),
            number(run.and_then(|run| run.temperature_c).map(|one| one.value)),
            number(cell.gap_change),
        ];
        let values = overview.dimensions.iter().zip(&cell.values);
        let values = values.map(|(dimension, &value)| dimension.values[value].clone());
        let of_figures = figures.iter().flat_map(|name| {
            let figure = run.and_then(|run| run.figures.get(*name));
            [number(figure.map(|one| one.value)), number(figure.map(|one| one.standard_error))]
        });
        table.write_record(fixed.into_iter().chain(values).chain(of_figures)).into_diagnostic()?;
    }
    let bytes = table.into_inner().into_diagnostic()?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
