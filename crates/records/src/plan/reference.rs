//! `[reference]` of a plan: a point that is measured repeatedly to detect drift.

use std::num::NonZeroU32;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::region::Reader;
use crate::FocusSection;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Delay, Exact, Fault, Place, Positive};

/// Default time between measurements of the point, minutes.
const EVERY_MIN: f64 = 15.0;

/// Default drift of the level that is allowed, percent.
const DRIFT_PERCENT: f64 = 3.0;

/// The keys of `[reference]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReferenceTable {
    at_mm: Option<Spanned<Exact<Place, 3>>>,
    every_points: Option<Spanned<NonZeroU32>>,
    every_min: Option<Delay>,
    drift_percent: Option<Positive>,
    focus: Option<Spanned<usize>>,
}

/// A point that is measured repeatedly to detect drift.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Its position, millimetres, array frame: that of the plan, or else that of its focus. `None` if neither is given.
    pub at_mm: Option<Vec3>,
    /// Number of points between its visits as a part of the plan. It is then also the first point and the last.
    pub every_points: Option<NonZeroU32>,
    /// Minutes between its visits in addition to the plan; 0: never.
    pub every_min: Delay,
    /// Drift of its level at which a person is notified, percent.
    pub drift_percent: Positive,
    /// Number of the focus with which it is measured.
    pub focus: usize,
    /// Position of `at_mm` in the plan, bytes; `None` if it is not given there.
    pub(super) place: Option<Range<usize>>,
}

impl Reference {
    /// Whether the plan gives its position.
    pub fn is_given(&self) -> bool {
        self.place.is_some()
    }

    /// The reference of a plan, in which the section may be missing.
    pub(super) fn read(
        table: Option<&ReferenceTable>,
        foci: &[FocusSection],
        reader: &Reader<'_>,
    ) -> Result<Self, Fault> {
        let focus = match table.and_then(|table| table.focus.as_ref()) {
            Some(number) => reader.focus(*number.get_ref(), number.span())?,
            None => 0,
        };
        let given = table.and_then(|table| table.at_mm.as_ref());
        let of_focus = || foci.get(focus)?.excitation().focus_m().map(|at_m| at_m * 1e3);
        let at_mm = match given {
            Some(at_mm) => Some(Vec3::from(at_mm.get_ref().map(Place::get))),
            None => of_focus(),
        };
        let every_points = table.and_then(|table| table.every_points.as_ref());
        if let (Some(every), None) = (every_points, at_mm) {
            return Err(reader.source.fault(
                every.span(),
                "the plan does not give the position of its reference point, and its focus has no position either",
                "add at_mm = [x, y, z]",
            ));
        }
        let minutes = table.and_then(|table| table.every_min);
        let percent = table.and_then(|table| table.drift_percent);
        Ok(Self {
            at_mm,
            every_points: every_points.map(|every| *every.get_ref()),
            every_min: minutes.unwrap_or(Delay::new(EVERY_MIN).expect("above zero")),
            drift_percent: percent.unwrap_or(Positive::new(DRIFT_PERCENT).expect("above zero")),
            focus,
            place: given.map(Spanned::span),
        })
    }
}
