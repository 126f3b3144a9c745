//! A scan with an I/Q receiver: amplitudes as those of a receiver without, and the phase of the field.

use std::path::Path;
use std::process::Command;

use fieldgap::acoustics::Simulator;
use fieldgap::records::RecordedScan;

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
