//! Known transducers, recovered from noisy logs.

mod transducer_synthetic;

use fieldgap::characterization::{
    AxisLaw, Characterization, Constant, LobeLaw, PairFit, Readings, appendix_a, characterize,
};
use fieldgap::records::RecordedScan;
use fieldgap::records::import::{ThesisLog, ThesisLogSetup, TransducerAxis};
use transducer_synthetic::{Axis, log, write};

/// The thesis's own fits, z in centimetres and θ in degrees.
fn thesis_field(_distance_m: f64, height_m: f64, angle_deg: f64) -> f64 {
    1.115436
        * (-0.052927 * height_m * 100.0).exp()
        * 1.071272
        * (-((angle_deg + 4.108851) / 35.458904).powi(2)).exp()
}

fn scan(text: &str) -> RecordedScan {
    let folder = tempfile::tempdir().expect("a folder");
    let log = ThesisLog::read(&write(folder.path(), text)).expect("a log");
    let of_thesis = ThesisLogSetup::of_thesis("one", jiff::Timestamp::UNIX_EPOCH);
    log.into_scan(ThesisLogSetup { axis: TransducerAxis::At([0.0, 0.0]), ..of_thesis })
}

fn found(text: &str) -> Characterization {
    characterize(&Readings::of(&scan(text), 20.0).expect("enough heights")).expect("a fit")
}

/// Deviation of a constant from the known value, in standard errors.
fn pull(constant: &Constant, known: f64) -> f64 {
    (constant.value - known) / constant.standard_error
}

fn thesis_pulls(pair: &PairFit) -> [f64; 4] {
    // The two amplitudes of the thesis are not determined separately; their product is.
    [
        pull(&pair.amplitude, 1.115436 * 1.071272),
        pull(&pair.axis_constants[0], 0.052927),
        pull(&pair.lobe_constants[0], -4.108851),
        pull(&pair.lobe_constants[1], 35.458904),
    ]
}

#[test]
fn constants_of_the_thesis_model_are_recovered_within_their_standard_errors() {
    let mut squares = [0.0; 4];
    let draws = 6;
    for seed in 0..draws {
        let found = found(&log(Axis::default(), 0.004, seed, thesis_field));
        let best = found.best();
        assert_eq!((best.axis_law, best.lobe_law), (AxisLaw::Exponential, LobeLaw::OffsetGaussian));
        assert!(found.pairs[1].bic - best.bic > 10.0, "seed {seed}");
        let pulls = thesis_pulls(best);
        assert!(pulls.iter().all(|pull| pull.abs() < 3.5), "seed {seed}: {pulls:?}");
        squares.iter_mut().zip(pulls).for_each(|(sum, pull)| *sum += pull * pull);
    }
    // Chi-squared with six degrees of freedom lies between 0.7 and 19 in 99 % of cases.
    for sum in squares {
        assert!((0.5..20.0).contains(&sum), "{squares:?}");
    }
}

#[test]
fn a_tilted_axis_is_found_between_grid_points() {
    let axis = Axis { foot_mm: [6.3, -4.7], lean: [0.05, -0.03] };
    let found = found(&log(axis, 0.004, 3, thesis_field));
    let (pose, errors) = (found.best().axis, found.best().axis_errors);
    for side in 0..2 {
        let apart_m = pose.foot_m[side] - axis.foot_mm[side] * 1e-3;
        assert!(apart_m.abs() < 3.5 * errors.foot_m[side] && apart_m.abs() < 0.5e-3, "{pose:?}");
        let apart = pose.lean[side] - axis.lean[side];
        assert!(apart.abs() < 3.5 * errors.lean[side] && apart.abs() < 2e-3, "{pose:?}");
    }
    assert!(thesis_pulls(found.best()).iter().all(|pull| pull.abs() < 3.5));
}

#[test]
fn a_piston_in_absorbing_air_is_distinguished_from_the_thesis_model() {
    let field = |distance_m: f64, _: f64, angle_deg: f64| {
        let x = std::f64::consts::TAU * 40e3 / 343.0 * 5.2e-3 * angle_deg.to_radians().sin();
        let lobe = if x < 1e-6 { 1.0 } else { 2.0 * libm::j1(x) / x };
        0.1 * (-0.6 * distance_m).exp() / distance_m * lobe.abs()
    };
    let found = found(&log(Axis::default(), 0.001, 5, field));
    let best = found.best();
    assert_eq!((best.axis_law, best.lobe_law), (AxisLaw::Absorbed, LobeLaw::Piston));
    assert!(pull(&best.lobe_constants[0], 5.2).abs() < 3.5, "{:?}", best.lobe_constants);
    let attenuation_db_m = 0.6 * 20.0 / std::f64::consts::LN_10;
    assert!(
        pull(&best.axis_constants[0], attenuation_db_m).abs() < 3.5,
        "{:?}",
        best.axis_constants
    );
    let file = found.transducer_file("mine", "a test").text().to_owned();
    assert!(file.contains("law = \"absorbed\"") && file.contains("law = \"piston\""), "{file}");
    let again = fieldgap::records::TransducerFile::parse(&fieldgap::input::TomlSource::new(
        std::path::Path::new("mine.toml"),
        file,
    ));
    assert!(
        (again.expect("reads back").face_radius_m().expect("a radius") - 5.2e-3).abs() < 0.1e-3
    );
}

#[test]
fn angles_of_the_lobe_are_the_same_at_every_height() {
    let width_deg: f64 = 30.0;
    let field = |distance_m: f64, _: f64, angle_deg: f64| {
        0.1 / distance_m * (-(angle_deg / width_deg).powi(2)).exp()
    };
    let found = found(&log(Axis::default(), 1e-4, 7, field));
    assert_eq!(found.best().lobe_law, LobeLaw::Gaussian);
    let near: Vec<_> = found.profile.angles.iter().filter(|angle| angle.height_m > 0.1).collect();
    assert!(near.len() > 30, "{}", near.len());
    for angle in near {
        // exp(-(θ/w)²) has fallen by L dB at θ = w sqrt(L ln(10)/20).
        let known = width_deg * (-angle.level_db * std::f64::consts::LN_10 / 20.0).sqrt();
        assert!((angle.angle_rad.to_degrees() - known).abs() < 1.0, "{angle:?} {known}");
    }
}

#[test]
fn the_thesis_script_recovers_decay_and_lobe() {
    let found = appendix_a(&scan(&log(Axis::default(), 0.0, 1, thesis_field))).expect("a log");
    let value = |constants: &[Constant], index: usize| constants[index].value;
    // The decay is exact. The lobe is relative to the axis, where the off-axis Gaussian is below its peak, so its amplitude is
    // 1/p2(0). Subtracting the smallest reading shifts the other constants.
    let of_axis = 1.0 / (-(4.108851_f64 / 35.458904).powi(2)).exp();
    assert!((value(&found.on_axis.constants, 1) + 0.052927).abs() < 3e-4, "{found:?}");
    assert!((value(&found.lobe.constants, 0) - of_axis).abs() < 2e-3, "{found:?}");
    assert!((value(&found.lobe.constants, 1) + 4.108851).abs() < 0.1, "{found:?}");
    assert!((value(&found.lobe.constants, 2) - 35.458904).abs() < 0.4, "{found:?}");
    assert!(found.on_axis.r_squared > 0.9999 && found.lobe.r_squared > 0.9999);
}
