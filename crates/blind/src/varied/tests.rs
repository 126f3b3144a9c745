//! Many laboratories, and what every one of them must be.

use std::collections::{BTreeMap, BTreeSet};

use num_complex::Complex64;

use super::super::causes::Causes;
use super::super::world::World;
use super::*;
use fieldgap_virtual_rig::counter_rng::CounterRng;

fn drawn(seed: u64) -> Laboratory {
    laboratory(&[], &mut RandomSequence::new(CounterRng::new(seed)))
}

#[test]
fn every_laboratory_can_be_measured_and_all_classes_come() {
    let mut classes: BTreeSet<(String, String)> = BTreeSet::new();
    for seed in 0..300 {
        let laboratory = drawn(seed);
        let survey = &laboratory.survey;
        let driven: Vec<_> = survey.driven().collect();
        assert!(driven.len() >= 27, "{seed}: {}", driven.len());
        assert!(driven.len() * laboratory.elements().len() <= 13 * MOST_PATHS / 10, "{seed}");
        assert!(survey.stops.windows(2).all(|two| two[1].time_s > two[0].time_s), "{seed}");
        assert_eq!(driven[0].time_s, 0.0, "{seed}");
        assert!(driven.iter().all(|stop| stop.focus < Some(laboratory.foci.len())));
        // Nothing is measured within the near field of an element, nor a metre away.
        let (low, high) = survey.corners_mm();
        assert!(low.z >= 60.0 && high.z < 1100.0, "{seed}: {low} {high}");
        let used = driven.len() / survey.gap_of_one_in;
        assert!((27..=801).contains(&used), "{seed}: {used}");
        classes.extend(laboratory.strata.clone());
        laboratory.setup("0000").to_toml().expect("a scan.toml");
    }
    let of = |axis: &str| classes.iter().filter(|(name, _)| name == axis).count();
    for (axis, count) in [
        ("layout", 5),
        ("elements", 4),
        ("radiator", 6),
        ("drives", 4),
        ("path", 5),
        ("order", 3),
        ("motion", 2),
        ("readings", 4),
        ("noise", 3),
        ("quantity", 2),
        ("converter", 3),
    ] {
        assert_eq!(of(axis), count, "{axis}: {classes:?}");
    }
}

#[test]
fn a_lag_is_only_where_the_robot_reads_in_motion_and_play_where_it_turns() {
    for seed in 0..60 {
        let of = |id| laboratory(&[id], &mut RandomSequence::new(CounterRng::new(seed)));
        for laboratory in [of("lag"), of("backlash")] {
            assert!(laboratory.survey.flown, "{seed}");
            let stops: Vec<_> = laboratory.survey.driven().collect();
            let steps = stops.windows(2).map(|two| two[1].at_mm.x - two[0].at_mm.x);
            let steps: Vec<f64> = steps.collect();
            assert!(steps.iter().any(|&x| x > 0.0) && steps.iter().any(|&x| x < 0.0), "{seed}");
        }
    }
}

#[test]
fn a_cause_takes_the_place_of_an_imperfection_and_is_twice_as_large() {
    let mut laboratory = drawn(1);
    let mut random = RandomSequence::new(CounterRng::new(1));
    make_imperfect(&mut laboratory, &["offset"], &mut random);
    let ids: Vec<&str> = laboratory.imperfections.iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, ["sound-speed", "element-gain", "element-phase", "reflection", "gain-drift"]);
    for id in ids {
        let sizes = crate::catalogue::draw(id, &laboratory, &mut random);
        let crate::catalogue::Sizes::Any { largest, least, .. } = beyond_the_ordinary(id, sizes)
        else {
            panic!("{id} has any size")
        };
        assert!(0.0 < least && least < 0.7 * largest, "{id}: {least} {largest}");
    }
}

/// The readings without causes and imperfections, against the simulator that the record names. The two share no field code.
#[test]
fn the_record_believes_the_field_that_is_there_up_to_the_near_field_of_an_element() {
    let mut worst: BTreeMap<String, f64> = BTreeMap::new();
    for seed in 0..80 {
        let laboratory = drawn(seed);
        if laboratory.elements().len() > 100 {
            continue;
        }
        let none = Causes::none();
        let world = World::new(&laboratory, &none, 1.0, CounterRng::new(0));
        let stops = &laboratory.survey.stops;
        let driven = (0..stops.len()).filter(|&n| stops[n].focus.is_some());
        let chosen: Vec<usize> = driven.step_by(1 + stops.len() / 60).collect();
        let phasors = world.phasors_v(&chosen);
        let setup = laboratory.setup("0000");
        let believed: Vec<Complex64> = chosen
            .iter()
            .map(|&n| {
                let simulation = setup.simulation(setup.simulator, stops[n].focus.unwrap_or(0));
                simulation.expect("a focus").field(&[stops[n].at_mm * 1e-3])[0]
            })
            .collect();
        let squares = |of: &[Complex64]| of.iter().map(|p| p.norm_sqr()).sum::<f64>();
        let product: Complex64 = believed.iter().zip(&phasors).map(|(b, p)| b.conj() * p).sum();
        let share = product.norm_sqr() / squares(&believed) / squares(&phasors);
        let left = (1.0 - share).max(0.0).sqrt();
        let radiator = laboratory.strata["radiator"].clone();
        let worst = worst.entry(radiator).or_default();
        *worst = worst.max(left);
    }
    assert_eq!(worst.len(), 6);
    for (radiator, left) in worst {
        // Exactly by the laws, or by a law of the far field and a table of it.
        let most =
            if ["monopole", "far-field piston", "measured table"].contains(&radiator.as_str()) {
                1e-6
            } else {
                0.01
            };
        assert!(left < most, "{radiator}: {left}");
    }
}
