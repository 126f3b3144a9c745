//! Scans of planes above square arrays, with noise.

use std::f64::consts::TAU;
use std::path::Path;

use fieldgap_acoustics::{Element, Excitation, Simulation, Vec3};
use fieldgap_diagnosis::{Diagnosis, EffectId, FittedParameter, Verdict};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Proportional noise of a reading, and each quadrature's over the largest reading.
pub const NOISE: (f64, f64) = (0.017, 0.003);

/// Places that are read again.
pub const REPEATS: usize = 150;

/// A scan of planes through the foci of a square array, drive by drive.
pub struct Scan {
    setup: ScanSetup,
    pub foci: usize,
    pub places_m: Vec<Vec3>,
}

impl Scan {
    pub fn new(side: usize, foci_mm: &[[f64; 3]], points_a_row: usize, heights_mm: &[f64]) -> Self {
        let foci: String = foci_mm
            .iter()
            .map(|[x, y, z]| format!("[[focus]]\nx_mm = {x:.1}\ny_mm = {y:.1}\nz_mm = {z:.1}\n"))
            .collect();
        let text = format!(
            "format = 1\nname = \"a\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
             [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = {side}\nrows = {side}\nelement_diameter_mm = 10.0\nspacing_mm = 0.5\n\
             [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n{foci}"
        );
        let setup =
            ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("a set-up");
        let step_mm = 70.0 / (points_a_row - 1) as f64;
        let at_mm = |n: usize| step_mm * n as f64 - 35.0;
        let mut places_m: Vec<Vec3> = heights_mm
            .iter()
            .flat_map(|z| (0..points_a_row * points_a_row).map(move |n| (n, *z)))
            .map(|(n, z)| Vec3::new(at_mm(n % points_a_row), at_mm(n / points_a_row), z) * 1e-3)
            .collect();
        let again: Vec<Vec3> =
            (0..REPEATS).map(|n| places_m[n * places_m.len() / REPEATS]).collect();
        places_m.extend(again);
        Self { setup, foci: foci_mm.len(), places_m }
    }

    /// The scan of a sum over the elements of a wave at each reading, given the phase that an element is driven with.
    pub fn read_waves(
        &self,
        seed: u64,
        mut wave: impl FnMut(&Element, f64, &Vec3) -> Complex64,
    ) -> RecordedScan {
        let mut field = |focus: usize| -> Vec<f64> {
            let believed = self.believed(focus);
            let phases_rad = phases_rad(&believed);
            let mut level = |at: &Vec3| {
                let elements = believed.array.elements().iter().zip(&phases_rad);
                let waves = elements.map(|(element, phase_rad)| wave(element, *phase_rad, at));
                1e-3 * waves.sum::<Complex64>().norm()
            };
            self.places_m.iter().map(&mut level).collect()
        };
        self.record((0..self.foci).map(&mut field).collect(), seed)
    }

    pub fn believed(&self, focus: usize) -> Simulation {
        self.setup.simulation(self.setup.simulator, focus).expect("a focus")
    }

    /// The readings of these fields, drive by drive, with noise.
    pub fn record(&self, fields: Vec<Vec<f64>>, seed: u64) -> RecordedScan {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let largest = fields.iter().flatten().fold(0.0f64, |most, level| most.max(*level));
        let mut read = |level: f64| {
            let (re, im) = (level + NOISE.1 * largest * normal(), NOISE.1 * largest * normal());
            (re.hypot(im) * (1.0 + NOISE.0 * normal())).max(0.0)
        };
        let mut samples = Vec::new();
        let mut add = |focus: Option<usize>, at_m: Vec3, reading: f64| {
            let time_s = 0.1 * samples.len() as f64;
            samples.push(RecordedSample::measured(time_s, focus, at_m, reading, None));
        };
        for _ in 0..40 {
            add(None, Vec3::z() * 0.1, read(0.0));
        }
        for (n, place_m) in self.places_m.iter().enumerate() {
            for (focus, field) in fields.iter().enumerate() {
                add(Some(focus), *place_m, read(field[n]));
            }
        }
        RecordedScan { setup: self.setup.clone(), samples }
    }
}

pub const WAVENUMBER_RAD_M: f64 = TAU * 40e3 / 343.0;

/// Phases with which the waves of all elements arrive together at the focus.
pub fn phases_rad(believed: &Simulation) -> Vec<f64> {
    let Excitation::Focus(at_m) = &believed.excitation else { panic!("a focus") };
    let elements = believed.array.elements().iter();
    elements.map(|element| -WAVENUMBER_RAD_M * (at_m - element.centre_m).norm()).collect()
}

pub fn named_alone(diagnosis: &Diagnosis, id: EffectId) {
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{}", diagnosis.to_text());
    assert_eq!(diagnosis.effects, [id], "{}", diagnosis.to_text());
}

pub fn real(diagnosis: &Diagnosis, name: &str) -> f64 {
    match diagnosis.ranked[0].parameters.get(name) {
        Some(FittedParameter::Real { value, .. }) => *value,
        other => panic!("{name}: {other:?}"),
    }
}
