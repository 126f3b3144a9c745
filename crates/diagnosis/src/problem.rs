//! The least-squares problem of a set of effects: residuals at any point, and how they change with every number.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use num_complex::Complex64;

use super::effects::{Context, Search};
use super::fit::Instance;
use super::likelihood::{Nuisance, Pressures, Residuals, pressures};
use super::observations::Observations;
use super::supposed::Supposed;
use fieldgap_acoustics::least_squares::{Linearisation, Parameter as Unknown};

/// Share of a parameter's scale that its difference quotient steps: far above rounding, far below curvature.
const DIFFERENCE: f64 = 1e-3;

/// The problem that a search works on.
pub(super) struct Problem<'o> {
    observations: &'o Observations,
    context: &'o Context,
    instances: &'o [Instance],
    /// How many parameters each effect has.
    pub lengths: Vec<usize>,
    /// Where it was looked last.
    last: RefCell<Option<Arc<Looked>>>,
}

/// A point of the problem with all that is known there.
pub(super) struct Looked {
    numbers: Vec<f64>,
    pressures: Pressures,
    /// What the readings are beyond what is expected there.
    pub residuals: Residuals,
    /// The same as least squares wants them.
    pub squared: Vec<f64>,
    /// How each residual, and each charge, changes with its pressure.
    slopes: OnceLock<Vec<Complex64>>,
    /// Each element's part of the pressures: by drive over all scans, then element, then visit.
    contributions: OnceLock<Vec<Vec<Vec<Complex64>>>>,
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

    fn pressures(&self, numbers: &[f64]) -> Pressures {
        pressures(self.observations, &self.supposed(numbers), &self.nuisance(numbers))
    }

    fn residuals(&self, numbers: &[f64], pressures: &Pressures) -> Residuals {
        self.supposed(numbers).residuals(self.observations, pressures, &self.nuisance(numbers))
    }

    /// What a point looks like.
    pub fn look(&self, numbers: &[f64]) -> Arc<Looked> {
        let mut last = self.last.borrow_mut();
        if let Some(looked) = last.as_ref().filter(|looked| looked.numbers == numbers) {
            return Arc::clone(looked);
        }
        let pressures = self.pressures(numbers);
        let residuals = self.residuals(numbers, &pressures);
        let looked = Arc::new(Looked {
            numbers: numbers.to_vec(),
            pressures,
            squared: residuals.for_least_squares(),
            residuals,
            slopes: OnceLock::new(),
            contributions: OnceLock::new(),
        });
        *last = Some(Arc::clone(&looked));
        looked
    }

    /// Residuals at a point, NaN where a parameter has left what is plausible.
    pub fn at(&self, numbers: &[f64]) -> Vec<f64> {
        match self.plausible(numbers) {
            true => self.look(numbers).squared.clone(),
            false => vec![f64::NAN],
        }
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
        let looked = self.look(numbers);
        let of = |range| self.columns(numbers, unknowns, range, &looked);
        let nuisance = Nuisance::COUNT * self.observations.scans.len();
        let mut columns = match kept.take().filter(|kept| kept[0].len() == looked.squared.len()) {
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
        Linearisation { residuals: looked.squared.clone(), columns }
    }

    /// Derivatives of the residuals by some of the numbers, at a point that looks like this: it may have been looked at without the last
    /// effect, if that does nothing there.
    pub fn columns(
        &self,
        numbers: &[f64],
        unknowns: &[Unknown],
        range: Range<usize>,
        looked: &Looked,
    ) -> Vec<Vec<f64>> {
        let base = self.supposed(numbers);
        let base_field = base.field_alone();
        let random = self.random_ranges();
        range
            .map(|j| {
                let mut beside = numbers.to_vec();
                let mut step = DIFFERENCE * unknowns[j].scale;
                beside[j] += step;
                if !self.plausible(&beside) {
                    step = -step;
                    beside[j] = numbers[j] + step;
                }
                let of_scan = j % Nuisance::COUNT;
                let is_nuisance = j < Nuisance::COUNT * self.observations.scans.len();
                let supposed = self.supposed(&beside);
                // Each reading follows its own pressure, and where no speckle changes with it, the pressure's magnitude.
                let by_pressure = !supposed.minds_the_way();
                let by_level = by_pressure && supposed.turbulence == 0.0;
                if is_nuisance && of_scan == 0 && by_level {
                    let slopes = self.slopes(numbers, looked);
                    return along_gain(slopes, looked, j / Nuisance::COUNT);
                }
                let random = random.iter().find(|range| range.contains(&j));
                if let Some(range) = random.filter(|_| by_pressure) {
                    let change = change_of_weight(j - range.start, &base, &supposed) / step;
                    let parts = self.contributions(numbers, looked);
                    return along_element(
                        self.slopes(numbers, looked),
                        parts,
                        j - range.start,
                        change,
                    );
                }
                let moves_field =
                    is_nuisance && of_scan != 0 || supposed.field_alone() != base_field;
                let moved = if let Some(range) = random {
                    let parts = self.contributions(numbers, looked);
                    Some(turned(&looked.pressures, parts, j - range.start, &base, &supposed))
                } else {
                    moves_field.then(|| self.pressures(&beside))
                };
                if let Some(moved) =
                    moved.as_ref().filter(|_| by_level && supposed.hears_like(&base))
                {
                    return along_pressures(self.slopes(numbers, looked), looked, moved, step);
                }
                let pressures = moved.as_ref().unwrap_or(&looked.pressures);
                let moved = self.residuals(&beside, pressures).for_least_squares();
                moved.iter().zip(&looked.squared).map(|(m, r)| (m - r) / step).collect()
            })
            .collect()
    }

    /// How each residual, and after them each charge, changes with its pressure: the derivative by a change dp is the real part of slope
    /// times dp.
    pub fn slopes<'l>(&self, numbers: &[f64], looked: &'l Looked) -> &'l [Complex64] {
        const LOUDER: f64 = 1e-6;
        looked.slopes.get_or_init(|| {
            let mut louder = looked.pressures.clone();
            let all = louder.iter_mut().flatten().flatten();
            all.for_each(|pressure| pressure.coherent *= 1.0 + LOUDER);
            let moved = self.residuals(numbers, &louder).for_least_squares();
            let pressures = looked.pressures.iter().flatten().flatten().cycle();
            moved
                .iter()
                .zip(&looked.squared)
                .zip(pressures)
                .map(|((moved, residual), pressure)| {
                    let power = pressure.coherent.norm_sqr().max(f64::MIN_POSITIVE);
                    pressure.coherent.conj() / power * ((moved - residual) / LOUDER)
                })
                .collect()
        })
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

    fn contributions<'l>(&self, numbers: &[f64], looked: &'l Looked) -> &'l [Vec<Vec<Complex64>>] {
        looked.contributions.get_or_init(|| {
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
        })
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
    let parts = contributions.iter().flat_map(|drive| &drive[element]).cycle();
    slopes.iter().zip(parts).map(|(slope, part)| (slope * part * change).re).collect()
}

/// How the residuals change as the pressures do, in one step of a parameter.
fn along_pressures(
    slopes: &[Complex64],
    looked: &Looked,
    moved: &Pressures,
    step: f64,
) -> Vec<f64> {
    let moved = moved.iter().flatten().flatten();
    let before = looked.pressures.iter().flatten().flatten();
    let changes = moved.zip(before).map(|(moved, before)| moved.coherent - before.coherent);
    slopes.iter().zip(changes.cycle()).map(|(slope, change)| (slope * change).re / step).collect()
}

/// How the residuals change as the logarithm of one scan's gain does.
fn along_gain(slopes: &[Complex64], looked: &Looked, scan: usize) -> Vec<f64> {
    let of_scans = looked.pressures.iter().enumerate();
    let pressures = of_scans.flat_map(|(n, drives)| drives.iter().flatten().map(move |p| (n, p)));
    slopes
        .iter()
        .zip(pressures.cycle())
        .map(|(slope, (n, pressure))| if n == scan { (slope * pressure.coherent).re } else { 0.0 })
        .collect()
}
