//! On resuming a scan: points measured before are measured again, and the scan goes on only where both place and level
//! are what they were.

use crate::scan::{Sample, Visit, VisitKind};

use super::conductor::distance_mm;

/// How far the robot may report to be from where it reported before, mm.
pub(super) const PLACE_TOLERANCE_MM: f64 = 0.05;

/// How much the level may have changed, relative, beyond four standard errors of the two readings.
pub(super) const LEVEL_TOLERANCE: f64 = 0.03;

/// Standard errors that two readings of one level may differ by.
const STANDARD_ERRORS: f64 = 4.0;

/// How many points are measured again, at most.
const REFERENCES: usize = 3;

/// Something is no longer where or what it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Moved {
    /// The robot reports another place.
    #[error(
        "row {row}: the robot reports to be {moved_mm:.3} mm from where it reported before; {PLACE_TOLERANCE_MM} mm is allowed"
    )]
    Robot {
        /// Row of `samples.csv`.
        row: usize,
        /// Distance between the two reported places, mm.
        moved_mm: f64,
    },
    /// The level there is another.
    #[error(
        "row {row}: the level is {now:.5} where {kept:.5} was kept, {:+.1} %; {} % beyond the noise is allowed",
        (now / kept - 1.0) * 100.0, LEVEL_TOLERANCE * 100.0
    )]
    Level {
        /// Row of `samples.csv`.
        row: usize,
        /// The reading that was kept.
        kept: f64,
        /// The reading now.
        now: f64,
    },
}

/// The rows to measure again: the last visit to the plan's reference point, where it has one, and the strongest
/// readings of the drives, which tell most, spread over the rows that are kept. Empty while nothing was measured with
/// the array driven.
pub(super) fn reference_rows(kept: &[Sample], visits: &[Visit]) -> Vec<usize> {
    let reference = |row: &usize| visits[*row].kind == VisitKind::Reference;
    let mut rows: Vec<usize> = (0..kept.len()).rev().find(reference).into_iter().collect();
    let part = kept.len().div_ceil(REFERENCES).max(1);
    let strongest = kept.chunks(part).enumerate().filter_map(|(number, rows)| {
        rows.iter()
            .enumerate()
            .filter(|(_, sample)| sample.focus.is_some())
            .max_by(|a, b| a.1.reading.total_cmp(&b.1.reading))
            .map(|(row, _)| number * part + row)
    });
    rows.extend(strongest.take(REFERENCES - rows.len()));
    rows
}

/// Holds a reading against the one that was kept.
pub(super) fn compare(row: usize, kept: &Sample, now: &Sample) -> Result<(), Moved> {
    let moved_mm = distance_mm(kept.position_m(), now.position_m());
    if moved_mm > PLACE_TOLERANCE_MM {
        return Err(Moved::Robot { row, moved_mm });
    }
    let noise = STANDARD_ERRORS * standard_error(kept).hypot(standard_error(now));
    if (now.reading - kept.reading).abs() > LEVEL_TOLERANCE * kept.reading + noise {
        return Err(Moved::Level { row, kept: kept.reading, now: now.reading });
    }
    Ok(())
}

/// Standard error of a sample's mean, in the record's unit; zero where its spread is not known.
pub(super) fn standard_error(sample: &Sample) -> f64 {
    sample.spread.map_or(0.0, |spread| spread.std / f64::from(spread.count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acoustics::Vec3;
    use crate::scan::{Part, Spread};

    fn sample(focus: Option<usize>, x_mm: f64, reading: f64) -> Sample {
        let spread = Some(Spread { std: 0.01, count: 16 });
        Sample::measured(0.0, focus, Vec3::new(x_mm * 1e-3, 0.0, 0.1), reading, spread)
    }

    fn visits(count: usize, reference: Option<usize>) -> Vec<Visit> {
        let kind = |row| {
            if Some(row) == reference { VisitKind::Reference } else { VisitKind::Point }
        };
        let visit = |row| Visit {
            kind: kind(row),
            focus: Some(0),
            position_m: Vec3::zeros(),
            part: Part::Region(0),
        };
        (0..count).map(visit).collect()
    }

    #[test]
    fn the_strongest_driven_reading_of_each_third_is_measured_again() {
        let kept: Vec<Sample> = [9.0, 1.0, 3.0, 2.0, 5.0, 4.0]
            .into_iter()
            .enumerate()
            .map(|(row, reading)| sample((row > 0).then_some(0), row as f64, reading))
            .collect();
        assert_eq!(reference_rows(&kept, &visits(6, None)), [1, 2, 4]);
        assert_eq!(reference_rows(&kept, &visits(6, Some(3))), [3, 1, 2]);
        assert!(reference_rows(&[], &[]).is_empty());
        assert!(reference_rows(&[sample(None, 0.0, 1.0)], &visits(1, None)).is_empty());
    }

    #[test]
    fn a_shift_or_another_level_is_told() {
        let kept = sample(Some(0), 1.0, 2.0);
        assert_eq!(compare(7, &kept, &sample(Some(0), 1.04, 2.05)), Ok(()));
        assert!(matches!(
            compare(7, &kept, &sample(Some(0), 1.06, 2.0)),
            Err(Moved::Robot { row: 7, .. })
        ));
        assert!(matches!(
            compare(7, &kept, &sample(Some(0), 1.0, 2.1)),
            Err(Moved::Level { row: 7, .. })
        ));
    }
}
