//! The posterior of a joint fit as a normal distribution, and the evidence for each effect in it.

use std::ops::Range;

use fieldgap_acoustics::least_squares::Factor;
use nalgebra::{DMatrix, DVector};

use crate::fit::joint_fit::Fit;
use crate::fit::random_elements::best_spread;
use crate::model::effect::Search;
use crate::model::instance::Instance;

/// Scales of a smooth effect's parameters in one unit of the search for a spread, which begins at a thousandth and ends at two: from half a
/// scale to a thousand.
const SCALES: f64 = 500.0;

/// The numbers of one effect in a joint fit.
#[derive(Clone)]
pub(crate) struct Member {
    /// Number of the effect in the fit.
    pub number: usize,
    range: Range<usize>,
    /// Width of the prior, in units of the member.
    width: f64,
}

/// Mean and covariance of all numbers of a joint fit. Those of the effects are departures from where they do nothing, in units of their own.
#[derive(Clone)]
pub(crate) struct Posterior {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    members: Vec<Member>,
}

/// What the readings say of one effect, all others free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Said {
    /// The width of its prior with the greatest evidence, in units of the effect.
    pub width: f64,
    /// The logarithm of that evidence over that of no effect.
    pub nats: f64,
}

impl Posterior {
    /// Of a fit whose effects all have a prior of their own. Effects without numbers have no part in it; `None` where the covariance is not known.
    pub fn of(fit: &Fit) -> Option<Self> {
        let covariance = fit.covariance.as_ref()?;
        let nuisance = fit.first();
        let mut mean = vec![0.0; nuisance];
        let mut units = vec![1.0; nuisance];
        let mut members = Vec::new();
        let effects = fit.instances.iter().zip(&fit.values).zip(fit.ranges()).zip(&fit.spreads);
        for (number, (((instance, values), range), spread)) in effects.enumerate() {
            let of_effect = units_of(instance, values.len());
            let neutral = neutral_of(instance, values.len());
            let departures = values.iter().zip(&neutral).zip(&of_effect);
            mean.extend(departures.map(|((value, neutral), unit)| (value - neutral) / unit));
            units.extend(of_effect);
            if !values.is_empty() && spread.is_finite() {
                members.push(Member { number, range, width: spread / unit_of_spread(instance) });
            }
        }
        let units = DVector::from_vec(units);
        let covariance = covariance.component_div(&(&units * units.transpose()));
        Some(Self { mean: DVector::from_vec(mean), covariance, members })
    }

    /// The effects in it.
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// What the readings say of one of them; `None` where its numbers are not told apart.
    pub fn said(&self, member: &Member) -> Option<Said> {
        let Range { start, end } = member.range;
        let count = end - start;
        let own = self.covariance.view((start, start), (count, count)).into_owned();
        let precision = Factor::of(own)?.inverse();
        let by_readings =
            &precision - DMatrix::identity(count, count) / (member.width * member.width);
        let downhill = precision * self.mean.rows(start, count);
        let (width, nats) = best_spread(by_readings, &downhill);
        Some(Said { width, nats })
    }

    /// The same without one of them: the distribution of the others where it does nothing.
    pub fn without(&self, member: &Member) -> Option<Self> {
        let removed = member.range.clone();
        let kept: Vec<usize> = (0..self.mean.len()).filter(|n| !removed.contains(n)).collect();
        let out: Vec<usize> = removed.clone().collect();
        let block = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
                self.covariance[(rows[i], columns[j])]
            })
        };
        let own = Factor::of(block(&out, &out))?;
        let across = block(&kept, &out);
        let carried = &across * own.inverse();
        let mean = DVector::from_fn(kept.len(), |i, _| self.mean[kept[i]])
            - &carried * self.mean.rows(removed.start, removed.len());
        let covariance = block(&kept, &kept) - carried * across.transpose();
        let others = self.members.iter().filter(|other| other.number != member.number);
        let members = others.cloned().map(|mut other| {
            if other.range.start > removed.start {
                other.range = other.range.start - removed.len()..other.range.end - removed.len();
            }
            other
        });
        Some(Self { mean, covariance, members: members.collect() })
    }

    /// The effect for which the readings say least, with what they say.
    pub fn weakest(&self) -> Option<(&Member, Said)> {
        let said = self.members.iter().filter_map(|member| Some((member, self.said(member)?)));
        said.min_by(|a, b| a.1.nats.total_cmp(&b.1.nats))
    }
}

/// Neutral values of an effect's numbers.
fn neutral_of(instance: &Instance, count: usize) -> Vec<f64> {
    match instance.effect.search() {
        Search::Random => vec![0.0; count],
        _ => instance.neutral(),
    }
}

/// One unit of each of an effect's numbers.
fn units_of(instance: &Instance, count: usize) -> Vec<f64> {
    match instance.effect.search() {
        Search::Random => vec![1.0; count],
        _ => {
            let parameters = instance.effect.parameters_of(&instance.choice).iter();
            parameters.map(|parameter| SCALES * parameter.scale).collect()
        }
    }
}

/// The spread of a fit for one unit of width: smooth effects have theirs in scales of their parameters.
pub(crate) fn unit_of_spread(instance: &Instance) -> f64 {
    if instance.effect.search() == Search::Random { 1.0 } else { SCALES }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn posterior(covariance: DMatrix<f64>, mean: Vec<f64>, widths: &[f64]) -> Posterior {
        let members = widths.iter().enumerate();
        let members = members.map(|(n, &width)| Member { number: n, range: n..n + 1, width });
        Posterior { mean: DVector::from_vec(mean), covariance, members: members.collect() }
    }

    /// For one number x with precision h by the readings the evidence of a prior of width s is that of the estimate's own distribution, of
    /// variance s² + 1/h: greatest at s² = x² - 1/h, where its logarithm over that of none is (t² - 1 - ln t²)/2 with t = x √h.
    #[test]
    fn the_best_width_of_one_number_is_that_of_its_marginal_likelihood() {
        let (estimate, by_readings, width): (f64, f64, f64) = (0.3, 400.0, 0.1);
        let precision = by_readings + width.powi(-2);
        let mean = by_readings * estimate / precision;
        let covariance = DMatrix::from_element(1, 1, 1.0 / precision);
        let posterior = posterior(covariance, vec![mean], &[width]);
        let said = posterior.said(&posterior.members[0]).expect("told");
        let best = (estimate * estimate - 1.0 / by_readings).sqrt();
        let t2 = estimate * estimate * by_readings;
        assert!((said.width / best - 1.0).abs() < 0.1, "{said:?} {best}");
        assert!((said.nats - 0.5 * (t2 - 1.0 - t2.ln())).abs() < 0.05, "{said:?}");
    }

    /// Two numbers of which the readings tell the sum alone: without the one, the other takes up all of it.
    #[test]
    fn without_an_effect_those_like_it_take_up_its_part() {
        let (noise, width): (f64, f64) = (0.01, 1.0);
        // Readings say x + y = 1 to within the noise.
        let precision = DMatrix::from_element(2, 2, noise.powi(-2)) + DMatrix::identity(2, 2);
        let downhill = DVector::from_element(2, noise.powi(-2));
        let covariance = precision.cholesky().expect("positive").inverse();
        let mean = &covariance * downhill;
        assert!((mean[0] - 0.5).abs() < 1e-3);
        let both = posterior(covariance, mean.as_slice().to_vec(), &[width, width]);
        let [first, second] = [0, 1].map(|n| both.said(&both.members[n]).expect("told").nats);
        assert!(first < 1.0 && second < 1.0, "{first} {second}");
        let alone = both.without(&both.members[0]).expect("told");
        assert!((alone.mean[0] - 1.0).abs() < 1e-3, "{}", alone.mean[0]);
        assert_eq!((alone.members[0].number, alone.members[0].range.clone()), (1, 0..1));
        assert!(alone.said(&alone.members[0]).expect("told").nats > 1000.0);
    }
}
