//! The search for a pose without a start value: a coarse search, then refinement of fewer and fewer candidates on more and more
//! readings.

use std::f64::consts::FRAC_PI_2;

use fieldgap_acoustics::Vec3;
use rayon::prelude::*;

use super::coarse::{candidates, grid_points};
use super::pose::{Mirror, Pose};
use super::readings::{Readings, places};
use super::refine::{Fit, PoseParameter, Search, refine};

/// Standard deviations of the priors of a pose: height and turn are set by hand, a step has the tolerance of a belt or a screw. They are
/// weak, so that they matter only for what the readings do not determine.
pub(super) const HEIGHT_SD_M: f64 = 10e-3;
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

/// Fewest places from which a pose is searched: some fifteen for each of its six numbers and the gain. Fewer readings of a field
/// full of lobes agree with some pose by chance.
const FEWEST_PLACES: usize = 100;

/// Smallest standard deviation of the places along their narrowest horizontal direction, in wavelengths: that of an area of
/// three and a half wavelengths. Turn, handedness and step cannot be told from a line.
const NARROWEST: f64 = 1.0;

/// Largest extent along x and y, m: that of the largest scanning robots. The search computes the field over the whole area.
const WIDEST_M: f64 = 2.0;

/// Most points of the field at one height that a search computes: at 40 kHz those of the largest extent.
pub(super) const MOST_POINTS: f64 = 4e6;

/// Why no pose is searched.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Undetermined {
    /// Too few different places.
    #[error("{places} places do not determine a pose; at least {FEWEST_PLACES} are needed")]
    TooFew {
        /// Different places.
        places: usize,
    },
    /// The places are far apart.
    #[error("the places extend over {extent_m:.1} m; a pose is searched within {WIDEST_M} m")]
    TooWide {
        /// The larger extent along x and y, m.
        extent_m: f64,
    },
    /// The places extend over too many wavelengths, or lie too far from the array's axis.
    #[error(
        "within the reach of the places the field has {points:.1e} points a quarter of a wavelength apart; a pose is searched over at most \
         {MOST_POINTS:.0e}"
    )]
    TooFine {
        /// Points at each height.
        points: f64,
    },
    /// The places lie along a line.
    #[error(
        "the places spread by {spread_mm:.1} mm (standard deviation) along their narrowest direction, which does not determine a pose; \
         at least {needed_mm:.1} mm are needed"
    )]
    AlongALine {
        /// Standard deviation along the narrowest horizontal direction, mm.
        spread_mm: f64,
        /// What is needed, mm.
        needed_mm: f64,
    },
}

/// Whether the readings determine a pose.
///
/// # Errors
/// [`Undetermined`].
pub fn determine_a_pose(readings: &Readings) -> Result<(), Undetermined> {
    let positions_m = readings.positions_m();
    let places = places(&positions_m);
    if places < FEWEST_PLACES {
        return Err(Undetermined::TooFew { places });
    }
    let extent_m = |axis: usize| {
        let along = || positions_m.iter().map(|at| at[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    let extent_m = extent_m(0).max(extent_m(1));
    if extent_m > WIDEST_M {
        return Err(Undetermined::TooWide { extent_m });
    }
    let points = grid_points(readings);
    if points > MOST_POINTS {
        return Err(Undetermined::TooFine { points });
    }
    let n = positions_m.len() as f64;
    let mean = positions_m.iter().sum::<Vec3>() / n;
    let moment = |a: usize, b: usize| {
        positions_m.iter().map(|at| (at[a] - mean[a]) * (at[b] - mean[b])).sum::<f64>() / n
    };
    let (xx, xy, yy) = (moment(0, 0), moment(0, 1), moment(1, 1));
    // The smaller eigenvalue of the covariance of x and y.
    let least = 0.5 * (xx + yy) - (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
    let (spread_m, needed_m) = (least.max(0.0).sqrt(), NARROWEST * readings.wavelength_m());
    if spread_m < needed_m {
        return Err(Undetermined::AlongALine {
            spread_mm: spread_m * 1e3,
            needed_mm: needed_m * 1e3,
        });
    }
    Ok(())
}

/// The pose with the smallest residual, and the best of the other handedness.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The pose found, refined on all readings.
    pub best: Fit,
    /// The best of the other handedness, refined on some thousands of readings, if there was one in that round.
    pub other_handedness: Option<Fit>,
    /// The misfit of the best pose on the same readings.
    pub best_in_that_round: f64,
}

/// Searches every handedness, turn, step, height and shift; `None` without readings. The readings [determine a
/// pose](determine_a_pose).
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
        fits.sort_by(|a, b| a.misfit().total_cmp(&b.misfit()));
        prefer_plain(&mut fits);
        starts = keep_both_hands(&fits, ROUNDS[1].entering);
        rounds.push(fits);
    }
    let [_, second, last] = rounds.as_slice() else { return None };
    let (then, best) = (second.first()?, Fit::at(readings, last.first()?.pose));
    let mirrored = |fit: &Fit| fit.pose.mirror != Mirror::None;
    let other = second.iter().find(|fit| mirrored(fit) != mirrored(&best)).cloned();
    Some(Found { best_in_that_round: then.misfit(), other_handedness: other, best })
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
    let limit = best.misfit() * (1.0 + AS_GOOD).sqrt();
    let plain = |fit: &Fit| {
        let mirrored = u8::from(fit.pose.mirror != Mirror::None);
        let quarters = (fit.pose.turn_rad / FRAC_PI_2).round().abs() as u8;
        mirrored + quarters
    };
    let as_good = sorted.iter().take_while(|fit| fit.misfit() <= limit).count();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readings::Drive;
    use fieldgap_acoustics::{Array, Excitation, Medium, Simulation, Simulator};

    fn readings(positions_m: Vec<Vec3>) -> Readings {
        let simulation = Simulation {
            array: Array::square(2, 2, 10.5e-3).expect("four elements"),
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
            excitation: Excitation::Uniform,
            simulator: Simulator::Piston,
        };
        let readings = vec![1.0; positions_m.len()];
        Readings::from_drives(vec![Drive {
            focus: 0,
            simulation,
            positions_m,
            readings,
            phases: Vec::new(),
        }])
    }

    fn plane(columns: usize, rows: usize, step_m: f64) -> Readings {
        let at =
            |n: usize| Vec3::new((n % columns) as f64, (n / columns) as f64, 0.1 / step_m) * step_m;
        readings((0..columns * rows).map(at).collect())
    }

    #[test]
    fn a_pose_needs_many_places_in_two_directions() {
        assert_eq!(determine_a_pose(&plane(20, 20, 2e-3)), Ok(()));
        assert_eq!(determine_a_pose(&plane(3, 2, 10e-3)), Err(Undetermined::TooFew { places: 6 }));
        let line = determine_a_pose(&plane(200, 1, 1e-3));
        assert!(
            matches!(line, Err(Undetermined::AlongALine { spread_mm, .. }) if spread_mm < 1e-6)
        );
        let strip = determine_a_pose(&plane(100, 4, 1e-3));
        assert!(matches!(strip, Err(Undetermined::AlongALine { .. })), "{strip:?}");
        let wide = determine_a_pose(&plane(20, 20, 1.0));
        assert!(matches!(wide, Err(Undetermined::TooWide { .. })), "{wide:?}");
        let repeated = readings(vec![Vec3::new(0.0, 0.0, 0.1); 500]);
        assert_eq!(determine_a_pose(&repeated), Err(Undetermined::TooFew { places: 1 }));
    }
}
