//! An effect with what was chosen for it, and with the numbers at which it acts.

use std::fmt;

use num_complex::Complex64;

use super::effect::{Choice, Context, Effect};

/// An effect with what was chosen for it.
#[derive(Clone)]
pub(crate) struct Instance {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// What was chosen.
    pub choice: Choice,
}

impl Instance {
    /// Where the effect does nothing; nothing for random elements.
    pub fn neutral(&self) -> Vec<f64> {
        let parameters = self.effect.parameters_of(&self.choice).iter();
        parameters.map(|parameter| parameter.neutral).collect()
    }
}

impl fmt::Debug for Instance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:?}", self.effect.id(), self.choice)
    }
}

/// The numbers at which an effect acts.
#[derive(Clone, Copy)]
pub(crate) struct Setting<'a> {
    /// Its real parameters, as the fit works on them; for random elements, each element's departure.
    pub values: &'a [f64],
    /// What was chosen.
    pub choice: &'a Choice,
    /// The set-up as believed.
    pub context: &'a Context,
}

/// An effect at work.
#[derive(Clone)]
pub(crate) struct Active<'c> {
    /// The effect.
    pub effect: &'static dyn Effect,
    values: Vec<f64>,
    choice: Choice,
    context: &'c Context,
}

impl<'c> Active<'c> {
    /// An effect with its numbers.
    pub fn new(instance: &Instance, values: &[f64], context: &'c Context) -> Self {
        let choice = instance.choice.clone();
        Self { effect: instance.effect, values: values.to_vec(), choice, context }
    }

    /// The numbers at which it acts.
    pub fn setting(&self) -> Setting<'_> {
        Setting { values: &self.values, choice: &self.choice, context: self.context }
    }

    /// Whether its parameters are where it does nothing.
    pub fn is_neutral(&self) -> bool {
        self.values == self.effect.neutral()
    }

    /// The factor on the complex amplitude of one element.
    pub fn element_weight(&self, element: usize) -> Complex64 {
        self.values
            .get(element)
            .map_or(Complex64::ONE, |departure| self.effect.element_weight(*departure))
    }
}
