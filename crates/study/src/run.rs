//! The run of a study: simulation and figures of every combination of values.

use rayon::prelude::*;
use serde::Serialize;

use super::point::Point;
use super::shared_sums::shared_magnitudes;
use super::{Limits, Observation, Quantiles, Study, SweptValue};
use fieldgap_acoustics::metrics::PlaneMap;
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_input::Fault;

/// The result of a study.
#[derive(Debug, Clone)]
pub struct StudyResult {
    /// A row for each combination of values; the values of the last sweep change fastest.
    pub rows: Vec<Row>,
}

/// One combination of values.
#[derive(Debug, Clone)]
pub struct Row {
    /// Index of the value of each sweep.
    pub values: Vec<usize>,
    /// The simulator.
    pub simulator: Simulator,
    /// Elements of the array.
    pub elements: usize,
    /// The focus, metres, if any.
    pub focus_m: Option<Vec3>,
    /// Height at which the field was observed, millimetres.
    pub z_mm: f64,
    /// The limits from theory.
    pub limits: Limits,
    /// The figures: once, or for each random array, with its seed; at least one.
    pub draws: Vec<(Option<u32>, Observation)>,
    /// The map of the first random array, if maps were requested.
    pub map: Option<PlaneMap>,
}

/// One of the thesis's three figures of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Figure {
    /// Focal radius, millimetres.
    FocalRadius,
    /// Largest value, the simulator's unit.
    Peak,
    /// Sub-peaks.
    SubPeaks,
}

impl Figure {
    /// In the thesis's order.
    pub const ALL: [Self; 3] = [Self::FocalRadius, Self::Peak, Self::SubPeaks];

    /// The figure of a map, if the map has it.
    pub fn of(self, observation: &Observation) -> Option<f64> {
        match self {
            Self::FocalRadius => observation.figures()?.focal_radius_mm,
            Self::Peak => Some(observation.figures()?.peak),
            Self::SubPeaks => Some(observation.figures()?.sub_peaks as f64),
        }
    }
}

impl Row {
    /// The distribution of a figure over the draws; `None` if no map has it.
    pub fn figure(&self, figure: Figure) -> Option<Quantiles> {
        Quantiles::of(self.draws.iter().filter_map(|(_, observed)| figure.of(observed)))
    }

    /// Draws whose peak is outside the map.
    pub fn outside(&self) -> usize {
        self.draws.iter().filter(|(_, observed)| observed.figures().is_none()).count()
    }

    /// The observation of the first draw.
    pub fn first(&self) -> &Observation {
        &self.draws[0].1
    }
}

/// Runs a study; with `keep_maps`, each row keeps its map.
///
/// # Errors
/// A [`Fault`] at the first combination of values that is not a valid set-up, before any simulation.
pub fn run(study: &Study, keep_maps: bool) -> Result<StudyResult, Fault> {
    let combinations: Vec<Vec<usize>> = combinations(study);
    let read: Vec<Result<Point, Fault>> = combinations
        .par_iter()
        .map(|values| Point::read(study, &values_at(study, values)))
        .collect();
    let points: Vec<Point> = read.into_iter().collect::<Result<_, Fault>>()?;
    let observed = observe(&points, keep_maps);
    let rows = combinations
        .into_iter()
        .zip(&points)
        .zip(observed)
        .map(|((values, point), (draws, map))| row(values, point, draws, map))
        .collect();
    Ok(StudyResult { rows })
}

/// A row, of what was observed at a point.
pub(super) fn row(
    values: Vec<usize>,
    point: &Point,
    draws: Vec<Observation>,
    map: Option<PlaneMap>,
) -> Row {
    let first = &point.draws[0].simulation;
    let seeds = point.draws.iter().map(|draw| draw.seed);
    Row {
        values,
        simulator: first.simulator,
        elements: first.array.len(),
        focus_m: first.excitation.focus_m(),
        z_mm: point.grid.z_m * 1e3,
        limits: point.limits,
        draws: seeds.zip(draws).collect(),
        map,
    }
}

/// The values of one combination.
pub(super) fn values_at<'s>(study: &'s Study, values: &[usize]) -> Vec<&'s SweptValue> {
    study.sweeps.iter().zip(values).map(|(sweep, &value)| &sweep.values[value]).collect()
}

fn combinations(study: &Study) -> Vec<Vec<usize>> {
    study.sweeps.iter().fold(vec![Vec::new()], |before, sweep| {
        before
            .into_iter()
            .flat_map(|head| {
                (0..sweep.values.len()).map(move |value| [head.clone(), vec![value]].concat())
            })
            .collect()
    })
}

/// Simulates points; returns the figures of all draws and, with `keep_maps`, the map of the first draw.
pub(super) fn observe(
    points: &[Point],
    keep_maps: bool,
) -> Vec<(Vec<Observation>, Option<PlaneMap>)> {
    let jobs: Vec<_> = points
        .iter()
        .flat_map(|point| point.draws.iter().map(move |draw| (&draw.simulation, &point.grid)))
        .collect();
    let owner: Vec<&Point> =
        points.iter().flat_map(|point| point.draws.iter().map(move |_| point)).collect();
    let mut observed: Vec<(Observation, Option<PlaneMap>)> =
        shared_magnitudes(&jobs, |job, values| {
            let (point, grid) = (owner[job], jobs[job].1);
            let map = PlaneMap::new(grid.x_m.clone(), grid.y_m.clone(), values)
                .expect("ascending axes and a value for each point");
            (Observation::of(&map, point.threshold, point.convention), keep_maps.then_some(map))
        });
    let mut rest = observed.drain(..);
    points
        .iter()
        .map(|point| {
            let own: Vec<_> = rest.by_ref().take(point.draws.len()).collect();
            let (observations, mut maps): (Vec<_>, Vec<_>) = own.into_iter().unzip();
            (observations, maps.swap_remove(0))
        })
        .collect()
}

/// The number of sub-peaks at another value of a study's only sweep; `None` if that is not a valid set-up, or the peak is outside the map.
pub(super) fn sub_peaks_at(study: &Study, value: f64) -> Option<usize> {
    let point = Point::read(study, &[&SweptValue::of_number(value)]).ok()?;
    let (observations, _) = observe(std::slice::from_ref(&point), false).swap_remove(0);
    Some(observations[0].figures()?.sub_peaks)
}
