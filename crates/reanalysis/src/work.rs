//! A reanalysis as work of one item a record.

use std::path::{Path, PathBuf};

use fieldgap_jobs::{Batch, Failure, Product, Work};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::ReanalysisError;
use crate::reanalysed::Reanalysed;
use crate::record_item::{RecordItem, records_below};
use crate::with::With;

/// The kind of work.
pub const KIND: &str = "reanalyse";

/// Records analysed again.
#[derive(Debug, Clone)]
pub struct Reanalysis {
    description: Description,
    items: Vec<RecordItem>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    /// The folder with the records, an absolute path.
    folder: PathBuf,
    with: With,
}

impl Reanalysis {
    /// The records in a folder and below it.
    ///
    /// # Errors
    /// [`ReanalysisError`] if there is none, or a folder cannot be read.
    pub fn of(folder: &Path, with: With) -> Result<Self, ReanalysisError> {
        let failed = |source| ReanalysisError::Read { path: folder.to_owned(), source };
        let folder = folder.canonicalize().map_err(failed)?;
        let items = records_below(&folder)?;
        Ok(Self { description: Description { folder, with }, items })
    }

    /// The reanalysis of a batch.
    ///
    /// # Errors
    /// [`ReanalysisError::NotUnderstood`] if the batch is not one.
    pub fn of_batch(batch: &Batch) -> Result<Self, ReanalysisError> {
        let not_understood =
            |error: serde_json::Error| ReanalysisError::NotUnderstood(error.to_string());
        let description = Description::deserialize(batch.description()).map_err(not_understood)?;
        let items = batch.items().iter().map(RecordItem::deserialize).collect::<Result<_, _>>();
        Ok(Self { description, items: items.map_err(not_understood)? })
    }

    /// The folder with the records, an absolute path.
    pub fn folder(&self) -> &Path {
        &self.description.folder
    }

    /// What is done differently.
    pub fn with(&self) -> &With {
        &self.description.with
    }

    /// The records.
    pub fn records(&self) -> &[RecordItem] {
        &self.items
    }
}

impl Work for Reanalysis {
    fn kind(&self) -> &str {
        KIND
    }

    fn description(&self) -> Value {
        serde_json::to_value(&self.description).expect("paths of text and names have JSON")
    }

    fn items(&self) -> Vec<Value> {
        let item = |item| serde_json::to_value(item).expect("paths of text and digests have JSON");
        self.items.iter().map(item).collect()
    }

    fn run(&self, item: &Value) -> Result<Product, Failure> {
        let item = RecordItem::deserialize(item).map_err(Failure::new)?;
        Product::json(&Reanalysed::of(&self.description.folder, &item, &self.description.with)?)
    }
}
