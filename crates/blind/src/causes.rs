//! What is at work in one scan: effects of the catalogue by their ids and parameters, or a cause outside it.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::outside::Outside;
use fieldgap_virtual_rig::Truth;
use fieldgap_virtual_rig::effects::Effect;

/// Effects as a truth file has them, with their ids.
pub(super) type Effects = Vec<(&'static str, Box<dyn Effect>)>;

/// Parameters of one effect, as a truth file has them.
pub(super) type Parameters = toml::Table;

/// What is at work in one scan.
#[derive(Debug, Clone, Default)]
pub(super) struct Causes {
    catalogue: Vec<(&'static str, Parameters)>,
    outside: Option<Arc<dyn Outside>>,
}

impl Causes {
    /// Nothing.
    pub fn none() -> Self {
        Self::default()
    }

    /// Effects of the catalogue, each by its id.
    pub fn of_catalogue(catalogue: Vec<(&'static str, Parameters)>) -> Self {
        Self { catalogue, outside: None }
    }

    /// A cause that the catalogue does not have.
    pub fn of_outside(cause: Arc<dyn Outside>) -> Self {
        Self { catalogue: Vec::new(), outside: Some(cause) }
    }

    /// The cause outside the catalogue.
    pub fn outside(&self) -> Option<&dyn Outside> {
        self.outside.as_deref()
    }

    /// What they are called, in the catalogue's order.
    pub fn names(&self) -> Vec<String> {
        let catalogue = self.catalogue.iter().map(|(id, _)| (*id).to_owned());
        catalogue.chain(self.outside().map(|cause| cause.name().to_owned())).collect()
    }

    /// All parameters, by `effect.parameter`.
    pub fn parameters(&self) -> BTreeMap<String, serde_json::Value> {
        let outside = self.outside().map(|cause| (cause.name(), cause.parameters()));
        let of_all = self.catalogue.iter().cloned().chain(outside);
        of_all
            .flat_map(|(id, parameters)| {
                parameters.into_iter().map(move |(name, value)| {
                    let value = serde_json::to_value(value).expect("numbers and lists of them");
                    (format!("{id}.{name}"), value)
                })
            })
            .collect()
    }

    /// The effects at work from each time on, s; the first from the beginning.
    pub fn epochs(&self) -> Vec<(f64, Effects)> {
        let mut epochs = vec![(f64::NEG_INFINITY, self.effects_of(&self.catalogue))];
        if let Some(cause) = self.outside() {
            epochs.extend(
                cause.changes().into_iter().map(|(time_s, more)| (time_s, self.effects_of(&more))),
            );
        }
        epochs
    }

    fn effects_of(&self, catalogue: &[(&'static str, Parameters)]) -> Effects {
        let tables = catalogue
            .iter()
            .map(|(id, parameters)| ((*id).to_owned(), toml::Value::Table(parameters.clone())));
        let mut effects = Truth::of_effects(&tables.collect())
            .expect("every draw is a valid truth file; a test draws them all")
            .effects;
        effects.extend(self.outside().and_then(Outside::effect));
        effects
    }
}
