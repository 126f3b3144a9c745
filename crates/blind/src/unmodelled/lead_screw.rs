//! The lead screw of x has a periodic error: the position deviates sinusoidally, one period per turn.

use std::f64::consts::TAU;

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::effects::Effect;
use fieldgap_virtual_rig::trajectory::Kinematics;

pub(super) const NAME: &str = "lead-screw";

/// Leads of common screws, mm per turn. Leads of 4 mm and less would alias with points 2 mm apart.
const LEADS_MM: [f64; 3] = [5.0, 8.0, 12.0];

#[derive(Debug, Clone, Copy)]
struct LeadScrew {
    lead_mm: f64,
    amplitude_mm: f64,
    phase_rad: f64,
}

pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let lead_mm = LEADS_MM[random.index(LEADS_MM.len())];
    let phase_rad = random.angle_rad();
    Draw::new(1.5, move |amplitude_mm| LeadScrew { lead_mm, amplitude_mm, phase_rad })
}

impl Effect for LeadScrew {
    fn place(&self, at_m: &mut Vec3, kinematics: &Kinematics) {
        let turn_rad = TAU * kinematics.position_mm.x / self.lead_mm + self.phase_rad;
        at_m.x += self.amplitude_mm * 1e-3 * turn_rad.sin();
    }
}

impl Unmodelled for LeadScrew {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! {
            lead_mm = (self.lead_mm)
            amplitude_mm = (self.amplitude_mm)
            phase_rad = (self.phase_rad)
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
    fn the_error_is_periodic_in_the_lead() {
        let screw = LeadScrew { lead_mm: 8.0, amplitude_mm: 0.5, phase_rad: 0.3 };
        let error_mm = |x_mm: f64| {
            let mut at_m = Vec3::zeros();
            let position_mm = Vec3::new(x_mm, 0.0, 0.0);
            let kinematics = Kinematics {
                position_mm,
                x_direction: 1.0,
                x_since_reversal_mm: 9.0,
                travelled_mm: 9.0,
            };
            screw.place(&mut at_m, &kinematics);
            at_m.x * 1e3
        };
        assert!((error_mm(3.0) - error_mm(11.0)).abs() < 1e-12);
        assert!((error_mm(3.0) + error_mm(7.0)).abs() < 1e-12);
    }
}
