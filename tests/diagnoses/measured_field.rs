//! A measured field with unlabelled errors (a mirrored axis, a shifted origin, an inexact step) that the registration
//! must find.
//!
//! The field is not part of the project; the test looks for it in `$FIELDGAP_SHARED`, else beside the project in
//! `../shared`, and reports if it is missing.

use std::io::Write;
use std::path::PathBuf;

use fieldgap::comparison::{Comparison, Mirror, Registering, compare};
use fieldgap::records::RecordedScan;

fn measured(name: &str) -> Option<RecordedScan> {
    let shared = std::env::var_os("FIELDGAP_SHARED").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")),
        PathBuf::from,
    );
    let folder = shared.join("real").join(name);
    if !folder.is_dir() {
        let _ = writeln!(std::io::stderr(), "skipped: no measured field at {}", folder.display());
        return None;
    }
    Some(RecordedScan::open(&folder).expect("a recorded scan"))
}

fn within(value: f64, expected: f64, tolerance: f64) -> bool {
    (value - expected).abs() <= tolerance
}

#[test]
fn the_pose_of_a_measured_field_and_its_undetermined_parameters_are_found() {
    let Some(scan) = measured("heightmod-a") else { return };
    let found: Comparison =
        compare(&scan, scan.setup.simulator, Registering::Auto).expect("a field to compare");
    let registration = &found.registration;
    assert_eq!(registration.chosen, Registering::Pose, "{}", registration.why);
    assert_eq!(registration.mirror, Mirror::Y);
    assert!(registration.turn_rad.value.abs() < 0.02);
    assert!(within(registration.shift_m[0].value, 8.6e-3, 1e-3));
    assert!(within(registration.shift_m[1].value, 5.8e-3, 1e-3));
    assert!(within(registration.step_ratio.value, 1.41 / 1.378, 0.01));

    // One gain for all angles, with the pistons of the record, reaches no more than 0.907 and 0.266, whatever the pose; a
    // receiver with a face like that of the elements explains the rest.
    let one_gain = registration.tried.last().expect("the pose was tried");
    assert_eq!(one_gain.registering, Registering::Pose);
    assert!(one_gain.correlation > 0.905 && one_gain.residual_rms_ratio < 0.267, "{one_gain:?}");
    let face = registration.receiver_face_m.expect("the gain falls off with the angle");
    assert!(within(face.value, 4.5e-3, 0.5e-3), "{face:?}");
    assert!(found.overall.correlation >= 0.93, "{:?}", found.overall);
    assert!(found.overall.residual_rms_ratio <= 0.24, "{:?}", found.overall);

    let left_open = &registration.undetermined[0];
    for parameter in ["shift_z", "step_ratio", "array_pitch"] {
        assert!(left_open.parameters.iter().any(|name| name == parameter), "{left_open:?}");
    }
}
