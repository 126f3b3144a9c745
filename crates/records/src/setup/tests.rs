use std::num::NonZeroU32;

use proptest::prelude::*;

use super::*;
use crate::{PossibleReflection, Rims};
use fieldgap_acoustics::{Element, Excitation, Vec3};
use fieldgap_input::{Finite, Frequency, Gap, Length, SoundSpeed, literal};
use fieldgap_level::Reads;

const EXAMPLE: &str = r#"format = 1
name = "focus-planes"
recorded = 2026-11-20T17:00:00Z
reading = "V"

[array]
frequency_hz = 40000.0
layout = "square"
columns = 6
rows = 6
element_diameter_mm = 10.5
spacing_mm = 0.0

[medium]
speed_of_sound_m_s = 343.0

[simulator]
model = "corrected"

[[focus]]
x_mm = 17.5
y_mm = -22.5
z_mm = 100.0
"#;

fn parse(text: &str) -> Result<ScanSetup, Fault> {
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text))
}

#[test]
fn the_example_of_the_format_is_read() {
    let setup = parse(EXAMPLE).expect("good");
    assert_eq!(setup.name, "focus-planes");
    assert_eq!(setup.recorded.to_string(), "2026-11-20T17:00:00Z");
    assert_eq!(setup.unit, "V");
    let simulation = setup.simulation(Simulator::Piston, 0).expect("one focus");
    assert_eq!(simulation.array.len(), 36);
    assert_eq!(simulation.frequency_hz, 40e3);
    assert_eq!(simulation.excitation, Excitation::Focus(Vec3::new(0.0175, -0.0225, 0.1)));
    assert_eq!(setup.simulation(Simulator::Piston, 1), None);
}

#[test]
fn what_is_written_is_the_example_again() {
    let written = parse(EXAMPLE).expect("good").to_toml().expect("writable");
    assert_eq!(written, EXAMPLE);
}

#[test]
fn the_meaning_of_phases_is_read() {
    let with = |keys: &str| {
        parse(&EXAMPLE.replace("[simulator]", &format!("[phase]\n{keys}\n[simulator]")))
    };
    let known = "reference = \"drive-sync\"\nconvention = \"exp(+iwt)\"";
    let phase = with(known).expect("good").phase.expect("stated");
    assert_eq!((phase.convention.turned(0.5), phase.drift_u_rad()), (-0.5, 0.1));
    let stated = with(&format!("{known}\ndrift_u_rad = 0.02")).expect("good").phase;
    assert_eq!(stated.expect("stated").drift_u_rad(), 0.02);
    for wrong in
        ["reference = \"drive-sync\"", "convention = \"exp(iwt)\"\nreference = \"drive-sync\""]
    {
        assert!(with(wrong).is_err(), "{wrong}");
    }
    assert!(with(&format!("{known}\ndrift_u_rad = -1.0")).is_err());
}

#[test]
fn how_well_the_set_up_is_known_is_read() {
    let with = |keys: &str| {
        parse(&EXAMPLE.replace("[simulator]", &format!("[uncertainty]\n{keys}\n[simulator]")))
    };
    let keys = "element_gain = 0.08\nreflection = { height_mm = 420, coefficient = 0.02 }";
    let stated = with(keys).expect("good").uncertainty.expect("stated");
    let reflection = PossibleReflection { height_mm: literal(420.0), coefficient: literal(0.02) };
    let known = SetupUncertainty {
        element_gain: Some(literal(0.08)),
        reflection: Some(reflection),
        ..SetupUncertainty::default()
    };
    assert_eq!(stated, known);
    for wrong in ["element_gain = 8", "origin_mm = 0", "gain = 0.1", "reflection = 0.02"] {
        let fault = with(wrong).expect_err(wrong);
        assert_eq!(fault.line_column().map(|place| place.0), Some(18), "{wrong}: {fault}");
    }
}

#[test]
fn faults_are_placed() {
    let cases = [
        ("format = 1", "format = 2", 1, "format 2"),
        ("17:00:00Z", "17:00:00", 3, "not a point in time"),
        ("reading", "readings", 4, "readings"),
        ("\"corrected\"", "\"perfect\"", 18, "perfect"),
        ("x_mm = 17.5\n", "", 20, "`x_mm`"),
        ("x_mm = 17.5\ny_mm = -22.5\nz_mm = 100.0", "phases_rad = [0.0]", 20, "36 elements"),
        ("[medium]\nspeed_of_sound_m_s = 343.0\n", "", 1, "medium"),
        ("[simulator]", "[receiver]\nreads = \"rms\"\n[simulator]", 17, "`sensitivity_v_pa`"),
        ("[simulator]", "[receiver]\nrated = \"rms\"\n[simulator]", 18, "rated"),
    ];
    for (from, to, line, said) in cases {
        let text = EXAMPLE.replace(from, to);
        assert_ne!(text, EXAMPLE);
        let fault = parse(&text).expect_err(to);
        assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{to}: {fault}");
        assert!(fault.problem().contains(said), "{to}: {fault}");
    }
}

#[test]
fn a_sensitivity_fits_the_unit_of_the_readings() {
    let receiver = "[receiver]\nsensitivity_v_pa = 0.003\nsensitivity_u_percent = 5.0\nreads = \"rms\"\n\n[simulator]";
    let text = EXAMPLE.replace("[simulator]", receiver);
    let setup = parse(&text).expect("good");
    let pa = setup.receiver.as_ref().expect("a sensitivity").rms_pa_of(&setup.unit);
    assert!((pa.expect("volts") - 1.0 / 0.003).abs() < 1e-9);
    assert_eq!(setup.to_toml().expect("writable"), text);
    let fault = parse(&text.replace("\"V\"", "\"count\"")).expect_err("not in volts");
    assert_eq!(fault.line_column().map(|place| place.0), Some(17), "{fault}");
}

#[test]
fn a_year_that_toml_cannot_write_is_refused() {
    let setup = ScanSetup { recorded: Timestamp::MIN, ..parse(EXAMPLE).expect("good") };
    assert!(setup.to_toml().is_err());
}

fn any_length() -> impl Strategy<Value = Length> {
    (1e-6..1e5f64).prop_map(|value| Length::new(value).expect("above zero"))
}

fn any_frequency() -> impl Strategy<Value = Frequency> {
    (1e3..1e7f64).prop_map(|value| Frequency::new(value).expect("in range"))
}

prop_compose! {
    fn any_rims()(diameter_mm in any_length(), spacing_mm in 0.0..1e3f64) -> Rims {
        Rims { diameter_mm, spacing_mm: Gap::new(spacing_mm).expect("above zero") }
    }
}

fn any_lattice() -> impl Strategy<Value = Layout> {
    let count = || (1u32..20).prop_filter_map("above zero", NonZeroU32::new);
    prop_oneof![
        (count(), count(), any_rims()).prop_map(|(columns, rows, rims)| Layout::Square {
            columns,
            rows,
            rims
        }),
        (count(), any_rims()).prop_map(|(count, rims)| Layout::Linear { count, rims }),
        (0u32..5, any_rims()).prop_map(|(rings, rims)| Layout::Hexagonal { rings, rims }),
        (0u32..4, any_rims()).prop_map(|(rings, rims)| Layout::HexagonalThesis { rings, rims }),
        (3u32..20, any::<u32>(), any_rims()).prop_filter_map(
            "above zero",
            |(count, seed, rims)| {
                Some(Layout::Random { count: NonZeroU32::new(count)?, seed, rims })
            }
        ),
    ]
}

prop_compose! {
    fn any_element()(
        at_um in [-90_000i32..90_000, -90_000i32..90_000, 0i32..30_000],
        direction in [-1.0..1.0f64, -1.0..1.0f64, 0.1..1.0f64],
        amplitude in 0.0..2.0f64,
        phase_rad in -4.0..4.0f64,
    ) -> Element {
        Element {
            centre_m: Vec3::from(at_um.map(|um| f64::from(um) / 1e3)) / 1e3,
            normal: Vec3::from(direction).normalize(),
            radius_m: 0.0045,
            amplitude,
            phase_rad,
        }
    }
}

fn any_array() -> impl Strategy<Value = ArraySection> {
    prop_oneof![
        (any_frequency(), any_lattice()).prop_map(|(frequency_hz, layout)| {
            ArraySection::of_layout(frequency_hz, layout).expect("room for few elements")
        }),
        (any_frequency(), prop::collection::vec(any_element(), 1..5)).prop_map(
            |(frequency_hz, elements)| {
                ArraySection::of_elements(frequency_hz, elements).expect("some elements")
            }
        ),
    ]
}

fn any_medium() -> impl Strategy<Value = MediumSection> {
    let finite = |range: std::ops::Range<f64>| {
        range.prop_map(|value| Finite::new(value).expect("a range of finite numbers"))
    };
    prop_oneof![
        (100.0..2e3f64).prop_map(|speed| MediumSection::SpeedOfSound(
            SoundSpeed::new(speed).expect("in range")
        )),
        (finite(-20.0..50.0), finite(0.0..100.0), finite(60.0..110.0)).prop_map(
            |(temperature_c, humidity_percent, pressure_kpa)| MediumSection::Air {
                temperature_c,
                humidity_percent,
                pressure_kpa,
            }
        ),
    ]
}

fn any_focus(elements: usize) -> impl Strategy<Value = FocusSection> {
    let phases = prop::collection::vec(-7.0..7.0f64, elements);
    prop_oneof![
        [-1e3..1e3f64, -1e3..1e3f64, -1e3..1e3f64].prop_map(|at| FocusSection::Point(at.into())),
        Just(FocusSection::AllZero),
        phases.prop_map(FocusSection::Phases),
    ]
}

fn any_receiver() -> impl Strategy<Value = Option<Sensitivity>> {
    let known = (1e-6..1e3f64, 0.0..50.0f64).prop_map(|(readings, percent)| {
        let keys = SensitivityKeys {
            sensitivity_reading_pa: Some(literal(readings)),
            sensitivity_u_percent: Some(literal(percent)),
            reads: Some(Reads::Peak),
            ..SensitivityKeys::default()
        };
        let sensitivity = Sensitivity::of_keys(keys).expect("good").expect("a sensitivity");
        sensitivity.placed_within(1e-4)
    });
    proptest::option::of(known)
}

fn any_phase() -> impl Strategy<Value = Option<PhaseSection>> {
    use crate::{PhaseConvention, PhaseReference};
    let reference =
        prop::sample::select(vec![PhaseReference::DriveSync, PhaseReference::EachDrive]);
    let convention =
        prop::sample::select(vec![PhaseConvention::MinusIwt, PhaseConvention::PlusIwt]);
    let drift_u_rad = prop::option::of((0.0..7.0f64).prop_map(literal));
    let section = (reference, convention, drift_u_rad);
    prop::option::of(section.prop_map(|(reference, convention, drift_u_rad)| PhaseSection {
        reference,
        convention,
        drift_u_rad,
    }))
}

fn any_uncertainty() -> impl Strategy<Value = Option<SetupUncertainty>> {
    let of_elements = (prop::option::of(0.0..=1.0f64), prop::option::of(1e-3..3.0f64));
    let of_place = (prop::option::of(1e-2..10.0f64), prop::option::of(1e-2..5.0f64));
    let of_waves = (prop::option::of(0.0..=1.0f64), prop::option::of((1.0..3e3f64, 0.0..=1.0f64)));
    let all = (of_elements, of_place, of_waves);
    prop::option::of(all.prop_map(|((gain, phase_rad), (origin_mm, kelvin), (drift, plane))| {
        SetupUncertainty {
            element_gain: gain.map(literal),
            element_phase_rad: phase_rad.map(literal),
            origin_mm: origin_mm.map(literal),
            temperature_k: kelvin.map(literal),
            level_drift: drift.map(literal),
            reflection: plane.map(|(height_mm, coefficient)| PossibleReflection {
                height_mm: literal(height_mm),
                coefficient: literal(coefficient),
            }),
        }
    }))
}

fn any_setup() -> impl Strategy<Value = ScanSetup> {
    any_array().prop_flat_map(|array| {
        let foci = prop::collection::vec(any_focus(array.array().len()), 1..3);
        let seconds = 0i64..4_000_000_000;
        let simulator = prop::sample::select(Simulator::ALL.to_vec());
        let medium = (any_medium(), (any_receiver(), any_phase(), any_uncertainty()));
        ("\\PC{0,12}", seconds, "[a-zA-Z\"\\\\]{1,8}", medium, simulator, foci).prop_map(
            move |(
                name,
                seconds,
                unit,
                (medium, (receiver, phase, uncertainty)),
                simulator,
                foci,
            )| ScanSetup {
                name,
                recorded: Timestamp::from_second(seconds).expect("this century or the next"),
                unit,
                array: array.clone(),
                medium,
                receiver,
                phase,
                uncertainty,
                simulator,
                foci,
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_setup_reads_back_equal(setup in any_setup()) {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, bytes) in setup.files().expect("writable") {
            std::fs::write(folder.path().join(name), bytes).expect("written");
        }
        let again = ScanSetup::read(&folder.path().join("scan.toml"));
        prop_assert_eq!(again.expect("what was written reads"), setup);
    }
}
