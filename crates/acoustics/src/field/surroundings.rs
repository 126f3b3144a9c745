//! A tile's points and the sources as they stand to its middle.
//!
//! What all points of a tile have in common, above all the phase at its middle, is found once and in double precision.

use std::f64::consts::PI;

use super::{FieldKernel, PathLengths, TILE};
use crate::Vec3;
use crate::float::Float;
use crate::simd::MAX_LANES;
use crate::transducer::OnAxis;

/// A source as it stands to the middle of a tile.
#[derive(Clone, Copy)]
pub(super) struct Near<T> {
    /// From the source to the tile's middle, m.
    pub offset: [T; 3],
    pub normal: [T; 3],
    /// Place of the source, m.
    pub centre: [T; 3],
    pub amplitude: T,
    /// Phase of the drive, rad.
    pub drive: T,
    /// Length of the path to the tile's middle, m: where path lengths are frozen, to below or above it.
    pub path: T,
    /// What its square as rounded lacks of the true square, m².
    pub rounded_off: T,
    /// Height of the path where it is frozen, m.
    pub rise: T,
    /// Phase at the tile's middle, half turns, -1 to 1.
    pub half_turns: T,
    pub lobe: usize,
    /// What the near field makes a path longer by on the axis, times its length, halved, m².
    pub near_field: T,
}

/// Room for a tile's points and for what the last vectors hold beyond them.
pub(super) const ROOM: usize = TILE + MAX_LANES;

/// A tile's points and the sources as they stand to its middle.
pub(super) struct Surroundings<T> {
    pub points: usize,
    /// From the middle to each point, along each axis, m; beyond the last whatever is there, which comes to nothing.
    pub steps: [[T; ROOM]; 3],
    pub near: Vec<Near<T>>,
}

impl<T: Float> Default for Surroundings<T> {
    fn default() -> Self {
        Self { points: 0, steps: [[T::ZERO; ROOM]; 3], near: Vec::new() }
    }
}

impl<T: Float> Surroundings<T> {
    /// Places a kernel's sources about a tile of points.
    pub fn surround(&mut self, kernel: &FieldKernel, points_m: &[Vec3]) {
        let middle_m = middle(points_m);
        self.points = points_m.len();
        for (n, point_m) in points_m.iter().enumerate() {
            for axis in 0..3 {
                self.steps[axis][n] = T::of(point_m[axis] - middle_m[axis]);
            }
        }
        let near = &mut self.near;
        let amplitude = match kernel.on_axis {
            OnAxis::Exponential { amplitude, .. } | OnAxis::Absorbed { amplitude, .. } => amplitude,
            OnAxis::Spherical | OnAxis::Power { .. } => 1.0,
        };
        let lanes = |vector: Vec3| [T::of(vector.x), T::of(vector.y), T::of(vector.z)];
        near.clear();
        near.extend(kernel.sources.iter().map(|source| {
            let offset_m = middle_m - source.centre_m;
            let rise_m = match kernel.paths {
                PathLengths::Observed => offset_m.z,
                PathLengths::FrozenAt(height_m) => height_m - source.centre_m.z,
            };
            let square = offset_m.x * offset_m.x + offset_m.y * offset_m.y + rise_m * rise_m;
            let path = T::of(square.sqrt());
            let half_turns =
                (path.to_f64() * kernel.wavenumber_rad_m + source.drive_rad + source.own_rad) / PI;
            let turns = (0.5 * half_turns + f64::ROUNDER) - f64::ROUNDER;
            Near {
                offset: lanes(offset_m),
                normal: lanes(source.normal),
                centre: lanes(source.centre_m),
                amplitude: T::of(source.amplitude * amplitude),
                drive: T::of(source.drive_rad),
                path,
                rounded_off: T::of(square - path.to_f64() * path.to_f64()),
                rise: T::of(rise_m),
                half_turns: T::of(half_turns - 2.0 * turns),
                lobe: source.lobes,
                near_field: T::of(
                    kernel.near_field * kernel.lobes[source.lobes].radius_m.powi(2) / 8.0,
                ),
            }
        }));
    }
}

/// The middle of the box about points.
fn middle(points_m: &[Vec3]) -> Vec3 {
    // Boxes about every fourth point: one after the other, comparisons would wait for each other longer than sums do.
    let mut boxes = [[[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]; 4];
    for four in points_m.chunks(4) {
        for ([low, high], point) in boxes.iter_mut().zip(four) {
            for axis in 0..3 {
                // As the processor's own least and greatest: what is no number is passed over.
                low[axis] = if point[axis] < low[axis] { point[axis] } else { low[axis] };
                high[axis] = if point[axis] > high[axis] { point[axis] } else { high[axis] };
            }
        }
    }
    let extremes = |axis: usize| {
        boxes.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], [low, high]| {
            [least.min(low[axis]), most.max(high[axis])]
        })
    };
    Vec3::from_fn(|axis, _| extremes(axis).iter().sum::<f64>() * 0.5)
}
