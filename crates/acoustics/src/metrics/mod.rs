//! The figures that the thesis reads off a field map: peak, focal radius, sub-peaks.

mod focal_radius;
mod map;
mod peak;
mod sub_peaks;

pub use focal_radius::{FocalRadius, Side, focal_radius};
pub use map::{MapShapeError, PlaneMap};
pub use peak::{Peak, peak};
pub use sub_peaks::sub_peaks;

/// The threshold of the thesis, relative to the peak, for focal radius and sub-peaks.
pub const THESIS_THRESHOLD: f64 = 0.5;

/// Which reading of the thesis's definitions is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convention {
    /// As its listings compute them, slips included, so that its printed figures reproduce.
    AsWritten,
    /// With the slips mended.
    Corrected,
}
