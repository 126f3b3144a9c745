//! The residuals of a fit, and tests for structure in them.
//!
//! - [`test`]: a test of the residuals, with its limit.
//! - [`patterns`]: neighbours, ripples, slow patterns, repeats, whole planes.
//! - [`element_order`]: whether departures of single elements have an order.
//! - [`level_steps`]: whether a level that wanders slowly steps at one moment.
//! - [`far_readings`]: whether a few readings are farther off than a scatter makes them.
//! - [`converter_steps`]: whether the converter's steps are too coarse for the noise.
//! - [`score_tests`]: score tests for causes outside the catalogue.
//! - [`stray_wave`]: a wave from a place without an element.

pub mod converter_steps;
pub mod element_order;
mod far_readings;
mod level_steps;
pub mod patterns;
pub mod score_tests;
pub mod stray_wave;
pub mod test;

use crate::effect_id::EffectId;
use crate::fit::joint_fit::Fit;
use crate::fit::score_statistic::ScoreStatistics;
use crate::limits::{ORDER_LIMIT, PATTERN_LIMIT, ROUNDING_LIMIT, SINGLE_CAUSE_LIMIT};
use crate::model::effect::Context;
use crate::model::observations::Observations;
use crate::residual_structure::converter_steps::ConverterSteps;
use crate::residual_structure::element_order::order_of_elements;
use crate::residual_structure::far_readings::z_of_few_far;
use crate::residual_structure::patterns::REPEATS_ALIKE;
use crate::residual_structure::test::{Kind, Test};

/// The residuals of a fit and their tests.
pub(crate) struct ResidualStructure {
    /// By reading, in standard deviations.
    pub residuals: Vec<f64>,
    /// Every test of them.
    pub tests: Vec<Test>,
}

impl ResidualStructure {
    /// Of a fit, with all tests.
    pub fn of(fit: &Fit, observations: &Observations, context: &Context) -> Self {
        let Self { residuals, mut tests } = Self::patterns_only(fit, observations, context);
        tests.extend(of_one_thing(fit, observations, context, &residuals));
        tests.extend(level_steps::test(observations, &residuals));
        Self { residuals, tests }
    }

    /// Of a fit, with the tests for patterns only.
    pub fn patterns_only(fit: &Fit, observations: &Observations, context: &Context) -> Self {
        let residuals = residuals_of(fit, observations, context);
        let plain = |kind: Kind, limit: f64| {
            move |(name, z): (&'static str, f64)| Test { name, z, limit, sign_of: None, kind }
        };
        let scatter = patterns::scatter(observations, &residuals);
        let mut tests = vec![plain(Kind::NoFlaw, PATTERN_LIMIT.get())((
            "more scatter than the noise",
            scatter,
        ))];
        let patterns = patterns::z_scores(observations, &residuals);
        if fit.instances.iter().any(|instance| instance.effect.scatters_repeats()) {
            // Air and robot scatter each reading. If a few readings make the scatter, it has another cause.
            let far = z_of_few_far(fit, observations, context);
            let far = ("a few readings far off", far);
            tests.push(plain(Kind::NoFlaw, PATTERN_LIMIT.get())(far));
            // The tests for single causes, one of them over time, are left out beside a field that scatters.
            // The mean of a strongly turbulent field is not known well enough to ask for places.
            let jitters = fit.values_of(EffectId::PositionJitter).is_some();
            let scores = jitters.then(|| ScoreStatistics::of(observations, context, fit));
            let shifts = scores.map_or(Vec::new(), |scores| scores.shift_columns().to_vec());
            let slow = patterns::slow_changes(observations, &residuals, &shifts);
            let slow = ("slow changes through the scan", slow);
            tests.push(plain(Kind::Pattern, PATTERN_LIMIT.get())(slow));
        }
        tests.extend(patterns.into_iter().map(|(name, z)| {
            let limit =
                if name == REPEATS_ALIKE { SINGLE_CAUSE_LIMIT.get() } else { PATTERN_LIMIT.get() };
            plain(Kind::Pattern, limit)((name, z))
        }));
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

/// The tests for single causes. A fluctuating field excludes them, because its speckle imitates them. Where the arrival of the robot
/// matters, they use only readings whose arrival is known, because the others have no derivative.
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
    let known = observations.only(|_, visit| visit.is_in_row());
    match known.scans.len() == observations.scans.len() && 2 * known.len() > observations.len() {
        true => ask(&known, &residuals_of(fit, &known, context)),
        false => Vec::new(),
    }
}
