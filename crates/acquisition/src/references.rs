//! The check on resuming a scan: some points are measured again, and the scan continues only if position and level agree.

use fieldgap_records::{RecordedSample, Tolerances, Visit, VisitKind, VisitPace};

use super::sequencer::distance_mm;

/// Standard errors that two readings of one level may differ by.
const STANDARD_ERRORS: f64 = 4.0;

/// Most points that are measured again.
const REFERENCES: usize = 3;

/// A difference between a repeated reading and the first one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RigChange {
    /// The robot reports another position.
    #[error(
        "row {row}: the robot reports a position {moved_mm:.3} mm from the first one; {allowed_mm} mm is allowed"
    )]
    Robot {
        /// Row of `samples.csv`.
        row: usize,
        /// Distance between the two reported positions, mm.
        moved_mm: f64,
        /// Tolerance in the plan, mm.
        allowed_mm: f64,
    },
    /// The level has changed.
    #[error(
        "row {row}: the level changed from {kept:.5} to {now:.5} ({:+.1} %); {allowed_percent} % beyond the noise is allowed",
        (now / kept - 1.0) * 100.0
    )]
    Level {
        /// Row of `samples.csv`.
        row: usize,
        /// The recorded reading.
        kept: f64,
        /// The repeated reading.
        now: f64,
        /// Tolerance in the plan, percent.
        allowed_percent: f64,
    },
    /// Several points differ.
    #[error("{}{}", listed(.0), common_cause(.0))]
    Several(Vec<Self>),
}

impl RigChange {
    /// The differences at several points as one error.
    pub(super) fn of(mut found: Vec<Self>) -> Result<(), Self> {
        match found.len() {
            0 => Ok(()),
            1 => Err(found.remove(0)),
            _ => Err(Self::Several(found)),
        }
    }
}

fn listed(found: &[RigChange]) -> String {
    found.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

/// The likely common cause: a gain, if all levels changed by one factor; otherwise a displacement.
fn common_cause(found: &[RigChange]) -> &'static str {
    /// Largest relative difference between factors that count as equal.
    const ALIKE: f64 = 0.02;
    let factors: Vec<f64> = found
        .iter()
        .filter_map(|moved| match moved {
            RigChange::Level { kept, now, .. } => Some(now / kept),
            _ => None,
        })
        .collect();
    let [least, most] =
        [f64::min, f64::max].map(|of| factors.iter().copied().reduce(of).unwrap_or(f64::NAN));
    if factors.len() < found.len() {
        ". The robot's origin has changed: check its end switches"
    } else if most - least <= ALIKE * most {
        ". All levels changed by the same factor: check the supply voltage and the gain of the receiver"
    } else {
        ". The levels changed by different factors: array or receiver was moved, or elements failed"
    }
}

/// The rows to measure again: the last visit to the reference point of the plan, if it has one, and the strongest readings,
/// spread over the recorded rows. Empty if nothing was measured with the array driven. They are measured at rest; what a list of the
/// plan had in motion may read otherwise there, and is left out.
pub(super) fn reference_rows(kept: &[RecordedSample], visits: &[Visit]) -> Vec<usize> {
    let reference = |row: &usize| visits[*row].kind == VisitKind::Reference;
    let mut rows: Vec<usize> = (0..kept.len()).rev().find(reference).into_iter().collect();
    let part = kept.len().div_ceil(REFERENCES).max(1);
    let strongest = kept.chunks(part).enumerate().filter_map(|(number, rows)| {
        rows.iter()
            .enumerate()
            .filter(|(row, sample)| {
                let pace = visits[number * part + row].pace;
                sample.focus.is_some() && !matches!(pace, VisitPace::Flown(_))
            })
            .max_by(|a, b| a.1.reading.total_cmp(&b.1.reading))
            .map(|(row, _)| number * part + row)
    });
    rows.extend(strongest.take(REFERENCES - rows.len()));
    rows
}

/// Compares a repeated reading with the recorded one.
pub(super) fn compare(
    row: usize,
    kept: &RecordedSample,
    now: &RecordedSample,
    allowed: Tolerances,
) -> Result<(), RigChange> {
    let (allowed_mm, allowed_percent) = (allowed.place_mm.get(), allowed.level_percent.get());
    let moved_mm = distance_mm(kept.position_m(), now.position_m());
    if moved_mm > allowed_mm {
        return Err(RigChange::Robot { row, moved_mm, allowed_mm });
    }
    let noise = STANDARD_ERRORS * standard_error(kept).hypot(standard_error(now));
    if (now.reading - kept.reading).abs() > allowed_percent / 100.0 * kept.reading + noise {
        return Err(RigChange::Level {
            row,
            kept: kept.reading,
            now: now.reading,
            allowed_percent,
        });
    }
    Ok(())
}

/// Standard error of a reading, in the record's unit; zero if its spread is unknown.
pub(super) fn standard_error(sample: &RecordedSample) -> f64 {
    sample.spread.map_or(0.0, |spread| spread.std / f64::from(spread.count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Vec3;
    use fieldgap_input::{Positive, literal};
    use fieldgap_records::{PlanPart, Spread};

    fn sample(focus: Option<usize>, x_mm: f64, reading: f64) -> RecordedSample {
        let spread = Some(Spread { std: 0.01, count: 16 });
        RecordedSample::measured(0.0, focus, Vec3::new(x_mm * 1e-3, 0.0, 0.1), reading, spread)
    }

    fn visits(count: usize, reference: Option<usize>) -> Vec<Visit> {
        let kind = |row| {
            if Some(row) == reference { VisitKind::Reference } else { VisitKind::Point }
        };
        let visit = |row| Visit {
            kind: kind(row),
            focus: Some(0),
            position_m: Vec3::zeros(),
            pace: VisitPace::OfPlan,
            part: PlanPart::Region(0),
        };
        (0..count).map(visit).collect()
    }

    #[test]
    fn the_strongest_driven_reading_of_each_third_is_measured_again() {
        let kept: Vec<RecordedSample> = [9.0, 1.0, 3.0, 2.0, 5.0, 4.0]
            .into_iter()
            .enumerate()
            .map(|(row, reading)| sample((row > 0).then_some(0), row as f64, reading))
            .collect();
        assert_eq!(reference_rows(&kept, &visits(6, None)), [1, 2, 4]);
        assert_eq!(reference_rows(&kept, &visits(6, Some(3))), [3, 1, 2]);
        // A reading in motion may differ from one at rest.
        let mut in_motion = visits(6, None);
        in_motion[2].pace = VisitPace::Flown(literal(60.0));
        assert_eq!(reference_rows(&kept, &in_motion), [1, 3, 4]);
        assert!(reference_rows(&[], &[]).is_empty());
        assert!(reference_rows(&[sample(None, 0.0, 1.0)], &visits(1, None)).is_empty());
    }

    #[test]
    fn a_shift_or_another_level_is_reported() {
        let kept = sample(Some(0), 1.0, 2.0);
        let compared = |now| compare(7, &kept, &now, Tolerances::default());
        assert_eq!(compared(sample(Some(0), 1.04, 2.05)), Ok(()));
        assert!(matches!(
            compared(sample(Some(0), 1.06, 2.0)),
            Err(RigChange::Robot { row: 7, .. })
        ));
        assert!(matches!(
            compared(sample(Some(0), 1.0, 2.1)),
            Err(RigChange::Level { row: 7, .. })
        ));
        let wide = Tolerances {
            place_mm: literal(0.2),
            level_percent: Positive::new(6.0).expect("above zero"),
        };
        assert_eq!(compare(7, &kept, &sample(Some(0), 1.1, 2.1), wide), Ok(()));
    }

    #[test]
    fn the_likely_cause_follows_from_how_the_points_changed() {
        let level = |row, kept, now| RigChange::Level { row, kept, now, allowed_percent: 3.0 };
        let robot = RigChange::Robot { row: 1, moved_mm: 0.2, allowed_mm: 0.05 };
        let said = |found| RigChange::of(found).expect_err("moved").to_string();
        assert_eq!(RigChange::of(vec![]), Ok(()));
        assert!(
            said(vec![level(3, 2.0, 1.8), level(5, 1.0, 0.9)]).contains("gain of the receiver")
        );
        let shifted = said(vec![level(3, 2.0, 1.8), level(5, 1.0, 1.1)]);
        assert!(shifted.contains("row 3") && shifted.contains("was moved"), "{shifted}");
        assert!(said(vec![robot, level(3, 2.0, 1.8)]).contains("end switches"));
    }
}
