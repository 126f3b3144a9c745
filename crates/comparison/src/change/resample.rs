//! A map between its points, by bilinear interpolation, and the error of that.

use fieldgap_acoustics::metrics::PlaneMap;

/// A map that can be read between its points.
#[derive(Debug)]
pub(super) struct Resampled<'m> {
    map: &'m PlaneMap,
    error: f64,
}

impl<'m> Resampled<'m> {
    /// Of a map with at least three neighbours in a row, along x or y.
    ///
    /// The error of a linear interpolation grows with the square of the step. Each point is left out in turn and interpolated from its
    /// two neighbours, which are two steps apart; a quarter of what that misses is the error in the middle of one step. Noise is in it,
    /// so it is an upper bound.
    pub fn of(map: &'m PlaneMap) -> Option<Self> {
        let (columns, rows) = (map.x_m().len(), map.y_m().len());
        let at = |column: usize, row: usize| map.values()[row * columns + column];
        let mean_square = |missed: Vec<f64>| {
            let known: Vec<f64> = missed.into_iter().filter(|missed| missed.is_finite()).collect();
            let squares: f64 = known.iter().map(|missed| missed * missed).sum();
            (!known.is_empty()).then(|| squares / known.len() as f64)
        };
        let along_x = (0..rows).flat_map(|row| {
            (1..columns.saturating_sub(1)).map(move |column| {
                at(column, row) - 0.5 * (at(column - 1, row) + at(column + 1, row))
            })
        });
        let along_y = (0..columns).flat_map(|column| {
            (1..rows.saturating_sub(1))
                .map(move |row| at(column, row) - 0.5 * (at(column, row - 1) + at(column, row + 1)))
        });
        let (along_x, along_y) = (mean_square(along_x.collect())?, mean_square(along_y.collect())?);
        Some(Self { map, error: (along_x + along_y).sqrt() / 4.0 })
    }

    /// Standard error of the interpolation, in the unit of the map.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Value and standard error of its interpolation at a place in metres; `None` outside the map, or beside a point that was not measured.
    pub fn at(&self, x_m: f64, y_m: f64) -> Option<(f64, f64)> {
        let (column, x) = cell(self.map.x_m(), x_m)?;
        let (row, y) = cell(self.map.y_m(), y_m)?;
        let columns = self.map.x_m().len();
        let corner =
            |right: usize, up: usize| self.map.values()[(row + up) * columns + column + right];
        let low = corner(0, 0) * (1.0 - x) + corner(1, 0) * x;
        let high = corner(0, 1) * (1.0 - x) + corner(1, 1) * x;
        let value = low * (1.0 - y) + high * y;
        value.is_finite().then_some((value, self.error))
    }
}

/// The cell of a place along an axis, and the share of the cell before it.
pub(super) fn cell(axis_m: &[f64], at_m: f64) -> Option<(usize, f64)> {
    let (&first, &last) = (axis_m.first()?, axis_m.last()?);
    if axis_m.len() < 2 || !(first..=last).contains(&at_m) {
        return None;
    }
    let after = axis_m.partition_point(|edge| *edge <= at_m).clamp(1, axis_m.len() - 1);
    let (low, high) = (axis_m[after - 1], axis_m[after]);
    Some((after - 1, (at_m - low) / (high - low)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(step_m: f64, of: impl Fn(f64, f64) -> f64) -> PlaneMap {
        let count = (0.02 / step_m).round() as usize;
        let axis: Vec<f64> = (0..=count).map(|n| n as f64 * step_m).collect();
        let values = axis.iter().flat_map(|y| axis.iter().map(|x| of(*x, *y)).collect::<Vec<_>>());
        PlaneMap::new(axis.clone(), axis.clone(), values.collect()).expect("a map")
    }

    #[test]
    fn a_plane_is_interpolated_without_error() {
        let of = |x: f64, y: f64| 1.0 + 20.0 * x - 7.0 * y;
        let map = map(2e-3, of);
        let resampled = Resampled::of(&map).expect("a map");
        assert!(resampled.error() < 1e-12);
        for (x, y) in [(0.0, 0.0), (0.0033, 0.0171), (0.02, 0.02)] {
            let (value, _) = resampled.at(x, y).expect("inside");
            assert!((value - of(x, y)).abs() < 1e-12, "{x} {y}");
        }
        assert_eq!(resampled.at(0.0201, 0.0), None);
    }

    #[test]
    fn the_error_of_a_wave_is_that_in_the_middle_of_its_cells() {
        // A standing pattern of half a wavelength at 40 kHz.
        let of = |x: f64, y: f64| (700.0 * x).sin() * (700.0 * y).cos();
        let map = map(1e-3, of);
        let resampled = Resampled::of(&map).expect("a map");
        let missed: Vec<f64> = (0..400)
            .map(|n| (0.0005 + 0.001 * f64::from(n % 20), 0.0005 + 0.001 * f64::from(n / 20)))
            .map(|(x, y)| resampled.at(x, y).expect("inside").0 - of(x, y))
            .collect();
        let rms = (missed.iter().map(|m| m * m).sum::<f64>() / 400.0).sqrt();
        // The two directions add up here, and are taken as independent in the estimate: up to √2.
        assert!(
            rms < 1.5 * resampled.error() && rms > 0.6 * resampled.error(),
            "{rms} {}",
            resampled.error()
        );
    }
}
