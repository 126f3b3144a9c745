//! How well a record states that its set-up is known. Every fit lets the set-up depart so far from what is stated, whatever the causes.

use std::collections::BTreeMap;

use super::effect::Search;
use super::instance::Instance;
use crate::effect_id::EffectId;
use crate::limits::SHIFT_PRIOR_M;

/// A departure of the set-up from what is stated, as one of the effects makes it.
#[derive(Debug, Clone)]
pub(crate) struct StatedDeparture {
    pub instance: Instance,
    /// Mean and standard deviation of each of its numbers before any reading.
    pub priors: Vec<(f64, f64)>,
}

impl StatedDeparture {
    pub fn id(&self) -> EffectId {
        self.instance.effect.id()
    }

    /// Whether it is one of each element.
    pub fn is_of_elements(&self) -> bool {
        self.instance.effect.search() == Search::Random
    }

    /// The standard deviation of the departures of elements: as it was found, or as stated.
    pub fn spread(&self, found: &BTreeMap<EffectId, f64>) -> f64 {
        found.get(&self.id()).copied().unwrap_or(self.priors[0].1)
    }

    /// The numbers before any reading.
    pub fn means(&self) -> Vec<f64> {
        self.priors.iter().map(|(mean, _)| *mean).collect()
    }
}

/// What a record states of all departures.
#[derive(Debug, Clone, Default)]
pub(crate) struct StatedUncertainty {
    /// Standard uncertainty of each coordinate of the origin, m, where it is stated and more than that of a careful set-up.
    pub origin_m: Option<f64>,
    /// All others, each of another effect.
    pub departures: Vec<StatedDeparture>,
}

impl StatedUncertainty {
    /// Standard uncertainty of each coordinate of the origin, m: as stated, or of a careful set-up.
    pub fn origin_m(&self) -> f64 {
        self.origin_m.unwrap_or(SHIFT_PRIOR_M.get())
    }

    /// Whether anything is stated that departs.
    pub fn is_any(&self) -> bool {
        self.origin_m.is_some() || !self.departures.is_empty()
    }

    /// Whether the origin is known less well than that of a careful set-up.
    pub fn has_wide_origin(&self) -> bool {
        self.origin_m.is_some()
    }

    /// The departures beside a set of effects: an effect of the set takes the place of a departure of its kind.
    pub fn beside<'s>(
        &'s self,
        instances: &'s [Instance],
    ) -> impl Iterator<Item = &'s StatedDeparture> {
        let is_cause = |id: EffectId| instances.iter().any(|instance| instance.effect.id() == id);
        self.departures.iter().filter(move |departure| !is_cause(departure.id()))
    }

    /// Whether an effect is one of the departures.
    pub fn holds(&self, id: EffectId) -> bool {
        self.departures.iter().any(|departure| departure.id() == id)
    }

    /// Whether single elements depart.
    pub fn holds_elements(&self) -> bool {
        self.departures.iter().any(StatedDeparture::is_of_elements)
    }
}
