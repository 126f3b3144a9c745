//! What each unmodelled cause does to the readings of one laboratory.

use super::super::causes::Causes;
use super::super::world::World;
use super::*;
use fieldgap_virtual_rig::counter_rng::CounterRng;

/// The field of some stops with the cause of a name at a size, and without, V.
fn with_and_without(name: &str, size: f64) -> (Laboratory, [Vec<Complex64>; 2]) {
    let laboratory = Laboratory::draw(&mut RandomSequence::new(CounterRng::new(3)));
    let draw = UNMODELLED.iter().find(|(known, _)| *known == name).expect(name).1;
    let mut random = RandomSequence::new(CounterRng::new(8));
    let cause = (draw(&laboratory, &mut random).of_size)(size);
    let stops = &laboratory.survey.stops;
    let chosen: Vec<usize> = (64..stops.len()).step_by(113).collect();
    let causes = [Causes::of_unmodelled(cause), Causes::none()];
    let read = causes.each_ref().map(|causes| {
        let world = World::new(&laboratory, causes, 1.0, CounterRng::new(1));
        let phasors = world.phasors_v(&chosen).into_iter().zip(&chosen);
        phasors.map(|(phasor, &n)| world.noiseless_v(&stops[n], phasor)).collect()
    });
    (laboratory, read)
}

#[test]
fn every_cause_changes_the_readings_and_the_more_the_larger_it_is() {
    for (name, draw) in UNMODELLED {
        let (laboratory, _) = with_and_without(name, 0.1);
        let largest = draw(&laboratory, &mut RandomSequence::new(CounterRng::new(8))).largest;
        let change = |size: f64| {
            let (_, [with, without]) = with_and_without(name, size);
            let pairs = with.iter().zip(&without);
            pairs.map(|(a, b)| (a.norm() - b.norm()).powi(2)).sum::<f64>().sqrt()
        };
        let (small, large) = (change(0.15 * largest), change(largest));
        assert!(large > 0.0 && small < large, "{name}: {small} {large}");
    }
}

/// Causes that begin at one moment leave the readings before it as they are.
#[test]
fn before_the_moment_of_a_change_nothing_is_changed() {
    for (name, size) in [("lost-steps", 2.0), ("failing-elements", 5.0), ("fog", 10.0)] {
        let (_, [with, without]) = with_and_without(name, size);
        let same = with.iter().zip(&without).take_while(|(a, b)| a == b).count();
        let share = same as f64 / with.len() as f64;
        assert!((0.2..0.8).contains(&share), "{name}: {share}");
        assert!(with[same..].iter().zip(&without[same..]).all(|(a, b)| a != b), "{name}");
    }
}

#[test]
fn a_held_reading_is_that_of_an_earlier_stop() {
    let (_, [with, without]) = with_and_without("held-readings", 0.3);
    let changed = with.iter().zip(&without).filter(|(a, b)| a != b).count();
    let share = changed as f64 / with.len() as f64;
    assert!((0.1..0.5).contains(&share), "{share}");
}

#[test]
fn a_missed_command_leaves_the_field_of_all_elements_in_phase() {
    let (laboratory, [with, without]) = with_and_without("missed-commands", 0.3);
    let mut unfocused = laboratory;
    unfocused.foci.iter_mut().for_each(|focus| *focus = fieldgap_records::FocusSection::AllZero);
    let none = Causes::none();
    let world = World::new(&unfocused, &none, 1.0, CounterRng::new(1));
    let chosen: Vec<usize> = (64..unfocused.survey.stops.len()).step_by(113).collect();
    let in_phase = world.phasors_v(&chosen);
    let is = |a: Complex64, b: Complex64| (a - b).norm() < 1e-9 * b.norm();
    let missed = (0..with.len()).filter(|&n| is(with[n], in_phase[n])).count();
    let kept = (0..with.len()).filter(|&n| is(with[n], without[n])).count();
    assert_eq!(missed + kept, with.len());
    assert!(missed > 3 && kept > missed, "{missed} {kept}");
}

#[test]
fn a_second_source_adds_its_spherical_wave() {
    let (laboratory, [with, without]) = with_and_without("second-source", 3.0);
    let chosen: Vec<usize> = (64..laboratory.survey.stops.len()).step_by(113).collect();
    // A spherical wave of 3 at one metre, from 0.5 to 2.1 m away.
    let added: Vec<f64> = with.iter().zip(&without).map(|(a, b)| (a - b).norm()).collect();
    assert!(added.iter().all(|v| (1.3..7.0).contains(v)), "{added:?}");
    assert_eq!(added.len(), chosen.len());
}
