//! What these data cannot tell, and what would.

use super::super::html::{Html, element, lines, paragraph, text};
use super::super::words::sentence;
use fieldgap_diagnosis::Diagnosis;
use fieldgap_text::significant;

/// What stays open; `None` where nothing does.
pub(super) fn open(diagnosis: &Diagnosis) -> Option<Vec<Html>> {
    if diagnosis.undetermined.is_empty() {
        return None;
    }
    let items = diagnosis
        .undetermined
        .iter()
        .map(|words| element("li", &[], [text(&sentence(words))]))
        .collect::<Vec<_>>();
    Some(vec![element("ul", &[], items)])
}

/// The measurement that tells the rivals apart; `None` where there is none to propose.
pub(super) fn next(diagnosis: &Diagnosis) -> Option<Vec<Html>> {
    let next = diagnosis.next_measurement.as_ref()?;
    let mut content = vec![
        paragraph(&next.what),
        paragraph(&format!(
            "It should tell the two best rivals apart by {} standard deviations of the noise; the scan at hand does by {}.",
            significant(next.expected_sigma, 2),
            significant(next.present_sigma, 2)
        )),
    ];
    if let Some(plan) = &next.plan {
        content.push(element(
            "p",
            &[],
            [
                text("Its plan; keep it as a file, and run it with "),
                element("code", &[], [text("fieldgap scan PLAN --rig RIG")]),
                text("."),
            ],
        ));
        content.push(lines(plan));
    }
    Some(content)
}
