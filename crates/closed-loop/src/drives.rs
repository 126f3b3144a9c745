//! The drives among which a closed loop chooses: those of the plan, and some that show what a focus hides.
//!
//! All elements in phase, one half reversed, random phases and further foci are what any controller of a phased array can drive. In the
//! focus alone all elements add up, so that errors of single elements hide behind each other; random phases separate them.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use fieldgap_acoustics::{Array, Medium, Vec3};
use fieldgap_records::{BoxMm, FocusSection};

use crate::places::places_m;

/// Further foci, and sets of random phases. Set by judgement: with more, each is measured too seldom to settle its own steps of phase.
const FURTHER_FOCI: usize = 3;
const RANDOM_DRIVES: u64 = 4;

/// Digits of a phase behind the point that a plan states: below a thousandth of a period.
const PER_RADIAN: f64 = 1e4;

/// Drives beside those of the plan, for an array that is believed to be this one.
pub(crate) fn further_drives(
    planned: &[FocusSection],
    array: &Array,
    medium: &Medium,
    frequency_hz: f64,
    within: &BoxMm,
) -> Vec<FocusSection> {
    let mut drives = Vec::new();
    if !planned.contains(&FocusSection::AllZero) {
        drives.push(FocusSection::AllZero);
    }
    // Foci in the inner half of the box, so that the box holds their surroundings.
    let middle = (within.least + within.most) / 2.0;
    let inner = BoxMm {
        least: middle + (within.least - middle) / 2.0,
        most: middle + (within.most - middle) / 2.0,
    };
    // Rounded again, because a plan and a page show them.
    let in_mm = |at_m: Vec3| at_m.map(|m| (m * 1e5).round() / 100.0);
    let foci = places_m(&inner, 0).take(FURTHER_FOCI);
    drives.extend(foci.map(|at_m| FocusSection::Point(in_mm(at_m))));
    let phases_rad = planned[0].excitation().phases_rad(array, medium, frequency_hz);
    for side in [Vec3::x(), Vec3::y()] {
        let elements = array.elements().iter().zip(&phases_rad);
        let reversed = elements.map(|(element, phase_rad)| {
            let turn_rad = if element.centre_m.dot(&side) > 0.0 { PI } else { 0.0 };
            rounded(phase_rad + turn_rad)
        });
        drives.push(FocusSection::Phases(reversed.collect()));
    }
    for number in 0..RANDOM_DRIVES {
        let mut draws = ChaCha8Rng::seed_from_u64(number);
        let phases = (0..array.len()).map(|_| rounded(draws.random_range(0.0..TAU)));
        drives.push(FocusSection::Phases(phases.collect()));
    }
    drives
}

fn rounded(phase_rad: f64) -> f64 {
    (phase_rad.rem_euclid(TAU) * PER_RADIAN).round() / PER_RADIAN
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Excitation;

    #[test]
    fn the_halves_are_reversed_and_all_drives_differ() {
        let array = Array::square(4, 4, 10e-3).expect("not empty");
        let medium = Medium { speed_of_sound_m_s: 343.0 };
        let within =
            BoxMm { least: Vec3::new(-20.0, -20.0, 60.0), most: Vec3::new(20.0, 20.0, 120.0) };
        let planned = [FocusSection::Point(Vec3::new(5.0, 0.0, 100.0))];
        let drives = further_drives(&planned, &array, &medium, 40e3, &within);
        assert_eq!(drives.len(), 10);
        assert!((0..10).all(|n| !drives[..n].contains(&drives[n])));
        let focused =
            Excitation::Focus(Vec3::new(5e-3, 0.0, 0.1)).phases_rad(&array, &medium, 40e3);
        let FocusSection::Phases(right) = &drives[4] else { panic!("{drives:?}") };
        for ((element, phase), focused) in array.elements().iter().zip(right).zip(focused) {
            let turned = (phase - focused).cos();
            assert!((turned + element.centre_m.x.signum()).abs() < 1e-6, "{turned}");
        }
        // A drive that the plan has already is not added.
        let planned = [planned[0].clone(), FocusSection::AllZero];
        assert_eq!(further_drives(&planned, &array, &medium, 40e3, &within).len(), 9);
        for drive in &drives {
            let FocusSection::Point(at_mm) = drive else { continue };
            assert!(at_mm.x.abs() <= 10.0 && (75.0..=105.0).contains(&at_mm.z), "{at_mm}");
        }
    }
}
