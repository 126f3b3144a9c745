//! The driver's supply voltage drops along a rail: elements further from the feed are weaker.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::counter_rng::CounterRng;
use fieldgap_virtual_rig::effects::{Effect, TrueArray};

pub(super) const NAME: &str = "row-sag";

#[derive(Debug, Clone, Copy)]
struct RowSag {
    /// From the feed along the rail, of unit length.
    along: Vec3,
    /// Loss at the far end, relative.
    loss: f64,
}

/// Along x or along y, fed from either end.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let along = random.sign() * if random.chance(0.5) { Vec3::x() } else { Vec3::y() };
    Draw::new(0.9, move |loss| RowSag { along, loss })
}

impl Effect for RowSag {
    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        let far_m = |at_m: &Vec3| at_m.dot(&self.along);
        let places_m = || array.elements.iter().map(|element| far_m(&element.centre_m));
        let (feed_m, end_m) = (
            places_m().fold(f64::INFINITY, f64::min),
            places_m().fold(f64::NEG_INFINITY, f64::max),
        );
        for element in &mut array.elements {
            let way = (far_m(&element.centre_m) - feed_m) / (end_m - feed_m);
            // Each element draws the same current, so the drop steepens towards the feed.
            element.amplitude *= 1.0 - self.loss * way * (2.0 - way);
        }
    }
}

impl Unmodelled for RowSag {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! {
            along = [(self.along.x), (self.along.y)]
            loss = (self.loss)
        }
    }

    fn effect(&self) -> Option<(&'static str, Box<dyn Effect>)> {
        Some((NAME, Box::new(*self)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Array;

    #[test]
    fn a_row_grows_weaker_from_its_feed_and_rows_are_alike() {
        let elements = Array::square(6, 6, 10.5e-3).expect("not empty").elements().to_vec();
        let mut array = TrueArray { channels: (0..36).collect(), elements, lobe_stretch: 1.0 };
        RowSag { along: Vec3::x(), loss: 0.4 }.array(&mut array, CounterRng::new(0));
        let level = |n: usize| array.elements[n].amplitude;
        assert!((level(0) - 1.0).abs() < 1e-12 && (level(5) - 0.6).abs() < 1e-12);
        assert!((0..5).all(|n| level(n) > level(n + 1) && level(n) == level(n + 30)));
    }
}
