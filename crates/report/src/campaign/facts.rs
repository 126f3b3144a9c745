//! What a campaign used, and what was not measured, with reasons.

use maud::{Markup, html};

use super::super::html::facts as table;
use super::super::words::sentence;
use super::addresses::report_address;
use fieldgap_campaign::{CellOverview, CellStatus, Overview};
use fieldgap_text::fixed;

/// The most cells of a list that are unfolded.
const MOST_UNFOLDED: usize = 10;

/// Rounds, cells and what was used.
pub(super) fn used(overview: &Overview) -> Markup {
    let [done, failed, open] = overview.counts();
    let began = overview
        .began
        .map_or("not yet".to_owned(), |at| at.strftime("%Y-%m-%d %H:%M UTC").to_string());
    let mut rows = vec![
        ("Began", html! { (began) }),
        ("Rounds begun", html! { (overview.rounds_begun.len()) " of " (overview.rounds) }),
        (
            "Cells of these rounds",
            html! { (done) " done, " (failed) " failed, " (open) " not done" },
        ),
        ("Time of the scans", html! { (duration(overview.used.time_s)) }),
        ("Time with the array driven", html! { (duration(overview.used.emitting_s)) }),
        ("Path of the robots", html! { (fixed(overview.used.way_m, 1)) " m" }),
    ];
    if overview.starts_left_out > 0 {
        let words = "left out, because a round was still going on";
        rows.push(("Starts of rounds", html! { (overview.starts_left_out) " " (words) }));
    }
    table(rows)
}

/// What was not measured or not done, and why; `None` where nothing is missing.
pub(super) fn missing(overview: &Overview) -> Option<Markup> {
    let reason_of = |cell: &CellOverview| match &cell.status {
        CellStatus::Failed { reason } => Some(reason.clone()),
        _ => None,
    };
    let problem_of = |cell: &CellOverview| match &cell.status {
        CellStatus::Done { problem, .. } => problem.clone(),
        _ => None,
    };
    let rigs = overview
        .rigs_left
        .iter()
        .map(|(rig, reason)| html! { b { (rig) } ": " (sentence(reason)) });
    let not_set = overview.not_set.iter().map(|words| html! { (sentence(words)) });
    let failed = overview.cells.iter().filter_map(|cell| Some((cell, reason_of(cell)?)));
    let failed = failed.map(|(cell, reason)| html! { b { (cell.id) } ": " (sentence(&reason)) });
    let problems = overview.cells.iter().filter_map(|cell| Some((cell, problem_of(cell)?)));
    let problems = problems
        .map(|(cell, problem)| html! { a href=(report_address(&cell.id)) { (cell.id) } ": " (sentence(&problem)) });
    let lists = [
        ("rigs-left", "Rigs that are left alone", rigs.collect::<Vec<_>>()),
        ("not-set", "Conditions that were not set", not_set.collect()),
        ("failed-cells", "Cells that failed", failed.collect()),
        (
            "problems",
            "Cells that were scanned, but not all that follows was done",
            problems.collect(),
        ),
    ];
    let any = lists.iter().any(|(.., items)| !items.is_empty());
    any.then(|| html! { @for (id, heading, items) in &lists { (list(id, heading, items)) } })
}

fn list(id: &str, heading: &str, items: &[Markup]) -> Markup {
    let (shown, more) = items.split_at(items.len().min(MOST_UNFOLDED));
    html! {
        @if !items.is_empty() {
            h3 { (heading) " (" (items.len()) ")" }
            ul { @for item in shown { li { (item) } } }
            @if !more.is_empty() {
                details id=(id) { summary { (more.len()) " more" } ul { @for item in more { li { (item) } } } }
            }
        }
    }
}

/// A time in hours, minutes or seconds.
fn duration(seconds: f64) -> String {
    match seconds {
        ..60.0 => format!("{} s", fixed(seconds, 0)),
        ..3600.0 => format!("{} min", fixed(seconds / 60.0, 1)),
        _ => format!("{} h", fixed(seconds / 3600.0, 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::example::{cell, overview};
    use super::*;

    #[test]
    fn durations_have_the_unit_that_suits_them() {
        assert_eq!([12.0, 90.0, 5400.0].map(duration), ["12 s", "1.5 min", "1.5 h"]);
    }

    #[test]
    fn long_lists_are_folded() {
        let mut many = overview();
        many.cells = (0..30).map(|number| cell(1, &format!("x={number}"))).collect();
        for cell in &mut many.cells {
            cell.status = CellStatus::Failed { reason: "no answer".to_owned() };
        }
        let words = missing(&many).expect("something is missing").into_string();
        assert!(words.contains("Cells that failed (30)") && words.contains("20 more"), "{words}");
    }
}
