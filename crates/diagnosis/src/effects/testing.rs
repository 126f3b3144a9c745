//! What the tests of effects share: a believed set-up, and the points of the chain before an effect acts.

use fieldgap_acoustics::transducer::Piston;
use fieldgap_acoustics::{
    Array, Element, Excitation, Medium, PathLengths, Simulation, Simulator, Vec3,
};
use fieldgap_virtual_rig::counter_rng::CounterRng;
use nalgebra::Vector3;

use super::crosstalk::neighbours;
use super::effect;
use crate::effect_id::EffectId;
use crate::model::effect::{Choice, Context, Effect, Radiation};
use crate::model::forward_model::ForwardModel;
use crate::model::instance::{Instance, Setting};
use crate::model::motion::Motion;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, ObservedDrive, ObservedScan, Visit};
use crate::model::stated_uncertainty::{StatedDeparture, StatedUncertainty};
use crate::statistics::noise_scale::NoiseScale;
use crate::statistics::scatter::Scatter;

/// A believed set-up: a focused array of pistons whose largest reading is 2 V.
pub(crate) struct Bench {
    pub context: Context,
}

impl Bench {
    pub fn new() -> Self {
        Self::of(Array::square(4, 4, 10e-3).expect("not empty"), Excitation::Focus(Vec3::z() * 0.1))
    }

    pub fn of_one_element() -> Self {
        Self::of(Array::square(1, 1, 1e-4).expect("not empty"), Excitation::Uniform)
    }

    pub fn of(array: Array, excitation: Excitation) -> Self {
        let believed = Simulation {
            simulator: Simulator::Piston,
            array,
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
            excitation,
        };
        let context = Context {
            neighbours: neighbours(believed.array.elements()).into(),
            believed,
            largest_reading: 2.0,
            unit: "V".to_owned(),
            highest_m: 0.15,
            lasts_s: 600.0,
            dark_floor: 0.0,
            common: None,
            stated: StatedUncertainty::default(),
            tried: None,
        };
        Self { context }
    }

    pub fn believed(&self) -> &Simulation {
        &self.context.believed
    }

    pub fn at<'a>(&'a self, values: &'a [f64]) -> Setting<'a> {
        Setting { values, choice: &Choice::None, context: &self.context }
    }

    /// Readings at some places for each of these drives, as the set-up as believed expects them, with 2 % and 0.01 V of noise to come.
    pub fn observations(&self, drives: &[(Excitation, Vec<Vec3>)]) -> Observations {
        let mut scan = ObservedScan {
            drives: Vec::new(),
            scatter: Scatter::default(),
            averaged: 1.0,
            scale: NoiseScale::new(0.02, 0.01, 1.0),
            dark: Vec::new(),
            within: None,
            slow_level: None,
            map_noise: None,
            outliers: 0,
            phase: None,
        };
        scan.set_scatter(Scatter { share: 0.02, additive: 0.01, ..Scatter::default() });
        for (number, (excitation, places_m)) in drives.iter().enumerate() {
            let mut believed = self.believed().clone();
            believed.excitation = excitation.clone();
            let first = scan.drives.iter().map(|drive| drive.visits.len()).sum::<usize>();
            let numbered = (first..).zip(places_m);
            let visits: Vec<Visit> =
                numbered.map(|(number, &at_m)| Visit { number, at_m, ..visit() }).collect();
            let pressures = ForwardModel::believed().pressures_at(&believed, &visits, &nuisance());
            let model = ForwardModel::believed();
            let expected = pressures.iter().map(|p| model.expected(p, 1.0, 0.0, &scan).reading);
            let readings: Vec<f64> = expected.collect();
            let stabilised = readings.iter().map(|reading| scan.scale.of(*reading)).collect();
            let focus = number;
            scan.drives.push(ObservedDrive {
                focus,
                number,
                believed,
                visits,
                stabilised,
                expected: Vec::new(),
                readings,
                phases_rad: Vec::new(),
                believed_rad: Vec::new(),
            });
        }
        Observations { scans: vec![scan] }
    }

    /// As the readings of a 4 x 4 array of this pitch, all elements in phase, in six planes.
    pub fn in_six_planes(pitch_m: f64) -> Observations {
        let places_m: Vec<Vec3> = (0..600)
            .map(|n| {
                let (x, y, z) = (n % 10, n / 10 % 10, n / 100);
                Vec3::new(f64::from(x) - 4.5, f64::from(y) - 4.5, f64::from(z))
                    .component_mul(&Vec3::new(8e-3, 8e-3, 12e-3))
                    + Vec3::z() * 0.06
            })
            .collect();
        Self::of(Array::square(4, 4, pitch_m).expect("not empty"), Excitation::Uniform)
            .observations(&[(Excitation::Uniform, places_m)])
    }

    /// The same with elements whose amplitudes and phases are known to these standard deviations.
    pub fn with_elements_known_to(mut self, gain: f64, phase_rad: f64) -> Self {
        let elements = self.believed().array.len();
        let of = |id, sd| StatedDeparture {
            instance: Instance { effect: effect(id), choice: Choice::None },
            priors: vec![(0.0, sd); elements],
        };
        self.context.stated.departures =
            vec![of(EffectId::ElementGain, gain), of(EffectId::ElementPhase, phase_rad)];
        self
    }

    /// Departures of this size at most that go up and down from element to element.
    pub fn waves(&self, size: f64, turn_rad: f64) -> Vec<f64> {
        (0..self.believed().array.len()).map(|n| size * (turn_rad * n as f64).sin()).collect()
    }

    pub fn model(&self, id: EffectId, values: &[f64]) -> ForwardModel<'_> {
        let instance = Instance { effect: effect(id), choice: Choice::None };
        ForwardModel::of(&[instance], &[values.to_vec()], &self.context)
    }
}

/// Makes the readings of the first drive those that a model expects, without noise.
pub(crate) fn read(observations: &mut Observations, model: &ForwardModel<'_>) {
    let readings = model.expected_readings(observations, &[nuisance()]);
    let scan = &mut observations.scans[0];
    scan.drives[0].stabilised = readings.iter().map(|reading| scan.scale.of(*reading)).collect();
    scan.drives[0].readings = readings;
}

pub(crate) fn visit() -> Visit {
    Visit {
        number: 0,
        at_m: Vec3::z() * 0.1,
        motion: Motion::steady(Vec3::zeros(), 0.0),
        otherwise: None,
        begins: false,
        time_s: 0.0,
        progress: 0.0,
        variance: 1.0,
    }
}

pub(crate) fn nuisance() -> Nuisance {
    Nuisance { log_gain: 0.0, shift_m: Vector3::zeros(), near_field: 0.0 }
}

pub(crate) fn radiation() -> Radiation<'static> {
    Radiation {
        transducer: &Piston,
        width_ratio: 1.0,
        by_face: false,
        shape: [0.0; 2],
        on_axis: None,
        paths: PathLengths::Observed,
    }
}

/// Amplitudes of three elements after an effect that names some of them.
pub(crate) fn amplitudes_with(effect: &dyn Effect, named: &[usize]) -> [f64; 3] {
    let bench = Bench::new();
    let choice = Choice::Elements(named.to_vec());
    let mut elements = [Element::at(0.0, 0.0); 3];
    effect.elements(Setting { choice: &choice, ..bench.at(&[]) }, &mut elements);
    elements.map(|element| element.amplitude)
}

/// Three rows across a focus, each flown forth and back at a speed of its own, which tells play from a lag.
pub(crate) struct Flown {
    pub bench: Bench,
    pub observations: Observations,
}

impl Flown {
    const SPEEDS_M_S: [f64; 3] = [0.02, 0.05, 0.1];

    /// With dark readings and 1 % of noise, as a set-up with this effect reads them, its places scattered by so many millimetres along x and y.
    pub fn with(id: EffectId, value: f64, scatter_mm: f64) -> Self {
        let row = |y_mm: f64, back: bool| {
            (0..40).map(move |n| {
                let x_mm = f64::from(if back { 39 - n } else { n }) - 19.5;
                Vec3::new(1e-3 * x_mm, 1e-3 * y_mm, 0.1)
            })
        };
        let places_m: Vec<Vec3> = [-6.0, 1.0, 5.0]
            .into_iter()
            .flat_map(|y_mm| row(y_mm, false).chain(row(y_mm, true)))
            .collect();
        let focus = Excitation::Focus(Vec3::z() * 0.1);
        let bench = Bench::of(Array::square(8, 8, 10e-3).expect("not empty"), focus.clone());
        let mut observations = bench.observations(&[(focus, places_m.clone())]);
        let rng = CounterRng::new(5);
        let rayleigh = |n: u64| rng.normal(2 * n).hypot(rng.normal(2 * n + 1));
        observations.scans[0].dark = (1000..1032).map(rayleigh).collect();
        for visit in &mut observations.scans[0].drives[0].visits {
            let direction = if visit.number / 40 % 2 == 0 { 1.0 } else { -1.0 };
            let speed_m_s = Self::SPEEDS_M_S[visit.number / 80];
            visit.motion = Motion::steady(Vec3::x() * speed_m_s * direction, direction);
            visit.otherwise = None;
            let [x, y] = [0, 1].map(|axis| rng.normal(2 * visit.number as u64 + axis));
            visit.at_m += 1e-3 * scatter_mm * Vec3::new(x, y, 0.0);
        }
        read(&mut observations, &bench.model(id, &[value]));
        let scan = &mut observations.scans[0];
        let drive = &mut scan.drives[0];
        for (n, (visit, at_m)) in drive.visits.iter_mut().zip(places_m).enumerate() {
            visit.at_m = at_m;
            drive.readings[n] *= 1.0 + 0.01 * rng.normal(3000 + n as u64);
            drive.stabilised[n] = scan.scale.of(drive.readings[n]);
        }
        Self { bench, observations }
    }
}
