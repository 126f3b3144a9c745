//! The catalogue of effects: one file each, with its physics, its source, its parameters and its words.
//!
//! Nothing here is shared with the virtual rig's effects, which act on paths of sound: the physics that makes a field and the physics
//! that explains it were written independently. A test holds the one against the other.

mod absorption;
mod aperture;
mod array_tilt;
mod axis_scale;
mod backlash;
mod bowed_array;
mod clipping;
pub(crate) mod crosstalk;
mod dead_elements;
mod defect;
mod directivity;
mod drive_frequency;
mod element_gain;
mod element_phase;
mod element_tilt;
mod flow;
mod gain_drift;
#[cfg(test)]
mod independent_physics;
mod lag;
pub(crate) mod lead_screw;
mod noise_floor;
mod of_elements;
mod offset;
mod on_axis_unit;
pub(crate) mod one_element;
mod phase_plane;
pub(crate) mod phase_quantisation;
mod pitch;
mod polarity;
mod position_jitter;
mod random;
mod receiver_directivity;
pub(crate) mod reflection;
mod rigid_ball;
mod rotation;
mod saturation;
pub(crate) mod scatterer;
mod skew;
mod sound_speed;
mod spreading;
mod standing_wave;
pub mod stated;
mod swapped_channels;
mod temperature_drift;
mod temperature_gradient;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod turbulence;
pub(crate) mod wall;

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::Effect;
use crate::remedy::Remedy;

/// The effect of an id. An id without an effect does not compile.
pub(crate) fn effect(id: EffectId) -> &'static dyn Effect {
    match id {
        EffectId::PhasePlane => &phase_plane::PHASE_PLANE,
        EffectId::OnAxisUnit => &on_axis_unit::ON_AXIS_UNIT,
        EffectId::SoundSpeed => &sound_speed::SoundSpeed,
        EffectId::Absorption => &absorption::Absorption,
        EffectId::Flow => &flow::Flow,
        EffectId::TemperatureGradient => &temperature_gradient::TemperatureGradient,
        EffectId::TemperatureDrift => &temperature_drift::TemperatureDrift,
        EffectId::Turbulence => &turbulence::Turbulence,
        EffectId::Spreading => &spreading::Spreading,
        EffectId::Directivity => &directivity::Directivity,
        EffectId::ElementGain => &element_gain::ELEMENT_GAIN,
        EffectId::ElementPhase => &element_phase::ELEMENT_PHASE,
        EffectId::ElementTilt => &element_tilt::ElementTilt,
        EffectId::DeadElements => &dead_elements::DEAD_ELEMENTS,
        EffectId::Polarity => &polarity::POLARITY,
        EffectId::SwappedChannels => &swapped_channels::SWAPPED_CHANNELS,
        EffectId::Crosstalk => &crosstalk::Crosstalk,
        EffectId::Pitch => &pitch::Pitch,
        EffectId::ArrayTilt => &array_tilt::ArrayTilt,
        EffectId::BowedArray => &bowed_array::BowedArray,
        EffectId::PhaseQuantisation => &phase_quantisation::PhaseQuantisation,
        EffectId::DriveFrequency => &drive_frequency::DriveFrequency,
        EffectId::Offset => &offset::Offset,
        EffectId::Rotation => &rotation::Rotation,
        EffectId::Skew => &skew::Skew,
        EffectId::AxisScale => &axis_scale::AxisScale,
        EffectId::LeadScrew => &lead_screw::LeadScrew,
        EffectId::Backlash => &backlash::Backlash,
        EffectId::Lag => &lag::Lag,
        EffectId::PositionJitter => &position_jitter::PositionJitter,
        EffectId::ReceiverDirectivity => &receiver_directivity::ReceiverDirectivity,
        EffectId::Aperture => &aperture::Aperture,
        EffectId::Saturation => &saturation::Saturation,
        EffectId::NoiseFloor => &noise_floor::NoiseFloor,
        EffectId::Clipping => &clipping::Clipping,
        EffectId::Reflection => &reflection::Reflection,
        EffectId::Wall => &wall::Wall,
        EffectId::Scatterer => &scatterer::Scatterer,
        EffectId::StandingWave => &standing_wave::StandingWave,
        EffectId::GainDrift => &gain_drift::GainDrift,
    }
}

/// Every effect, in the order of the catalogue.
pub(crate) fn catalogue() -> impl Iterator<Item = &'static dyn Effect> {
    EffectId::ALL.iter().copied().map(effect)
}

impl EffectId {
    /// What corrects this effect where fields are simulated by `simulator`.
    pub fn remedy(self, simulator: Simulator) -> Remedy {
        effect(self).remedy(simulator)
    }

    /// What shows this effect without a scan of the field, as a clause; `None` where nothing simple does.
    pub fn independent_check(self) -> Option<&'static str> {
        effect(self).facts().independent_check
    }

    /// Effects that a single scan mistakes for this one.
    pub fn mimics(self) -> &'static [Self] {
        effect(self).facts().mimics
    }
}
