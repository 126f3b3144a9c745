//! Elements from ordinary planes of amplitudes: all driven at once, by one or a few drives.
//!
//! Begin with [`calibrate_planes`]. The readings go through these files:
//!
//! | file | what it does |
//! |---|---|
//! | `grid` | rows, neighbours and blocks of the readings, and the way of travel |
//! | `parameters` | the numbers that explain a plane: of each element and shared ones |
//! | `model` | level at each reading and its derivatives |
//! | `dense` | products and factors of large matrices |
//! | `spread` | the width of each group of numbers, and the evidence for it |
//! | `fit` | the search, with the noise found on the way |
//! | `held_out` | what is left of blocks that a fit did not see |
//! | `calibration` | the result |

mod calibration;
mod dense;
mod fit;
mod grid;
mod held_out;
mod model;
mod parameters;
mod spread;

pub use calibration::{
    ElementFound, GroupFound, PlaneCalibration, SharedNumber, account_for_planes, calibrate_planes,
};
pub use held_out::HeldOutBlocks;
pub use parameters::Group;
