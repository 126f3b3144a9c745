//! The first sentence of the page of a campaign.

use fieldgap_campaign::{AlarmOverview, GAP, Overview};
use fieldgap_monitoring::Scope;
use fieldgap_text::percent;

/// The most words of a name in a headline: with those of the longest sentence they are fifteen.
const WORDS_OF_A_NAME: usize = 4;

/// The longest name in a headline, characters: half a line on a wide screen.
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
    if cells == 0 {
        return "The campaign has no cells".to_owned();
    }
    let [done, failed, _] = overview.counts();
    let all = done == cells && overview.rounds_begun.len() as u32 >= overview.rounds;
    let done = match overview.ended_early {
        _ if all && cells > 1 => format!("All {cells} cells done"),
        Some(_) => format!("Ended early: {done} of {cells} cells done"),
        None => format!("{done} of {cells} cells done"),
    };
    let failed = match failed {
        0 => String::new(),
        failed => format!(", {failed} failed"),
    };
    let limits = match (overview.charts.is_empty(), overview.alarms.is_empty()) {
        (true, true) => "no control charts yet",
        (false, true) => "no figure left its limits",
        (_, false) => "no open alarm",
    };
    format!("{done}{failed}; {limits}")
}

/// The alarm that is farthest beyond its limit; those of the gap of all readings go before the others.
fn largest<'a>(alarms: &[&'a AlarmOverview]) -> Option<&'a AlarmOverview> {
    let of_the_gap = |one: &AlarmOverview| one.alarm.figure == GAP;
    let beyond = |one: &AlarmOverview| one.alarm.statistic.abs() / one.alarm.limit;
    alarms.iter().copied().max_by(|one, other| {
        of_the_gap(one).cmp(&of_the_gap(other)).then(beyond(one).total_cmp(&beyond(other)))
    })
}

/// What changed, where, by how much and since when.
fn change(one: &AlarmOverview) -> String {
    let alarm = &one.alarm;
    let verb = alarm.verb();
    let place = match &alarm.scope {
        Scope::AllCells => "all cells".to_owned(),
        Scope::CellByCell => "single cells".to_owned(),
        Scope::Cell(cell) => short(cell, WORDS_OF_A_NAME),
    };
    let size =
        alarm.relative.map_or(String::new(), |part| format!(" by {}", percent(part.value.abs())));
    let since = alarm.since.strftime("%Y-%m-%d");
    format!("the {} of {place} {verb}{size} since {since}", short(&alarm.figure, 1))
}

/// A name, cut where it is too long for a headline.
fn short(name: &str, most_words: usize) -> String {
    let words: Vec<&str> = name.split_whitespace().collect();
    let kept = words[..words.len().min(most_words)].join(" ");
    let letters: String = kept.chars().take(LONGEST_NAME).collect();
    let whole = words.len() <= most_words && letters.len() == kept.len();
    if whole { letters } else { format!("{letters}…") }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::example::{alarm, charts, overview};
    use super::*;

    fn words(headline: &str) -> usize {
        headline.split_whitespace().count()
    }

    #[test]
    fn alarms_come_first() {
        let mut campaign = overview();
        let expected = "1 alarm: the gap of focus=left grew by 6.00\u{a0}% since 2026-11-22";
        assert_eq!(headline(&campaign), expected);
        let mut level = alarm(true);
        (level.alarm.figure, level.alarm.statistic) = ("level".to_owned(), -60.0);
        campaign.alarms.push(level);
        assert!(headline(&campaign).starts_with("2 alarms: the gap"), "the gap goes first");
        campaign.alarms.remove(0);
        campaign.alarms[0].alarm.relative = None;
        assert_eq!(headline(&campaign), "1 alarm: the level of focus=left fell since 2026-11-22");
    }

    #[test]
    fn without_alarms_progress_comes_first() {
        let mut campaign = overview();
        campaign.alarms = vec![alarm(false)];
        assert_eq!(headline(&campaign), "Ended early: 3 of 4 cells done, 1 failed; no open alarm");
        campaign.alarms.clear();
        campaign.ended_early = None;
        campaign.cells.pop();
        assert_eq!(headline(&campaign), "3 of 3 cells done; no control charts yet");
        (campaign.charts, campaign.rounds) = (charts(), 2);
        assert_eq!(headline(&campaign), "All 3 cells done; no figure left its limits");
        campaign.cells.clear();
        assert_eq!(headline(&campaign), "The campaign has no cells");
    }

    proptest! {
        #[test]
        fn a_headline_has_at_most_fifteen_words(
            figure in "\\PC{0,60}", cell in "(\\PC{0,12} ){0,12}", relative: bool, alarms in 0..3usize, failed: bool,
        ) {
            let mut campaign = overview();
            let mut one = alarm(true);
            (one.alarm.figure, one.alarm.scope) = (figure, Scope::Cell(cell));
            one.alarm.relative = one.alarm.relative.filter(|_| relative);
            campaign.alarms = vec![one; alarms];
            if !failed {
                campaign.cells.pop();
            }
            for charts in [Default::default(), charts()] {
                campaign.charts = charts;
                prop_assert!(words(&headline(&campaign)) <= 15, "{}", headline(&campaign));
            }
        }
    }
}
