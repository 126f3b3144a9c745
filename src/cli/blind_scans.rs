//! The scans of a sealed set as items of a batch.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use miette::{IntoDiagnostic, miette};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::output::{print, report_error};
use super::shard::not_understood;
use fieldgap_acoustics::Simulator;
use fieldgap_blind::Run;
use fieldgap_diagnosis::diagnose;
use fieldgap_jobs::{Batch, Failure, ItemResult, Product, Work};
use fieldgap_records::RecordedScan;

/// The kind of work.
pub(super) const KIND: &str = "blind";

/// Scans to be diagnosed, one an item.
pub(super) struct BlindScans {
    description: Description,
    names: Vec<String>,
}

#[derive(Serialize, Deserialize)]
struct Description {
    /// The folder that contains the scans, an absolute path.
    folder: PathBuf,
    simulator: Option<Simulator>,
}

impl BlindScans {
    /// These scans of a folder.
    pub(super) fn of(
        folder: &Path,
        names: Vec<String>,
        simulator: Option<Simulator>,
    ) -> miette::Result<Self> {
        let folder = folder.canonicalize().into_diagnostic()?;
        Ok(Self { description: Description { folder, simulator }, names })
    }

    /// The scans of a batch.
    pub(super) fn of_batch(batch: &Batch) -> miette::Result<Self> {
        let description = Description::deserialize(batch.description()).map_err(not_understood)?;
        let names = batch.items().iter().map(String::deserialize).collect::<Result<_, _>>();
        Ok(Self { description, names: names.map_err(not_understood)? })
    }

    /// Keeps the diagnoses of a batch, and prints a line for each.
    pub(super) fn keep(&self, batch: &Batch, run: &Run) -> miette::Result<ExitCode> {
        let names = Self::of_batch(batch)?.names;
        let mut code = ExitCode::SUCCESS;
        for (name, result) in names.iter().zip(batch.results()?) {
            let ItemResult { product, .. } = result?;
            match product {
                Ok(Product::Json(json)) => {
                    print(&format!("{}\n", run.keep(name, json.as_bytes())?))?;
                }
                Ok(Product::Bytes(_)) => return Err(miette!("the diagnosis of {name} is no JSON")),
                Err(failure) => {
                    code = ExitCode::FAILURE;
                    report_error(&miette!("{name}: {failure}"));
                }
            }
        }
        Ok(code)
    }
}

impl Work for BlindScans {
    fn kind(&self) -> &str {
        KIND
    }

    fn description(&self) -> Value {
        serde_json::to_value(&self.description).expect("paths of text and names have JSON")
    }

    fn items(&self) -> Vec<Value> {
        self.names.iter().map(|name| Value::from(name.as_str())).collect()
    }

    fn run(&self, item: &Value) -> Result<Product, Failure> {
        let name = item.as_str().ok_or_else(|| Failure::new("an item is the name of a scan"))?;
        let scan = RecordedScan::open(&self.description.folder.join(name)).map_err(Failure::new)?;
        let scans = std::slice::from_ref(&scan);
        Product::json(&diagnose(scans, self.description.simulator).map_err(Failure::new)?)
    }
}
