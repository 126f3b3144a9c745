//! The axes of the elements lean, each by two normal angles: the slopes of its face towards x and towards y.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_acoustics::Vec3;
use fieldgap_input::NonNegative;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ElementTilt {
    /// Standard deviation of the angle about each axis, rad.
    spread_rad: NonNegative,
}

impl Effect for ElementTilt {
    fn array(&self, array: &mut TrueArray, rng: CounterRng) {
        let slope = |number: usize| self.spread_rad.get() * rng.normal(number as u64);
        for (n, element) in array.elements.iter_mut().enumerate() {
            let normal = element.normal;
            // Any two directions across the axis do: the angles have no order.
            let across = Vec3::y().cross(&normal).normalize();
            let along = normal.cross(&across);
            element.normal =
                (normal + slope(2 * n) * across + slope(2 * n + 1) * along).normalize();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn axes_spread_by_the_given_deviation_about_either_axis() {
        let mut array = TrueArray::of_many(4000);
        effect::<ElementTilt>("spread_rad = 0.05").array(&mut array, CounterRng::new(1));
        let rms = |part: fn(&Vec3) -> f64| {
            let squares = array.elements.iter().map(|element| part(&element.normal).powi(2));
            (squares.sum::<f64>() / array.elements.len() as f64).sqrt()
        };
        assert!((rms(|normal| normal.x) - 0.05).abs() < 0.002);
        assert!((rms(|normal| normal.y) - 0.05).abs() < 0.002);
        assert!(array.elements.iter().all(|element| (element.normal.norm() - 1.0).abs() < 1e-12));
    }
}
