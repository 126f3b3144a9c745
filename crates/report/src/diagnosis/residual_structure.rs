//! Tests for structure in the residual.

use maud::Markup;

use super::super::html::table;
use fieldgap_diagnosis::Diagnosis;
use fieldgap_text::fixed;

/// The tests of the residual of the best candidate; `None` where none was made.
pub(super) fn tests(diagnosis: &Diagnosis) -> Option<Markup> {
    if diagnosis.residual_tests.is_empty() {
        return None;
    }
    let rows = diagnosis.residual_tests.iter().map(|test| {
        let finding = match (test.was_structure(), test.is_structure()) {
            (_, true) => {
                let sign = test.sign_of.as_deref().unwrap_or("not explained");
                format!("present: {sign}")
            }
            (true, false) => "removed".to_owned(),
            (false, false) => "absent".to_owned(),
        };
        vec![
            test.name.to_owned(),
            test.z_before.map_or_else(String::new, |z| fixed(z, 1)),
            fixed(test.z, 1),
            finding,
        ]
    });
    let caption = "Test statistics before and after the correction, in standard deviations of what noise alone gives";
    Some(table(caption, &["Structure", "Before", "After", "Result"], rows))
}
