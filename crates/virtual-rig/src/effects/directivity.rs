//! The main lobe is wider or narrower than modelled.
//!
//! The lobe of a piston is 2 J₁(x)/x with x = k a sin θ: a face smaller by the ratio has a lobe wider by it. A transducer whose
//! lobe does not follow from its face has every angle of it stretched.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::luck::Luck;
use fieldgap_input::Positive;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Directivity {
    /// Width of the true lobe over the modelled one.
    width_ratio: Positive,
}

impl Effect for Directivity {
    fn array(&self, array: &mut TrueArray, _luck: Luck) {
        array.lobe_stretch *= self.width_ratio.get();
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_lobe_is_wider_by_the_ratio() {
        let mut array = TrueArray::of_two();
        effect::<Directivity>("width_ratio = 1.25").array(&mut array, Luck::new(0));
        assert!((array.lobe_stretch - 1.25).abs() < 1e-15);
    }
}
