//! The page of a closed loop: where each round measured, what it knew, and why it went on.
//!
//! All of it is read from the record: `rounds.jsonl`, the plan and the readings.

mod figures;
mod page;
mod set;
mod tables;

use std::path::{Path, PathBuf};

use self::figures::RoundsFigures;
use super::context::ReportContext;
use super::error::ReportError;
use super::folder::Folder;
use fieldgap_closed_loop::{ROUNDS_FILE, Round};
use fieldgap_records::{ClosedLoop, RecordedSample, RecordedScan, Visit, VisitPace};

/// A closed loop, ended or not.
#[derive(Debug, Clone, Copy)]
pub struct LoopOfRounds<'a> {
    /// Its decisions; at least one.
    pub rounds: &'a [Round],
    /// The readings.
    pub record: &'a RecordedScan,
    /// The visits of the plan: reading k belongs to visit k.
    pub visits: &'a [Visit],
    /// What the plan allows.
    pub settings: &'a ClosedLoop,
}

/// The files of the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RoundsFiles {
    /// The page.
    pub index: PathBuf,
    /// The pictures, PNG and SVG.
    pub pictures: Vec<PathBuf>,
}

impl<'a> LoopOfRounds<'a> {
    /// The readings of a round, as far as they were taken.
    fn samples(&self, round: &Round) -> &'a [RecordedSample] {
        let all = &self.record.samples;
        let from = round.before.min(all.len());
        &all[from..(round.before + round.readings).min(all.len())]
    }

    /// Which readings of a round were taken in motion.
    fn flown(&self, round: &Round) -> impl Iterator<Item = bool> {
        let paces = self.visits.iter().skip(round.before).map(|visit| visit.pace);
        let flown = paces.map(|pace| matches!(pace, VisitPace::Flown(_)));
        flown.chain(std::iter::repeat(false)).take(self.samples(round).len())
    }

    /// Whether any reading was taken in motion.
    fn flies(&self) -> bool {
        self.rounds.iter().any(|round| self.flown(round).any(|flown| flown))
    }

    /// The rounds that took readings.
    fn measured(&self) -> impl Iterator<Item = &'a Round> {
        self.rounds.iter().filter(|round| !self.samples(round).is_empty())
    }

    /// From the first reading to the last, s on the robot's clock.
    fn duration_s(&self) -> f64 {
        duration_s(&self.record.samples)
    }
}

/// From the first reading to the last, s.
fn duration_s(samples: &[RecordedSample]) -> f64 {
    samples.first().zip(samples.last()).map_or(0.0, |(first, last)| last.time_s - first.time_s)
}

/// Writes the page of a closed loop into a folder, which is created if it is missing.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_rounds(
    dir: &Path,
    context: &ReportContext,
    of: LoopOfRounds<'_>,
) -> Result<RoundsFiles, ReportError> {
    let figures = RoundsFigures::draw(&of)?;
    let folder = Folder::make(dir)?;
    let pictures = folder.put_figures(figures.all())?;
    let lines: Result<Vec<String>, serde_json::Error> =
        of.rounds.iter().map(serde_json::to_string).collect();
    folder.put(ROUNDS_FILE, (lines?.join("\n") + "\n").as_bytes())?;
    // The page comes last: where it exists, the report is complete.
    let index = folder.put("index.html", page::page(context, &of, &figures).as_bytes())?;
    Ok(RoundsFiles { index, pictures })
}
