//! What a fit leaves of the readings, and everything that is asked of it.

use super::converter_steps::ConverterSteps;
use super::effects::Context;
use super::element_order::order_of_elements;
use super::fit::Fit;
use super::likelihood::pressures;
use super::observations::Observations;
use super::promises::Promises;
use super::{residual_tests, score_tests, stray_wave};

/// Standard deviations at which a test says that there is structure: small flaws of the formulas show among thousands of readings.
pub(super) const LIMIT: f64 = 4.0;

/// The same of a test that asks for one thing and knows how rare it is: one in two thousand.
const LIMIT_OF_ONE_THING: f64 = 3.3;

/// The same for order among departures that should have none, whatever the formulas: one in four hundred, by either of two tests.
const LIMIT_OF_ORDER: f64 = 3.0;

/// Rounding error of a converter, in deviations of the noise, from which on the noise is no longer what hides it: steps of a third
/// (B. Widrow and I. Kollár, *Quantization Noise*, 2008).
const LIMIT_OF_STEPS: f64 = 0.1;

/// A test of what a fit leaves.
#[derive(Debug, Clone)]
pub(super) struct Test {
    /// What is looked for.
    pub name: &'static str,
    /// Standard deviations from what noise alone gives; of a converter's steps, their rounding error.
    pub z: f64,
    /// From where on it is structure.
    pub limit: f64,
    /// What it is a sign of, as far as the readings say.
    pub sign_of: Option<String>,
    /// What kind of structure it is.
    pub kind: Kind,
}

/// Kinds of structure, by what may excuse it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Of a gap that is many times the noise it may be a formula's own error.
    Pattern,
    /// No formula is so wrong.
    NoFlaw,
    /// What the receiver's converter does to every reading: it matters to a gap that is not much larger.
    Converter,
}

impl Test {
    /// A test for one cause that the catalogue does not have.
    pub fn of_one_thing(name: &'static str, z: f64, sign_of: Option<String>) -> Self {
        Self { name, z, limit: LIMIT_OF_ONE_THING, sign_of, kind: Kind::Pattern }
    }

    /// Whether there is structure.
    pub fn fails(&self) -> bool {
        self.z > self.limit
    }
}

/// What a fit leaves.
pub(super) struct Left {
    /// By reading, in standard deviations.
    pub residuals: Vec<f64>,
    /// Every test of them.
    pub tests: Vec<Test>,
}

impl Left {
    /// By a fit, with all that is asked of it.
    pub fn by(fit: &Fit, observations: &Observations, context: &Context) -> Self {
        let Self { residuals, mut tests } = Self::and_its_patterns(fit, observations, context);
        tests.extend(of_one_thing(fit, observations, context, &residuals));
        Self { residuals, tests }
    }

    /// By a fit, with the patterns in it, but no causes asked for one by one.
    pub fn and_its_patterns(fit: &Fit, observations: &Observations, context: &Context) -> Self {
        let residuals = residuals_of(fit, observations, context);
        let plain = |kind: Kind, limit: f64| {
            move |(name, z): (&'static str, f64)| Test { name, z, limit, sign_of: None, kind }
        };
        let scatter = residual_tests::scatter(observations, &residuals);
        let mut tests = vec![plain(Kind::NoFlaw, LIMIT)(("more scatter than the noise", scatter))];
        let patterns = residual_tests::z_scores(observations, &residuals);
        tests.extend(patterns.into_iter().map(plain(Kind::Pattern, LIMIT)));
        let order = order_of_elements(observations, fit).map(|z| ("order among the elements", z));
        tests.extend(order.map(plain(Kind::NoFlaw, LIMIT_OF_ORDER)));
        tests.extend(ConverterSteps::of(observations).map(|steps| Test {
            name: "readings in steps",
            z: steps.rounding,
            limit: LIMIT_OF_STEPS,
            sign_of: Some(format!("steps of {:.2e} in the readings' unit", steps.step)),
            kind: Kind::Converter,
        }));
        Self { residuals, tests }
    }
}

fn residuals_of(fit: &Fit, observations: &Observations, context: &Context) -> Vec<f64> {
    let supposed = fit.supposed(context);
    let pressures = pressures(observations, &supposed, &fit.nuisance);
    supposed.residuals(observations, &pressures, &fit.nuisance).scaled
}

/// The tests that ask for one thing each; none beside turbulence, whose speckle comes from everywhere and differs over the field by
/// itself. Where it matters how the robot came, they are asked of the readings of which that is known: the others follow no slope.
fn of_one_thing(
    fit: &Fit,
    observations: &Observations,
    context: &Context,
    residuals: &[f64],
) -> Vec<Test> {
    if fit.turbulence().0 > 0.0 {
        return Vec::new();
    }
    let ask = |observations: &Observations, residuals: &[f64]| {
        let promises = Promises::of(observations, context, fit);
        let mut tests = score_tests::tests(&promises, residuals);
        tests.extend(stray_wave::test(&promises, residuals));
        tests
    };
    if !fit.supposed(context).minds_the_way() {
        return ask(observations, residuals);
    }
    let known = observations.only(|_, visit| visit.even);
    match known.scans.len() == observations.scans.len() && 2 * known.len() > observations.len() {
        true => ask(&known, &residuals_of(fit, &known, context)),
        false => Vec::new(),
    }
}
