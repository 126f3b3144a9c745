//! The page of a campaign: one HTML file with its pictures beside it.

use maud::{Markup, PreEscaped, html};

use super::super::html::{document, navigation, section};
use super::super::page::STYLE;
use super::shades::CLASSES;
use super::{alarms, cells, facts, headline, next_steps};
use fieldgap_campaign::{CellStatus, Overview};

/// The styles of this page alone.
const OWN_STYLE: &str = include_str!("style.css");

/// Keeps what the reader chose, and loads the page again while the campaign runs.
const SCRIPT: &str = include_str!("page.js");

/// The page with the section of trends, and that of maps where there are any.
pub(super) fn page(overview: &Overview, trends: &Markup, maps: Option<Markup>) -> String {
    let sections = [
        ("alarms", "Alarms", alarms::alarms(overview)),
        ("cells", "Cells", Some(cells::cells(overview))),
        ("next", "Next steps", next_steps::next_steps(overview)),
        ("trends", "Trends", Some(trends.clone())),
        ("maps", "Maps", maps),
        ("missing", "Not measured", facts::missing(overview)),
        ("used", "What was used", Some(facts::used(overview))),
    ];
    let present: Vec<(&str, &str, Markup)> = sections
        .into_iter()
        .filter_map(|(id, heading, content)| Some((id, heading, content?)))
        .collect();
    let body = html! {
        header class="campaign" {
            h1 { (headline::headline(overview)) }
            p class="subtitle" { (subtitle(overview)) }
            (progress(overview))
            @if let Some(question) = next_steps::question(overview) { (question) }
        }
        (navigation(present.iter().map(|(id, heading, _)| (*id, *heading))))
        main { @for (id, heading, content) in &present { (section(id, heading, content)) } }
        script { (PreEscaped(SCRIPT)) }
    };
    document(&format!("{}: campaign", overview.name), &[STYLE, OWN_STYLE, &CLASSES], &body)
}

/// Which campaign it is, and how far.
fn subtitle(overview: &Overview) -> String {
    let begun = overview.rounds_begun.len();
    let round = match (begun, overview.rounds) {
        (_, 0 | 1) => String::new(),
        (0, rounds) => format!(", {rounds} rounds, none begun"),
        (begun, rounds) => format!(", round {begun} of {rounds}"),
    };
    let newest = overview.cells.iter().filter_map(|cell| Some(cell.run.as_ref()?.at)).max();
    let newest = newest.map_or(String::new(), |at| {
        format!(". Newest cell: {}", at.strftime("%Y-%m-%d %H:%M UTC"))
    });
    let state = if overview.ended { "not running" } else { "running" };
    format!("Campaign {}, {state}{round}{newest}", overview.name)
}

/// A bar of done, failed and open cells, and the box that turns loading off.
fn progress(overview: &Overview) -> Markup {
    let [done, failed, open] = overview.counts();
    let scanning = overview
        .cells
        .iter()
        .filter(|cell| matches!(cell.status, CellStatus::Scanning | CellStatus::Measured))
        .count();
    let words =
        format!("{done} done, {failed} failed, {scanning} in work, {} not begun", open - scanning);
    html! {
        div class="progress" role="img" aria-label=(words) {
            @for (class, count) in [("done", done), ("failed", failed), ("work", scanning), ("open", open - scanning)] {
                @if count > 0 { i class=(class) style={ "flex-grow:" (count) } {} }
            }
        }
        p class="counts" {
            (words) "."
            @if !overview.ended {
                " " label { input type="checkbox" id="renew" checked; " load this page again every 30 s" }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::example::{cell, overview};
    use super::super::matrix::Matrix;
    use super::*;

    fn page_of(overview: &Overview) -> String {
        page(overview, &html! {}, None)
    }

    #[test]
    fn the_page_loads_itself_again_only_while_the_campaign_runs() {
        let mut campaign = overview();
        assert!(!page_of(&campaign).contains("id=\"renew\""));
        campaign.ended = false;
        assert!(page_of(&campaign).contains("id=\"renew\" checked"));
    }

    /// The words of a page, a line for each block: no tags, no style, no script.
    fn words(page: &str) -> String {
        let body = page.split_once("<body>").expect("a body").1;
        let body = body.split_once("<script>").expect("a script").0;
        let mut words = String::new();
        for piece in body.split('<') {
            let (tag, text) = piece.split_once('>').unwrap_or(("", piece));
            let name = tag.split(' ').next().unwrap_or_default();
            match name {
                "/td" | "/th" | "/span" => words.push_str(" | "),
                "tr" | "p" | "li" | "h1" | "h2" | "h3" | "summary" | "pre" | "label" => {
                    words.push('\n')
                }
                _ => {}
            }
            words.push_str(text);
        }
        let lines = words.lines().map(str::trim).filter(|line| !line.is_empty());
        lines.collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn the_words_of_a_page() {
        let mut campaign = overview();
        campaign.alarms.push(super::super::example::alarm(false));
        insta::assert_snapshot!(words(&page_of(&campaign)));
    }

    #[test]
    fn an_open_question_stands_at_the_top_with_the_command_that_answers_it() {
        let mut campaign = overview();
        assert!(!page_of(&campaign).contains("campaign answer"));
        (campaign.question, campaign.ended) = (Some("Put the screen in".to_owned()), false);
        let page = page_of(&campaign);
        let place = |words: &str| page.find(words).unwrap_or_else(|| panic!("{words}"));
        assert!(place("waits for a person: Put the screen in") < place("<nav"));
        assert!(place("fieldgap campaign answer 'out/two foci' yes") < place("<nav"));
    }

    #[test]
    fn nothing_comes_from_outside() {
        let page = page_of(&overview());
        for outside in ["http:", "https:", "@import", "src=\"//"] {
            assert!(!page.contains(outside), "{outside}");
        }
    }

    #[test]
    fn one_cell_and_no_cell_have_a_page() {
        let mut campaign = overview();
        campaign.cells.truncate(1);
        campaign.dimensions.clear();
        campaign.cells[0].values.clear();
        assert!(page_of(&campaign).contains("<th scope=\"row\">all</th>"));
        campaign.cells.clear();
        campaign.alarms.clear();
        assert!(page_of(&campaign).contains("The campaign has no cells"));
    }

    #[test]
    fn a_thousand_cells_have_a_page() {
        let mut campaign = overview();
        campaign.cells = (0..1200)
            .map(|number| cell(1 + number / 100, &format!("x={}", number % 100)))
            .collect();
        for (number, cell) in campaign.cells.iter_mut().enumerate() {
            cell.id = format!("cell-{number}");
            cell.values = vec![number % 100];
        }
        assert_eq!(
            (Matrix::of(&campaign).rows.len(), Matrix::of(&campaign).columns.len()),
            (100, 12)
        );
        let page = page_of(&campaign);
        assert_eq!(page.matches("/report/index.html").count(), 1200 + campaign.alarms.len());
    }

    proptest! {
        #[test]
        fn no_name_adds_markup(name in "\\PC{0,20}|[<>&\"'\\x00-\\x1f]{0,20}") {
            let page_with = |name: &str| {
                let mut campaign = overview();
                campaign.name = name.to_owned();
                campaign.alarms[0].sentence = name.to_owned();
                campaign.alarms[0].cause = Some(name.to_owned());
                campaign.dimensions[0].name = name.to_owned();
                campaign.dimensions[0].values[0] = name.to_owned();
                campaign.rigs_left = [(name.to_owned(), name.to_owned())].into();
                campaign.not_set = vec![name.to_owned()];
                campaign.ended_early = Some(name.to_owned());
                campaign.question = Some(name.to_owned());
                campaign.cells[1].id = name.to_owned();
                campaign.cells[3].setting = name.to_owned();
                campaign.cells[3].status = CellStatus::Failed { reason: name.to_owned() };
                page_of(&campaign)
            };
            let (page, empty) = (page_with(&name), page_with(""));
            for markup in ['<', '>', '"'] {
                let count = |page: &str| page.matches(markup).count();
                prop_assert_eq!(count(&page), count(&empty), "{}", page);
            }
        }
    }
}
