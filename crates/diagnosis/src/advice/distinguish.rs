//! Which effects a scan can separate, whatever its readings: the Fisher information of its places, drives and noise.
//!
//! To first order an effect changes the readings along its signature, the derivatives of the residuals by its parameters. The part of a
//! signature in the span of another effect's signature and of the nuisance parameters cannot be separated from that effect. The squared
//! rest, over the whole, is the residual share of the information (S. M. Kay, *Fundamentals of Statistical Signal Processing*, vol. 1,
//! section 3.8).

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::Incomparable;
use fieldgap_records::RecordedScan;
use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::Serialize;

use crate::effect_id::EffectId;
use crate::effects::effect;
use crate::fit::score_statistic::ScoreStatistics;
use crate::limits::{READINGS_OF_A_SEARCH, SEPARATED_SIGMA};
use crate::model::effect::{Effect, Search};
use crate::model::forward_model::ForwardModel;
use crate::model::observations::Observations;
use crate::noise::settle::settle_scatter;
use crate::preparation::Prepared;
use crate::selection::scored_model::believed;
use crate::verdict::gap_size::as_believed;

/// Two effects that a scan separates poorly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AlikeEffects {
    /// The true effect.
    pub effect: EffectId,
    /// The effect that is mistaken for it.
    pub imitator: EffectId,
    /// Share of the effect's squared signature, gain and a small shift removed, that the imitator cannot reproduce, in the direction of its
    /// parameters where it is least; 0 to 1.
    pub residual_share: f64,
    /// Gap at which the two are separated by three standard deviations, rms over all readings in units of their noise. The gap is that of
    /// the believed set-up at the best gain, with what a small shift would take up.
    pub separable_gap_sigma: f64,
}

/// Every pair of effects that act to first order, the most alike first. Of the two orders of a pair the one with the smaller residual
/// share is listed. An effect with two laws is represented by the first. Choices (dead elements, steps, heights) and effects that change
/// the scatter (turbulence, jitter, compression, floor, clipping) are left out. Of a scan with phases these count too; the gap at which two
/// effects are separated is still that of the amplitudes.
///
/// # Errors
/// [`Incomparable`] if there is nothing to compare.
pub fn alike_effects(
    scan: &RecordedScan,
    simulator: Option<Simulator>,
) -> Result<Vec<AlikeEffects>, Incomparable> {
    alike(scan, simulator, true)
}

/// As [`alike_effects`], by the amplitudes of the readings alone.
///
/// # Errors
/// [`Incomparable`] if there is nothing to compare.
pub fn alike_effects_by_amplitudes(
    scan: &RecordedScan,
    simulator: Option<Simulator>,
) -> Result<Vec<AlikeEffects>, Incomparable> {
    alike(scan, simulator, false)
}

fn alike(
    scan: &RecordedScan,
    simulator: Option<Simulator>,
    with_phases: bool,
) -> Result<Vec<AlikeEffects>, Incomparable> {
    let Prepared { mut observations, context, .. } =
        Prepared::of(std::slice::from_ref(scan), simulator, with_phases)?;
    let nuisance = as_believed(&observations);
    settle_scatter(&mut observations, &ForwardModel::believed(), &nuisance, &context, false);
    let readings = observations.len() as f64;
    observations = observations.thinned(READINGS_OF_A_SEARCH);
    let base = believed(&observations, &context);
    let scores = ScoreStatistics::of(&observations, &context, &base.fit);
    let signatures: Vec<Signature> = EffectId::ALL
        .par_iter()
        .map(|id| effect(*id))
        .filter(|effect| has_slope(*effect, &observations))
        .filter(|effect| !effect.begins_flat(&context))
        .filter_map(|effect| Signature::of(effect, &scores))
        .collect();
    let nuisance = scores.known_columns();
    let mut alike: Vec<AlikeEffects> = signatures
        .par_iter()
        .flat_map_iter(|signature| {
            let others = signatures.iter().filter(|other| other.id != signature.id);
            others.filter_map(|other| {
                let Residual { share: residual_share, of_gap } =
                    signature.residual(&nuisance, other)?;
                let separable_gap_sigma = SEPARATED_SIGMA / (readings * of_gap).sqrt();
                let (effect, imitator) = (signature.id, other.id);
                Some(AlikeEffects { effect, imitator, residual_share, separable_gap_sigma })
            })
        })
        .collect();
    alike.sort_by(|a, b| a.residual_share.total_cmp(&b.residual_share));
    let mut seen: Vec<[EffectId; 2]> = Vec::new();
    alike.retain(|pair| {
        let is_new = !seen.contains(&[pair.imitator, pair.effect]);
        seen.push([pair.effect, pair.imitator]);
        is_new
    });
    Ok(alike)
}

/// Whether a scan whose gap has this size, rms in standard deviations of a reading, leaves two sets of effects apart by less than three
/// standard deviations, to first order. `alike` are the pairs of that scan. `None` where the sets differ by more than one effect each, or by
/// effects that are not in these pairs.
pub fn are_alike(
    alike: &[AlikeEffects],
    [one, other]: [&[EffectId]; 2],
    gap_sigma: f64,
) -> Option<bool> {
    let beyond = |set: &[EffectId], of: &[EffectId]| -> Option<EffectId> {
        let mut more = set.iter().filter(|id| !of.contains(id));
        more.next().copied().filter(|_| more.next().is_none())
    };
    let ids = [beyond(one, other)?, beyond(other, one)?];
    let pair =
        alike.iter().find(|pair| ids.contains(&pair.effect) && ids.contains(&pair.imitator))?;
    Some(gap_sigma < pair.separable_gap_sigma)
}

/// Whether an effect has a signature where it does nothing.
fn has_slope(effect: &dyn Effect, observations: &Observations) -> bool {
    let has_columns = match effect.search() {
        Search::Smooth => true,
        Search::Random => observations.tell_each_element(),
        _ => false,
    };
    has_columns && !effect.is_defect() && effect.can_act(observations)
}

/// The signature of an effect.
struct Signature {
    id: EffectId,
    /// Derivatives of the amplitudes, then of the phases, each column with a mean square of one over the amplitudes.
    columns: DMatrix<f64>,
    /// How many amplitudes there are.
    amplitudes: usize,
}

/// What of a signature another effect cannot reproduce, in the direction of its parameters where it is least.
struct Residual {
    /// Share of the squared signature, nuisance parameters removed.
    share: f64,
    /// The same over the squared gap that the effect makes: that of the amplitudes, with the gain alone removed.
    of_gap: f64,
}

impl Signature {
    /// Of an effect; `None` if it changes nothing.
    fn of(effect: &'static dyn Effect, scores: &ScoreStatistics<'_>) -> Option<Self> {
        let neutral = match effect.search() {
            Search::Random => effect.no_departures(scores.observations.elements()),
            _ => effect.neutral(),
        };
        let amplitudes = scores.observations.len();
        let columns: Vec<_> = scores
            .columns_of(effect, &neutral)
            .into_iter()
            .map(|column| {
                let of = &column[..amplitudes];
                let rms = (of.iter().map(|c| c * c).sum::<f64>() / amplitudes as f64).sqrt();
                (rms > 0.0 && rms.is_finite())
                    .then(|| column.iter().map(|c| c / rms).collect::<Vec<f64>>())
            })
            .collect::<Option<_>>()?;
        let rows = columns.first()?.len();
        let columns = DMatrix::from_fn(rows, columns.len(), |i, j| columns[j][i]);
        Some(Self { id: effect.id(), columns, amplitudes })
    }

    /// What is left beside another effect.
    fn residual(&self, nuisance: &DMatrix<f64>, other: &Self) -> Option<Residual> {
        let alone = self.beside(nuisance)?;
        let mut both =
            nuisance.clone().resize_horizontally(nuisance.ncols() + other.columns.ncols(), 0.0);
        // (What a scan's prior adds to the nuisance's columns stands in rows of its own below the readings'.)
        both.view_mut((0, nuisance.ncols()), other.columns.shape()).copy_from(&other.columns);
        let beside = self.beside(&both)?;
        let share = least_over(alone, &beside)?.clamp(1e-9, 1.0);
        let of_gap = least_over(self.gap(nuisance)?, &beside)?.max(1e-9);
        Some(Residual { share, of_gap })
    }

    /// The squared gap by the parameters: the information in the amplitudes alone, the gain free.
    fn gap(&self, nuisance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        // The gain is the first of the nuisance parameters.
        let gain = nuisance.view((0, 0), (self.amplitudes, 1)).into_owned();
        let columns = self.columns.rows(0, self.amplitudes).into_owned();
        Self { id: self.id, columns, amplitudes: self.amplitudes }.beside(&gain)
    }

    /// The information about the parameters, those of `columns` free.
    fn beside(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        /// Keeps the normal matrix regular where columns are equal to rounding.
        const RIDGE: f64 = 1e-9;
        let rows = self.columns.nrows();
        let mut within = columns.tr_mul(columns);
        for i in 0..within.nrows() {
            within[(i, i)] *= 1.0 + RIDGE;
        }
        let across = columns.rows(0, rows).tr_mul(&self.columns);
        let own = self.columns.tr_mul(&self.columns);
        Some(&own - across.transpose() * within.cholesky()?.solve(&across))
    }
}

/// The least eigenvalue of one information over another.
fn least_over(alone: DMatrix<f64>, beside: &DMatrix<f64>) -> Option<f64> {
    let root = alone.cholesky()?.l();
    let half = root.solve_lower_triangular(beside)?;
    let whole = root.solve_lower_triangular(&half.transpose())?;
    Some(whole.symmetric_eigen().eigenvalues.min())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four readings: the gain moves the first, a shift the second. The effect is mostly that shift, and the imitator has half the power of the rest.
    #[test]
    fn what_a_shift_takes_up_is_part_of_the_gap_and_not_of_the_signature() {
        let column = |values: [f64; 4]| DMatrix::from_column_slice(4, 1, &values);
        let signature = |id, values| Signature { id, columns: column(values), amplitudes: 4 };
        let effect = signature(EffectId::Flow, [0.0, 0.8, 0.6, 0.0]);
        let other = signature(EffectId::ArrayTilt, [0.0, 0.0, 1.0, 1.0]);
        let nuisance = DMatrix::from_fn(4, 2, |row, number| f64::from(u8::from(row == number)));
        let Residual { share, of_gap } = effect.residual(&nuisance, &other).expect("both act");
        assert!((share - 0.5).abs() < 1e-6, "{share}");
        assert!((of_gap - 0.5 * 0.36).abs() < 1e-6, "{of_gap}");
    }

    #[test]
    fn sets_are_alike_where_the_one_effect_that_differs_is_imitated_at_that_gap() {
        use EffectId::{Aperture, Flow, Pitch, Polarity, ReceiverDirectivity};
        let alike = [AlikeEffects {
            effect: Aperture,
            imitator: ReceiverDirectivity,
            residual_share: 0.01,
            separable_gap_sigma: 2.0,
        }];
        let told = |one: &[EffectId], other: &[EffectId], gap_sigma| {
            are_alike(&alike, [one, other], gap_sigma)
        };
        assert_eq!(told(&[ReceiverDirectivity], &[Aperture], 1.9), Some(true));
        assert_eq!(told(&[Aperture], &[ReceiverDirectivity], 2.1), Some(false));
        assert_eq!(told(&[Flow, Aperture], &[ReceiverDirectivity, Flow], 1.0), Some(true));
        assert_eq!(told(&[Aperture], &[Pitch], 1.0), None);
        assert_eq!(told(&[Aperture, Flow], &[ReceiverDirectivity, Pitch], 1.0), None);
        assert_eq!(told(&[Aperture], &[Aperture, Polarity], 1.0), None);
    }
}
