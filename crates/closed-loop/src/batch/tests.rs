//! The choice of readings by hand-made outlooks.

use std::path::Path;

use fieldgap_acquisition::RigSetup;
use fieldgap_input::TomlSource;
use fieldgap_records::{BoxMm, Plan};
use nalgebra::DMatrix;

use super::*;

fn robot() -> Robot {
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/virtual.toml");
    Robot::of(&RigSetup::read(&rig).expect("the rig file"))
}

fn settings(criterion: Criterion) -> ClosedLoop {
    let within = BoxMm { least: Vec3::new(-30.0, -30.0, 60.0), most: Vec3::new(30.0, 30.0, 140.0) };
    ClosedLoop { criterion, ..ClosedLoop::within(within) }
}

fn chooser<'c>(settings: &'c ClosedLoop, robot: &'c Robot) -> Chooser<'c> {
    Chooser {
        settings,
        robot,
        flying: None,
        rounds: 0,
        planned_drives: 2,
        drives: 9,
        at_m: robot.home_m(),
        places_used: 0,
    }
}

/// Two sets that differ above 100 mm alone, by so many standard deviations; one parameter of both moves readings below.
fn above(possible: &[PossibleReading], sigma: f64) -> Vec<Outlook> {
    let is_above = |one: &PossibleReading| if one.at_m.z > 0.1 { 1.0 } else { 0.0 };
    let set = |share: f64| Outlook {
        effects: Vec::new(),
        probability: 0.5,
        means: possible.iter().map(|one| share * sigma * is_above(one)).collect(),
        variances: vec![1.0; possible.len()],
        slopes: DMatrix::from_fn(1, possible.len(), |_, n| 1.0 - is_above(&possible[n])),
        covariance: DMatrix::identity(1, 1),
    };
    vec![set(0.0), set(1.0)]
}

fn share_above(batch: &Batch) -> f64 {
    let above = batch.course.readings.iter().filter(|(at_m, _)| at_m.z > 0.1).count();
    above as f64 / batch.course.readings.len() as f64
}

#[test]
fn the_first_round_has_silence_places_of_both_kinds_of_drives_and_repeats() {
    let (settings, robot) = (settings(Criterion::Information), robot());
    let Batch { course: Course { readings, .. }, .. } = chooser(&settings, &robot).first();
    assert_eq!(readings.len(), 240);
    assert!(readings[..40].iter().all(|(_, focus)| focus.is_none()));
    let driven = &readings[40..];
    let is_again = |&number: &usize| driven[..number].contains(&driven[number]);
    let (again, once): (Vec<usize>, Vec<usize>) = (0..driven.len()).partition(is_again);
    assert_eq!(again.len(), 24);
    for number in again {
        // Not soon after the first visit.
        assert!(!driven[number.saturating_sub(8)..number].contains(&driven[number]));
    }
    let once: Vec<Planned> = once.into_iter().map(|number| driven[number]).collect();
    let planned = once.iter().filter(|(_, focus)| focus.is_some_and(|focus| focus < 2));
    assert_eq!(2 * planned.count(), once.len());
    assert!((0..9).all(|drive| once.iter().any(|(_, focus)| *focus == Some(drive))));
    assert!(driven.windows(2).all(|pair| pair[0].0 != pair[1].0));
}

#[test]
fn readings_are_taken_where_the_sets_differ_or_where_the_first_is_least_sure() {
    let robot = robot();
    let chosen = |criterion, sigma| {
        let settings = settings(criterion);
        let outlooks = |possible: &[PossibleReading]| above(possible, sigma);
        chooser(&settings, &robot).next(outlooks, 96)
    };
    let share = |criterion| share_above(&chosen(criterion, 0.2));
    // Of a round a quarter is even; so half of a quarter lies where nothing is to be learnt.
    assert!(share(Criterion::Information) > 0.75, "{}", share(Criterion::Information));
    assert!(share(Criterion::Parameters) < 0.35, "{}", share(Criterion::Parameters));
    assert!((0.35..0.65).contains(&share(Criterion::Even)), "{}", share(Criterion::Even));
    // Sets that the even readings part already leave the rest to what the first is least sure of.
    let parted = chosen(Criterion::Information, 5.0);
    let least_sure = chosen(Criterion::Parameters, 5.0);
    assert_eq!(parted.course.readings, least_sure.course.readings);
}

/// Readings of a robot at rest share the error of its place: they look sure, and tell nothing of how places scatter.
#[test]
fn the_robot_moves_before_each_reading_and_comes_to_no_place_more_than_twice_for_what_it_tells() {
    let (settings, robot) = (settings(Criterion::Information), robot());
    // One place tells by far the most.
    let outlooks = |possible: &[PossibleReading]| {
        let mut sets = above(possible, 0.2);
        let most = possible.iter().position(|one| one.at_m.z > 0.1).expect("some are above");
        sets[1].means[most] = 3.0;
        sets
    };
    let Batch { course: Course { readings, .. }, .. } =
        chooser(&settings, &robot).next(outlooks, 96);
    assert!(readings.windows(2).all(|pair| pair[0].0 != pair[1].0));
    assert!(readings.len() > 90, "{}", readings.len());
    // One reading in ten is a repeat.
    let visits = |at_m: &Vec3| readings.iter().filter(|(other_m, _)| other_m == at_m).count();
    let beyond: usize = readings.iter().map(|(at_m, _)| usize::from(visits(at_m) > 2)).sum();
    assert!(readings.iter().all(|(at_m, _)| visits(at_m) <= 3));
    assert!(beyond <= 3 * 9, "{beyond}");
}

#[test]
fn what_is_told_counts_per_second() {
    let (settings, robot) = (settings(Criterion::Information), robot());
    let chooser = chooser(&settings, &robot);
    let batch = chooser.next(|possible| above(possible, 0.2), 96);
    let way_s = |readings: &[Planned]| -> f64 {
        readings.windows(2).map(|pair| robot.move_s(pair[0].0, pair[1].0)).sum()
    };
    // As many readings spread evenly, with as many repeats, would take longer.
    let evenly = ClosedLoop { criterion: Criterion::Even, ..settings.clone() };
    let evenly = Chooser { settings: &evenly, ..chooser };
    let even = evenly.next(|possible| above(possible, 0.2), 96).course.readings;
    let [way_s, even_s] = [&batch.course.readings, &even].map(|r| way_s(r) / r.len() as f64);
    assert!(way_s < even_s, "{way_s} {even_s}");
    // Some seventy readings above of 0.2 standard deviations: half of the sum of their squares.
    assert!((0.9..1.9).contains(&batch.apart[0]), "{:?}", batch.apart);
    assert!(batch.information.expect("sets were asked") > 0.2);
}

#[test]
fn a_verification_draws_the_same_places_again_and_others_in_another_round() {
    let (mut settings, robot) = (settings(Criterion::Information), robot());
    settings.verify_within =
        BoxMm { least: Vec3::new(-5.0, -5.0, 90.0), most: Vec3::new(5.0, 5.0, 110.0) };
    let chooser = chooser(&settings, &robot);
    let drawn = |round| chooser.fresh(round).course.readings;
    assert_eq!(drawn(3).len(), 64);
    assert_eq!(drawn(3), drawn(3));
    assert!(drawn(3).iter().all(|reading| !drawn(4).contains(reading)));
    let inside = |at_m: &Vec3| at_m.x.abs() <= 5e-3 && (0.09..=0.11).contains(&at_m.z);
    assert!(drawn(3).iter().all(|(at_m, focus)| inside(at_m) && focus.is_some_and(|f| f < 2)));
}

#[test]
fn every_drive_is_measured_in_every_part_of_the_box() {
    let within = BoxMm { least: Vec3::repeat(-10.0), most: Vec3::repeat(10.0) };
    let mut counts = [[0; 5]; 10];
    for (n, at_m) in places_m(&within, 0).take(500).enumerate() {
        let part = ((at_m.z * 1e3 + 10.0) / 4.0) as usize;
        counts[one_of(10, n)][part.min(4)] += 1;
    }
    assert!(counts.iter().flatten().all(|count| (5..=16).contains(count)), "{counts:?}");
}

/// The flights of a plan with `[fly]` on the rig of these tests.
fn flying(speed_mm_s: f64) -> Flying {
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/virtual.toml");
    let text = format!(
        "name = \"p\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 100.0\n\
         [fly]\nspeed_mm_s = {speed_mm_s}\n[closed_loop]\nmin_mm = [-30, -30, 60]\nmax_mm = [30, 30, 140]\n"
    );
    let plan = Plan::parse(TomlSource::new(Path::new("plan.toml"), text)).expect("a plan");
    Flying::of(&plan, &RigSetup::read(&rig).expect("the rig file")).expect("it flies")
}

fn speeds_of(course: &Course) -> Vec<f64> {
    course.rows.iter().map(|(_, row)| row.speed_mm_s.get()).collect()
}

#[test]
fn half_of_a_first_look_is_flown_at_both_speeds_and_either_way() {
    let (settings, robot, flying) = (settings(Criterion::Information), robot(), flying(180.0));
    let chooser = Chooser { flying: Some(&flying), ..chooser(&settings, &robot) };
    let Batch { course, .. } = chooser.first();
    assert_eq!(course.readings.len(), 240);
    // Of 176 that are neither silent nor repeats.
    assert_eq!(course.rows.len(), 88 / ROW);
    for speed in [180.0, 60.0] {
        assert!(speeds_of(&course).iter().filter(|mm_s| **mm_s == speed).count() >= 5);
    }
    let mut ways: Vec<[i8; 3]> = course
        .rows
        .iter()
        .map(|(first, row)| {
            let places_m: Vec<Vec3> = row.places_m().collect();
            assert!(row.readings().eq(course.readings[*first..][..ROW].iter().copied()));
            (places_m[1] - places_m[0]).map(|along| along.signum() as i8 * i8::from(along != 0.0))
        })
        .map(Into::into)
        .collect();
    ways.sort_unstable();
    ways.dedup();
    assert_eq!(ways, [[-1, 0, 0], [0, -1, 0], [0, 1, 0], [1, 0, 0]]);
    // The robot stands at the last place of a round.
    assert!(course.rows.iter().all(|(first, _)| first + ROW < course.readings.len()));
    let speeds = course.speeds_mm_s().expect("some are flown");
    assert_eq!(speeds.iter().filter(|mm_s| **mm_s > 0.0).count(), 88);
}

/// A lag and play that shift readings alike at the slower speed and along x; at rest neither does.
fn lag_or_play(possible: &[PossibleReading], same_at_m_s: f64, sigma: f64) -> Vec<Outlook> {
    let set = |means: &dyn Fn(f64) -> f64| Outlook {
        effects: Vec::new(),
        probability: 0.5,
        means: possible.iter().map(|one| sigma * means(one.velocity_m_s.x)).collect(),
        variances: vec![1.0; possible.len()],
        slopes: DMatrix::zeros(0, possible.len()),
        covariance: DMatrix::zeros(0, 0),
    };
    let play = |along: f64| if along == 0.0 { 0.0 } else { along.signum() };
    vec![set(&|along| along / same_at_m_s), set(&play)]
}

#[test]
fn where_one_speed_leaves_a_lag_and_play_alike_rows_are_flown_at_the_other() {
    let (settings, robot, flying) = (settings(Criterion::Information), robot(), flying(180.0));
    let chooser = Chooser { flying: Some(&flying), ..chooser(&settings, &robot) };
    for (same_at_m_s, other_mm_s) in [(0.06, 180.0), (0.18, 60.0)] {
        let outlooks = |possible: &[PossibleReading]| lag_or_play(possible, same_at_m_s, 0.2);
        let Batch { course, information, .. } = chooser.next(outlooks, 96);
        assert!(information.expect("sets were asked") > 0.1);
        // One row is of the even ones; the others are those that were chosen.
        let telling = course.rows.iter().filter(|(_, row)| {
            let mut possible = row.possible(true);
            row.speed_mm_s.get() == other_mm_s && possible.all(|one| one.velocity_m_s.x != 0.0)
        });
        assert!(course.rows.len() >= 3, "{}", course.rows.len());
        assert!(telling.count() + 1 >= course.rows.len(), "{:?}", course.rows);
        assert!(course.readings.len() > 90);
    }
}

#[test]
fn rows_are_flown_where_they_tell_more_in_a_second_and_no_more_than_half_of_what_is_chosen() {
    let (settings, robot, flying) = (settings(Criterion::Information), robot(), flying(180.0));
    let at_rest = chooser(&settings, &robot);
    let chooser = Chooser { flying: Some(&flying), ..at_rest };
    // Places above tell alike, in motion or at rest; a pass takes less time.
    let Batch { course, .. } = chooser.next(|possible| above(possible, 0.2), 96);
    let flown = course.rows.len() * ROW;
    // Half of 24 even readings make one row, and half of the other 63 make three.
    assert_eq!(flown, 4 * ROW);
    let evenly = ClosedLoop { criterion: Criterion::Even, ..settings.clone() };
    let even = Chooser { settings: &evenly, ..chooser };
    let Batch { course, .. } = even.next(|possible| above(possible, 0.2), 96);
    assert_eq!(course.rows.len(), 43 / ROW);
}

#[test]
fn half_of_a_verification_is_flown_at_fresh_places_at_both_speeds() {
    let (settings, robot, flying) = (settings(Criterion::Information), robot(), flying(180.0));
    let chooser = Chooser { flying: Some(&flying), ..chooser(&settings, &robot) };
    let Batch { course, .. } = chooser.fresh(3);
    assert_eq!((course.readings.len(), course.rows.len()), (64, 4));
    let mut speeds = speeds_of(&course);
    speeds.sort_by(f64::total_cmp);
    assert_eq!(speeds, [60.0, 60.0, 180.0, 180.0]);
    assert_eq!(chooser.fresh(3).course, course);
    assert_ne!(chooser.fresh(4).course, course);
    assert!(course.readings.iter().all(|(_, focus)| focus.is_some_and(|focus| focus < 2)));
    // None of few readings is flown.
    let few = ClosedLoop { verify_readings: 2 * ROW - 1, ..settings.clone() };
    let few = Chooser { settings: &few, ..chooser };
    assert!(few.fresh(3).course.rows.is_empty());
}
