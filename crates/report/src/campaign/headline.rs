//! The first sentence of the page of a campaign.

use fieldgap_campaign::{AlarmOverview, CellStatus, Overview};
use fieldgap_monitoring::Scope;
use fieldgap_text::percent;

/// The most words of a headline.
#[cfg(test)]
const MOST_WORDS: usize = 15;

/// The longest name that a headline holds, characters.
const LONGEST_NAME: usize = 40;

/// What a reader has to know first, in at most fifteen words.
pub(super) fn headline(overview: &Overview) -> String {
    let open: Vec<&AlarmOverview> = overview.alarms.iter().filter(|alarm| alarm.open).collect();
    if let Some(largest) = largest(&open) {
        let count = match open.len() {
            1 => "1 alarm".to_owned(),
            several => format!("{several} alarms"),
        };
        return format!("{count}: {}", change(largest));
    }
    let cells = overview.cells.len();
    let count =
        |of: fn(&CellStatus) -> bool| overview.cells.iter().filter(|cell| of(&cell.status)).count();
    let done = count(|status| matches!(status, CellStatus::Done { .. }));
    let failed = count(|status| matches!(status, CellStatus::Failed { .. }));
    if cells == 0 {
        return "The campaign has no cells".to_owned();
    }
    let done = match (done, overview.ended_early.is_some()) {
        (done, _) if done == cells && round_is_last(overview) => format!("All {cells} cells done"),
        (done, true) => format!("Ended early: {done} of {cells} cells done"),
        (done, false) => format!("{done} of {cells} cells done"),
    };
    let failed = match failed {
        0 => String::new(),
        failed => format!(", {failed} failed"),
    };
    let limits = match (overview.charts.is_empty(), overview.alarms.is_empty()) {
        (true, _) => "no control charts yet",
        (false, true) => "no figure left its limits",
        (false, false) => "no open alarm",
    };
    format!("{done}{failed}; {limits}")
}

/// Whether no round is to come.
fn round_is_last(overview: &Overview) -> bool {
    overview.rounds_begun.len() as u32 >= overview.rounds
}

/// The alarm of the largest statistic against its limit; that of the gap goes before the others.
fn largest<'a>(alarms: &[&'a AlarmOverview]) -> Option<&'a AlarmOverview> {
    let size = |one: &AlarmOverview| {
        let beyond = one.alarm.statistic.abs() / one.alarm.limit;
        (one.alarm.figure == fieldgap_campaign::GAP, if beyond.is_finite() { beyond } else { 0.0 })
    };
    alarms.iter().copied().max_by(|one, other| {
        let (one, other) = (size(one), size(other));
        one.0.cmp(&other.0).then(one.1.total_cmp(&other.1))
    })
}

/// What changed, where, by how much and since when.
fn change(one: &AlarmOverview) -> String {
    let alarm = &one.alarm;
    let verb = match (alarm.figure == fieldgap_campaign::GAP, alarm.statistic > 0.0) {
        (true, true) => "grew",
        (true, false) => "shrank",
        (false, true) => "rose",
        (false, false) => "fell",
    };
    let place = match &alarm.scope {
        Scope::AllCells => "all cells".to_owned(),
        Scope::Cell(cell) => short(cell),
    };
    let size =
        alarm.relative.map_or(String::new(), |part| format!(" by {}", percent(part.value.abs())));
    let since = alarm.since.strftime("%Y-%m-%d");
    format!("the {} of {place} {verb}{size} since {since}", short(&alarm.figure))
}

/// A name that is no longer than a headline bears, in one word.
fn short(name: &str) -> String {
    let words: Vec<&str> = name.split_whitespace().collect();
    let joined = words.join("\u{a0}");
    if joined.chars().count() <= LONGEST_NAME {
        return joined;
    }
    joined.chars().take(LONGEST_NAME - 1).chain(['…']).collect()
}
