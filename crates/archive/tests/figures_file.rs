//! `figures.json` and the names of its figures.

use std::fs;
use std::path::Path;

use fieldgap_acoustics::Simulator;
use fieldgap_archive::{CauseFigures, HeightFigures, RecordFigures, SeriesName};
use fieldgap_diagnosis::{EffectId, Verdict};
use fieldgap_text::Uncertain;
use proptest::prelude::*;

fn figure(value: f64) -> Uncertain {
    Uncertain { value, standard_error: 0.01 }
}

fn height(focus: usize, z_mm: f64) -> HeightFigures {
    HeightFigures {
        focus,
        z_mm,
        gap: figure(0.1),
        correlation: figure(0.99),
        peak_ratio: Some(figure(1.02)),
        peak_offset_mm: None,
        focal_radius_mm: Some(Uncertain { value: -0.3, standard_error: f64::NAN }),
    }
}

fn figures(heights: Vec<HeightFigures>) -> RecordFigures {
    RecordFigures {
        format: 1,
        software: "fieldgap".to_owned(),
        simulator: Simulator::Piston,
        points: 100,
        gap: figure(0.12),
        noise_floor: 0.02,
        level: figure(8500.0),
        correlation: figure(0.98),
        heights,
        cause: None,
        air: None,
    }
}

fn cause() -> CauseFigures {
    CauseFigures {
        verdict: Verdict::Explained,
        effects: vec![EffectId::SoundSpeed],
        probability: 0.97,
        parameters: [("sound-speed.c_m_s".to_owned(), figure(346.0))].into(),
    }
}

fn names(figures: &RecordFigures) -> Vec<String> {
    figures.series().into_iter().map(|(name, _)| name.to_string()).collect()
}

fn json(figures: &RecordFigures) -> String {
    serde_json::to_string(figures).expect("JSON")
}

#[test]
fn figures_read_back_as_they_were_written() {
    let record = tempfile::tempdir().expect("a folder");
    let report = record.path().join("report");
    assert!(RecordFigures::read(record.path()).expect("none yet").is_none());
    fs::create_dir_all(report.join("why")).expect("made");
    let plain = figures(vec![height(0, 100.0)]);
    plain.write(&report).expect("written");
    let read = RecordFigures::read(record.path()).expect("good").expect("there");
    // As text, in which NaN equals NaN.
    assert_eq!(json(&read), json(&plain));
    // The cause of a diagnosis of the same simulator is taken, that of another is not.
    let other =
        RecordFigures { simulator: Simulator::Corrected, cause: Some(cause()), ..plain.clone() };
    other.write(&report.join("why")).expect("written");
    assert!(RecordFigures::read(record.path()).expect("good").expect("there").cause.is_none());
    RecordFigures { cause: Some(cause()), ..plain }.write(&report.join("why")).expect("written");
    let read = RecordFigures::read(record.path()).expect("good").expect("there");
    assert_eq!(read.cause, Some(cause()));
    assert!(names(&read).contains(&"sound-speed.c_m_s".to_owned()));
}

#[test]
fn other_files_are_refused_with_the_reason() {
    let good = json(&figures(Vec::new()));
    let later = "{\"format\":2,\"gaps\":[]}".to_owned();
    let negative = good.replace("0.12", "-0.12");
    let unknown = good.replace("piston", "magic");
    for (text, reason) in [
        (later, "format 2"),
        (negative, "below zero"),
        (unknown, "magic"),
        (String::new(), "no figures"),
    ] {
        let fault = RecordFigures::parse(Path::new("figures.json"), &text).expect_err("refused");
        assert!(fault.to_string().contains(reason), "{fault}");
    }
}

#[test]
fn names_do_not_depend_on_a_robots_scatter() {
    let at = |z_mm| names(&figures(vec![height(0, z_mm), height(1, z_mm)]));
    assert_eq!(at(99.9), at(100.1));
    assert_eq!(
        at(100.0)[4..7],
        ["z100.focus0.gap", "z100.focus0.correlation", "z100.focus0.peak_ratio"]
    );
    assert_eq!(names(&figures(vec![height(2, 12.5)]))[4], "z12.5.focus2.gap");
    // Both within a quarter of a millimetre of 100 mm.
    let near = names(&figures(vec![height(0, 99.9), height(0, 100.1)]));
    assert!(
        near.contains(&"z99.9.focus0.gap".to_owned())
            && near.contains(&"z100.1.focus0.gap".to_owned())
    );
}

proptest! {
    #[test]
    fn names_are_all_different(heights in prop::collection::btree_set((0usize..3, 0i32..400), 0..40)) {
        // Planes of one drive are more than a tenth of a millimetre apart.
        let heights = heights.into_iter().map(|(focus, z)| height(focus, 50.0 + 0.11 * f64::from(z))).collect();
        let mut names = names(&figures(heights));
        let count = names.len();
        names.sort();
        names.dedup();
        prop_assert_eq!(names.len(), count);
    }

    #[test]
    fn a_name_reads_back_and_has_no_white_space(text in "\\PC{0,20}|[a-z._-]{0,120}") {
        if let Ok(name) = text.parse::<SeriesName>() {
            prop_assert_eq!(name.as_str(), text);
            prop_assert!(!name.as_str().is_empty() && !name.as_str().contains(char::is_whitespace));
        }
    }
}
