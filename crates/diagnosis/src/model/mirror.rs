//! A plane that reflects sound, and the images in it (Pierce, *Acoustics*, section 1-4).

use fieldgap_acoustics::Vec3;

/// A plane n·r = d in the array's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mirror {
    /// Its normal, of unit length.
    pub normal: Vec3,
    /// Its distance from the array's centre along the normal, m.
    pub distance_m: f64,
}

impl Mirror {
    /// A plane parallel to the array.
    pub fn at_height(height_m: f64) -> Self {
        Self { normal: Vec3::z(), distance_m: height_m }
    }

    /// The image of a place.
    pub fn of_place(&self, at_m: &Vec3) -> Vec3 {
        at_m + 2.0 * (self.distance_m - self.normal.dot(at_m)) * self.normal
    }

    /// The image of a direction.
    pub fn of_direction(&self, direction: &Vec3) -> Vec3 {
        direction - 2.0 * self.normal.dot(direction) * self.normal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The plane is half way between a place and its image, and the image of the image is the place.
        #[test]
        fn an_image_lies_as_far_behind_the_plane(
            [x, y, z] in [-0.3..0.3f64, -0.3..0.3, -0.3..0.3],
            [azimuth, elevation] in [-3.0..3.0f64, -1.5..1.5],
            distance_m in 0.01..0.5f64,
        ) {
            let normal = Vec3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
            let (mirror, at_m) = (Mirror { normal, distance_m }, Vec3::new(x, y, z));
            let image_m = mirror.of_place(&at_m);
            prop_assert!((0.5 * normal.dot(&(image_m + at_m)) - distance_m).abs() < 1e-12);
            prop_assert!((mirror.of_place(&image_m) - at_m).norm() < 1e-12);
            let moved = mirror.of_place(&(at_m + normal)) - image_m;
            prop_assert!((moved - mirror.of_direction(&normal)).norm() < 1e-12);
        }
    }
}
