//! The visits of a plan, in their order.

use super::region::{Layers, Shape};
use super::{Order, Plan, PlanPart};
use fieldgap_acoustics::Vec3;
use fieldgap_input::Speed;

/// What a visit is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VisitKind {
    /// A reading with the array silent.
    Dark,
    /// A point of the plan.
    Point,
    /// The reference point.
    Reference,
}

/// How the robot moves while a reading is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VisitPace {
    /// As the plan has it for all rows: at the speed of `[fly]`, or at rest without that section.
    OfPlan,
    /// The robot stands still.
    AtRest,
    /// At this speed, mm/s; neighbours of the same list, drive and speed form a row.
    Flown(Speed),
}

/// One point at which one sample is taken: row k of the samples belongs to visit k of the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visit {
    /// Its purpose.
    pub kind: VisitKind,
    /// Number of the focus that is driven; `None` with the array silent.
    pub focus: Option<usize>,
    /// Position, metres, array frame.
    pub position_m: Vec3,
    /// How the robot moves meanwhile.
    pub pace: VisitPace,
    /// The part of the plan that it comes from.
    pub part: PlanPart,
}

impl Plan {
    /// The visits, in their order; at least one, unless a closed loop has not chosen any yet. The same plan always gives the same visits.
    ///
    /// For each focus: planes by height, then volumes, lines and lists of points. The reference point is first, after each
    /// `every_points` points, and last. Readings with the array silent are taken at the first of these points before it, and at the last
    /// after it. Then follow the readings that are listed one by one.
    pub fn visits(&self) -> Vec<Visit> {
        let driven = self.with_references(self.points());
        let silent = |at: Option<&Visit>, count: u32| {
            let dark = at.map(|at| Visit { kind: VisitKind::Dark, focus: None, ..*at });
            dark.into_iter().flat_map(move |dark| std::iter::repeat_n(dark, count as usize))
        };
        let before = silent(driven.first(), self.dark.before);
        let after = silent(driven.last(), self.dark.after);
        before.chain(driven.iter().copied()).chain(after).chain(self.listed()).collect()
    }

    fn listed(&self) -> impl Iterator<Item = Visit> {
        let lists = self.readings.iter().enumerate();
        lists.flat_map(|(index, readings)| {
            readings.list.iter().enumerate().map(move |(number, &(at_mm, focus))| Visit {
                kind: if focus.is_some() { VisitKind::Point } else { VisitKind::Dark },
                focus,
                position_m: at_mm / 1e3,
                pace: readings.pace(number),
                part: PlanPart::Readings(index),
            })
        })
    }

    fn points(&self) -> Vec<Visit> {
        let mut route = Route { order: self.order, rows: 0, planes: 0, points: Vec::new() };
        for focus in 0..self.foci.len() {
            let regions = || {
                let all = self.regions.iter().enumerate();
                all.filter(|(_, region)| region.foci.contains(&focus))
            };
            let mut planes: Vec<(f64, usize, &Layers)> = regions()
                .filter_map(|(index, region)| match &region.shape {
                    Shape::Planes(layers) => Some((index, layers)),
                    _ => None,
                })
                .flat_map(|(index, layers)| layers.z_mm.iter().map(move |&z| (z, index, layers)))
                .collect();
            planes.sort_by(|(a_mm, ..), (b_mm, ..)| a_mm.total_cmp(b_mm));
            for (z_mm, index, layers) in planes {
                route.plane(focus, PlanPart::Region(index), layers, z_mm);
            }
            for (index, region) in regions() {
                let part = PlanPart::Region(index);
                match &region.shape {
                    Shape::Planes(_) => {}
                    Shape::Volume(layers) => {
                        layers.z_mm.iter().for_each(|&z_mm| route.plane(focus, part, layers, z_mm));
                    }
                    Shape::Line { from_mm, step_mm, count } => {
                        (0..*count)
                            .for_each(|n| route.point(focus, part, from_mm + step_mm * n as f64));
                    }
                    Shape::Points(points) => {
                        points.iter().for_each(|&at_mm| route.point(focus, part, at_mm));
                    }
                }
            }
        }
        route.points
    }

    fn with_references(&self, points: Vec<Visit>) -> Vec<Visit> {
        let reference = &self.reference;
        let (Some(every), Some(at_mm)) = (reference.every_points, reference.at_mm) else {
            return points;
        };
        let revisit = Visit {
            kind: VisitKind::Reference,
            focus: Some(reference.focus),
            position_m: at_mm / 1e3,
            pace: VisitPace::OfPlan,
            part: PlanPart::Reference,
        };
        let mut visits = vec![revisit];
        for between in points.chunks(every.get() as usize) {
            visits.extend_from_slice(between);
            visits.push(revisit);
        }
        visits
    }
}

/// The route of the robot.
struct Route {
    order: Order,
    /// Rows and planes so far: in serpentine order every second one runs backwards.
    rows: usize,
    planes: usize,
    points: Vec<Visit>,
}

impl Route {
    fn plane(&mut self, focus: usize, part: PlanPart, layers: &Layers, z_mm: f64) {
        let from_last_row = self.runs_backwards(self.planes);
        for row in along(layers.y.count, from_last_row) {
            let backwards = self.runs_backwards(self.rows);
            for column in along(layers.x.count, backwards) {
                let at_mm = Vec3::new(layers.x.at_mm(column), layers.y.at_mm(row), z_mm);
                self.point(focus, part, at_mm);
            }
            self.rows += 1;
        }
        self.planes += 1;
    }

    fn point(&mut self, focus: usize, part: PlanPart, at_mm: Vec3) {
        self.points.push(Visit {
            kind: VisitKind::Point,
            focus: Some(focus),
            position_m: at_mm / 1e3,
            pace: VisitPace::OfPlan,
            part,
        });
    }

    fn runs_backwards(&self, number: usize) -> bool {
        self.order == Order::Serpentine && number % 2 == 1
    }
}

/// Indices up to `count`, from either end.
fn along(count: usize, backwards: bool) -> impl Iterator<Item = usize> {
    (0..count).map(move |index| if backwards { count - 1 - index } else { index })
}
