//! What differs at random from element to element.
//!
//! One spread for all; each element's departure is integrated out, so that the effect pays for its freedom.

use super::{Choice, Context, Effect, Fitted, Said, Search};
use crate::FittedParameter;
use crate::supposed::Supposed;

/// A random departure of each element.
pub(super) struct Random {
    pub id: &'static str,
    /// The catalogue's name of the spread.
    pub spread: &'static str,
    /// What the departures of the elements are called.
    pub departures: &'static str,
    /// A spread and its standard error, in words.
    pub words: fn(f64, f64) -> String,
    pub act: fn(&[f64], &mut Supposed),
}

impl Effect for Random {
    fn id(&self) -> &'static str {
        self.id
    }

    fn search(&self) -> Search {
        Search::Random
    }

    fn suppose(&self, values: &[f64], _: &Choice, _: &Context, supposed: &mut Supposed) {
        (self.act)(values, supposed);
    }

    /// The spread's estimate comes last, after the elements' departures.
    fn say(&self, fitted: &[Fitted], _: &Choice, _: &Context) -> Said {
        let unknown = Fitted { value: f64::NAN, error: f64::NAN };
        let (spread, each) = fitted.split_last().unwrap_or((&unknown, &[]));
        let each = FittedParameter::Each {
            value: each.iter().map(|departure| departure.value).collect(),
            standard_error: each.iter().map(|departure| departure.error).collect(),
        };
        let parameters = [(self.spread, spread.real()), (self.departures, each)];
        Said::new(parameters, (self.words)(spread.value, spread.error))
    }
}
