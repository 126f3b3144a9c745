//! Readings of coded drives or planes: places, drives, levels, and the noise that repeats show.

use std::collections::HashMap;
use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::limits::{ASSUMED_NOISE, LEAST_NOISE};
use fieldgap_acoustics::{Vec3, delays_s};
use fieldgap_records::RecordedScan;

/// One reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Index of its place.
    pub place: usize,
    /// Index of its drive.
    pub drive: usize,
    /// When it was taken, s.
    pub time_s: f64,
    /// Its value, zero or above, any unit.
    pub value: f64,
}

/// The noise of a reading: the root of `(relative · level)² + additive²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadingNoise {
    /// Relative to the level.
    pub relative: f64,
    /// At no level, in the unit of the readings.
    pub additive: f64,
    /// Pairs of readings that tell it; 0: it is assumed.
    pub repeats: usize,
}

impl ReadingNoise {
    /// Standard deviation at a level.
    pub fn at(&self, level: f64) -> f64 {
        (self.relative * level).hypot(self.additive)
    }
}

/// Readings of an array with known drives.
#[derive(Debug, Clone, PartialEq)]
pub struct CodedReadings {
    /// The places, array frame, m.
    pub places_m: Vec<Vec3>,
    /// The phasor that each channel was commanded, drive by drive.
    pub drives: Vec<Vec<Complex64>>,
    /// The readings, in the order of time.
    pub readings: Vec<Reading>,
    /// Mean reading with the array silent; `None` if there is none.
    pub silent: Option<f64>,
}

impl CodedReadings {
    /// The readings of a recorded scan. The phases are those that the controller was sent: with those that compensate the drive.
    pub fn of(scan: &RecordedScan) -> Self {
        let setup = &scan.setup;
        let added_rad = setup.array.compensation_rad();
        let frequency_hz = setup.array.frequency_hz();
        let drive = |delays_s: Vec<f64>| -> Vec<Complex64> {
            let phases = delays_s.into_iter().zip(&added_rad);
            phases
                .map(|(delay_s, added)| {
                    Complex64::from_polar(1.0, TAU * frequency_hz * delay_s + added)
                })
                .collect()
        };
        let mut drives = Vec::new();
        let mut known: HashMap<Vec<u64>, usize> = HashMap::new();
        let drive_of_focus: Vec<usize> = setup
            .foci
            .iter()
            .map(|focus| {
                let delays_s = delays_s(
                    &focus.excitation(),
                    setup.array.array(),
                    &setup.medium.medium(),
                    frequency_hz,
                );
                let key = delays_s.iter().map(|delay_s| delay_s.to_bits()).collect();
                *known.entry(key).or_insert_with(|| {
                    drives.push(drive(delays_s));
                    drives.len() - 1
                })
            })
            .collect();
        let mut places_m: Vec<Vec3> = Vec::new();
        let mut place_at: HashMap<[i64; 3], usize> = HashMap::new();
        let mut readings = Vec::new();
        for sample in &scan.samples {
            let Some(focus) = sample.focus else { continue };
            // Places within ten micrometres are one: a robot reports no finer.
            let cell = sample.position_mm.map(|mm| (mm * 100.0).round() as i64).into();
            let place = *place_at.entry(cell).or_insert_with(|| {
                places_m.push(sample.position_m());
                places_m.len() - 1
            });
            readings.push(Reading {
                place,
                drive: drive_of_focus[focus],
                time_s: sample.time_s,
                value: sample.reading,
            });
        }
        let silent: Vec<f64> = scan.silent().map(|sample| sample.reading).collect();
        let silent = (!silent.is_empty()).then(|| mean(&silent));
        Self { places_m, drives, readings, silent }
    }

    /// The readings of several scans of one array with one receiver, each a minute after the one before.
    pub fn joined(scans: impl IntoIterator<Item = Self>) -> Self {
        let mut scans = scans.into_iter();
        let mut joined = scans.next().unwrap_or(Self {
            places_m: Vec::new(),
            drives: Vec::new(),
            readings: Vec::new(),
            silent: None,
        });
        for scan in scans {
            let (places, drives) = (joined.places_m.len(), joined.drives.len());
            let begins_s = joined.readings.last().map_or(0.0, |last| last.time_s + 60.0)
                - scan.readings.first().map_or(0.0, |first| first.time_s);
            joined.places_m.extend(scan.places_m);
            joined.drives.extend(scan.drives);
            joined.readings.extend(scan.readings.into_iter().map(|reading| Reading {
                place: reading.place + places,
                drive: reading.drive + drives,
                time_s: reading.time_s + begins_s,
                ..reading
            }));
            joined.silent = joined.silent.or(scan.silent);
        }
        joined
    }

    /// The readings that are not taken, and those that are.
    pub fn split(&self, take: impl Fn(&Reading) -> bool) -> (Self, Self) {
        let part = |taken: bool| {
            let mut part = self.clone();
            part.readings.retain(|reading| take(reading) == taken);
            part
        };
        (part(false), part(true))
    }

    /// How many channels there are.
    pub fn channels(&self) -> usize {
        self.drives.first().map_or(0, Vec::len)
    }

    /// Root mean square of all readings.
    pub fn rms(&self) -> f64 {
        let squares: f64 = self.readings.iter().map(|reading| reading.value.powi(2)).sum();
        (squares / self.readings.len().max(1) as f64).sqrt()
    }

    /// Whether there are more drives than places: then the level may change with time and still be told from the weights.
    pub fn is_coded(&self) -> bool {
        self.drives.len() > self.places_m.len()
    }

    /// The readings of each drive at each place that was read more than once, in the order of time.
    pub fn repeated(&self) -> Vec<Vec<&Reading>> {
        let mut groups: HashMap<(usize, usize), Vec<&Reading>> = HashMap::new();
        for reading in &self.readings {
            groups.entry((reading.place, reading.drive)).or_default().push(reading);
        }
        let mut groups: Vec<_> = groups.into_values().filter(|group| group.len() > 1).collect();
        // The map's order changes from run to run.
        groups.sort_by_key(|group| (group[0].place, group[0].drive));
        groups
    }

    /// The noise, from differences of successive readings of one drive at one place: slow changes of level cancel.
    ///
    /// Where nothing was repeated it is assumed.
    pub fn noise(&self) -> ReadingNoise {
        let additive = self.silent.unwrap_or(0.0).max(LEAST_NOISE * self.rms());
        let mut squares = 0.0;
        let mut repeats = 0;
        for group in self.repeated() {
            for pair in group.windows(2) {
                let level = 0.5 * (pair[0].value + pair[1].value);
                if level > 3.0 * additive {
                    let difference = (pair[0].value - pair[1].value).powi(2) / 2.0;
                    squares += (difference - additive.powi(2)).max(0.0) / level.powi(2);
                    repeats += 1;
                }
            }
        }
        let relative = if repeats == 0 { ASSUMED_NOISE } else { (squares / repeats as f64).sqrt() };
        ReadingNoise { relative: relative.max(LEAST_NOISE), additive, repeats }
    }

    /// The same readings from an instant on.
    pub fn from_time(mut self, begins_s: f64) -> Self {
        self.readings.retain(|reading| reading.time_s >= begins_s);
        self
    }
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
