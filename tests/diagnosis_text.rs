//! The text of a diagnosis.

mod diagnosis_synthetic;
#[allow(dead_code)] // shared with the tests of the report
mod report_synthetic;

use diagnosis_synthetic::{ambiguous, explained, no_gap, two_causes};
use fieldgap::diagnosis::{Diagnosis, Standing};

fn text(diagnosis: &Diagnosis) -> String {
    let text = diagnosis.to_text();
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    assert!(text.lines().all(|line| line.trim_end() == line), "{text}");
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    text
}

#[test]
fn a_named_cause() {
    insta::assert_snapshot!(text(&explained(&[50.0, 100.0, 150.0, 200.0], 5.0)));
}

#[test]
fn rivals_and_the_next_measurement() {
    insta::assert_snapshot!(text(&ambiguous(5.0)));
}

#[test]
fn two_causes_of_elements_and_a_complex_coefficient() {
    insta::assert_snapshot!(text(&two_causes(&[100.0, 150.0], 5.0)));
}

#[test]
fn no_gap_beyond_noise() {
    insta::assert_snapshot!(text(&no_gap(5.0)));
}

#[test]
fn many_heights_are_reduced_to_the_largest_shares() {
    let heights: Vec<f64> = (4..=20).map(|z| f64::from(z) * 10.0).collect();
    let mut diagnosis = explained(&heights, 10.0);
    diagnosis.scans.push("another".to_owned());
    let text = text(&diagnosis);
    assert!(text.contains("(and 5 more heights with smaller shares)"), "{text}");
    assert!(text.contains("scan 0, z = "), "{text}");
    assert!(text.contains("thesis-focus, another against corrected"), "{text}");
}

#[test]
fn verdict_words_follow_the_odds() {
    let diagnosis = explained(&[100.0], 10.0);
    let standings: Vec<Standing> =
        diagnosis.ranked.iter().map(|candidate| diagnosis.standing(candidate).0).collect();
    use Standing::{Best, RuledOut};
    assert_eq!(standings, [Best, RuledOut, RuledOut, RuledOut, RuledOut, RuledOut]);
    let rivals = ambiguous(10.0);
    assert_eq!(rivals.standing(&rivals.ranked[1]).0, Standing::Level);
    assert_eq!(rivals.contenders().len(), 2);
}

#[test]
fn the_json_has_the_documented_keys() {
    let json = serde_json::to_value(explained(&[50.0, 100.0], 10.0)).expect("JSON");
    assert_eq!(json["format"], 1);
    assert_eq!(json["verdict"], "explained");
    assert_eq!(json["where"]["regions"][0]["region"], "main-lobe");
    let speed = &json["ranked"][0]["parameters"]["sound-speed.c_m_s"];
    assert_eq!((&speed["value"], &speed["standard_error"]), (&347.1234.into(), &0.2061.into()));
}
