//! What each reading should have been under a fit, to judge the readings' scatter by.

use super::effects::Context;
use super::fit::Fit;
use super::gap_size::expected;
use super::likelihood::pressures;
use super::observations::{Observations, ObservedDrive};
use super::pair::Level;
use super::scatter::{judge, settled};
use super::supposed::{Pressure, Speckle, Supposed};

/// Judges the scatter of every scan anew, by what a fit says that readings should have been; where it has `fitted` them,
/// what it leaves is let speak too.
pub(super) fn settle_scatter(
    observations: &mut Observations,
    fit: &Fit,
    context: &Context,
    fitted: bool,
) {
    let levels = levels(observations, fit, context);
    for (scan, levels) in observations.scans.iter_mut().zip(&levels) {
        let scatter = judge(scan, levels);
        scan.set_scatter(if fitted { settled(scan, levels, scatter) } else { scatter });
    }
}

/// By scan, drive and visit.
fn levels(observations: &Observations, fit: &Fit, context: &Context) -> Vec<Vec<Vec<Level>>> {
    /// Turbulence, rad over √m, small enough to be linear in its square.
    const PROBE: f64 = 1e-3;
    let supposed = Supposed { turbulence: 0.0, ..fit.supposed(context) };
    let stirred = Supposed { turbulence: PROBE, speckle: Speckle::OfPaths, ..supposed.clone() };
    let stirred = pressures(observations, &stirred, &fit.nuisance);
    let mut readings = expected(observations, &supposed, &fit.nuisance).into_iter();
    let mut levels = Vec::new();
    for ((scan, nuisance), stirred) in observations.scans.iter().zip(&fit.nuisance).zip(&stirred) {
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
