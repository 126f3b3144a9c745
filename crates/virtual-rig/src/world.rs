//! The physical world that the three devices share: robot, array, air and receiver.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use num_complex::Complex64;

use super::clock::Clock;
use super::converter::Converter;
use super::counter_rng::CounterRng;
use super::drive::{Drive, DriveHistory, Played};
use super::gestures::{ElementPaths, Swipe, Swipes};
use super::trajectory::Trajectory;
use super::true_field::{AirStep, Contributions, TrueField};
use super::truth::{PhaseTruth, Truth};
use fieldgap_acoustics::{Array, Medium, Vec3};
use fieldgap_input::Fault;

/// Averaging time of the receiver, s: one period of the modulation that skin feels best (200 Hz).
const SMOOTHED_S: f64 = 5e-3;

/// Period of the slow drift of the direct coupling between elements, s.
const DRIFTS_S: f64 = 20.0;

/// The assumed set-up: what the rig file states, and what the effects of the truth file change.
#[derive(Debug, Clone)]
pub struct Believed {
    /// The array, in its own frame.
    pub array: Array,
    /// The air.
    pub medium: Medium,
    /// The carrier, Hz.
    pub frequency_hz: f64,
    /// The array's centre in the robot's axes, m.
    pub array_origin_m: Vec3,
}

/// Robot, array and air at any instant of virtual time.
pub struct World {
    trajectory: Arc<Mutex<Trajectory>>,
    array_origin_m: Vec3,
    volts: f64,
    multiplicative_noise: f64,
    additive_noise_v: f64,
    noise: CounterRng,
    phase: PhaseTruth,
    phase_noise: CounterRng,
    /// Noise of the elements used as receivers.
    hiss: CounterRng,
    hand: Option<Swipes>,
    drift: f64,
    field: TrueField,
    drives: Mutex<DriveHistory>,
    last_field: Mutex<LastField>,
    clock: Arc<Clock>,
}

/// The field that was computed last: a robot at rest needs the same one for every sample.
#[derive(Default)]
struct LastField {
    contributions: Option<((AirStep, Vec3), Contributions)>,
    weights: Option<(u64, Vec<Complex64>)>,
    phasor: Option<Complex64>,
}

impl World {
    /// The world of a truth file.
    ///
    /// # Errors
    /// A [`Fault`] of the truth file if an effect does not fit the array.
    pub fn new(
        believed: &Believed,
        truth: Truth,
        seed: u64,
        trajectory: Arc<Mutex<Trajectory>>,
        clock: Arc<Clock>,
    ) -> Result<Self, Fault> {
        truth.check(believed.array.len())?;
        let rng = CounterRng::new(seed);
        let field = TrueField::new(
            &believed.array,
            believed.medium,
            believed.frequency_hz,
            &truth.source,
            truth.effects,
            rng,
        );
        Ok(Self {
            trajectory,
            array_origin_m: believed.array_origin_m,
            volts: truth.pressure_pa_at_1_m.get() * truth.microphone.sensitivity_v_pa.get(),
            multiplicative_noise: truth.noise.multiplicative.get(),
            additive_noise_v: truth.noise.additive_v.get(),
            noise: rng.stream("noise"),
            phase: truth.phase,
            phase_noise: rng.stream("phase"),
            hiss: rng.stream("listening"),
            hand: truth.hand.map(|hand| Swipes::new(hand, rng)),
            drift: truth.hand.map_or(0.0, |hand| hand.drift.get()),
            field,
            drives: Mutex::new(DriveHistory::new(Drive::silent(believed.array.len()))),
            last_field: Mutex::default(),
            clock,
        })
    }

    /// The motion of the robot that carries the nozzle.
    pub(super) fn trajectory(&self) -> Arc<Mutex<Trajectory>> {
        self.trajectory.clone()
    }

    /// Whether virtual time stands still until an answer needs it.
    pub fn is_lockstep(&self) -> bool {
        self.clock.is_lockstep()
    }

    /// The receiver's converter as its settings have it, unless an effect changes its full scale.
    pub fn converter(&self, full_scale_v: f64, bits: u32) -> Converter {
        Converter::new(self.field.full_scale_v(full_scale_v), bits)
    }

    /// From `time_s` on the array is driven like this.
    pub fn drive(&self, time_s: f64, drive: Drive) {
        lock(&self.drives).push(time_s, drive);
    }

    /// How the array is driven at `time_s`.
    pub fn drive_at(&self, time_s: f64) -> Drive {
        lock(&self.drives).at(time_s).1.clone()
    }

    /// The hand's gestures that began before `time_s`; empty without a hand.
    pub fn swipes_until(&self, time_s: f64) -> Vec<Swipe> {
        self.hand.as_ref().map(|hand| hand.until(time_s)).unwrap_or_default()
    }

    /// Where the nozzle truly is at `time_s`, array's frame, m.
    pub fn nozzle_m(&self, time_s: f64) -> Vec3 {
        let kinematics = lock(&self.trajectory).at(time_s);
        self.field.place(kinematics.position_mm * 1e-3 - self.array_origin_m, &kinematics)
    }

    /// The rectified and smoothed signal at the converter at `time_s`, V, with the noise of the `sample`th sample.
    ///
    /// Noise adds to the carrier, both quadratures alike, before its magnitude is taken, so a silent field does not
    /// read zero. Modulation is slower than the carrier and faster than the receiver's averaging: the level scales by its duty.
    pub fn reading_v(&self, time_s: f64, sample: u64) -> f64 {
        self.phasor_v(time_s, sample).norm()
    }

    /// As [`World::reading_v`], before rectification: the complex amplitude of the carrier, V, against the field's own phase.
    pub fn phasor_v(&self, time_s: f64, sample: u64) -> Complex64 {
        self.noisy_v(self.level_v(time_s).0, time_s, sample)
    }

    /// As [`World::phasor_v`], against the clock that the drives are made from, as a receiver with that clock measures it; the time
    /// convention is exp(-iωt). A display that plays has no phase: its frames are averaged.
    pub fn synchronous_v(&self, time_s: f64, sample: u64) -> Complex64 {
        let (level_v, phase_rad) = self.level_v(time_s);
        let noise_rad = self.phase.noise_rad.get() * self.phase_noise.normal(sample);
        let drift_rad = self.phase.drift_rad_h.get() * time_s / 3600.0;
        let phase_rad = phase_rad + self.phase.offset_rad.get() + drift_rad + noise_rad;
        self.noisy_v(level_v, time_s, sample) * Complex64::from_polar(1.0, phase_rad)
    }

    fn noisy_v(&self, level_v: f64, time_s: f64, sample: u64) -> Complex64 {
        let level_v = self.field.level_v(level_v, time_s);
        let normal = |part: u64| self.noise.normal(3 * sample + part);
        let in_phase_v = level_v * (1.0 + self.multiplicative_noise * normal(0))
            + self.additive_noise_v * normal(1);
        Complex64::new(in_phase_v, self.additive_noise_v * normal(2))
    }

    /// The carrier that is truly emitted, Hz.
    pub fn carrier_hz(&self) -> f64 {
        self.field.carrier_hz()
    }

    /// The rectified and smoothed signal of each element used as a receiver at `time_s`, V, with the noise of the `sample`th
    /// sample.
    ///
    /// An element receives the direct coupling from the others, which drifts slowly, and the hand's echo. While a display plays,
    /// it receives the current frame at the mean level over the averaging time.
    pub fn sensed_v(&self, time_s: f64, sample: u64) -> Vec<f64> {
        let drive = self.drive_at(time_s);
        let outputs = match &drive.display {
            Some(played) => {
                let stretches = played.stretches(time_s - SMOOTHED_S, time_s);
                let last = stretches.last().map(|&(_, frame, level)| played.outputs(frame, level));
                last.unwrap_or_default()
            }
            None => drive.outputs(),
        };
        let weights = self.field.weights(&outputs);
        let elements = &self.field.array().elements;
        let air = ElementPaths { wavenumber_rad_m: self.field.wavenumber_rad_m() };
        let plate = self.hand.as_ref().and_then(|hand| hand.at(time_s).plate(time_s));
        let received_v = |place: usize, listens: &usize| {
            let hiss = self.hiss.substream(place as u64);
            let turns = time_s / DRIFTS_S + hiss.uniform(u64::MAX);
            let drifted = 1.0 + self.drift * (std::f64::consts::TAU * turns).sin();
            let Some(sensor) = elements.get(*listens) else { return 0.0 };
            let pressure: Complex64 = elements
                .iter()
                .zip(&weights)
                .enumerate()
                .filter(|(n, (_, weight))| n != listens && **weight != Complex64::ZERO)
                .map(|(_, (emitter, weight))| {
                    let echo =
                        plate.map_or(Complex64::ZERO, |plate| air.echo(emitter, sensor, &plate));
                    weight * (air.coupling(emitter, sensor) * drifted + echo)
                })
                .sum();
            let level_v = pressure.norm() * self.volts * drive.duty;
            let normal = |part: u64| hiss.normal(3 * sample + part);
            let in_phase_v = level_v * (1.0 + self.multiplicative_noise * normal(0))
                + self.additive_noise_v * normal(1);
            in_phase_v.hypot(self.additive_noise_v * normal(2))
        };
        drive
            .listening
            .iter()
            .enumerate()
            .map(|(place, listens)| received_v(place, listens))
            .collect()
    }

    /// The level without noise, V, and the phase of the field, rad.
    fn level_v(&self, time_s: f64) -> (f64, f64) {
        let (number, drive) = {
            let drives = lock(&self.drives);
            let (number, drive) = drives.at(time_s);
            (number, drive.clone())
        };
        if !drive.emitting {
            return (0.0, 0.0);
        }
        let at_m = self.nozzle_m(time_s - self.field.lag_s());
        let mut last = lock(&self.last_field);
        let last = &mut *last;
        let where_and_when = (self.field.air_at(time_s), at_m);
        if last.contributions.as_ref().is_none_or(|(known, _)| *known != where_and_when) {
            let (air, at_m) = where_and_when;
            last.contributions = Some((where_and_when, self.field.contributions_in(air, at_m)));
            last.phasor = None;
        }
        if let (Some(played), Some((_, contributions))) = (&drive.display, &last.contributions) {
            return (self.played_v(played, contributions, time_s), 0.0);
        }
        if last.weights.as_ref().is_none_or(|(known, _)| *known != number) {
            last.weights = Some((number, self.field.weights(&drive.outputs())));
            last.phasor = None;
        }
        let (Some((_, weights)), Some((_, contributions))) = (&last.weights, &last.contributions)
        else {
            unreachable!("both were filled in above")
        };
        let phasor = match last.phasor.filter(|_| !self.field.scintillates()) {
            Some(phasor) => phasor,
            None => self.field.phasor(contributions, weights, time_s),
        };
        last.phasor = Some(phasor);
        (phasor.norm() * self.volts * drive.duty, phasor.arg())
    }

    /// The level of a display, averaged over the smoothing time, V.
    fn played_v(&self, played: &Played, contributions: &Contributions, time_s: f64) -> f64 {
        played
            .stretches(time_s - SMOOTHED_S, time_s)
            .into_iter()
            .map(|(share, frame, level)| {
                let weights = self.field.weights(&played.outputs(frame, level));
                share * self.field.magnitude(contributions, &weights, time_s) * self.volts
            })
            .sum()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
