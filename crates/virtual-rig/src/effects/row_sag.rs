//! The driver's supply voltage drops along a rail: elements further from the feed are weaker.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Finite};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RowSag {
    /// From the feed along the rail, in the array's plane.
    along: Exact<Finite, 2>,
    /// Loss at the far end, relative.
    loss: Finite,
}

impl Effect for RowSag {
    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        let [x, y] = self.along.map(Finite::get);
        let far_m = |at_m: &Vec3| at_m.x * x + at_m.y * y;
        let places_m = || array.elements.iter().map(|element| far_m(&element.centre_m));
        let (feed_m, end_m) = (
            places_m().fold(f64::INFINITY, f64::min),
            places_m().fold(f64::NEG_INFINITY, f64::max),
        );
        let length_m = (end_m - feed_m).max(f64::MIN_POSITIVE);
        for element in &mut array.elements {
            let way = (far_m(&element.centre_m) - feed_m) / length_m;
            // Each element draws the same current, so the drop steepens towards the feed.
            element.amplitude *= 1.0 - self.loss.get() * way * (2.0 - way);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;
    use fieldgap_acoustics::Array;

    #[test]
    fn a_row_grows_weaker_from_its_feed_and_rows_are_alike() {
        let elements = Array::square(6, 6, 10.5e-3).expect("not empty").elements().to_vec();
        let mut array = TrueArray { channels: (0..36).collect(), elements, lobe_stretch: 1.0 };
        effect::<RowSag>("along = [1.0, 0.0]\nloss = 0.4").array(&mut array, CounterRng::new(0));
        let level = |n: usize| array.elements[n].amplitude;
        assert!((level(0) - 1.0).abs() < 1e-12 && (level(5) - 0.6).abs() < 1e-12);
        assert!((0..5).all(|n| level(n) > level(n + 1) && level(n) == level(n + 30)));
    }
}
