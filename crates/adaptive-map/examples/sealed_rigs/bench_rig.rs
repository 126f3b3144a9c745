//! A rig of a sealed set, read in this process: the physics of the virtual rig (vibrating pistons by their Rayleigh integrals, and the
//! effects of its truth file), the noise of its receiver and the time of its robot, without firmware and ports.

use std::path::Path;

use fieldgap_acoustics::{Vec3, delays_s};
use fieldgap_acquisition::RigSetup;
use fieldgap_closed_loop::{Planned, Robot};
use fieldgap_records::{Plan, RecordedSample, RecordedScan, ScanSetup, Spread};
use fieldgap_virtual_rig::Truth;
use fieldgap_virtual_rig::counter_rng::CounterRng;
use fieldgap_virtual_rig::drive::Drive;
use fieldgap_virtual_rig::trajectory::Kinematics;
use fieldgap_virtual_rig::true_field::TrueField;
use num_complex::Complex64;

/// Samples of a reading, and seconds from one to the next.
const SAMPLES: u64 = 16;
const SAMPLE_S: f64 = 1e-3;

/// Draws over which the truth of an effect that fluctuates is averaged.
const DRAWS: usize = 100;

pub struct BenchRig {
    pub setup: RigSetup,
    field: TrueField,
    /// The amplitude of each element, for each drive of the plan.
    weights: Vec<Vec<Complex64>>,
    volts: f64,
    multiplicative: f64,
    additive_v: f64,
    noise: CounterRng,
    pub effects: Vec<String>,
}

/// The robot and the clock of one scan.
pub struct Session<'r> {
    rig: &'r BenchRig,
    robot: Robot,
    at_m: Vec3,
    time_s: f64,
    x_direction: f64,
    travelled_mm: f64,
    taken: u64,
    pub record: RecordedScan,
}

impl BenchRig {
    pub fn open(folder: &Path, plan: &Plan) -> Self {
        let path = folder.join(fieldgap_blind::RIG);
        let setup = RigSetup::read(&path).expect("the rig file");
        let truth = Truth::read(&setup.truth_path().expect("a virtual rig")).expect("the truth");
        let text = setup.source().text();
        let seed = text.lines().find_map(|line| line.strip_prefix("seed = ")).expect("a seed");
        let rng = CounterRng::new(seed.parse().expect("a number"));
        let frequency_hz = setup.array.frequency_hz();
        let (array, medium) = (setup.nominal_array().clone(), setup.nominal_medium());
        let effects = truth.effects.iter().map(|(id, _)| (*id).to_owned()).collect();
        let volts = truth.pressure_pa_at_1_m.get() * truth.microphone.sensitivity_v_pa.get();
        let (multiplicative, additive_v) =
            (truth.noise.multiplicative.get(), truth.noise.additive_v.get());
        let field = TrueField::new(&array, medium, frequency_hz, &truth.source, truth.effects, rng);
        let weights = plan
            .foci
            .iter()
            .map(|focus| {
                let delays = delays_s(&focus.excitation(), &array, &medium, frequency_hz);
                let delays_s = delays.into_iter().map(Some).collect();
                let drive = Drive { emitting: true, delays_s, ..Drive::silent(array.len()) };
                field.weights(&drive.outputs())
            })
            .collect();
        let noise = rng.stream("noise");
        Self { setup, field, weights, volts, multiplicative, additive_v, noise, effects }
    }

    fn level_v(&self, at_m: Vec3, focus: usize, time_s: f64) -> f64 {
        let contributions = self.field.contributions(at_m);
        self.field.magnitude(&contributions, &self.weights[focus], time_s) * self.volts
    }

    /// Levels at a place as they would be drawn again and again; one where nothing fluctuates. The robot comes from smaller x.
    pub fn levels_v(&self, at_m: Vec3, focus: usize) -> Vec<f64> {
        let is_moved = self.effects.iter().any(|id| id == "position-jitter");
        let draws = if is_moved || self.field.scintillates() { DRAWS } else { 1 };
        let place_m = |draw: usize| {
            let kinematics = Kinematics {
                position_mm: at_m * 1e3,
                x_direction: 1.0,
                x_since_reversal_mm: f64::INFINITY,
                travelled_mm: 1e6 + 1.037 * draw as f64,
            };
            self.field.place(at_m, &kinematics)
        };
        let steady = (!is_moved).then(|| self.field.contributions(place_m(0)));
        let one = |draw: usize| {
            let moved = steady.is_none().then(|| self.field.contributions(place_m(draw)));
            let contributions = steady.as_ref().or(moved.as_ref()).expect("one of both");
            let time_s = 1e4 + 0.13 * draw as f64;
            self.field.magnitude(contributions, &self.weights[focus], time_s) * self.volts
        };
        (0..draws).map(one).collect()
    }

    /// The reading without noise of such levels, at a moment of a drift.
    pub fn truth_v(&self, levels_v: &[f64], time_s: f64) -> f64 {
        let read_v = |&level_v: &f64| {
            let read_v = self.field.level_v(level_v, time_s);
            read_v.min(self.field.full_scale_v(f64::INFINITY))
        };
        levels_v.iter().map(read_v).sum::<f64>() / levels_v.len() as f64
    }

    pub fn session(&self, plan: &Plan) -> Session<'_> {
        let robot = Robot::of(&self.setup);
        let setup = ScanSetup {
            name: plan.name.clone(),
            recorded: "2026-11-25T12:00:00Z".parse().expect("a time"),
            unit: "V".to_owned(),
            array: self.setup.array.clone(),
            medium: self.setup.medium,
            receiver: None,
            phase: None,
            uncertainty: None,
            simulator: plan.simulator,
            foci: plan.foci.clone(),
        };
        let at_m = robot.home_m();
        let record = RecordedScan { setup, samples: Vec::new() };
        let (time_s, x_direction, travelled_mm, taken) = (0.0, 0.0, 0.0, 0);
        Session { rig: self, robot, at_m, time_s, x_direction, travelled_mm, taken, record }
    }
}

impl Session<'_> {
    pub fn take(&mut self, readings: &[Planned]) {
        readings.iter().for_each(|&(at_m, focus)| self.read(at_m, focus));
    }

    fn read(&mut self, to_m: Vec3, focus: Option<usize>) {
        let rig = self.rig;
        self.time_s += self.robot.move_s(self.at_m, to_m) + self.robot.reading_s();
        let way_m = to_m - self.at_m;
        if way_m.x != 0.0 {
            self.x_direction = way_m.x.signum();
        }
        self.travelled_mm += way_m.norm() * 1e3;
        self.at_m = to_m;
        let kinematics = Kinematics {
            position_mm: to_m * 1e3,
            x_direction: self.x_direction,
            x_since_reversal_mm: f64::INFINITY,
            travelled_mm: self.travelled_mm,
        };
        let place_m = rig.field.place(to_m, &kinematics);
        let steady = (!rig.field.scintillates())
            .then(|| focus.map_or(0.0, |focus| rig.level_v(place_m, focus, self.time_s)));
        let values: Vec<f64> = (0..SAMPLES)
            .map(|sample| {
                let time_s = self.time_s + SAMPLE_S * sample as f64;
                let level_v = steady.unwrap_or_else(|| {
                    focus.map_or(0.0, |focus| rig.level_v(place_m, focus, time_s))
                });
                let level_v = rig.field.level_v(level_v, time_s);
                let number = 3 * (self.taken * SAMPLES + sample);
                let normal = |part: u64| rig.noise.normal(number + part);
                let in_phase_v =
                    level_v * (1.0 + rig.multiplicative * normal(0)) + rig.additive_v * normal(1);
                let read_v = in_phase_v.hypot(rig.additive_v * normal(2));
                read_v.min(rig.field.full_scale_v(f64::INFINITY))
            })
            .collect();
        self.taken += 1;
        let mean = values.iter().sum::<f64>() / SAMPLES as f64;
        let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        let std = (squares / (SAMPLES - 1) as f64).sqrt();
        let spread = Some(Spread { std, count: SAMPLES as u32 });
        let sample = RecordedSample::measured(self.time_s, focus, to_m, mean, spread);
        self.record.samples.push(sample);
    }
}
