//! What was known of a record before.

use std::path::Path;

use fieldgap_acoustics::Simulator;
use fieldgap_archive::RecordFigures;
use fieldgap_comparison::{Registering, compare};
use fieldgap_diagnosis::{EffectId, Verdict};
use fieldgap_records::RecordedScan;
use serde::{Deserialize, Serialize};

/// What was known of a record before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Before {
    /// The simulator.
    pub simulator: Simulator,
    /// The gap, relative to the scan's rms; `None` if there was no comparison and none is possible.
    pub gap: Option<f64>,
    /// The verdict; `None` without a diagnosis.
    pub verdict: Option<Verdict>,
    /// The named effects.
    pub effects: Vec<EffectId>,
    /// Whether the gap is that of the record's report. Without a report, it is computed with the record's own simulator.
    pub from_report: bool,
}

impl Before {
    /// Reads the report of a record, or compares the record as its plan had asked.
    pub(crate) fn of(folder: &Path, scan: &RecordedScan) -> Self {
        // A damaged report is as good as none: the record is to be analysed again.
        if let Ok(Some(figures)) = RecordFigures::read(folder) {
            let cause = figures.cause;
            return Self {
                simulator: figures.simulator,
                gap: Some(figures.gap.value).filter(|gap| gap.is_finite()),
                verdict: cause.as_ref().map(|cause| cause.verdict),
                effects: cause.map(|cause| cause.effects).unwrap_or_default(),
                from_report: true,
            };
        }
        let simulator = scan.setup.simulator;
        let comparison = compare(scan, simulator, Registering::Auto).ok();
        Self {
            simulator,
            gap: comparison.map(|comparison| comparison.overall.residual_rms_ratio),
            verdict: None,
            effects: Vec::new(),
            from_report: false,
        }
    }
}
