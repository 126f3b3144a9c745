//! Valid and invalid display files.

use proptest::prelude::*;

use super::*;

fn display(text: &str) -> Result<DisplayFile, Fault> {
    DisplayFile::parse(TomlSource::new(FilePath::new("scans/display.toml"), text))
}

const HEAD: &str = "name = \"d\"\nrig = \"../rigs/virtual.toml\"\n";

#[test]
fn missing_keys_have_defaults() {
    let file = display(&format!("{HEAD}[[focus]]\npath.point_mm = [0, 0, 100]\n")).expect("valid");
    assert_eq!(file.rig_path(), FilePath::new("scans/../rigs/virtual.toml"));
    assert_eq!((file.foci, file.solver, file.rounds.get()), (Foci::Together, Solver::Weighted, 50));
    assert!(file.modulation.is_none() && file.seconds.is_none());
    assert_eq!(file.output.element_db_at_300_mm.get(), 120.0);
    assert_eq!(file.schedule(), FocusSchedule::Together);
}

#[test]
fn every_modulation_and_path_is_read() {
    for (modulation, focus) in [
        (
            "am]\nfrequency_hz = 200\ndepth = 0.8\nwaveform = \"triangle\"\nof = \"force\"",
            "path.point_mm = [0, 0, 100]",
        ),
        (
            "pwm]\nfrequency_hz = 173.2\nduty_percent = 30",
            "path.points_mm = [[0, 0, 100], [9, 0, 100]]\ndwell_ms = 40",
        ),
        (
            "lateral]\nfrequency_hz = 50\namplitude_mm = 3\nalong = [0, 1, 0]",
            "path.point_mm = [0, 0, 100]",
        ),
        (
            "spatiotemporal]\nfrequency_hz = 100",
            "path.figure-of-eight = { centre_mm = [0, 0, 100], width_mm = 30 }",
        ),
        (
            "am]\nfrequency_hz = 200",
            "path.line = { from_mm = [0, 0, 100], to_mm = [9, 0, 100] }\nspeed_mm_s = 40\ndwell_ms = 5",
        ),
        (
            "am]\nfrequency_hz = 200",
            "path.polygon.corners_mm = [[0, 0, 90], [9, 0, 90], [0, 9, 90]]\nloops_per_s = 2",
        ),
    ] {
        let text = format!(
            "{HEAD}foci = {{ alternate_ms = 5.0 }}\n[modulation.{modulation}\n[[focus]]\n{focus}\n"
        );
        let file = display(&text).unwrap_or_else(|fault| panic!("{text}\n{fault}"));
        assert_eq!(file.tracks().len(), 1);
        assert_eq!(file.schedule(), FocusSchedule::Alternate(0.005));
    }
}

#[test]
fn contradictions_are_reported_at_their_line() {
    let still = "[[focus]]\npath.point_mm = [0, 0, 100]";
    let circle = "[[focus]]\npath.circle = { centre_mm = [0, 0, 100], radius_mm = 9 }";
    let places = "[[focus]]\npath.points_mm = [[0, 0, 100], [9, 0, 100]]";
    let refusals: Vec<String> = [
        format!("{still}\nspeed_mm_s = 3"),
        circle.to_owned(),
        format!("{circle}\nspeed_mm_s = 3\nloops_per_s = 2"),
        format!("{circle}\nspeed_mm_s = 3\ndwell_ms = 2"),
        format!("{circle}\nspeed_mm_s = -3"),
        places.to_owned(),
        format!("{places}\nspeed_mm_s = 3"),
        format!("{places}\ndwell_ms = 0"),
        format!("{still}\nlevel = 0"),
        format!("{still}\ncolour = 3"),
        format!("foci = \"sometimes\"\n{still}"),
        format!("[modulation.am]\nfrequency_hz = 200\ndepth = 1.5\n{still}"),
        format!("[modulation.am]\nfrequency_hz = 200\nwaveform = \"saw\"\n{still}"),
        format!("[modulation.pm]\nfrequency_hz = 200\n{still}"),
        format!("[modulation.pwm]\nfrequency_hz = 0\nduty_percent = 50\n{still}"),
        format!("[modulation.spatiotemporal]\nfrequency_hz = 200\n{still}"),
        format!("[modulation.spatiotemporal]\nfrequency_hz = 200\n{circle}\nspeed_mm_s = 3"),
        "focus = []".to_owned(),
        format!("{still}\n[picture]\nstep_mm = 0.001"),
        format!("{still}\n[picture]\nframes = 5000"),
    ]
    .iter()
    .map(|text| display(&format!("{HEAD}{text}\n")).expect_err(text).to_string())
    .collect();
    insta::assert_snapshot!(refusals.join("\n"));
}

proptest! {
    #[test]
    fn no_text_makes_the_parser_panic(text in "(\\[\\[focus\\]\\]\n)?(path\\.[a-z_-]{0,15} = )?[-\\[\\]{}a-z_0-9., =\"\n]{0,80}") {
        let _ = display(&format!("{HEAD}{text}"));
    }

    #[test]
    fn any_numbers_give_a_display_or_a_located_fault(
        radius in -10.0..50.0f64, speed in -100.0..500.0f64, z in -50.0..200.0f64, level in -1.0..2.0f64,
    ) {
        let text = format!("{HEAD}[[focus]]\npath.circle = {{ centre_mm = [0, 0, {z}], radius_mm = {radius} }}\nspeed_mm_s = {speed}\nlevel = {level}\n");
        let valid = radius > 0.0 && speed > 0.0 && z > 0.0 && level > 0.0;
        match display(&text) {
            Ok(_) => prop_assert!(valid),
            Err(fault) => prop_assert!(!valid && fault.line_column().is_some(), "{}", fault),
        }
    }
}

#[test]
fn the_level_of_a_focus_has_an_uncertainty_where_the_elements_have_one() {
    let budget = |u_db: Option<f64>| {
        let element_u_db = u_db.map(fieldgap_input::literal);
        Output { element_u_db, ..Output::default() }.level_budget()
    };
    assert_eq!(budget(None), None);
    // 1.5 and 2 dB are 2.5 dB.
    assert!((budget(Some(1.5)).expect("stated").expanded_db() - 5.0).abs() < 1e-12);
}
