//! The share of the gap that each effect explains, as a waterfall chart.

use super::super::picture::{Bar, BarChart, Weight};
use super::super::words::listed;
use fieldgap_diagnosis::{Diagnosis, WaterfallPart};
use fieldgap_text::percent;

/// The squared gap beyond noise, effect by effect; `None` where nothing was added.
pub(super) fn chart(diagnosis: &Diagnosis) -> Option<BarChart> {
    if !diagnosis.waterfall.iter().any(|step| step.effect.is_some()) {
        return None;
    }
    let bar = |name: &str, (from, to): (f64, f64), note: String, weight| Bar {
        name: name.to_owned(),
        from,
        to,
        note,
        weight,
    };
    let mut bars = vec![bar("nominal simulation", (0.0, 1.0), percent(1.0), Weight::Faint)];
    let mut remaining = 1.0;
    for step in &diagnosis.waterfall {
        bars.push(match step.part {
            WaterfallPart::Alignment | WaterfallPart::StatedUncertainty | WaterfallPart::Effect => {
                let span = (remaining, remaining - step.share);
                remaining -= step.share;
                let share = format!("\u{2212}{}", percent(step.share));
                bar(step.name(), span, share, Weight::Strong)
            }
            WaterfallPart::Residual => {
                bar(step.name(), (0.0, step.share), percent(step.share), Weight::Plain)
            }
        });
    }
    let parts: Vec<String> = diagnosis
        .waterfall
        .iter()
        .map(|step| format!("{} {}", step.name(), percent(step.share)))
        .collect();
    Some(BarChart {
        bars,
        range: (0.0, 1.0),
        ticks: (0..=5).map(|fifth| (f64::from(fifth) / 5.0, format!("{} %", 20 * fifth))).collect(),
        label: "squared gap beyond noise".to_owned(),
        description: format!(
            "Bar chart of the squared gap beyond noise, with the share that each effect explains: {}.",
            listed(&parts)
        ),
    })
}
