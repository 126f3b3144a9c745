use proptest::prelude::*;

use super::*;
use fieldgap_acoustics::Vec3;

fn sample(x_mm: f64, y_mm: f64, reading: f64) -> RecordedSample {
    let position_mm = Vec3::new(x_mm, y_mm, 100.0);
    RecordedSample {
        time_s: 0.0,
        focus: Some(0),
        position_mm,
        reading,
        phase_rad: None,
        spread: None,
    }
}

fn map_of(samples: &[RecordedSample]) -> Result<MappedPlane, NotAGrid> {
    let plane = Plane { focus: 0, z_mm: 100.0, samples: samples.iter().collect() };
    plane_map(&plane, OFF_LINE_MM)
}

/// A grid of 8 x 6 points, 2 mm by 3 mm, with readings that tell where they were taken.
fn grid() -> Vec<RecordedSample> {
    (0..6)
        .flat_map(|row| (0..8).map(move |column| (f64::from(column), f64::from(row))))
        .map(|(column, row)| sample(-7.0 + 2.0 * column, 3.0 * row, 10.0 * row + column))
        .collect()
}

#[test]
fn a_grid_becomes_a_map() {
    let mapped = map_of(&grid()).expect("a grid");
    assert_eq!(mapped.step_mm, [2.0, 3.0]);
    assert_eq!((mapped.map.x_m().len(), mapped.map.y_m().len()), (8, 6));
    assert!((mapped.map.x_m()[0] + 0.007).abs() < 1e-15);
    assert!((mapped.map.y_m()[5] - 0.015).abs() < 1e-15);
    assert_eq!(mapped.map.at(3, 4), Some(43.0));
    assert_eq!(mapped.off_grid, 0);
}

#[test]
fn repeats_are_averaged_and_gaps_are_not_a_number() {
    let mut samples = grid();
    samples.push(sample(-7.0, 0.0, 4.0));
    // The whole column at x = -3 mm, and one point more.
    samples.retain(|sample| sample.position_mm.x != -3.0);
    samples.retain(|sample| sample.reading != 57.0);
    let mapped = map_of(&samples).expect("still a grid");
    assert_eq!(mapped.map.at(0, 0), Some(2.0));
    assert_eq!(mapped.map.at(2, 1), None);
    assert_eq!(mapped.map.at(7, 5), None);
    assert_eq!(mapped.map.values().iter().filter(|value| value.is_nan()).count(), 7);
}

#[test]
fn a_point_revisited_between_the_lines_is_left_out_and_counted() {
    let mut samples = grid();
    samples.extend([sample(0.5, 4.4, 99.0); 3]);
    let mapped = map_of(&samples).expect("a grid and a revisited point");
    assert_eq!(mapped.off_grid, 3);
    assert_eq!(mapped.map.x_m().len(), 8);
    assert!(!mapped.map.values().contains(&99.0));
}

#[test]
fn what_is_no_grid_says_why() {
    let line: Vec<RecordedSample> = (0..9).map(|n| sample(f64::from(n), 0.0, 1.0)).collect();
    assert_eq!(map_of(&line), Err(NotAGrid::TooFewLines { columns: 0, rows: 1 }));

    let mut irregular = grid();
    for sample in &mut irregular {
        if sample.position_mm.x == 5.0 {
            sample.position_mm.x = 5.7;
        }
    }
    let reason = map_of(&irregular).expect_err("a column off its step");
    assert!(matches!(reason, NotAGrid::Irregular { axis: 'x', .. }), "{reason}");

    let mut scattered = grid();
    scattered
        .extend((0..9).map(|n| sample(0.1 + 1.3 * f64::from(n), 0.5 + 1.7 * f64::from(n), 1.0)));
    let reason = map_of(&scattered).expect_err("too many between the lines");
    assert_eq!(reason, NotAGrid::Scattered { off_grid: 9, samples: 57 });

    let far = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1e9, 0.0), (1e9, 1.0)];
    let reason = map_of(&far.map(|(x_mm, y_mm)| sample(x_mm, y_mm, 1.0))).expect_err("far apart");
    assert!(matches!(reason, NotAGrid::Sparse { measured: 6, rows: 2, .. }), "{reason}");
}

proptest! {
    #[test]
    fn the_grid_is_found_in_any_order_and_through_the_robots_jitter(
        columns in 3usize..12, rows in 3usize..12,
        step_mm in 1.0..5.0f64, corner_mm in -50.0..50.0f64,
        jitters in prop::collection::vec((-0.04..0.04f64, -0.04..0.04f64), 144),
        turn in 0usize..144,
    ) {
        let mut samples: Vec<RecordedSample> = (0..columns * rows).map(|n| {
            let (column, row) = ((n % columns) as f64, (n / columns) as f64);
            let (jitter_x, jitter_y) = jitters[n];
            sample(corner_mm + step_mm * column + jitter_x, step_mm * row + jitter_y, n as f64)
        }).collect();
        samples.rotate_left(turn % (columns * rows));
        let mapped = map_of(&samples).expect("a grid");
        let expected: Vec<f64> = (0..columns * rows).map(|n| n as f64).collect();
        prop_assert_eq!(mapped.map.values(), &expected[..]);
        prop_assert!((mapped.step_mm[0] - step_mm).abs() < 0.08 / (columns - 1) as f64);
    }

    #[test]
    fn any_points_are_mapped_or_refused(points in prop::collection::vec((-3i32..4, -3i32..4), 1..40)) {
        let samples: Vec<RecordedSample> =
            points.iter().map(|&(x, y)| sample(f64::from(x), f64::from(y), 1.0)).collect();
        if let Ok(mapped) = map_of(&samples) {
            let on_map = mapped.map.values().iter().filter(|value| !value.is_nan()).count();
            prop_assert!(on_map + mapped.off_grid <= samples.len());
        }
    }
}
