//! What a campaign is going to take, before anything moves.

use jiff::Timestamp;
use serde::Serialize;

use super::budget::Use;
use super::condition::SetBy;
use super::error::CampaignError;
use super::file::Campaign;
use super::runner::planned_use;

/// What a campaign is going to take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forecast {
    /// Name of the campaign.
    pub name: String,
    /// Names of the rigs.
    pub rigs: Vec<String>,
    /// Rounds.
    pub rounds: u32,
    /// Cells of a round, over all rigs.
    pub cells_a_round: usize,
    /// Readings of a round.
    pub readings_a_round: usize,
    /// Duration of a round, s: that of the slowest rig, without waits for conditions.
    pub round_s: f64,
    /// Time with the array driven and robot paths, of all rounds and rigs.
    pub used: Use,
    /// Disk space of all records, bytes.
    pub bytes: u64,
    /// What a person is going to be asked in a round, in order.
    pub questions: Vec<String>,
    /// The first starts.
    pub starts: Vec<Timestamp>,
    /// What the budget says to it, if it does not suffice.
    pub exceeds: Option<String>,
}

/// Most starts that are listed.
const STARTS: usize = 5;

impl Campaign {
    /// Checks every cell against its rig, as `scan --dry-run` does, and adds up what the campaign takes.
    ///
    /// # Errors
    /// [`CampaignError`] at the first cell that cannot be scanned.
    pub fn forecast(&self, seed: u64, now: Timestamp) -> Result<Forecast, CampaignError> {
        let blocks = self.round(1, seed);
        let mut of_round = Use::default();
        let (mut cells, mut readings, mut bytes, mut round_s) = (0, 0, 0, 0.0);
        let mut questions = Vec::new();
        for block in &blocks {
            for (condition, &value) in self.conditions.iter().zip(&block.conditions) {
                if let SetBy::Person(question) = &condition.setting {
                    questions.push(condition.values[value].within(question));
                }
            }
            let mut slowest_s = 0.0_f64;
            for queue in &block.queues {
                let mut queue_s = 0.0;
                for cell in queue {
                    let scan = self.scan_of(cell)?;
                    let label = self.setting_of(cell);
                    let wrong = |source| CampaignError::of_cell(&label, source);
                    let check = scan.dry_run();
                    let (check, planned) =
                        check.and_then(|check| Ok((check, planned_use(&scan)?))).map_err(wrong)?;
                    cells += 1;
                    readings += check.visits;
                    bytes += check.bytes;
                    queue_s += check.about_s;
                    of_round = of_round + planned;
                }
                slowest_s = slowest_s.max(queue_s);
            }
            round_s += slowest_s;
        }
        let rounds = self.schedule.rounds;
        let times = f64::from(rounds);
        let used = Use {
            time_s: round_s * times,
            emitting_s: of_round.emitting_s * times,
            way_m: of_round.way_m * times,
        };
        let mut starts = Vec::new();
        let mut next = self.schedule.start_from(now, now);
        while let Some(start) = next.filter(|_| starts.len() < STARTS.min(rounds as usize)) {
            starts.push(start);
            let earliest = jiff::SignedDuration::try_from_secs_f64(round_s.max(1.0)).ok();
            next = earliest
                .and_then(|round| start.checked_add(round).ok())
                .and_then(|after| self.schedule.start_from(now, after));
        }
        let exceeds = self.budget.refuses(Use::default(), used);
        Ok(Forecast {
            name: self.name.clone(),
            rigs: self.benches.iter().map(|bench| bench.name.clone()).collect(),
            rounds,
            cells_a_round: cells,
            readings_a_round: readings,
            round_s,
            used,
            bytes: bytes.saturating_mul(u64::from(rounds)),
            questions,
            starts,
            exceeds,
        })
    }
}
