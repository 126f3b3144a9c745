//! The paths of a focus.

use serde::Deserialize;

use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Finite, Length, Place};

/// Segments of a figure of eight: the relative error of its length is below a millionth.
const FIGURE_OF_EIGHT_SEGMENTS: usize = 4096;

/// A point in front of the array, mm in its frame: z above 0.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Exact<Place, 3>")]
pub struct FieldPoint([f64; 3]);

impl FieldPoint {
    /// Metres.
    pub fn metres(self) -> Vec3 {
        Vec3::from(self.0) * 1e-3
    }
}

impl TryFrom<Exact<Place, 3>> for FieldPoint {
    type Error = String;
    fn try_from(point_mm: Exact<Place, 3>) -> Result<Self, String> {
        let [x, y, z] = point_mm.map(Place::get);
        if z > 0.0 {
            Ok(Self([x, y, z]))
        } else {
            Err(format!("a focus must lie in front of the array: z must be above 0, and is {z} mm"))
        }
    }
}

/// A direction, of unit length.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Exact<Finite, 3>")]
pub struct Direction(Vec3);

impl Direction {
    /// The unit vector.
    pub fn unit(self) -> Vec3 {
        self.0
    }

    fn along_z() -> Self {
        Self(Vec3::z())
    }

    fn along_x() -> Self {
        Self(Vec3::x())
    }
}

impl TryFrom<Exact<Finite, 3>> for Direction {
    type Error = String;
    fn try_from(along: Exact<Finite, 3>) -> Result<Self, String> {
        Vec3::from(along.map(Finite::get))
            .try_normalize(1e-9)
            .map(Self)
            .ok_or_else(|| "a direction cannot be [0, 0, 0]".to_owned())
    }
}

/// The path of a focus in a display file: `path = { circle = { … } }`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Path {
    /// A fixed point.
    #[serde(rename = "point_mm")]
    PointMm(FieldPoint),
    /// Back and forth between two points.
    Line(Line),
    /// Around a circle, counter-clockwise when seen against its normal.
    Circle(Circle),
    /// Along the sides of a polygon, back to its first corner.
    Polygon(Corners),
    /// Along the lemniscate of Bernoulli.
    FigureOfEight(FigureOfEight),
    /// From point to point in jumps, back to the first.
    #[serde(rename = "points_mm")]
    PointsMm(Places),
}

/// A straight line.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "LineKeys")]
pub struct Line {
    ends: [FieldPoint; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LineKeys {
    from_mm: FieldPoint,
    to_mm: FieldPoint,
}

impl TryFrom<LineKeys> for Line {
    type Error = String;
    fn try_from(keys: LineKeys) -> Result<Self, String> {
        if keys.from_mm == keys.to_mm {
            return Err("the ends of a line must differ".to_owned());
        }
        Ok(Self { ends: [keys.from_mm, keys.to_mm] })
    }
}

/// A circle.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Circle {
    centre_mm: FieldPoint,
    radius_mm: Length,
    #[serde(default = "Direction::along_z")]
    normal: Direction,
}

/// A polygon's corners.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "CornersKeys")]
pub struct Corners(Vec<FieldPoint>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CornersKeys {
    corners_mm: Vec<FieldPoint>,
}

impl TryFrom<CornersKeys> for Corners {
    type Error = String;
    fn try_from(keys: CornersKeys) -> Result<Self, String> {
        let corners = keys.corners_mm;
        let count = corners.len();
        if count < 3 {
            return Err(format!(
                "a polygon needs at least three corners, not {count}; use `line` for two"
            ));
        }
        match (0..count).find(|&n| corners[n] == corners[(n + 1) % count]) {
            Some(n) => Err(format!(
                "corners {n} and {} of the polygon are the same point",
                (n + 1) % count
            )),
            None => Ok(Self(corners)),
        }
    }
}

/// A figure of eight.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FigureOfEight {
    centre_mm: FieldPoint,
    /// Distance between the outermost points of its two loops, mm.
    width_mm: Length,
    /// Direction of its width.
    #[serde(default = "Direction::along_x")]
    along: Direction,
    #[serde(default = "Direction::along_z")]
    normal: Direction,
}

/// At least two points.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "Vec<FieldPoint>")]
pub struct Places(Vec<FieldPoint>);

impl TryFrom<Vec<FieldPoint>> for Places {
    type Error = String;
    fn try_from(places: Vec<FieldPoint>) -> Result<Self, String> {
        match places.len() {
            0 | 1 => {
                Err("`points_mm` needs at least two points; use `point_mm` for one".to_owned())
            }
            _ => Ok(Self(places)),
        }
    }
}

/// The geometry of a path.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum PathGeometry {
    /// One point, m.
    Still(Vec3),
    /// Points with jumps between them, m.
    Jumps(Vec<Vec3>),
    /// Legs; the last ends where the first begins.
    Legs(Vec<Leg>),
}

/// A part of a path without corners.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Leg {
    pub length_m: f64,
    pub shape: Shape,
}

/// Shape of a leg, m.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    Straight {
        from_m: Vec3,
        to_m: Vec3,
    },
    /// A full circle from `start_m`; `start_m` and `quarter_m` are relative to the centre.
    Turn {
        centre_m: Vec3,
        start_m: Vec3,
        quarter_m: Vec3,
    },
    /// Points at equal distances along it; the last equals the first.
    Traced(Vec<Vec3>),
}

impl Leg {
    /// The point after a fraction of its length, 0 to 1.
    pub fn at(&self, share: f64) -> Vec3 {
        match &self.shape {
            Shape::Straight { from_m, to_m } => from_m.lerp(to_m, share),
            Shape::Turn { centre_m, start_m, quarter_m } => {
                let (sine, cosine) = (std::f64::consts::TAU * share).sin_cos();
                centre_m + start_m * cosine + quarter_m * sine
            }
            Shape::Traced(points) => {
                let along = share.clamp(0.0, 1.0) * (points.len() - 1) as f64;
                let before = (along as usize).min(points.len() - 2);
                points[before].lerp(&points[before + 1], along - before as f64)
            }
        }
    }
}

impl Path {
    /// Whether it is a fixed point.
    pub fn is_still(&self) -> bool {
        matches!(self, Self::PointMm(_))
    }

    /// Length of one loop, m: for a line there and back; 0 for points.
    pub fn length_m(&self) -> f64 {
        match self.geometry() {
            PathGeometry::Still(_) | PathGeometry::Jumps(_) => 0.0,
            PathGeometry::Legs(legs) => legs.iter().map(|leg| leg.length_m).sum(),
        }
    }

    pub(super) fn geometry(&self) -> PathGeometry {
        let straight = |from_m: Vec3, to_m: Vec3| Leg {
            length_m: (to_m - from_m).norm(),
            shape: Shape::Straight { from_m, to_m },
        };
        match self {
            Self::PointMm(place) => PathGeometry::Still(place.metres()),
            Self::PointsMm(places) => {
                PathGeometry::Jumps(places.0.iter().map(|place| place.metres()).collect())
            }
            Self::Line(line) => {
                let [from, to] = line.ends.map(FieldPoint::metres);
                PathGeometry::Legs(vec![straight(from, to), straight(to, from)])
            }
            Self::Polygon(Corners(corners)) => PathGeometry::Legs(
                (0..corners.len())
                    .map(|n| {
                        straight(corners[n].metres(), corners[(n + 1) % corners.len()].metres())
                    })
                    .collect(),
            ),
            Self::Circle(circle) => {
                let radius_m = circle.radius_mm.get() * 1e-3;
                let normal = circle.normal.unit();
                let start = across(Vec3::x(), normal);
                PathGeometry::Legs(vec![Leg {
                    length_m: std::f64::consts::TAU * radius_m,
                    shape: Shape::Turn {
                        centre_m: circle.centre_mm.metres(),
                        start_m: start * radius_m,
                        quarter_m: normal.cross(&start) * radius_m,
                    },
                }])
            }
            Self::FigureOfEight(eight) => PathGeometry::Legs(vec![eight.leg()]),
        }
    }
}

/// The direction nearest to `preferred` that is normal to `normal`; nearest to y if the two are parallel.
fn across(preferred: Vec3, normal: Vec3) -> Vec3 {
    let part = |preferred: Vec3| (preferred - normal * preferred.dot(&normal)).try_normalize(1e-6);
    part(preferred).or_else(|| part(Vec3::y())).expect("no normal is along both x and y")
}

impl FigureOfEight {
    /// Bernoulli's lemniscate of half width a: x = a cos t/(1 + sin² t), y = x sin t.
    fn leg(&self) -> Leg {
        let half_m = 0.5e-3 * self.width_mm.get();
        let normal = self.normal.unit();
        let along = across(self.along.unit(), normal);
        let up = normal.cross(&along);
        let centre_m = self.centre_mm.metres();
        let at = |part: f64| {
            let t = std::f64::consts::TAU * part;
            let x = half_m * t.cos() / (1.0 + t.sin().powi(2));
            centre_m + along * x + up * (x * t.sin())
        };
        let points: Vec<Vec3> = (0..=FIGURE_OF_EIGHT_SEGMENTS)
            .map(|part| at(part as f64 / FIGURE_OF_EIGHT_SEGMENTS as f64))
            .collect();
        let mut reached_m = vec![0.0];
        for pair in points.windows(2) {
            reached_m.push(reached_m[reached_m.len() - 1] + (pair[1] - pair[0]).norm());
        }
        let length_m = reached_m[FIGURE_OF_EIGHT_SEGMENTS];
        let traced = (0..=FIGURE_OF_EIGHT_SEGMENTS)
            .map(|step| {
                let wanted_m = length_m * step as f64 / FIGURE_OF_EIGHT_SEGMENTS as f64;
                let after =
                    reached_m.partition_point(|&m| m < wanted_m).clamp(1, FIGURE_OF_EIGHT_SEGMENTS);
                let (from_m, to_m) = (reached_m[after - 1], reached_m[after]);
                points[after - 1].lerp(&points[after], (wanted_m - from_m) / (to_m - from_m))
            })
            .collect();
        Leg { length_m, shape: Shape::Traced(traced) }
    }
}

#[cfg(test)]
mod tests;
