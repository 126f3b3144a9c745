//! The sound at the receiver: the radiation of every element's face through the real air.

use num_complex::Complex64;

use super::counter_rng::CounterRng;
use super::drive::Output;
use super::effects::{Effect, Path, TrueArray};
use super::radiator::{NEAREST_RADII, Radiator, Radiators};
use super::rigid_sphere::ScatteredWaves;
use super::trajectory::Kinematics;
use super::truth::TrueSource;
use fieldgap_acoustics::rayleigh::DiscRule;
use fieldgap_acoustics::{Array, Medium, Vec3};

/// Step in which the temperature of the air changes, K: a turn of 1 mrad over 0.2 m.
const AIR_STEP_K: f64 = 0.005;

/// Speed of sound in dry air at 0 °C, m/s, and that temperature, K.
const SPEED_AT_FREEZING_M_S: f64 = 331.3;
const FREEZING_K: f64 = 273.15;

/// The air at some time, as steps of its temperature from time zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct AirStep(i64);

/// A radiating face: an element's, or its image in a reflecting plane.
#[derive(Debug, Clone)]
struct Source {
    element: usize,
    centre_m: Vec3,
    radiator: Radiator,
    coefficient: Complex64,
}

/// What each element contributes to the pressure at one point, driven alone with unit amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Contributions {
    /// One for each element, 1/m.
    pressures: Vec<Complex64>,
    /// Distance from each element, m.
    distances_m: Vec<f64>,
}

impl Contributions {
    /// Adds the contributions at another point times a factor: an echo or a scattered wave.
    pub fn add(&mut self, other: &Self, factor: Complex64) {
        for (pressure, other) in self.pressures.iter_mut().zip(&other.pressures) {
            *pressure += factor * other;
        }
    }
}

/// The world's acoustics.
#[derive(Debug)]
pub struct TrueField {
    array: TrueArray,
    sources: Vec<Source>,
    /// Points of the receiver's face, relative to its centre, with weights that sum to 1.
    face: Vec<(Vec3, f64)>,
    /// What rigid spheres scatter of the sources' waves.
    scattered: Vec<ScatteredWaves>,
    /// Speed of sound at time zero.
    speed_m_s: f64,
    frequency_hz: f64,
    nominal_frequency_hz: f64,
    effects: Vec<Box<dyn Effect>>,
    rng: CounterRng,
}

impl TrueField {
    /// The field of the assumed array, changed by the effects. `rng` sets what they draw at random.
    pub fn new(
        believed: &Array,
        medium: Medium,
        frequency_hz: f64,
        source: &TrueSource,
        effects: Vec<(&'static str, Box<dyn Effect>)>,
        rng: CounterRng,
    ) -> Self {
        let mut array = TrueArray {
            elements: believed.elements().to_vec(),
            channels: (0..believed.len()).collect(),
            lobe_stretch: 1.0,
        };
        if let Some(radius_m) = source.face_radius_m {
            array.elements.iter_mut().for_each(|element| element.radius_m = radius_m);
        }
        let mut medium = medium;
        let mut true_frequency_hz = frequency_hz;
        for (id, effect) in &effects {
            effect.medium(&mut medium);
            effect.array(&mut array, rng.stream(id));
            true_frequency_hz = effect.frequency_hz(true_frequency_hz);
        }
        let effects: Vec<_> = effects.into_iter().map(|(_, effect)| effect).collect();
        let wavenumber_rad_m = medium.wavenumber_rad_m(true_frequency_hz);
        let sources = sources(&array, source, &effects, wavenumber_rad_m);
        let face = receiver_face(&effects, wavenumber_rad_m);
        let scattered = effects.iter().filter_map(|effect| effect.sphere()).map(|sphere| {
            let field = |source: &Source| source.radiator.field(sphere.centre_m, wavenumber_rad_m);
            let incident = sources.iter().map(|source| (source.centre_m, field(source)));
            ScatteredWaves::new(sphere, incident, wavenumber_rad_m)
        });
        let scattered = scattered.collect();
        Self {
            scattered,
            array,
            sources,
            face,
            speed_m_s: medium.speed_of_sound_m_s,
            frequency_hz: true_frequency_hz,
            nominal_frequency_hz: frequency_hz,
            effects,
            rng,
        }
    }

    /// The array as it truly is, with the random deviations of its elements.
    pub fn array(&self) -> &TrueArray {
        &self.array
    }

    /// The wavenumber of the true carrier in still air at the array's centre, rad/m.
    pub fn wavenumber_rad_m(&self) -> f64 {
        std::f64::consts::TAU * self.frequency_hz / self.speed_m_s
    }

    /// The carrier that is truly emitted, Hz.
    pub fn carrier_hz(&self) -> f64 {
        self.frequency_hz
    }

    /// The true position of the nozzle, array's frame, m, where the robot reports `reported_m`.
    pub fn place(&self, reported_m: Vec3, kinematics: &Kinematics) -> Vec3 {
        let mut at_m = reported_m;
        self.effects.iter().for_each(|effect| effect.place(&mut at_m, kinematics));
        let rng = self.rng.stream("place");
        at_m + self
            .effects
            .iter()
            .map(|effect| effect.displacement_m(kinematics, rng))
            .sum::<Vec3>()
    }

    /// How long before a reading its field was sampled, s.
    pub fn lag_s(&self) -> f64 {
        self.effects.iter().map(|effect| effect.lag_s()).sum()
    }

    /// The complex amplitude of each element for the channels' `outputs`.
    ///
    /// A delay τ turns the phase by +ωτ, as the time convention is exp(-iωt).
    pub fn weights(&self, outputs: &[Option<Output>]) -> Vec<Complex64> {
        let omega = std::f64::consts::TAU * self.frequency_hz;
        let mut weights: Vec<Complex64> = self
            .array
            .elements
            .iter()
            .zip(&self.array.channels)
            .map(|(element, &channel)| {
                let Some(Some(output)) = outputs.get(channel) else {
                    return Complex64::ZERO;
                };
                let delay_s = self.effects.iter().fold(output.delay_s, |delay_s, effect| {
                    effect.delay_s(delay_s, self.nominal_frequency_hz)
                });
                let amplitude = element.amplitude * output.amplitude;
                amplitude * Complex64::from_polar(1.0, element.phase_rad + omega * delay_s)
            })
            .collect();
        self.effects.iter().for_each(|effect| effect.emit(&mut weights, &self.array.elements));
        weights
    }

    /// The air at an instant: it changes in steps of a few millikelvins.
    pub fn air_at(&self, time_s: f64) -> AirStep {
        let warmer_k: f64 = self.effects.iter().map(|effect| effect.warmer_k(time_s)).sum();
        AirStep((warmer_k / AIR_STEP_K).round() as i64)
    }

    /// The speed of sound in still air at the array's centre, m/s.
    fn speed_in(&self, air: AirStep) -> f64 {
        let warmer_k = air.0 as f64 * AIR_STEP_K;
        let squared =
            self.speed_m_s.powi(2) + SPEED_AT_FREEZING_M_S.powi(2) * warmer_k / FREEZING_K;
        // No air is colder than a tenth of its sound speed.
        squared.max(0.01 * self.speed_m_s.powi(2)).sqrt()
    }

    /// The contribution of each element at a point, array's frame, m, in the air of time zero.
    pub fn contributions(&self, at_m: Vec3) -> Contributions {
        self.contributions_in(AirStep::default(), at_m)
    }

    /// The contribution of each element at a point, array's frame, m.
    ///
    /// The wave that a sphere scatters is that of time zero also while the air changes.
    pub fn contributions_in(&self, air: AirStep, at_m: Vec3) -> Contributions {
        let speed_m_s = self.speed_in(air);
        let wavenumber_rad_m = std::f64::consts::TAU * self.frequency_hz / speed_m_s;
        let mut pressures = vec![Complex64::ZERO; self.array.elements.len()];
        for &(offset_m, share) in &self.face {
            let point_m = at_m + offset_m;
            let resonance = self.effects.iter().fold(Complex64::ONE, |factor, effect| {
                factor * effect.resonance(point_m, wavenumber_rad_m)
            });
            for source in &self.sources {
                pressures[source.element] +=
                    share * resonance * self.pressure(source, point_m, speed_m_s);
            }
            for scattered in &self.scattered {
                for (source, wave) in self.sources.iter().zip(scattered.at(point_m)) {
                    pressures[source.element] += share * resonance * source.coefficient * wave;
                }
            }
        }
        let distances_m =
            self.array.elements.iter().map(|element| (at_m - element.centre_m).norm()).collect();
        Contributions { pressures, distances_m }
    }

    fn pressure(&self, source: &Source, at_m: Vec3, speed_m_s: f64) -> Complex64 {
        let straight = Path::straight(source.element, source.centre_m, at_m, speed_m_s);
        let mut path = straight;
        self.effects.iter().for_each(|effect| effect.path(&mut path));
        let omega = std::f64::consts::TAU * self.frequency_hz;
        let undisturbed = source.radiator.field(at_m, omega / speed_m_s);
        let disturbance = Complex64::from_polar(path.gain, omega * (path.time_s - straight.time_s));
        source.coefficient * disturbance * undisturbed
    }

    /// Whether the field at a fixed point fluctuates from sample to sample.
    pub fn scintillates(&self) -> bool {
        self.effects.iter().any(|effect| effect.scintillates())
    }

    /// The magnitude of the pressure at an instant, relative to an element's pressure at 1 m, 1/m.
    pub fn magnitude(
        &self,
        contributions: &Contributions,
        weights: &[Complex64],
        time_s: f64,
    ) -> f64 {
        self.phasor(contributions, weights, time_s).norm()
    }

    /// The complex amplitude of the pressure at an instant, relative to an element's pressure at 1 m, 1/m; the time convention is exp(-iωt).
    pub fn phasor(
        &self,
        contributions: &Contributions,
        weights: &[Complex64],
        time_s: f64,
    ) -> Complex64 {
        let terms =
            contributions.pressures.iter().zip(weights).map(|(pressure, weight)| pressure * weight);
        if !self.scintillates() {
            return terms.sum::<Complex64>();
        }
        terms
            .zip(&contributions.distances_m)
            .enumerate()
            .map(|(n, (term, &distance_m))| {
                let phase_rad: f64 = self
                    .effects
                    .iter()
                    .map(|effect| {
                        effect.scintillation_rad(n, distance_m, time_s, self.rng.stream("air"))
                    })
                    .sum();
                term * Complex64::from_polar(1.0, phase_rad)
            })
            .sum()
    }

    /// The level that reaches the converter, V, for a level at the microphone.
    pub fn level_v(&self, level_v: f64, time_s: f64) -> f64 {
        self.effects.iter().fold(level_v, |level_v, effect| effect.level_v(level_v, time_s))
    }

    /// The converter's true full scale, V.
    pub fn full_scale_v(&self, full_scale_v: f64) -> f64 {
        self.effects.iter().fold(full_scale_v, |v, effect| effect.full_scale_v(v))
    }
}

fn sources(
    array: &TrueArray,
    source: &TrueSource,
    effects: &[Box<dyn Effect>],
    wavenumber_rad_m: f64,
) -> Vec<Source> {
    let mut radiators = Radiators::new(source, wavenumber_rad_m);
    let mut sources = Vec::new();
    let mirrors: Vec<_> = effects.iter().filter_map(|effect| effect.mirror()).collect();
    for (n, element) in array.elements.iter().enumerate() {
        let images = mirrors
            .iter()
            .flat_map(|mirror| mirror.images(element).map(|image| (image, mirror.coefficient)));
        for (face, coefficient) in std::iter::once((*element, Complex64::ONE)).chain(images) {
            let radiator = radiators.of(face, array.lobe_stretch);
            sources.push(Source { element: n, centre_m: face.centre_m, radiator, coefficient });
        }
    }
    sources
}

fn receiver_face(effects: &[Box<dyn Effect>], wavenumber_rad_m: f64) -> Vec<(Vec3, f64)> {
    let radius_m = effects.iter().map(|effect| effect.face_radius_m()).fold(0.0, f64::max);
    if radius_m == 0.0 {
        return vec![(Vec3::zeros(), 1.0)];
    }
    // Receiving is radiating in reverse, so the same rule serves. Each patch costs a whole field: a percent will do.
    let rule = DiscRule::for_piston(wavenumber_rad_m * radius_m, NEAREST_RADII, 1e-2);
    let patch_m = |u: f64, v: f64| Vec3::new(u, v, 0.0) * radius_m;
    rule.patches().iter().map(|patch| (patch_m(patch.u, patch.v), patch.weight)).collect()
}

#[cfg(test)]
mod tests;
