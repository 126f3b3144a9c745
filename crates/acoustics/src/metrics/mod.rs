//! The figures that the thesis takes from a field map: peak, focal radius, sub-peaks.

mod focal_radius;
mod map;
mod peak;
mod sub_peaks;

pub use focal_radius::{FocalRadius, Side, focal_radius};
pub use map::{MapShapeError, PlaneMap};
pub use peak::{Peak, peak};
pub use sub_peaks::sub_peaks;

/// The thesis's threshold for focal radius and sub-peaks, relative to the peak.
pub const THESIS_THRESHOLD: f64 = 0.5;

/// Which version of the thesis's definitions is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convention {
    /// As its listings compute them, bugs included: reproduces its printed figures.
    AsWritten,
    /// With the bugs corrected.
    Corrected,
}
