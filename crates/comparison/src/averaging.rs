//! What a reading is the mean of: magnitudes, or samples with their phases, of which the magnitude is taken afterwards. The noise of these is
//! that of single magnitudes.

use super::within_readings::WithinReadings;
use fieldgap_records::RecordedScan;

/// How many samples a reading of a scan is the mean of, the median of the recorded counts; one if there are none.
pub fn averaged(scan: &RecordedScan) -> f64 {
    let counts = scan.samples.iter().filter_map(|sample| sample.spread.map(|spread| spread.count));
    let mut counts: Vec<_> = counts.collect();
    counts.sort_unstable();
    counts.get(counts.len() / 2).map_or(1.0, |&count| f64::from(count))
}

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
