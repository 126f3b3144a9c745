//! A measured plane: 256 elements at different heights, driven alike, whose readings nobody explained for us.
//!
//! The record is not part of the project; the test looks for it in `$FIELDGAP_SHARED`, else beside the project in `../shared`, and reports
//! if it is missing.

use std::io::Write;
use std::path::PathBuf;

use fieldgap_acoustics::{Excitation, Simulation};
use fieldgap_calibration::CodedReadings;
use fieldgap_calibration::plane::calibrate_planes;
use fieldgap_comparison::{Mirror, Registering, register_scan};
use fieldgap_records::RecordedScan;

fn measured() -> Option<RecordedScan> {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared"));
    let shared = std::env::var_os("FIELDGAP_SHARED").map_or_else(beside, PathBuf::from);
    let folder = shared.join("real/heightmod-a");
    if !folder.is_dir() {
        let _ = writeln!(std::io::stderr(), "skipped: no measured plane at {}", folder.display());
        return None;
    }
    Some(RecordedScan::open(&folder).expect("a recorded scan"))
}

#[test]
fn elements_pose_and_backlash_of_a_measured_plane_explain_blocks_that_the_fit_did_not_see() {
    let Some(mut scan) = measured() else { return };
    let setup = scan.setup.clone();
    let simulation = Simulation {
        simulator: setup.simulator,
        array: setup.array.uncalibrated().clone(),
        medium: setup.medium.medium(),
        frequency_hz: setup.array.frequency_hz(),
        excitation: Excitation::Uniform,
    };
    let registration =
        register_scan(&scan, setup.simulator, Registering::Auto).expect("comparable");
    // Every second column: half of the time.
    let column = |x_mm: f64| ((x_mm + 84.7441) / 1.377_953).round() as i64;
    scan.samples.retain(|sample| column(sample.position_mm.x) % 2 == 0);
    let readings = CodedReadings::of(&scan);
    let found = calibrate_planes(&simulation, &readings, &registration).expect("enough");
    assert_eq!(found.mirror, Mirror::Y);
    assert!(found.residual < 0.045, "{}", found.residual);
    // Rows scanned to the right and to the left lie a third of a millimetre apart.
    let backlash = found.shared("backlash_along_mm").expect("a serpentine");
    assert!((backlash.value + 0.33).abs() < 0.06, "{backlash:?}");
    let floor = found.shared("floor").expect("always there");
    assert!((floor.value - 0.11).abs() < 0.03, "{floor:?}");
    let [small, large] = found.held_out[..] else { panic!("{:?}", found.held_out) };
    assert!(small.points == 6 && small.residual < 0.07, "{small:?}");
    assert!(large.points == 12 && large.residual < 0.11 && large.before > 0.15, "{large:?}");
}
