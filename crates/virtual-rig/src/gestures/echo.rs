//! The echo of a flat plate of finite size, and the direct coupling from element to element.
//!
//! An infinite plate returns the wave of the emitter's mirror image. A finite plate acts as an aperture in front of that image.
//! For a rectangle Kirchhoff's integral becomes a product of two Fresnel integrals (Born and Wolf, *Principles of Optics*,
//! section 8.7), exact for edges at small angles from the line of sight. For a hand at 100 mm, whose edges are at larger angles,
//! the error against Kirchhoff's integral is below a fifth of the mirror's echo. The time convention is exp(-iωt).

use num_complex::Complex64;

use super::fresnel::fresnel;
use fieldgap_acoustics::{Element, Vec3};

/// Direct coupling from element to element through housings and board, relative to the sound on an element's axis. It makes a
/// neighbour about as loud as the echo of a hand.
const COUPLING: f64 = 0.05;

/// A rectangular plate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// Its centre, array's frame, m.
    pub centre_m: Vec3,
    /// Along one side, of unit length.
    pub along: Vec3,
    /// Along the other, of unit length, across the first.
    pub across: Vec3,
    /// Half of the sides, m.
    pub half_m: [f64; 2],
    /// Reflected share of the amplitude.
    pub reflection: f64,
}

/// Sound from element to element, in air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementPaths {
    /// Wavenumber, rad/m.
    pub wavenumber_rad_m: f64,
}

impl ElementPaths {
    /// Pressure at an element by way of a plate, where another emits with unit amplitude, 1/m.
    pub fn echo(&self, emitter: &Element, sensor: &Element, plate: &Plate) -> Complex64 {
        let normal = plate.along.cross(&plate.across);
        let height_m = (plate.centre_m - emitter.centre_m).dot(&normal);
        let image_m = emitter.centre_m + normal * (2.0 * height_m);
        let sight_m = sensor.centre_m - image_m;
        let reach_m = sight_m.norm();
        let falls = sight_m.dot(&normal);
        // The sensor must be on the emitter's side of the mirror.
        if reach_m == 0.0 || falls * height_m >= 0.0 {
            return Complex64::ZERO;
        }
        let to_plate_m = reach_m * (-height_m / falls);
        let rest_m = reach_m - to_plate_m;
        if rest_m <= 0.0 {
            return Complex64::ZERO;
        }
        let sight = sight_m / reach_m;
        let met_m = image_m + sight * to_plate_m - plate.centre_m;
        // Fresnel's number of a distance across the line of sight.
        let scale = (self.wavenumber_rad_m / std::f64::consts::PI
            * (1.0 / to_plate_m + 1.0 / rest_m))
            .sqrt();
        let seen = |side: Vec3, half_m: f64| {
            let foreshortened = (1.0 - sight.dot(&side).powi(2)).sqrt() * scale;
            let middle_m = met_m.dot(&side);
            let (from, to) =
                ((-half_m - middle_m) * foreshortened, (half_m - middle_m) * foreshortened);
            (fresnel(to) - fresnel(from)) / Complex64::new(1.0, 1.0)
        };
        let [along_m, across_m] = plate.half_m;
        // Where the mirror point lies beside the plate, the echo comes from the nearest edge.
        let nearest_m = plate.centre_m
            + plate.along * met_m.dot(&plate.along).clamp(-along_m, along_m)
            + plate.across * met_m.dot(&plate.across).clamp(-across_m, across_m);
        let towards =
            |element: &Element| self.lobe(element, (nearest_m - element.centre_m).normalize());
        let loudness = plate.reflection * towards(emitter) * towards(sensor);
        Complex64::from_polar(loudness / reach_m, self.wavenumber_rad_m * reach_m)
            * seen(plate.along, along_m)
            * seen(plate.across, across_m)
    }

    /// Pressure at an element by direct coupling from another with unit amplitude, 1/m.
    pub fn coupling(&self, emitter: &Element, sensor: &Element) -> Complex64 {
        let between_m = (sensor.centre_m - emitter.centre_m).norm();
        if between_m == 0.0 {
            return Complex64::ZERO;
        }
        Complex64::from_polar(COUPLING / between_m, self.wavenumber_rad_m * between_m)
    }

    /// Directivity of an element in a direction of unit length, in emission and reception alike; zero behind its face.
    fn lobe(&self, element: &Element, direction: Vec3) -> f64 {
        let cosine = direction.dot(&element.normal).clamp(-1.0, 1.0);
        if cosine <= 0.0 {
            return 0.0;
        }
        let sine = (1.0 - cosine * cosine).sqrt();
        let x = self.wavenumber_rad_m * element.radius_m * sine;
        if x < 1e-4 { 1.0 } else { 2.0 * libm::j1(x) / x }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use fieldgap_acoustics::transducer::{Piston, Transducer};

    const AIR: ElementPaths = ElementPaths { wavenumber_rad_m: 732.7 };

    fn flat(x: f64, height: f64, half_m: [f64; 2]) -> Plate {
        Plate {
            centre_m: Vec3::new(x, 0.0, height),
            along: Vec3::x(),
            across: Vec3::y(),
            half_m,
            reflection: 1.0,
        }
    }

    /// Kirchhoff's integral over the plate, patch by patch.
    fn kirchhoff(emitter: &Element, sensor: &Element, plate: &Plate) -> Complex64 {
        let normal = plate.along.cross(&plate.across);
        let step_m = 1e-3;
        let count = plate.half_m.map(|half_m| (2.0 * half_m / step_m).round() as i64);
        let cell = |n: i64, count: i64, half_m: f64| {
            ((n as f64 + 0.5) / count as f64 * 2.0 - 1.0) * half_m
        };
        let area_m2 = 4.0 * plate.half_m[0] * plate.half_m[1] / (count[0] * count[1]) as f64;
        let mut sum = Complex64::ZERO;
        for u in 0..count[0] {
            for v in 0..count[1] {
                let at_m = plate.centre_m
                    + plate.along * cell(u, count[0], plate.half_m[0])
                    + plate.across * cell(v, count[1], plate.half_m[1]);
                let (there, back) = (at_m - emitter.centre_m, sensor.centre_m - at_m);
                let (d1, d2) = (there.norm(), back.norm());
                let inclination = 0.5 * (there.dot(&normal) / d1 - back.dot(&normal) / d2);
                let lobes = AIR.lobe(emitter, there / d1) * AIR.lobe(sensor, -back / d2);
                sum += Complex64::from_polar(
                    inclination * lobes * area_m2 / (d1 * d2),
                    AIR.wavenumber_rad_m * (d1 + d2),
                );
            }
        }
        sum * plate.reflection * Complex64::new(0.0, -AIR.wavenumber_rad_m / std::f64::consts::TAU)
    }

    proptest! {
        #[test]
        fn a_large_plate_is_a_mirror(x in -0.02..0.02f64, height in 0.04..0.15f64) {
            let (emitter, sensor) = (Element::at(0.0, 0.0), Element::at(x, 0.01));
            let echo = AIR.echo(&emitter, &sensor, &flat(0.0, height, [50.0, 50.0]));
            let image = Vec3::new(x, 0.01, -2.0 * height);
            let sine = image.xy().norm() / image.norm();
            let lobe = Piston.directivity(sine.asin(), emitter.radius_m, AIR.wavenumber_rad_m).powi(2);
            let mirror = Complex64::from_polar(lobe / image.norm(), AIR.wavenumber_rad_m * image.norm());
            prop_assert!((echo - mirror).norm() < 1e-2 * mirror.norm(), "{} {}", echo, mirror);
        }

        #[test]
        fn the_echo_is_the_same_the_other_way_round(
            a in (-0.02..0.02f64, -0.02..0.02f64), b in (-0.02..0.02f64, -0.02..0.02f64), x in -0.15..0.15f64, tilt in -0.2..0.2f64,
        ) {
            let (a, b) = (Element::at(a.0, a.1), Element::at(b.0, b.1));
            let along = Vec3::new(tilt.cos(), 0.0, tilt.sin());
            let plate = Plate { along, ..flat(x, 0.1, [0.045, 0.09]) };
            let (there, back) = (AIR.echo(&a, &b, &plate), AIR.echo(&b, &a, &plate));
            prop_assert!((there - back).norm() < 1e-9 + 1e-6 * there.norm());
        }
    }

    #[test]
    fn the_product_of_fresnel_integrals_is_kirchhoffs_integral() {
        let (emitter, sensor) = (Element::at(0.0, 0.0), Element::at(-0.018, 0.0105));
        let mirror = 1.0 / 0.2;
        for (x, tilt) in
            [(-0.12, 0.0), (-0.06, 0.0), (-0.04, 0.1), (0.0, 0.0), (0.03, -0.08), (0.05, 0.0)]
        {
            let along = Vec3::new(f64::cos(tilt), 0.0, f64::sin(tilt));
            let plate = Plate { along, ..flat(x, 0.1, [0.045, 0.09]) };
            let (ours, sum) =
                (AIR.echo(&emitter, &sensor, &plate), kirchhoff(&emitter, &sensor, &plate));
            assert!((ours - sum).norm() < 0.2 * mirror, "at {x}: {ours} against {sum}");
        }
    }

    #[test]
    fn nothing_comes_back_from_behind() {
        let (emitter, sensor) = (Element::at(0.0, 0.0), Element::at(0.01, 0.0));
        assert_eq!(AIR.echo(&emitter, &sensor, &flat(0.0, -0.1, [0.1, 0.1])), Complex64::ZERO);
    }
}
