//! The simulation at each reading of a scan, as a comparison registered it.

use super::comparison::Comparison;
use super::receiver_face::simulation_with_receiver_face;
use fieldgap_acoustics::Vec3;
use fieldgap_records::RecordedScan;

/// The simulation at the place of each sample, in the reading's unit and the order of the scan: at the pose and the gain of a comparison of
/// the same scan. NaN where the array was silent.
pub fn simulated_readings(scan: &RecordedScan, comparison: &Comparison) -> Vec<f64> {
    let registration = &comparison.registration;
    let (pose, gain) = (registration.pose(), registration.gain.value);
    let mut simulated = vec![f64::NAN; scan.samples.len()];
    for focus in 0..scan.setup.foci.len() {
        let Some(simulation) = scan.setup.simulation(comparison.simulator, focus) else { continue };
        let simulation = match registration.receiver_face_m {
            Some(face) => simulation_with_receiver_face(&simulation, face.value),
            None => simulation,
        };
        let (rows, points_m): (Vec<usize>, Vec<Vec3>) = scan
            .samples
            .iter()
            .enumerate()
            .filter(|(_, sample)| sample.focus == Some(focus))
            .map(|(row, sample)| (row, pose.to_array(&sample.position_m())))
            .unzip();
        for (row, magnitude) in rows.into_iter().zip(simulation.magnitudes(&points_m)) {
            simulated[row] = gain * magnitude;
        }
    }
    simulated
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{Registering, compare};
    use fieldgap_acoustics::{PlaneGrid, Simulator};
    use fieldgap_input::TomlSource;
    use fieldgap_records::{RecordedSample, ScanSetup};

    #[test]
    fn the_difference_is_the_residual_of_the_comparison() {
        let text = "format = 1\nname = \"n\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n[array]\nfrequency_hz = 40000.0\n\
                    layout = \"square\"\ncolumns = 4\nrows = 4\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n[medium]\n\
                    speed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 80.0\n\
                    [[focus]]\nphases = \"all-zero\"\n";
        let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good");
        let points = PlaneGrid::square(12e-3, 4e-3, 0.08).points();
        let mut samples = Vec::new();
        for (index, at) in points.iter().enumerate() {
            // Drives and silence in turn, so that the order matters.
            let focus = [Some(1), None, Some(0)][index % 3];
            let reading = match focus {
                Some(focus) => {
                    3.0 * setup
                        .simulation(Simulator::Piston, focus)
                        .expect("a focus")
                        .magnitudes(&[*at])[0]
                        + 0.01 * (index % 5) as f64
                }
                None => 0.02,
            };
            samples.push(RecordedSample::measured(index as f64, focus, *at, reading, None));
        }
        let scan = RecordedScan { setup, samples };
        let comparison = compare(&scan, Simulator::Piston, Registering::Auto).expect("comparable");
        let simulated = simulated_readings(&scan, &comparison);
        let (mut squares, mut count) = (0.0, 0);
        for (sample, simulated) in scan.samples.iter().zip(&simulated) {
            assert_eq!(simulated.is_nan(), sample.focus.is_none());
            if sample.focus.is_some() {
                squares += (sample.reading - simulated).powi(2);
                count += 1;
            }
        }
        let rms = (squares / f64::from(count)).sqrt();
        assert!((rms - comparison.overall.residual_rms).abs() < 1e-9, "{rms} {comparison:?}");
    }
}
