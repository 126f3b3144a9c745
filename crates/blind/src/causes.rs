//! The causes of one scan: effects of the catalogue by their ids and parameters, or an unmodelled cause.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::parameters::Parameters;
use super::unmodelled::Unmodelled;
use fieldgap_virtual_rig::Truth;
use fieldgap_virtual_rig::effects::Effect;

/// Effects as a truth file has them, with their ids.
pub(super) type Effects = Vec<(&'static str, Box<dyn Effect>)>;

/// The causes of one scan.
#[derive(Debug, Clone, Default)]
pub(super) struct Causes {
    catalogue: Vec<(&'static str, Parameters)>,
    unmodelled: Option<Arc<dyn Unmodelled>>,
}

impl Causes {
    /// No cause.
    pub fn none() -> Self {
        Self::default()
    }

    /// Effects of the catalogue, each by its id.
    pub fn of_catalogue(catalogue: Vec<(&'static str, Parameters)>) -> Self {
        Self { catalogue, unmodelled: None }
    }

    /// A cause that is not in the catalogue.
    pub fn of_unmodelled(cause: Arc<dyn Unmodelled>) -> Self {
        Self { catalogue: Vec::new(), unmodelled: Some(cause) }
    }

    /// Each of them by itself, in their order.
    pub fn each_alone(&self) -> Vec<Self> {
        let catalogue = self.catalogue.iter().map(|one| Self::of_catalogue(vec![one.clone()]));
        catalogue.chain(self.unmodelled.clone().map(Self::of_unmodelled)).collect()
    }

    /// The unmodelled cause, if any.
    pub fn unmodelled(&self) -> Option<&dyn Unmodelled> {
        self.unmodelled.as_deref()
    }

    /// Their names, in the catalogue's order.
    pub fn names(&self) -> Vec<String> {
        let catalogue = self.catalogue.iter().map(|(id, _)| (*id).to_owned());
        catalogue.chain(self.unmodelled().map(|cause| cause.name().to_owned())).collect()
    }

    /// All parameters, by `effect.parameter`.
    pub fn parameters(&self) -> BTreeMap<String, serde_json::Value> {
        let unmodelled = self.unmodelled().map(|cause| (cause.name(), cause.parameters()));
        by_name(self.catalogue.iter().cloned().chain(unmodelled))
    }

    /// The effects from each time on, s, beside those that a set-up has anyway. The first set acts from the beginning.
    pub fn epochs(&self, anyway: &[(&'static str, Parameters)]) -> Vec<(f64, Effects)> {
        let mut epochs = vec![(f64::NEG_INFINITY, self.effects_of(anyway, &self.catalogue))];
        if let Some(cause) = self.unmodelled() {
            let changed = |(time_s, more): (f64, Vec<_>)| (time_s, self.effects_of(anyway, &more));
            epochs.extend(cause.changes().into_iter().map(changed));
        }
        epochs
    }

    /// The effects of the virtual rig as tables of a truth file.
    pub fn tables(&self) -> toml::Table {
        self.tables_with(&self.catalogue)
    }

    fn tables_with(&self, catalogue: &[(&'static str, Parameters)]) -> toml::Table {
        let unmodelled = self.unmodelled().filter(|cause| cause.is_of_truth());
        let unmodelled = unmodelled.map(|cause| (cause.name(), cause.parameters()));
        let mut tables = tables_of(catalogue);
        tables.extend(unmodelled.map(table));
        tables
    }

    /// A cause takes the place of what the set-up has of its kind.
    fn effects_of(
        &self,
        anyway: &[(&'static str, Parameters)],
        catalogue: &[(&'static str, Parameters)],
    ) -> Effects {
        let mut tables = tables_of(anyway);
        tables.extend(self.tables_with(catalogue));
        let truth = Truth::of_effects(&tables);
        truth.expect("every draw is a valid truth file; a test draws them all").effects
    }
}

/// Parameters by `effect.parameter`.
pub(super) fn by_name(
    effects: impl IntoIterator<Item = (&'static str, Parameters)>,
) -> BTreeMap<String, serde_json::Value> {
    let named = |(id, parameters): (&'static str, Parameters)| {
        parameters.into_iter().map(move |(name, value)| {
            let value = serde_json::to_value(value).expect("numbers and lists of them");
            (format!("{id}.{name}"), value)
        })
    };
    effects.into_iter().flat_map(named).collect()
}

fn tables_of(effects: &[(&'static str, Parameters)]) -> toml::Table {
    effects.iter().cloned().map(table).collect()
}

fn table((id, parameters): (&'static str, Parameters)) -> (String, toml::Value) {
    (id.to_owned(), toml::Value::Table(parameters))
}
