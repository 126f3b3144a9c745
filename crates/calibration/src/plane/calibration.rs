//! From planes of amplitudes to a calibration.

use serde::Serialize;

use super::fit::{Fit, fit, variances};
use super::grid::Grid;
use super::held_out::{HeldOutBlocks, held_out};
use super::model::PlaneModel;
use super::parameters::{Group, Layout, Shared};
use crate::CalibrationError;
use crate::channels::channels;
use crate::readings::CodedReadings;
use crate::verification::Gap;
use fieldgap_acoustics::Simulation;
use fieldgap_comparison::{Mirror, PlaneNoise, Registration};
use fieldgap_records::{CalibratedChannel, ChannelState};

/// Points along a block that is held out, smallest first.
const BLOCKS: [usize; 3] = [6, 12, 24];

/// Blocks along a side from which on every fifth is worth holding out.
const LEAST_BLOCKS: usize = 4;

/// Wavelengths from which on a block does not follow from its neighbours. On a measured plane of 256 elements half as much was left of blocks of one
/// wavelength as of blocks of four.
const WIDE: f64 = 2.0;

/// Readings for each independent number of an element below which planes tell too little.
const LEAST_FOR_EACH: usize = 6;

/// What each element of an array emits, from planes of amplitudes.
#[derive(Debug, Clone)]
pub struct PlaneCalibration {
    /// The channels.
    pub channels: Vec<CalibratedChannel>,
    /// Which axis of the scan runs against the array's.
    pub mirror: Mirror,
    /// Numbers that all elements share: pose, lobe and floor.
    pub shared: Vec<SharedNumber>,
    /// Kinds of numbers that each element has of its own, and whether the readings ask for them.
    pub groups: Vec<GroupFound>,
    /// Elements, where they stand and how they lean.
    pub elements: Vec<ElementFound>,
    /// Readings.
    pub used: usize,
    /// Rms of the readings, in their unit.
    pub rms: f64,
    /// Noise of the readings that the fit leaves, relative to their rms: at no level, and relative to the level.
    pub noise: [f64; 2],
    /// Noise that the maps show beyond the wavenumber, without any model; `None` where they are too small.
    pub map_noise: Option<PlaneNoise>,
    /// Readings that tell as much as one that is independent.
    pub readings_of_one: f64,
    /// Rms of what the fit leaves, relative to the rms of the readings.
    pub residual: f64,
    /// What fits leave of blocks that they did not see.
    pub held_out: Vec<HeldOutBlocks>,
    /// What the readings cannot tell, in sentences.
    pub ambiguities: Vec<String>,
    layout: Layout,
    /// The array as it was thought to be in the registered pose, and as it was found.
    parameters: [Vec<f64>; 2],
}

/// A number that all elements share.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SharedNumber {
    /// Its name, with its unit.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// A kind of numbers of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GroupFound {
    /// Which.
    pub group: Group,
    /// Their spread: relative, rad, mm, or of the logarithm of the pressure for each unit of the direction cosine.
    pub spread: f64,
    /// How many of them the readings determine, and how many there are.
    pub determined: f64,
    /// All of them.
    pub numbers: usize,
    /// Natural logarithm of how much more probable the readings are with them.
    pub log_evidence: f64,
    /// Whether they were kept: the evidence is for them.
    pub is_kept: bool,
}

/// Where an element stands and how it leans.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ElementFound {
    /// Place beside the nominal one along x and y, mm.
    pub beside_mm: [f64; 2],
    /// Its standard errors.
    pub beside_error_mm: [f64; 2],
    /// Height that would make its phase, mm.
    pub height_mm: f64,
    /// Angle by which its lobe is turned towards x and y, degrees.
    pub tilt_deg: [f64; 2],
    /// Its standard errors.
    pub tilt_error_deg: [f64; 2],
}

/// Calibrates the array of `simulation` by planes of amplitudes, from the pose of a registration.
///
/// # Errors
/// [`CalibrationError`] if the readings do not fit the array, are silent, or too few.
pub fn calibrate_planes(
    simulation: &Simulation,
    readings: &CodedReadings,
    registration: &Registration,
) -> Result<PlaneCalibration, CalibrationError> {
    let grid = Grid::of(readings);
    let blocks = BLOCKS.iter().filter(|&&points| grid.side() >= LEAST_BLOCKS * points);
    calibrated(simulation, readings, registration, &grid, blocks.copied().collect())
}

/// The same, with only the largest blocks held out: half of the time. `None` if these are narrower than two wavelengths, so that they follow from
/// their neighbours.
///
/// # Errors
/// As for [`calibrate_planes`].
pub fn account_for_planes(
    simulation: &Simulation,
    readings: &CodedReadings,
    registration: &Registration,
) -> Result<Option<PlaneCalibration>, CalibrationError> {
    let grid = Grid::of(readings);
    let wavelength_m = simulation.medium.wavelength_m(simulation.frequency_hz);
    let is_wide = |points: usize| {
        grid.side() >= LEAST_BLOCKS * points && points as f64 * grid.step_m >= WIDE * wavelength_m
    };
    let Some(points) = BLOCKS.into_iter().rev().find(|&points| is_wide(points)) else {
        return Ok(None);
    };
    calibrated(simulation, readings, registration, &grid, vec![points]).map(Some)
}

fn calibrated(
    simulation: &Simulation,
    readings: &CodedReadings,
    registration: &Registration,
    grid: &Grid,
    blocks: Vec<usize>,
) -> Result<PlaneCalibration, CalibrationError> {
    let elements = simulation.array.len();
    if readings.channels() != elements {
        return Err(CalibrationError::OtherArray { channels: readings.channels(), elements });
    }
    let used = readings.readings.len();
    if used < LEAST_FOR_EACH * elements {
        return Err(CalibrationError::TooFew { readings: used, elements });
    }
    if readings.rms() <= 0.0 {
        return Err(CalibrationError::Silent);
    }
    let model = PlaneModel::new(simulation, readings, grid, registration.mirror);
    let both_ways = |axis: usize| {
        let ways = || grid.travel.iter().map(|way| way[axis]);
        ways().any(|way| way > 0.0) && ways().any(|way| way < 0.0)
    };
    let has_travel = both_ways(0) || both_ways(1);
    let whole = Layout { elements, groups: Group::ALL.to_vec(), has_travel };
    let face_m = registration.receiver_face_m.map_or(0.0, |face| face.value);
    let start = model.start(&whole, &registration.pose(), face_m);
    let mut layout = whole.clone();
    let mut dropped = Vec::new();
    let found = loop {
        let from = whole.moved(&start, &layout);
        let found = fit(&model, &layout, &from).ok_or(CalibrationError::Undetermined)?;
        // Gain and phase of each element are what is asked for.
        let worst = layout.groups[2..]
            .iter()
            .map(|&group| group_found(&found, group))
            .min_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
        match worst {
            Some(worst) if worst.log_evidence < 0.0 => {
                layout.groups.retain(|group| *group != worst.group);
                dropped.push(GroupFound { is_kept: false, ..worst });
            }
            _ => break found,
        }
    };
    let start = whole.moved(&start, &layout);
    let held_out =
        blocks.into_iter().filter_map(|points| held_out(&model, &layout, &start, points));
    let held_out = held_out.collect();
    let mut groups: Vec<GroupFound> =
        layout.groups.iter().map(|&group| group_found(&found, group)).collect();
    groups.append(&mut dropped);
    let n = elements;
    let weights = layout.weights(&found.x);
    let parts: Vec<usize> = (0..2 * n).collect();
    let covariance = super::dense::covariance(&found.inverse_factor, &parts);
    let maps = grid.maps(&readings.readings.iter().map(|row| row.value).collect::<Vec<f64>>());
    let maps: Vec<(&[f64], usize)> = maps.iter().map(|(map, n)| (&map[..], *n)).collect();
    let wiring: Vec<usize> = (0..n).collect();
    let channels = channels(&weights, Some(&covariance), &wiring);
    Ok(PlaneCalibration {
        elements: elements_found(&model, &found, &channels),
        ambiguities: ambiguities(&found, &channels, has_travel),
        channels,
        mirror: registration.mirror,
        shared: shared_numbers(&found),
        groups,
        used,
        rms: readings.rms(),
        noise: [found.noise.additive, found.noise.relative],
        map_noise: PlaneNoise::of(&maps),
        readings_of_one: found.readings_of_one,
        residual: found.residual,
        held_out,
        layout,
        parameters: [start, found.x],
    })
}

impl PlaneCalibration {
    /// A shared number by its name.
    pub fn shared(&self, name: &str) -> Option<&SharedNumber> {
        self.shared.iter().find(|number| number.name == name)
    }

    /// The gap on other readings of the array in the same pose, with the array as it was thought to be and as it was found, each with the
    /// best common gain.
    pub fn gap(&self, simulation: &Simulation, readings: &CodedReadings) -> Gap {
        let grid = Grid::of(readings);
        let model = PlaneModel::new(simulation, readings, &grid, self.mirror);
        let values = model.values();
        let power: f64 = values.iter().map(|value| value * value).sum();
        let [before, after] = [0, 1].map(|which| {
            let levels = model.levels(&self.layout, &self.parameters[which]);
            let product: f64 = levels.iter().zip(&values).map(|(level, value)| level * value).sum();
            let square: f64 = levels.iter().map(|level| level * level).sum();
            // What is left beside the part along the levels.
            (1.0 - product * product / (square * power).max(f64::MIN_POSITIVE)).max(0.0).sqrt()
        });
        let [additive, relative] = self.noise;
        Gap { readings: values.len(), before, after, noise: additive.hypot(relative) }
    }

    /// The channels that are not sound.
    pub fn faults(&self) -> impl Iterator<Item = (usize, &CalibratedChannel)> {
        self.channels.iter().enumerate().filter(|(_, c)| c.state != ChannelState::Sound)
    }
}

fn group_found(found: &Fit, group: Group) -> GroupFound {
    let width = found.spread.widths.iter().find(|width| width.group == group);
    let (width, determined) = width.map_or((0.0, 0.0), |w| (w.width, w.determined));
    let in_mm = if group == Group::Place { 1e3 } else { 1.0 };
    let Fit { layout, x, inverse_factor, prior, spread, .. } = found;
    GroupFound {
        group,
        spread: width * in_mm,
        determined,
        numbers: group.size() * layout.elements,
        log_evidence: spread.evidence(layout, x, inverse_factor, prior, group),
        is_kept: true,
    }
}

fn shared_numbers(found: &Fit) -> Vec<SharedNumber> {
    let variances = variances(&found.inverse_factor);
    let number = |&which: &Shared| {
        let (name, unit) = match which {
            Shared::Shift(0) => ("shift_x_mm", 1e3),
            Shared::Shift(1) => ("shift_y_mm", 1e3),
            Shared::Shift(_) => ("shift_z_mm", 1e3),
            Shared::Turn => ("turn_deg", 1f64.to_degrees()),
            Shared::Step(0) => ("step_ratio_x", 1.0),
            Shared::Step(_) => ("step_ratio_y", 1.0),
            Shared::Slope(0) => ("slope_x_deg", 1f64.to_degrees()),
            Shared::Slope(_) => ("slope_y_deg", 1f64.to_degrees()),
            Shared::Travel(0) => ("backlash_along_mm", 1e3),
            Shared::Travel(_) => ("backlash_across_mm", 1e3),
            Shared::Lobe(1) => ("lobe_sin2", 1.0),
            Shared::Lobe(2) => ("lobe_sin4", 1.0),
            Shared::Lobe(_) => ("lobe_sin6", 1.0),
            Shared::LobePhase(1) => ("lobe_phase_sin2_rad", 1.0),
            Shared::LobePhase(_) => ("lobe_phase_sin4_rad", 1.0),
            Shared::Lean(0) => ("lean_x", 1.0),
            Shared::Lean(_) => ("lean_y", 1.0),
            Shared::Level => return None,
            Shared::Floor => ("floor", 1.0),
        };
        if matches!(which, Shared::Travel(_)) && !found.layout.has_travel {
            return None;
        }
        let at = found.layout.shared(which);
        let standard_error = variances[at].sqrt() * unit;
        Some(SharedNumber { name, value: found.x[at] * unit, standard_error })
    };
    Shared::ALL.iter().filter_map(number).collect()
}

fn elements_found(
    model: &PlaneModel<'_>,
    found: &Fit,
    channels: &[CalibratedChannel],
) -> Vec<ElementFound> {
    let layout = &found.layout;
    let variances: Vec<f64> = variances(&found.inverse_factor);
    let errors = |group, element| layout.pair(&variances, group, element).map(f64::sqrt);
    // The lobe exp(-a sin² θ) turned by τ gains 2 a τ sin θ.
    let steepness = model.steepness() - found.x[layout.shared(Shared::Lobe(1))];
    let degrees = |lean: f64| (lean / (2.0 * steepness.max(0.5))).to_degrees();
    channels
        .iter()
        .enumerate()
        .map(|(element, channel)| ElementFound {
            beside_mm: layout.pair(&found.x, Group::Place, element).map(|m| m * 1e3),
            beside_error_mm: errors(Group::Place, element).map(|m| m * 1e3),
            height_mm: -channel.phase_rad / model.wavenumber() * 1e3,
            tilt_deg: layout.pair(&found.x, Group::Lean, element).map(degrees),
            tilt_error_deg: errors(Group::Lean, element).map(degrees),
        })
        .collect()
}

fn ambiguities(found: &Fit, channels: &[CalibratedChannel], has_travel: bool) -> Vec<String> {
    let mut texts = vec![
        "Amplitudes tell neither the common phase nor the common gain: gains are relative to their median, phases to their mean.".to_owned(),
        "Phase and height of an element, and exchanged channels, are not told apart: a height is given as the phase that it makes, and each \
         channel is taken to drive its own element."
            .to_owned(),
        "Height, step and the array's pitch trade off against one another, and so do a common lean and a slope of the plane.".to_owned(),
    ];
    if !has_travel {
        texts.push("All rows run one way: a backlash is a shift.".to_owned());
    }
    let weak = channels.iter().filter(|channel| {
        channel.state != ChannelState::Dead
            && channel.phase_error_rad > 0.7 * found.spread.of(Group::Phase)
    });
    let weak = weak.count();
    if weak > 0 {
        texts.push(format!(
            "The phase of {weak} elements is hardly better known than by the spread of all."
        ));
    }
    texts
}
