//! The regions of a plan: planes, volumes, lines and lists of points.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::one_or_many::OneOrMany;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Fault, Length, Place, TomlSource};

/// Deviation of a length from a whole number of steps that is taken as rounding, in steps.
const ROUNDING: f64 = 1e-9;

/// Most points along one axis of a region; more are taken as a mistake in the step.
const MAX_POINTS_ALONG: f64 = 1e6;

/// The keys of a `[[plane]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaneTable {
    z_mm: Spanned<OneOrMany<Place>>,
    /// By default above the array's centre.
    #[serde(default)]
    centre_mm: Exact<Place, 2>,
    size_mm: Spanned<Exact<Length, 2>>,
    step_mm: Spanned<Length>,
    foci: Option<Spanned<Vec<usize>>>,
}

/// The keys of a `[[volume]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VolumeTable {
    min_mm: Exact<Place, 3>,
    max_mm: Spanned<Exact<Place, 3>>,
    step_mm: Spanned<OneOrMany<Length>>,
    foci: Option<Spanned<Vec<usize>>>,
}

/// The keys of a `[[line]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LineTable {
    from_mm: Exact<Place, 3>,
    to_mm: Spanned<Exact<Place, 3>>,
    step_mm: Spanned<Length>,
    foci: Option<Spanned<Vec<usize>>>,
}

/// The keys of a `[[points]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PointsTable {
    at_mm: Spanned<Vec<Exact<Place, 3>>>,
    foci: Option<Spanned<Vec<usize>>>,
}

/// Points to be measured, and the foci with which they are measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// The points.
    pub shape: Shape,
    /// Numbers of the foci, each once, ascending.
    pub foci: Vec<usize>,
    /// Position of the region in the plan, bytes.
    pub(super) place: Range<usize>,
}

/// Points in space; millimetres, array frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Planes with the same grid at several heights.
    Planes(Layers),
    /// A grid in space.
    Volume(Layers),
    /// Points in a row, from its start.
    Line {
        /// The first point.
        from_mm: Vec3,
        /// From each point to the next.
        step_mm: Vec3,
        /// Points; at least one.
        count: usize,
    },
    /// Any points, in the order given; at least one.
    Points(Vec<Vec3>),
}

/// A grid along x and y, repeated at each height.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// Columns.
    pub x: Axis,
    /// Rows.
    pub y: Axis,
    /// Heights, millimetres, ascending; at least one.
    pub z_mm: Vec<f64>,
}

/// Equally spaced positions along an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The first position, millimetres.
    pub first_mm: f64,
    /// From each to the next, millimetres, above zero.
    pub step_mm: f64,
    /// Positions; at least one.
    pub count: usize,
}

impl Axis {
    /// A position, millimetres.
    pub fn at_mm(&self, index: usize) -> f64 {
        self.first_mm + self.step_mm * index as f64
    }
}

impl Layers {
    /// Number of points; at least one.
    pub fn points(&self) -> usize {
        self.x.count.saturating_mul(self.y.count).saturating_mul(self.z_mm.len())
    }

    /// The points, millimetres: along x first, then y, then z.
    pub fn places_mm(&self) -> impl Iterator<Item = Vec3> + '_ {
        let row = move |y_mm: f64, z_mm: f64| {
            (0..self.x.count).map(move |column| Vec3::new(self.x.at_mm(column), y_mm, z_mm))
        };
        let plane =
            move |z_mm: f64| (0..self.y.count).flat_map(move |n| row(self.y.at_mm(n), z_mm));
        self.z_mm.iter().flat_map(move |&z_mm| plane(z_mm))
    }
}

impl Shape {
    /// Number of points; at least one.
    pub fn points(&self) -> usize {
        match self {
            Self::Planes(layers) | Self::Volume(layers) => layers.points(),
            Self::Line { count, .. } => *count,
            Self::Points(points) => points.len(),
        }
    }
}

/// Reads regions of a plan with a number of foci.
pub(super) struct Reader<'p> {
    pub source: &'p TomlSource,
    pub foci: usize,
}

impl Reader<'_> {
    /// A `[[plane]]`: as many whole steps as fit in its size, centred.
    pub fn plane(&self, table: &Spanned<PlaneTable>) -> Result<Region, Fault> {
        let keys = table.get_ref();
        let PlaneTable { z_mm, centre_mm, size_mm, step_mm, .. } = keys;
        let step_mm = (step_mm.get_ref().get(), step_mm.span());
        let layers = self.planes(z_mm, *centre_mm, size_mm, step_mm)?;
        self.region(Shape::Planes(layers), &keys.foci, table.span())
    }

    /// The grid of planes: as many whole steps as fit in their size, centred. The step comes with its place in the file.
    pub fn planes(
        &self,
        z_mm: &Spanned<OneOrMany<Place>>,
        centre_mm: Exact<Place, 2>,
        sizes_mm: &Spanned<Exact<Length, 2>>,
        (step_mm, step_place): (f64, Range<usize>),
    ) -> Result<Layers, Fault> {
        let size_mm = sizes_mm.get_ref().map(Length::get);
        if size_mm.iter().any(|&size_mm| size_mm < step_mm) {
            return Err(self.source.fault(
                sizes_mm.span(),
                format!("the plane is smaller than its step of {step_mm} mm"),
                "make `size_mm` larger or `step_mm` smaller; for single points use [[points]]",
            ));
        }
        let centred = |axis: usize| -> Result<Axis, Fault> {
            let steps = self.whole_steps(size_mm[axis], step_mm, &step_place)?;
            let first_mm = centre_mm[axis].get() - step_mm * (steps as f64 / 2.0);
            Ok(Axis { first_mm, step_mm, count: steps + 1 })
        };
        let (x, y) = (centred(0)?, centred(1)?);
        let mut heights_mm: Vec<f64> = z_mm.get_ref().0.iter().map(|z| z.get()).collect();
        heights_mm.sort_by(f64::total_cmp);
        if heights_mm.is_empty() {
            return Err(self.source.fault(
                z_mm.span(),
                "the plane has no height",
                "give at least one, such as `z_mm = 100.0`",
            ));
        }
        Ok(Layers { x, y, z_mm: heights_mm })
    }

    /// A `[[volume]]`: whole steps from `min_mm`, up to `max_mm`.
    pub fn volume(&self, table: &Spanned<VolumeTable>) -> Result<Region, Fault> {
        let keys = table.get_ref();
        let layers = self.layers(&keys.min_mm, &keys.max_mm, &keys.step_mm)?;
        self.region(Shape::Volume(layers), &keys.foci, table.span())
    }

    /// The grid of a box: whole steps from its lowest corner, up to its highest.
    pub fn layers(
        &self,
        min_mm: &Exact<Place, 3>,
        max_mm: &Spanned<Exact<Place, 3>>,
        step_mm: &Spanned<OneOrMany<Length>>,
    ) -> Result<Layers, Fault> {
        let steps_mm = match step_mm.get_ref().0[..] {
            [same] => [same; 3],
            [x, y, z] => [x, y, z],
            _ => {
                return Err(self.source.fault(
                    step_mm.span(),
                    "a volume has one step, or three",
                    "give one number for all axes, or [x, y, z]",
                ));
            }
        };
        let along = |axis: usize| -> Result<Axis, Fault> {
            let first_mm = min_mm[axis].get();
            let size_mm = max_mm.get_ref()[axis].get() - first_mm;
            if size_mm < 0.0 {
                return Err(self.source.fault(
                    max_mm.span(),
                    format!("`max_mm` is below `min_mm` along {}", ["x", "y", "z"][axis]),
                    "exchange the two numbers",
                ));
            }
            let along_mm = steps_mm[axis].get();
            let steps = self.whole_steps(size_mm, along_mm, &step_mm.span())?;
            Ok(Axis { first_mm, step_mm: along_mm, count: steps + 1 })
        };
        let z = along(2)?;
        let z_mm = (0..z.count).map(|layer| z.at_mm(layer)).collect();
        Ok(Layers { x: along(0)?, y: along(1)?, z_mm })
    }

    /// A `[[line]]`: whole steps from its start, up to its end.
    pub fn line(&self, table: &Spanned<LineTable>) -> Result<Region, Fault> {
        let keys = table.get_ref();
        let from_mm = Vec3::from(keys.from_mm.map(Place::get));
        let along_mm = Vec3::from(keys.to_mm.get_ref().map(Place::get)) - from_mm;
        let step_mm = keys.step_mm.get_ref().get();
        let steps = self.whole_steps(along_mm.norm(), step_mm, &keys.step_mm.span())?;
        if steps == 0 {
            return Err(self.source.fault(
                keys.to_mm.span(),
                format!("the line is shorter than its step of {step_mm} mm"),
                "move its end away or make `step_mm` smaller; for single points use [[points]]",
            ));
        }
        let step_mm = along_mm.normalize() * step_mm;
        self.region(Shape::Line { from_mm, step_mm, count: steps + 1 }, &keys.foci, table.span())
    }

    /// A `[[points]]`.
    pub fn points(&self, table: &Spanned<PointsTable>) -> Result<Region, Fault> {
        let keys = table.get_ref();
        let points: Vec<Vec3> =
            keys.at_mm.get_ref().iter().map(|at| Vec3::from(at.map(Place::get))).collect();
        if points.is_empty() {
            return Err(self.source.fault(
                keys.at_mm.span(),
                "the list of points is empty",
                "give at least one, such as `at_mm = [[0.0, 0.0, 100.0]]`",
            ));
        }
        self.region(Shape::Points(points), &keys.foci, table.span())
    }

    /// The number of an existing focus.
    pub fn focus(&self, number: usize, place: Range<usize>) -> Result<usize, Fault> {
        if number < self.foci {
            return Ok(number);
        }
        Err(self.source.fault(
            place,
            format!(
                "there is no focus {number}: the plan has {} [[focus]], numbered from 0",
                self.foci
            ),
            "correct the number, or add the [[focus]]",
        ))
    }

    fn region(
        &self,
        shape: Shape,
        foci: &Option<Spanned<Vec<usize>>>,
        place: Range<usize>,
    ) -> Result<Region, Fault> {
        let foci = match foci {
            None => (0..self.foci).collect(),
            Some(listed) => {
                for &number in listed.get_ref() {
                    self.focus(number, listed.span())?;
                }
                let mut foci = listed.get_ref().clone();
                foci.sort_unstable();
                foci.dedup();
                if foci.is_empty() {
                    return Err(self.source.fault(
                        listed.span(),
                        "the list of foci is empty, so nothing would be measured here",
                        "name at least one, or leave `foci` out for all of them",
                    ));
                }
                foci
            }
        };
        Ok(Region { shape, foci, place })
    }

    fn whole_steps(
        &self,
        length_mm: f64,
        step_mm: f64,
        place: &Range<usize>,
    ) -> Result<usize, Fault> {
        let steps = (length_mm / step_mm + ROUNDING).floor();
        if steps < MAX_POINTS_ALONG {
            return Ok(steps as usize);
        }
        Err(self.source.fault(
            place.clone(),
            format!("a step of {step_mm} mm makes {steps:.0} steps over {length_mm} mm"),
            "the step is in millimetres; make it larger",
        ))
    }
}
