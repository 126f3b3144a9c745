//! The physical causes that can make the true field differ from the simulated one.
//!
//! Each effect is one file, its `mod`, and **one line in the registry below**. It acts where the physical cause acts: on the
//! air, the array, a sound path, the nozzle's position or the receiver. The simulator's own defects (`phase-plane`,
//! `on-axis-unit`) are not here: a real set-up cannot have them.

mod absorption;
mod aperture;
mod array_tilt;
mod axis_scale;
mod backlash;
mod bowed_array;
mod clipping;
mod crosstalk;
mod dead_elements;
mod directivity;
mod drive_frequency;
mod element_gain;
mod element_phase;
mod element_tilt;
mod flow;
mod gain_drift;
mod gain_jump;
mod hot_plume;
mod lag;
mod lead_screw;
mod noise_floor;
mod offset;
mod phase_quantisation;
mod pitch;
mod polarity;
mod position_jitter;
mod receiver_directivity;
mod reflection;
mod rotation;
mod row_sag;
mod saturation;
mod scatterer;
mod screen;
mod skew;
mod sound_speed;
mod spreading;
mod standing_wave;
mod swapped_channels;
mod temperature_drift;
mod temperature_gradient;
mod tilted_receiver;
mod turbulence;
mod wall;
mod warm_up;

pub(crate) use position_jitter::CELL_MM as JITTER_CELL_MM;

use num_complex::Complex64;
use serde::Deserialize;

use super::counter_rng::CounterRng;
use super::rigid_sphere::RigidSphere;
use super::trajectory::Kinematics;
use fieldgap_acoustics::{Element, Medium, Vec3};

/// The array as it physically is.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueArray {
    /// The elements; a negative amplitude is a reversed polarity.
    pub elements: Vec<Element>,
    /// The controller's output that each element is wired to.
    pub channels: Vec<usize>,
    /// Ratio of every element's lobe width to that of its transducer type.
    pub lobe_stretch: f64,
}

/// The sound path from one element to one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// The element's number.
    pub element: usize,
    /// Where it starts, metres.
    pub from_m: Vec3,
    /// Where it ends.
    pub to_m: Vec3,
    /// Speed of sound in still air at the array's centre.
    pub speed_m_s: f64,
    /// Travel time.
    pub time_s: f64,
    /// Amplitude relative to that of the undisturbed path.
    pub gain: f64,
}

impl Path {
    /// The path through still, uniform air without loss.
    pub fn straight(element: usize, from_m: Vec3, to_m: Vec3, speed_m_s: f64) -> Self {
        let time_s = (to_m - from_m).norm() / speed_m_s;
        Self { element, from_m, to_m, speed_m_s, time_s, gain: 1.0 }
    }

    /// Its length.
    pub fn distance_m(&self) -> f64 {
        (self.to_m - self.from_m).norm()
    }

    /// Its direction, of unit length; along z if it has no length.
    pub fn direction(&self) -> Vec3 {
        (self.to_m - self.from_m).try_normalize(0.0).unwrap_or_else(Vec3::z)
    }
}

/// An axis of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Axis {
    X,
    Y,
    Z,
}

/// A plane that reflects sound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mirror {
    /// Its normal, of unit length.
    pub normal: Vec3,
    /// Its distance from the array's centre along the normal, m.
    pub distance_m: f64,
    /// Reflected over incident pressure.
    pub coefficient: Complex64,
    /// Whether the array's plane reflects the reflected wave once more, as a rigid baffle.
    pub baffle: bool,
}

impl Mirror {
    /// The images of an element: one, and with a baffle a second one behind it.
    pub fn images(&self, element: &Element) -> impl Iterator<Item = Element> + use<> {
        let image = reflected(element, self.normal, self.distance_m);
        let behind = self.baffle.then(|| reflected(&image, Vec3::z(), 0.0));
        std::iter::once(image).chain(behind)
    }
}

fn reflected(element: &Element, normal: Vec3, distance_m: f64) -> Element {
    let mut image = *element;
    image.centre_m += 2.0 * (distance_m - element.centre_m.dot(&normal)) * normal;
    image.normal -= 2.0 * element.normal.dot(&normal) * normal;
    image
}

/// One cause. Each method is a place where it can act; by default it does nothing there.
///
/// Where several effects act at one place they do so in the order of the registry.
pub trait Effect: std::fmt::Debug + Send + Sync {
    /// Checks that it fits an array of so many elements; the error says why not.
    fn check(&self, _elements: usize) -> Result<(), String> {
        Ok(())
    }

    /// Changes the air.
    fn medium(&self, _medium: &mut Medium) {}

    /// Changes the array: positions, faces, amplitudes, wiring.
    fn array(&self, _array: &mut TrueArray, _rng: CounterRng) {}

    /// Changes the elements' complex amplitudes as they are driven.
    fn emit(&self, _weights: &mut [Complex64], _elements: &[Element]) {}

    /// How much warmer the air is than at time zero, K.
    fn warmer_k(&self, _time_s: f64) -> f64 {
        0.0
    }

    /// A rigid sphere that it puts into the field.
    fn sphere(&self) -> Option<RigidSphere> {
        None
    }

    /// A reflecting plane that it puts beside or above the field.
    fn mirror(&self) -> Option<Mirror> {
        None
    }

    /// The carrier that is truly emitted.
    fn frequency_hz(&self, frequency_hz: f64) -> f64 {
        frequency_hz
    }

    /// The delay that an output truly has.
    fn delay_s(&self, delay_s: f64, _frequency_hz: f64) -> f64 {
        delay_s
    }

    /// Changes time and amplitude on a path.
    fn path(&self, _path: &mut Path) {}

    /// Whether [`Effect::scintillation_rad`] is ever other than zero.
    fn scintillates(&self) -> bool {
        false
    }

    /// A phase on the path from an element that fluctuates in time, rad.
    fn scintillation_rad(
        &self,
        _element: usize,
        _distance_m: f64,
        _time_s: f64,
        _rng: CounterRng,
    ) -> f64 {
        0.0
    }

    /// Moves the nozzle from the position that the robot reports (array's frame, metres).
    fn place(&self, _at_m: &mut Vec3, _kinematics: &Kinematics) {}

    /// A random displacement of the nozzle (array's frame, metres), added after [`Effect::place`] of all effects.
    fn displacement_m(&self, _kinematics: &Kinematics, _rng: CounterRng) -> Vec3 {
        Vec3::zeros()
    }

    /// How long before the reading the received field was sampled, s.
    fn lag_s(&self) -> f64 {
        0.0
    }

    /// Radius of the receiver's face; 0 is a point.
    fn face_radius_m(&self) -> f64 {
        0.0
    }

    /// A factor on the whole field at a point.
    fn resonance(&self, _at_m: Vec3, _wavenumber_rad_m: f64) -> Complex64 {
        Complex64::ONE
    }

    /// The level that reaches the converter, V.
    fn level_v(&self, level_v: f64, _time_s: f64) -> f64 {
        level_v
    }

    /// The converter's full scale, V.
    fn full_scale_v(&self, full_scale_v: f64) -> f64 {
        full_scale_v
    }
}

/// Declares the table `[effects]` of a truth file: each key an effect's parameters.
macro_rules! registry {
    ($($id:literal => $module:ident::$effect:ident,)*) => {
        /// The table `[effects]` as it is written.
        #[derive(Debug, Default, Deserialize)]
        #[serde(deny_unknown_fields)]
        #[allow(non_snake_case)]
        pub(super) struct EffectTables {
            $(#[serde(rename = $id)] $effect: Option<$module::$effect>,)*
            #[serde(rename = "phase-plane")]
            #[allow(dead_code)]
            phase_plane: Option<DefectOfSimulator>,
            #[serde(rename = "on-axis-unit")]
            #[allow(dead_code)]
            on_axis_unit: Option<DefectOfSimulator>,
        }

        impl EffectTables {
            /// The effects present, with their ids, in the order of the registry.
            pub fn into_effects(self) -> Vec<(&'static str, Box<dyn Effect>)> {
                let mut effects: Vec<(&'static str, Box<dyn Effect>)> = Vec::new();
                $(if let Some(effect) = self.$effect { effects.push(($id, Box::new(effect))); })*
                effects
            }
        }
    };
}

registry! {
    // medium
    "sound-speed" => sound_speed::SoundSpeed,
    "absorption" => absorption::Absorption,
    "flow" => flow::Flow,
    "temperature-gradient" => temperature_gradient::TemperatureGradient,
    "turbulence" => turbulence::Turbulence,
    "temperature-drift" => temperature_drift::TemperatureDrift,
    // source
    "spreading" => spreading::Spreading,
    "directivity" => directivity::Directivity,
    "element-gain" => element_gain::ElementGain,
    "element-phase" => element_phase::ElementPhase,
    "element-tilt" => element_tilt::ElementTilt,
    "dead-elements" => dead_elements::DeadElements,
    "polarity" => polarity::Polarity,
    "swapped-channels" => swapped_channels::SwappedChannels,
    "pitch" => pitch::Pitch,
    "bowed-array" => bowed_array::BowedArray,
    "array-tilt" => array_tilt::ArrayTilt,
    "crosstalk" => crosstalk::Crosstalk,
    "phase-quantisation" => phase_quantisation::PhaseQuantisation,
    "drive-frequency" => drive_frequency::DriveFrequency,
    // geometry
    "lead-screw" => lead_screw::LeadScrew,
    "backlash" => backlash::Backlash,
    "axis-scale" => axis_scale::AxisScale,
    "skew" => skew::Skew,
    "rotation" => rotation::Rotation,
    "offset" => offset::Offset,
    "lag" => lag::Lag,
    "position-jitter" => position_jitter::PositionJitter,
    // receiver and environment
    "receiver-directivity" => receiver_directivity::ReceiverDirectivity,
    "aperture" => aperture::Aperture,
    "reflection" => reflection::Reflection,
    "wall" => wall::Wall,
    "scatterer" => scatterer::Scatterer,
    "standing-wave" => standing_wave::StandingWave,
    "warm-up" => warm_up::WarmUp,
    "gain-drift" => gain_drift::GainDrift,
    "saturation" => saturation::Saturation,
    "noise-floor" => noise_floor::NoiseFloor,
    "clipping" => clipping::Clipping,
    // not in the catalogue of a diagnosis
    "gain-jump" => gain_jump::GainJump,
    "hot-plume" => hot_plume::HotPlume,
    "row-sag" => row_sag::RowSag,
    "screen" => screen::Screen,
    "tilted-receiver" => tilted_receiver::TiltedReceiver,
}

/// Accepts nothing: its name is a defect of a simulator, which a real set-up cannot have.
#[derive(Debug)]
pub(super) struct DefectOfSimulator;

impl<'de> Deserialize<'de> for DefectOfSimulator {
    fn deserialize<D: serde::Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
        Err(serde::de::Error::custom(
            "this is a defect of the simulator, which no world can have; choose the simulator in the plan",
        ))
    }
}

/// Whether all these elements exist.
fn all_exist(wanted: &[usize], elements: usize) -> Result<(), String> {
    match wanted.iter().find(|&&n| n >= elements) {
        Some(n) => Err(format!("there is no element {n}; the array has 0 to {}", elements - 1)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod testing {
    use super::*;

    /// The effect with these parameters.
    pub fn effect<E: serde::de::DeserializeOwned>(parameters: &str) -> E {
        toml::from_str(parameters).expect("the parameters are those of the effect")
    }

    impl TrueArray {
        pub(crate) fn of_two() -> Self {
            Self {
                elements: vec![Element::at(-0.01, 0.0), Element::at(0.01, 0.0)],
                channels: vec![0, 1],
                lobe_stretch: 1.0,
            }
        }

        pub(crate) fn of_many(count: usize) -> Self {
            Self {
                elements: vec![Element::at(0.0, 0.0); count],
                channels: (0..count).collect(),
                lobe_stretch: 1.0,
            }
        }
    }

    impl Kinematics {
        pub(crate) fn resting() -> Self {
            Self {
                position_mm: Vec3::zeros(),
                x_direction: 0.0,
                x_since_reversal_mm: 0.0,
                travelled_mm: 0.0,
            }
        }
    }
}
