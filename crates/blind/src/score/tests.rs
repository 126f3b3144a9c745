//! Scores of hand-made diagnoses, whose rates are known.

use std::collections::BTreeMap;

use serde_json::json;

use super::super::answer::{Answer, Imperfections};
use super::super::assignment::Category;
use super::*;

fn answer(number: usize, category: Category, effects: &[&str], gap_sigma: f64) -> Answer {
    Answer {
        name: format!("{number:04}"),
        category,
        effects: effects.iter().map(|&effect| effect.to_owned()).collect(),
        parameters: BTreeMap::from([
            ("sound-speed.c_m_s".to_owned(), json!(345.0)),
            ("standing-wave.coefficient".to_owned(), json!([0.1, -0.2])),
        ]),
        gap_sigma,
        gaps_alone_sigma: vec![gap_sigma; effects.len()],
        elements: None,
        noise: [0.02, 0.005],
        peak_v: 1.0,
        dominant: None,
        imperfections: None,
        strata: BTreeMap::new(),
    }
}

fn parsed(text: serde_json::Value) -> Option<ParsedDiagnosis> {
    Some(serde_json::from_value(text).expect("a diagnosis"))
}

fn explained(effects: &[&str], probability: f64) -> Option<ParsedDiagnosis> {
    parsed(json!({
        "verdict": "explained", "effects": effects, "explained_fraction": 0.98, "unknown": 1,
        "ranked": [{ "effects": effects, "probability": probability }]
    }))
}

fn verdict(verdict: &str) -> Option<ParsedDiagnosis> {
    parsed(json!({ "verdict": verdict }))
}

fn score(all: Vec<(Answer, Option<ParsedDiagnosis>)>) -> Score {
    let (answers, diagnoses): (Vec<_>, Vec<_>) = all.into_iter().unzip();
    Score::new(&Answers { format: 1, seed: 1, answers }, &diagnoses)
}

fn share(score: &Score, what: &str) -> f64 {
    let found = score.rates.iter().find(|rate| rate.what == what);
    found.expect(what).share.expect("there are some")
}

#[test]
fn known_diagnoses_have_known_rates() {
    let one = |n, gap| answer(n, Category::One, &["sound-speed"], gap);
    let two = |n| answer(n, Category::Two, &["lag", "pitch"], 2.0);
    let rivals = json!({
        "verdict": "ambiguous", "alternatives": [["drive-frequency"], ["sound-speed"]]
    });
    let score = score(vec![
        (one(0, 3.0), explained(&["sound-speed"], 0.99)),
        (one(1, 1.0), explained(&["pitch"], 0.6)),
        (one(2, 0.6), parsed(rivals)),
        (one(3, 0.2), verdict("none")),
        (two(4), explained(&["pitch", "lag"], 0.9)),
        (two(5), explained(&["lag"], 0.9)),
        (two(6), explained(&["lag", "skew"], 0.9)),
        (answer(7, Category::None, &[], 0.0), verdict("none")),
        (answer(8, Category::None, &[], 0.0), verdict("unexplained")),
        (answer(9, Category::Unmodelled, &["screen"], 1.0), verdict("unexplained")),
        (answer(10, Category::Unmodelled, &["screen"], 4.0), explained(&["flow"], 0.8)),
        (answer(11, Category::One, &["flow"], 1.0), None),
    ]);
    assert_eq!((score.scored, score.not_diagnosed.as_slice()), (11, &["0011".to_owned()][..]));
    for (what, expected) in [
        ("one effect, gap >= 0.5 sigma: named exactly", 1.0 / 3.0),
        ("one effect, gap >= 0.5 sigma: exactly or among two or three", 2.0 / 3.0),
        ("one effect, any gap: explained with a wrong cause", 0.25),
        ("one effect, gap 0.12 to 0.5 sigma: named exactly", 0.0),
        ("two effects: both exactly", 1.0 / 3.0),
        ("two effects, where explained: every named one true", 2.0 / 3.0),
        ("no effect: false alarms", 0.5),
        ("outside: unexplained", 0.5),
        ("outside: named with confidence", 0.5),
        ("outside, gap > 2 sigma: named with confidence", 1.0),
    ] {
        assert!((share(&score, what) - expected).abs() < 1e-12, "{what}");
    }
    assert_eq!(score.figures[0].value, Some(0.98));
    let text = score.to_text();
    assert!(text.contains("sound-speed (4) -> "), "{text}");
    assert!(text.contains("1 WITHOUT A DIAGNOSIS"), "{text}");
}

#[test]
fn probabilities_that_hold_have_no_error_and_boasts_have() {
    let of = |probability: f64, right: usize| {
        let all = (0..10).map(|n| {
            let named = if n < right { "lag" } else { "skew" };
            (answer(n, Category::One, &["lag"], 1.0), explained(&[named], probability))
        });
        score(all.collect()).calibration.error.expect("there are some")
    };
    assert!(of(0.8, 8) < 1e-12);
    assert!((of(0.95, 5) - 0.45).abs() < 1e-12);
}

#[test]
fn parameters_are_measured_in_their_stated_errors() {
    let fitted = |value: f64| {
        parsed(json!({
            "verdict": "explained", "effects": ["sound-speed"],
            "ranked": [{ "effects": ["sound-speed"], "probability": 1.0, "parameters": {
                "sound-speed.c_m_s": { "value": value, "standard_error": 0.5 },
                "standing-wave.coefficient":
                    { "value": [0.2, -0.2], "standard_error": [0.01, null] },
                "dead-elements.elements": { "value": [1, 2] }
            }}]
        }))
    };
    let truth = |n| answer(n, Category::One, &["sound-speed"], 1.0);
    let score = score(vec![(truth(0), fitted(345.5)), (truth(1), fitted(343.0))]);
    let [speed, wave] = &score.parameters[..] else { panic!("two parameters have errors") };
    assert_eq!((speed.of, speed.within_two), (2, 1));
    assert!((speed.mean_z + 1.5).abs() < 1e-9);
    assert_eq!((wave.of, wave.within_two), (2, 0));
    assert_eq!(share(&score, "parameters within two standard errors"), 0.25);
}

/// The same phase may be told as one a turn away.
#[test]
fn phases_are_compared_without_whole_turns() {
    let fitted = |phase_rad: f64| {
        parsed(json!({
            "verdict": "explained", "effects": ["lead-screw"],
            "ranked": [{ "effects": ["lead-screw"], "probability": 1.0, "parameters": {
                "lead-screw.phase_rad": { "value": phase_rad, "standard_error": 0.1 },
                "lead-screw.amplitude_mm": { "value": 6.5, "standard_error": 0.1 }
            }}]
        }))
    };
    let truth = |n| {
        let mut truth = answer(n, Category::One, &["lead-screw"], 1.0);
        truth.parameters.insert("lead-screw.phase_rad".to_owned(), json!(-3.1));
        truth.parameters.insert("lead-screw.amplitude_mm".to_owned(), json!(0.2));
        truth
    };
    let score = score(vec![(truth(0), fitted(3.1)), (truth(1), fitted(-2.6))]);
    let [amplitude, phase] = &score.parameters[..] else { panic!("two parameters have errors") };
    assert_eq!((phase.of, phase.within_two), (2, 1));
    assert!((phase.mean_z - (5.0 + 6.2 * 10.0 - std::f64::consts::TAU * 10.0) / 2.0).abs() < 1e-9);
    assert_eq!(amplitude.within_two, 0);
}

#[test]
fn of_rigs_the_cost_and_the_proof_of_the_cause_are_scored() {
    let one = |n| answer(n, Category::One, &["sound-speed"], 2.0);
    let measured = |readings: usize, holds: Option<bool>| {
        parsed(json!({
            "verdict": "explained", "effects": ["sound-speed"],
            "measurement": {
                "readings": readings, "seconds": 0.3 * readings as f64,
                "verification": holds.map(|holds| json!({ "holds": holds }))
            }
        }))
    };
    let rivals = |alike: Option<bool>| {
        parsed(json!({
            "verdict": "ambiguous", "alternatives": [["sound-speed"], ["pitch"]],
            "measurement": { "readings": 700, "seconds": 210.0, "rivals_alike": alike }
        }))
    };
    let score = score(vec![
        (one(0), measured(400, Some(true))),
        (one(1), measured(600, Some(false))),
        (one(2), measured(800, Some(true))),
        // Named, but never tested.
        (one(3), measured(1800, None)),
        (one(4), rivals(Some(true))),
        (one(5), rivals(Some(false))),
        (one(6), rivals(None)),
    ]);
    assert_eq!(share(&score, "where explained: the cause holds on fresh readings"), 0.5);
    assert_eq!(share(&score, "where rivals are left: the readings cannot tell them apart"), 0.5);
    let figure = |what: &str| {
        score.figures.iter().find(|figure| figure.what == what).expect(what).value.expect("some")
    };
    assert_eq!(figure("median readings of a rig"), 700.0);
    assert!((figure("median minutes on the rig's clock") - 3.5).abs() < 1e-12);
}

/// An answer of a laboratory with ordinary imperfections.
fn in_laboratory(number: usize, category: Category, effects: &[&str], gap_sigma: f64) -> Answer {
    let parameters = BTreeMap::from([
        ("element-gain.spread".to_owned(), json!(0.06)),
        ("offset.x_mm".to_owned(), json!(0.5)),
        ("offset.y_mm".to_owned(), json!(-0.5)),
        ("offset.z_mm".to_owned(), json!(0.3)),
        ("sound-speed.c_m_s".to_owned(), json!(344.6)),
        ("reflection.coefficient".to_owned(), json!([0.01, 0.02])),
    ]);
    let radiator = if number.is_multiple_of(2) { "monopole" } else { "bending face" };
    Answer {
        imperfections: Some(Imperfections { parameters, stated_speed_m_s: 344.0, gap_sigma: 1.5 }),
        strata: BTreeMap::from([
            ("radiator".to_owned(), radiator.to_owned()),
            ("quantity".to_owned(), "amplitude".to_owned()),
        ]),
        ..answer(number, category, effects, gap_sigma)
    }
}

/// An explanation whose candidate states parameters.
fn fitted(effects: &[&str], parameters: serde_json::Value) -> Option<ParsedDiagnosis> {
    parsed(json!({
        "verdict": "mostly-explained", "effects": effects, "explained_fraction": 0.9,
        "ranked": [{ "effects": effects, "probability": 0.9, "parameters": parameters }]
    }))
}

#[test]
fn what_every_set_up_has_is_neither_a_hit_nor_a_wrong_cause() {
    let one = |n| in_laboratory(n, Category::One, &["pitch"], 1.0);
    let both = |n| in_laboratory(n, Category::Two, &["lag", "pitch"], 1.0);
    let score = score(vec![
        (one(0), explained(&["element-gain", "pitch", "offset"], 0.9)),
        // The cause is missed, not mistaken.
        (one(1), explained(&["element-gain", "offset"], 0.9)),
        (one(2), explained(&["element-gain", "skew"], 0.9)),
        (both(3), explained(&["offset", "pitch"], 0.9)),
    ]);
    for (what, expected) in [
        ("one effect, gap >= 0.5 sigma: named exactly", 1.0 / 3.0),
        ("one effect, any gap: explained with a wrong cause", 1.0 / 3.0),
        ("two effects: both exactly", 0.0),
        ("two effects, where explained: every named one true", 1.0),
    ] {
        assert!((share(&score, what) - expected).abs() < 1e-12, "{what}");
    }
}

#[test]
fn what_every_set_up_has_is_an_alarm_only_at_more_than_twice_its_size() {
    let alarmed = |diagnosis: Option<ParsedDiagnosis>| {
        let none = in_laboratory(0, Category::None, &[], 0.0);
        share(&score(vec![(none, diagnosis)]), "no effect: false alarms") == 1.0
    };
    let real = |value: f64| json!({ "value": value, "standard_error": 0.01 });
    let gain =
        |value: f64| fitted(&["element-gain"], json!({ "element-gain.spread": real(value) }));
    assert!(!alarmed(gain(0.115)) && alarmed(gain(0.125)));
    // Of the sound speed the distance from the stated one counts: 0.6 m/s here.
    let speed = |value: f64| fitted(&["sound-speed"], json!({ "sound-speed.c_m_s": real(value) }));
    assert!(!alarmed(speed(345.1)) && !alarmed(speed(343.0)) && alarmed(speed(345.3)));
    let offset = |x: f64| {
        let parameters = json!({
            "offset.x_mm": real(x), "offset.y_mm": real(0.0), "offset.z_mm": real(0.0)
        });
        fitted(&["offset"], parameters)
    };
    assert!(!alarmed(offset(-1.5)) && alarmed(offset(1.6)));
    let mirror = |re: f64| {
        let coefficient = json!({ "value": [re, 0.0], "standard_error": [0.001, 0.001] });
        fitted(&["reflection"], json!({ "reflection.coefficient": coefficient }))
    };
    assert!(!alarmed(mirror(0.044)) && alarmed(mirror(0.046)));
    // A size that is not stated, an effect that the set-up does not have, and a gap left unexplained.
    assert!(alarmed(fitted(&["element-gain"], json!({}))));
    assert!(alarmed(explained(&["pitch"], 0.9)) && alarmed(verdict("unexplained")));
    assert!(!alarmed(verdict("none")));
    let rivals = |other: &str| {
        parsed(json!({ "verdict": "ambiguous", "alternatives": [["offset"], [other]] }))
    };
    assert!(!alarmed(rivals("element-gain")) && alarmed(rivals("skew")));
}

#[test]
fn of_a_whole_bench_the_dominant_one_must_be_named_and_nothing_invented() {
    let bench = |n| Answer {
        dominant: Some("flow".to_owned()),
        ..in_laboratory(n, Category::WholeBench, &["flow", "lag", "pitch"], 3.0)
    };
    let rivals = |sets: serde_json::Value| {
        parsed(json!({ "verdict": "ambiguous", "alternatives": sets, "explained_fraction": 0.8 }))
    };
    let score = score(vec![
        (bench(0), explained(&["flow", "offset"], 0.9)),
        (bench(1), explained(&["flow", "skew"], 0.9)),
        (bench(2), explained(&["pitch"], 0.9)),
        (bench(3), rivals(json!([["flow", "lag"], ["flow", "pitch"]]))),
        (bench(4), rivals(json!([["flow"], ["skew"]]))),
        (bench(5), parsed(json!({ "verdict": "explained", "effects": ["flow"] }))),
        (bench(6), verdict("unexplained")),
    ]);
    for (what, count) in [
        ("whole bench: the dominant one named", 4.0),
        ("whole bench: every named one true", 5.0),
        ("whole bench: the remaining share told", 5.0),
        ("whole bench: all three", 2.0),
    ] {
        assert!((share(&score, what) - count / 7.0).abs() < 1e-12, "{what}");
    }
}

#[test]
fn a_set_of_laboratories_is_scored_by_their_classes() {
    let of = in_laboratory;
    let whole = Answer {
        dominant: Some("flow".to_owned()),
        ..of(6, Category::WholeBench, &["flow", "lag", "pitch"], 3.0)
    };
    let score = score(vec![
        (of(0, Category::One, &["pitch"], 1.0), explained(&["pitch"], 0.95)),
        (of(1, Category::One, &["pitch"], 1.0), explained(&["skew"], 0.55)),
        (of(2, Category::One, &["lag"], 0.2), verdict("none")),
        (of(3, Category::Two, &["lag", "pitch"], 2.0), explained(&["lag", "pitch"], 0.9)),
        (of(4, Category::Three, &["flow", "lag", "pitch"], 2.0), explained(&["lag", "flow"], 0.9)),
        (of(5, Category::None, &[], 0.0), verdict("none")),
        (whole, explained(&["flow", "element-gain"], 0.9)),
        (of(7, Category::Unmodelled, &["screen"], 2.0), verdict("unexplained")),
    ]);
    let radiators: Vec<_> = score.strata.iter().filter(|one| one.axis == "radiator").collect();
    let one = |n: usize| {
        (radiators[n].class.as_str(), radiators[n].rates[0].count, radiators[n].rates[0].of)
    };
    assert_eq!([one(0), one(1)], [("bending face", 0, 1), ("monopole", 1, 1)]);
    insta::assert_snapshot!(score.to_text());
}
