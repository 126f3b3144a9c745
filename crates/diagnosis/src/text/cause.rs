//! Each effect as a cause in a few words, for headlines.

use crate::effect_id::EffectId;

impl EffectId {
    /// The effect as a cause, at most six words: `wrong speed of sound`.
    pub const fn as_cause(self) -> &'static str {
        match self {
            Self::PhasePlane => "phases frozen at the focal height",
            Self::OnAxisUnit => "metres in place of centimetres",
            Self::SoundSpeed => "another speed of sound",
            Self::Absorption => "absorption of the air",
            Self::Flow => "a wind across the field",
            Self::TemperatureGradient => "a temperature gradient",
            Self::TemperatureDrift => "air that warms or cools",
            Self::Turbulence => "turbulent air",
            Self::Spreading => "another decay with distance",
            Self::Directivity => "another width of the elements' lobes",
            Self::ElementGain => "unequal amplitudes of the elements",
            Self::ElementPhase => "unequal phases of the elements",
            Self::ElementTilt => "elements that point elsewhere",
            Self::DeadElements => "silent elements",
            Self::Polarity => "reversed elements",
            Self::SwappedChannels => "two exchanged elements",
            Self::Crosstalk => "crosstalk between the elements",
            Self::Pitch => "another pitch of the array",
            Self::ArrayTilt => "a tilted array",
            Self::BowedArray => "a bowed array",
            Self::PhaseQuantisation => "phases driven in coarse steps",
            Self::DriveFrequency => "another frequency of the drive",
            Self::Offset => "an offset of the robot's origin",
            Self::Rotation => "rotated axes of the robot",
            Self::Skew => "skewed axes of the robot",
            Self::AxisScale => "wrong steps per millimetre",
            Self::LeadScrew => "a screw out of true",
            Self::Backlash => "backlash of the robot",
            Self::Lag => "readings that lag the motion",
            Self::PositionJitter => "scatter of the robot's position",
            Self::ReceiverDirectivity => "directivity of the receiver",
            Self::Aperture => "the size of the receiver's face",
            Self::Saturation => "saturation of the receiver",
            Self::NoiseFloor => "a floor of the detector",
            Self::Clipping => "clipping of the receiver",
            Self::Reflection => "a reflection above the field",
            Self::Wall => "a reflecting wall",
            Self::Scatterer => "an object in the field",
            Self::StandingWave => "a standing wave at the receiver",
            Self::GainDrift => "a drift of the gain",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_is_short_and_its_own() {
        let causes: Vec<&str> = EffectId::ALL.iter().map(|effect| effect.as_cause()).collect();
        for (n, cause) in causes.iter().enumerate() {
            assert!((2..=6).contains(&cause.split(' ').count()), "{cause}");
            assert!(!causes[..n].contains(cause), "{cause} stands twice");
        }
    }
}
