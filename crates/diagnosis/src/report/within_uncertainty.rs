//! How far the set-up departs from what is stated, within its stated uncertainty.

use fieldgap_text::{Uncertain, listed, millimetres};

use crate::fit::joint_fit::Fit;
use crate::model::effect::{Context, Estimate};
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::stated_uncertainty::StatedDeparture;
use crate::result::StatedFinding;

/// The departures of a fit, each in words; nothing where no uncertainty is stated.
pub(super) fn findings(fit: &Fit, context: &Context) -> Vec<StatedFinding> {
    let mut findings: Vec<StatedFinding> = Vec::new();
    if context.stated.has_wide_origin() {
        findings.extend(origin(fit, context));
    }
    let mut from = fit.departures().start;
    for departure in context.stated.beside(&fit.instances) {
        let values = &fit.nuisance.departures[&departure.id()];
        let range = from..from + values.len();
        from = range.end;
        let mut fitted = fit.estimates(values, range);
        if departure.is_of_elements() {
            // The mean square of a departure is that of what was found and its variance.
            let squares: f64 = fitted.iter().map(|e| e.value.powi(2) + e.error.powi(2)).sum();
            let spread = (squares / values.len() as f64).sqrt();
            fitted.push(Estimate::of_spread(spread, values.len()));
        }
        let Instance { effect, choice } = &departure.instance;
        let finding = effect.describe(&fitted, choice, context);
        findings.push(StatedFinding {
            what: departure.id().to_string(),
            sentence: finding.sentence,
            in_uncertainties: size(departure, values),
        });
    }
    findings
}

/// Root mean square of the departures, each over its standard uncertainty.
fn size(departure: &StatedDeparture, values: &[f64]) -> f64 {
    let priors = departure.priors.iter().zip(values);
    let squares: f64 = priors.map(|((mean, sd), value)| ((value - mean) / sd).powi(2)).sum();
    (squares / values.len() as f64).sqrt()
}

/// Where the origin of each scan is.
fn origin<'f>(fit: &'f Fit, context: &'f Context) -> impl Iterator<Item = StatedFinding> + 'f {
    fit.nuisance.iter().enumerate().map(|(scan, Nuisance { shift_m, .. })| {
        let first = Nuisance::COUNT * scan + 1;
        let along = fit.estimates(shift_m.as_slice(), first..first + 3);
        let along =
            along.into_iter().zip(["x", "y", "z"]).map(|(Estimate { value, error }, axis)| {
                let mm = millimetres(Uncertain { value, standard_error: error });
                format!("{mm} mm along {axis}")
            });
        let along: Vec<String> = along.collect();
        StatedFinding {
            what: "origin".to_owned(),
            sentence: format!("the origin of the scan is off by {}", listed(&along)),
            in_uncertainties: shift_m.norm() / (3f64.sqrt() * context.stated.origin_m()),
        }
    })
}
