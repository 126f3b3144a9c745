//! The converter's full scale cuts the peaks.
//!
//! It is fitted as a share of the largest reading, at which the readings pile up.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Expected, Facts, Finding, Parameter, PerElement, Stage,
    Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Clipping;

impl Effect for Clipping {
    fn id(&self) -> EffectId {
        EffectId::Clipping
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.2, scale: 0.005, least: 0.05, most: 1.2 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Converter,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Saturation],
            independent_check: Some(
                "readings at the focus at full and at half drive show whether the receiver is linear",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual("lower the receiver's amplification")
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![0.999], vec![0.9]]
    }

    fn begins_flat(&self, _believed: &Context) -> bool {
        true
    }

    fn clipped(&self, at: Setting<'_>, expected: Expected, deviation: f64) -> Expected {
        clipped(at.context.largest_reading * at.values[0], expected, deviation)
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, context: &Context) -> Finding {
        let level =
            fitted[0].map(context.largest_reading * fitted[0].value, context.largest_reading);
        let sentence = format!(
            "readings are clipped at {:.3} ± {:.3} {}",
            level.value, level.error, context.unit
        );
        Finding::new([("level", level.real())], sentence)
    }
}

/// What a full scale leaves of normal readings: those that noise takes beyond it are cut, and those that it takes below are not. How
/// those that are cut would have scattered says nothing.
fn clipped(full_scale: f64, expected: Expected, deviation: f64) -> Expected {
    let Expected { reading, variance_ratio } = expected;
    let below = (full_scale - reading) / deviation;
    let share_below = 0.5 * libm::erfc(-below * FRAC_1_SQRT_2);
    let density = (-0.5 * below * below).exp() / TAU.sqrt();
    Expected {
        reading: full_scale - deviation * (below * share_below + density),
        variance_ratio: 1.0 + share_below * (variance_ratio - 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of normal readings cut at a level, by summing over their density.
    #[test]
    fn a_full_scale_cuts_as_much_of_the_mean_as_the_readings_beyond_it_had() {
        let (share, full_scale) = (0.05, 0.3);
        for reading in [0.2, 0.28, 0.3, 0.31, 0.33, 0.6] {
            let deviation = share * reading;
            let (mut sum, mut weights) = (0.0, 0.0);
            for n in -600..=600 {
                let t = 0.01 * f64::from(n);
                let weight = (-0.5 * t * t).exp();
                sum += weight * (reading + t * deviation).min(full_scale);
                weights += weight;
            }
            let cut = clipped(full_scale, Expected { reading, variance_ratio: 1.0 }, deviation);
            assert!((cut.reading - sum / weights).abs() < 1e-5, "{reading}: {cut:?}");
        }
        let beyond = clipped(full_scale, Expected { reading: 0.6, variance_ratio: 0.1 }, 0.01);
        assert!((beyond.variance_ratio - 1.0).abs() < 1e-6, "{beyond:?}");
    }
}
