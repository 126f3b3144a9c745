//! The driver rounds the delay to n steps in a period.
//!
//! Where in a step its zero lies depends on which delay the driver counts from, and is fitted.

use std::f64::consts::TAU;

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Carrier, Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search,
    Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// Steps in a period: every number up to here, and then, as far as steps are told from none, what clocks and counters have.
const EVERY_STEPS: u32 = 64;
const MOST_STEPS: u32 = 256;
const OFTEN: usize = 4;

/// The effect.
pub(crate) struct PhaseQuantisation;

impl Effect for PhaseQuantisation {
    fn id(&self) -> EffectId {
        EffectId::PhaseQuantisation
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::ElementPhase],
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(SetupKey::PhaseSteps)
    }

    fn search(&self) -> Search {
        Search::Steps
    }

    fn drive_phases(&self, at: Setting<'_>, carrier: &Carrier, phases_rad: &mut [f64]) {
        if let Choice::Steps(steps, zero) = at.choice {
            for phase_rad in phases_rad {
                *phase_rad = rounded_rad(*phase_rad, *steps, *zero, carrier.frequency_ratio);
            }
        }
    }

    fn describe(&self, _fitted: &[Estimate], choice: &Choice, _believed: &Context) -> Finding {
        let steps = match choice {
            Choice::Steps(steps, _) => f64::from(*steps),
            Choice::None | Choice::Law(_) | Choice::Elements(_) => f64::NAN,
        };
        let sentence = format!("the driver rounds delays to {steps} steps in a period");
        let value = FittedParameter::Real { value: steps, standard_error: 0.0 };
        Finding::new([("steps", value)], sentence)
    }
}

/// All steps in a period that are looked at, and the sixteenths of a step in which their zero may lie.
pub(crate) fn steps_and_zeros() -> impl Iterator<Item = (u32, u8)> {
    let often = (EVERY_STEPS..=MOST_STEPS).step_by(OFTEN).skip(1);
    (2..=EVERY_STEPS).chain(often).flat_map(|steps| (0..16).map(move |zero| (steps, zero)))
}

/// A phase, rad, of a delay rounded to steps, counted from a number of sixteenths of a step.
pub(crate) fn rounded_rad(phase_rad: f64, steps: u32, zero: u8, frequency_ratio: f64) -> f64 {
    let step_rad = TAU * frequency_ratio / f64::from(steps);
    let from = f64::from(zero) / 16.0;
    ((phase_rad / step_rad + from).round() - from) * step_rad
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_is_rounded_to_the_nearest_of_its_steps() {
        let step_rad = TAU / 16.0;
        for n in 0..100 {
            let phase_rad = 0.1 * f64::from(n);
            let rounded = rounded_rad(phase_rad, 16, 0, 1.0);
            assert!((rounded / step_rad - (rounded / step_rad).round()).abs() < 1e-9);
            assert!((rounded - phase_rad).abs() <= 0.5 * step_rad + 1e-12);
            // Counted from half a step later, the steps lie between these.
            let between = rounded_rad(phase_rad, 16, 8, 1.0) / step_rad;
            assert!((between.rem_euclid(1.0) - 0.5).abs() < 1e-9);
        }
    }
}
