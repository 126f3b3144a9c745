//! A map between its points, by polynomials through six points along each axis, and the errors of that: an alignment needs slopes of the
//! field, and peaks that are not cut.

use fieldgap_acoustics::metrics::PlaneMap;

use super::resample::cell;
use crate::comparison::Noise;

/// Points along each axis that a place is interpolated from.
const TAPS: usize = 6;

/// A map that can be read between its points, with its slopes.
#[derive(Debug)]
pub(super) struct Polynomial<'m> {
    map: &'m PlaneMap,
    noise: Noise,
    /// Error of the interpolation in the middle of a cell, along x and y.
    errors: [f64; 2],
}

/// A reading of a map between its points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Read {
    /// The value.
    pub value: f64,
    /// Its variance, from noise and interpolation.
    pub variance: f64,
    /// Slopes along x and y, per metre.
    pub slopes: [f64; 2],
    /// What noise adds to the square of each slope, on average.
    pub slope_variances: [f64; 2],
}

/// The points about a place along an axis: the first one's number, the weights, and their derivatives per metre.
struct Taps {
    first: usize,
    weights: [f64; TAPS],
    slopes: [f64; TAPS],
    /// One in the middle of a cell, zero at a point.
    middle: f64,
}

impl<'m> Polynomial<'m> {
    /// Of a map with at least six points along each axis, and the noise of its points.
    ///
    /// The error of an interpolation through six points grows with the sixth power of the step. Each point is left out in turn and
    /// interpolated from its neighbours at one, three and five steps, which are twice as far apart as those about a place. What that misses,
    /// over 32, is the error in the middle of a cell: the ratio is 64 for small steps, and 25 for a wave with 4.5 points a period. It is an
    /// upper bound, as noise is in it. Where an axis is too short for that, the nearest points stand in for the far ones.
    pub fn of(map: &'m PlaneMap, noise: Noise) -> Option<Self> {
        let (columns, rows) = (map.x_m().len(), map.y_m().len());
        if columns < TAPS || rows < TAPS {
            return None;
        }
        let errors = [(columns, rows, 1, columns), (rows, columns, columns, 1)].map(
            |(along, across, stride, other)| {
                let reach = if along > 10 { [1, 3, 5] } else { [1, 1, 2] };
                let missed = (0..across).flat_map(|line| {
                    (reach[2]..along.saturating_sub(reach[2])).map(move |n| {
                        let at = |m: usize| map.values()[line * other + m * stride];
                        let pair = |k: usize| at(n - reach[k]) + at(n + reach[k]);
                        at(n) - (150.0 * pair(0) - 25.0 * pair(1) + 3.0 * pair(2)) / 256.0
                    })
                });
                let known: Vec<f64> = missed.filter(|missed| missed.is_finite()).collect();
                let squares: f64 = known.iter().map(|missed| missed * missed).sum();
                (squares / known.len().max(1) as f64).sqrt() / 32.0
            },
        );
        Some(Self { map, noise, errors })
    }

    /// Standard error of the interpolation in the middle of a cell, in the unit of the map.
    pub fn error(&self) -> f64 {
        self.errors[0].hypot(self.errors[1])
    }

    /// Half the sides of the map, m.
    pub fn half_sides_m(&self) -> [f64; 2] {
        [self.map.x_m(), self.map.y_m()].map(|axis| 0.5 * (axis[axis.len() - 1] - axis[0]))
    }

    /// The value alone, by linear interpolation, for a search.
    pub fn value_at(&self, x_m: f64, y_m: f64) -> Option<f64> {
        let (column, x) = cell(self.map.x_m(), x_m)?;
        let (row, y) = cell(self.map.y_m(), y_m)?;
        let columns = self.map.x_m().len();
        let at = |right: usize, up: usize| self.map.values()[(row + up) * columns + column + right];
        let low = at(0, 0) * (1.0 - x) + at(1, 0) * x;
        let high = at(0, 1) * (1.0 - x) + at(1, 1) * x;
        let value = low * (1.0 - y) + high * y;
        value.is_finite().then_some(value)
    }

    /// The map at a place in metres; `None` outside of it, or beside a point that was not measured.
    pub fn at(&self, x_m: f64, y_m: f64) -> Option<Read> {
        let (x, y) = (taps(self.map.x_m(), x_m)?, taps(self.map.y_m(), y_m)?);
        let columns = self.map.x_m().len();
        let (mut value, mut slope_x, mut slope_y) = (0.0, 0.0, 0.0);
        let (mut noise, mut noise_x, mut noise_y) = (0.0, 0.0, 0.0);
        for (row, (wy, dy)) in y.weights.iter().zip(&y.slopes).enumerate() {
            let first = (y.first + row) * columns + x.first;
            let points = &self.map.values()[first..first + TAPS];
            for (point, (wx, dx)) in points.iter().zip(x.weights.iter().zip(&x.slopes)) {
                let variance = self.noise.at(*point).powi(2);
                value += wx * wy * point;
                slope_x += dx * wy * point;
                slope_y += wx * dy * point;
                noise += (wx * wy).powi(2) * variance;
                noise_x += (dx * wy).powi(2) * variance;
                noise_y += (wx * dy).powi(2) * variance;
            }
        }
        let interpolation =
            (self.errors[0] * x.middle).powi(2) + (self.errors[1] * y.middle).powi(2);
        value.is_finite().then_some(Read {
            value,
            variance: noise + interpolation,
            slopes: [slope_x, slope_y],
            slope_variances: [noise_x, noise_y],
        })
    }
}

/// Lagrange's weights of the points about a place; `None` outside of the axis.
fn taps(axis_m: &[f64], at_m: f64) -> Option<Taps> {
    let (&first, &last) = (axis_m.first()?, axis_m.last()?);
    if !(first..=last).contains(&at_m) {
        return None;
    }
    let after = axis_m.partition_point(|point| *point <= at_m).clamp(1, axis_m.len() - 1);
    let (low, high) = (axis_m[after - 1], axis_m[after]);
    let share = (at_m - low) / (high - low);
    let first = (after - 1).saturating_sub(TAPS / 2 - 1).min(axis_m.len() - TAPS);
    let points = &axis_m[first..first + TAPS];
    let (mut weights, mut slopes) = ([0.0; TAPS], [0.0; TAPS]);
    for n in 0..TAPS {
        let others = || (0..TAPS).filter(move |other| *other != n);
        let scale: f64 = others().map(|other| points[n] - points[other]).product();
        weights[n] = others().map(|other| at_m - points[other]).product::<f64>() / scale;
        slopes[n] = others()
            .map(|left_out| {
                let rest = others().filter(|other| *other != left_out);
                rest.map(|other| at_m - points[other]).product::<f64>()
            })
            .sum::<f64>()
            / scale;
    }
    Some(Taps { first, weights, slopes, middle: 4.0 * share * (1.0 - share) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::NoiseSource;

    const QUIET: Noise = Noise { additive: 0.0, multiplicative: 0.0, source: NoiseSource::Repeats };

    fn map(of: impl Fn(f64, f64) -> f64) -> PlaneMap {
        let axis: Vec<f64> = (0..12).map(|n| f64::from(n) * 2e-3).collect();
        let values = axis.iter().flat_map(|y| axis.iter().map(|x| of(*x, *y)).collect::<Vec<_>>());
        PlaneMap::new(axis.clone(), axis.clone(), values.collect()).expect("a map")
    }

    #[test]
    fn a_cubic_is_read_without_error_with_its_slopes() {
        let of = |x: f64, y: f64| 1.0 + 20.0 * x - 3e3 * x * y + 4e5 * y.powi(3);
        let map = map(of);
        let polynomial = Polynomial::of(&map, QUIET).expect("a map");
        for (x, y) in [(0.0, 0.0), (0.0033, 0.0171), (0.0211, 0.0005), (0.022, 0.022)] {
            let read = polynomial.at(x, y).expect("inside");
            assert!((read.value - of(x, y)).abs() < 1e-9, "{x} {y}");
            assert!((read.slopes[0] - (20.0 - 3e3 * y)).abs() < 1e-6);
            assert!((read.slopes[1] - (-3e3 * x + 1.2e6 * y * y)).abs() < 1e-6);
        }
        assert!(polynomial.at(0.0221, 0.0).is_none());
    }

    #[test]
    fn the_error_of_a_wave_is_that_between_its_points() {
        let of = |x: f64, y: f64| (700.0 * x).sin() * (700.0 * y).cos();
        let map = map(of);
        let polynomial = Polynomial::of(&map, QUIET).expect("a map");
        let missed: Vec<f64> = (0..200)
            .map(|n| (0.005 + 0.002 * f64::from(n % 5), 0.005 + 0.0003 * f64::from(n / 5)))
            .map(|(x, y)| polynomial.at(x, y).expect("inside").value - of(x, y))
            .collect();
        let rms = (missed.iter().map(|m| m * m).sum::<f64>() / 200.0).sqrt();
        assert!(
            rms < 2.0 * polynomial.error() && rms > 0.2 * polynomial.error(),
            "{rms} {}",
            polynomial.error()
        );
    }
}
