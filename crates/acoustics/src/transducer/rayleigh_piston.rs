//! A piston in a rigid baffle by its Rayleigh integral, without far-field approximation.

use std::cell::RefCell;

use super::{OnAxis, Smooth, Transducer};
use crate::rayleigh::{DiscRule, Patch};

/// Smallest distance from the face, in radii, at which the integral keeps its tolerance.
const NEAREST_RADII: f64 = 2.0;

/// Rules that a thread keeps: a fit sums the field at one wavenumber many times, and one beside it.
const KEPT: usize = 4;

/// The patches for a wavenumber times radius and a tolerance.
struct KeptRule {
    ka: f64,
    tolerance: f64,
    patches: Vec<Patch>,
}

thread_local! {
    /// The last ones that were asked for, the latest first.
    static RULES: RefCell<Vec<KeptRule>> = const { RefCell::new(Vec::new()) };
}

/// The face as patches that radiate spherical waves, as many as a tolerance requires.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayleighPiston {
    /// Largest error at distances from two radii, relative to the far field on the axis; above zero.
    pub tolerance: f64,
}

impl RayleighPiston {
    /// 1e-4: about 40 to 100 patches for the faces of 40 kHz transducers.
    pub const FINE: Self = Self { tolerance: 1e-4 };
}

impl Transducer for RayleighPiston {
    fn smooth(&self) -> Smooth {
        Smooth::InCosine
    }

    fn on_axis(&self) -> OnAxis {
        OnAxis::Spherical
    }

    fn directivity(&self, _theta_rad: f64, _face_radius_m: f64, _wavenumber_rad_m: f64) -> f64 {
        1.0
    }

    fn patches(&self, face_radius_m: f64, wavenumber_rad_m: f64) -> Vec<Patch> {
        let ka = wavenumber_rad_m * face_radius_m;
        RULES.with_borrow_mut(|rules| {
            let is_kept = |rule: &KeptRule| rule.ka == ka && rule.tolerance == self.tolerance;
            let rule = match rules.iter().position(is_kept) {
                Some(number) => rules.remove(number),
                None => KeptRule {
                    ka,
                    tolerance: self.tolerance,
                    patches: DiscRule::for_piston(ka, NEAREST_RADII, self.tolerance)
                        .patches()
                        .to_vec(),
                },
            };
            rules.insert(0, rule);
            rules.truncate(KEPT);
            rules[0].patches.clone()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_that_were_kept_are_those_of_the_rule_whatever_was_asked_for_between() {
        let radii_m = [4e-3, 4.5e-3, 5e-3, 5.25e-3, 6e-3, 4e-3, 6e-3, 4e-3];
        for (tolerance, radius_m) in radii_m.into_iter().flat_map(|m| [(1e-4, m), (1e-2, m)]) {
            let kept = RayleighPiston { tolerance }.patches(radius_m, 733.0);
            let rule = DiscRule::for_piston(733.0 * radius_m, NEAREST_RADII, tolerance);
            assert_eq!(kept, rule.patches());
        }
    }
}
