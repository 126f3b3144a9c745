//! A scan with an I/Q receiver: amplitudes as those of a receiver without, and the phase of the field.

use std::path::Path;
use std::process::Command;

use fieldgap::acoustics::{Simulator, Vec3};
use fieldgap::comparison::{PlanePhase, Registering, compare};
use fieldgap::input::TomlSource;
use fieldgap::records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap::virtual_rig::{Visit, noise_free_coded_phasors};

fn scanned(folder: &Path, rig: &str) -> RecordedScan {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let out = folder.join(rig);
    let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .arg("scan")
        .arg(here.join("scans/quick-look.toml"))
        .arg("--rig")
        .arg(here.join("rigs").join(rig))
        .arg("--out")
        .arg(&out)
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    RecordedScan::open(&out).expect("a whole record")
}

/// The virtual rig and the simulator compute the field by code of their own; `iq-lab.toml` states offset and noise.
#[test]
fn an_iq_scan_records_the_phase_of_the_field_beside_the_amplitude() {
    let folder = tempfile::tempdir().expect("a folder");
    let plain = scanned(folder.path(), "virtual.toml");
    let phased = scanned(folder.path(), "virtual-iq.toml");
    assert!(plain.setup.phase.is_none() && plain.samples.iter().all(|s| s.phase_rad.is_none()));
    assert_eq!(phased.setup.phase.expect("stated").named(), ("drive-sync", "exp(-iwt)"));
    let driven = |scan: &RecordedScan| {
        scan.samples.iter().copied().filter(|sample| sample.focus.is_some()).collect::<Vec<_>>()
    };
    let (plain, samples) = (driven(&plain), driven(&phased));
    assert_eq!((plain.len(), samples.len()), (169, 169));
    for (one, other) in plain.iter().zip(&samples) {
        // Means of 16 samples with 1 % and 0.015 V of noise.
        let noise = (0.01 * one.reading).hypot(0.015) / 4.0;
        assert!((one.reading - other.reading).abs() < 8.0 * noise, "{one:?} {other:?}");
    }
    let simulation = phased.setup.simulation(Simulator::Rayleigh, 0).expect("a focus");
    let places: Vec<_> = samples.iter().map(|sample| sample.position_m()).collect();
    let turns = simulation.field(&places).into_iter().zip(&samples).map(|(pressure, sample)| {
        (sample.phase_rad.expect("a phase") - pressure.arg() - 0.7).sin()
    });
    let squares = turns.map(|turn| turn * turn).sum::<f64>() / samples.len() as f64;
    // Noise is 0.01 rad and 0.015 V of some volts, over 16 samples; the simulation has larger faces.
    assert!(squares.sqrt() < 0.03, "{}", squares.sqrt());
}

/// A scan of the virtual rig's field without noise: planes of 4 mm steps, 120 mm wide, under a plane wave drive.
fn noise_free(effects: &toml::Table, heights_mm: &[f64]) -> RecordedScan {
    let text = "format = 1\nname = \"phases\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
                [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\n\
                spacing_mm = 0.0\n[medium]\nspeed_of_sound_m_s = 343.0\n\
                [phase]\nreference = \"drive-sync\"\nconvention = \"exp(+iwt)\"\n\
                [simulator]\nmodel = \"piston\"\n[[focus]]\nphases = \"all-zero\"\n";
    let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good");
    let simulation = setup.simulation(Simulator::Piston, 0).expect("a drive");
    let along = |n: i32| 4e-3 * (f64::from(n) - 15.0);
    let visits: Vec<(usize, Visit)> = heights_mm
        .iter()
        .flat_map(|z_mm| (0..31).flat_map(move |y| (0..31).map(move |x| (x, y, *z_mm))))
        .map(|(x, y, z_mm)| Vec3::new(along(x), along(y), z_mm * 1e-3))
        .map(|position_m| (0, Visit { position_m, velocity_m_s: Vec3::zeros(), time_s: 0.0 }))
        .collect();
    let drives_s = [vec![0.0; 36]];
    let field = noise_free_coded_phasors(&simulation, effects, 1.0, &drives_s, &visits, 1);
    let field = field.expect("the effects fit");
    let mut samples = Vec::new();
    for (n, ((_, visit), (level, phase_rad))) in visits.iter().zip(field).enumerate() {
        let sample = RecordedSample::measured(n as f64, Some(0), visit.position_m, level, None);
        // The other convention, beside a reference with a phase of 2 rad.
        samples.push(sample.with_phase(Some(-(phase_rad + 2.0))));
    }
    RecordedScan { setup, samples }
}

fn phases_of(scan: &RecordedScan) -> Vec<PlanePhase> {
    let comparison = compare(scan, Simulator::Piston, Registering::GainOnly).expect("comparable");
    comparison.planes.into_iter().map(|plane| plane.phase.expect("phases")).collect()
}

/// The rig's elements vibrate as pistons, and their field is a Rayleigh integral; the simulation knows nothing of the faults.
#[test]
fn a_plane_brought_back_to_the_elements_shows_which_is_out() {
    let dead = toml::toml! { dead-elements = { elements = [14] } };
    let reversed = toml::toml! { polarity = { elements = [26] } };
    let none = toml::Table::new();
    let out = |effects: &toml::Table| {
        let phases = phases_of(&noise_free(effects, &[30.0, 60.0]));
        assert!(phases[1].hologram.is_none(), "the lowest plane is enough");
        phases[0].hologram.as_ref().expect("a hologram").outstanding()
    };
    assert_eq!(out(&none), []);
    let of_dead = out(&dead);
    assert_eq!(of_dead.iter().map(|one| one.element).collect::<Vec<_>>(), [14]);
    assert!(of_dead[0].ratio < 0.3, "{of_dead:?}");
    let of_reversed = out(&reversed);
    assert_eq!(of_reversed[0].element, 26);
    assert!(of_reversed[0].phase_rad.abs() > 2.5, "{of_reversed:?}");
}

/// Sound that is faster by a share e is late by k z e less at the height z: -0.55 rad over 60 mm for one per cent and a quarter.
#[test]
fn a_wrong_speed_of_sound_shows_as_a_phase_that_changes_with_the_height() {
    let faster = toml::toml! { sound-speed = { c_m_s = 347.3 } };
    let phases = phases_of(&noise_free(&faster, &[60.0, 120.0]));
    let k = std::f64::consts::TAU * 40e3;
    let expected = 0.06 * k * (1.0 / 347.3 - 1.0 / 343.0);
    let change = phases[1].mean_rad - phases[0].mean_rad;
    assert!((change / expected - 1.0).abs() < 0.1, "{change} {expected}");
    let none = phases_of(&noise_free(&toml::Table::new(), &[60.0, 120.0]));
    assert!(
        none.iter().all(|phase| phase.points == 961 && phase.rms_rad < 0.1),
        "{:?}",
        none[0].rms_rad
    );
}
