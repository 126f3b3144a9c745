//! What each reading should have been under a fit, to judge the readings' scatter by.

use crate::effect_id::EffectId;
use crate::effects::{effect, turbulence};
use crate::model::effect::Context;
use crate::model::forward_model::ForwardModel;
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, ObservedDrive};
use crate::model::pressure::Pressure;
use crate::noise::judge::{judge_scatter, settled};
use crate::statistics::reading_pairs::Level;
use crate::statistics::speckle::Speckle;

/// Judges the scatter of every scan anew, by what a fit says that readings should have been; where it has `fitted` them,
/// what it leaves is let speak too.
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
        scan.set_scatter(if fitted { settled(scan, levels, scatter) } else { scatter });
    }
}

/// By scan, drive and visit.
fn levels(
    observations: &Observations,
    model: &ForwardModel<'_>,
    nuisance: &[Nuisance],
    context: &Context,
) -> Vec<Vec<Vec<Level>>> {
    /// Turbulence, rad over √m, small enough to be linear in its square.
    const PROBE: f64 = 1e-3;
    let model = model.without_scatter_of_the_field();
    let turbulence = Instance {
        effect: effect(EffectId::Turbulence),
        choice: turbulence::choice(Speckle::OfPaths),
    };
    let stirred = model.and(&turbulence, &[PROBE], context).pressures(observations, nuisance);
    let mut readings = model.expected_readings(observations, nuisance).into_iter();
    let mut levels = Vec::new();
    for ((scan, nuisance), stirred) in observations.scans.iter().zip(nuisance).zip(&stirred) {
        let unit = (nuisance.log_gain.exp() / PROBE).powi(2);
        let mut of_drive = |(drive, stirred): (&ObservedDrive, &Vec<Pressure>)| {
            let visits = readings.by_ref().take(drive.visits.len()).zip(stirred);
            let level = |(reading, stirred): (f64, &Pressure)| {
                let speckle = stirred.speckle_along_and_across().map(|square| square * unit);
                Level { reading, speckle }
            };
            visits.map(level).collect()
        };
        levels.push(scan.drives.iter().zip(stirred).map(&mut of_drive).collect());
    }
    levels
}
