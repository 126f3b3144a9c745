//! The driver rounds the delay to n steps in a period.
//!
//! Where in a step its zero lies depends on which delay the driver counts from. A driver that counts from an element, or from the least delay,
//! has another zero for every focus. A common zero is tried, and one for each drive.

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

/// The unit of a zero, as parts of a step.
const PARTS_OF_A_STEP: f64 = 65536.0;

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

    fn drive_phases(
        &self,
        at: Setting<'_>,
        drive: usize,
        carrier: &Carrier,
        phases_rad: &mut [f64],
    ) {
        if let Choice::Steps(steps, zeros) = at.choice
            && let Some(zero) = zeros.get(drive).or(zeros.first())
        {
            let step_rad = step_rad(*steps, carrier.frequency_ratio);
            for phase_rad in phases_rad {
                *phase_rad = rounded_rad(*phase_rad, step_rad, *zero);
            }
        }
    }

    fn describe(&self, _fitted: &[Estimate], choice: &Choice, _believed: &Context) -> Finding {
        let (steps, zeros): (f64, &[u16]) = match choice {
            Choice::Steps(steps, zeros) => (f64::from(*steps), zeros),
            Choice::None | Choice::Law(_) | Choice::Elements(_) => (f64::NAN, &[]),
        };
        let sentence = format!("the driver rounds delays to {steps} steps in a period");
        let value = FittedParameter::Real { value: steps, standard_error: 0.0 };
        let mut finding = Finding::new([("steps", value)], sentence);
        if zeros.iter().any(|zero| *zero != 0) {
            // Parts of a step: one for every drive, or one for all. What lies between two phases is not determined, and makes no difference.
            let value = zeros.iter().map(|zero| f64::from(*zero) / PARTS_OF_A_STEP).collect();
            let standard_error = vec![0.0; zeros.len()];
            let zeros = FittedParameter::Each { value, standard_error };
            finding.parameters.insert("zeros", zeros);
        }
        finding
    }
}

/// All numbers of steps in a period that are looked at.
pub(crate) fn steps_in_a_period() -> impl Iterator<Item = u32> {
    let often = (EVERY_STEPS..=MOST_STEPS).step_by(OFTEN).skip(1);
    (2..=EVERY_STEPS).chain(often)
}

/// Binary digits of the common zeros that are compared first: sixteenths of a step.
pub(crate) const FIRST_DIGITS: u32 = 4;

/// The common zeros that are compared first, in the unit of a choice.
pub(crate) fn first_common_zeros() -> impl Iterator<Item = u16> {
    (0..1 << FIRST_DIGITS).map(|number| number << (u16::BITS - FIRST_DIGITS))
}

/// Binary digits of a zero, as a part of a step; of sixteenths all four.
pub(crate) fn digits(zero: u16) -> u32 {
    (u16::BITS - zero.trailing_zeros()).max(FIRST_DIGITS)
}

/// A step, rad.
pub(crate) fn step_rad(steps: u32, frequency_ratio: f64) -> f64 {
    TAU * frequency_ratio / f64::from(steps)
}

/// A phase, rad, of a delay rounded to steps, counted from a number of 65,536ths of a step.
pub(crate) fn rounded_rad(phase_rad: f64, step_rad: f64, zero: u16) -> f64 {
    let from = f64::from(zero) / PARTS_OF_A_STEP;
    ((phase_rad / step_rad + from).round() - from) * step_rad
}

/// The whole steps of that: the same but for a phase that all elements of a drive share, which readings do not show.
pub(crate) fn whole_steps(phase_rad: f64, step_rad: f64, zero: u16) -> i64 {
    // (The library's rounding takes much longer.)
    (phase_rad / step_rad + f64::from(zero) / PARTS_OF_A_STEP + 0.5).floor() as i64
}

/// The zero from which on a phase is rounded to the next step: half a step from its place within a step.
pub(crate) fn turned_from(phase_rad: f64, step_rad: f64) -> f64 {
    (0.5 - phase_rad / step_rad).rem_euclid(1.0) * PARTS_OF_A_STEP
}

/// The zeros that round the phases of a drive differently: one between each two neighbours of the places that phases have within a step.
pub(crate) fn zeros_of_a_drive(phases_rad: &[f64], step_rad: f64) -> Vec<u16> {
    let mut places: Vec<f64> =
        phases_rad.iter().map(|phase| (phase / step_rad).rem_euclid(1.0)).collect();
    places.sort_by(f64::total_cmp);
    let next = places.iter().skip(1).copied().chain([places[0] + 1.0]);
    let mut zeros: Vec<u16> = places
        .iter()
        .zip(next)
        // Closer ones are equal but for rounding errors.
        .filter(|(place, next)| next - *place > 4.0 / PARTS_OF_A_STEP)
        // What lies half a step from the zero is rounded to either side.
        .map(|(place, next)| shortest_zero(0.5 - 0.5 * (place + next), 0.25 * (next - place)))
        .collect();
    zeros.sort_unstable();
    zeros
}

/// The zero of the fewest binary digits that is this near to a part of a step.
fn shortest_zero(part: f64, within: f64) -> u16 {
    let zero = |digits: u32| {
        let parts = f64::from(1u32 << digits);
        (part * parts).round() / parts
    };
    let near = (FIRST_DIGITS..u16::BITS).map(zero).find(|zero| (zero - part).abs() <= within);
    (near.unwrap_or(part).rem_euclid(1.0) * PARTS_OF_A_STEP) as u16
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_phase_is_rounded_to_the_nearest_of_its_steps() {
        let step_rad = TAU / 16.0;
        for n in 0..100 {
            let phase_rad = 0.1 * f64::from(n);
            let rounded = rounded_rad(phase_rad, step_rad, 0);
            assert!((rounded / step_rad - (rounded / step_rad).round()).abs() < 1e-9);
            assert!((rounded - phase_rad).abs() <= 0.5 * step_rad + 1e-12);
            // Counted from half a step later, the steps lie between these.
            let between = rounded_rad(phase_rad, step_rad, 1 << 15) / step_rad;
            assert!((between.rem_euclid(1.0) - 0.5).abs() < 1e-9);
        }
    }

    /// The middle of each gap between 32 evenly spread places is an odd number of 64ths, which have six binary digits.
    #[test]
    fn zeros_have_as_few_digits_as_the_gaps_between_phases_allow() {
        let step_rad = TAU / 8.0;
        let phases_rad: Vec<f64> = (0..32).map(|n| step_rad * f64::from(n) / 32.0).collect();
        let zeros = zeros_of_a_drive(&phases_rad, step_rad);
        assert_eq!(zeros.len(), 32);
        assert!(zeros.iter().all(|&zero| digits(zero) == 6), "{zeros:?}");
        assert_eq!([0, 1 << 15, 1 << 12, 1 << 11, 1].map(digits), [4, 4, 4, 5, 16]);
    }

    proptest! {
        /// Whatever a driver counts from, one of the zeros rounds as it does but for a phase that all elements share.
        #[test]
        fn one_of_the_zeros_of_a_drive_rounds_as_any_driver_does(
            phases_rad in prop::collection::vec(-30.0..30.0f64, 1..40),
            from in 0.0..1.0f64,
            steps in 2..64u32,
        ) {
            let step_rad = step_rad(steps, 1.0);
            let counted = |phase: &f64| phase / step_rad + from;
            // (Near a boundary either side is right.)
            prop_assume!(phases_rad.iter().all(|phase| (counted(phase).rem_euclid(1.0) - 0.5).abs() > 1e-4));
            let driven: Vec<f64> = phases_rad.iter().map(|phase| counted(phase).round()).collect();
            let rounds_alike = |zero: &u16| {
                let steps_of = |phase: &f64| rounded_rad(*phase, step_rad, *zero) / step_rad;
                let off: Vec<f64> =
                    phases_rad.iter().zip(&driven).map(|(phase, driven)| steps_of(phase) - driven).collect();
                off.iter().all(|one| (one - off[0]).abs() < 1e-6)
            };
            prop_assert!(zeros_of_a_drive(&phases_rad, step_rad).iter().any(rounds_alike));
        }
    }
}
