//! A rigid sphere in the field, such as a bead, a screw's head or the ball of a probe, scatters the wave of each element.

use serde::Deserialize;

use super::Effect;
use crate::rigid_sphere::RigidSphere;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Coordinate, Length};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Scatterer {
    /// Its centre.
    x_mm: Coordinate,
    y_mm: Coordinate,
    z_mm: Coordinate,
    radius_mm: Length,
}

impl Effect for Scatterer {
    fn sphere(&self) -> Option<RigidSphere> {
        let centre_m = Vec3::new(self.x_mm.get(), self.y_mm.get(), self.z_mm.get()) * 1e-3;
        Some(RigidSphere { centre_m, radius_m: self.radius_mm.get() * 1e-3 })
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn its_sphere_has_its_place_and_size_in_metres() {
        let sphere = effect::<Scatterer>("x_mm = 5\ny_mm = -2\nz_mm = 40\nradius_mm = 3").sphere();
        let sphere = sphere.expect("a sphere");
        assert!((sphere.centre_m - Vec3::new(0.005, -0.002, 0.04)).norm() < 1e-15);
        assert!((sphere.radius_m - 0.003).abs() < 1e-15);
    }
}
