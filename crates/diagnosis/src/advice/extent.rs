//! Where a proposed scan goes, and how closely it samples: inside the travel of the recorded scan, and with readings enough for a diagnosis.

use crate::limits::{
    FEWEST_READINGS, HEIGHTS_OF_A_PROPOSAL, NARROWEST_PROPOSAL_M, POINTS_ALONG_A_PROPOSED_ROW,
};
use crate::model::observations::Observations;
use crate::model::planes::{by_height, step_m};

/// Steps of a plan are whole multiples of this, m.
const STEP_UNIT_M: f64 = 1e-5;

/// The box that the recorded scans reached, and how they sampled it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Extent {
    /// From and to along x, m.
    x_m: (f64, f64),
    /// The same along y.
    y_m: (f64, f64),
    /// The heights of the first scan, ascending, mm.
    heights_mm: Vec<f64>,
    /// The recorded step, m; nothing for points in no order.
    step_m: Option<f64>,
    /// The largest step that samples the field, m: half a wavelength.
    coarsest_m: f64,
}

/// The points of one plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    pub step_m: f64,
    pub columns: usize,
    pub rows: usize,
}

impl Extent {
    /// Of recorded scans; `None` where they have no area: of a line, a plane cannot be measured inside its travel.
    pub fn of(observations: &Observations) -> Option<Self> {
        let first = observations.first();
        let visits = || {
            let drives = observations.scans.iter().flat_map(|scan| &scan.drives);
            drives.flat_map(|drive| &drive.visits)
        };
        let range = |along: fn(&fieldgap_acoustics::Vec3) -> f64| {
            visits()
                .map(|visit| along(&visit.at_m))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), at| {
                    (least.min(at), most.max(at))
                })
        };
        let (x_m, y_m) = (range(|at| at.x), range(|at| at.y));
        if (x_m.1 - x_m.0).min(y_m.1 - y_m.0) < NARROWEST_PROPOSAL_M {
            return None;
        }
        let heights_mm = by_height(first)
            .iter()
            .map(|plane| (1e6 * first.visits[plane[0]].at_m.z).round() / 1e3)
            .collect();
        let believed = &first.believed;
        Some(Self {
            x_m,
            y_m,
            heights_mm,
            step_m: step_m(first).filter(|step_m| *step_m > STEP_UNIT_M),
            coarsest_m: 0.5 * believed.medium.speed_of_sound_m_s / believed.frequency_hz,
        })
    }

    pub fn x_m(&self) -> (f64, f64) {
        self.x_m
    }

    pub fn y_m(&self) -> (f64, f64) {
        self.y_m
    }

    /// The recorded heights, mm; of many, some that are spread over them.
    pub fn heights_mm(&self) -> Vec<f64> {
        let known = &self.heights_mm;
        if known.len() <= HEIGHTS_OF_A_PROPOSAL {
            return known.clone();
        }
        let last = (HEIGHTS_OF_A_PROPOSAL - 1) as f64;
        let place = |number: usize| (number as f64 * (known.len() - 1) as f64 / last).round();
        (0..HEIGHTS_OF_A_PROPOSAL).map(|number| known[place(number) as usize]).collect()
    }

    /// More heights than the recorded ones, between the lowest and the highest, mm; `None` where there is no room or no need.
    pub fn more_heights_mm(&self) -> Option<Vec<f64>> {
        let (lowest, highest) = (self.heights_mm.first()?, self.heights_mm.last()?);
        let few = self.heights_mm.len() < HEIGHTS_OF_A_PROPOSAL;
        let apart = (highest - lowest) / (HEIGHTS_OF_A_PROPOSAL - 1) as f64;
        let enough_room = 1e-3 * apart >= self.coarsest_m;
        (few && enough_room).then(|| {
            let tidy = |z_mm: f64| (10.0 * z_mm).round() / 10.0;
            let inner = 1..HEIGHTS_OF_A_PROPOSAL - 1;
            let inner = inner.map(|number| tidy(lowest + apart * number as f64));
            [*lowest].into_iter().chain(inner).chain([*highest]).collect()
        })
    }

    /// The coarsest grid that gives so many readings on so many planes, and samples the field; as dense as the recorded one at most, if that is
    /// enough for a diagnosis.
    pub fn grid(&self, planes: usize, readings: f64) -> Grid {
        let readings = match self.step_m {
            Some(step_m) => readings.min((planes * self.points(step_m).points()) as f64),
            None => readings,
        };
        let readings = readings.max(FEWEST_READINGS as f64);
        let enough = |grid: Grid| {
            grid.columns.min(grid.rows) >= POINTS_ALONG_A_PROPOSED_ROW
                && (planes * grid.points()) as f64 >= readings
        };
        let mut units = (self.coarsest_m / STEP_UNIT_M).floor();
        while units > 1.0 && !enough(self.points(units * STEP_UNIT_M)) {
            units -= (0.01 * units).ceil();
        }
        // Round numbers are easier to check at the rig.
        let round = [100.0, 50.0, 10.0].map(|by| by * (units / by).floor());
        let units = round.into_iter().find(|round| *round >= 0.9 * units).unwrap_or(units);
        self.points(units * STEP_UNIT_M)
    }

    fn points(&self, step_m: f64) -> Grid {
        // A side that is a whole number of steps is not to lose one to rounding.
        let along = |(from, to): (f64, f64)| ((to - from) / step_m + 1e-6).floor() as usize + 1;
        Grid { step_m, columns: along(self.x_m), rows: along(self.y_m) }
    }
}

impl Grid {
    /// How many there are.
    pub fn points(self) -> usize {
        self.columns * self.rows
    }

    /// Width and depth, m.
    pub fn size_m(self) -> [f64; 2] {
        [self.columns, self.rows].map(|points| (points - 1) as f64 * self.step_m)
    }
}
