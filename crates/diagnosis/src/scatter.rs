//! How readings scatter about their mean: from silence and from points that were visited again.
//!
//! A level m reads |m + b (n₁ + i n₂)| (1 + a n₀) with standard normal n, so that silence reads Rayleigh's distribution and a
//! strong signal scatters by √(a² m² + b²). A floor that the detector adds in power makes √(reading² + floor²) of it before
//! the share in proportion comes in: quadrature noise is the smaller beside a floor, and the share is not.

use std::sync::Arc;

use super::flicker::turbulent;
use super::golden::least;
use super::observations::ObservedScan;
use super::pair::{Level, Pair, cost, full_scale, pairs_beside};
use super::scale::LEAST_SHARE;
use super::silence::{Silence, Told};
use super::supposed::Speckle;

/// The scatter of one reading.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scatter {
    /// In proportion to the level.
    pub share: f64,
    /// Each quadrature of what does not depend on the level, in the reading's unit.
    pub additive: f64,
    /// Random phase over one metre of path that the repeats ask for, rad, and the kind of it.
    pub turbulence: f64,
    pub speckle: Speckle,
    /// The most of it that the repeats allow.
    pub most_turbulence: f64,
    /// Floor that silence shows, in the reading's unit.
    pub floor: f64,
    /// The largest floor that silence allows: nothing can read less than the floor.
    pub most_floor: f64,
    /// By how much silence prefers that floor to none, in nats.
    pub floor_evidence: f64,
    /// Visits that came again to a point, with what they differed by.
    pub pairs: Arc<[Pair]>,
}

impl Default for Scatter {
    fn default() -> Self {
        Self {
            share: 0.02,
            additive: 0.0,
            turbulence: 0.0,
            speckle: Speckle::OfPaths,
            most_turbulence: f64::INFINITY,
            floor: 0.0,
            most_floor: f64::INFINITY,
            floor_evidence: 0.0,
            pairs: Arc::new([]),
        }
    }
}

/// The additive part is taken for no less than this of the largest reading: what is lower is below any converter's step.
const LEAST_ADDITIVE: f64 = 1e-4;

impl Scatter {
    /// Whether there are repeats enough to tell it, whatever the readings should have been.
    pub fn is_told_by_repeats(&self) -> bool {
        self.pairs.len() >= ENOUGH
    }

    /// The squares of share, additive part and turbulence.
    pub fn squares(&self) -> [f64; 3] {
        [self.share, self.additive, self.turbulence].map(|root| root * root)
    }

    /// By how much the repeats speak against turbulence of so much, in nats, from the one that suits them best.
    pub fn against_turbulence(&self, turbulence: f64, speckle: Speckle) -> f64 {
        let of =
            |turbulence, speckle| cost(&self.pairs, self.share, self.additive, turbulence, speckle);
        (of(turbulence, speckle) - of(self.turbulence, self.speckle)).max(0.0)
    }

    fn with_most_turbulence(self) -> Self {
        /// Nats against it at which turbulence is out of the question.
        const TOO_MUCH: f64 = 15.0;
        /// Where the search for it begins, rad over √m, and the factor of its steps.
        const FROM: f64 = 0.01;
        const FACTOR: f64 = 1.25;
        let mut most_turbulence = self.turbulence.max(FROM);
        let against = |turbulence| {
            let kinds = Speckle::ALL.map(|speckle| self.against_turbulence(turbulence, speckle));
            kinds.into_iter().fold(f64::INFINITY, f64::min)
        };
        while most_turbulence < 100.0 && against(most_turbulence) < TOO_MUCH {
            most_turbulence *= FACTOR;
        }
        Self { most_turbulence, ..self }
    }
}

/// Pairs of visits fewer than this tell nothing.
const ENOUGH: usize = 8;

/// A share that is taken before repeats tell it.
pub(super) const USUAL_SHARE: f64 = 0.02;

/// By how much a residual's fine structure along the rows may underestimate the noise.
const DOUBT: f64 = 2.0;

/// What is known of a share beforehand, in nats: receivers scatter by some percent, give or take a factor of three.
fn against_share(share: f64) -> f64 {
    0.5 * (share / USUAL_SHARE).ln().powi(2)
}

/// The least silent reading, or the floor that silence tells, and some more, as both are read with an error.
fn most_floor(silence: &Silence, told: f64, additive: f64) -> f64 {
    const SOME_MORE: f64 = 0.1;
    silence.least().max(told) * (1.0 + SOME_MORE) + SOME_MORE * additive
}

/// Judges the scatter of a scan, given what each reading should have been, drive by drive.
///
/// The additive part is silence's; the share is told by visits that came again to a point, the turbulence by
/// the way in which their scatter depends on the level. Where no point was visited again, the fine structure
/// of the residual along the rows stands for both: an upper bound.
pub(super) fn judge(scan: &ObservedScan, levels: &[Vec<Level>]) -> Scatter {
    let rough = roughness(scan, levels);
    // A converter with coarse steps reads silence as nothing at all.
    let largest = scan.drives.iter().flat_map(|d| &d.readings).fold(0.0f64, |a, r| a.max(*r));
    let lowest = (LEAST_ADDITIVE * largest).max(f64::MIN_POSITIVE);
    let silence = Silence::of(&scan.silent, scan.averaged);
    let unsaid = Told { additive: rough.1, floor: 0.0, evidence: 0.0 };
    let mut told = silence.as_ref().map_or(unsaid, |silence| silence.told(USUAL_SHARE));
    let mut pairs = pairs_beside(scan, levels, told.floor);
    let beside_floor = told.floor > 0.0 && scan.averaged == 1.0 && pairs.len() >= ENOUGH;
    if let Some(silence) = silence.as_ref().filter(|_| beside_floor) {
        // Beside a floor silence scatters by the share, too: both are found from silence and repeats together.
        let most_share = (DOUBT * rough.0).max(10.0 * LEAST_SHARE);
        let of = |additive: f64| {
            least(LEAST_SHARE, most_share, |share| {
                cost(&pairs, share, additive, 0.0, Speckle::OfPaths)
                    + silence.cost(additive, share)
                    + against_share(share)
            })
        };
        let most = silence.floor_beside(0.0);
        let (additive, _) = least(1e-3 * most, 0.7 * most, |additive| of(additive).1);
        let evidence = silence.told(of(additive).0).evidence;
        told = Told { additive, floor: silence.floor_beside(additive), evidence };
        pairs = pairs_beside(scan, levels, told.floor);
    }
    let additive = told.additive.max(lowest);
    let scatter = Scatter {
        share: rough.0,
        additive,
        turbulence: 0.0,
        speckle: Speckle::OfPaths,
        most_turbulence: f64::INFINITY,
        floor: told.floor,
        most_floor: silence
            .as_ref()
            .map_or(f64::INFINITY, |silence| most_floor(silence, told.floor, additive)),
        floor_evidence: told.evidence,
        pairs: pairs.into(),
    };
    let pairs = &scatter.pairs;
    if pairs.len() < ENOUGH {
        return scatter;
    }
    let best_share = |additive: f64, turbulence: f64, speckle: Speckle| {
        least(LEAST_SHARE, 1.0, |share| {
            cost(pairs, share, additive, turbulence, speckle) + against_share(share)
        })
    };
    let of_silence = |additive: f64| match &silence {
        Some(silence) if told.floor == 0.0 => silence.cost_without_floor(additive),
        _ => 0.0,
    };
    /// Factor within which silence tells the additive part, if repeats say otherwise.
    const SURE: f64 = 2.0;
    let steady = |additive: f64| best_share(additive, 0.0, Speckle::OfPaths);
    let (steady_additive, steady_cost) = match silence.is_some() && told.floor == 0.0 {
        true => least(additive / SURE, additive * SURE, |additive| {
            steady(additive).1 + of_silence(additive)
        }),
        false => (additive, steady(additive).1),
    };
    let turbulent = Speckle::ALL.map(|speckle| {
        (least(0.01, 10.0, |turbulence| best_share(additive, turbulence, speckle).1), speckle)
    });
    let ((turbulence, turbulent_cost), speckle) = match turbulent[0].0.1 <= turbulent[1].0.1 {
        true => turbulent[0],
        false => turbulent[1],
    };
    /// Nats that turbulence must gain before scatter is put down to it.
    const ENOUGH_EVIDENCE: f64 = 8.0;
    if steady_cost - turbulent_cost - of_silence(additive) > ENOUGH_EVIDENCE {
        let share = best_share(additive, turbulence, speckle).0;
        return Scatter { share, turbulence, speckle, ..scatter }.with_most_turbulence();
    }
    let (additive, share) = (steady_additive, steady(steady_additive).0);
    // Repeats also differ by what the model of them leaves out (a lag, a drift); the residual's fine structure along
    // the rows does less so, if it is rougher than the noise by less.
    let share = share.min(DOUBT * rough.0);
    Scatter { share, additive, ..scatter }.with_most_turbulence()
}

/// The scatter of a scan, share and additive part moved to where all its readings, silence and repeats together are
/// likeliest, as far as silence and repeats allow.
pub(super) fn settled(scan: &ObservedScan, levels: &[Vec<Level>], judged: Scatter) -> Scatter {
    /// Nats by which silence and repeats may speak against it: what all readings scatter by may be a gap.
    const AGAINST: f64 = 3.0;
    /// Factor within which the one is looked for while the other is held.
    const WIDE: f64 = 3.0;
    let Some(silence) = Silence::of(&scan.silent, scan.averaged) else { return judged };
    let averaged_beside_floor = judged.floor > 0.0 && scan.averaged > 1.0;
    if judged.turbulence > 0.0 || judged.pairs.len() < ENOUGH || averaged_beside_floor {
        return judged;
    }
    let full_scale = full_scale(scan);
    let mut told: Vec<Pair> = Vec::new();
    for (drive, levels) in scan.drives.iter().zip(levels) {
        for (reading, level) in drive.readings.iter().zip(levels) {
            if *reading >= full_scale {
                continue;
            }
            // A reading scatters by half of what a difference of two does.
            let difference = 2f64.sqrt() * (reading - level.reading);
            told.push(Pair::new(*level, scan.averaged, judged.floor, difference));
        }
    }
    let steady = |pairs: &[Pair], share: f64, additive: f64| {
        cost(pairs, share, additive, 0.0, Speckle::OfPaths)
    };
    let known = |share: f64, additive: f64| {
        let of_silence = match judged.floor > 0.0 {
            true => silence.cost(additive, share),
            false => silence.cost_without_floor(additive),
        };
        steady(&judged.pairs, share, additive) + of_silence + against_share(share)
    };
    let of = |share: f64, additive: f64| steady(&told, share, additive) + known(share, additive);
    let least_known = known(judged.share, judged.additive);
    // What one may be depends on what the other is: beside a floor silence tells a sum of both.
    let either = |at: f64, known: &dyn Fn(f64) -> f64| least(at / WIDE, at * WIDE, known).1;
    let limit = |factor: f64, known: &dyn Fn(f64) -> f64| {
        let mut limit = 1.0;
        while (0.02..50.0).contains(&limit) && known(limit) < least_known + AGAINST {
            limit *= factor;
        }
        limit
    };
    const FINER: f64 = 1.06;
    let of_share =
        |factor: f64| either(judged.additive, &|additive| known(factor * judged.share, additive));
    let of_additive =
        |factor: f64| either(judged.share, &|share| known(share, factor * judged.additive));
    let shares = [1.0 / FINER, FINER].map(|factor| judged.share * limit(factor, &of_share));
    let additives =
        [1.0 / FINER, FINER].map(|factor| judged.additive * limit(factor, &of_additive));
    let best_share = |additive: f64| least(shares[0], shares[1], |share| of(share, additive));
    let (additive, _) = least(additives[0], additives[1], |additive| best_share(additive).1);
    let steady = Scatter { share: best_share(additive).0, additive, ..judged };
    let turbulent = match steady.floor == 0.0 {
        true => turbulent(&told, &silence, &steady),
        false => None,
    };
    turbulent.unwrap_or(steady).with_most_turbulence()
}

/// Share and additive part as the residual's third differences along evenly spaced visits tell them: their square is 20
/// times the variance of white noise.
fn roughness(scan: &ObservedScan, levels: &[Vec<Level>]) -> (f64, f64) {
    let full_scale = full_scale(scan);
    let mut told: Vec<(f64, f64)> = Vec::new();
    for (drive, levels) in scan.drives.iter().zip(levels) {
        let beyond = |i: usize| drive.readings[i] - levels[i].reading;
        for i in 0..drive.visits.len().saturating_sub(3) {
            let even = (i + 2..i + 4).all(|j| {
                let (a, b) = (&drive.visits[j], &drive.visits[i + 1]);
                (a.velocity_m_s - b.velocity_m_s).norm() <= 1e-3 * b.velocity_m_s.norm()
            });
            let seen = drive.readings[i..i + 4].iter().all(|&reading| reading < full_scale);
            if even && seen {
                let third = beyond(i + 3) - 3.0 * beyond(i + 2) + 3.0 * beyond(i + 1) - beyond(i);
                let level = 0.5 * (levels[i + 1].reading + levels[i + 2].reading);
                told.push((level * level, third * third / 20.0));
            }
        }
    }
    if told.is_empty() {
        let default = Scatter::default();
        let readings = scan.drives.iter().flat_map(|drive| &drive.readings);
        let largest = readings.fold(0.0f64, |largest, r| largest.max(*r));
        return (default.share, 5e-3 * largest);
    }
    told.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (low, high) = told.split_at(told.len() / 2);
    // Medians, as a gap is rough in some places: of the square of a normal number, 0.455 times its mean.
    let middle = |part: &[(f64, f64)]| {
        let mut variances: Vec<f64> = part.iter().map(|(_, variance)| *variance).collect();
        variances.sort_by(f64::total_cmp);
        let levels = part.iter().map(|(level, _)| level).sum::<f64>() / part.len().max(1) as f64;
        (levels, variances.get(variances.len() / 2).copied().unwrap_or(0.0) / 0.455)
    };
    let ((low_level, low), (high_level, high)) = (middle(low), middle(high));
    let share = ((high - low) / (high_level - low_level).max(f64::MIN_POSITIVE)).max(0.0).sqrt();
    let additive = (low - share * share * low_level).max(1e-4 * low).sqrt();
    (share.max(1e-3), additive)
}
