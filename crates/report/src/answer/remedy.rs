//! What to do about a cause, as a card.

use maud::{Markup, html};

use super::Cause;
use crate::words::sentence;
use fieldgap_diagnosis::Verdict;

/// The correction of a set-up file that a diagnosis asks for.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ProposedCorrection {
    /// The file that changes.
    pub file: String,
    /// Its keys that change.
    pub changes: Vec<ProposedChange>,
    /// The fitted parameters with their standard errors, one line for each effect.
    pub fitted: Vec<String>,
    /// Effects without a key, and what to do instead.
    pub manual: Vec<String>,
    /// The command that writes the corrected file; empty if nothing is to be written.
    pub command: String,
}

/// A key of a set-up file and its value, before and after.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProposedChange {
    /// The key with its table: `medium.speed_of_sound_m_s`.
    pub key: String,
    /// The value before; `None` where the file does not have the key.
    pub before: Option<String>,
    /// The value after; `None` where the key is removed.
    pub after: Option<String>,
}

/// What to do: the keys to change, the command that changes them, or what to measure next.
pub(super) fn card(cause: Cause<'_>) -> Markup {
    html! {
        div class="card" {
            h2 { "What to do" }
            @match cause.correction {
                Some(correction) => (corrected(correction)),
                None => p { (without_correction(cause)) },
            }
        }
    }
}

fn corrected(correction: &ProposedCorrection) -> Markup {
    let value = |value: &Option<String>| value.clone().unwrap_or("\u{2013}".to_owned());
    html! {
        @if !correction.changes.is_empty() {
            div class="wide" {
                table class="names" {
                    caption { "In " code { (correction.file) } }
                    thead { tr { th scope="col" { "key" } th scope="col" { "now" } th scope="col" { "corrected" } } }
                    tbody {
                        @for change in &correction.changes {
                            tr {
                                th scope="row" { code { (change.key) } }
                                td { (value(&change.before)) }
                                td { (value(&change.after)) }
                            }
                        }
                    }
                }
            }
        }
        @for fitted in &correction.fitted { p class="notes" { "Fitted: " (fitted) } }
        @for manual in &correction.manual { p class="notes" { (sentence(manual)) } }
        @if !correction.command.is_empty() { pre { (correction.command) } }
    }
}

fn without_correction(cause: Cause<'_>) -> String {
    if let Some(next) = &cause.diagnosis.next_measurement {
        return next.what.clone();
    }
    match cause.diagnosis.verdict {
        Verdict::None => "Nothing: the set-up explains the scan.".to_owned(),
        Verdict::Unexplained => {
            "Check the set-up by hand: distances, temperature, connections, and reflecting surfaces. The structure in the \
             residual shows where to look."
                .to_owned()
        }
        Verdict::Ambiguous => "Measure at more heights or with another focus.".to_owned(),
        Verdict::Explained | Verdict::MostlyExplained => {
            "No key of a set-up file corrects this cause.".to_owned()
        }
    }
}
