//! The solvers where the answer is known.

use proptest::prelude::*;

use super::*;
use crate::transducer::{MurataFit, Piston};
use crate::{Excitation, Medium};

const MEDIUM: Medium = Medium { speed_of_sound_m_s: 343.0 };

fn array() -> Array {
    Array::square(6, 6, 10.5e-3).expect("not empty")
}

fn transfer(points_m: &[Vec3]) -> Transfer {
    Transfer::new(&array(), &Piston, MEDIUM.wavenumber_rad_m(40e3), points_m)
}

fn unit_drives(phases_rad: &[f64]) -> Vec<Complex64> {
    phases_rad.iter().map(|&phase| Complex64::from_polar(1.0, phase)).collect()
}

proptest! {
    #[test]
    fn one_focus_is_the_closed_form_and_reaches_the_sum_of_all_amplitudes(
        x in -0.04..0.04f64, y in -0.04..0.04f64, z in 0.05..0.2f64, solver in prop::sample::select(&Solver::ALL),
    ) {
        let focus = Vec3::new(x, y, z);
        let transfer = transfer(&[focus]);
        let phases = transfer.solve(solver, &[1.0], 10);
        let closed = Excitation::Focus(focus).phases_rad(&array(), &MEDIUM, 40e3);
        // The same up to a phase of all.
        for (ours, theirs) in phases.iter().zip(&closed) {
            let apart = Complex64::from_polar(1.0, (ours - phases[0]) - (theirs - closed[0]));
            prop_assert!(apart.arg().abs() < 1e-9, "{}", apart.arg());
        }
        let pressure = transfer.pressures(&unit_drives(&phases))[0];
        let most: f64 = transfer.matrix.iter().map(|amplitude| amplitude.norm()).sum();
        prop_assert!((pressure - most).norm() < 1e-9 * most, "in phase, at phase 0");
    }

    #[test]
    fn two_mirrored_foci_are_equal(x in 0.008..0.035f64, z in 0.08..0.15f64) {
        // The sum is symmetric. (The iterations may break the symmetry: where an element must choose between the two foci, it is not
        // stable.)
        let transfer = transfer(&[Vec3::new(x, 0.0, z), Vec3::new(-x, 0.0, z)]);
        let drives = unit_drives(&transfer.solve(Solver::Naive, &[1.0, 1.0], 0));
        prop_assert!(transfer.quality(&drives, &[1.0, 1.0]).uniformity > 1.0 - 1e-6);
    }

    #[test]
    fn no_drive_is_better_than_the_bound(phases in prop::collection::vec(-4.0..4.0f64, 36)) {
        let transfer = transfer(&[Vec3::new(0.02, 0.0, 0.1), Vec3::new(-0.01, 0.01, 0.1)]);
        let quality = transfer.quality(&unit_drives(&phases), &[1.0, 1.0]);
        prop_assert!(quality.efficiency <= 1.0 + 1e-12 && (0.0..=1.0).contains(&quality.uniformity));
    }
}

#[test]
fn the_bound_is_reached_by_one_far_focus() {
    // Far away all paths have the same loss, so that full amplitude is also the best drive: the bound is reached.
    let transfer = transfer(&[Vec3::new(0.0, 0.0, 20.0)]);
    let drives = unit_drives(&transfer.solve(Solver::Naive, &[1.0], 0));
    let quality = transfer.quality(&drives, &[1.0]);
    assert!((quality.efficiency - 1.0).abs() < 1e-5, "{quality:?}");
}

#[test]
fn unequal_levels_are_met_in_their_proportion() {
    let places =
        [Vec3::new(0.02, 0.015, 0.1), Vec3::new(-0.02, 0.0, 0.1), Vec3::new(0.01, -0.02, 0.1)];
    let wanted = [1.0, 0.5, 0.8];
    for transducer in [&Piston as &dyn Transducer, &MurataFit::CENTIMETRES] {
        let transfer = Transfer::new(&array(), transducer, MEDIUM.wavenumber_rad_m(40e3), &places);
        let pressures =
            transfer.pressures(&unit_drives(&transfer.solve(Solver::Weighted, &wanted, 200)));
        let scale = pressures[0].norm();
        for (pressure, wanted) in pressures.iter().zip(wanted) {
            assert!((pressure.norm() / scale - wanted).abs() < 0.01, "{pressures:?}");
        }
    }
}

#[test]
fn a_point_that_no_element_reaches_gives_finite_phases() {
    let transfer = transfer(&[Vec3::new(0.0, 0.0, -0.05), Vec3::new(0.0, 0.0, 0.1)]);
    for solver in Solver::ALL {
        assert!(transfer.solve(solver, &[1.0, 1.0], 5).iter().all(|phase| phase.is_finite()));
    }
}
