//! The plan of a scan: which foci, which points, in what order.

mod adaptive;
mod closed_loop;
mod exposure;
mod fly;
mod one_or_many;
mod readings;
mod reference;
mod region;
mod visits;

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use self::adaptive::AdaptiveTable;
pub use self::adaptive::{AdaptiveMap, MapPrior};
use self::closed_loop::ClosedLoopTable;
pub use self::closed_loop::{BoxMm, ClosedLoop, Criterion};
use self::exposure::ExposureTable;
pub use self::fly::Fly;
use self::readings::ReadingsTable;
pub use self::readings::{FEWEST_FLOWN, Readings};
pub use self::reference::Reference;
use self::reference::ReferenceTable;
pub use self::region::{Axis, Layers, Region, Shape};
use self::region::{LineTable, PlaneTable, PointsTable, Reader, VolumeTable};
pub use self::visits::{Visit, VisitKind, VisitPace};
use super::focus_section::{FocusSection, FocusTable};
use super::hooks::{Alarm, Hooks};
use fieldgap_acoustics::Simulator;
use fieldgap_input::{Fault, Length, Positive, TomlSource, file_name};
use fieldgap_level::People;

/// Most visits of a plan: at ten per second, two weeks.
pub(super) const MAX_VISITS: usize = 10_000_000;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanFile {
    name: Spanned<String>,
    rig: Option<Spanned<String>>,
    #[serde(default)]
    order: Order,
    #[serde(default)]
    diagnose: bool,
    fly: Option<Fly>,
    simulator: SimulatorTable,
    #[serde(default)]
    focus: Vec<Spanned<FocusTable>>,
    #[serde(default)]
    dark: Dark,
    reference: Option<ReferenceTable>,
    #[serde(default)]
    resume: Tolerances,
    #[serde(default)]
    hooks: Hooks,
    #[serde(default)]
    alarm: Alarm,
    #[serde(default)]
    plane: Vec<Spanned<PlaneTable>>,
    #[serde(default)]
    volume: Vec<Spanned<VolumeTable>>,
    #[serde(default)]
    line: Vec<Spanned<LineTable>>,
    #[serde(default)]
    points: Vec<Spanned<PointsTable>>,
    #[serde(default)]
    readings: Vec<Spanned<ReadingsTable>>,
    closed_loop: Option<Spanned<ClosedLoopTable>>,
    adaptive: Option<Spanned<AdaptiveTable>>,
    exposure: Option<Spanned<ExposureTable>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SimulatorTable {
    model: Simulator,
    #[serde(default)]
    also: Vec<Simulator>,
}

/// The order of the rows of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Every second row is measured backwards, and every second plane from its last row, without idle travel.
    #[default]
    Serpentine,
    /// All rows in the same direction, so that backlash shifts all rows equally.
    Raster,
}

/// Readings with the array silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dark {
    /// Number before all other readings.
    #[serde(default)]
    pub before: u32,
    /// Number after all other readings.
    #[serde(default)]
    pub after: u32,
}

/// `[resume]`: largest deviation of points that are measured again, for an interrupted scan to continue.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tolerances {
    /// Of the position, mm.
    pub place_mm: Length,
    /// Of the level, in addition to its noise, percent.
    pub level_percent: Positive,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self {
            place_mm: Length::new(0.05).expect("a literal above zero"),
            level_percent: Positive::new(3.0).expect("a literal above zero"),
        }
    }
}

/// The plan of a scan.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Name of the scan; a valid file name.
    pub name: String,
    /// Path of the rig file, if the plan names one.
    pub rig: Option<PathBuf>,
    /// The order of the rows of a plane.
    pub order: Order,
    /// Whether a run also diagnoses the gap, corrects the set-up, and compares again.
    pub diagnose: bool,
    /// How rows are measured in motion; `None` if the robot stops at each point.
    pub fly: Option<Fly>,
    /// The simulator that the scan is compared with.
    pub simulator: Simulator,
    /// Further simulators to compare with, without repetitions.
    pub also: Vec<Simulator>,
    /// The drives of the array; at least one.
    pub foci: Vec<FocusSection>,
    /// Readings with the array silent.
    pub dark: Dark,
    /// The point that is measured repeatedly.
    pub reference: Reference,
    /// Largest deviation of points that are measured again, for an interrupted scan to continue.
    pub resume: Tolerances,
    /// Programs that are started at events.
    pub hooks: Hooks,
    /// When a scan without progress raises an alarm.
    pub alarm: Alarm,
    /// The points to be measured; at least one region or one list of readings, unless the rig chooses them itself. Planes, volumes, lines, lists of points, each in the order of the plan.
    pub regions: Vec<Region>,
    /// Readings in a given order, after the regions.
    pub readings: Vec<Readings>,
    /// Where the rig chooses further readings itself, and when it stops; `None` if it chooses none.
    pub closed_loop: Option<ClosedLoop>,
    /// The map for which the rig chooses its readings; `None` if there is none.
    pub adaptive: Option<AdaptiveMap>,
    /// Places of people and limits of exposure in this scan, beside those of the rig file; `None` if the plan states none.
    pub people: Option<People>,
    source: TomlSource,
    people_place: Option<Range<usize>>,
    rig_place: Option<Range<usize>>,
    focus_places: Vec<Range<usize>>,
}

/// A part of a plan, for errors that are found after reading it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanPart {
    /// The name of the rig file.
    Rig,
    /// A `[[focus]]`, by its number.
    Focus(usize),
    /// One of [`Plan::regions`], by its index.
    Region(usize),
    /// One of [`Plan::readings`], by its index.
    Readings(usize),
    /// The point of `[reference]`.
    Reference,
    /// `[exposure]`.
    Exposure,
}

impl Plan {
    /// Reads a plan.
    ///
    /// # Errors
    /// A [`Fault`] at the first invalid key or value.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        Self::parse(TomlSource::read(path)?)
    }

    /// Reads a text as a plan.
    ///
    /// # Errors
    /// As [`Plan::read`].
    pub fn parse(source: TomlSource) -> Result<Self, Fault> {
        let file: PlanFile = source.parse()?;
        let name = file_name(&file.name, "the folder of the scan", &source)?;
        let foci = FocusSection::read_all(&file.focus, &source)?;
        let reader = Reader { source: &source, foci: foci.len() };
        let regions = file
            .plane
            .iter()
            .map(|table| reader.plane(table))
            .chain(file.volume.iter().map(|table| reader.volume(table)))
            .chain(file.line.iter().map(|table| reader.line(table)))
            .chain(file.points.iter().map(|table| reader.points(table)))
            .collect::<Result<Vec<_>, _>>()?;
        let readings = file.readings.iter().map(|table| Readings::read(table, &reader));
        let readings = readings.collect::<Result<Vec<_>, _>>()?;
        let closed_loop =
            file.closed_loop.as_ref().map(|table| ClosedLoop::read(table, &source)).transpose()?;
        let adaptive =
            file.adaptive.as_ref().map(|table| AdaptiveMap::read(table, &reader)).transpose()?;
        let chooses = closed_loop.is_some() || adaptive.is_some();
        if regions.is_empty() && readings.is_empty() && !chooses {
            return Err(Fault::of_file(
                source.path(),
                "the plan has nothing to measure",
                "add a [[plane]], [[volume]], [[line]] or [[points]]",
            ));
        }
        let reference = Reference::read(file.reference.as_ref(), &foci, &reader)?;
        let mut also = Vec::new();
        for simulator in file.simulator.also {
            if simulator != file.simulator.model && !also.contains(&simulator) {
                also.push(simulator);
            }
        }
        let beside = source.path().parent().unwrap_or(Path::new(""));
        let plan = Self {
            name,
            rig: file.rig.as_ref().map(|rig| beside.join(rig.get_ref())),
            order: file.order,
            diagnose: file.diagnose,
            fly: file.fly,
            simulator: file.simulator.model,
            also,
            foci,
            dark: file.dark,
            reference,
            resume: file.resume,
            hooks: file.hooks,
            alarm: file.alarm,
            regions,
            readings,
            closed_loop,
            adaptive,
            people: file
                .exposure
                .as_ref()
                .map(|table| exposure::read(table, &source))
                .transpose()?,
            people_place: file.exposure.as_ref().map(Spanned::span),
            rig_place: file.rig.as_ref().map(Spanned::span),
            focus_places: file.focus.iter().map(Spanned::span).collect(),
            source,
        };
        plan.within_bounds()?;
        if let (Some(_), Some(table)) = (&file.closed_loop, &file.adaptive) {
            return Err(plan.source.fault(
                table.span(),
                "the plan has [closed_loop] as well, which seeks a cause and not a map",
                "leave one of the two out; a map can also be made of what a closed loop recorded, by `fieldgap map`",
            ));
        }
        let closed_loop = file.closed_loop.as_ref().map(|table| ("a closed loop", table.span()));
        let adaptive = file.adaptive.as_ref().map(|table| ("an adaptive map", table.span()));
        if let Some((what, place)) = closed_loop.or(adaptive) {
            plan.grows_at_its_end(what, place)?;
        }
        Ok(plan)
    }

    /// The text of the plan, to be kept with the scan.
    pub fn text(&self) -> &str {
        self.source.text()
    }

    /// The path of the plan.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// An error that was found after reading the plan, such as a point outside the robot's travel, located at a part of the plan.
    pub fn fault(
        &self,
        part: PlanPart,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Fault {
        let place = match part {
            PlanPart::Rig => self.rig_place.clone(),
            PlanPart::Focus(number) => self.focus_places.get(number).cloned(),
            PlanPart::Region(index) => self.regions.get(index).map(|region| region.place.clone()),
            PlanPart::Readings(index) => self.readings.get(index).map(|list| list.place.clone()),
            PlanPart::Reference => self.reference.place.clone(),
            PlanPart::Exposure => self.people_place.clone(),
        };
        match place {
            Some(place) => self.source.fault(place, problem, remedy),
            None => Fault::of_file(self.source.path(), problem, remedy),
        }
    }

    /// Whether the rig chooses readings, so that the plan grows as it is measured.
    pub fn chooses_readings(&self) -> bool {
        self.closed_loop.is_some() || self.adaptive.is_some()
    }

    /// Checks that foci given by phases have one phase for each element of the array.
    ///
    /// # Errors
    /// A [`Fault`] at the first focus that has another number.
    pub fn fits_array(&self, elements: usize) -> Result<(), Fault> {
        for (number, focus) in self.foci.iter().enumerate() {
            focus.fits(elements).map_err(|wrong| {
                self.fault(
                    PlanPart::Focus(number),
                    wrong.to_string(),
                    "give one phase for each element of the rig's array",
                )
            })?;
        }
        Ok(())
    }

    fn within_bounds(&self) -> Result<(), Fault> {
        let mut visits = self.dark.before as usize + self.dark.after as usize;
        for (index, region) in self.regions.iter().enumerate() {
            let points = region.shape.points().saturating_mul(region.foci.len());
            visits = visits.saturating_add(points);
            if visits > MAX_VISITS {
                return Err(self.fault(
                    PlanPart::Region(index),
                    format!(
                        "with this the plan has {visits} points; at most {MAX_VISITS} are allowed"
                    ),
                    "make the step larger, or split the plan",
                ));
            }
        }
        Ok(())
    }

    /// Rounds add readings at the end: whatever else comes last would come twice.
    fn grows_at_its_end(&self, what: &str, place: Range<usize>) -> Result<(), Fault> {
        let last = match (self.dark.after, self.reference.every_points, self.regions.is_empty()) {
            (0, None, true) => return Ok(()),
            (0, None, false) => "regions to measure",
            (0, Some(_), _) => "a reference point after so many points",
            _ => "silent readings after all others",
        };
        Err(self.source.fault(
            place,
            format!("{what} chooses its readings itself, and the plan has {last}"),
            "leave planes, volumes, lines, points, `every_points` and `dark.after` out of this plan",
        ))
    }
}

#[cfg(test)]
mod tests;
