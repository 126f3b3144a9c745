//! The log of the thesis's robot: one transducer, scanned over a box.
//!
//! A header line; then the start, the size and the resolution of the axes, one row each; then one row for each point: x, y, z,
//! magnitude, and a fifth column that is not used. Lengths are in centimetres, as in the thesis's own script (Appendix A).

use std::num::NonZeroU32;
use std::path::Path;

use jiff::Timestamp;

use super::MADE_UP_SECONDS_A_POINT;
use crate::sample::{RecordedSample, millimetres};
use crate::table::{Row, Table};
use crate::{ArraySection, FocusSection, Layout, MediumSection, RecordedScan, Rims, ScanSetup};
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_input::{Fault, Frequency, Gap, Length, SoundSpeed};

const CENTIMETRE_M: f64 = 0.01;

/// Largest length of a log, cm.
const MOST_CM: f64 = 1e3;

/// A log of the thesis's robot.
#[derive(Debug, Clone, PartialEq)]
pub struct ThesisLog {
    /// Start of the axes, millimetres.
    pub start_mm: Vec3,
    /// Lengths of the axes, millimetres.
    pub size_mm: Vec3,
    /// Steps of the axes, millimetres, above zero.
    pub resolution_mm: Vec3,
    /// Positions as logged, millimetres, and magnitudes, zero or above, in the order of the log; at least one.
    pub readings: Vec<(Vec3, f64)>,
}

/// The position of the transducer's axis in the logged coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TransducerAxis {
    /// At the largest reading, the first if several are equal, as in the thesis's script.
    UnderLargest,
    /// At a logged x and y, millimetres.
    At([f64; 2]),
}

/// The set-up, which a log does not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct ThesisLogSetup {
    /// Name of the scan.
    pub name: String,
    /// Time of the recording.
    pub recorded: Timestamp,
    /// Unit of the magnitudes.
    pub unit: String,
    /// The medium.
    pub medium: MediumSection,
    /// The simulator that the scan is compared with.
    pub simulator: Simulator,
    /// Position of the transducer.
    pub axis: TransducerAxis,
}

impl ThesisLogSetup {
    /// As in the thesis: volts, 343 m/s, the transducer at the largest reading; compared with `corrected`.
    pub fn of_thesis(name: &str, recorded: Timestamp) -> Self {
        Self {
            name: name.to_owned(),
            recorded,
            unit: "V".to_owned(),
            medium: MediumSection::SpeedOfSound(SoundSpeed::new(343.0).expect("that of air")),
            simulator: Simulator::Corrected,
            axis: TransducerAxis::UnderLargest,
        }
    }
}

impl ThesisLog {
    /// Reads a log.
    ///
    /// # Errors
    /// A [`Fault`] at the first invalid row.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        Self::of(&Table::read(path)?)
    }

    fn of(table: &Table) -> Result<Self, Fault> {
        let mut rows = table.rows(b',').skip(1);
        let start_mm = axes_of(table, rows.next(), "start")?;
        let size_mm = axes_of(table, rows.next(), "size")?;
        let resolution_mm = axes_of(table, rows.next(), "resolution")?;
        let mut readings = Vec::new();
        let mut last = None;
        for row in rows {
            readings.push(reading_of(&row)?);
            last = Some(row);
        }
        let last = last.ok_or_else(|| short(table, "a row for each point"))?;
        table.refuse_cut_end(&last)?;
        Ok(Self { start_mm, size_mm, resolution_mm, readings })
    }

    /// The log as a recorded scan of one transducer at the origin: positions relative to its axis, heights and magnitudes as logged
    /// (the thesis's script subtracts the smallest magnitude as noise), assumed times.
    pub fn into_scan(self, setup: ThesisLogSetup) -> RecordedScan {
        let [x_mm, y_mm] = match setup.axis {
            TransducerAxis::At(at_mm) => at_mm,
            TransducerAxis::UnderLargest => self.under_largest_mm(),
        };
        let origin_mm = Vec3::new(x_mm, y_mm, 0.0);
        let samples = self.readings.iter().enumerate().map(|(row, &(at_mm, reading))| {
            let time_s = row as f64 * MADE_UP_SECONDS_A_POINT;
            RecordedSample::measured(time_s, Some(0), (at_mm - origin_mm) / 1e3, reading, None)
        });
        RecordedScan {
            samples: samples.collect(),
            setup: ScanSetup {
                name: setup.name,
                recorded: setup.recorded,
                unit: setup.unit,
                array: one_transducer(),
                medium: setup.medium,
                receiver: None,
                phase: None,
                uncertainty: None,
                simulator: setup.simulator,
                foci: vec![FocusSection::AllZero],
            },
        }
    }

    fn under_largest_mm(&self) -> [f64; 2] {
        let (mut under_mm, mut largest) = ([0.0; 2], f64::NEG_INFINITY);
        for (at_mm, reading) in &self.readings {
            if *reading > largest {
                (under_mm, largest) = ([at_mm.x, at_mm.y], *reading);
            }
        }
        under_mm
    }
}

/// The thesis's transducer (Murata MA40S4S), alone, at its frequency.
fn one_transducer() -> ArraySection {
    let rims = Rims {
        diameter_mm: Length::new(10.5).expect("10.5 lies above zero"),
        spacing_mm: Gap::new(0.0).expect("zero is not negative"),
    };
    let frequency_hz = Frequency::new(40_000.0).expect("ultrasound");
    ArraySection::of_layout(frequency_hz, Layout::Linear { count: NonZeroU32::MIN, rims })
        .expect("one element makes an array")
}

fn axes_of(table: &Table, row: Option<Row<'_>>, what: &str) -> Result<Vec3, Fault> {
    let row = row.ok_or_else(|| short(table, &format!("the {what} of the axes")))?;
    let along =
        |index: usize| length_cm(&row, index, &format!("the {what} of {}", ["x", "y", "z"][index]));
    let of_axes = Vec3::new(along(0)?, along(1)?, along(2)?);
    if what == "resolution"
        && let Some(index) = (0..3).find(|&index| of_axes[index] <= 0.0)
    {
        return Err(row.wrong(index, "the resolution", "a number above zero"));
    }
    Ok(of_axes.map(from_centimetres))
}

fn reading_of(row: &Row<'_>) -> Result<(Vec3, f64), Fault> {
    if !(4..=5).contains(&row.len()) {
        return Err(row.fault(
            row.len().min(5),
            format!(
                "the row has {} cells where a point has x, y, z, magnitude and one more",
                row.len()
            ),
            "complete the row, or take it out on purpose",
        ));
    }
    let at_cm =
        Vec3::new(length_cm(row, 0, "x")?, length_cm(row, 1, "y")?, length_cm(row, 2, "z")?);
    let magnitude = row.number(3, "the magnitude")?;
    if magnitude < 0.0 {
        return Err(row.wrong(3, "the magnitude", "zero or a number above zero"));
    }
    Ok((at_cm.map(from_centimetres), magnitude))
}

/// A length of the log: within 10 m, as all places of a record are.
fn length_cm(row: &Row<'_>, index: usize, name: &str) -> Result<f64, Fault> {
    let length_cm = row.number(index, name)?;
    if length_cm.abs() < MOST_CM {
        return Ok(length_cm);
    }
    Err(row.wrong(index, name, "a length within 10 m (in cm, not in mm)"))
}

fn from_centimetres(centimetres: f64) -> f64 {
    millimetres(centimetres * CENTIMETRE_M)
}

fn short(table: &Table, missing: &str) -> Fault {
    Fault::of_file(
        table.path(),
        format!("ends before {missing}"),
        "a log has a header line, the start, the size and the resolution of the axes, and then a row for each \
         point: x, y, z, magnitude; lengths are centimetres",
    )
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LOG: &str = "x,y,z,mag,unused\n0,0,0\n50,50,50\n1.1,1,2,,\n\
                       24,25,2,0.5,0\n25,25,2,0.9,0\n26.1,25,2,0.9,0\n25,25,4,0.7,0\n";

    fn parse(text: &str) -> Result<ThesisLog, Fault> {
        ThesisLog::of(&Table::new(Path::new("log.csv"), text))
    }

    fn setup() -> ThesisLogSetup {
        ThesisLogSetup::of_thesis("one", Timestamp::UNIX_EPOCH)
    }

    #[test]
    fn centimetres_become_millimetres_from_the_axis() {
        let log = parse(LOG).expect("good");
        assert_eq!(log.size_mm, Vec3::repeat(500.0));
        assert_eq!(log.resolution_mm, Vec3::new(11.0, 10.0, 20.0));
        let scan = log.into_scan(setup());
        let seen: Vec<([f64; 3], f64)> =
            scan.samples.iter().map(|s| (s.position_mm.into(), s.reading)).collect();
        let expected = [
            ([-10.0, 0.0, 20.0], 0.5),
            ([0.0, 0.0, 20.0], 0.9),
            ([11.0, 0.0, 20.0], 0.9),
            ([0.0, 0.0, 40.0], 0.7),
        ];
        assert_eq!(seen, expected);
        assert!(scan.samples.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
        assert_eq!(scan.setup.array.array().len(), 1);
        assert!(scan.samples.iter().all(|sample| sample.focus == Some(0)));
    }

    #[test]
    fn the_axis_may_be_given() {
        let at = ThesisLogSetup { axis: TransducerAxis::At([240.0, 250.0]), ..setup() };
        let scan = parse(LOG).expect("good").into_scan(at);
        assert_eq!(scan.samples[0].position_mm, Vec3::new(0.0, 0.0, 20.0));
    }

    #[test]
    fn an_imported_log_can_be_written_and_opened() {
        let folder = tempfile::tempdir().expect("a folder");
        let scan = parse(LOG).expect("good").into_scan(setup());
        scan.write(folder.path()).expect("written");
        assert_eq!(RecordedScan::open(folder.path()).expect("good"), scan);
    }

    #[test]
    fn faults_are_placed() {
        let cases = [
            (LOG.replace("26.1", "26;1"), Some((7, 1)), "`26;1`"),
            (LOG.replace("0.7", "-0.7"), Some((8, 9)), "`-0.7`"),
            (LOG.replace("25,25,4,0.7,0", "25,25,4"), Some((8, 8)), "3 cells"),
            (LOG.replace("1.1,1,2", "1.1,0,2"), Some((4, 5)), "resolution"),
            (LOG.replace("50,50,50", "50,50"), Some((3, 6)), "size of z"),
            (LOG[..LOG.len() - 1].to_owned(), Some((8, 14)), "line end"),
            (LOG[..LOG.find("24").unwrap_or(0)].to_owned(), None, "each point"),
            ("x,y\n".to_owned(), None, "start"),
            (String::new(), None, "start"),
        ];
        for (text, place, said) in cases {
            let fault = parse(&text).expect_err(&text);
            assert_eq!(fault.line_column(), place, "{text}: {fault}");
            assert!(fault.problem().contains(said), "{text}: {fault}");
        }
    }

    #[test]
    fn lengths_beyond_any_robot_are_refused() {
        for (from, to, line) in [("24,25,2,0.5", "24,25,1e9,0.5", 5), ("50,50,50", "50,5000,50", 3)]
        {
            let fault = parse(&LOG.replace(from, to)).expect_err(to);
            assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{fault}");
            assert!(fault.problem().contains("within 10 m"), "{fault}");
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_the_reader_panic(rows in "[-0-9.,eNainf\r\n λ]{0,80}") {
            for text in [rows.clone(), format!("{LOG}{rows}"), format!("h\n{rows}")] {
                if let Ok(log) = parse(&text) {
                    log.into_scan(setup());
                }
            }
        }
    }
}
