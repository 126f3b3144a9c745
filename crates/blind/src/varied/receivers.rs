//! Receivers: their noise, their converters, and what goes wrong with single readings.

use super::super::random_sequence::RandomSequence;
use super::super::reception::{Outliers, PhaseReading, Reception};
use fieldgap_records::PhaseConvention;

/// Noise that adds, over the peak, where there is next to none.
const LITTLE: f64 = 5e-4;

/// A receiver and its noise.
pub(super) struct Receiver {
    pub multiplicative: f64,
    pub additive_over_peak: f64,
    pub reception: Reception,
}

/// Each property on its own, so that all combinations come.
pub(super) fn draw(random: &mut RandomSequence) -> Receiver {
    let kind = random.index(3);
    let multiplicative = if kind == 1 { 0.0 } else { random.log_uniform(0.005, 0.03) };
    let additive_over_peak = if kind == 0 { LITTLE } else { random.log_uniform(0.002, 0.02) };
    let slow = if random.chance(0.25) { random.uniform(0.003, 0.01) } else { 0.0 };
    let outliers = random.chance(0.2).then(|| Outliers {
        share: random.uniform(0.002, 0.01),
        most_sigma: random.uniform(5.0, 20.0),
    });
    let bits = random.chance(0.35).then(|| 8 + random.index(7) as u32);
    let lost = if random.chance(0.2) { random.uniform(0.01, 0.05) } else { 0.0 };
    let phase = random.chance(0.3).then(|| PhaseReading {
        noise_rad: random.log_uniform(0.01, 0.05),
        offset_rad: random.angle_rad(),
        drift_rad: random.uniform(-0.3, 0.3),
        convention: if random.chance(0.5) {
            PhaseConvention::MinusIwt
        } else {
            PhaseConvention::PlusIwt
        },
    });
    let reception = Reception { slow, outliers, bits, lost, phase };
    Receiver { multiplicative, additive_over_peak, reception }
}

impl Receiver {
    /// Its class on each axis.
    pub fn classes(&self) -> Vec<(&'static str, &'static str)> {
        let Reception { slow, outliers, bits, lost, phase } = self.reception;
        let noise = match (self.multiplicative > 0.0, self.additive_over_peak > LITTLE) {
            (true, true) => "both",
            (true, false) => "multiplicative",
            (false, _) => "additive",
        };
        let with = |is: bool| if is { "with" } else { "without" };
        let converter = match bits {
            Some(..=10) => "8 to 10 bits",
            Some(_) => "11 to 14 bits",
            None => "fine",
        };
        vec![
            ("noise", noise),
            ("slow noise", with(slow > 0.0)),
            ("outliers", with(outliers.is_some())),
            ("converter", converter),
            ("lost readings", with(lost > 0.0)),
            ("quantity", if phase.is_some() { "complex" } else { "amplitude" }),
        ]
    }
}
