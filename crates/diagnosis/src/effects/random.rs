//! What differs at random from element to element.
//!
//! One spread for all; each element's departure is integrated out, so that the effect pays for its freedom.

use fieldgap_acoustics::{Element, Simulator};
use num_complex::Complex64;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// A random departure of each element.
pub(crate) struct Random {
    pub id: EffectId,
    pub per_element: PerElement,
    pub mimics: &'static [EffectId],
    pub key: SetupKey,
    /// The catalogue's name of the spread.
    pub spread: &'static str,
    /// What the departures of the elements are called.
    pub departures: &'static str,
    /// A spread and its standard error, in words.
    pub words: fn(f64, f64) -> String,
    /// What a departure does to an element.
    pub act: fn(f64, &mut Element),
    /// The same as a factor on the element's complex amplitude.
    pub weight: fn(f64) -> Complex64,
}

impl Effect for Random {
    fn id(&self) -> EffectId {
        self.id
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: self.per_element,
            mimics: self.mimics,
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(self.key)
    }

    fn search(&self) -> Search {
        Search::Random
    }

    fn elements(&self, at: Setting<'_>, elements: &mut [Element]) {
        for (element, departure) in elements.iter_mut().zip(at.values) {
            (self.act)(*departure, element);
        }
    }

    fn element_weight(&self, departure: f64) -> Complex64 {
        (self.weight)(departure)
    }

    /// The spread's estimate comes last, after the elements' departures.
    fn describe(&self, fitted: &[Estimate], _: &Choice, _: &Context) -> Finding {
        let unknown = Estimate { value: f64::NAN, error: f64::NAN };
        let (spread, each) = fitted.split_last().unwrap_or((&unknown, &[]));
        let each = FittedParameter::Each {
            value: each.iter().map(|departure| departure.value).collect(),
            standard_error: each.iter().map(|departure| departure.error).collect(),
        };
        let parameters = [(self.spread, spread.real()), (self.departures, each)];
        Finding::new(parameters, (self.words)(spread.value, spread.error))
    }
}
