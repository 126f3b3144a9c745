//! What these data do not determine, and the measurement that would.

use maud::{Markup, html};

use super::super::words::sentence;
use fieldgap_diagnosis::Diagnosis;
use fieldgap_text::significant;

/// What the data do not determine; `None` where nothing is open.
pub(super) fn undetermined(diagnosis: &Diagnosis) -> Option<Markup> {
    let open = &diagnosis.undetermined;
    (!open.is_empty()).then(|| html! { ul { @for words in open { li { (sentence(words)) } } } })
}

/// The measurement that separates the rivals; `None` where there is none to propose.
pub(super) fn next_measurement(diagnosis: &Diagnosis) -> Option<Markup> {
    let next = diagnosis.next_measurement.as_ref()?;
    Some(html! {
        p { (next.what) }
        p {
            "It is expected to separate the two best rivals by " (significant(next.expected_sigma, 2))
            " standard deviations of the noise. The present data separate them by " (significant(next.present_sigma, 2)) "."
        }
        @if let Some(plan) = &next.plan {
            p { "Save this plan as a file and run it with " code { "fieldgap scan PLAN --rig RIG" } "." }
            pre { (plan.trim_end()) }
        }
    })
}
