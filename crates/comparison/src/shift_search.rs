//! The search for a shift of any size along the recorded axes.
//!
//! It answers how far the robot's origin seems to be from the array's. The registration does not adopt a large shift: it is told and
//! left in the gap. A field with side lobes has several optima, so that the search starts from the recorded place and from the best
//! places of a coarse grid.

use fieldgap_acoustics::Vec3;
use fieldgap_text::{Uncertain, uncertain};
use rayon::prelude::*;

use super::coarse::{grid_points, shifts};
use super::identifiability::identifiability;
use super::pose::Pose;
use super::pose_search::{HEIGHT_SD_M, MOST_POINTS};
use super::readings::{Readings, places};
use super::refine::{Fit, PoseParameter, Search, refine};

/// Fewest places from which a shift is searched: some fifteen for each of its three numbers and the gain.
const FEWEST_PLACES: usize = 60;

/// Readings of the first and of the last refinement: thousands determine a shift far better than any robot keeps it.
const FIRST: usize = 400;
const LAST: usize = 10_000;

/// Linearisations of the first and of the last refinement: a start from the grid is within a third of a wavelength.
const FIRST_ITERATIONS: usize = 12;
const LAST_ITERATIONS: usize = 6;

/// Directions with a larger standard error than this are not determined, m: the coarse grid would not tell them either.
const LARGEST_ERROR_M: f64 = 2e-3;

/// A shift that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundShift {
    /// The fit with this shift.
    pub fit: Fit,
    /// Standard error along x, y and z, metres.
    pub errors_m: [f64; 3],
}

/// Why there is no shift.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoShift {
    /// Too few different places.
    #[error("{places} places do not determine a shift; at least {FEWEST_PLACES} are needed")]
    TooFew {
        /// Different places.
        places: usize,
    },
    /// The places extend too far for the wavelength.
    #[error(
        "the places extend too far: a shift is searched over at most {MOST_POINTS:.0e} points of the field"
    )]
    TooWide,
}

/// The shift with the smallest residual.
///
/// # Errors
/// [`NoShift`] if the readings are too few.
pub fn find_shift(readings: &Readings) -> Result<FoundShift, NoShift> {
    let places = places(&readings.positions_m());
    if places < FEWEST_PLACES {
        return Err(NoShift::TooFew { places });
    }
    if grid_points(readings) > MOST_POINTS {
        return Err(NoShift::TooWide);
    }
    let starts: Vec<Vec3> = [Vec3::zeros()].into_iter().chain(shifts(readings)).collect();
    let some = readings.thinned(FIRST);
    let fits: Vec<Fit> = starts
        .into_par_iter()
        .map(|shift_m| {
            let start = Pose { shift_m, ..Pose::default() };
            refine(&some, start, &of_shift(FIRST_ITERATIONS))
        })
        .collect();
    let best = fits.into_iter().min_by(|a, b| a.misfit().total_cmp(&b.misfit()));
    let start = best.expect("the recorded place is among the starts").pose;
    let last = refine(&readings.thinned(LAST), start, &of_shift(LAST_ITERATIONS));
    let fit = Fit::at(readings, last.pose);
    let known = identifiability(readings, &fit, &PoseParameter::SHIFT);
    let errors_m = [known.errors[0], known.errors[1], known.errors[2]];
    Ok(FoundShift { fit, errors_m })
}

/// A free shift. Its height has the prior of a pose: a single plane hardly determines it.
fn of_shift(iterations: usize) -> Search {
    let prior = |parameter| match parameter {
        PoseParameter::ShiftZ => Some((0.0, HEIGHT_SD_M)),
        _ => None,
    };
    let free = PoseParameter::SHIFT.map(|parameter| (parameter, prior(parameter))).to_vec();
    Search { free, iterations }
}

impl FoundShift {
    /// Whether some component that the readings determine is larger than this, metres, by so many of its standard errors.
    pub fn exceeds(&self, limit_m: f64, sigma: f64) -> bool {
        let of_axis = self.determined_m().into_iter().zip(self.errors_m);
        of_axis
            .filter_map(|(shift_m, error_m)| Some((shift_m?.abs(), error_m)))
            .any(|(shift_m, error_m)| shift_m - limit_m > sigma * error_m)
    }

    /// The components, metres; `None` for one that the readings do not determine.
    fn determined_m(&self) -> [Option<f64>; 3] {
        [0, 1, 2].map(|axis| {
            (self.errors_m[axis] <= LARGEST_ERROR_M).then_some(self.fit.pose.shift_m[axis])
        })
    }
}

impl std::fmt::Display for FoundShift {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let of_axis = self.determined_m().into_iter().zip(self.errors_m).zip(["x", "y", "z"]);
        let words: Vec<String> = of_axis
            .map(|((shift_m, error_m), axis)| match shift_m {
                Some(shift_m) => {
                    let shift_mm =
                        Uncertain { value: shift_m * 1e3, standard_error: error_m * 1e3 };
                    format!("{} mm along {axis}", uncertain(shift_mm))
                }
                None => format!("not determined along {axis}"),
            })
            .collect();
        write!(f, "{}", words.join(", "))
    }
}
