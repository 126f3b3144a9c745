//! The radiation of one element's face: a piston by its Rayleigh integral, or a transducer as a file describes it.
//!
//! A described transducer is evaluated at each point from its laws, without the simulators' kernel. A bug in either thus shows as a
//! difference.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use num_complex::Complex64;

use super::face_motion::FaceMotion;
use super::truth::TrueSource;
use fieldgap_acoustics::rayleigh::{DiscRule, Piston};
use fieldgap_acoustics::transducer::{
    DescribedTransducer, Directivity, OnAxis, Smooth, Transducer,
};
use fieldgap_acoustics::{Element, Vec3};

/// Error allowed in cutting faces into patches, relative to an element's own level on its axis.
const TOLERANCE: f64 = 1e-4;

/// How much finer the patches of a face are that does not move as a whole.
const FINER: f64 = 100.0;

/// Distance from a face, in its radii, from which on that error holds.
pub(super) const NEAREST_RADII: f64 = 2.0;

/// Distance at which every transducer has the level of a spherical wave of unit amplitude at 1 m, m: the middle of usual scan
/// heights.
const REFERENCE_M: f64 = 0.1;

/// One face in space.
#[derive(Debug, Clone)]
pub(super) enum Radiator {
    /// A piston, by the sum over its patches.
    Piston(Piston),
    /// A described transducer.
    Described(Described),
}

/// A described transducer in space.
#[derive(Debug, Clone)]
pub(super) struct Described {
    transducer: Arc<DescribedTransducer>,
    face: Element,
    /// Ratio of its lobe width to the described one, where the face does not determine it.
    stretch: f64,
    /// Scale that gives the reference level at the reference distance.
    scale: f64,
}

/// Makes radiators of one kind. The patches of a radius are computed once.
pub(super) struct Radiators<'s> {
    source: &'s TrueSource,
    wavenumber_rad_m: f64,
    rules: Vec<(f64, DiscRule)>,
}

impl<'s> Radiators<'s> {
    /// For the real elements.
    pub fn new(source: &'s TrueSource, wavenumber_rad_m: f64) -> Self {
        Self { source, wavenumber_rad_m, rules: Vec::new() }
    }

    /// The radiator of an element whose lobe is `stretch` times as wide as its type's: through a smaller face, where the face
    /// determines the lobe.
    pub fn of(&mut self, face: Element, stretch: f64) -> Radiator {
        match &self.source.transducer {
            Some(transducer) if transducer.directivity != Directivity::Rayleigh => {
                Radiator::Described(Described::new(Arc::clone(transducer), face, stretch))
            }
            _ => {
                let radius_m = face.radius_m / stretch;
                Radiator::Piston(Piston::new(
                    face.centre_m,
                    face.normal,
                    radius_m,
                    self.rule(radius_m),
                ))
            }
        }
    }

    fn rule(&mut self, radius_m: f64) -> &DiscRule {
        let known = self.rules.iter().position(|(known_m, _)| *known_m == radius_m);
        let known = known.unwrap_or_else(|| {
            let ka = self.wavenumber_rad_m * radius_m;
            self.rules.push((radius_m, self.fresh_rule(ka)));
            self.rules.len() - 1
        });
        &self.rules[known].1
    }

    fn fresh_rule(&self, ka: f64) -> DiscRule {
        match self.source.motion {
            FaceMotion::Whole => DiscRule::for_piston(ka, NEAREST_RADII, TOLERANCE),
            // The velocity is a polynomial in the squared radius, and the mean velocity can be far below that of the centre: both need more rings.
            motion => DiscRule::for_piston(ka, NEAREST_RADII, TOLERANCE / FINER)
                .moving(|radii| motion.at(radii)),
        }
    }
}

impl Described {
    fn new(transducer: Arc<DescribedTransducer>, mut face: Element, stretch: f64) -> Self {
        // A plane face's lobe is as wide as the face is small; another law knows no face.
        let by_face = transducer.smooth() == Smooth::InSineSquared;
        if by_face {
            face.radius_m /= stretch;
        }
        let scale = 1.0 / (REFERENCE_M * level(transducer.on_axis(), REFERENCE_M, REFERENCE_M));
        Self { transducer, face, stretch: if by_face { 1.0 } else { stretch }, scale }
    }

    fn field(&self, at_m: Vec3, wavenumber_rad_m: f64) -> Complex64 {
        let way_m = at_m - self.face.centre_m;
        let distance_m = way_m.norm().max(1e-9);
        let height_m = way_m.dot(&self.face.normal).max(0.0);
        // Beside and behind its face it is as at a right angle, to which the laws reach.
        let theta_rad = (height_m / distance_m).min(1.0).acos();
        let directivity = self.transducer.directivity(
            (theta_rad / self.stretch).min(FRAC_PI_2),
            self.face.radius_m,
            wavenumber_rad_m,
        );
        let level = self.scale * level(self.transducer.on_axis(), distance_m, height_m);
        Complex64::from_polar(level * directivity.abs(), wavenumber_rad_m * distance_m)
            * directivity.signum()
    }
}

impl Radiator {
    /// The field at a point, 1/m.
    pub fn field(&self, at_m: Vec3, wavenumber_rad_m: f64) -> Complex64 {
        match self {
            Self::Piston(piston) => piston.field(at_m, wavenumber_rad_m),
            Self::Described(described) => described.field(at_m, wavenumber_rad_m),
        }
    }
}

/// The value of an on-axis law at a distance from the face's centre and a height above its plane.
fn level(law: OnAxis, distance_m: f64, height_m: f64) -> f64 {
    match law {
        OnAxis::Exponential { amplitude, decay_per_m } => {
            amplitude * (-decay_per_m * height_m).exp()
        }
        OnAxis::Spherical => 1.0 / distance_m,
        OnAxis::Power { exponent } => distance_m.powf(-exponent),
        OnAxis::Absorbed { amplitude, attenuation_np_m } => {
            amplitude * (-attenuation_np_m * distance_m).exp() / distance_m
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::transducer::MeasuredTable;
    use fieldgap_acoustics::{Array, FieldKernel, PathLengths};

    const K: f64 = 732.7;

    fn kinds() -> Vec<DescribedTransducer> {
        let table = MeasuredTable::new(&[0.0, 20.0, 60.0], &[1.0, 0.7, 0.1]).expect("a table");
        let laws = [
            Directivity::Even,
            Directivity::Gaussian { centre_rad: 0.0, width_rad: 0.54 },
            Directivity::Gaussian { centre_rad: -0.07, width_rad: 0.62 },
            Directivity::Piston,
            Directivity::MultiGaussian,
            Directivity::Table(table),
        ];
        let decays = [
            OnAxis::Spherical,
            OnAxis::Absorbed { amplitude: 0.4, attenuation_np_m: 0.15 },
            OnAxis::Power { exponent: 0.9 },
            OnAxis::Exponential { amplitude: 1.1, decay_per_m: 5.3 },
        ];
        laws.iter()
            .flat_map(|directivity| {
                let of =
                    |on_axis| DescribedTransducer { on_axis, directivity: directivity.clone() };
                decays.map(of)
            })
            .collect()
    }

    fn source(transducer: DescribedTransducer) -> TrueSource {
        TrueSource { transducer: Some(Arc::new(transducer)), ..TrueSource::default() }
    }

    /// Two independent computations of one number: the kernel's polynomials, and the laws themselves.
    #[test]
    fn every_transducer_sounds_as_the_simulators_kernel_has_it() {
        let face =
            Element { normal: Vec3::new(0.1, -0.2, 1.0).normalize(), ..Element::at(3e-3, -2e-3) };
        let array = Array::from_elements(vec![face]).expect("one element");
        for transducer in kinds() {
            let source = source(transducer.clone());
            let radiator = Radiators::new(&source, K).of(face, 1.0);
            let kernel = FieldKernel::new(&array, &[0.0], &transducer, K, PathLengths::Observed);
            let reference_m = face.centre_m + face.normal * REFERENCE_M;
            let scale = 1.0 / REFERENCE_M / kernel.at(&[reference_m])[0].norm()
                * transducer.directivity(0.0, face.radius_m, K);
            for (x, y, z) in [(0.0, 0.0, 100.0), (40.0, -10.0, 60.0), (-80.0, 30.0, 150.0)] {
                let at_m = Vec3::new(x, y, z) * 1e-3;
                let (own, other) = (radiator.field(at_m, K), kernel.at(&[at_m])[0] * scale);
                assert!(
                    (own - other).norm() < 1e-9 * other.norm().max(1.0),
                    "{transducer:?}: {own} {other}"
                );
            }
        }
    }

    #[test]
    fn each_has_the_level_of_a_spherical_wave_a_tenth_of_a_metre_up_its_axis() {
        for transducer in kinds().into_iter().filter(|kind| kind.directivity == Directivity::Even) {
            let p = Radiators::new(&source(transducer), K)
                .of(Element::at(0.0, 0.0), 1.0)
                .field(Vec3::z() * REFERENCE_M, K);
            assert!((p.norm() - 10.0).abs() < 1e-12);
        }
    }

    /// The far field in closed form, reached where the distance is large beside a²/λ.
    #[test]
    fn a_face_in_its_bending_mode_has_the_lobe_of_its_closed_form() {
        for motion in [
            FaceMotion::CentreAgainstRim { bend: 1.7 },
            FaceMotion::HeldAtRim { power: 1 },
            FaceMotion::HeldAtRim { power: 2 },
        ] {
            let source = TrueSource { motion, ..TrueSource::default() };
            let face = Element::at(0.0, 0.0);
            let radiator = Radiators::new(&source, K).of(face, 1.0);
            for degree in (0..=80).step_by(10) {
                let (sin, cos) = f64::from(degree).to_radians().sin_cos();
                let p = radiator.field(Vec3::new(sin, 0.0, cos) * 20.0, K) * 20.0;
                let expected = motion.far_field(K * face.radius_m * sin);
                assert!((p.norm() - expected.abs()).abs() < 1e-3, "{motion:?} {degree}: {p}");
            }
        }
    }

    #[test]
    fn a_wider_lobe_has_the_level_of_an_angle_at_a_wider_one() {
        for (directivity, wider_rad) in [
            (Directivity::Gaussian { centre_rad: 0.0, width_rad: 0.54 }, 1.25 * 0.4),
            (Directivity::Piston, (1.25 * 0.4f64.sin()).asin()),
        ] {
            let transducer = DescribedTransducer { on_axis: OnAxis::Spherical, directivity };
            let source = source(transducer);
            let level = |stretch: f64, angle: f64| {
                let at_m = Vec3::new(angle.sin(), 0.0, angle.cos()) * 0.2;
                Radiators::new(&source, K).of(Element::at(0.0, 0.0), stretch).field(at_m, K).norm()
            };
            assert!((level(1.25, wider_rad) - level(1.0, 0.4)).abs() < 1e-12);
        }
    }
}
