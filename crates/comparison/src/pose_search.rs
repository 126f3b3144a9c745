//! The search for a pose without a start value: a coarse search, then refinement of fewer and fewer candidates on more and more
//! readings.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;

use super::coarse::candidates;
use super::pose::{Mirror, Pose};
use super::readings::Readings;
use super::refine::{Fit, PoseParameter, Search, refine};

/// Standard deviations of the priors of a pose: height and turn are set by hand, a step has the tolerance of a belt or a screw. They are
/// weak, so that they matter only for what the readings do not determine.
const HEIGHT_SD_M: f64 = 10e-3;
const TURN_SD_RAD: f64 = 0.09;
const STEP_SD: f64 = 0.05;

/// A round of refinement.
struct Round {
    /// Readings it looks at, at most.
    readings: usize,
    /// Linearisations of the simulation, at most.
    iterations: usize,
    /// Candidates that enter it, at most.
    entering: usize,
}

/// From many candidates on few readings to one on many: 40,000 readings determine a pose far better than any robot keeps it.
const ROUNDS: [Round; 3] = [
    Round { readings: 400, iterations: 6, entering: usize::MAX },
    Round { readings: 1500, iterations: 8, entering: 4 },
    Round { readings: 40_000, iterations: 8, entering: 1 },
];

/// Squared residuals with a smaller relative difference than this are taken as equal: the pose that is closer to the recorded
/// coordinates is chosen.
const AS_GOOD: f64 = 0.05;

/// The pose with the smallest residual, and the best of the other handedness.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The pose found, refined on all readings.
    pub best: Fit,
    /// The best of the other handedness, refined on some thousands of readings, if there was one in that round.
    pub other_handedness: Option<Fit>,
    /// The residual ratio of the best pose on the same readings.
    pub best_in_that_round: f64,
}

/// Searches every handedness, turn, step, height and shift; `None` without readings.
pub fn find_pose(readings: &Readings) -> Option<Found> {
    let mut starts: Vec<Pose> = candidates(readings).iter().map(|found| found.pose).collect();
    let mut rounds: Vec<Vec<Fit>> = Vec::new();
    for round in ROUNDS {
        let some = readings.thinned(round.readings);
        let mut fits: Vec<Fit> = starts
            .par_iter()
            .take(round.entering)
            .map(|start| refine(&some, *start, &search_about(start, round.iterations)))
            .collect();
        fits.sort_by(|a, b| a.residual_ratio.total_cmp(&b.residual_ratio));
        prefer_plain(&mut fits);
        starts = keep_both_hands(&fits, ROUNDS[1].entering);
        rounds.push(fits);
    }
    let [_, second, last] = rounds.as_slice() else { return None };
    let (then, best) = (second.first()?, Fit::at(readings, last.first()?.pose));
    let mirrored = |fit: &Fit| fit.pose.mirror != Mirror::None;
    let other = second.iter().find(|fit| mirrored(fit) != mirrored(&best)).cloned();
    Some(Found { best_in_that_round: then.residual_ratio, other_handedness: other, best })
}

/// All five parameters, with what is known of a pose in this orientation.
fn search_about(start: &Pose, iterations: usize) -> Search {
    let quarter = (start.turn_rad / FRAC_PI_2).round() * FRAC_PI_2;
    let prior = |parameter| match parameter {
        PoseParameter::ShiftX | PoseParameter::ShiftY => None,
        PoseParameter::ShiftZ => Some((0.0, HEIGHT_SD_M)),
        PoseParameter::Turn => Some((quarter, TURN_SD_RAD)),
        PoseParameter::Step => Some((1.0, STEP_SD)),
    };
    let free = PoseParameter::ALL.map(|parameter| (parameter, prior(parameter))).to_vec();
    Search { free, iterations }
}

/// Moves the simplest of those that are as good as the best to the front.
fn prefer_plain(sorted: &mut [Fit]) {
    let Some(best) = sorted.first() else { return };
    let limit = best.residual_ratio * (1.0 + AS_GOOD).sqrt();
    let plain = |fit: &Fit| {
        let mirrored = u8::from(fit.pose.mirror != Mirror::None);
        let quarters = (fit.pose.turn_rad / FRAC_PI_2).round().abs() as u8;
        mirrored + quarters
    };
    let as_good = sorted.iter().take_while(|fit| fit.residual_ratio <= limit).count();
    let plainest = (0..as_good).min_by_key(|&index| plain(&sorted[index]));
    if let Some(index) = plainest {
        sorted[..=index].rotate_right(1);
    }
}

/// The first `count`, the last of them replaced by the best of the missing handedness, if they are all of one.
fn keep_both_hands(sorted: &[Fit], count: usize) -> Vec<Pose> {
    let mut kept: Vec<Pose> = sorted.iter().take(count).map(|fit| fit.pose).collect();
    let mirrored = |pose: &Pose| pose.mirror != Mirror::None;
    if let Some(first) = kept.first().copied()
        && kept.iter().all(|pose| mirrored(pose) == mirrored(&first))
        && let Some(other) = sorted.iter().find(|fit| mirrored(&fit.pose) != mirrored(&first))
    {
        kept.truncate(count - 1);
        kept.push(other.pose);
    }
    kept
}
