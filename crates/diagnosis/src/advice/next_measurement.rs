//! The scan that would separate two rivals: of some that a lab can make at once, the one in which they differ most after a refit.
//!
//! The expected readings of one rival stand for the scan, and the other rival is fitted to them. The square root of the remaining cost is
//! the number of standard deviations by which the whole scan would separate the two.

use fieldgap_acoustics::{Excitation, Simulation, Simulator, Vec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

use super::extent::{Extent, Grid};
use crate::effect_id::joined;
use crate::fit::joint_fit::{Fit, SEARCH, Start, fit};
use crate::limits::{
    MARGIN_OF_A_PROPOSAL, POINTS_ALONG_A_PROPOSED_ROW, READINGS_OF_A_SEARCH, SEPARATED_SIGMA,
};
use crate::model::effect::{Context, Effect, Timing};
use crate::model::forward_model::ForwardModel;
use crate::model::motion::Motion;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{NOT_RECORDED, Observations, ObservedDrive, ObservedScan, Visit};
use crate::model::residuals::Residuals;
use crate::result::NextMeasurement;
use crate::statistics::noise_scale::NoiseScale;

/// Speed of a slower scan over that of the one that was made.
const SLOWER: f64 = 1.0 / 3.0;

/// Dark readings before and after a proposed scan.
const DARK_READINGS: usize = 64;

/// A scan that could be made.
struct Proposal {
    what: String,
    heights_mm: Vec<f64>,
    drives: Vec<Excitation>,
    /// How often each point is measured, pass after pass.
    passes: usize,
    /// Every row in the same direction.
    raster: bool,
    /// Speed along the rows; nothing for a robot that stops at each point.
    speed_m_s: Option<f64>,
    /// Speed of the recorded scan over the proposed one.
    slower: f64,
}

/// Proposes the scan that separates two fits best, inside the travel of the recorded scans and with readings enough for a diagnosis; `None`
/// where the array is driven without a focus, or where the recorded scans have no area. `seconds_a_reading` is the pace of the recorded scan,
/// where it is known.
pub(crate) fn next_measurement(
    observations: &Observations,
    context: &Context,
    rivals: [&Fit; 2],
    simulator: Simulator,
    name: &str,
    seconds_a_reading: Option<f64>,
) -> Option<NextMeasurement> {
    let first = observations.first();
    let focus_m = first.believed.excitation.focus_m()?;
    let extent = Extent::of(observations)?;
    let few = observations.thinned(READINGS_OF_A_SEARCH);
    let present =
        separation(&few, context, rivals) * (observations.len() as f64 / few.len() as f64).sqrt();
    let proposals = proposals(first, focus_m, &extent, rivals);
    // The best is the one that separates most with each reading, so that a longer scan has to earn its time.
    let tell_apart: Vec<f64> = proposals
        .par_iter()
        .map(|proposal| {
            let scan = proposal.scan(observations, &extent);
            separation(&scan, context, rivals) / (scan.len() as f64).sqrt()
        })
        .collect();
    let proposals = tell_apart.into_iter().zip(proposals);
    let (each, best) = proposals.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let wanted = (MARGIN_OF_A_PROPOSAL * SEPARATED_SIGMA / each).powi(2);
    let grid = extent.grid(best.planes(), wanted);
    let readings = best.planes() * grid.points();
    let sigma = each * (readings as f64).sqrt();
    let duration_s =
        seconds_a_reading.map(|seconds| seconds * best.slower * (readings + DARK_READINGS) as f64);
    let [one, other] = rivals.map(|fit| joined(&fit.ids(), " + "));
    let mut what = match sigma < SEPARATED_SIGMA {
        true => format!(
            "No scan considered separates {one} from {other}. The best is {}: they would then differ by {sigma:.1} standard \
             deviations of the whole scan's noise, each fitted again.",
            best.what
        ),
        false => format!(
            "Scan {}: {one} and {other} would then differ by {sigma:.0} standard deviations of the whole scan's noise, each \
             fitted again; in these data they differ by {present:.1}.",
            best.what
        ),
    };
    what += &format!(" The plan has {readings} readings");
    what += &duration_s.map_or(".".to_owned(), |seconds| {
        format!("; at the pace of the recorded scan they take {}.", duration(seconds))
    });
    if extent.heights_mm().len() == 1 {
        what += " All are at the recorded height. If the robot's travel allows it, measure further heights too.";
    }
    let shown: Vec<&str> =
        differing(rivals).filter_map(|effect| effect.facts().independent_check).collect();
    if !shown.is_empty() {
        what += &format!(" Without a scan, {}.", shown.join("; "));
    }
    Some(NextMeasurement {
        what,
        expected_sigma: sigma,
        present_sigma: present,
        readings,
        duration_s,
        plan: Some(best.plan(simulator, name, &extent, grid)),
    })
}

/// A time in words, in seconds, minutes or hours.
fn duration(seconds: f64) -> String {
    match seconds {
        short if short < 90.0 => format!("about {:.0} s", short.max(1.0)),
        medium if medium < 5400.0 => format!("about {:.0} min", medium / 60.0),
        long => format!("about {:.1} h", long / 3600.0),
    }
}

/// The scans that a lab can make at once.
fn proposals(
    first: &ObservedDrive,
    focus_m: Vec3,
    extent: &Extent,
    rivals: [&Fit; 2],
) -> Vec<Proposal> {
    let other_m = Vec3::new(-focus_m.x, -focus_m.y, 1.3 * focus_m.z);
    let focus = Excitation::Focus(focus_m);
    let halves = [Vec3::x(), Vec3::y()].map(|side| half_reversed(&first.believed, &focus, side));
    let random = [1, 2].map(|number| random_phases(first.believed.array.len(), number));
    let of_motion = |timing: Timing| {
        rivals.iter().any(|fit| fit.instances.iter().any(|i| i.effect.facts().timing == timing))
    };
    // Only where the readings lag behind the motion does the speed of the robot matter.
    let moves = of_motion(Timing::Velocity);
    let speed_m_s = if moves { speed_along_rows_m_s(first) } else { None };
    // What scatters repeats, or changes in time, shows where each point is measured again.
    let scatters = differing(rivals).any(|effect| effect.scatters_repeats());
    let passes = if scatters || of_motion(Timing::Moment) { 2 } else { 1 };
    let twice = if passes > 1 { ", each point twice" } else { "" };
    let heights_mm = extent.heights_mm();
    let again = |what: &str| Proposal {
        what: format!("{what}{twice}"),
        heights_mm: heights_mm.clone(),
        drives: vec![focus.clone()],
        passes,
        raster: false,
        speed_m_s,
        slower: 1.0,
    };
    let mut proposals = vec![
        Proposal {
            drives: vec![focus.clone(), Excitation::Focus(other_m)],
            ..again("a second focus on the other side, higher up")
        },
        Proposal {
            drives: vec![focus.clone(), Excitation::Uniform],
            ..again("the focus, and again with all elements in phase")
        },
        Proposal {
            drives: [focus.clone()].into_iter().chain(halves).collect(),
            ..again(
                "the focus, and again with the right and with the upper half of the elements reversed",
            )
        },
        Proposal {
            drives: [focus.clone()].into_iter().chain(random).collect(),
            ..again("the focus, and twice with random phases, which separates the elements")
        },
        Proposal { raster: true, ..again("every row in the same direction") },
    ];
    if heights_mm.len() > 1 {
        proposals.push(Proposal {
            heights_mm: heights_mm.iter().rev().copied().collect(),
            ..again(
                "the same planes from the highest to the lowest, which separates time from height",
            )
        });
    }
    if let Some(more_mm) = extent.more_heights_mm() {
        let (from, to) = (more_mm[0], more_mm[more_mm.len() - 1]);
        let what = format!("more heights, {} from {from} to {to} mm", more_mm.len());
        proposals.push(Proposal { heights_mm: more_mm, ..again(&what) });
    }
    if let Some(speed_m_s) = speed_m_s {
        let speed_m_s = Some(SLOWER * speed_m_s);
        let slower = 1.0 / SLOWER;
        proposals.push(Proposal {
            speed_m_s,
            slower,
            ..again("the same planes at a third of the speed")
        });
    }
    proposals
}

/// The effects that one of two fits has and the other has not.
fn differing([one, other]: [&Fit; 2]) -> impl Iterator<Item = &'static dyn Effect> {
    let not_of = |fit: &Fit, other: &Fit| {
        let others = other.ids();
        let effects = fit.instances.iter().map(|instance| instance.effect);
        effects.filter(|effect| !others.contains(&effect.id())).collect::<Vec<_>>()
    };
    not_of(one, other).into_iter().chain(not_of(other, one))
}

/// A drive whose elements on one side of the array's middle are reversed.
fn half_reversed(believed: &Simulation, drive: &Excitation, side: Vec3) -> Excitation {
    let phases_rad = drive.phases_rad(&believed.array, &believed.medium, believed.frequency_hz);
    let elements = believed.array.elements().iter();
    let reversed = elements.zip(phases_rad).map(|(element, phase_rad)| {
        if element.centre_m.dot(&side) > 0.0 { phase_rad + PI } else { phase_rad }
    });
    Excitation::Phases(reversed.collect())
}

/// Random phases, one set for each number.
fn random_phases(elements: usize, number: u64) -> Excitation {
    let mut draws = ChaCha8Rng::seed_from_u64(number);
    Excitation::Phases((0..elements).map(|_| draws.random_range(0.0..TAU)).collect())
}

/// The largest apparent speed of the robot along rows; `None` where it has none.
fn speed_along_rows_m_s(drive: &ObservedDrive) -> Option<f64> {
    let in_rows = drive.visits.iter().filter(|visit| visit.is_in_row());
    let speeds = in_rows.map(|visit| visit.motion.velocity_m_s().norm());
    speeds.max_by(f64::total_cmp).filter(|speed_m_s| *speed_m_s > 0.0)
}

/// Standard deviations by which the second fit, refitted, misses the expected readings of the first.
fn separation(observations: &Observations, context: &Context, [one, other]: [&Fit; 2]) -> f64 {
    // (What the phases would tell is left out.)
    let mut synthetic = observations.without_phases();
    let nuisance = vec![one.nuisance[0]; synthetic.scans.len()];
    let mut readings = one.model(context).expected_readings(&synthetic, &nuisance).into_iter();
    for scan in &mut synthetic.scans {
        for drive in &mut scan.drives {
            drive.readings = readings.by_ref().take(drive.visits.len()).collect();
        }
        scan.set_scatter(scan.scatter.clone());
    }
    let start = Start {
        instances: other.instances.clone(),
        values: other.values.clone(),
        spreads: other.spreads.clone(),
        nuisance: Some(
            other.nuisance.clone().with_scans(vec![other.nuisance[0]; synthetic.scans.len()]),
        ),
    };
    let other = fit(&synthetic, context, start, SEARCH);
    let residuals = |model: ForwardModel<'_>, nuisance: &[Nuisance]| {
        let pressures = model.pressures(&synthetic, nuisance);
        model.residuals(&synthetic, &pressures, nuisance)
    };
    let [one, other] = [
        residuals(one.model(context), &nuisance),
        residuals(other.model(context), &other.nuisance),
    ];
    told_apart(&one, &other).sqrt()
}

/// Twice the Kullback-Leibler divergence of the second model from the first, whose residuals are zero: squared residuals and the terms of
/// a different variance (S. Kullback and R. A. Leibler, Ann. Math. Stat. 22, 79, 1951).
fn told_apart(one: &Residuals, other: &Residuals) -> f64 {
    let log_variance = |of: &Residuals, n: usize| of.log_variances.get(n).copied().unwrap_or(0.0);
    let of_reading = |(n, residual): (usize, &f64)| {
        let smaller = log_variance(one, n) - log_variance(other, n);
        residual * residual + smaller.exp() - 1.0 - smaller
    };
    other.scaled.iter().enumerate().map(of_reading).sum()
}

impl Proposal {
    /// Planes of all drives and passes.
    fn planes(&self) -> usize {
        self.heights_mm.len() * self.drives.len() * self.passes
    }

    /// The scan as it would be made, with few points.
    fn scan(&self, observations: &Observations, extent: &Extent) -> Observations {
        let template = observations.first();
        let scatter = &observations.scans[0].scatter;
        let steps = (POINTS_ALONG_A_PROPOSED_ROW - 1) as f64;
        let along =
            |(from, to): (f64, f64), index: usize| from + (to - from) * index as f64 / steps;
        let total =
            (self.planes() * POINTS_ALONG_A_PROPOSED_ROW * POINTS_ALONG_A_PROPOSED_ROW) as f64;
        let speed = self.speed_m_s.unwrap_or(0.0);
        let lasts_s = observations.scans[0].lasts_s();
        let mut number = 0;
        let drives = self
            .drives
            .iter()
            .enumerate()
            .map(|(focus, excitation)| {
                let mut visits = Vec::new();
                let passes = (0..self.passes).flat_map(|_| &self.heights_mm);
                for z_mm in passes {
                    for row in 0..POINTS_ALONG_A_PROPOSED_ROW {
                        let back = row % 2 == 1 && !self.raster;
                        let x_direction = if back { -1.0 } else { 1.0 };
                        for step in 0..POINTS_ALONG_A_PROPOSED_ROW {
                            let column =
                                if back { POINTS_ALONG_A_PROPOSED_ROW - 1 - step } else { step };
                            let (x_m, y_m) =
                                (along(extent.x_m(), column), along(extent.y_m(), row));
                            visits.push(Visit {
                                number,
                                at_m: Vec3::new(x_m, y_m, 1e-3 * z_mm),
                                motion: Motion::steady(
                                    Vec3::x() * x_direction * speed,
                                    x_direction,
                                ),
                                otherwise: None,
                                begins: false,
                                time_s: lasts_s * number as f64 / total,
                                progress: number as f64 / total,
                                variance: 1.0,
                            });
                            number += 1;
                        }
                    }
                }
                let mut believed = template.believed.clone();
                believed.excitation = excitation.clone();
                let readings = vec![0.0; visits.len()];
                ObservedDrive {
                    focus,
                    number: NOT_RECORDED,
                    believed,
                    stabilised: readings.clone(),
                    expected: Vec::new(),
                    readings,
                    visits,
                    phases_rad: Vec::new(),
                    believed_rad: Vec::new(),
                }
            })
            .collect();
        let averaged = observations.scans[0].averaged;
        let scale = NoiseScale::new(scatter.share, scatter.additive, averaged);
        let scan = ObservedScan {
            drives,
            scatter: scatter.clone(),
            averaged,
            scale,
            slow_level: None,
            dark: Vec::new(),
            within: None,
            map_noise: None,
            outliers: 0,
            phase: None,
        };
        Observations { scans: vec![scan] }
    }

    fn plan(&self, simulator: Simulator, name: &str, extent: &Extent, grid: Grid) -> String {
        let tidy = |value: f64| (value * 1e3).round() / 1e3;
        let order = if self.raster { "raster" } else { "serpentine" };
        let mut plan = format!(
            "# {}.\nname = \"{name}-next\"\norder = \"{order}\"\n\n[simulator]\nmodel = \"{simulator}\"\n",
            self.what
        );
        for excitation in &self.drives {
            plan += "\n[[focus]]\n";
            plan += &match excitation {
                Excitation::Focus(focus_m) => {
                    let [x, y, z] = [focus_m.x, focus_m.y, focus_m.z].map(|m| tidy(1e3 * m));
                    format!("x_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\n")
                }
                Excitation::Uniform => "phases = \"all-zero\"\n".to_owned(),
                Excitation::Phases(phases_rad) => {
                    let phases_rad: Vec<f64> =
                        phases_rad.iter().map(|phase| tidy(phase.rem_euclid(TAU))).collect();
                    format!("phases_rad = {phases_rad:?}\n")
                }
            };
        }
        if let Some(speed_m_s) = self.speed_m_s {
            plan += &format!("\n[fly]\nspeed_mm_s = {:?}\n", tidy(1e3 * speed_m_s));
        }
        plan += "\n[dark]\nbefore = 32\nafter = 32\n";
        let heights: Vec<String> =
            self.heights_mm.iter().map(|z_mm| format!("{:?}", tidy(*z_mm))).collect();
        let middle = |(from, to): (f64, f64)| tidy(0.5e3 * (from + to));
        let [width, depth] = grid.size_m().map(|size_m| tidy(1e3 * size_m));
        let plane = format!(
            "\n[[plane]]\nz_mm = [{}]\ncentre_mm = [{:?}, {:?}]\nsize_mm = [{width:?}, {depth:?}]\nstep_mm = {:?}\n",
            heights.join(", "),
            middle(extent.x_m()),
            middle(extent.y_m()),
            tidy(1e3 * grid.step_m),
        );
        plan += &plane.repeat(self.passes);
        plan
    }
}

#[cfg(test)]
mod tests;
