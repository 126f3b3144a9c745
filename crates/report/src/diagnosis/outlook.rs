//! What these data cannot tell, and what would.

use maud::{Markup, html};

use super::super::words::sentence;
use fieldgap_diagnosis::Diagnosis;
use fieldgap_text::significant;

/// What stays open; `None` where nothing does.
pub(super) fn open(diagnosis: &Diagnosis) -> Option<Markup> {
    let open = &diagnosis.undetermined;
    (!open.is_empty()).then(|| html! { ul { @for words in open { li { (sentence(words)) } } } })
}

/// The measurement that tells the rivals apart; `None` where there is none to propose.
pub(super) fn next(diagnosis: &Diagnosis) -> Option<Markup> {
    let next = diagnosis.next_measurement.as_ref()?;
    Some(html! {
        p { (next.what) }
        p {
            "It should tell the two best rivals apart by " (significant(next.expected_sigma, 2))
            " standard deviations of the noise; the scan at hand does by " (significant(next.present_sigma, 2)) "."
        }
        @if let Some(plan) = &next.plan {
            p { "Its plan; keep it as a file, and run it with " code { "fieldgap scan PLAN --rig RIG" } "." }
            pre { (plan.trim_end()) }
        }
    })
}
