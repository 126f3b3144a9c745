//! An obstacle on one side, such as a bracket, a cable duct or a curtain: a half-plane that transmits part of the sound and
//! diffracts the rest round its edge.
//!
//! The edge is a knife edge with its Fresnel integral (Born and Wolf, *Principles of Optics*, section 8.7), whose auxiliary
//! functions are those of Abramowitz and Stegun, 7.3.32 and 7.3.33 (good to 0.002).

use std::f64::consts::{FRAC_PI_2, TAU};

use num_complex::Complex64;

use super::super::laboratory::{FREQUENCY_HZ, Laboratory, SPEED_M_S};
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::effects::{Effect, Path};

pub(super) const NAME: &str = "screen";

#[derive(Debug, Clone, Copy)]
struct Screen {
    height_m: f64,
    /// Horizontal unit vector across the edge, from the screen to the open side.
    open: Vec3,
    /// Position of the edge along `open`, m from the axis.
    edge_m: f64,
    /// Share of the pressure that the screen blocks; 1 is opaque.
    opacity: f64,
}

/// Below the lowest plane, with its edge 5 to 25 mm from the axis on a random side.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let height_m = random.uniform(15e-3, 40e-3);
    let (sin, cos) = random.angle_rad().sin_cos();
    let edge_m = random.uniform(-25e-3, -5e-3);
    let open = Vec3::new(cos, sin, 0.0);
    Draw::new(1.0, move |opacity| Screen { height_m, open, edge_m, opacity })
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
        let (below_m, above_m) = (self.height_m - path.from_m.z, path.to_m.z - self.height_m);
        if below_m <= 0.0 || above_m <= 0.0 {
            return;
        }
        let share = below_m / (below_m + above_m);
        let crossing_m = path.from_m.lerp(&path.to_m, share);
        let length_m = path.distance_m();
        let (before_m, behind_m) = (share * length_m, (1.0 - share) * length_m);
        let wavelength_m = SPEED_M_S / FREQUENCY_HZ;
        let shadow_m = self.edge_m - crossing_m.dot(&self.open);
        let v = shadow_m * (2.0 * length_m / (wavelength_m * before_m * behind_m)).sqrt();
        let passed = 1.0 - self.opacity * (1.0 - past_edge(v));
        path.gain *= passed.norm();
        path.time_s += passed.arg() / (TAU * FREQUENCY_HZ);
    }
}

impl Unmodelled for Screen {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! {
            height_mm = (self.height_m * 1e3)
            open = [(self.open.x), (self.open.y)]
            edge_mm = (self.edge_m * 1e3)
            opacity = (self.opacity)
        }
    }

    fn effect(&self) -> Option<(&'static str, Box<dyn Effect>)> {
        Some((NAME, Box::new(*self)))
    }
}

#[cfg(test)]
mod tests {
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
        let screen = Screen { height_m: 0.03, open: Vec3::x(), edge_m: 0.0, opacity: 0.4 };
        let gain = |x_m: f64| {
            let (from_m, to_m) = (Vec3::new(x_m, 0.0, 0.0), Vec3::new(x_m, 0.0, 0.1));
            let mut path = Path::straight(0, from_m, to_m, 343.0);
            screen.path(&mut path);
            path.gain
        };
        assert!((gain(0.3) - 1.0).abs() < 0.01 && (gain(-0.3) - 0.6).abs() < 0.01);
    }
}
