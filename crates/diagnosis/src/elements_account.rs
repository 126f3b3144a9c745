//! What each element of an array emits, as an account of dense planes that no set of effects explains.
//!
//! The effects of the catalogue have few numbers each. A plane of thousands of readings of a large array tells hundreds: gain, phase, place and lean of
//! each element. The calibration fits them, all readings together. So many numbers follow readings beside those that they were fitted to, whether or
//! not they are true; blocks of two wavelengths and more that a fit did not see show what they understand.

use fieldgap_acoustics::{Excitation, Simulation, Simulator};
use fieldgap_calibration::CodedReadings;
use fieldgap_calibration::plane::{Group, PlaneCalibration, account_for_planes};
use fieldgap_comparison::Registration;
use fieldgap_records::RecordedScan;

use crate::limits::{LEAST_BY_ELEMENTS, LEAST_FOR_ELEMENTS};
use crate::result::{ElementFault, ElementsAccount, ElementsSpread};

/// The account of a scan without a calibration of its own; `None` where it has too few readings for each element, or planes too narrow for wide
/// blocks. `noise` is that of a reading, relative to the rms of the scan.
pub(crate) fn account(
    scan: &RecordedScan,
    simulator: Simulator,
    registration: &Registration,
    noise: f64,
) -> Option<ElementsAccount> {
    let setup = &scan.setup;
    if setup.array.calibration_file().is_some() {
        return None;
    }
    let readings = CodedReadings::of(scan);
    if readings.is_coded() {
        return None;
    }
    let simulation = Simulation {
        simulator,
        array: setup.array.array().clone(),
        medium: setup.medium.medium(),
        frequency_hz: setup.array.frequency_hz(),
        excitation: Excitation::Uniform,
    };
    // What cannot be fitted is no account.
    let found = account_for_planes(&simulation, &readings, registration).ok()??;
    of_calibration(&found, noise)
}

fn of_calibration(found: &PlaneCalibration, noise: f64) -> Option<ElementsAccount> {
    let blocks = found.held_out.first()?;
    let beyond_noise = |gap: f64| (gap * gap - noise * noise).max(0.0);
    let explained = |before: f64| match beyond_noise(before) {
        zero if zero <= 0.0 => 0.0,
        before => (1.0 - beyond_noise(blocks.residual) / before).clamp(0.0, 1.0),
    };
    let spread = |group: Group| {
        let of_group = found.groups.iter().find(|of| of.group == group && of.is_kept);
        of_group.map_or(0.0, |of| of.spread)
    };
    let explained_by_elements = explained(blocks.alike);
    let faults = found.faults().map(|(element, channel)| ElementFault {
        element,
        state: channel.state.to_string(),
        gain: channel.gain,
    });
    Some(ElementsAccount {
        readings: found.used,
        elements: found.channels.len(),
        block_mm: (10.0 * blocks.width_mm).round() / 10.0,
        block_wavelengths: blocks.wavelengths,
        gap_before_held_out: blocks.before,
        gap_alike_held_out: blocks.alike,
        gap_after_held_out: blocks.residual,
        expected_held_out: blocks.expected,
        gap_after: found.residual,
        explained_fraction: explained(blocks.before),
        explained_by_elements,
        is_borne_out: blocks.alike.powi(2) > LEAST_FOR_ELEMENTS * noise * noise
            && explained_by_elements > LEAST_BY_ELEMENTS,
        spread: ElementsSpread {
            gain: spread(Group::Gain),
            phase_rad: spread(Group::Phase),
            place_mm: spread(Group::Place),
            lean: spread(Group::Lean),
        },
        backlash_mm: found.shared("backlash_along_mm").map(|number| number.value.abs()),
        faults: faults.collect(),
        undetermined: found.ambiguities.clone(),
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fieldgap_acoustics::{Array, Element, Vec3};
    use fieldgap_comparison::{Registering, register_scan};
    use fieldgap_input::TomlSource;
    use fieldgap_records::{RecordedSample, ScanSetup};
    use fieldgap_virtual_rig::counter_rng::CounterRng;
    use fieldgap_virtual_rig::{Visit, noise_free_readings};

    use super::*;

    const NOISE: f64 = 0.02;

    fn setup() -> ScanSetup {
        let text = "format = 1\nname = \"plane\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n[array]\nfrequency_hz = 40000.0\n\
             layout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n[medium]\n\
             speed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n[[focus]]\nphases = \"all-zero\"\n";
        let source = TomlSource::new(Path::new("scan.toml"), text.to_owned());
        ScanSetup::parse(&source).expect("a set-up")
    }

    /// A plane of vibrating faces beside their places, gains and phases by so many spreads of 8 %, 0.15 rad and 0.3 mm.
    fn account_of(spreads: f64, causes: &str, points: usize) -> Option<ElementsAccount> {
        let setup = setup();
        let rng = CounterRng::new(11);
        let draw = |n: usize, part: u64| spreads * rng.normal(8 * n as u64 + part);
        let believed = setup.array.array().elements().iter().enumerate();
        let elements = believed.map(|(n, element)| Element {
            amplitude: 1.0 + 0.08 * draw(n, 0),
            phase_rad: 0.15 * draw(n, 1),
            centre_m: element.centre_m + 3e-4 * Vec3::new(draw(n, 2), draw(n, 3), 0.0),
            ..*element
        });
        let truth = Simulation {
            array: Array::from_elements(elements.collect()).expect("elements"),
            ..setup.simulation(setup.simulator, 0).expect("a drive")
        };
        let visit = |n: usize| {
            let (column, row) = (n % points, n / points);
            let back = !row.is_multiple_of(2);
            let column = if back { points - 1 - column } else { column };
            let along = |n: usize| 2e-3 * (n as f64 - 0.5 * (points as f64 - 1.0));
            Visit {
                position_m: Vec3::new(along(column), along(row), 0.08),
                velocity_m_s: Vec3::zeros(),
                time_s: 0.1 * n as f64,
            }
        };
        let visits: Vec<Visit> = (0..points * points).map(visit).collect();
        let causes = causes.parse().expect("TOML");
        let levels = noise_free_readings(&truth, &causes, 1.0, &visits, 1).expect("valid");
        let rms = (levels.iter().map(|a| a * a).sum::<f64>() / levels.len() as f64).sqrt();
        let samples = visits.iter().zip(levels).enumerate().map(|(n, (visit, level))| {
            let reading = (level + NOISE * rms * rng.normal(1000 + n as u64)).abs();
            RecordedSample::measured(visit.time_s, Some(0), visit.position_m, reading, None)
        });
        let scan = RecordedScan { samples: samples.collect(), setup };
        let simulator = scan.setup.simulator;
        let registration = register_scan(&scan, simulator, Registering::Auto).expect("comparable");
        account(&scan, simulator, &registration, NOISE)
    }

    #[test]
    fn elements_that_differ_are_borne_out_by_blocks_that_the_fit_did_not_see() {
        let found = account_of(1.0, "", 48).expect("dense and wide");
        assert!(found.is_borne_out, "{found:?}");
        assert!(found.explained_fraction > 0.9 && found.explained_by_elements > 0.9, "{found:?}");
        assert!(found.gap_after < 1.2 * NOISE, "{found:?}");
        assert!((found.spread.gain / 0.08 - 1.0).abs() < 0.4, "{found:?}");
        assert!((found.spread.phase_rad / 0.15 - 1.0).abs() < 0.4, "{found:?}");
        assert!(found.block_mm == 24.0 && found.faults.is_empty(), "{found:?}");
    }

    /// The fit gives sound elements gains and phases all the same, with evidence for both.
    #[test]
    fn causes_beside_sound_elements_are_not_told_as_departures_of_elements() {
        let reflection = "[reflection]\nheight_mm = 300.0\ncoefficient = [0.2, 0.0]\n";
        let wall =
            "[wall]\nnormal = [1.0, 0.0, 0.0]\ndistance_mm = 90.0\ncoefficient = [0.5, 0.0]\n";
        let object = "[scatterer]\nx_mm = 20.0\ny_mm = 10.0\nz_mm = 45.0\nradius_mm = 5.0\n";
        let crosstalk = "[crosstalk]\ncoefficient = [0.15, 0.1]\n";
        for cause in [reflection, wall, object, crosstalk] {
            let found = account_of(0.0, cause, 48).expect("dense and wide");
            assert!(!found.is_borne_out, "{cause}: {found:?}");
        }
        assert!(account_of(0.0, reflection, 48).expect("the same").spread.gain > 0.03);
    }

    #[test]
    fn too_narrow_planes_have_no_account() {
        assert_eq!(account_of(1.0, "", 30), None);
    }
}
