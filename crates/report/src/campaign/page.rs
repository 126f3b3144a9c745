//! The page of a campaign.

use maud::{Markup, html};

use super::super::html::{document, section};
use super::super::page::STYLE;
use super::alarms::alarms;
use super::cells::{report_address, status_word};
use super::headline::headline;
use fieldgap_campaign::{CellStatus, GAP, Overview};
use fieldgap_text::{ABSENT, percent};

/// The page.
pub(super) fn page(overview: &Overview) -> String {
    let body = html! {
        header { h1 { (headline(overview)) } p class="subtitle" { "Campaign " (overview.name) } }
        main {
            @if let Some(alarms) = alarms(overview) { (section("alarms", "Alarms", &alarms)) }
            (section("cells", "Cells", &table(overview)))
        }
    };
    document(&format!("{}: campaign", overview.name), &[STYLE], &body)
}

fn table(overview: &Overview) -> Markup {
    html! {
        div class="wide" {
            table class="names" {
                thead { tr { th scope="col" { "Setting" } th scope="col" { "Round" } th scope="col" { "Repeat" }
                    th scope="col" { "Status" } th scope="col" { "Gap" } th scope="col" { "Report" } } }
                tbody {
                    @for cell in &overview.cells {
                        tr {
                            th scope="row" { (cell.setting) } td { (cell.round) } td { (cell.repeat) }
                            td { (status_word(cell)) }
                            td { (cell.run.as_ref().and_then(|run| run.figures.get(GAP)).map_or(ABSENT.to_owned(), |gap| percent(gap.value))) }
                            td { @if matches!(cell.status, CellStatus::Done { .. }) { a href=(report_address(&cell.id)) { "report" } } }
                        }
                    }
                }
            }
        }
    }
}
