//! The combinations of a study as items of a batch.

use std::path::PathBuf;

use miette::{IntoDiagnostic, miette};
use serde::Deserialize;
use serde_json::Value;

use super::shard::not_understood;
use fieldgap_jobs::{Batch, Failure, ItemResult, Product, Work};
use fieldgap_study::{Cell, Study, StudyFiles, StudyResult, run_cell};

/// The kind of work.
pub(super) const KIND: &str = "study";

/// A study, a combination of values an item.
pub(super) struct StudyCells {
    files: StudyFiles,
    study: Study,
}

impl StudyCells {
    /// The cells of a study. Paths become absolute: other computers find the files that the study names.
    pub(super) fn of(study: &Study) -> miette::Result<Self> {
        let mut files = study.files();
        let absolute = |path: &mut PathBuf| {
            *path = std::path::absolute(&*path).into_diagnostic()?;
            miette::Result::<()>::Ok(())
        };
        absolute(&mut files.study.0)?;
        if let Some((path, _)) = &mut files.rig {
            absolute(path)?;
        }
        Ok(Self { study: Study::of_files(&files)?, files })
    }

    /// The cells of a batch.
    pub(super) fn of_batch(batch: &Batch) -> miette::Result<Self> {
        let files = StudyFiles::deserialize(batch.description()).map_err(not_understood)?;
        Ok(Self { study: Study::of_files(&files)?, files })
    }

    /// The result of the study.
    pub(super) fn result(&self, batch: &Batch) -> miette::Result<StudyResult> {
        let mut rows = Vec::new();
        for result in batch.results()? {
            let ItemResult { item, product } = result?;
            let json = match product {
                Ok(Product::Json(json)) => json,
                Ok(Product::Bytes(_)) => return Err(miette!("combination {item} is no JSON")),
                Err(failure) => return Err(miette!("combination {item} failed: {failure}")),
            };
            let cell: Cell = serde_json::from_str(&json).into_diagnostic()?;
            let row = cell.into_row(&self.study, item);
            rows.push(row.ok_or_else(|| miette!("combination {item} has no draws"))?);
        }
        Ok(StudyResult { rows })
    }
}

impl Work for StudyCells {
    fn kind(&self) -> &str {
        KIND
    }

    fn description(&self) -> Value {
        serde_json::to_value(&self.files).expect("paths of text and texts have JSON")
    }

    fn items(&self) -> Vec<Value> {
        (0..self.study.points()).map(Value::from).collect()
    }

    fn run(&self, item: &Value) -> Result<Product, Failure> {
        let number = usize::deserialize(item).map_err(Failure::new)?;
        Product::json(&run_cell(&self.study, number).map_err(Failure::new)?)
    }
}
