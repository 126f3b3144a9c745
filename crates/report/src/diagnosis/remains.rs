//! Where the gap lies, what takes it away, and what is left of it.

use maud::{Markup, html};

use super::super::html::table;
use super::figures::DiagnosisFigures;
use fieldgap_diagnosis::{Diagnosis, PlaneShare};
use fieldgap_text::{fixed, height_mm, percent};

/// What each effect takes off the gap; `None` where nothing does.
pub(super) fn waterfall(figures: &DiagnosisFigures) -> Option<Markup> {
    let figure = figures.waterfall.as_ref()?;
    Some(figure.markup(&html! {
        p {
            "How the squared gap beyond noise shrinks as the named effects are added one after another, the largest \
             first."
        }
    }))
}

/// Shares of the gap by height, by region and by kind.
pub(super) fn whereabouts(diagnosis: &Diagnosis) -> Markup {
    let shares = &diagnosis.r#where;
    let several_scans = diagnosis.scans.len() > 1;
    let several_drives = shares.planes.windows(2).any(|pair| pair[0].focus != pair[1].focus);
    let place = |plane: &PlaneShare| {
        let scan = if several_scans {
            format!("{}, ", diagnosis.scans.get(plane.scan).map_or("", String::as_str))
        } else {
            String::new()
        };
        let drive = if several_drives { format!("drive {}, ", plane.focus) } else { String::new() };
        format!("{scan}{drive}{} mm", height_mm(plane.z_mm * 1e-3))
    };
    let row = |name: &str, share: f64| vec![name.to_owned(), percent(share)];
    let planes = shares.planes.iter().map(|plane| row(&place(plane), plane.share));
    let regions = shares.regions.iter().map(|part| row(part.region.name(), part.share));
    let kinds = [
        ("a gain of its own for each height", shares.kinds.gain),
        ("a shift of each height, beyond that", shares.kinds.registration),
        ("another shape", shares.kinds.shape),
        ("noise", shares.kinds.noise),
    ];
    let kinds = kinds.into_iter().map(|(name, share)| row(name, share));
    html! {
        p {
            "Shares of the squared gap beyond noise. Regions are those of the field as believed; kinds are what a simple change \
             of the simulation would remove."
        }
        div class="side-by-side" {
            (table("By height", &["Height", "Share"], planes))
            (table("By region", &["Region", "Share"], regions))
            (table("By kind", &["Kind", "Share"], kinds))
        }
    }
}

/// Tests of what the best candidate leaves; `None` where none was made.
pub(super) fn structure(diagnosis: &Diagnosis) -> Option<Markup> {
    if diagnosis.residual_tests.is_empty() {
        return None;
    }
    let rows = diagnosis.residual_tests.iter().map(|test| {
        let finding = match (test.was_structure(), test.is_structure()) {
            (_, true) => {
                let sign = test.sign_of.as_deref().unwrap_or("something is not explained");
                format!("still there: {sign}")
            }
            (true, false) => "gone".to_owned(),
            (false, false) if test.z_before.is_none() => "not there".to_owned(),
            (false, false) => "never there".to_owned(),
        };
        vec![
            test.name.to_owned(),
            test.z_before.map_or_else(String::new, |z| fixed(z, 1)),
            fixed(test.z, 1),
            finding,
        ]
    });
    let caption = "Structure in what is left, in standard deviations of what noise alone gives";
    Some(table(caption, &["Looked for", "Before", "After", "Found"], rows))
}
