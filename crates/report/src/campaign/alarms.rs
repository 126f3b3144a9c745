//! The alarms of a campaign: open ones first, those that somebody acknowledged folded.

use maud::{Markup, html};

use super::super::words::sentence;
use fieldgap_campaign::{AlarmOverview, Overview};

/// All alarms; `None` where there was none.
pub(super) fn alarms(overview: &Overview) -> Option<Markup> {
    let (open, known): (Vec<&AlarmOverview>, Vec<&AlarmOverview>) =
        overview.alarms.iter().partition(|alarm| alarm.open);
    if overview.alarms.is_empty() {
        return None;
    }
    Some(html! {
        @if open.is_empty() { p { "No alarm is open." } } @else { (list(&open)) }
        @if !known.is_empty() {
            details {
                summary { "Acknowledged alarms: " (known.len()) }
                (list(&known))
            }
        }
    })
}

fn list(alarms: &[&AlarmOverview]) -> Markup {
    html! {
        // Newest first.
        ul class="alarms" { @for alarm in alarms.iter().rev() { li { (one(alarm)) } } }
    }
}

fn one(alarm: &AlarmOverview) -> Markup {
    html! {
        p class="what" { (sentence(&alarm.sentence)) }
        @if let Some(cause) = &alarm.cause { p { "Before and after: " (sentence(cause)) } }
        p {
            a href=(super::cells::report_address(&alarm.cell)) { "Report of " (alarm.cell) }
        }
    }
}
