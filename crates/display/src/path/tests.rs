//! Paths compared with their geometry.

use std::path::Path as FilePath;

use proptest::prelude::*;

use super::*;
use fieldgap_input::{Fault, toml_text};

#[derive(Debug, Deserialize)]
struct File {
    path: Path,
}

fn path(text: &str) -> Result<Path, Fault> {
    toml_text::<File>(FilePath::new("display.toml"), text).map(|file| file.path)
}

fn legs(path: &Path) -> Vec<Leg> {
    match path.geometry() {
        PathGeometry::Legs(legs) => legs,
        other => panic!("no legs: {other:?}"),
    }
}

proptest! {
    #[test]
    fn circles_have_constant_radius_and_are_normal_to_their_normal(
        x in -30.0..30.0f64, z in 60.0..150.0f64, radius in 1.0..40.0f64,
        normal in prop::array::uniform3(-1.0..1.0f64), share in 0.0..1.0f64,
    ) {
        prop_assume!(Vec3::from(normal).norm() > 1e-3);
        let circle = path(&format!(
            "path.circle = {{ centre_mm = [{x}, 5.0, {z}], radius_mm = {radius}, normal = {normal:?} }}"
        )).expect("valid");
        let from_centre = legs(&circle)[0].at(share) - Vec3::new(x, 5.0, z) * 1e-3;
        prop_assert!((from_centre.norm() - radius * 1e-3).abs() < 1e-12);
        prop_assert!(from_centre.dot(&Vec3::from(normal)).abs() < 1e-12);
        prop_assert!((circle.length_m() - std::f64::consts::TAU * radius * 1e-3).abs() < 1e-12);
    }

    #[test]
    fn figures_of_eight_are_traced_at_constant_speed(
        width in 5.0..60.0f64, along in prop::array::uniform3(-1.0..1.0f64), from in 0.0..0.99f64,
    ) {
        prop_assume!(Vec3::from(along).xy().norm() > 1e-3);
        let eight = path(&format!(
            "path.figure-of-eight = {{ centre_mm = [0.0, 0.0, 100.0], width_mm = {width}, along = {along:?} }}"
        )).expect("valid");
        // The lemniscate's length is 2 ϖ a, ϖ = 2.622057554292 the lemniscate constant.
        let length_m = 2.0 * 2.622_057_554_292 * 0.5e-3 * width;
        prop_assert!((eight.length_m() / length_m - 1.0).abs() < 1e-6, "{}", eight.length_m() / length_m);
        let leg = &legs(&eight)[0];
        let step = 1e-3;
        let chord_m = (leg.at(from + step) - leg.at(from)).norm();
        prop_assert!((chord_m / (step * length_m) - 1.0).abs() < 1e-3, "{}", chord_m / (step * length_m));
        prop_assert!((leg.at(0.0) - leg.at(1.0)).norm() < 1e-12);
        // (x² + y²)² = a² (x² - y²), in the axes of the lemniscate.
        let at = leg.at(from) - Vec3::new(0.0, 0.0, 0.1);
        let axis = Vec3::new(along[0], along[1], 0.0).normalize();
        let (u, v) = (at.dot(&axis), at.dot(&Vec3::z().cross(&axis)));
        let half = 0.5e-3 * width;
        prop_assert!(((u * u + v * v).powi(2) - half * half * (u * u - v * v)).abs() < 1e-5 * half.powi(4));
    }

    #[test]
    fn polygons_are_closed(corners in prop::collection::vec(prop::array::uniform3(-40.0..40.0f64), 3..8)) {
        let corners: Vec<_> = corners.iter().map(|[x, y, z]| [*x, *y, z + 100.0]).collect();
        let polygon = path(&format!("path.polygon.corners_mm = {corners:?}")).expect("valid");
        let legs = legs(&polygon);
        prop_assert_eq!(legs.len(), corners.len());
        for (n, leg) in legs.iter().enumerate() {
            let next = &legs[(n + 1) % legs.len()];
            prop_assert!((leg.at(1.0) - next.at(0.0)).norm() < 1e-12);
        }
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in "path(\\.[a-z-]{0,15})? = [-\\[\\]{}a-z_0-9., =\"]{0,60}") {
        let _ = path(&text);
    }
}

#[test]
fn a_line_is_traversed_in_both_directions() {
    let line = path("path.line = { from_mm = [0, 0, 100], to_mm = [30, 0, 100] }").expect("valid");
    assert!((line.length_m() - 0.06).abs() < 1e-12);
    assert_eq!(legs(&line)[1].at(1.0), Vec3::new(0.0, 0.0, 0.1));
}

#[test]
fn wrong_paths_are_refused_with_the_reason() {
    let refusals: Vec<String> = [
        "path.point_mm = [0.0, 0.0, -5.0]",
        "path.line = { from_mm = [0, 0, 100], to_mm = [0, 0, 100] }",
        "path.circle = { centre_mm = [0, 0, 100], radius_mm = 0 }",
        "path.circle = { centre_mm = [0, 0, 100], radius_mm = 3, normal = [0, 0, 0] }",
        "path.polygon.corners_mm = [[0, 0, 100], [1, 0, 100]]",
        "path.polygon.corners_mm = [[0, 0, 100], [1, 0, 100], [0, 0, 100]]",
        "path.points_mm = [[0, 0, 100]]",
        "path.spiral = 3",
    ]
    .iter()
    .map(|text| path(text).expect_err(text).to_string())
    .collect();
    insta::assert_snapshot!(refusals.join("\n"));
}
