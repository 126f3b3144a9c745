//! How the face of an element moves: as a whole, less at its rim, or with centre and rim in opposite phase.

/// The velocity over a face as a function of the distance from its centre. Only its shape counts: the field on the axis is the same for all.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum FaceMotion {
    /// A piston.
    #[default]
    Whole,
    /// (1 - (r/a)²)^n: a plate held at its rim. n = 1 is simply supported, n = 2 clamped (M. Greenspan, J. Acoust. Soc.
    /// Am. 65, 608, 1979).
    HeldAtRim {
        /// The power, 1 or 2.
        power: u8,
    },
    /// 1 - b (r/a)²: a disc in its first bending mode, as that of open ultrasonic transducers, whose nodal circle lies at a/√b.
    CentreAgainstRim {
        /// b, above 1 and below 2, at which the two sides cancel.
        bend: f64,
    },
}

impl FaceMotion {
    /// The velocity at a distance from the centre, 0 to 1 radii, relative to that of the centre.
    pub fn at(self, radii: f64) -> f64 {
        let squared = radii * radii;
        match self {
            Self::Whole => 1.0,
            Self::HeldAtRim { power } => (1.0 - squared).powi(power.into()),
            Self::CentreAgainstRim { bend } => 1.0 - bend * squared,
        }
    }

    /// The directivity in the far field at x = ka sin θ, 1 on the axis.
    ///
    /// (1 - s²)^n gives 2^(n+1) (n+1)! J(n+1)(x)/x^(n+1), and 1 - b s² = (1 - b) + b (1 - s²) is a sum of two of them, weighted by their
    /// mean velocities 1 - b and b/2.
    pub fn far_field(self, x: f64) -> f64 {
        match self {
            Self::Whole => held(0, x),
            Self::HeldAtRim { power } => held(power.into(), x),
            Self::CentreAgainstRim { bend } => {
                ((1.0 - bend) * held(0, x) + 0.5 * bend * held(1, x)) / (1.0 - 0.5 * bend)
            }
        }
    }
}

/// 2^(n+1) (n+1)! J(n+1)(x)/x^(n+1), 1 at x = 0.
fn held(n: i32, x: f64) -> f64 {
    // J(m)(x) ≈ (x/2)^m/m! (1 - x²/(4(m+1))) near zero.
    if x.abs() < 1e-3 {
        return 1.0 - x * x / f64::from(4 * (n + 2));
    }
    let factorial: f64 = (1..=n + 1).map(f64::from).product();
    factorial * (2.0 / x).powi(n + 1) * libm::jn(n + 1, x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hankel's transform by a sum over rings, an independent way to the same number.
    #[test]
    fn the_far_field_is_the_transform_of_the_velocity() {
        let motions = [
            FaceMotion::Whole,
            FaceMotion::HeldAtRim { power: 1 },
            FaceMotion::HeldAtRim { power: 2 },
            FaceMotion::CentreAgainstRim { bend: 1.7 },
        ];
        let rings = 4000;
        for motion in motions {
            let transform = |x: f64| {
                let ring = |n: i32| (f64::from(n) + 0.5) / f64::from(rings);
                let of = |s: f64| motion.at(s) * libm::j0(x * s) * s;
                (0..rings).map(|n| of(ring(n))).sum::<f64>()
            };
            for x in [0.0, 5e-4, 0.5, 2.0, 3.3, 6.0] {
                let expected = transform(x) / transform(0.0);
                assert!((motion.far_field(x) - expected).abs() < 1e-6, "{motion:?} {x}");
            }
        }
    }

    #[test]
    fn the_rim_moves_against_the_centre_beyond_the_nodal_circle() {
        let motion = FaceMotion::CentreAgainstRim { bend: 1.6 };
        let node = 1.6f64.sqrt().recip();
        assert!(motion.at(0.99 * node) > 0.0 && motion.at(1.01 * node) < 0.0);
        assert_eq!(FaceMotion::HeldAtRim { power: 2 }.at(1.0), 0.0);
    }
}
