//! An obstacle on one side, such as a bracket, a cable duct or a curtain: a half-plane that transmits part of the sound and
//! diffracts the rest round its edge.
//!
//! The edge is a knife edge with its Fresnel integral (Born and Wolf, *Principles of Optics*, section 8.7), whose auxiliary
//! functions are those of Abramowitz and Stegun, 7.3.32 and 7.3.33 (good to 0.002).

use std::f64::consts::{FRAC_PI_2, TAU};

use num_complex::Complex64;
use serde::Deserialize;

use super::{Effect, Path};
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Finite, Positive};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Screen {
    /// Height above the array.
    height_mm: Finite,
    /// Horizontal unit vector across the edge, from the screen to the open side.
    open: Exact<Finite, 2>,
    /// Position of the edge along `open`, from the axis.
    edge_mm: Finite,
    /// Share of the pressure that the screen blocks; 1 is opaque.
    opacity: Finite,
    /// The carrier whose wavelength the edge diffracts.
    frequency_hz: Positive,
}

/// Share of a wave that passes a knife edge at the Fresnel parameter `v`: 1 far on the open side (-∞), 1/2 at the edge.
fn past_edge(v: f64) -> Complex64 {
    if v < 0.0 {
        return 1.0 - past_edge(-v);
    }
    let f = (1.0 + 0.926 * v) / (2.0 + 1.792 * v + 3.104 * v * v);
    let g = 1.0 / (2.0 + 4.142 * v + 3.492 * v * v + 6.670 * v * v * v);
    Complex64::new(0.5, -0.5) * Complex64::from_polar(1.0, FRAC_PI_2 * v * v) * Complex64::new(g, f)
}

impl Effect for Screen {
    fn path(&self, path: &mut Path) {
        let height_m = self.height_mm.get() * 1e-3;
        let (below_m, above_m) = (height_m - path.from_m.z, path.to_m.z - height_m);
        if below_m <= 0.0 || above_m <= 0.0 {
            return;
        }
        let share = below_m / (below_m + above_m);
        let crossing_m = path.from_m.lerp(&path.to_m, share);
        let length_m = path.distance_m();
        let (before_m, behind_m) = (share * length_m, (1.0 - share) * length_m);
        let wavelength_m = path.speed_m_s / self.frequency_hz.get();
        let [x, y] = self.open.map(Finite::get);
        let shadow_m = self.edge_mm.get() * 1e-3 - crossing_m.dot(&Vec3::new(x, y, 0.0));
        let v = shadow_m * (2.0 * length_m / (wavelength_m * before_m * behind_m)).sqrt();
        let passed = 1.0 - self.opacity.get() * (1.0 - past_edge(v));
        path.gain *= passed.norm();
        path.time_s += passed.arg() / (TAU * self.frequency_hz.get());
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_wave_past_the_edge_is_its_fresnel_integral() {
        for v in [-2.3, -1.0, -0.2, 0.0, 0.4, 1.5, 3.0] {
            // (1 - i)/2 ∫ exp(iπt²/2) dt from v on: down to a far end by steps, the rest by its first term.
            let (end, steps) = (30.0, 400_000);
            let step = (end - v) / f64::from(steps);
            let sum: Complex64 = (0..steps)
                .map(|n| {
                    let t = v + (f64::from(n) + 0.5) * step;
                    Complex64::from_polar(step, FRAC_PI_2 * t * t)
                })
                .sum();
            let rest = Complex64::from_polar(1.0, FRAC_PI_2 * end * end) * Complex64::i()
                / (std::f64::consts::PI * end);
            let expected = Complex64::new(0.5, -0.5) * (sum + rest);
            assert!((past_edge(v) - expected).norm() < 3e-3, "{v}: {expected}");
        }
    }

    #[test]
    fn the_open_side_is_undisturbed_and_the_deep_shadow_lacks_the_blocked_share() {
        let screen: Screen = effect(
            "height_mm = 30.0\nopen = [1.0, 0.0]\nedge_mm = 0.0\nopacity = 0.4\nfrequency_hz = 40000.0",
        );
        let gain = |x_m: f64| {
            let (from_m, to_m) = (Vec3::new(x_m, 0.0, 0.0), Vec3::new(x_m, 0.0, 0.1));
            let mut path = Path::straight(0, from_m, to_m, 343.0);
            screen.path(&mut path);
            path.gain
        };
        assert!((gain(0.3) - 1.0).abs() < 0.01 && (gain(-0.3) - 0.6).abs() < 0.01);
    }
}
