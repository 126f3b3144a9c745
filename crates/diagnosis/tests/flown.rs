//! Scans that a robot flies, as it makes them: trapezoids of velocity, run-ups, play as a hysteresis of the nozzle, and readings that are
//! those of a moment ago. The motion is followed in small steps of time and shares nothing with the diagnosis; the field is that of the
//! virtual rig's vibrating pistons. The record holds what a robot reports: the motor's places and the times.

use std::path::Path;

use fieldgap_acoustics::{Simulation, Vec3};
use fieldgap_diagnosis::{Diagnosis, EffectId, FittedParameter, Verdict, diagnose};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_readings};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Proportional noise of a reading, and each quadrature's over the largest reading.
const NOISE: (f64, f64) = (0.012, 0.003);

/// Acceleration of the robot, m/s².
const ACCELERATION_M_S2: f64 = 1.0;

/// Step of time in which the motion is followed, s.
const INSTANT_S: f64 = 5e-4;

/// Speed between rows, m/s.
const TRAVEL_M_S: f64 = 0.08;

/// Half the side of a plane, and its step, m.
const HALF_M: f64 = 0.021;
const STEP_M: f64 = 1.5e-3;

/// What reads while a row is flown.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Trigger {
    /// At even places.
    Place,
    /// At even times, the ramps included, so that there is no run-up.
    Time,
}

struct Flight {
    lag_s: f64,
    play_m: f64,
    raster: bool,
    along_y: bool,
    /// One for each plane, m/s.
    speeds_m_s: Vec<f64>,
    trigger: Trigger,
    /// Standard deviation of a reported place along each axis, m.
    off_m: f64,
    /// Whether the last rows of each plane are flown twice.
    repeats: bool,
    seed: u64,
}

impl Flight {
    fn new(lag_s: f64, play_m: f64, speeds_m_s: &[f64], seed: u64) -> Self {
        Self {
            lag_s,
            play_m,
            raster: false,
            along_y: false,
            speeds_m_s: speeds_m_s.to_vec(),
            trigger: Trigger::Place,
            off_m: 0.0,
            repeats: true,
            seed,
        }
    }

    fn flown(&self) -> RecordedScan {
        let mut robot = Robot::at(Vec3::new(0.0, 0.0, 0.15), self.play_m);
        let turned = |along: f64, across: f64, z_m: f64| match self.along_y {
            true => Vec3::new(across, along, z_m),
            false => Vec3::new(along, across, z_m),
        };
        let rows = (2.0 * HALF_M / STEP_M).round() as usize + 1;
        let mut triggers: Vec<(f64, Vec3)> = Vec::new();
        let planes = [0.085, 0.115].into_iter().zip(self.speeds_m_s.iter().cycle());
        for (z_m, &speed_m_s) in planes {
            let again = if self.repeats { rows - 3..rows } else { 0..0 };
            for row in (0..rows).chain(again) {
                let back = row % 2 == 1 && !self.raster;
                let forth = if back { -1.0 } else { 1.0 };
                let across = STEP_M * row as f64 - HALF_M;
                let at = |along: f64| turned(forth * along, across, z_m);
                let lead_m = match self.trigger {
                    Trigger::Place => 1.2 * speed_m_s * speed_m_s / 2.0 / ACCELERATION_M_S2 + 2e-3,
                    Trigger::Time => 0.0,
                };
                robot.move_to(at(-HALF_M - lead_m), TRAVEL_M_S);
                robot.wait(0.12);
                let began = robot.path.len() - 1;
                robot.move_to(at(HALF_M + lead_m), speed_m_s);
                match self.trigger {
                    Trigger::Place => {
                        for n in 0..rows {
                            let along_m = STEP_M * n as f64 - HALF_M;
                            triggers.push((robot.when_at(at(along_m), began), at(along_m)));
                        }
                    }
                    Trigger::Time => {
                        let each = (STEP_M / speed_m_s / INSTANT_S) as usize;
                        let on_the_way = (began..robot.path.len()).step_by(each);
                        triggers
                            .extend(on_the_way.map(|n| (INSTANT_S * n as f64, robot.path[n].0)));
                    }
                }
                robot.wait(0.08);
            }
        }
        self.record(&robot, &triggers)
    }

    fn record(&self, robot: &Robot, triggers: &[(f64, Vec3)]) -> RecordedScan {
        let visits: Vec<Visit> = triggers
            .iter()
            .map(|&(time_s, _)| Visit {
                position_m: robot.nozzle_at(time_s - self.lag_s),
                velocity_m_s: Vec3::zeros(),
                time_s,
            })
            .collect();
        let setup = setup();
        let simulation: Simulation = setup.simulation(setup.simulator, 0).expect("focus 0");
        let field = noise_free_readings(&simulation, &toml::Table::new(), 0.05, &visits, self.seed)
            .expect("no effects");
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let additive = NOISE.1 * field.iter().fold(0.0f64, |most, level| most.max(*level));
        let mut samples = Vec::new();
        for n in 0..48 {
            let reading = (additive * normal()).hypot(additive * normal());
            let time_s = 0.1 * f64::from(n) - 8.0;
            samples.push(RecordedSample::measured(time_s, None, Vec3::z() * 0.15, reading, None));
        }
        for (&(time_s, at_m), level) in triggers.iter().zip(field) {
            let (re, im) = (level + additive * normal(), additive * normal());
            let reading = (re.hypot(im) * (1.0 + NOISE.0 * normal())).max(0.0);
            let off_m = Vec3::new(normal(), normal(), 0.0) * self.off_m;
            samples.push(RecordedSample::measured(time_s, Some(0), at_m + off_m, reading, None));
        }
        RecordedScan { setup, samples }
    }
}

fn setup() -> ScanSetup {
    let text = "format = 1\nname = \"flown\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
        [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
        [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
        [[focus]]\nx_mm = 4.0\ny_mm = -5.0\nz_mm = 100.0\n";
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text.to_owned())).expect("a set-up")
}

/// A robot whose motors move along straight lines, followed instant by instant.
struct Robot {
    /// Play along x, m.
    play_m: f64,
    /// Place of the motors at each instant, m, and x of the nozzle, which they drag along.
    path: Vec<(Vec3, f64)>,
}

impl Robot {
    fn at(motors_m: Vec3, play_m: f64) -> Self {
        Self { play_m, path: vec![(motors_m, motors_m.x)] }
    }

    fn motors_m(&self) -> Vec3 {
        self.path[self.path.len() - 1].0
    }

    fn step(&mut self, motors_m: Vec3) {
        let (_, nozzle_x_m) = self.path[self.path.len() - 1];
        let free_m = 0.5 * self.play_m;
        self.path.push((motors_m, nozzle_x_m.clamp(motors_m.x - free_m, motors_m.x + free_m)));
    }

    fn wait(&mut self, time_s: f64) {
        let motors_m = self.motors_m();
        (0..(time_s / INSTANT_S) as usize).for_each(|_| self.step(motors_m));
    }

    /// Speeds up at constant acceleration, goes at constant speed, and brakes.
    fn move_to(&mut self, to_m: Vec3, speed_m_s: f64) {
        let from_m = self.motors_m();
        let way_m = (to_m - from_m).norm();
        let (mut gone_m, mut now_m_s) = (0.0, 0.0f64);
        while way_m - gone_m > 1e-6 {
            let stops_from_m_s = (2.0 * ACCELERATION_M_S2 * (way_m - gone_m)).sqrt();
            now_m_s = (now_m_s + ACCELERATION_M_S2 * INSTANT_S).min(speed_m_s).min(stops_from_m_s);
            gone_m += now_m_s * INSTANT_S;
            self.step(from_m + (to_m - from_m) * (gone_m / way_m).min(1.0));
        }
        self.step(to_m);
    }

    /// When the motors were at a place on their way since an instant.
    fn when_at(&self, place_m: Vec3, since: usize) -> f64 {
        let along = (self.motors_m() - self.path[since].0).normalize();
        let still_m = |n: usize| (place_m - self.path[n].0).dot(&along);
        let n = (since + 1..self.path.len()).find(|&n| still_m(n) <= 0.0).expect("on the way");
        INSTANT_S * (n as f64 + still_m(n) / (still_m(n - 1) - still_m(n)))
    }

    fn nozzle_at(&self, time_s: f64) -> Vec3 {
        let instant = (time_s / INSTANT_S).max(0.0);
        let (n, share) = (instant as usize, instant.fract());
        let [one, next] = [n, n + 1].map(|n| {
            let (motors_m, x_m) = self.path[n.min(self.path.len() - 1)];
            Vec3::new(x_m, motors_m.y, motors_m.z)
        });
        one + (next - one) * share
    }
}

/// The set of one effect, and the value and standard error of its parameter, where it is named or among the rivals.
fn parameter(found: &Diagnosis, id: EffectId, name: &str) -> (f64, f64) {
    let candidate = found.ranked.iter().find(|candidate| candidate.effects == [id]);
    match candidate.and_then(|candidate| candidate.parameters.get(name)) {
        Some(FittedParameter::Real { value, standard_error }) => (*value, *standard_error),
        other => panic!("{id} {other:?}"),
    }
}

fn diagnosed(flight: &Flight) -> Diagnosis {
    let found = diagnose(&[flight.flown()], None).expect("comparable");
    println!(
        "lag {:.0} ms, play {:.1} mm, raster {}, along y {}, {:?} m/s, {:?}, off {:.2} mm: {:?} {:?}{:?} {}",
        1e3 * flight.lag_s,
        1e3 * flight.play_m,
        flight.raster,
        flight.along_y,
        flight.speeds_m_s,
        flight.trigger,
        1e3 * flight.off_m,
        found.verdict,
        found.effects,
        found.alternatives,
        found.ranked[0].readings.join("; ")
    );
    found
}

/// That the truth is named, or rivals of one effect each with the truth among them, and that its parameter is right.
fn assert_found(flight: &Flight, id: EffectId, alone: bool) {
    let found = diagnosed(flight);
    let named = match alone {
        true => found.verdict.names_a_cause() && found.effects == [id],
        false => {
            found.verdict == Verdict::Ambiguous
                && found.alternatives.iter().all(|set| set.len() == 1)
                && found.alternatives.iter().any(|set| set == &[id])
        }
    };
    assert!(named, "{}", found.sentence);
    let (name, truth) = match id {
        EffectId::Lag => ("lag.s", flight.lag_s),
        _ => ("backlash.mm", 1e3 * flight.play_m),
    };
    let (value, error) = parameter(&found, id, name);
    assert!((value - truth).abs() < 3.0 * error, "{value} ± {error}, truly {truth}");
}

#[test]
fn at_one_speed_lag_and_play_are_rivals() {
    assert_found(&Flight::new(0.03, 0.0, &[0.05], 1), EffectId::Lag, false);
    assert_found(&Flight::new(0.0, 4e-4, &[0.05], 2), EffectId::Backlash, false);
}

/// The noise then is told by the fine structure of the residual along the rows.
#[test]
fn without_repeats_noise_is_not_told_as_a_second_cause() {
    let flight = Flight { repeats: false, ..Flight::new(0.03, 0.0, &[0.05], 7) };
    assert_found(&flight, EffectId::Lag, false);
}

#[test]
fn two_speeds_tell_lag_from_play() {
    assert_found(&Flight::new(0.03, 0.0, &[0.05, 0.02], 3), EffectId::Lag, true);
    assert_found(&Flight::new(0.0, 4e-4, &[0.05, 0.02], 4), EffectId::Backlash, true);
}

#[test]
fn rows_along_y_have_a_lag_and_no_play() {
    let along_y = Flight { along_y: true, ..Flight::new(0.03, 0.0, &[0.05], 5) };
    assert_found(&along_y, EffectId::Lag, true);
}

/// Without a run-up the first readings of a row are taken on the ramp, where the lag is a shorter way.
#[test]
fn readings_at_even_times_on_the_ramps_tell_lag_from_play() {
    let timed = Flight { trigger: Trigger::Time, ..Flight::new(0.03, 0.0, &[0.05], 6) };
    assert_found(&timed, EffectId::Lag, true);
}

#[test]
#[ignore = "a hundred scans take four minutes"]
fn over_lags_plays_orders_and_speeds_the_truth_is_named_or_among_rivals() {
    let (mut right, mut of, mut wrong) = (0, 0, Vec::new());
    let mut seed = 100;
    for speeds_m_s in [&[0.05][..], &[0.02], &[0.06, 0.025]] {
        for (raster, along_y) in [(false, false), (true, false), (false, true)] {
            for (trigger, off_m) in
                [(Trigger::Place, 0.0), (Trigger::Place, 1.5e-5), (Trigger::Time, 0.0)]
            {
                for (lag_ms, play_mm) in
                    [(5.0, 0.0), (20.0, 0.0), (60.0, 0.0), (0.0, 0.1), (0.0, 0.5)]
                {
                    // Rows in one direction, or along y, are all displaced alike by play.
                    if play_mm > 0.0 && (raster || along_y) {
                        continue;
                    }
                    seed += 1;
                    let flight = Flight {
                        raster,
                        along_y,
                        trigger,
                        off_m,
                        ..Flight::new(1e-3 * lag_ms, 1e-3 * play_mm, speeds_m_s, seed)
                    };
                    let found = diagnosed(&flight);
                    let id = if lag_ms > 0.0 { EffectId::Lag } else { EffectId::Backlash };
                    let sets = found.alternatives.iter().chain([&found.effects]);
                    // Rows in one direction at one speed are displaced as a whole, and four tenths of a millimetre may be the setting-up.
                    let as_set_up =
                        raster && speeds_m_s.len() == 1 && lag_ms * speeds_m_s[0] <= 0.4;
                    let is_right = sets.into_iter().any(|set| set == &[id])
                        || as_set_up && found.verdict == Verdict::None;
                    of += 1;
                    right += usize::from(is_right);
                    if !is_right {
                        wrong.push(found.sentence);
                    }
                }
            }
        }
    }
    println!("{right} of {of}");
    // Of 99 three were not: two with places off by 0.015 mm named turbulence beside the lag, and one of rows in one direction from rest named a
    // play and an offset.
    assert!(100 * right >= 95 * of, "{right} of {of}:\n{}", wrong.join("\n"));
}
