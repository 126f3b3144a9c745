//! The result of one record.

use std::path::Path;

use fieldgap_archive::RecordFigures;
use fieldgap_comparison::compare;
use fieldgap_diagnosis::diagnose_with;
use fieldgap_jobs::Failure;
use fieldgap_records::RecordedScan;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::before::Before;
use crate::record_item::RecordItem;
use crate::with::With;

/// The result of one record.
#[derive(Debug, Serialize, Deserialize)]
pub struct Reanalysed {
    /// What was known before.
    pub before: Before,
    /// The figures of the new comparison, with the new cause.
    pub figures: RecordFigures,
    /// The new diagnosis, as `diagnose --json` prints it.
    pub diagnosis: Option<Box<RawValue>>,
}

impl Reanalysed {
    /// Compares and diagnoses a record.
    pub(crate) fn of(folder: &Path, item: &RecordItem, with: &With) -> Result<Self, Failure> {
        let record = folder.join(&item.record);
        let scan = RecordedScan::open(&record).map_err(|fault| in_full(&fault))?;
        if RecordItem::of(folder, item.record.clone()) != *item {
            return Err(Failure::new(
                "its files have changed since the batch was made; analyse it again under another name",
            ));
        }
        let before = Before::of(&record, &scan);
        let simulator = with.simulator.unwrap_or(scan.setup.simulator);
        let comparison = compare(&scan, simulator, with.register).map_err(Failure::new)?;
        let scans = std::slice::from_ref(&scan);
        let diagnosis = match with.diagnosis() {
            Some(options) => Some(diagnose_with(scans, &options).map_err(Failure::new)?),
            None => None,
        };
        let figures = RecordFigures::of(&scan, &comparison, diagnosis.as_ref(), None);
        let diagnosis = diagnosis.as_ref().map(serde_json::value::to_raw_value).transpose();
        Ok(Self { before, figures, diagnosis: diagnosis.map_err(Failure::new)? })
    }
}

/// A fault with what to do about it, as one sentence after the other.
fn in_full(fault: &fieldgap_input::Fault) -> Failure {
    let help = miette::Diagnostic::help(fault).map(|help| format!("; {help}"));
    Failure::new(format!("{fault}{}", help.unwrap_or_default()))
}
