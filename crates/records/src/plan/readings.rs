//! `[[readings]]` of a plan: readings in a given order, each with its own place, drive and speed.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::region::Reader;
use super::visits::VisitPace;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Fault, Place, Speed, TomlSource};

/// The number that stands for a silent array, as in `samples.csv`.
const SILENT: i64 = -1;

/// Fewest readings of a row in motion: fewer are faster to take at rest.
pub const FEWEST_FLOWN: usize = 4;

/// Largest difference between the steps of a row, mm.
const SAME_STEP_MM: f64 = 1e-6;

/// The keys of a `[[readings]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReadingsTable {
    at_mm: Spanned<Vec<Exact<Place, 3>>>,
    focus: Spanned<Vec<i64>>,
    speed_mm_s: Option<Spanned<Vec<Spanned<f64>>>>,
}

/// Readings in the order in which they are taken, after all regions of the plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Place, millimetres, array frame, and number of the focus of each; `None` with the array silent. At least one.
    pub list: Vec<(Vec3, Option<usize>)>,
    /// Speed of each, mm/s, `None` at rest; no list if the plan leaves it to `[fly]`.
    pub speeds_mm_s: Option<Vec<Option<Speed>>>,
    /// Position of the table in the plan, bytes.
    pub(super) place: Range<usize>,
}

impl Readings {
    /// Checks a `[[readings]]`: as many foci as places, every focus exists, and what is flown forms rows.
    pub(super) fn read(table: &Spanned<ReadingsTable>, reader: &Reader<'_>) -> Result<Self, Fault> {
        let ReadingsTable { at_mm, focus, speed_mm_s } = table.get_ref();
        let (places, drives) = (at_mm.get_ref().len(), focus.get_ref().len());
        if places == 0 {
            return Err(reader.source.fault(
                at_mm.span(),
                "the list of readings is empty",
                "give at least one place, or leave the [[readings]] out",
            ));
        }
        if places != drives {
            return Err(reader.source.fault(
                focus.span(),
                format!("`focus` has {drives} numbers, and `at_mm` has {places} places"),
                "give the number of a focus for each place; -1 silences the array",
            ));
        }
        let drive = |&number: &i64| match (number, usize::try_from(number)) {
            (SILENT, _) => Ok(None),
            (_, Ok(number)) => reader.focus(number, focus.span()).map(Some),
            _ => Err(reader.source.fault(
                focus.span(),
                format!("{number} is no number of a focus"),
                "foci are numbered from 0; -1 silences the array",
            )),
        };
        let list = at_mm
            .get_ref()
            .iter()
            .zip(focus.get_ref())
            .map(|(at_mm, number)| Ok((Vec3::from(at_mm.map(Place::get)), drive(number)?)));
        let list = list.collect::<Result<Vec<_>, Fault>>()?;
        let speeds = speed_mm_s.as_ref();
        let speeds_mm_s = speeds.map(|key| speeds_of(key, &list, reader.source)).transpose()?;
        Ok(Self { list, speeds_mm_s, place: table.span() })
    }

    /// How the robot moves while a reading of the list is taken.
    pub(super) fn pace(&self, number: usize) -> VisitPace {
        match self.speeds_mm_s.as_ref().map(|speeds_mm_s| speeds_mm_s[number]) {
            None => VisitPace::OfPlan,
            Some(None) => VisitPace::AtRest,
            Some(Some(speed_mm_s)) => VisitPace::Flown(speed_mm_s),
        }
    }
}

/// The speeds of a list, of which those above zero form rows.
fn speeds_of(
    key: &Spanned<Vec<Spanned<f64>>>,
    list: &[(Vec3, Option<usize>)],
    source: &TomlSource,
) -> Result<Vec<Option<Speed>>, Fault> {
    let keys = key.get_ref();
    if keys.len() != list.len() {
        return Err(source.fault(
            key.span(),
            format!(
                "`speed_mm_s` has {} numbers, and `at_mm` has {} places",
                keys.len(),
                list.len()
            ),
            "give a speed for each place; 0 stops the robot there",
        ));
    }
    let speed = |key: &Spanned<f64>| match *key.get_ref() {
        0.0 => Ok(None),
        mm_s => Speed::new(mm_s).map(Some).map_err(|error| {
            source.fault(key.span(), error.to_string(), "give 0 for a reading at rest")
        }),
    };
    let speeds_mm_s = keys.iter().map(speed).collect::<Result<Vec<_>, Fault>>()?;
    let mut first = 0;
    while first < list.len() {
        let count = row_from(first, list, &speeds_mm_s);
        let in_motion = speeds_mm_s[first].is_some();
        let place = keys[first].span();
        if in_motion && list[first].1.is_none() {
            return Err(source.fault(
                place,
                format!("reading {first} is silent and in motion"),
                "give 0 as its speed: a silent reading is taken at rest",
            ));
        }
        if in_motion && count < FEWEST_FLOWN {
            return Err(source.fault(
                place,
                format!(
                    "from reading {first} on, {count} of one speed and drive lie on a line with equal steps"
                ),
                format!("give at least {FEWEST_FLOWN} to a row in motion, or 0 as their speed"),
            ));
        }
        first += count;
    }
    Ok(speeds_mm_s)
}

/// How many readings from this one on form a row: of one speed and drive, on a line with equal steps; one at rest.
fn row_from(first: usize, list: &[(Vec3, Option<usize>)], speeds_mm_s: &[Option<Speed>]) -> usize {
    let alike = |n: &usize| (speeds_mm_s[*n], list[*n].1) == (speeds_mm_s[first], list[first].1);
    let Some((second_mm, _)) = list.get(first + 1) else { return 1 };
    let step_mm = second_mm - list[first].0;
    let follows =
        |n: &usize| alike(n) && (list[*n].0 - list[*n - 1].0 - step_mm).norm() < SAME_STEP_MM;
    match speeds_mm_s[first].is_none() || step_mm.norm() < SAME_STEP_MM {
        true => 1,
        false => 1 + (first + 1..list.len()).take_while(follows).count(),
    }
}
