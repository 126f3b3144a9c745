//! What skin at the foci feels of a display.

use num_complex::Complex64;
use serde::Serialize;

use super::compose::Composed;
use super::playback::Playback;
use fieldgap_acoustics::metrics::{PlaneMap, peak};
use fieldgap_acoustics::radiation::{SKIN_THRESHOLD_PA, SkinInAir, level_db};
use fieldgap_acoustics::{PlaneGrid, Vec3};

/// Frames of each focus that its peak is looked for in, at most.
const LOOKED_AT: usize = 24;

/// How far from its place a peak is looked for, m: less than a wavelength, so that neighbours are not met.
const LOOKED_WITHIN_M: f64 = 6e-3;

/// Radius of the disc that the force is taken over, m: a fingertip.
const FINGERTIP_M: f64 = 10e-3;

/// Periods of the carrier that a course in time is followed, at most: two seconds at 40 kHz.
const FOLLOWED_PERIODS: u64 = 80_000;

/// What is felt at one focus.
#[derive(Debug, Clone, Serialize)]
pub struct FeltFocus {
    /// Which, from 0.
    pub focus: usize,
    /// Frames in which it sounds.
    pub frames: usize,
    /// Sound pressure at its place under the whole envelope, the mean over its frames, Pa rms.
    pub rms_pa: f64,
    /// The least of them.
    pub least_pa: f64,
    /// The largest.
    pub most_pa: f64,
    /// The mean as a level, dB re 20 µPa.
    pub level_db: f64,
    /// How far the peak of the plane stands from where the focus was asked for, at most, mm; `None` where no peak stands
    /// within 6 mm.
    pub peak_off_mm: Option<f64>,
    /// Radiation pressure on skin at the mean, Pa.
    pub radiation_pa: f64,
    /// Force on a disc of 10 mm radius about its first place, across the array's axis, mN.
    pub force_mn: f64,
    /// The mean over the thesis's threshold.
    pub of_threshold: f64,
    /// Radiation pressure on skin that stays at one of its places, the mean over time, Pa: at the place where it swings most.
    pub steady_pa: f64,
    /// What of it swings at the modulation's momentary frequency there, amplitude, Pa; `None` for a continuous wave.
    pub swinging_pa: Option<f64>,
}

/// What is felt of a display.
#[derive(Debug, Clone, Serialize)]
pub struct Felt {
    /// At each focus.
    pub foci: Vec<FeltFocus>,
    /// The threshold that the thesis gives, Pa rms.
    pub threshold_pa: f64,
}

/// What skin feels of a display that is played.
pub fn felt(composed: &Composed, playback: &Playback, skin: SkinInAir, carrier_hz: f64) -> Felt {
    let count = composed.slots.iter().flat_map(|slot| &slot.foci).map(|(focus, _)| focus + 1).max();
    let foci = (0..count.unwrap_or(0))
        .filter_map(|focus| felt_at(focus, composed, playback, skin, carrier_hz))
        .collect();
    Felt { foci, threshold_pa: SKIN_THRESHOLD_PA }
}

fn felt_at(
    focus: usize,
    composed: &Composed,
    playback: &Playback,
    skin: SkinInAir,
    carrier_hz: f64,
) -> Option<FeltFocus> {
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
    let lasts: f64 = places.iter().map(|(_, _, periods)| periods).sum();
    let rms_pa =
        levels.iter().zip(&places).map(|(level, (_, _, periods))| level * periods).sum::<f64>()
            / lasts;
    let every = places.len().div_ceil(LOOKED_AT);
    let off: Option<Vec<f64>> = places
        .iter()
        .step_by(every)
        .map(|(frame, at_m, _)| peak_off_m(playback, *frame, *at_m))
        .collect();
    let (steady_pa, swinging_pa) = places
        .iter()
        .step_by(every)
        .map(|(_, at_m, _)| course(composed, playback, skin, carrier_hz, *at_m))
        .max_by(|(_, one), (_, other)| one.unwrap_or(0.0).total_cmp(&other.unwrap_or(0.0)))?;
    Some(FeltFocus {
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

/// A grid of a place's surroundings, across the array's axis.
fn around(at_m: Vec3, reach_m: f64, step_m: f64) -> PlaneGrid {
    let mut grid = PlaneGrid::square(reach_m, step_m, at_m.z);
    grid.x_m.iter_mut().for_each(|x| *x += at_m.x);
    grid.y_m.iter_mut().for_each(|y| *y += at_m.y);
    grid
}

/// How far the peak stands from a place; `None` if the plane rises to the edge of what is looked at.
fn peak_off_m(playback: &Playback, frame: usize, at_m: Vec3) -> Option<f64> {
    let grid = around(at_m, LOOKED_WITHIN_M, 0.5e-3);
    let values = playback.rms_pa(frame, &grid.points());
    let map = PlaneMap::new(grid.x_m, grid.y_m, values).ok()?;
    let top = peak(&map)?;
    let off_m = |x_m: f64, y_m: f64| (x_m - at_m.x).hypot(y_m - at_m.y);
    let inside = (top.x_m - at_m.x).abs() < 0.99 * LOOKED_WITHIN_M
        && (top.y_m - at_m.y).abs() < 0.99 * LOOKED_WITHIN_M;
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

/// Mean of the radiation pressure at a place over time, and its amplitude at the modulation's frequency.
fn course(
    composed: &Composed,
    playback: &Playback,
    skin: SkinInAir,
    carrier_hz: f64,
    at_m: Vec3,
) -> (f64, Option<f64>) {
    let program = playback.program();
    let whole = program.loop_periods().max(program.envelope().loop_periods());
    // Whole cycles of the modulation, over a loop at least.
    let cycle = composed.modulation_hz.map_or(1.0, |hz| carrier_hz / hz);
    let cycles = (whole as f64 / cycle).round().max(1.0);
    let periods = ((cycles * cycle).round() as u64).clamp(1, FOLLOWED_PERIODS);
    let pressures: Vec<f64> = playback
        .course_pa(at_m, periods)
        .into_iter()
        .map(|rms_pa| skin.radiation_pressure_pa(rms_pa))
        .collect();
    let mean = pressures.iter().sum::<f64>() / periods as f64;
    let swinging = composed.modulation_hz.map(|hz| {
        // Followed through its sweep, where it has one.
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
