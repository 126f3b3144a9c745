//! The order of a fit's numbers: gain, shift and near field of each scan, departures of the set-up, then the effects.

use std::ops::Range;

use crate::model::effect::{Context, Effect, Search};
use crate::model::instance::Instance;
use crate::model::nuisance::{Nuisance, Nuisances};
use crate::model::stated_uncertainty::StatedDeparture;

/// What each number of a fit belongs to.
pub(crate) struct Layout<'o> {
    scans: usize,
    /// Departures of the set-up beside the effects.
    stated: Vec<&'o StatedDeparture>,
    instances: &'o [Instance],
    /// How many parameters each effect has.
    pub lengths: Vec<usize>,
}

impl<'o> Layout<'o> {
    /// Of so many scans and a set of effects.
    pub fn of(
        scans: usize,
        context: &'o Context,
        instances: &'o [Instance],
        values: &[Vec<f64>],
    ) -> Self {
        let stated = context.stated.beside(instances).collect();
        let lengths = values.iter().map(Vec::len).collect();
        Self { scans, stated, instances, lengths }
    }

    /// The same with the departures of the set-up that are beside other effects.
    pub fn with_departures_beside(self, others: &'o [Instance], context: &'o Context) -> Self {
        Self { stated: context.stated.beside(others).collect(), ..self }
    }

    /// How many numbers are free whatever the effects.
    pub fn first(&self) -> usize {
        self.departures().end
    }

    /// Which numbers are those of the departures of the set-up.
    pub fn departures(&self) -> Range<usize> {
        let from = Nuisance::COUNT * self.scans;
        from..from + self.stated.iter().map(|departure| departure.priors.len()).sum::<usize>()
    }

    /// Departures of single elements, each with its numbers.
    pub fn spread_departures(&self) -> impl Iterator<Item = (&'o StatedDeparture, Range<usize>)> {
        let stated = self.stated.iter().copied().zip(self.parts().map(|(_, range)| range));
        stated.filter(|(departure, _)| departure.is_of_elements())
    }

    /// The departures of the set-up, then the effects, each with its numbers.
    pub fn parts(&self) -> impl Iterator<Item = (&Instance, Range<usize>)> {
        let stated = self.stated.iter().map(|of| (&of.instance, of.priors.len()));
        let effects = self.instances.iter().zip(self.lengths.iter().copied());
        let mut end = self.departures().start;
        stated.chain(effects).map(move |(instance, length)| {
            end += length;
            (instance, end - length..end)
        })
    }

    /// What is free whatever the effects, at a point.
    pub fn nuisances(&self, numbers: &[f64]) -> Nuisances {
        let mut all = Nuisances::from(self.nuisance(numbers));
        let stated = self.parts().take(self.stated.len());
        let stated =
            stated.map(|(instance, range)| (instance.effect.id(), numbers[range].to_vec()));
        all.departures = stated.collect();
        all
    }

    /// Gain and shift of each scan at a point.
    pub fn nuisance(&self, numbers: &[f64]) -> Vec<Nuisance> {
        numbers[..Nuisance::COUNT * self.scans]
            .chunks(Nuisance::COUNT)
            .map(Nuisance::from_slice)
            .collect()
    }

    /// The effect of a number; `None` for gain, shift and near field.
    pub fn effect(&self, number: usize) -> Option<&'static dyn Effect> {
        let of_number = self.parts().find(|(_, range)| range.contains(&number));
        of_number.map(|(instance, _)| instance.effect)
    }

    /// The numbers that are departures of single elements, of the set-up and of the effects: of each kind their range.
    pub fn random_ranges(&self) -> Vec<Range<usize>> {
        let random = self.parts().filter(|(part, _)| part.effect.search() == Search::Random);
        random.map(|(_, range)| range).collect()
    }
}
