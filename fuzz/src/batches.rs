//! Files of batches, and answers of Slurm.

use std::path::{Path, PathBuf};

use fieldgap::jobs::slurm::{
    parse_config, parse_job_id, parse_sacct, parse_scontrol, parse_squeue,
};
use fieldgap::jobs::{Batch, JobError, Results};

/// The batch whose results are read.
const BATCH: &[u8] = include_bytes!("../corpus/batch/three.json");

/// `batch.json`.
pub fn batch(case: &[u8]) {
    match Batch::parse(PathBuf::from("case"), case) {
        Ok(batch) => assert!((1..=batch.items().len()).contains(&batch.shards())),
        Err(error) => assert!(matches!(error, JobError::NotABatch { .. }), "{error}"),
    }
}

/// The merged results of a batch of three items.
pub fn results(case: &[u8]) {
    let batch = Batch::parse(PathBuf::from("case"), BATCH).expect("a good batch");
    let Ok(results) = Results::read(case, Path::new("case"), &batch, None) else { return };
    let mut read = 0;
    for (number, result) in results.enumerate() {
        match result {
            Ok(result) => assert_eq!(result.item, number),
            Err(error) => {
                assert!(matches!(error, JobError::Damaged { .. }), "{error}");
                return;
            }
        }
        read += 1;
    }
    assert_eq!(read, batch.items().len());
}

/// What Slurm's commands print.
pub fn slurm(case: &[u8]) {
    let text = String::from_utf8_lossy(case);
    let job = parse_job_id(&text).unwrap_or(7);
    for job in [7, job] {
        for parse in [parse_squeue, parse_sacct, parse_scontrol] {
            assert!(parse(&text, job).iter().all(|report| !report.tasks.is_empty()));
        }
    }
    let _ = parse_config(&text, "MaxArraySize");
}
