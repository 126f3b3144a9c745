//! `[[readings]]` of a plan: readings in a given order, each with its own place and drive.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::region::Reader;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Fault, Place};

/// The number that stands for a silent array, as in `samples.csv`.
const SILENT: i64 = -1;

/// The keys of a `[[readings]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReadingsTable {
    at_mm: Spanned<Vec<Exact<Place, 3>>>,
    focus: Spanned<Vec<i64>>,
}

/// Readings in the order in which they are taken, after all regions of the plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Place, millimetres, array frame, and number of the focus of each; `None` with the array silent. At least one.
    pub list: Vec<(Vec3, Option<usize>)>,
    /// Position of the table in the plan, bytes.
    pub(super) place: Range<usize>,
}

impl Readings {
    /// Checks a `[[readings]]`: as many foci as places, and every focus exists.
    pub(super) fn read(table: &Spanned<ReadingsTable>, reader: &Reader<'_>) -> Result<Self, Fault> {
        let ReadingsTable { at_mm, focus } = table.get_ref();
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
        Ok(Self { list: list.collect::<Result<_, Fault>>()?, place: table.span() })
    }
}
