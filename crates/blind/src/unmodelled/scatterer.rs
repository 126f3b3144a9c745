//! A small object in the field, such as a screw or a drop of solder on a wire, scatters the incident wave.

use num_complex::Complex64;

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;

pub(super) const NAME: &str = "scatterer";

/// Distance below which the receiver would touch it, m.
const TOUCHING_M: f64 = 4e-3;

#[derive(Debug, Clone, Copy)]
struct Scatterer {
    at_m: Vec3,
    /// Scattered pressure at 1 m relative to the incident one, m; it falls as 1/r.
    strength_m: f64,
}

/// Between the planes, as the robot would hit it on one of them. A rigid sphere as large as the wavelength has a strength of half
/// its radius; 8 mm is an object as large as an egg.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let gaps_m = [(15e-3, 42e-3), (58e-3, 92e-3), (108e-3, 142e-3)];
    let (low_m, high_m) = gaps_m[random.index(gaps_m.len())];
    let at_m = Vec3::new(
        random.uniform(-25e-3, 25e-3),
        random.uniform(-25e-3, 25e-3),
        random.uniform(low_m, high_m),
    );
    Draw::new(8e-3, move |strength_m| Scatterer { at_m, strength_m })
}

impl Unmodelled for Scatterer {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let at_mm = self.at_m * 1e3;
        toml::toml! {
            at_mm = [(at_mm.x), (at_mm.y), (at_mm.z)]
            strength_mm = (self.strength_m * 1e3)
        }
    }

    fn echoes(&self, at_m: Vec3, wavenumber_rad_m: f64) -> Vec<(Vec3, Complex64)> {
        let distance_m = (at_m - self.at_m).norm().max(TOUCHING_M);
        let strength = self.strength_m / distance_m;
        vec![(self.at_m, Complex64::from_polar(strength, wavenumber_rad_m * distance_m))]
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::causes::Causes;
    use super::super::super::laboratory::Laboratory;
    use super::super::super::world::World;
    use super::*;
    use fieldgap_virtual_rig::counter_rng::CounterRng;
    use std::sync::Arc;

    /// Compares with |p + f p(s) exp(ikr)/r| from fields without the scatterer.
    #[test]
    fn the_field_is_the_incident_one_and_a_spherical_wave_from_the_scatterer() {
        let laboratory = Laboratory::draw(&mut RandomSequence::new(CounterRng::new(3)));
        let scatterer = Scatterer { at_m: Vec3::new(0.01, 0.0, 0.07), strength_m: 3e-3 };
        let (none, causes) = (Causes::none(), Causes::of_unmodelled(Arc::new(scatterer)));
        let plain = World::new(&laboratory, &none, 1.0, CounterRng::new(1));
        let scattered = World::new(&laboratory, &causes, 1.0, CounterRng::new(1));
        let at_m = laboratory.survey.stops[3000].at_mm * 1e-3;
        let field = plain.field();
        let weights = field.weights(&laboratory.drives()[0].outputs());
        let mut contributions = field.contributions(at_m);
        let r_m = (at_m - scatterer.at_m).norm();
        let wave = Complex64::from_polar(3e-3 / r_m, field.wavenumber_rad_m() * r_m);
        contributions.add(&field.contributions(scatterer.at_m), wave);
        let expected = field.magnitude(&contributions, &weights, 0.0);
        let got = scattered.phasors_v(&[3000])[0].norm();
        let without = plain.phasors_v(&[3000])[0].norm();
        assert!((got / expected - 1.0).abs() < 1e-12);
        assert!((got / without - 1.0).abs() > 1e-4);
    }
}
