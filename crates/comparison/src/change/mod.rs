//! Two records of one field against each other: what changed between them.
//!
//! Readings at the same place under the same drive are compared as they are. Where the places of the second record differ, its map is
//! interpolated, and the error of that is estimated from the map itself. If asked, the second record is first laid on the map of the first
//! ([`alignment`]); its places then lie between those of the first, which is interpolated.

mod aligned;
mod alignment;
mod alignment_search;
#[cfg(test)]
mod alignment_tests;
mod conditions;
mod headline;
mod noise_of_records;
mod polynomial;
mod resample;
#[cfg(test)]
mod tests;
mod text;

use std::collections::HashMap;

use serde::Serialize;

pub use self::aligned::aligned_change;
pub use self::alignment::{Aligning, Alignment};
pub use self::conditions::Condition;
use self::conditions::{conditions, predicted};
use self::noise_of_records::noise_of_both;
use self::resample::Resampled;
use super::agreement::{correlation, rms};
use super::comparison::{FieldFigures, Noise, Uncertain};
use fieldgap_acoustics::Vec3;
use fieldgap_records::{
    OFF_LINE_MM, Plane, RecordedScan, Repeat, SAME_HEIGHT_MM, SAME_POINT_MM, plane_map, visited,
};

/// Fewest common places: a gain and its error from fewer say little.
const FEWEST: usize = 5;

/// Differences beyond so many standard errors are counted. Of normal noise, 0.27 % are.
const FAR: f64 = 3.0;

/// Whether the second record is scaled to the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scaling {
    /// Readings are compared as they are; the units must be the same.
    AsRead,
    /// The second record is divided by its gain against the first.
    Gain,
}

/// Why two records cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoChange {
    /// One is in volts, the other in counts.
    #[error(
        "`{a}` is in {unit_a} and `{b}` in {unit_b}; with `--register gain`, the second is scaled to the first"
    )]
    OtherUnit {
        /// Name of the first record.
        a: String,
        /// Its unit.
        unit_a: String,
        /// Name of the second record.
        b: String,
        /// Its unit.
        unit_b: String,
    },
    /// There are too few common places.
    #[error(
        "`{a}` and `{b}` have {common} places in common under one drive, and at least {FEWEST} are needed: {extent_a}; {extent_b}"
    )]
    TooFewCommon {
        /// Name of the first record.
        a: String,
        /// Name of the second record.
        b: String,
        /// Common places.
        common: usize,
        /// What the first record has, in words.
        extent_a: String,
        /// What the second record has, in words.
        extent_b: String,
    },
    /// No drive and height of both is a map, so that nothing can be aligned.
    #[error(
        "`{a}` and `{b}` cannot be aligned: no drive and height of both is a map of at least 6 by 6 places: {extent_a}; {extent_b}"
    )]
    NoMap {
        /// Name of the first record.
        a: String,
        /// Name of the second record.
        b: String,
        /// What the first record has, in words.
        extent_a: String,
        /// What the second record has, in words.
        extent_b: String,
    },
    /// Where the records agree best, too little is common.
    #[error(
        "`{a}` and `{b}` cannot be aligned: where they agree best, {} % of the places of `{b}` lie within the map of `{a}`, and half are needed",
        (100.0 * share).round()
    )]
    LittleOverlap {
        /// Name of the first record.
        a: String,
        /// Name of the second record.
        b: String,
        /// Share of the places of the second within the map of the first.
        share: f64,
    },
    /// The maps are unlike wherever the second is laid on the first.
    #[error(
        "`{a}` and `{b}` cannot be aligned: in no position with half of the places in common do they correlate by 0.6; the best is {correlation:.2}"
    )]
    Unlike {
        /// Name of the first record.
        a: String,
        /// Name of the second record.
        b: String,
        /// The best correlation.
        correlation: f64,
    },
    /// A record is zero at all common places.
    #[error("`{0}` reads zero at all common places: was the receiver connected?")]
    AllZero(String),
}

/// What changed from record A to record B.
#[derive(Debug, Clone, Serialize)]
pub struct Change {
    /// Name of the first record.
    pub a: String,
    /// Name of the second record.
    pub b: String,
    /// Unit of the readings of the first.
    pub unit: String,
    /// What the readings of the second were divided by.
    pub scale: f64,
    /// Noise of a reading of the first.
    pub noise_a: Noise,
    /// Noise of a reading of the second, in its own unit.
    pub noise_b: Noise,
    /// Where the second record was laid, if that was asked for.
    pub alignment: Option<Alignment>,
    /// Over all common places.
    pub overall: ChangeFigures,
    /// For each drive and height of the first record that the second has too.
    pub heights: Vec<HeightChange>,
    /// What differs between the set-ups.
    pub conditions: Vec<Condition>,
    /// Share of the squared change that the simulation of the two set-ups predicts; `None` if they are alike. Below zero if it predicts another change.
    pub explained_by_set_up: Option<f64>,
    /// Places of the first record at which the second has nothing; of an aligned record, its own places outside the first.
    pub left_out: usize,
}

/// How two sets of readings differ.
#[derive(Debug, Clone, Serialize)]
pub struct ChangeFigures {
    /// Common places.
    pub points: usize,
    /// Those at which the second record was interpolated, or the first if the second was aligned.
    pub interpolated: usize,
    /// Readings of the second over those of the first, by least squares.
    pub gain: Uncertain,
    /// Root mean square of the difference over that of the first record.
    pub gap: f64,
    /// Cosine of the angle between the two as vectors.
    pub correlation: f64,
    /// Mean of the squared difference in standard errors: one if noise alone makes it.
    pub chi_square_per_point: f64,
    /// Share of the places that differ by more than three standard errors.
    pub beyond_three: f64,
}

/// One drive at one height.
#[derive(Debug, Clone, Serialize)]
pub struct HeightChange {
    /// Number of the drive in the first record.
    pub focus: usize,
    /// Height, m.
    pub z_m: f64,
    /// How the readings differ.
    pub figures: ChangeFigures,
    /// Standard error of the interpolation, in the unit of the record that was interpolated; `None` where nothing was.
    pub interpolation_error: Option<f64>,
    /// Peak and focal radius of the first record; `None` if its places are no map.
    pub a_figures: Option<FieldFigures>,
    /// Peak and focal radius of the second record, in its own unit.
    pub b_figures: Option<FieldFigures>,
    /// Every common place.
    pub places: Vec<PlaceChange>,
}

/// One common place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PlaceChange {
    /// Place in the frame of the first record, m.
    #[serde(serialize_with = "metres")]
    pub at_m: Vec3,
    /// Reading of the first record.
    pub a: f64,
    /// Reading of the second record, divided by the scale.
    pub b: f64,
    /// Standard error of the first.
    pub a_error: f64,
    /// Standard error of the second, divided by the scale.
    pub b_error: f64,
    /// Whether one of the two was interpolated.
    pub interpolated: bool,
}

impl PlaceChange {
    /// The difference in standard errors; zero where both readings are the same.
    pub fn in_standard_errors(&self) -> f64 {
        let difference = self.b - self.a;
        if difference == 0.0 { 0.0 } else { difference / self.a_error.hypot(self.b_error) }
    }
}

fn metres<S: serde::Serializer>(at_m: &Vec3, serializer: S) -> Result<S::Ok, S::Error> {
    [at_m.x, at_m.y, at_m.z].serialize(serializer)
}

/// Compares two records.
///
/// # Errors
/// [`NoChange`].
pub fn change(a: &RecordedScan, b: &RecordedScan, scaling: Scaling) -> Result<Change, NoChange> {
    same_unit(a, b, scaling)?;
    let (noise_a, noise_b) = noise_of_both(a, b);
    let planes_b = b.planes(SAME_HEIGHT_MM);
    let (mut heights, mut left_out) = (Vec::new(), 0);
    for plane in a.planes(SAME_HEIGHT_MM) {
        let drive = &a.setup.foci.get(plane.focus);
        let same = |other: &&Plane<'_>| {
            b.setup.foci.get(other.focus) == *drive
                && (other.z_mm - plane.z_mm).abs() <= SAME_HEIGHT_MM
        };
        let places = visited(&owned(&plane.samples), SAME_POINT_MM).len();
        let Some(other) = planes_b.iter().find(same) else {
            left_out += places;
            continue;
        };
        let height = height(&plane, other, &noise_a, &noise_b);
        left_out += places - height.places.len();
        if !height.places.is_empty() {
            heights.push(height);
        }
    }
    Differing { a, b, noises: [noise_a, noise_b], heights, left_out }.compared(scaling)
}

/// Readings in volts and in counts are comparable at the gain only.
fn same_unit(a: &RecordedScan, b: &RecordedScan, scaling: Scaling) -> Result<(), NoChange> {
    match scaling == Scaling::AsRead && a.setup.unit != b.setup.unit {
        true => Err(NoChange::OtherUnit {
            a: a.setup.name.clone(),
            unit_a: a.setup.unit.clone(),
            b: b.setup.name.clone(),
            unit_b: b.setup.unit.clone(),
        }),
        false => Ok(()),
    }
}

/// The common places of two records, the second unscaled.
struct Differing<'r> {
    a: &'r RecordedScan,
    b: &'r RecordedScan,
    noises: [Noise; 2],
    heights: Vec<HeightChange>,
    left_out: usize,
}

impl Differing<'_> {
    fn compared(self, scaling: Scaling) -> Result<Change, NoChange> {
        let Self { a, b, noises: [noise_a, noise_b], mut heights, left_out } = self;
        let (name_a, name_b) = (&a.setup.name, &b.setup.name);
        let common: usize = heights.iter().map(|height| height.places.len()).sum();
        if common < FEWEST {
            return Err(NoChange::TooFewCommon {
                a: name_a.clone(),
                b: name_b.clone(),
                common,
                extent_a: extent(a),
                extent_b: extent(b),
            });
        }
        let all = |heights: &[HeightChange]| -> Vec<PlaceChange> {
            heights.iter().flat_map(|height| height.places.iter().copied()).collect()
        };
        let unscaled = all(&heights);
        for (record, silent) in [
            (name_a, unscaled.iter().all(|place| place.a == 0.0)),
            (name_b, unscaled.iter().all(|place| place.b == 0.0)),
        ] {
            if silent {
                return Err(NoChange::AllZero(record.clone()));
            }
        }
        let gain = gain(&unscaled);
        let scale = if scaling == Scaling::Gain { gain.value } else { 1.0 };
        for height in &mut heights {
            let gain = self::gain(&height.places);
            for place in &mut height.places {
                place.b /= scale;
                place.b_error /= scale;
            }
            height.figures = figures(&height.places, gain);
        }
        let places = all(&heights);
        let predicted = predicted(a, b, scaling, &heights);
        let explained_by_set_up = predicted.map(|predicted| {
            let difference = places.iter().map(|place| place.b - place.a);
            let left =
                difference.clone().zip(&predicted).map(|(d, p)| (d - p).powi(2)).sum::<f64>();
            1.0 - left / difference.map(|d| d * d).sum::<f64>()
        });
        Ok(Change {
            a: name_a.clone(),
            b: name_b.clone(),
            unit: a.setup.unit.clone(),
            scale,
            overall: figures(&places, gain),
            noise_a,
            noise_b,
            heights,
            conditions: conditions(a, b),
            explained_by_set_up: explained_by_set_up.filter(|share| share.is_finite()),
            left_out,
            alignment: None,
        })
    }
}

fn owned(samples: &[&fieldgap_records::RecordedSample]) -> Vec<fieldgap_records::RecordedSample> {
    samples.iter().map(|sample| **sample).collect()
}

/// The common places of two planes, the second unscaled.
fn height(plane: &Plane<'_>, other: &Plane<'_>, noise_a: &Noise, noise_b: &Noise) -> HeightChange {
    let (samples_a, samples_b) = (owned(&plane.samples), owned(&other.samples));
    let visited_b = visited(&samples_b, SAME_POINT_MM);
    let index = Index::of(&visited_b);
    let map = |plane: &Plane<'_>| plane_map(plane, OFF_LINE_MM).ok();
    let (map_a, map_b) = (map(plane), map(other));
    // Between heights nothing is interpolated.
    let level = (plane.z_mm - other.z_mm).abs() <= SAME_POINT_MM;
    let resampled = map_b.as_ref().filter(|_| level).and_then(|map| Resampled::of(&map.map));
    let places: Vec<PlaceChange> = visited(&samples_a, SAME_POINT_MM)
        .iter()
        .filter_map(|point| {
            let at_m = point.position_mm * 1e-3;
            let a = point.mean();
            let a_error = noise_a.at(a) / (point.samples.len() as f64).sqrt();
            let (b, b_error, interpolated) = match index.at(point.position_mm, &visited_b) {
                Some(same) => {
                    let mean = same.mean();
                    (mean, noise_b.at(mean) / (same.samples.len() as f64).sqrt(), false)
                }
                None => {
                    let (resampled, error) = resampled.as_ref()?.at(at_m.x, at_m.y)?;
                    (resampled, noise_b.at(resampled).hypot(error), true)
                }
            };
            Some(PlaceChange { at_m, a, b, a_error, b_error, interpolated })
        })
        .collect();
    let any = places.iter().any(|place| place.interpolated);
    HeightChange {
        focus: plane.focus,
        z_m: plane.z_mm * 1e-3,
        figures: figures(&[], Uncertain { value: f64::NAN, standard_error: f64::NAN }),
        interpolation_error: resampled.filter(|_| any).map(|resampled| resampled.error()),
        a_figures: map_a.and_then(|map| FieldFigures::of_scan(&map.map, noise_a)),
        b_figures: map_b.and_then(|map| FieldFigures::of_scan(&map.map, noise_b)),
        places,
    }
}

/// The points of a plane by cells as wide as the tolerance.
struct Index(HashMap<[i64; 3], Vec<usize>>);

fn cell(position_mm: Vec3) -> [i64; 3] {
    position_mm.map(|mm| (mm / SAME_POINT_MM).floor() as i64).into()
}

impl Index {
    fn of(points: &[Repeat<'_>]) -> Self {
        let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (n, point) in points.iter().enumerate() {
            cells.entry(cell(point.position_mm)).or_default().push(n);
        }
        Self(cells)
    }

    /// The nearest point within the tolerance along each axis.
    fn at<'p, 's>(&self, position_mm: Vec3, points: &'p [Repeat<'s>]) -> Option<&'p Repeat<'s>> {
        let [x, y, z] = cell(position_mm);
        let cells =
            (0..27).filter_map(|n| self.0.get(&[x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1]));
        cells
            .flatten()
            .map(|&n| (&points[n], (points[n].position_mm - position_mm).amax()))
            .filter(|(_, apart)| *apart <= SAME_POINT_MM)
            .min_by(|(_, one), (_, other)| one.total_cmp(other))
            .map(|(point, _)| point)
    }
}

/// B over A by least squares, with the error that the noise of both makes.
fn gain(places: &[PlaceChange]) -> Uncertain {
    let power: f64 = places.iter().map(|place| place.a * place.a).sum();
    let value = places.iter().map(|place| place.a * place.b).sum::<f64>() / power;
    let variance =
        |place: &PlaceChange| (place.a * place.b_error.hypot(value * place.a_error)).powi(2);
    let standard_error = places.iter().map(variance).sum::<f64>().sqrt() / power;
    Uncertain { value, standard_error }
}

fn figures(places: &[PlaceChange], gain: Uncertain) -> ChangeFigures {
    let (a, b): (Vec<f64>, Vec<f64>) = places.iter().map(|place| (place.a, place.b)).unzip();
    let sigmas = || places.iter().map(PlaceChange::in_standard_errors);
    let count = places.len() as f64;
    ChangeFigures {
        points: places.len(),
        interpolated: places.iter().filter(|place| place.interpolated).count(),
        gain,
        gap: rms(places.iter().map(|place| place.b - place.a)) / rms(a.iter().copied()),
        correlation: correlation(&a, &b),
        chi_square_per_point: sigmas().map(|z| z * z).sum::<f64>() / count,
        beyond_three: sigmas().filter(|z| z.abs() > FAR).count() as f64 / count,
    }
}

/// What a record has, in words.
fn extent(scan: &RecordedScan) -> String {
    let planes = scan.planes(SAME_HEIGHT_MM);
    let driven = planes.iter().flat_map(|plane| &plane.samples);
    let range = |axis: usize| {
        let along = driven.clone().map(|sample| sample.position_mm[axis]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mm| {
            (low.min(mm), high.max(mm))
        });
        format!("{low:.1} to {high:.1} mm")
    };
    if planes.is_empty() {
        return format!("`{}` has no reading with the array driven", scan.setup.name);
    }
    format!(
        "`{}` has {} drives, x {}, y {}, z {}",
        scan.setup.name,
        scan.setup.foci.len(),
        range(0),
        range(1),
        range(2)
    )
}
