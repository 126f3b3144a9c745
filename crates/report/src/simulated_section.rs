//! The simulated field over a section through a volume.

use fieldgap_acoustics::Vec3;
use fieldgap_text::fixed;

use super::simulated_map::SimulatedMap;

/// The directions of a section: the first runs across the picture, the second up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SectionPlane {
    /// A horizontal plane.
    Xy,
    /// An upright plane along x.
    Xz,
    /// An upright plane along y.
    Yz,
}

impl SectionPlane {
    /// The three, in the order in which they are drawn.
    pub const ALL: [Self; 3] = [Self::Xy, Self::Xz, Self::Yz];

    /// Numbers of the coordinates across, up and normal to the plane: 0 for x, 1 for y, 2 for z.
    #[must_use]
    pub fn coordinates(self) -> [usize; 3] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Xz => [0, 2, 1],
            Self::Yz => [1, 2, 0],
        }
    }

    /// The point of the section at these coordinates, metres.
    #[must_use]
    pub fn point(self, across_m: f64, up_m: f64, at_m: f64) -> Vec3 {
        let mut point_m = Vec3::zeros();
        for (coordinate, value_m) in self.coordinates().into_iter().zip([across_m, up_m, at_m]) {
            point_m[coordinate] = value_m;
        }
        point_m
    }

    /// Name in the file of its picture.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Xy => "xy",
            Self::Xz => "xz",
            Self::Yz => "yz",
        }
    }

    pub(super) fn labels(self) -> [&'static str; 2] {
        let [across, up, _] = self.coordinates();
        [across, up].map(|coordinate| ["x (mm)", "y (mm)", "z (mm)"][coordinate])
    }
}

/// A simulated section.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedSection {
    /// Its directions.
    pub plane: SectionPlane,
    /// Rising coordinates across, metres.
    pub across_m: Vec<f64>,
    /// Rising coordinates up, metres.
    pub up_m: Vec<f64>,
    /// The coordinate normal to the plane, metres.
    pub at_m: f64,
    /// Root mean square pressure, row by row from the lowest, zero or above, in the simulator's arbitrary unit.
    pub amplitude: Vec<f64>,
    /// Phase of the complex pressure at the same points, radians.
    pub phase_rad: Vec<f64>,
    /// The focus, metres, if there is one.
    pub focus_m: Option<Vec3>,
}

impl SimulatedSection {
    /// Where the section lies, such as "y = −22.5 mm".
    pub(super) fn place(&self) -> String {
        let [_, _, normal] = self.plane.coordinates();
        let at_mm = fixed(self.at_m * 1e3, 3);
        let at_mm = at_mm.trim_end_matches('0').trim_end_matches('.');
        format!("{} = {at_mm} mm", ["x", "y", "z"][normal])
    }

    /// The focus on the section, across and up, millimetres.
    pub(super) fn focus_mm(&self) -> Option<(f64, f64)> {
        let focus_mm = self.focus_m? * 1e3;
        let [across, up, _] = self.plane.coordinates();
        Some((focus_mm[across], focus_mm[up]))
    }
}

impl From<&SimulatedMap> for SimulatedSection {
    fn from(map: &SimulatedMap) -> Self {
        Self {
            plane: SectionPlane::Xy,
            across_m: map.grid.x_m.clone(),
            up_m: map.grid.y_m.clone(),
            at_m: map.grid.z_m,
            amplitude: map.amplitude.clone(),
            phase_rad: map.phase_rad.clone(),
            focus_m: map.focus_m,
        }
    }
}
