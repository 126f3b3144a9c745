//! Readings whose samples were averaged with their phases, before the amplitude was taken: their noise is that of single magnitudes.

use super::dark_readings::{DarkReadings, averaged};
use super::within_readings::WithinReadings;
use fieldgap_records::RecordedScan;

/// Whether readings of a scan have phases: those of most of the driven ones are known. (Readings in motion are amplitudes.)
pub fn has_phases(scan: &RecordedScan) -> bool {
    let driven = scan.samples.iter().filter(|sample| sample.focus.is_some());
    let (mut known, mut all) = (0, 0);
    for sample in driven {
        known += usize::from(sample.phase_rad.is_some());
        all += 1;
    }
    scan.setup.phase.is_some() && 2 * known > all
}

/// How many magnitudes a reading of a scan is the mean of; one where samples were averaged with their phases, before the magnitude was
/// taken.
pub fn averaged_magnitudes(scan: &RecordedScan) -> f64 {
    if has_phases(scan) { 1.0 } else { averaged(scan) }
}

/// What the scatter of the magnitudes within readings tells; nothing where samples were averaged with their phases.
pub fn within_readings(scan: &RecordedScan) -> Option<WithinReadings> {
    if has_phases(scan) { None } else { WithinReadings::of(&scan.samples) }
}

/// The dark readings of a scan; `None` if it has too few.
pub fn dark_readings(scan: &RecordedScan) -> Option<DarkReadings> {
    if !has_phases(scan) {
        return DarkReadings::of_scan(scan);
    }
    // The amplitude of a mean of complex samples has the distribution of a single magnitude.
    let silent: Vec<f64> = scan.silent().map(|sample| sample.reading).collect();
    DarkReadings::of(&silent, 1.0)
}
