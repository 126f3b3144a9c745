//! The points of a tile and the sources, relative to the tile's middle.
//!
//! What the points of a tile have in common, above all the phase at the middle, is computed once and in double precision.

use std::f64::consts::PI;

use super::{FieldKernel, PathLengths, TILE};
use crate::Vec3;
use crate::simd::MAX_LANES;
use crate::simd::float::Float;
use crate::transducer::OnAxis;

/// A source relative to the middle of a tile.
#[derive(Clone, Copy)]
pub(super) struct Near<T> {
    /// From the source to the tile's middle, m.
    pub offset: [T; 3],
    pub normal: [T; 3],
    /// Position of the source, m.
    pub centre: [T; 3],
    pub amplitude: T,
    /// Phase of the drive, rad.
    pub drive: T,
    /// Length of the path to the tile's middle, m; where path lengths are frozen, to the point above or below it.
    pub path: T,
    /// True squared length minus the square of the rounded length, m².
    pub rounded_off: T,
    /// Component of this path along z, m.
    pub rise: T,
    /// Phase at the tile's middle, half turns, -1 to 1.
    pub half_turns: T,
    pub lobe: usize,
    /// Half of the near field's excess path on the axis times the length of the path, m².
    pub near_field: T,
}

/// Room for a tile's points and for the lanes of the last vectors beyond them.
pub(super) const ROOM: usize = TILE + MAX_LANES;

/// The points of a tile and the sources, relative to the tile's middle.
pub(super) struct Surroundings<T> {
    pub points: usize,
    /// From the middle to each point, along each axis, m. Entries beyond the last point are summed, but not used.
    pub steps: [[T; ROOM]; 3],
    pub near: Vec<Near<T>>,
}

impl<T: Float> Surroundings<T> {
    /// A kernel's sources and a tile of points.
    pub fn of(kernel: &FieldKernel, points_m: &[Vec3]) -> Self {
        let middle_m = middle(points_m);
        let mut steps = [[T::ZERO; ROOM]; 3];
        for (n, point_m) in points_m.iter().enumerate() {
            for axis in 0..3 {
                steps[axis][n] = T::of(point_m[axis] - middle_m[axis]);
            }
        }
        let amplitude = match kernel.on_axis {
            OnAxis::Exponential { amplitude, .. } | OnAxis::Absorbed { amplitude, .. } => amplitude,
            OnAxis::Spherical | OnAxis::Power { .. } => 1.0,
        };
        let components = |vector: Vec3| [T::of(vector.x), T::of(vector.y), T::of(vector.z)];
        let near = kernel.sources.iter().map(|source| {
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
                offset: components(offset_m),
                normal: components(source.normal),
                centre: components(source.centre_m),
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
        });
        Self { points: points_m.len(), steps, near: near.collect() }
    }
}

/// The middle of the box about points.
fn middle(points_m: &[Vec3]) -> Vec3 {
    // Four boxes, each about every fourth point: with one, each comparison would wait for the one before.
    let mut boxes = [[[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]; 4];
    for four in points_m.chunks(4) {
        for ([low, high], point) in boxes.iter_mut().zip(four) {
            for axis in 0..3 {
                // As the processor's minimum and maximum: NaN is ignored.
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
