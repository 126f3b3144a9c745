//! Sealed rigs: each is measured by its own plan, and what was measured is diagnosed.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use miette::{IntoDiagnostic, miette};
use serde::Serialize;

use super::closed_loop::{LoopArgs, begun, resumed};
use fieldgap_acquisition::{Ending, PlannedScan};
use fieldgap_blind::{Diagnosed, RIG, Run};
use fieldgap_closed_loop::{End, Verification, read_rounds};
use fieldgap_diagnosis::{Diagnosis, EffectId, Verdict, alike_effects, are_alike, diagnose};
use fieldgap_records::{Journal, RecordedScan};

/// What follows the folder of the diagnoses in the name of that of the records.
const RECORDS: &str = "-records";

/// Rigs of a set.
pub(super) struct BlindRigs<'r> {
    pub(super) run: &'r Run,
    /// The plan, in the folder of each rig.
    pub(super) plan: String,
}

/// A diagnosis with what it cost.
#[derive(Serialize)]
struct OfRig {
    #[serde(flatten)]
    diagnosis: Diagnosis,
    measurement: Measurement,
}

/// What was measured.
#[derive(Serialize)]
struct Measurement {
    readings: usize,
    /// On the rig's clock.
    seconds: f64,
    end: Option<End>,
    verification: Option<Verification>,
    /// Whether the readings cannot tell the rivals apart, to first order; `None` without rivals, or where that is not known of any.
    rivals_alike: Option<bool>,
}

/// Whether the most probable set of an ambiguous diagnosis is alike to each rival of which that is known.
fn rivals_alike(scan: &RecordedScan, diagnosis: &Diagnosis) -> miette::Result<Option<bool>> {
    let (Some((first, rivals)), true) =
        (diagnosis.alternatives.split_first(), diagnosis.verdict == Verdict::Ambiguous)
    else {
        return Ok(None);
    };
    let alike = alike_effects(scan, Some(diagnosis.simulator)).into_diagnostic()?;
    let (gap, noise) = (diagnosis.gap_before, diagnosis.noise_floor);
    // The effects that two sets share make a part of the gap that does not tell them apart.
    let beside_shared = |rival: &[EffectId]| {
        let is_shared = |id: &EffectId| first.contains(id) && rival.contains(id);
        let steps = diagnosis.waterfall.iter();
        let shared: f64 = steps
            .filter(|step| step.effect.as_ref().is_some_and(is_shared))
            .map(|step| step.share)
            .sum();
        ((gap * gap - noise * noise) * (1.0 - shared)).max(0.0).sqrt() / noise
    };
    let known =
        rivals.iter().filter_map(|rival| are_alike(&alike, [first, rival], beside_shared(rival)));
    Ok(known.reduce(|one, other| one && other))
}

/// The names of the rigs in a folder; none where it holds scans.
pub(super) fn rigs_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let rigs = entries.filter(|entry| entry.path().join(RIG).exists());
    let mut names: Vec<String> =
        rigs.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable();
    names
}

impl BlindRigs<'_> {
    /// Measures and diagnoses rigs, as many at a time as there are processors. `done` is called after each. One that fails does not stop
    /// the others.
    pub(super) fn each(&self, names: &[String], done: impl Fn(miette::Result<Diagnosed>) + Sync) {
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let next = AtomicUsize::new(0);
        let (next, done) = (&next, &done);
        std::thread::scope(|scope| {
            for _ in 0..threads.min(names.len()) {
                scope.spawn(move || {
                    while let Some(name) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
                        done(self.one(name));
                    }
                });
            }
        });
    }

    fn one(&self, name: &str) -> miette::Result<Diagnosed> {
        let begun = std::time::Instant::now();
        let folder = self.measured(name)?;
        let scans = [RecordedScan::open(&folder)?];
        let diagnosis = diagnose(&scans, None).into_diagnostic()?;
        let last = read_rounds(&folder).into_diagnostic()?.pop();
        let samples = &scans[0].samples;
        let measurement = Measurement {
            readings: samples.len(),
            seconds: samples.first().zip(samples.last()).map_or(0.0, |(a, b)| b.time_s - a.time_s),
            end: last.as_ref().and_then(|round| round.end),
            verification: last.and_then(|round| round.verification),
            rivals_alike: rivals_alike(&scans[0], &diagnosis)?,
        };
        let json = serde_json::to_vec(&OfRig { diagnosis, measurement }).into_diagnostic()?;
        let diagnosed = self.run.keep(name, &json)?;
        Ok(Diagnosed { seconds: Some(begun.elapsed().as_secs_f64()), ..diagnosed })
    }

    /// Measures a rig, and gives the folder of the record. One that was measured before is kept, and one that was measured in part is
    /// completed.
    fn measured(&self, name: &str) -> miette::Result<PathBuf> {
        let at = self.run.folder.join(name);
        let mut records = self.run.diagnoses.clone().into_os_string();
        records.push(RECORDS);
        let record = PathBuf::from(records).join(name);
        let is_begun = record.join("scan.toml").exists();
        if is_begun && Journal::resumable(&record).is_err() {
            return Ok(record);
        }
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .into_diagnostic()?;
        let scan_run = if is_begun {
            runtime.block_on(resumed(&record))?
        } else {
            let scan = PlannedScan::read(&at.join(&self.plan), Some(&at.join(RIG)))?;
            let (scan, opening) = LoopArgs::default().opened(scan, &record)?;
            runtime.block_on(begun(scan, &record, opening))?
        };
        let ending = runtime.block_on(scan_run.run(&mut |_| (), std::future::pending()))?;
        match ending {
            Ending::Complete => Ok(record),
            Ending::Partial { reason } => {
                Err(miette!("{name} was measured only in part: {reason}"))
            }
        }
    }
}
