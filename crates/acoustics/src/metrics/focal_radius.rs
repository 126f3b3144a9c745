//! The focal radius: the distance from the largest value at which the field first falls below a threshold.

use super::{Convention, PlaneMap};

/// A direction from the peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Towards larger x.
    Right,
    /// Towards smaller x.
    Left,
    /// Towards larger y.
    Up,
    /// Towards smaller y.
    Down,
}

impl Side {
    /// The sides in the order of [`FocalRadius::half_widths_m`].
    pub const ALL: [Self; 4] = [Self::Right, Self::Left, Self::Up, Self::Down];
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Right => "+x",
            Self::Left => "-x",
            Self::Up => "+y",
            Self::Down => "-y",
        })
    }
}

/// The focal radius of a map and the four half-widths that it is the mean of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FocalRadius {
    /// Mean of the half-widths that end inside the map, metres; `None` if none does.
    pub radius_m: Option<f64>,
    /// Half-width on each side ([`Side::ALL`]), metres; `None` where the field does not fall below the threshold before the map's edge
    /// or the first unmeasured point.
    pub half_widths_m: [Option<f64>; 4],
}

impl FocalRadius {
    /// The sides without a half-width; they are not in the mean.
    pub fn cut_off(&self) -> impl Iterator<Item = Side> + '_ {
        Side::ALL
            .into_iter()
            .zip(self.half_widths_m)
            .filter_map(|(side, half_width)| half_width.is_none().then_some(side))
    }
}

/// The focal radius by the thesis's definition (listing `measure_radius`): from the largest pixel along +x, -x, +y
/// and -y to where the field first falls below `threshold` times the largest value, linearly interpolated, averaged over
/// the sides on which it does.
///
/// On the negative sides the listing subtracts the interpolated fraction of a step instead of adding it, and it leaves out half-widths
/// of exactly zero; [`Convention::AsWritten`] does both. `None` if nothing was measured.
pub fn focal_radius(map: &PlaneMap, threshold: f64, convention: Convention) -> Option<FocalRadius> {
    let (column, row, peak) = map.largest()?;
    let level = threshold * peak;
    let half_width = |side: Side| {
        let (along_m, start) = match side {
            Side::Right | Side::Left => (map.x_m(), column),
            Side::Up | Side::Down => (map.y_m(), row),
        };
        let forward = matches!(side, Side::Right | Side::Up);
        let value = |index: usize| match side {
            Side::Right | Side::Left => map.at(index, row),
            Side::Up | Side::Down => map.at(column, index),
        };
        let (mut inside, mut inside_value) = (start, peak);
        loop {
            let next = if forward { inside.checked_add(1)? } else { inside.checked_sub(1)? };
            let next_value = value(next)?;
            if next_value < level {
                let fraction = (inside_value - level) / (inside_value - next_value);
                let to_inside_m = (along_m[inside] - along_m[start]).abs();
                let beyond_m = fraction * (along_m[next] - along_m[inside]).abs();
                return Some(match (convention, forward) {
                    (Convention::AsWritten, false) => to_inside_m - beyond_m,
                    _ => to_inside_m + beyond_m,
                });
            }
            (inside, inside_value) = (next, next_value);
        }
    };
    let half_widths_m = Side::ALL.map(half_width);
    let counted: Vec<f64> = half_widths_m
        .into_iter()
        .flatten()
        .filter(|&half_width| convention == Convention::Corrected || half_width != 0.0)
        .collect();
    let radius_m =
        (!counted.is_empty()).then(|| counted.iter().sum::<f64>() / counted.len() as f64);
    Some(FocalRadius { radius_m, half_widths_m })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn cone(x0: f64, y0: f64, slope: f64) -> PlaneMap {
        let along: Vec<f64> = (-10..=10).map(f64::from).collect();
        let values = along
            .iter()
            .flat_map(|y| along.iter().map(move |x| (x - x0).abs().max((y - y0).abs())))
            .map(|distance| 1.0 - slope * distance)
            .collect();
        PlaneMap::new(along.clone(), along, values).expect("a map")
    }

    proptest! {
        #[test]
        fn a_pyramid_about_a_pixel_has_its_own_half_width(x0 in -3i32..=3, y0 in -3i32..=3, slope in 0.08..0.9f64) {
            let radius = focal_radius(&cone(x0.into(), y0.into(), slope), 0.5, Convention::Corrected)
                .expect("measured").radius_m.expect("falls below inside the map");
            prop_assert!((radius - 0.5 / slope).abs() < 1e-9);
        }
    }

    #[test]
    fn a_side_cut_off_by_the_edge_is_named_and_left_out() {
        let found =
            focal_radius(&cone(8.0, 0.0, 0.2), 0.5, Convention::Corrected).expect("measured");
        assert_eq!(found.cut_off().collect::<Vec<_>>(), [Side::Right]);
        assert!((found.radius_m.expect("three sides") - 2.5).abs() < 1e-12);
    }

    #[test]
    fn a_flat_map_has_no_radius() {
        let found =
            focal_radius(&cone(0.0, 0.0, 0.0), 0.5, Convention::Corrected).expect("measured");
        assert_eq!(found.radius_m, None);
        assert_eq!(found.cut_off().count(), 4);
    }
}
