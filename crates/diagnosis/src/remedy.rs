//! What corrects an effect.

/// What corrects an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    /// A rig file and a recorded scan's `scan.toml` have a key for it.
    Key(SetupKey),
    /// No set-up file has a key for it: why, and what to do instead.
    Manual(&'static str),
}

/// What of a set-up an effect corrects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetupKey {
    /// The model of the simulator: its defects mended.
    SimulatorModel,
    /// The speed of sound.
    SpeedOfSound,
    /// The frequency of the drive.
    Frequency,
    /// The distances between the elements.
    Pitch,
    /// The elements that are silent.
    SilentElements,
    /// The elements that are reversed.
    ReversedElements,
    /// Two elements that are exchanged.
    SwappedElements,
    /// The amplitude of each element.
    Amplitudes,
    /// The phase of each element.
    Phases,
    /// The directions of the elements' axes, and their places.
    Tilt,
    /// The radius of the elements' faces.
    FaceRadius,
    /// The robot's origin.
    Origin,
    /// The turn of the robot's axes.
    Turn,
    /// The steps in which the driver rounds delays.
    PhaseSteps,
}
