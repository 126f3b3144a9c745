//! The scatter of every scan, judged by the readings expected of a forward model.

use crate::effect_id::EffectId;
use crate::effects::{effect, turbulence};
use crate::limits::{NOISE_CHANGED, NOISE_MISJUDGED};
use crate::model::effect::{Choice, Context};
use crate::model::forward_model::ForwardModel;
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, ObservedDrive};
use crate::model::pressure::Pressure;
use crate::noise::by_direction::with_play_or_lag;
use crate::noise::judge::{judge_scatter, settled};
use crate::noise::slow::with_slow_noise;
use crate::statistics::reading_pairs::{Compression, Level};
use crate::statistics::scatter::Scatter;

/// Judges the scatter of every scan again, by the expected readings. If the model is `fitted`, its residuals are used too. A play or a lag that
/// repeats show is no scatter, whether the model has it or not.
pub(crate) fn settle_scatter(
    observations: &mut Observations,
    model: &ForwardModel<'_>,
    nuisance: &[Nuisance],
    context: &Context,
    fitted: bool,
) {
    let levels = levels(observations, model, nuisance, context);
    for (scan, levels) in observations.scans.iter_mut().zip(&levels) {
        let scatter = judge_scatter(scan, levels);
        let scatter = match fitted {
            true => with_slow_noise(scan, levels, settled(scan, levels, scatter)),
            false => scatter,
        };
        for (drive, levels) in scan.drives.iter_mut().zip(levels) {
            let expected = levels.iter().map(|level| level.reading);
            drive.expected = expected.filter(|_| scatter.slow.is_some()).collect();
        }
        scan.set_scatter(scatter);
    }
}

/// The expected readings and their scatter for a unit of each fluctuation, by scan, drive and visit.
fn levels(
    observations: &Observations,
    model: &ForwardModel<'_>,
    nuisance: &[Nuisance],
    context: &Context,
) -> Vec<Vec<Vec<Level>>> {
    /// Turbulence, rad over one metre, and variance of the position, mm², small enough to be linear in the square.
    const TURBULENCE: f64 = 1e-3;
    const JITTER_MM2: f64 = 1e-4;
    let model = with_play_or_lag(model.without_fluctuations(), observations, nuisance, context);
    let probed = |id: EffectId, choice: Choice, values: &[f64]| {
        let instance = Instance { effect: effect(id), choice };
        model.and(&instance, values, context).pressures(observations, nuisance)
    };
    let stirred = probed(EffectId::Turbulence, turbulence::OF_PATHS, &[TURBULENCE]);
    let shaken = probed(EffectId::PositionJitter, Choice::None, &[JITTER_MM2; 3]);
    let mut readings = model.expected_readings(observations, nuisance).into_iter();
    let mut compressions = model.compressions(observations, nuisance).into_iter();
    let scans = observations.scans.iter().zip(nuisance).zip(stirred.iter().zip(&shaken));
    scans
        .map(|((scan, nuisance), (stirred, shaken))| {
            let power = (2.0 * nuisance.log_gain).exp();
            let of_drive = |(drive, (stirred, shaken)): (&ObservedDrive, Probed<'_>)| {
                let visits = readings.by_ref().take(drive.visits.len());
                let level = |(reading, (stirred, shaken)): (f64, (&Pressure, &Pressure))| {
                    let of_unit = |pressure: &Pressure, square: f64| {
                        pressure.speckle_along_and_across().map(|s| s * power / square)
                    };
                    Level {
                        reading,
                        by_turbulence: of_unit(stirred, TURBULENCE * TURBULENCE),
                        by_jitter: of_unit(shaken, JITTER_MM2),
                        compression: compressions.next().unwrap_or(Compression::NONE),
                    }
                };
                visits.zip(stirred.iter().zip(shaken)).map(level).collect()
            };
            scan.drives.iter().zip(stirred.iter().zip(shaken)).map(of_drive).collect()
        })
        .collect()
}

/// Pressures of one drive with a little turbulence, and with a little scatter of the position.
type Probed<'p> = (&'p Vec<Pressure>, &'p Vec<Pressure>);

/// How the noise after a fit compares with that before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoiseChange {
    /// The same.
    Alike,
    /// Changed, but the search remains valid.
    Otherwise,
    /// Changed so much that the search was misled.
    Misled,
}

/// Judges the noise again by what a fitted model expects; an immaterial change is not applied.
pub(crate) fn settled_again(
    observations: &mut Observations,
    model: &ForwardModel<'_>,
    nuisance: &[Nuisance],
    context: &Context,
) -> NoiseChange {
    let before: Vec<_> = observations.scans.iter().map(|scan| scan.scatter.clone()).collect();
    settle_scatter(observations, model, nuisance, context, true);
    let pairs = || observations.scans.iter().map(|scan| &scan.scatter).zip(&before);
    let changed = pairs().any(|(scatter, before)| {
        let off = |now: f64, before: f64| (now / before - 1.0).abs() > NOISE_CHANGED;
        off(scatter.share, before.share)
            || off(scatter.additive, before.additive)
            || off(scatter.share_of_repeats(), before.share_of_repeats())
    });
    let misled = pairs().any(|(scatter, before)| misleads(scatter, before));
    if !changed {
        for (scan, before) in observations.scans.iter_mut().zip(before) {
            scan.set_scatter(before);
        }
        return NoiseChange::Alike;
    }
    if misled { NoiseChange::Misled } else { NoiseChange::Otherwise }
}

/// Whether this noise is so far from the one before that a search with that was misled.
fn misleads(now: &Scatter, before: &Scatter) -> bool {
    let is_off =
        |now: f64, before: f64| !(NOISE_MISJUDGED..1.0 / NOISE_MISJUDGED).contains(&(now / before));
    is_off(now.share, before.share)
        || is_off(now.additive, before.additive)
        || (now.fluctuation > 0.0) != (before.fluctuation > 0.0)
        || now.slow.is_some() != before.slow.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_part_of_the_noise_may_have_misled() {
        let before = Scatter { share: 0.01, additive: 1e-3, ..Scatter::default() };
        let now = |share: f64, additive: f64, fluctuation: f64| {
            misleads(&Scatter { share, additive, fluctuation, ..Scatter::default() }, &before)
        };
        assert!(!now(0.012, 1.2e-3, 0.0));
        assert!(now(0.005, 1e-3, 0.0) && now(0.01, 5e-4, 0.0));
        assert!(now(0.01, 2e-3, 0.0) && now(0.01, 1e-3, 0.1));
    }
}
