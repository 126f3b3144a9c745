//! The names of the effects.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Declares the effects with the ids by which files and the command line know them.
macro_rules! effect_ids {
    ($($(#[$doc:meta])* $variant:ident = $id:literal,)*) => {
        /// An effect of the catalogue: a physical cause that a simulator may leave out.
        ///
        /// It is written as its id, such as `sound-speed`, in JSON and on the command line. The order is that of the catalogue: from the
        /// simulator over air, array and robot to the receiver and its surroundings. A position passes the effects of the robot backwards,
        /// from what its motors were told to the array's frame: steps per millimetre along each rail before the angle between the rails.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum EffectId {
            $($(#[$doc])* $variant,)*
        }

        impl EffectId {
            /// Every effect, in the order of the catalogue.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// The id that files and the command line use.
            pub const fn as_str(self) -> &'static str {
                match self {
                    $(Self::$variant => $id,)*
                }
            }
        }
    };
}

effect_ids! {
    /// The simulator takes path lengths at the focal height, not where the field is observed.
    PhasePlane = "phase-plane",
    /// The on-axis decay was fitted in centimetres and is fed metres.
    OnAxisUnit = "on-axis-unit",
    /// The speed of sound differs from the believed one.
    SoundSpeed = "sound-speed",
    /// Each path is attenuated beyond the model.
    Absorption = "absorption",
    /// A steady wind crosses the field.
    Flow = "flow",
    /// The speed of sound varies linearly through the field.
    TemperatureGradient = "temperature-gradient",
    /// The air warms or cools during the scan.
    TemperatureDrift = "temperature-drift",
    /// The phase of each path fluctuates at random.
    Turbulence = "turbulence",
    /// The level falls with distance by another law.
    Spreading = "spreading",
    /// The elements' lobes are wider or narrower than modelled.
    Directivity = "directivity",
    /// Amplitudes differ from element to element.
    ElementGain = "element-gain",
    /// Phases differ from element to element.
    ElementPhase = "element-phase",
    /// The axes of the elements point elsewhere than believed, each by itself.
    ElementTilt = "element-tilt",
    /// One to three elements, or up to a twelfth of a large array, are silent.
    DeadElements = "dead-elements",
    /// One to three elements, or up to a twelfth of a large array, are wired in reverse.
    Polarity = "polarity",
    /// Two elements are exchanged.
    SwappedChannels = "swapped-channels",
    /// The drive of an element reaches its neighbours.
    Crosstalk = "crosstalk",
    /// The array is larger or smaller than modelled.
    Pitch = "pitch",
    /// The array is tilted against the axes of the scan.
    ArrayTilt = "array-tilt",
    /// The array's board is bowed.
    BowedArray = "bowed-array",
    /// The driver rounds delays to steps of a period.
    PhaseQuantisation = "phase-quantisation",
    /// The drive is off its nominal frequency.
    DriveFrequency = "drive-frequency",
    /// The robot's origin is not the array's.
    Offset = "offset",
    /// The robot's axes are turned about z.
    Rotation = "rotation",
    /// The robot's x and y axes are not square.
    Skew = "skew",
    /// The robot's steps per millimetre are wrong.
    AxisScale = "axis-scale",
    /// The position along an axis errs periodically, once a turn of its screw.
    LeadScrew = "lead-screw",
    /// The robot has play along x.
    Backlash = "backlash",
    /// The reading trails the motion.
    Lag = "lag",
    /// The robot's position scatters from reading to reading.
    PositionJitter = "position-jitter",
    /// The receiver's sensitivity falls with the angle of arrival.
    ReceiverDirectivity = "receiver-directivity",
    /// The receiver averages over its face.
    Aperture = "aperture",
    /// The receiver compresses high levels.
    Saturation = "saturation",
    /// The detector adds a floor in power.
    NoiseFloor = "noise-floor",
    /// The converter's full scale cuts the peaks.
    Clipping = "clipping",
    /// A plane above the field returns an image of the array.
    Reflection = "reflection",
    /// A plane anywhere beside the field returns an image of the array.
    Wall = "wall",
    /// A ball in the field scatters.
    Scatterer = "scatterer",
    /// Sound bounces between receiver and array.
    StandingWave = "standing-wave",
    /// The level drifts through the scan.
    GainDrift = "gain-drift",
}

impl fmt::Display for EffectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl FromStr for EffectId {
    type Err = UnknownEffect;

    fn from_str(id: &str) -> Result<Self, UnknownEffect> {
        let known = Self::ALL.iter().find(|effect| effect.as_str() == id);
        known.copied().ok_or_else(|| UnknownEffect(id.to_owned()))
    }
}

impl Serialize for EffectId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for EffectId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Text that is the id of no effect.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no effect of the catalogue")]
pub struct UnknownEffect(pub String);

/// The ids of several effects, joined for a sentence or a heading: `lag + pitch`.
pub fn joined(effects: &[EffectId], separator: &str) -> String {
    let ids: Vec<&str> = effects.iter().map(|effect| effect.as_str()).collect();
    ids.join(separator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_id_reads_back_and_no_other_text_does() {
        for effect in EffectId::ALL {
            assert_eq!(effect.as_str().parse(), Ok(*effect));
        }
        let error = "backslash".parse::<EffectId>().expect_err("it is no id");
        assert_eq!(error.to_string(), "`backslash` is no effect of the catalogue");
    }
}
