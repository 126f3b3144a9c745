//! What acts on skin at the foci of a display.

use num_complex::Complex64;
use serde::Serialize;

use super::compose::ComposedDisplay;
use super::playback::Playback;
use fieldgap_acoustics::metrics::{PlaneMap, peak};
use fieldgap_acoustics::radiation::{SKIN_THRESHOLD_PA, SkinInAir};
use fieldgap_acoustics::{PlaneGrid, Vec3};
use fieldgap_level::level_db;

/// Most frames per focus in which the peak is searched.
const MOST_SEARCHED: usize = 24;

/// Search range for a peak about its focus, m: less than a wavelength, so that no other focus is found.
const SEARCH_RANGE_M: f64 = 6e-3;

/// Radius of the disc for the force, m: a fingertip.
const FINGERTIP_M: f64 = 10e-3;

/// Longest time series, carrier periods: two seconds at 40 kHz.
const LONGEST_SERIES: u64 = 80_000;

/// The stimulus at one focus.
#[derive(Debug, Clone, Serialize)]
pub struct FocusStimulus {
    /// Number of the focus, from 0.
    pub focus: usize,
    /// Frames in which it is driven.
    pub frames: usize,
    /// Sound pressure at the focus at full envelope, mean over its frames, Pa rms.
    pub rms_pa: f64,
    /// The smallest over its frames, Pa rms.
    pub least_pa: f64,
    /// The largest over its frames, Pa rms.
    pub most_pa: f64,
    /// Level of the mean, dB re 20 µPa.
    pub level_db: f64,
    /// Largest distance of the peak from the intended focus in its plane, mm; `None` if there is no peak within 6 mm.
    pub peak_off_mm: Option<f64>,
    /// Radiation pressure on skin at the mean sound pressure, Pa.
    pub radiation_pa: f64,
    /// Force on a disc of 10 mm radius about its first position, normal to the array axis, mN.
    pub force_mn: f64,
    /// Mean sound pressure over the threshold of the thesis.
    pub of_threshold: f64,
    /// Mean radiation pressure over time on skin at rest, at the position of the focus where it varies most, Pa.
    pub steady_pa: f64,
    /// Amplitude of this pressure at the instantaneous modulation frequency, Pa; `None` for a continuous wave.
    pub swinging_pa: Option<f64>,
}

/// The stimulus of a display.
#[derive(Debug, Clone, Serialize)]
pub struct Stimulus {
    /// At each focus.
    pub foci: Vec<FocusStimulus>,
    /// The threshold that the thesis gives, Pa rms.
    pub threshold_pa: f64,
}

/// Computes the stimulus of a display.
pub fn stimulus(
    composed: &ComposedDisplay,
    playback: &Playback,
    skin: SkinInAir,
    carrier_hz: f64,
) -> Stimulus {
    let count = composed.slots.iter().flat_map(|slot| &slot.foci).map(|(focus, _)| focus + 1).max();
    let foci = (0..count.unwrap_or(0))
        .filter_map(|focus| stimulus_at(focus, composed, playback, skin, carrier_hz))
        .collect();
    Stimulus { foci, threshold_pa: SKIN_THRESHOLD_PA }
}

fn stimulus_at(
    focus: usize,
    composed: &ComposedDisplay,
    playback: &Playback,
    skin: SkinInAir,
    carrier_hz: f64,
) -> Option<FocusStimulus> {
    let places: Vec<(usize, Vec3, f64)> = composed
        .slots
        .iter()
        .enumerate()
        .filter_map(|(frame, slot)| {
            let (_, at_m) = slot.foci.iter().find(|(number, _)| *number == focus)?;
            Some((frame, *at_m, f64::from(slot.periods.get())))
        })
        .collect();
    let &(first_frame, first_m, _) = places.first()?;
    let levels: Vec<f64> =
        places.iter().map(|(frame, at_m, _)| playback.rms_pa(*frame, &[*at_m])[0]).collect();
    let total_periods: f64 = places.iter().map(|(_, _, periods)| periods).sum();
    let rms_pa =
        levels.iter().zip(&places).map(|(level, (_, _, periods))| level * periods).sum::<f64>()
            / total_periods;
    let every = places.len().div_ceil(MOST_SEARCHED);
    let off: Option<Vec<f64>> = places
        .iter()
        .step_by(every)
        .map(|(frame, at_m, _)| peak_off_m(playback, *frame, *at_m))
        .collect();
    let (steady_pa, swinging_pa) = places
        .iter()
        .step_by(every)
        .map(|(_, at_m, _)| pressure_over_time(composed, playback, skin, carrier_hz, *at_m))
        .max_by(|(_, one), (_, other)| one.unwrap_or(0.0).total_cmp(&other.unwrap_or(0.0)))?;
    Some(FocusStimulus {
        focus,
        frames: places.len(),
        rms_pa,
        least_pa: levels.iter().copied().fold(f64::INFINITY, f64::min),
        most_pa: levels.iter().copied().fold(0.0, f64::max),
        level_db: level_db(rms_pa),
        peak_off_mm: off.map(|off| off.into_iter().fold(0.0, f64::max) * 1e3),
        radiation_pa: skin.radiation_pressure_pa(rms_pa),
        force_mn: fingertip_n(playback, skin, first_frame, first_m) * 1e3,
        of_threshold: rms_pa / SKIN_THRESHOLD_PA,
        steady_pa,
        swinging_pa,
    })
}

/// A grid about a point, normal to the array axis.
fn around(at_m: Vec3, reach_m: f64, step_m: f64) -> PlaneGrid {
    let mut grid = PlaneGrid::square(reach_m, step_m, at_m.z);
    grid.x_m.iter_mut().for_each(|x| *x += at_m.x);
    grid.y_m.iter_mut().for_each(|y| *y += at_m.y);
    grid
}

/// Distance of the peak from a point, m; `None` if the level rises to the edge of the search range.
fn peak_off_m(playback: &Playback, frame: usize, at_m: Vec3) -> Option<f64> {
    let grid = around(at_m, SEARCH_RANGE_M, 0.5e-3);
    let values = playback.rms_pa(frame, &grid.points());
    let map = PlaneMap::new(grid.x_m, grid.y_m, values).ok()?;
    let top = peak(&map)?;
    let off_m = |x_m: f64, y_m: f64| (x_m - at_m.x).hypot(y_m - at_m.y);
    let inside = (top.x_m - at_m.x).abs() < 0.99 * SEARCH_RANGE_M
        && (top.y_m - at_m.y).abs() < 0.99 * SEARCH_RANGE_M;
    inside.then(|| off_m(top.refined_x_m, top.refined_y_m))
}

fn fingertip_n(playback: &Playback, skin: SkinInAir, frame: usize, at_m: Vec3) -> f64 {
    let step_m = 0.5e-3;
    let disc: Vec<Vec3> = around(at_m, FINGERTIP_M, step_m)
        .points()
        .into_iter()
        .filter(|point| (point - at_m).norm() <= FINGERTIP_M)
        .collect();
    skin.force_n(playback.rms_pa(frame, &disc), step_m * step_m)
}

/// Mean radiation pressure at a point over time, and its amplitude at the modulation frequency, Pa.
fn pressure_over_time(
    composed: &ComposedDisplay,
    playback: &Playback,
    skin: SkinInAir,
    carrier_hz: f64,
    at_m: Vec3,
) -> (f64, Option<f64>) {
    let program = playback.program();
    let whole = program.loop_periods().max(program.envelope().loop_periods());
    // Whole cycles of the modulation, at least one loop.
    let cycle = composed.modulation_hz.map_or(1.0, |hz| carrier_hz / hz);
    let cycles = (whole as f64 / cycle).round().max(1.0);
    let periods = ((cycles * cycle).round() as u64).clamp(1, LONGEST_SERIES);
    let pressures: Vec<f64> = playback
        .pressure_over_time_pa(at_m, periods)
        .into_iter()
        .map(|rms_pa| skin.radiation_pressure_pa(rms_pa))
        .collect();
    let mean = pressures.iter().sum::<f64>() / periods as f64;
    let swinging = composed.modulation_hz.map(|hz| {
        // The phase follows the sweep, if there is one.
        let turns = |period: f64| match &composed.sweep {
            Some(sweep) => sweep.turns(period),
            None => hz / carrier_hz * period,
        };
        let sum: Complex64 = pressures
            .iter()
            .enumerate()
            .map(|(period, pressure)| {
                Complex64::from_polar(*pressure, -std::f64::consts::TAU * turns(period as f64))
            })
            .sum();
        2.0 * sum.norm() / periods as f64
    });
    (mean, swinging)
}
