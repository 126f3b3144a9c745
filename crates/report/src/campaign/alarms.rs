//! The alarms of a campaign: open ones first, those that somebody acknowledged folded.

use maud::{Markup, html};

use super::super::words::sentence;
use super::addresses::report_address;
use fieldgap_campaign::{AlarmOverview, Overview};

/// The most alarms that are unfolded: those of one screen.
const MOST_UNFOLDED: usize = 8;

/// All alarms, the newest first; `None` where there was none.
pub(super) fn alarms(overview: &Overview) -> Option<Markup> {
    let (open, known): (Vec<&AlarmOverview>, Vec<&AlarmOverview>) =
        overview.alarms.iter().rev().partition(|alarm| alarm.open);
    let (shown, more) = open.split_at(open.len().min(MOST_UNFOLDED));
    (!overview.alarms.is_empty()).then(|| {
        html! {
            @if shown.is_empty() { p { "No alarm is open." } } @else { (list(shown)) }
            @if !more.is_empty() {
                details id="more-alarms" { summary { "Older open alarms: " (more.len()) } (list(more)) }
            }
            @if !known.is_empty() {
                details id="known-alarms" { summary { "Acknowledged alarms: " (known.len()) } (list(&known)) }
            }
        }
    })
}

fn list(alarms: &[&AlarmOverview]) -> Markup {
    html! { ul class="alarms" { @for alarm in alarms { li { (one(alarm)) } } } }
}

fn one(alarm: &AlarmOverview) -> Markup {
    html! {
        p { b { "▲ " (sentence(&alarm.sentence)) } }
        @if let Some(cause) = &alarm.cause { p { "Records before and after: " (sentence(cause)) } }
        p { a href=(report_address(&alarm.cell)) { "Report of " (alarm.cell) } }
    }
}
