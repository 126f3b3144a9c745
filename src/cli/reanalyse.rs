//! `fieldgap reanalyse`: records compared and diagnosed again.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::on::{OnArgs, SOFTWARE};
use super::output::{print, print_json, say};
use fieldgap_jobs::{Batch, ItemResult, Product};
use fieldgap_reanalysis::{
    FOLDER, Keep, Reanalysed, Reanalysis, ReanalysisName, Summary, SummaryRow, With,
};

/// The `reanalyse` command.
#[derive(Debug, Args)]
pub(super) struct Reanalyse {
    /// A folder: every record in it and below it is analysed again
    folder: PathBuf,
    /// What is done differently, repeatable: simulator=NAME, register=NAME (as of `compare`), effects=ID,... (only these are tried),
    /// diagnose=no
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    with: Vec<(String, String)>,
    /// Name of the reanalysis; results go to reanalyses/NAME of each record [default: the keys and values, or the program's version]
    #[arg(long, value_name = "NAME")]
    name: Option<ReanalysisName>,
    /// Print the summary as CSV
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    on: OnArgs,
}

impl Reanalyse {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let given = self.with.iter().map(|(key, value)| (key.as_str(), value.as_str()));
        let with = With::read(given).into_diagnostic()?;
        let name = match &self.name {
            Some(name) => name.clone(),
            None => usual_name(&with)?,
        };
        let reanalysis = Reanalysis::of(&self.folder, with)?;
        let usual = reanalysis.folder().join("batches").join(name.to_string());
        let Some(batch) = self.on.run(&reanalysis, &usual, "records")? else {
            return Ok(ExitCode::SUCCESS);
        };
        let summary = keep(&batch, &name)?;
        if self.json {
            print_json(&summary)?;
        } else if self.csv {
            print(&summary.to_csv())?;
        } else {
            print(&summary.to_text())?;
        }
        say(format!("results: {FOLDER}/{name} in each record"));
        Ok(if summary.failed() > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
    }
}

/// Writes the results of a batch into the records.
fn keep(batch: &Batch, name: &ReanalysisName) -> miette::Result<Summary> {
    let reanalysis = &Reanalysis::of_batch(batch)?;
    let keep = Keep { reanalysis, batch, name };
    let mut summary = Summary::default();
    for (item, result) in reanalysis.records().iter().zip(batch.results()?) {
        let ItemResult { product, .. } = result?;
        let row = match product {
            Ok(Product::Json(json)) => {
                let result: Reanalysed = serde_json::from_str(&json).into_diagnostic()?;
                keep.keep(item, &result)?;
                SummaryRow::of(item.name(), Ok(&result))
            }
            Ok(Product::Bytes(_)) => {
                return Err(miette!("the result of {} is no JSON", item.name()));
            }
            Err(failure) => SummaryRow::of(item.name(), Err(failure.to_string())),
        };
        summary.rows.push(row);
    }
    Ok(summary)
}

/// The name where none is given.
fn usual_name(with: &With) -> miette::Result<ReanalysisName> {
    let keys: Vec<String> = with
        .keys()
        .iter()
        .map(|(key, value)| format!("{key}={}", value.replace(',', "+")))
        .collect();
    let name = if keys.is_empty() { SOFTWARE.replace(' ', "-") } else { keys.join("-") };
    let long = |error| miette!(help = "give a shorter name with --name", "{error}");
    name.parse().map_err(long)
}

fn key_and_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) => Ok((key.trim().to_owned(), value.trim().to_owned())),
        None => Err("expected a key and a value, as simulator=piston".to_owned()),
    }
}
