//! The receiver averages the pressure over its face, a disc parallel to the array.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::Gap;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Aperture {
    /// Radius of the face, mm.
    radius_mm: Gap,
}

impl Effect for Aperture {
    fn face_radius_m(&self) -> f64 {
        self.radius_mm.get() * 1e-3
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_face_has_its_radius_in_metres() {
        assert!((effect::<Aperture>("radius_mm = 4.0").face_radius_m() - 4e-3).abs() < 1e-15);
    }
}
