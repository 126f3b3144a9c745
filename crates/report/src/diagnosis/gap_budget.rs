//! The gap budget: what each effect explains, and where the gap lies.

use maud::{Markup, html};

use super::super::html::table;
use super::figures::DiagnosisFigures;
use fieldgap_diagnosis::{Diagnosis, PlaneShare};
use fieldgap_text::{height_mm, percent};

/// The share of the gap that each effect explains; `None` where none does.
pub(super) fn waterfall(figures: &DiagnosisFigures) -> Option<Markup> {
    let figure = figures.waterfall.as_ref()?;
    Some(figure.markup(&html! {
        p {
            "The squared gap beyond noise as the effects of the best candidate are added one after another: defects of the \
             simulator first, then the effect that explains most of the rest."
        }
    }))
}

/// Shares of the gap by height, by region and by kind.
pub(super) fn shares(diagnosis: &Diagnosis) -> Markup {
    let gap = &diagnosis.r#where;
    let several_scans = diagnosis.scans.len() > 1;
    let several_drives = gap.planes.windows(2).any(|pair| pair[0].focus != pair[1].focus);
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
    let planes = gap.planes.iter().map(|plane| row(&place(plane), plane.share));
    let regions = gap.regions.iter().map(|part| row(part.region.name(), part.share));
    let kinds = [
        ("separate gain for each height", gap.kinds.gain),
        ("then separate shift for each height", gap.kinds.registration),
        ("shape", gap.kinds.shape),
        ("noise", gap.kinds.noise),
    ];
    let kinds = kinds.into_iter().map(|(name, share)| row(name, share));
    html! {
        p {
            "Shares of the squared gap beyond noise. Regions are those of the nominal field. Kinds are simple changes of \
             the simulation, with the share that each would remove."
        }
        div class="side-by-side" {
            (table("By height", &["Height", "Share"], planes))
            (table("By region", &["Region", "Share"], regions))
            (table("By kind", &["Kind", "Share"], kinds))
        }
    }
}
