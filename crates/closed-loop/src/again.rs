//! The decisions of a record made again.

use fieldgap_input::{Fault, TomlSource};
use fieldgap_records::{Plan, Readings, RecordedScan};

use crate::log::LoggedRound;
use crate::searches::up_to;

/// Every decision made again from a finished record and its plan, the first round as it was logged. `decide` gives, for the plan, the readings
/// and the rounds so far, the next round and the text of the longer plan. A round whose readings are not those of the plan has none.
///
/// # Errors
/// As `decide`; a [`Fault`] if the longer plan is wrong.
pub fn again<R: LoggedRound + Clone, E: From<Fault>>(
    plan: &Plan,
    record: &RecordedScan,
    rounds: &[R],
    decide: impl Fn(&Plan, &RecordedScan, &[R]) -> Result<(R, Option<String>), E>,
) -> Result<Vec<R>, E> {
    let mut again: Vec<R> = rounds.iter().take(1).cloned().collect();
    for (number, round) in rounds.iter().enumerate().skip(1) {
        let mut so_far = plan.clone();
        so_far.readings.truncate(number);
        let seen = up_to(record, round.before());
        let (mut made, longer) = decide(&so_far, &seen, &rounds[..number])?;
        if let Some(text) = longer {
            let source = TomlSource::new(plan.path(), text);
            let chosen = Plan::parse(source)?.readings.pop();
            let told = |readings: &Readings| (readings.list.clone(), readings.speeds_mm_s.clone());
            if chosen.as_ref().map(told) != plan.readings.get(number).map(told) {
                made.forget_readings();
            }
        }
        again.push(made);
    }
    Ok(again)
}
