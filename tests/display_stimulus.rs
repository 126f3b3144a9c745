//! Computed stimuli of displays compared with closed forms, and their text.

use std::path::Path;
use std::process::Command;

use fieldgap::acoustics::radiation::{AIR_DENSITY_KG_M3, SkinInAir};
use fieldgap::acoustics::transducer::{Piston, Transducer};
use fieldgap::acoustics::{Array, Medium, Vec3};
use fieldgap::display::{
    ComposedDisplay, DisplayFile, Playback, RadiatingArray, Stimulus, compose, stimulus,
};
use fieldgap::input::TomlSource;
use fieldgap::level::{level_db, of_level_pa};
use fieldgap::rig::ArrayIdentity;

const MEDIUM: Medium = Medium { speed_of_sound_m_s: 343.0 };

fn array() -> Array {
    Array::square(6, 6, 10.5e-3).expect("not empty")
}

fn radiating(array: &Array) -> RadiatingArray<'_> {
    RadiatingArray { array, medium: MEDIUM, frequency_hz: 40e3, transducer: &Piston }
}

fn skin() -> SkinInAir {
    SkinInAir::new(MEDIUM, AIR_DENSITY_KG_M3)
}

fn display(text: &str) -> DisplayFile {
    let text = format!("name = \"test\"\nrig = \"rig.toml\"\n{text}");
    DisplayFile::parse(TomlSource::new(Path::new("test.toml"), text)).expect("valid")
}

/// A display for a controller with a number of clock steps per period.
fn composed(text: &str, period_steps: u32) -> (ComposedDisplay, Stimulus) {
    let array = array();
    let controller = ArrayIdentity {
        period_steps,
        clock_hz: 40e3 * f64::from(period_steps),
        ..ArrayIdentity::of_thesis(36, 40e3)
    };
    let composed = compose(&display(text), &radiating(&array), &controller).expect("it fits");
    let playback = Playback::new(&composed.program, radiating(&array), &controller, 120.0);
    let felt = stimulus(&composed, &playback, skin(), 40e3);
    (composed, felt)
}

/// The sound pressure where all elements arrive in phase, each 20 Pa rms at 300 mm on its axis, Pa rms.
fn in_phase_pa(at_m: Vec3) -> f64 {
    let wavenumber = MEDIUM.wavenumber_rad_m(40e3);
    array()
        .elements()
        .iter()
        .map(|element| {
            let way = at_m - element.centre_m;
            let angle = (way.z / way.norm()).acos();
            0.3 * of_level_pa(120.0) / way.norm()
                * Piston.directivity(angle, element.radius_m, wavenumber)
        })
        .sum()
}

#[test]
fn a_focus_has_the_sum_of_all_elements_at_the_intended_position() {
    let (_, felt) = composed(
        "[[focus]]\npath.circle = { centre_mm = [0, 0, 100], radius_mm = 12 }\nloops_per_s = 2\n",
        256,
    );
    let focus = &felt.foci[0];
    let closed = in_phase_pa(Vec3::new(0.012, 0.0, 0.1));
    assert!((focus.rms_pa / closed - 1.0).abs() < 5e-3, "{} {closed}", focus.rms_pa);
    assert!(focus.peak_off_mm.expect("a peak") < 0.6, "{focus:?}");
    assert!((focus.level_db - level_db(focus.rms_pa)).abs() < 1e-12);
    assert!((focus.of_threshold - focus.rms_pa / 8000.0).abs() < 1e-12);
}

#[test]
fn coarse_delays_reduce_the_pressure_by_their_rounding() {
    // Rounding to steps of 2π/n gives a uniform phase error of ±π/n: the mean of its cosine is sin(π/n)/(π/n).
    let text = "step_mm = 0.5\n[[focus]]\npath.circle = { centre_mm = [0, 0, 100], radius_mm = 12 }\nloops_per_s = 2\n";
    let (_, fine) = composed(text, 4096);
    for steps in [8, 16, 32] {
        let (_, coarse) = composed(text, steps);
        let half = std::f64::consts::PI / f64::from(steps);
        let ratio = coarse.foci[0].rms_pa / fine.foci[0].rms_pa;
        assert!(
            (ratio - half.sin() / half).abs() < 0.15 * (1.0 - half.sin() / half) + 5e-4,
            "{steps}: {ratio}"
        );
    }
}

#[test]
fn modulated_force_has_the_analytic_mean_and_amplitude() {
    let still = "[[focus]]\npath.point_mm = [5, -8, 110]\n";
    // ((1 + m s)/(1 + m))²: mean (1 + m²/2)/(1 + m)², and 2 m/(1 + m)² at the frequency.
    for depth in [1.0, 0.5] {
        let (composed, felt) = composed(
            &format!("[modulation.am]\nfrequency_hz = 200\ndepth = {depth}\n{still}"),
            256,
        );
        assert_eq!(composed.modulation_hz, Some(200.0));
        let focus = &felt.foci[0];
        let scale = (1.0f64 + depth).powi(2);
        assert!(
            (focus.steady_pa / focus.radiation_pa - (1.0 + 0.5 * depth * depth) / scale).abs()
                < 5e-3,
            "{focus:?}"
        );
        let swing = focus.swinging_pa.expect("modulated") / focus.radiation_pa;
        assert!((swing - 2.0 * depth / scale).abs() < 5e-3, "{swing}");
    }
    // Duty cycle d: mean d, and 2/π sin(π d) at the frequency.
    let (_, felt) =
        composed(&format!("[modulation.pwm]\nfrequency_hz = 100\nduty_percent = 30\n{still}"), 256);
    let focus = &felt.foci[0];
    assert!((focus.steady_pa / focus.radiation_pa - 0.3).abs() < 1e-3);
    let closed = 2.0 / std::f64::consts::PI * (0.3 * std::f64::consts::PI).sin();
    assert!((focus.swinging_pa.expect("modulated") / focus.radiation_pa - closed).abs() < 1e-3);
}

#[test]
fn simultaneous_foci_share_the_intensity() {
    // The sum of the intensities is constant: two distant foci have at best 1/√2 of the pressure each.
    let (composed, felt) = composed(
        "[[focus]]\npath.point_mm = [-20, 0, 100]\n[[focus]]\npath.point_mm = [20, 0, 100]\n",
        256,
    );
    let one = in_phase_pa(Vec3::new(0.02, 0.0, 0.1));
    let both: f64 = felt.foci.iter().map(|focus| focus.rms_pa.powi(2)).sum();
    assert!((0.75..1.05).contains(&(both.sqrt() / one)), "{} of {one}", both.sqrt());
    let quality = composed.quality.expect("two foci");
    assert!(quality.uniformity > 0.95 && quality.efficiency > 0.7, "{quality:?}");
    let levels: Vec<f64> = felt.foci.iter().map(|focus| focus.rms_pa).collect();
    assert!((levels[0] / levels[1] - 1.0).abs() < 0.03, "{levels:?}");
}

#[test]
fn lateral_and_spatiotemporal_modulation_keep_full_drive() {
    let (lateral, felt) = composed(
        "[modulation.lateral]\nfrequency_hz = 200\namplitude_mm = 4\n[[focus]]\npath.point_mm = [0, 0, 100]\n",
        256,
    );
    assert_eq!(lateral.program.loop_periods(), 200);
    assert!(felt.foci[0].least_pa > 0.95 * in_phase_pa(Vec3::new(0.0, 0.0, 0.1)));
    assert!(felt.foci[0].swinging_pa.expect("it moves") > 0.05 * felt.foci[0].radiation_pa);
    let (around, _) = composed(
        "[modulation.spatiotemporal]\nfrequency_hz = 173.2\n[[focus]]\npath.figure-of-eight = { centre_mm = [0, 0, 100], width_mm = 30 }\n",
        256,
    );
    assert_eq!(around.program.loop_periods(), 231);
    assert!((around.modulation_hz.expect("it moves") - 40e3 / 231.0).abs() < 1e-9);
}

/// Standard output of the program.
fn stdout(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .expect("it starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn the_example_displays_are_summarised_in_a_table() {
    for name in ["display-circle", "display-three-foci", "display-alternate"] {
        insta::assert_snapshot!(
            name,
            stdout(&["simulate", "--display", &format!("scans/{name}.toml")])
        );
    }
}

#[test]
fn pictures_and_frames_are_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("text");
    stdout(&["simulate", "--display", "scans/display-three-foci.toml", "--out", out]);
    let moving = std::fs::read(folder.path().join("display-moving.png")).expect("written");
    let reader = png::Decoder::new(std::io::Cursor::new(moving)).read_info().expect("a PNG");
    assert_eq!(reader.info().animation_control().map(|all| all.num_frames), Some(16));
    assert!(folder.path().join("display.png").exists());
    let frames = std::fs::read_to_string(folder.path().join("frames.csv")).expect("written");
    assert_eq!(frames.lines().count(), 1 + 16 * 3);
}
