//! The log of the times with the array driven: a line of JSON for each scan, so that minutes add up over a day.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use jiff::civil::Date;
use jiff::tz::TimeZone;
use serde::{Deserialize, Serialize};

use fieldgap_input::{Fault, Label, MOST_TABLE, NonNegative, read_text, visible_line};
use fieldgap_records::RecordedSample;

/// A time with the array driven.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sounding {
    /// When it ended.
    pub ended: Timestamp,
    /// How long the array was driven, s.
    pub seconds: NonNegative,
    /// Name of the rig.
    pub rig: Label,
    /// What was done: the folder of a record, or a command.
    pub what: Label,
}

/// Why a time was not kept.
#[derive(Debug, thiserror::Error)]
#[error("the time with the array driven cannot be kept in {}: {source}", path.display())]
pub struct SoundingError {
    path: PathBuf,
    source: io::Error,
}

/// Longest time between two readings that counts, s: the array is silenced in a pause and between a scan and its resumption, and a reading
/// with its move takes seconds.
const LONGEST_STEP_S: f64 = 60.0;

/// Time with the array driven during a scan, s: between readings that were both taken with it driven.
pub fn driven_s(samples: &[RecordedSample]) -> f64 {
    let driven = samples.windows(2).filter(|pair| pair.iter().all(|sample| sample.focus.is_some()));
    let times_s = driven.map(|pair| pair[1].time_s - pair[0].time_s);
    times_s.filter(|time_s| (0.0..=LONGEST_STEP_S).contains(time_s)).sum()
}

/// The log of a user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SoundingLog {
    path: PathBuf,
}

impl SoundingLog {
    /// The log in a file, which need not exist.
    pub fn at(path: PathBuf) -> Self {
        Self { path }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a time.
    ///
    /// # Errors
    /// [`SoundingError`]
    pub fn add(&self, sounding: &Sounding) -> Result<(), SoundingError> {
        let write = || {
            if let Some(folder) = self.path.parent() {
                std::fs::create_dir_all(folder)?;
            }
            let mut line = serde_json::to_vec(sounding)?;
            line.push(b'\n');
            // One write of a whole line: two scans at once do not mix theirs.
            let mut file = OpenOptions::new().create(true).append(true).open(&self.path)?;
            file.write_all(&line).and_then(|()| file.sync_all())
        };
        write().map_err(|source| SoundingError { path: self.path.clone(), source })
    }

    /// All times, in the order in which they were added; none if there is no log.
    ///
    /// # Errors
    /// The file cannot be read, or a line is no time.
    pub fn all(&self) -> Result<Vec<Sounding>, Fault> {
        if !self.path.exists() {
            return Ok(Vec::new());
        }
        let text = read_text(&self.path, MOST_TABLE).map_err(|error| {
            Fault::of_file(
                &self.path,
                format!("cannot be read: {error}"),
                "check the permissions of the file",
            )
        })?;
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        lines.map(|(number, line)| self.parsed(number + 1, line)).collect()
    }

    fn parsed(&self, number: usize, line: &str) -> Result<Sounding, Fault> {
        serde_json::from_str(line).map_err(|error| {
            Fault::on_line(
                &self.path,
                number,
                error.column().max(1),
                &visible_line(line),
                "is no line of the log of soundings",
                "correct the line, or move the file away: a new one is begun",
            )
        })
    }

    /// Minutes with the array of a rig driven on a day of a time zone, by when each time ended.
    ///
    /// # Errors
    /// As [`SoundingLog::all`].
    pub fn minutes_on(&self, day: Date, zone: &TimeZone, rig: &str) -> Result<f64, Fault> {
        let that_day = |sounding: &&Sounding| {
            sounding.rig.as_str() == rig && sounding.ended.to_zoned(zone.clone()).date() == day
        };
        let all = self.all()?;
        // From zero: the sum of nothing would be minus zero.
        let seconds = all.iter().filter(that_day).map(|sounding| sounding.seconds.get());
        Ok(seconds.fold(0.0, |sum, seconds| sum + seconds) / 60.0)
    }

    /// Seconds that were kept for something that was done on a rig.
    ///
    /// # Errors
    /// As [`SoundingLog::all`].
    pub fn seconds_of(&self, rig: &str, what: &str) -> Result<f64, Fault> {
        let same =
            |sounding: &&Sounding| sounding.rig.as_str() == rig && sounding.what.as_str() == what;
        Ok(self.all()?.iter().filter(same).map(|sounding| sounding.seconds.get()).sum())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use fieldgap_input::literal;

    fn sounding(ended: &str, seconds: f64, rig: &str) -> Sounding {
        let label = |text: &str| Label::try_from(text.to_owned()).expect("visible");
        Sounding {
            ended: ended.parse().expect("a time"),
            seconds: literal(seconds),
            rig: label(rig),
            what: label("out/scan"),
        }
    }

    fn log() -> (tempfile::TempDir, SoundingLog) {
        let folder = tempfile::tempdir().expect("a folder");
        let log = SoundingLog::at(folder.path().join("new/sounding.jsonl"));
        (folder, log)
    }

    #[test]
    fn minutes_add_up_over_a_day_of_the_time_zone() {
        let (_folder, log) = log();
        assert_eq!(log.all().expect("none"), []);
        for (ended, seconds, rig) in [
            ("2026-11-24T22:59:00Z", 60.0, "bench"),
            ("2026-11-24T23:30:00Z", 120.0, "bench"),
            ("2026-11-25T10:00:00Z", 600.0, "bench"),
            ("2026-11-25T11:00:00Z", 900.0, "other"),
        ] {
            log.add(&sounding(ended, seconds, rig)).expect("kept");
        }
        // An hour east of Greenwich the day begins at 23:00.
        let zone = TimeZone::fixed(jiff::tz::offset(1));
        let on = |day: i8, rig| {
            log.minutes_on(jiff::civil::date(2026, 11, day), &zone, rig).expect("a log")
        };
        assert_eq!(
            (on(25, "bench"), on(24, "bench"), on(25, "other"), on(26, "bench")),
            (12.0, 1.0, 15.0, 0.0)
        );
        assert!(on(26, "bench").is_sign_positive());
        assert_eq!(log.seconds_of("bench", "out/scan").expect("a log"), 780.0);
    }

    #[test]
    fn readings_with_the_array_silent_and_pauses_do_not_count() {
        let sample = |time_s, focus| {
            RecordedSample::measured(time_s, focus, fieldgap_acoustics::Vec3::zeros(), 1.0, None)
        };
        let times = [
            (0.0, None),
            (1.0, Some(0)),
            (2.5, Some(0)),
            (3.0, Some(1)),
            (900.0, Some(1)),
            (901.0, Some(1)),
            (902.0, None),
        ];
        let samples = times.map(|(time_s, focus)| sample(time_s, focus));
        assert_eq!(driven_s(&samples), 3.0);
        assert_eq!(driven_s(&samples[..1]), 0.0);
    }

    #[test]
    fn a_damaged_line_is_located() {
        let (_folder, log) = log();
        log.add(&sounding("2026-11-24T22:59:00Z", 60.0, "bench")).expect("kept");
        let text = std::fs::read_to_string(log.path()).expect("there");
        std::fs::write(log.path(), format!("{text}\n{}", text.replace("60.0", "-60.0")))
            .expect("written");
        let fault = log.all().expect_err("negative");
        assert_eq!(fault.line_column().map(|place| place.0), Some(3), "{fault}");
    }

    proptest! {
        #[test]
        fn what_is_kept_reads_back(seconds in 0.0..1e6f64, rig in "\\PC{1,20}") {
            prop_assume!(Label::try_from(rig.clone()).is_ok());
            let (_folder, log) = log();
            let kept = sounding("2026-11-24T22:59:00Z", seconds, &rig);
            log.add(&kept).expect("kept");
            prop_assert_eq!(log.all().expect("a log"), vec![kept]);
        }
    }
}
