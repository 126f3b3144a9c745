//! What the receiver's converter sees.

use nalgebra::Vector3;

use super::super::clock::Pace;
use super::super::planner::PlannedMove;
use super::super::testing;
use super::*;

fn laboratory(truth: &str) -> (Arc<World>, Arc<Mutex<Trajectory>>) {
    testing::world(truth, Pace::Lockstep)
}

fn on(duty: f64) -> Drive {
    Drive { emitting: true, duty, ..Drive::silent(36) }
}

const QUIET: &str = "";
const NOISY: &str = "[noise]\nmultiplicative = 0.01\nadditive_v = 0.02\n";

#[test]
fn the_array_is_silent_until_it_is_driven_and_after_it_is_switched_off() {
    let (world, _) = laboratory(QUIET);
    assert_eq!(world.reading_v(0.5, 0), 0.0);
    world.drive(1.0, on(1.0));
    world.drive(2.0, Drive::silent(36));
    assert!(world.reading_v(1.5, 0) > 0.1);
    assert_eq!(world.reading_v(2.5, 0), 0.0);
}

#[test]
fn modulation_scales_by_its_duty() {
    let (world, _) = laboratory(QUIET);
    world.drive(0.0, on(1.0));
    world.drive(1.0, on(0.5));
    assert!((world.reading_v(1.5, 0) / world.reading_v(0.5, 0) - 0.5).abs() < 1e-12);
}

/// An element is small beside the distance, so that far on the axis the array is a ring of points at every radius.
#[test]
fn the_phase_is_that_of_waves_that_left_the_elements_together() {
    let phasor_at = |z_m: f64| {
        let (world, trajectory) = laboratory("");
        world.drive(0.0, on(1.0));
        let from_mm = Vector3::new(150.0, 150.0, 80.0);
        let to_mm = Vector3::new(150.0, 150.0, z_m * 1e3 - 20.0);
        let planned = PlannedMove::new(from_mm, to_mm, 1000.0, 50.0, 0.0);
        lock(&trajectory).push(planned);
        world.synchronous_v(planned.ends_s() + 0.1, 0)
    };
    let k = std::f64::consts::TAU * 40e3 / 343.0;
    let points: Vec<f64> = (0..36)
        .map(|n| [n % 6, n / 6].map(|m| (f64::from(m) - 2.5) * 10.5e-3))
        .map(|[x, y]| x * x + y * y)
        .collect();
    let expected = |z_m: f64| -> Complex64 {
        let wave = |square: &f64| {
            let d = (square + z_m * z_m).sqrt();
            Complex64::from_polar(1.0 / d, k * d)
        };
        points.iter().map(wave).sum()
    };
    for (low_m, high_m) in [(0.150, 0.151), (0.18, 0.21)] {
        let seen = phasor_at(high_m) / phasor_at(low_m);
        let wanted = expected(high_m) / expected(low_m);
        assert!((seen / wanted).arg().abs() < 0.02, "{seen} {wanted}");
    }
}

#[test]
fn the_phase_of_the_clock_drifts_and_each_sample_has_phase_noise() {
    let truth = "[phase]\noffset_rad = -1.0\ndrift_rad_h = 0.36\nnoise_rad = 0.05\n";
    let [(plain, _), (noisy, _)] = [QUIET, truth].map(laboratory);
    plain.drive(0.0, on(1.0));
    noisy.drive(0.0, on(1.0));
    let turns: Vec<f64> = (0..4000)
        .map(|n| (noisy.synchronous_v(1000.0, n) / plain.synchronous_v(1000.0, n)).arg())
        .collect();
    let mean = turns.iter().sum::<f64>() / 4000.0;
    let variance = turns.iter().map(|turn| (turn - mean).powi(2)).sum::<f64>() / 4000.0;
    assert!((mean - (0.1 - 1.0)).abs() < 4.0 * 0.05 / 4000f64.sqrt(), "{mean}");
    assert!((variance.sqrt() / 0.05 - 1.0).abs() < 0.05, "{variance}");
}

#[test]
fn the_reading_is_that_of_where_the_nozzle_is_while_it_moves() {
    let (world, trajectory) = laboratory(QUIET);
    world.drive(0.0, on(1.0));
    let from_mm = Vector3::new(150.0, 150.0, 80.0);
    let to_mm = from_mm + Vector3::new(30.0, 0.0, 0.0);
    let planned = PlannedMove::new(from_mm, to_mm, 1000.0, 50.0, 0.0);
    lock(&trajectory).push(planned);
    let halfway_s = planned.ends_s() / 2.0;
    assert!((world.nozzle_m(halfway_s) - Vec3::new(0.015, 0.0, 0.1)).norm() < 1e-9);
    let (start, halfway) = (world.reading_v(0.0, 0), world.reading_v(halfway_s, 0));
    assert!((start - halfway).abs() > 0.01);
    assert_eq!(world.reading_v(0.0, 0), start, "the past can be asked for again");
}

#[test]
fn a_lag_gives_the_reading_of_a_moment_ago() {
    let (world, trajectory) = laboratory("[effects.lag]\ns = 0.1\n");
    world.drive(0.0, on(1.0));
    let from_mm = Vector3::new(150.0, 150.0, 80.0);
    let to_mm = from_mm + Vector3::new(30.0, 0.0, 0.0);
    lock(&trajectory).push(PlannedMove::new(from_mm, to_mm, 1000.0, 50.0, 0.0));
    let late = world.reading_v(0.4, 0);
    let (prompt, trajectory) = laboratory(QUIET);
    prompt.drive(0.0, on(1.0));
    lock(&trajectory).push(PlannedMove::new(from_mm, to_mm, 1000.0, 50.0, 0.0));
    assert!((late - prompt.reading_v(0.3, 0)).abs() < 1e-12);
}

#[test]
fn jitter_moves_the_nozzle_on_every_approach_and_holds_it_at_rest() {
    let (world, trajectory) =
        laboratory("[effects.position-jitter]\nx_mm = 0.1\ny_mm = 0.1\nz_mm = 0.1\n");
    let here_mm = Vector3::new(150.0, 150.0, 80.0);
    let away_mm = here_mm + Vector3::new(20.0, 0.0, 0.0);
    let there = PlannedMove::new(here_mm, away_mm, 1000.0, 50.0, 1.0);
    let back = PlannedMove::new(away_mm, here_mm, 1000.0, 50.0, there.ends_s());
    lock(&trajectory).push(there);
    lock(&trajectory).push(back);
    let (before_m, after_m) = (world.nozzle_m(0.5), world.nozzle_m(back.ends_s() + 1.0));
    assert_eq!(before_m, world.nozzle_m(0.9));
    assert!((before_m - after_m).norm() > 1e-6);
    for at_m in [before_m, after_m] {
        assert!((at_m - Vec3::new(0.0, 0.0, 0.1)).norm() < 1e-3, "{at_m}");
    }
    assert_eq!(lock(&trajectory).at(0.5).position_mm, here_mm, "the robot reports nothing of it");
}

#[test]
fn noise_has_the_deviation_of_the_truth_file_and_the_same_sample_the_same_noise() {
    let (quiet, _) = laboratory(QUIET);
    let (noisy, _) = laboratory(NOISY);
    quiet.drive(0.0, on(1.0));
    noisy.drive(0.0, on(1.0));
    let level = quiet.reading_v(1.0, 0);
    let n = 20_000;
    let readings: Vec<f64> = (0..n).map(|i| noisy.reading_v(1.0, i)).collect();
    let mean = readings.iter().sum::<f64>() / n as f64;
    let variance = readings.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / n as f64;
    let expected = (0.01 * level).hypot(0.02);
    assert!((mean / level - 1.0).abs() < 2e-3, "{mean} {level}");
    assert!((variance.sqrt() / expected - 1.0).abs() < 0.03, "{} {expected}", variance.sqrt());
    assert_eq!(noisy.reading_v(1.0, 77), readings[77]);
}

#[test]
fn a_silent_field_reads_the_mean_of_rayleighs_distribution() {
    let (world, _) = laboratory(NOISY);
    let n = 20_000;
    let mean = (0..n).map(|i| world.reading_v(0.0, i)).sum::<f64>() / n as f64;
    let expected = 0.02 * std::f64::consts::FRAC_PI_2.sqrt();
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean} {expected}");
}
