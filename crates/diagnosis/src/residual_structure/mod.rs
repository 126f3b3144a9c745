//! What a fit leaves: the residuals, and tests for structure in them.
//!
//! - [`test`]: a test of the residuals, with its limit.
//! - [`patterns`]: neighbours, ripples, slow patterns, repeats, whole planes.
//! - [`element_order`]: whether departures of single elements have an order.
//! - [`converter_steps`]: whether the converter's steps are too coarse for the noise.
//! - [`score_tests`]: causes that the catalogue does not have, asked one by one.
//! - [`stray_wave`]: a wave from where no element is.

pub mod converter_steps;
pub mod element_order;
pub mod patterns;
pub mod score_tests;
pub mod stray_wave;
pub mod test;

use crate::fit::joint_fit::Fit;
use crate::fit::score_statistic::ScoreStatistics;
use crate::limits::{ORDER_LIMIT, PATTERN_LIMIT, ROUNDING_LIMIT};
use crate::model::effect::Context;
use crate::model::observations::Observations;
use crate::residual_structure::converter_steps::ConverterSteps;
use crate::residual_structure::element_order::order_of_elements;
use crate::residual_structure::test::{Kind, Test};

/// What a fit leaves.
pub(crate) struct ResidualStructure {
    /// By reading, in standard deviations.
    pub residuals: Vec<f64>,
    /// Every test of them.
    pub tests: Vec<Test>,
}

impl ResidualStructure {
    /// By a fit, with all that is asked of it.
    pub fn of(fit: &Fit, observations: &Observations, context: &Context) -> Self {
        let Self { residuals, mut tests } = Self::patterns_only(fit, observations, context);
        tests.extend(of_one_thing(fit, observations, context, &residuals));
        Self { residuals, tests }
    }

    /// By a fit, with the patterns in it, but no causes asked for one by one.
    pub fn patterns_only(fit: &Fit, observations: &Observations, context: &Context) -> Self {
        let residuals = residuals_of(fit, observations, context);
        let plain = |kind: Kind, limit: f64| {
            move |(name, z): (&'static str, f64)| Test { name, z, limit, sign_of: None, kind }
        };
        let scatter = patterns::scatter(observations, &residuals);
        let mut tests =
            vec![plain(Kind::NoFlaw, PATTERN_LIMIT)(("more scatter than the noise", scatter))];
        let patterns = patterns::z_scores(observations, &residuals);
        tests.extend(patterns.into_iter().map(plain(Kind::Pattern, PATTERN_LIMIT)));
        let order = order_of_elements(observations, fit).map(|z| ("order among the elements", z));
        tests.extend(order.map(plain(Kind::NoFlaw, ORDER_LIMIT)));
        tests.extend(ConverterSteps::of(observations).map(|steps| Test {
            name: "readings in steps",
            z: steps.rounding,
            limit: ROUNDING_LIMIT,
            sign_of: Some(format!("steps of {:.2e} in the readings' unit", steps.step)),
            kind: Kind::Converter,
        }));
        Self { residuals, tests }
    }
}

fn residuals_of(fit: &Fit, observations: &Observations, context: &Context) -> Vec<f64> {
    let model = fit.model(context);
    let pressures = model.pressures(observations, &fit.nuisance);
    model.residuals(observations, &pressures, &fit.nuisance).scaled
}

/// The tests that ask for one thing each; none beside turbulence, whose speckle comes from everywhere and differs over the field by
/// itself. Where it matters how the robot came, they are asked of the readings of which that is known: the others follow no slope.
fn of_one_thing(
    fit: &Fit,
    observations: &Observations,
    context: &Context,
    residuals: &[f64],
) -> Vec<Test> {
    if fit.model(context).scatters_field() {
        return Vec::new();
    }
    let ask = |observations: &Observations, residuals: &[f64]| {
        let scores = ScoreStatistics::of(observations, context, fit);
        let mut tests = score_tests::tests(&scores, residuals);
        tests.extend(stray_wave::test(&scores, residuals));
        tests
    };
    if !fit.model(context).depends_on_arrival() {
        return ask(observations, residuals);
    }
    let known = observations.only(|_, visit| visit.even);
    match known.scans.len() == observations.scans.len() && 2 * known.len() > observations.len() {
        true => ask(&known, &residuals_of(fit, &known, context)),
        false => Vec::new(),
    }
}
