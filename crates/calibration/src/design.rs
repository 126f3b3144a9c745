//! Which drives, at which places, within a number of readings.
//!
//! **Drives.** Every channel is driven, each with one of four phases a quarter turn apart, at random. Quarter turns are whole steps of every
//! controller whose period has a multiple of four steps. Phases that are not all in opposition tell a weight from its mirror image, which
//! Hadamard codes of signs alone do not. Of two drawn codes the one with the smaller expected variance is kept: the noise of a reading
//! grows with its level, so codes in which the elements nearly cancel tell more.
//!
//! **Places.** With random codes the cross terms between elements vanish on average, and reading i tells each part of the phasor
//! c = T w of an element at its place with the information 1/(2σᵢ²). Where the array stands and the speed of sound are phases too; they
//! are eliminated (Schur's complement). Places are chosen one after another for the least mean variance of the elements' phases and gains:
//! an A-optimal choice. The determinant of the same information, which a D-optimal choice would maximise, is given beside it.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;

use nalgebra::{DMatrix, Matrix4, Vector4};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::limits::{LEAST_NOISE, OFFSET_SD_M, ORDINARY_GAIN, ORDINARY_PHASE_RAD, SPEED_SD};
use fieldgap_acoustics::{Array, FieldKernel, PathLengths, Simulation, Vec3};

/// Codes drawn for each that is used.
const DRAWN: usize = 2;

/// Coded drives between two of the reference drive.
const BETWEEN_REFERENCES: usize = 20;

/// Places of a calibration: the offset of the array has three numbers and the speed of sound one, and a fourth place tells a swapped
/// pair that the others show alike.
pub const PLACES: usize = 4;

/// Noise of a reading that the choice assumes, relative.
const NOISE: f64 = 0.02;

/// A choice of places and drives.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// The places, array frame, m.
    pub places_m: Vec<Vec3>,
    /// The quarter turns of each channel, drive by drive; the drives of one place follow one another.
    pub drives: Vec<Vec<u8>>,
    /// The place of each drive.
    pub place_of: Vec<usize>,
    /// What it promises.
    pub promise: Promise,
}

/// What a choice of places promises for sound elements, with noise of 2 %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Promise {
    /// Root of the mean variance of the elements' phases, rad.
    pub phase_rad: f64,
    /// Root of the mean variance of the elements' gains, relative.
    pub gain: f64,
    /// Natural logarithm of the determinant of the information on phases, per element.
    pub log_determinant: f64,
}

impl Design {
    /// Chooses `count` of the candidate places, or takes those of `given`, and draws codes for so many readings in all.
    ///
    /// `None` without any place, or for fewer readings than places.
    pub fn choose(
        simulation: &Simulation,
        candidates_m: &[Vec3],
        given_m: &[Vec3],
        readings: usize,
        seed: u64,
    ) -> Option<Self> {
        let places_m = if given_m.is_empty() {
            chosen_places(simulation, candidates_m, PLACES, readings)
        } else {
            given_m.to_vec()
        };
        if places_m.is_empty() || readings < places_m.len() {
            return None;
        }
        let informations: Vec<PlaceInformation> =
            places_m.iter().map(|&at| PlaceInformation::of(simulation, at)).collect();
        let promise = promise(&informations.iter().collect::<Vec<_>>(), readings)?;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (mut drives, mut place_of) = (Vec::new(), Vec::new());
        for (place, information) in informations.iter().enumerate() {
            let share = readings / places_m.len() + usize::from(place < readings % places_m.len());
            let references = share.div_ceil(BETWEEN_REFERENCES + 1);
            let mut codes = information.codes(share - references + 1, &mut random);
            let reference = codes.pop().expect("one more was drawn");
            for chunk in codes.chunks(BETWEEN_REFERENCES) {
                drives.push(reference.clone());
                drives.extend_from_slice(chunk);
            }
            place_of.resize(drives.len(), place);
        }
        Some(Self { places_m, drives, place_of, promise })
    }

    /// The same with `readings` codes for other places, none of them used for choosing: for a check.
    pub fn for_check(
        simulation: &Simulation,
        places_m: &[Vec3],
        readings: usize,
        seed: u64,
    ) -> Option<Self> {
        Self::choose(simulation, &[], places_m, readings, seed)
    }

    /// The plan of a scan that takes these readings.
    pub fn plan(&self, name: &str, simulator: &str) -> String {
        let mut text = format!(
            "name = \"{name}\"\n\n[simulator]\nmodel = \"{simulator}\"\n\n[dark]\nbefore = 10\nafter = 10\n\n\
             [reference]\nevery_min = 1e6\n"
        );
        for drive in &self.drives {
            let phases: Vec<String> = drive.iter().map(|turns| quarter(*turns)).collect();
            let _ = write!(text, "\n[[focus]]\nphases_rad = [{}]\n", phases.join(","));
        }
        for (place, at_m) in self.places_m.iter().enumerate() {
            let foci: Vec<String> = (0..self.drives.len())
                .filter(|&drive| self.place_of[drive] == place)
                .map(|drive| drive.to_string())
                .collect();
            let _ = write!(
                text,
                "\n[[points]]\nat_mm = [[{:?}, {:?}, {:?}]]\nfoci = [{}]\n",
                at_m.x * 1e3,
                at_m.y * 1e3,
                at_m.z * 1e3,
                foci.join(",")
            );
        }
        text
    }

    /// The delays of a drive's channels, s.
    pub fn delays_s(&self, drive: usize, frequency_hz: f64) -> Vec<f64> {
        self.drives[drive].iter().map(|&turns| f64::from(turns) / 4.0 / frequency_hz).collect()
    }
}

/// Quarter turns in radians, to a millionth.
fn quarter(turns: u8) -> String {
    match turns {
        0 => "0.0".to_owned(),
        turns => format!("{:.6}", FRAC_PI_2 * f64::from(turns)),
    }
}

/// Candidate places above an array: a lattice as wide as it, at heights from half its width to one and a half.
pub fn candidates(array: &Array) -> Vec<Vec3> {
    let half =
        array.elements().iter().map(|element| element.centre_m.xy().amax()).fold(0.02, f64::max);
    let top = array.elements().iter().map(|element| element.centre_m.z).fold(0.0, f64::max);
    let mut places = Vec::new();
    for z in [1.2, 1.8, 2.6] {
        for y in [-0.8, -0.3, 0.3, 0.8] {
            for x in [-0.8, -0.3, 0.3, 0.8] {
                // Off the lines of symmetry, on which elements are alike; whole tenths of a millimetre are what robots reach.
                let at = Vec3::new(x + 0.13 * y, y - 0.07, z) * half + Vec3::z() * top;
                places.push(at.map(|m| (m * 1e4).round() / 1e4));
            }
        }
    }
    places
}

/// What random codes tell at one place.
struct PlaceInformation {
    /// Each element's field.
    fields: Vec<Complex64>,
    /// Information that one reading gives on each part of an element's relative weight.
    of_element: Vec<f64>,
    /// Derivative of the element's phase by offset (m) and relative speed.
    phase_by: Vec<Vector4<f64>>,
}

impl PlaceInformation {
    fn of(simulation: &Simulation, at_m: Vec3) -> Self {
        let array = &simulation.array;
        let wavenumber = simulation.medium.wavenumber_rad_m(simulation.frequency_hz);
        let kernel = FieldKernel::new(
            array,
            &vec![0.0; array.len()],
            simulation.transducer(),
            wavenumber,
            PathLengths::Observed,
        );
        let fields: Vec<Complex64> =
            kernel.contributions_at(&[at_m]).into_iter().map(|field| field[0]).collect();
        let power: f64 = fields.iter().map(Complex64::norm_sqr).sum();
        let variance = expected_variance(power, power);
        let of_element = fields.iter().map(|field| field.norm_sqr() / (2.0 * variance)).collect();
        let phase_by = array
            .elements()
            .iter()
            .map(|element| {
                let path = at_m - element.centre_m;
                let by_offset = wavenumber * path.normalize();
                Vector4::new(by_offset.x, by_offset.y, by_offset.z, -wavenumber * path.norm())
            })
            .collect();
        Self { fields, of_element, phase_by }
    }

    /// Codes of small expected variance: the better of each two that are drawn.
    fn codes(&self, count: usize, random: &mut ChaCha8Rng) -> Vec<Vec<u8>> {
        let power: f64 = self.fields.iter().map(Complex64::norm_sqr).sum();
        let phasors: [Complex64; 4] =
            [0.0, 1.0, 2.0, 3.0].map(|turns| Complex64::from_polar(1.0, turns * TAU / 4.0));
        // The spread of the elements alone makes a field of this power.
        let spread = power * (ORDINARY_GAIN.powi(2) + ORDINARY_PHASE_RAD.powi(2));
        (0..count)
            .map(|_| {
                let drawn = (0..DRAWN).map(|_| {
                    let code: Vec<u8> =
                        self.fields.iter().map(|_| random.random_range(0..4u8)).collect();
                    let terms = self.fields.iter().zip(&code);
                    let field: Complex64 =
                        terms.map(|(field, &turns)| field * phasors[usize::from(turns)]).sum();
                    (expected_variance(field.norm_sqr() + spread, power), code)
                });
                let best = drawn.min_by(|a, b| a.0.total_cmp(&b.0));
                best.expect("at least one was drawn").1
            })
            .collect()
    }
}

/// Variance of a reading whose level squared is expected to be `square`, where random drives have `power`.
fn expected_variance(square: f64, power: f64) -> f64 {
    NOISE.powi(2) * square + LEAST_NOISE.powi(2) * power
}

/// Places chosen one after another for the least mean variance.
fn chosen_places(
    simulation: &Simulation,
    candidates_m: &[Vec3],
    count: usize,
    readings: usize,
) -> Vec<Vec3> {
    let all: Vec<PlaceInformation> =
        candidates_m.iter().map(|&at| PlaceInformation::of(simulation, at)).collect();
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < count.min(all.len()) {
        let variance = |&next: &usize| {
            let places: Vec<&PlaceInformation> =
                chosen.iter().chain([&next]).map(|&place| &all[place]).collect();
            promise(&places, readings)
                .map_or(f64::INFINITY, |p| p.phase_rad.powi(2) + p.gain.powi(2))
        };
        let free: Vec<usize> = (0..all.len()).filter(|place| !chosen.contains(place)).collect();
        let best = free.into_iter().min_by(|a, b| variance(a).total_cmp(&variance(b)));
        chosen.push(best.expect("fewer were chosen than there are"));
    }
    chosen.into_iter().map(|place| candidates_m[place]).collect()
}

/// What places promise with equal shares of the readings; `None` if they tell nothing of an element.
fn promise(places: &[&PlaceInformation], readings: usize) -> Option<Promise> {
    let elements = places.first()?.of_element.len();
    let share = readings as f64 / places.len() as f64;
    let prior = [OFFSET_SD_M, OFFSET_SD_M, OFFSET_SD_M, SPEED_SD].map(|sd| sd.powi(-2));
    let mut own = vec![0.0; elements];
    let mut cross = vec![Vector4::zeros(); elements];
    let mut common = Matrix4::from_diagonal(&Vector4::from(prior));
    for place in places {
        for n in 0..elements {
            let information = share * place.of_element[n];
            let by = place.phase_by[n];
            own[n] += information;
            cross[n] += information * by;
            common += information * by * by.transpose();
        }
    }
    if own.iter().any(|&information| information <= 0.0) {
        return None;
    }
    // One common phase is not sought: it is a fifth common parameter, fixed by the mean phase being zero.
    let mut reduced = common;
    for n in 0..elements {
        reduced -= cross[n] * cross[n].transpose() / own[n];
    }
    let inverse = reduced.try_inverse()?;
    let slopes: Vec<Vector4<f64>> = (0..elements).map(|n| cross[n] / own[n]).collect();
    let mean: Vector4<f64> = slopes.iter().sum::<Vector4<f64>>() / elements as f64;
    let variances = (0..elements).map(|n| {
        let apart = slopes[n] - mean;
        1.0 / own[n] + (apart.transpose() * inverse * apart)[0]
    });
    let phase = variances.sum::<f64>() / elements as f64;
    let gain = own.iter().map(|information| 1.0 / information).sum::<f64>() / elements as f64;
    let determinant = DMatrix::from_fn(4, 4, |i, j| reduced[(i, j)]).determinant();
    let of_common = DMatrix::from_fn(4, 4, |i, j| common[(i, j)]).determinant();
    let log_own: f64 = own.iter().map(|information| information.ln()).sum();
    let log_determinant =
        (log_own + (determinant / of_common).max(f64::MIN_POSITIVE).ln()) / elements as f64;
    Some(Promise { phase_rad: phase.sqrt(), gain: gain.sqrt(), log_determinant })
}
