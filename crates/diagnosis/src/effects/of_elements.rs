//! Effects that name elements: what is chosen is which, and nothing is fitted.

use super::{Choice, Context, Effect, Fitted, Said, Search, listed};
use crate::FittedParameter;
use crate::observations::Observations;
use crate::supposed::Supposed;

/// Something that is wrong with some elements.
pub(super) struct OfElements {
    pub id: &'static str,
    pub search: Search,
    /// What comes before the elements in a sentence.
    pub words: &'static str,
    pub act: fn(&[usize], &mut Supposed),
}

impl Effect for OfElements {
    fn id(&self) -> &'static str {
        self.id
    }

    fn search(&self) -> Search {
        self.search
    }

    fn can_act(&self, observations: &Observations) -> bool {
        observations.elements() > 1
    }

    fn suppose(&self, _: &[f64], choice: &Choice, _: &Context, supposed: &mut Supposed) {
        (self.act)(choice.elements(), supposed);
    }

    fn say(&self, _: &[Fitted], choice: &Choice, _: &Context) -> Said {
        let value = choice.elements().to_vec();
        let sentence = format!("{}: {}", self.words, listed(&value));
        Said::new([("elements", FittedParameter::Elements { value })], sentence)
    }
}
