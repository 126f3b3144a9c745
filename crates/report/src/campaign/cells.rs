//! The cells of a campaign in rows and columns, coloured by a figure that the reader chooses.

use maud::{Markup, html};

use super::addresses::report_address;
use super::matrix::Matrix;
use super::shades::{SIGNED_STEPS, STATUSES, STEPS, Steps, VERDICTS, usual_relative_error};
use fieldgap_campaign::{CellOverview, CellStatus, GAP, Overview};
use fieldgap_text::{Uncertain, fixed, percent, uncertain};

/// The name of the correlation among the figures.
const CORRELATION: &str = "correlation";

/// What colour and text of the cells can show: name of the choice, words.
const CHOICES: [(&str, &str); 5] = [
    ("gap", "gap"),
    ("correlation", "correlation"),
    ("verdict", "verdict"),
    ("change", "change against baseline"),
    ("status", "status"),
];

/// The scales of the figures; `None` where no cell has the figure.
struct Scales {
    gap: Option<Steps>,
    correlation: Option<Steps>,
    change: Option<Steps>,
    verdicts: bool,
}

impl Scales {
    fn of(overview: &Overview) -> Self {
        let all =
            |name: &'static str| overview.cells.iter().filter_map(move |cell| figure(cell, name));
        let changes = overview.cells.iter().filter_map(|cell| cell.gap_change);
        Self {
            gap: Steps::over(all(GAP)),
            correlation: Steps::over(all(CORRELATION)),
            change: Steps::about_zero(changes, usual_relative_error(all(GAP))),
            verdicts: overview.cells.iter().any(|cell| cell.verdict.is_some()),
        }
    }

    /// Whether there is something to see for a choice.
    fn has(&self, choice: &str) -> bool {
        match choice {
            "gap" => self.gap.is_some(),
            "correlation" => self.correlation.is_some(),
            "change" => self.change.is_some(),
            "verdict" => self.verdicts,
            _ => true,
        }
    }
}

/// The choices, the legend and the table.
pub(super) fn cells(overview: &Overview) -> Markup {
    if overview.cells.is_empty() {
        return html! { p { "The campaign has no cells." } };
    }
    let scales = Scales::of(overview);
    let matrix = Matrix::of(overview);
    let offered: Vec<(&str, &str)> =
        CHOICES.into_iter().filter(|(choice, _)| scales.has(choice)).collect();
    html! {
        fieldset class="choices" {
            legend { "Colour and text" }
            @for (number, (choice, words)) in offered.iter().enumerate() {
                label {
                    input type="radio" name="by" id={ "by-" (choice) } checked[number == 0];
                    " " (words)
                }
            }
        }
        (legend(&scales, overview))
        p class="counts" {
            "Rows: " (matrix.row_names) ". Columns: " (matrix.column_names)
            ". A cell leads to its report."
        }
        div class="wide matrix" role="region" aria-label="Table of cells" tabindex="0" {
            table {
                thead {
                    tr {
                        th scope="col" { (matrix.row_names) }
                        @for column in &matrix.columns { th scope="col" { (column) } }
                    }
                }
                tbody {
                    @for (name, row) in matrix.each_row() {
                        tr {
                            th scope="row" { (name) }
                            @for cell in row {
                                @match cell { Some(cell) => (one(cell, &scales)), None => td {} }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A cell of the table: the text of every choice, of which the style sheet shows one.
fn one(cell: &CellOverview, scales: &Scales) -> Markup {
    let texts = texts(cell);
    let content = html! {
        @for (choice, text) in &texts { span class=(choice) { (text) } }
        (marks(cell))
    };
    html! {
        td class=(classes(cell, scales)) title=(description(cell)) {
            @if matches!(cell.status, CellStatus::Done { .. }) {
                a href=(report_address(&cell.id)) { (content) }
            } @else { (content) }
        }
    }
}

/// The classes that colour it.
fn classes(cell: &CellOverview, scales: &Scales) -> String {
    let step = |letter: char, step: Option<usize>| step.map(|step| format!("{letter}{step}"));
    let of = |steps: Option<Steps>, value: Option<f64>| steps.and_then(|steps| steps.step(value?));
    let value = |name: &str| figure(cell, name).map(|figure| figure.value);
    let verdict = cell.verdict.as_deref().and_then(place_of_verdict);
    let status = status(cell);
    if !matches!(cell.status, CellStatus::Done { .. }) {
        return format!("s{status} {}", STATUSES[status].0);
    }
    [
        step('g', of(scales.gap, value(GAP))),
        step('c', of(scales.correlation, value(CORRELATION))),
        step('d', of(scales.change, cell.gap_change)),
        step('v', verdict),
        step('s', Some(status)),
        cell.alarm.then(|| "alarm".to_owned()),
        (STATUSES[status].0 == "changed").then(|| "changed".to_owned()),
    ]
    .into_iter()
    .flatten()
    .collect::<Vec<_>>()
    .join(" ")
}

/// The text for each choice; the status where there is no other.
fn texts(cell: &CellOverview) -> Vec<(&'static str, String)> {
    let status = STATUSES[status(cell)].0;
    if !matches!(cell.status, CellStatus::Done { .. }) {
        return vec![("any", status.to_owned())];
    }
    let or_status = |text: Option<String>| text.unwrap_or_else(|| status.to_owned());
    let verdict = cell.verdict.as_deref().map(|verdict| {
        place_of_verdict(verdict).map_or(verdict.to_owned(), |place| VERDICTS[place].1.to_owned())
    });
    vec![
        ("gap", or_status(figure(cell, GAP).map(|gap| percent(gap.value)))),
        ("correlation", or_status(figure(cell, CORRELATION).map(|figure| fixed(figure.value, 3)))),
        ("verdict", or_status(verdict)),
        ("change", or_status(cell.gap_change.map(signed_percent))),
        ("status", status.to_owned()),
    ]
}

/// Marks that do not depend on colour.
fn marks(cell: &CellOverview) -> Markup {
    let problem = matches!(cell.status, CellStatus::Done { problem: Some(_), .. });
    let changed = matches!(cell.status, CellStatus::Done { changed: true, .. });
    let marks: String = [(cell.alarm, '▲'), (problem, '!'), (changed, '*')]
        .into_iter()
        .filter_map(|(is, mark)| is.then_some(mark))
        .collect();
    html! { @if !marks.is_empty() { b { "\u{a0}" (marks) } } }
}

/// All that is known of a cell, in words.
fn description(cell: &CellOverview) -> String {
    let repeat = if cell.repeat > 1 { format!(", repeat {}", cell.repeat) } else { String::new() };
    let mut words = format!("Round {}{repeat}, {}: ", cell.round, cell.setting);
    words.push_str(match &cell.status {
        CellStatus::Failed { reason } => reason,
        _ => STATUSES[status(cell)].1,
    });
    if let Some(gap) = figure(cell, GAP) {
        let hundredfold =
            Uncertain { value: 100.0 * gap.value, standard_error: 100.0 * gap.standard_error };
        words.push_str(&format!("; gap {}\u{a0}%", uncertain(hundredfold)));
    }
    if let Some(change) = cell.gap_change {
        words.push_str(&format!(", {} against the baseline", signed_percent(change)));
    }
    if let Some(correlation) = figure(cell, CORRELATION) {
        words.push_str(&format!("; correlation {}", fixed(correlation.value, 3)));
    }
    if let CellStatus::Done { problem: Some(problem), .. } = &cell.status {
        words.push_str(&format!("; {problem}"));
    }
    words
}

/// The place of the status in [`STATUSES`].
fn status(cell: &CellOverview) -> usize {
    let word = match &cell.status {
        CellStatus::Open => "open",
        CellStatus::Scanning => "scanning",
        CellStatus::Measured => "measured",
        CellStatus::Done { changed: true, .. } => "changed",
        CellStatus::Done { .. } => "done",
        CellStatus::Failed { .. } => "failed",
    };
    STATUSES.iter().position(|(of, ..)| *of == word).unwrap_or(0)
}

fn place_of_verdict(verdict: &str) -> Option<usize> {
    VERDICTS.iter().position(|(word, ..)| *word == verdict)
}

fn figure(cell: &CellOverview, name: &str) -> Option<Uncertain> {
    cell.run.as_ref()?.figures.get(name).copied()
}

/// A ratio with its sign, as a percentage.
fn signed_percent(ratio: f64) -> String {
    let words = percent(ratio);
    if ratio > 0.0 { format!("+{words}") } else { words }
}

/// What colours and marks mean.
fn legend(scales: &Scales, overview: &Overview) -> Markup {
    let bar = |letter: char, steps: usize, ends: [String; 2], words: &str| {
        html! {
            (ends[0]) " "
            @for step in 0..steps { i class={ (letter) (step) } {} }
            " " (ends[1]) " " (words)
        }
    };
    let alarms = overview.cells.iter().any(|cell| cell.alarm);
    let has = |of: fn(&CellStatus) -> bool| overview.cells.iter().any(|cell| of(&cell.status));
    html! {
        div class="legend" {
            @if let Some(steps) = scales.gap {
                p class="gap" { (bar('g', STEPS, steps.ends().map(percent), "gap: rms of scan minus simulation over rms of the scan")) }
            }
            @if let Some(steps) = scales.correlation {
                p class="correlation" { (bar('c', STEPS, steps.ends().map(|end| fixed(end, 3)), "correlation of scan and simulation")) }
            }
            @if let Some(steps) = scales.change {
                p class="change" { (bar('d', SIGNED_STEPS, steps.ends().map(signed_percent), "of the gap in the baseline")) }
            }
            @if scales.verdicts {
                p class="verdict-words" {
                    @for (number, (_, word, _)) in VERDICTS.iter().enumerate() {
                        span { i class={ "v" (number) } {} " " (word) } " "
                    }
                }
            }
            p class="status" {
                @for (number, (word, meaning, _)) in STATUSES.iter().enumerate() {
                    span { i class={ "s" (number) } {} " " (word) ": " (meaning) } " "
                }
            }
            p class="marks" {
                @if alarms { span { b { "▲" } " open alarm" } " " }
                @if has(|status| matches!(status, CellStatus::Done { problem: Some(_), .. })) { span { b { "!" } " something was not done after the scan" } " " }
                @if has(|status| matches!(status, CellStatus::Done { changed: true, .. })) { span { b { "*" } " measured with other files than those of now" } }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::example::{cell, overview};
    use super::*;

    #[test]
    fn verdicts_are_those_of_a_diagnosis() {
        use fieldgap_diagnosis::Verdict;
        let all = [
            Verdict::None,
            Verdict::Explained,
            Verdict::MostlyExplained,
            Verdict::Ambiguous,
            Verdict::Unexplained,
        ];
        assert_eq!(
            all.map(|verdict| verdict.as_str().to_owned()),
            VERDICTS.map(|(word, ..)| word.to_owned())
        );
    }

    #[test]
    fn what_is_not_done_is_said_in_every_choice() {
        let mut failed = cell(1, "focus=left");
        failed.status = CellStatus::Failed { reason: "the robot did not answer".to_owned() };
        assert_eq!(texts(&failed), [("any", "failed".to_owned())]);
        assert!(description(&failed).contains("the robot did not answer"));
        let markup = one(&failed, &Scales::of(&overview())).into_string();
        assert!(!markup.contains("<a ") && markup.contains("failed"), "{markup}");
    }

    #[test]
    fn alarms_problems_and_changes_have_marks() {
        let mut done = cell(1, "focus=left");
        done.status = CellStatus::Done { problem: Some("not compared".to_owned()), changed: true };
        done.alarm = true;
        assert!(marks(&done).into_string().contains("▲!*"));
        assert!(!marks(&cell(1, "focus=left")).into_string().contains("<b>"));
    }

    #[test]
    fn only_what_there_is_can_be_chosen() {
        let mut bare = overview();
        for cell in &mut bare.cells {
            (cell.run, cell.verdict, cell.gap_change) = (None, None, None);
        }
        let page = cells(&bare).into_string();
        assert!(page.contains("id=\"by-status\" checked") && !page.contains("by-gap"), "{page}");
    }
}
