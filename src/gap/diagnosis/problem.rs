//! The least-squares problem of a set of effects: residuals at any point, and how they change with every number.

use std::cell::RefCell;
use std::ops::Range;

use num_complex::Complex64;

use super::effects::{Context, Search};
use super::fit::Instance;
use super::likelihood::{Nuisance, Pressures, Residuals, pressures};
use super::observations::Observations;
use super::supposed::Supposed;
use crate::least_squares::{Linearisation, Parameter as Unknown};

/// Share of a parameter's scale that its difference quotient steps: far above rounding, far below curvature.
const DIFFERENCE: f64 = 1e-3;

/// The problem that a search works on.
pub(super) struct Problem<'o> {
    observations: &'o Observations,
    context: &'o Context,
    instances: &'o [Instance],
    /// How many parameters each effect has.
    pub lengths: Vec<usize>,
    /// Where the residuals were looked at last, and the pressures there.
    last: RefCell<Option<(Vec<f64>, Pressures)>>,
}

impl<'o> Problem<'o> {
    /// Of a set of effects.
    pub fn new(
        observations: &'o Observations,
        context: &'o Context,
        instances: &'o [Instance],
        values: &[Vec<f64>],
    ) -> Self {
        let lengths = values.iter().map(Vec::len).collect();
        Self { observations, context, instances, lengths, last: RefCell::new(None) }
    }

    /// Gain and shift of each scan at a point.
    pub fn nuisance(&self, numbers: &[f64]) -> Vec<Nuisance> {
        numbers[..Nuisance::COUNT * self.observations.scans.len()]
            .chunks(Nuisance::COUNT)
            .map(Nuisance::from_slice)
            .collect()
    }

    fn supposed(&self, numbers: &[f64]) -> Supposed {
        let mut rest = &numbers[Nuisance::COUNT * self.observations.scans.len()..];
        let mut supposed = Supposed::default();
        for (instance, &length) in self.instances.iter().zip(&self.lengths) {
            let (values, after) = rest.split_at(length);
            instance.effect.suppose(values, &instance.choice, self.context, &mut supposed);
            rest = after;
        }
        supposed
    }

    pub fn pressures(&self, numbers: &[f64]) -> Pressures {
        pressures(self.observations, &self.supposed(numbers), &self.nuisance(numbers))
    }

    pub fn residuals(&self, numbers: &[f64], pressures: &Pressures) -> Residuals {
        self.supposed(numbers).residuals(self.observations, pressures, &self.nuisance(numbers))
    }

    /// Residuals at a point, NaN where a parameter has left what is plausible.
    pub fn at(&self, numbers: &[f64]) -> Vec<f64> {
        if !self.plausible(numbers) {
            return vec![f64::NAN];
        }
        let pressures = self.pressures(numbers);
        let residuals = self.residuals(numbers, &pressures).for_least_squares();
        self.last.replace(Some((numbers.to_vec(), pressures)));
        residuals
    }

    /// The pressures at a point, taken where the residuals were looked at last if that was there.
    fn pressures_again(&self, numbers: &[f64]) -> Pressures {
        let last = self.last.take().filter(|(at, _)| at == numbers);
        last.map_or_else(|| self.pressures(numbers), |(_, pressures)| pressures)
    }

    fn plausible(&self, numbers: &[f64]) -> bool {
        let mut at = Nuisance::COUNT * self.observations.scans.len();
        self.instances.iter().zip(&self.lengths).all(|(instance, length)| {
            let values = &numbers[at..at + length];
            at += length;
            is_plausible(self.observations, self.context, instance, values)
        })
    }

    /// Residuals and derivatives; those by the scans' shifts, which change little on the way, are taken from `kept` where
    /// that holds them.
    pub fn linearise(
        &self,
        numbers: &[f64],
        unknowns: &[Unknown],
        kept: &mut Option<Vec<Vec<f64>>>,
    ) -> Linearisation {
        let pressures = self.pressures_again(numbers);
        let residuals = self.residuals(numbers, &pressures).for_least_squares();
        let of = |range| self.columns(numbers, unknowns, range, &pressures, &residuals);
        let nuisance = Nuisance::COUNT * self.observations.scans.len();
        let mut columns = match kept.take().filter(|kept| kept[0].len() == residuals.len()) {
            Some(mut columns) => {
                for gain in (0..nuisance).step_by(Nuisance::COUNT) {
                    columns[gain] = of(gain..gain + 1).remove(0);
                }
                columns
            }
            None => of(0..nuisance),
        };
        *kept = Some(columns.clone());
        columns.extend(of(nuisance..numbers.len()));
        Linearisation { residuals, columns }
    }

    /// Derivatives of the residuals by some of the numbers.
    pub fn columns(
        &self,
        numbers: &[f64],
        unknowns: &[Unknown],
        range: Range<usize>,
        base_pressures: &Pressures,
        residuals: &[f64],
    ) -> Vec<Vec<f64>> {
        let base = self.supposed(numbers);
        let base_field = base.field_alone();
        let random = self.random_ranges();
        let mut contributions: Option<Vec<Vec<Vec<Complex64>>>> = None;
        let mut slopes: Option<Vec<Complex64>> = None;
        range
            .map(|j| {
                let mut beside = numbers.to_vec();
                let mut step = DIFFERENCE * unknowns[j].scale;
                beside[j] += step;
                if !self.plausible(&beside) {
                    step = -step;
                    beside[j] = numbers[j] + step;
                }
                let shifts =
                    j < Nuisance::COUNT * self.observations.scans.len() && j % Nuisance::COUNT != 0;
                let supposed = self.supposed(&beside);
                let plain = !supposed.minds_the_way() && !supposed.changes_scatter();
                if let Some(range) = random.iter().find(|r| r.contains(&j)).filter(|_| plain) {
                    let parts = contributions.get_or_insert_with(|| self.contributions(numbers));
                    let slopes = slopes
                        .get_or_insert_with(|| self.slopes(numbers, base_pressures, residuals));
                    let change = change_of_weight(j - range.start, &base, &supposed) / step;
                    return along_element(slopes, parts, j - range.start, change);
                }
                let pressures = if let Some(range) = random.iter().find(|r| r.contains(&j)) {
                    let parts = contributions.get_or_insert_with(|| self.contributions(numbers));
                    turned(base_pressures, parts, j - range.start, &base, &supposed)
                } else if shifts || supposed.field_alone() != base_field {
                    self.pressures(&beside)
                } else {
                    base_pressures.clone()
                };
                let moved = self.residuals(&beside, &pressures).for_least_squares();
                moved.iter().zip(residuals).map(|(m, r)| (m - r) / step).collect()
            })
            .collect()
    }

    /// How each residual changes with its pressure: the derivative by a change dp is the real part of slope times dp.
    fn slopes(&self, numbers: &[f64], pressures: &Pressures, residuals: &[f64]) -> Vec<Complex64> {
        const LOUDER: f64 = 1e-6;
        let mut louder = pressures.clone();
        let all = louder.iter_mut().flatten().flatten();
        all.for_each(|pressure| pressure.coherent *= 1.0 + LOUDER);
        let moved = self.residuals(numbers, &louder).scaled;
        let pressures = pressures.iter().flatten().flatten();
        moved
            .iter()
            .zip(residuals)
            .zip(pressures)
            .map(|((moved, residual), pressure)| {
                let power = pressure.coherent.norm_sqr().max(f64::MIN_POSITIVE);
                pressure.coherent.conj() / power * ((moved - residual) / LOUDER)
            })
            .collect()
    }

    /// Where the departures of single elements stand among the numbers.
    fn random_ranges(&self) -> Vec<Range<usize>> {
        let mut at = Nuisance::COUNT * self.observations.scans.len();
        let mut ranges = Vec::new();
        for (instance, length) in self.instances.iter().zip(&self.lengths) {
            if instance.effect.search() == Search::Random {
                ranges.push(at..at + length);
            }
            at += length;
        }
        ranges
    }

    /// Each element's part of the pressures: by drive over all scans, then element, then visit.
    fn contributions(&self, numbers: &[f64]) -> Vec<Vec<Vec<Complex64>>> {
        let supposed = self.supposed(numbers);
        let nuisance = self.nuisance(numbers);
        let scans = self.observations.scans.iter().zip(&nuisance);
        scans
            .flat_map(|(scan, nuisance)| scan.drives.iter().map(move |drive| (drive, nuisance)))
            .map(|(drive, nuisance)| {
                let otherwise = drive.otherwise.iter().map(|(_, visit)| *visit);
                let visits: Vec<_> = match supposed.minds_the_way() {
                    true => drive.visits.iter().copied().chain(otherwise).collect(),
                    false => drive.visits.clone(),
                };
                supposed.contributions(&drive.believed, &visits, nuisance)
            })
            .collect()
    }
}

/// Whether an effect's parameters are within what is plausible, and what repeats and silence allow.
pub(super) fn is_plausible(
    observations: &Observations,
    context: &Context,
    instance: &Instance,
    values: &[f64],
) -> bool {
    let parameters = instance.effect.parameters();
    if !parameters.iter().zip(values).all(|(p, v)| (p.least..=p.most).contains(v)) {
        return false;
    }
    let mut supposed = Supposed::default();
    if instance.effect.search() != Search::Random {
        instance.effect.suppose(values, &instance.choice, context, &mut supposed);
    }
    observations.scans.iter().all(|scan| {
        supposed.turbulence <= scan.scatter.most_turbulence
            && supposed.floor <= scan.scatter.most_floor
    })
}

/// The pressures after one element's amplitude and phase changed: the sum is linear in the elements.
fn turned(
    base: &Pressures,
    contributions: &[Vec<Vec<Complex64>>],
    element: usize,
    before: &Supposed,
    after: &Supposed,
) -> Pressures {
    let change = change_of_weight(element, before, after);
    let mut turned = base.clone();
    let drives = turned.iter_mut().flat_map(|scan| scan.iter_mut());
    for (drive, parts) in drives.zip(contributions) {
        for (pressure, part) in drive.iter_mut().zip(&parts[element]) {
            pressure.coherent += change * part;
        }
    }
    turned
}

/// Relative change of an element's complex amplitude.
fn change_of_weight(element: usize, before: &Supposed, after: &Supposed) -> Complex64 {
    let weight = |supposed: &Supposed| {
        let gain = supposed.gains.get(element).copied().unwrap_or(1.0);
        let phase_rad = supposed.extra_phases_rad.get(element).copied().unwrap_or(0.0);
        Complex64::from_polar(1.0, phase_rad) * gain
    };
    weight(after) / weight(before) - 1.0
}

/// How the residuals change as one element's amplitude does.
fn along_element(
    slopes: &[Complex64],
    contributions: &[Vec<Vec<Complex64>>],
    element: usize,
    change: Complex64,
) -> Vec<f64> {
    let parts = contributions.iter().flat_map(|drive| &drive[element]);
    slopes.iter().zip(parts).map(|(slope, part)| (slope * part * change).re).collect()
}
