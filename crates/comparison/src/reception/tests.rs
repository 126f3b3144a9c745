use std::path::Path;

use super::*;
use fieldgap_input::TomlSource;

fn setup(array: &str, receiver: &str) -> ScanSetup {
    let text = format!(
        "format = 1\nname = \"n\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n[array]\nfrequency_hz = 40000.0\n{array}\
         element_diameter_mm = 10.5\nspacing_mm = 0.0\n[medium]\ntemperature_c = 20.0\nhumidity_percent = 50.0\n\
         [receiver]\nsensitivity_v_pa = 0.003\nsensitivity_u_percent = 5.0\nreads = \"rms\"\n{receiver}\
         [simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 80.0\n"
    );
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good")
}

const SQUARE: &str = "layout = \"square\"\ncolumns = 12\nrows = 12\n";
const ONE: &str = "layout = \"linear\"\ncount = 1\n";

fn heard(array: &str, receiver: &str, at_m: Vec3) -> (f64, Reception, Sensitivity) {
    let setup = setup(array, receiver);
    let sensitivity = setup.receiver.clone().expect("stated");
    let reception = Reception::at(&setup, Simulator::Piston, 0, at_m).expect("sound");
    (reception.heard_db(&sensitivity), reception, sensitivity)
}

#[test]
fn a_face_over_a_focus_reads_the_mean_pressure_over_it() {
    let (radius_m, focus) = (4.5e-3, Vec3::new(0.0, 0.0, 0.08));
    let face = "face_radius_mm = 4.5\nface_radius_u_mm = 0.2\n";
    let (heard_db, reception, _) = heard(SQUARE, face, focus);
    // The complex mean over the disc, ring by ring.
    let rings = 24;
    let (mut sum, mut weight) = (Complex64::ZERO, 0.0);
    for ring in 0..rings {
        let r = radius_m * (f64::from(ring) + 0.5) / f64::from(rings);
        let points: Vec<Vec3> = (0..48)
            .map(|n| {
                let angle = std::f64::consts::TAU * f64::from(n) / 48.0;
                focus + Vec3::new(r * angle.cos(), r * angle.sin(), 0.0)
            })
            .collect();
        let mean: Complex64 =
            reception.kernel(0.0, 0.0).at(&points).iter().sum::<Complex64>() / 48.0;
        sum += mean * r;
        weight += r;
    }
    let middle = reception.kernel(0.0, 0.0).at(&[focus])[0];
    let mean_db = 20.0 * ((sum / weight).norm() / middle.norm()).log10();
    assert!(mean_db < -1.0, "the face is as wide as the focus: {mean_db}");
    assert!((heard_db - mean_db).abs() < 0.05, "{heard_db} {mean_db}");
}

#[test]
fn a_plane_wave_is_heard_by_the_response_at_its_angle() {
    let response = "response_angle_deg = [0.0, 30.0, 60.0]\nresponse_db = [0.0, -2.0, -6.0]\nresponse_u_db = 0.3\n";
    let at_m = Vec3::new(0.3 * 45f64.to_radians().sin(), 0.0, 0.3 * 45f64.to_radians().cos());
    let (heard_db, ..) = heard(ONE, response, at_m);
    assert!((heard_db + 4.0).abs() < 1e-6, "{heard_db}");
    let (point_db, ..) = heard(ONE, "", at_m);
    assert_eq!(point_db, 0.0);
}

#[test]
fn the_field_of_one_element_has_the_gradient_of_a_spherical_wave() {
    let keys = "place_u_mm = 0.1\ntemperature_u_c = 1.0\n";
    let (_, reception, sensitivity) = heard(ONE, keys, Vec3::new(0.0, 0.0, 0.1));
    let lines = reception.lines(&sensitivity);
    let line = |name: &str| lines.iter().find(|line| line.source == name).expect("a line").clone();
    // 20/ln 10 dB per relative change of 1/d, 0.0869 dB/mm at 100 mm; absorption adds 0.0013.
    assert!((line("place").sensitivity_db - 0.0882).abs() < 2e-4, "{lines:?}");
    // On the axis of one element, air changes the density, 1/293 per kelvin, and the absorption over 0.1 m.
    let temperature = line("temperature of the air");
    let absorption_db_m = |temperature_c: f64| {
        fieldgap_acoustics::Air { temperature_c, humidity_percent: 50.0, pressure_kpa: 101.325 }
            .attenuation_db_m(40e3)
    };
    let closed = -8.6859 / 293.15 - 0.1 * (absorption_db_m(21.0) - absorption_db_m(19.0)) / 2.0;
    assert!((temperature.sensitivity_db - closed).abs() < 1e-5, "{temperature:?} {closed}");
    assert!(!temperature.assumed && line("relative humidity").assumed);
    assert!(lines.iter().all(|line| line.source != "angle of incidence"), "a point hears alike");
}

#[test]
fn no_drive_gives_no_reception() {
    let setup = setup(ONE, "");
    assert!(Reception::at(&setup, Simulator::Piston, 1, Vec3::new(0.0, 0.0, 0.1)).is_none());
}
