//! Effects that no set-up file has a key for.

/// A named effect that was not written, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unwritten {
    /// Its id.
    pub effect: &'static str,
    /// Why, and what to do instead.
    pub why: String,
}

impl std::fmt::Display for Unwritten {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.effect, self.why)
    }
}

impl Unwritten {
    pub(super) fn new(effect: &'static str, why: impl Into<String>) -> Self {
        Self { effect, why: why.into() }
    }
}

/// Why an effect changes nothing in a set-up.
pub(super) fn why(effect: &str) -> &'static str {
    match effect {
        "absorption" | "spreading" => {
            "how the level falls with the distance is part of a simulator, not of a set-up; try another --simulator"
        }
        "directivity" => {
            "the lobe of this simulator is a fixed fit; only `piston` has a radius of the face to correct"
        }
        "flow" | "temperature-gradient" | "turbulence" => {
            "the simulators know still air of one temperature only; keep draughts and heat away"
        }
        "axis-scale" => "correct the steps per millimetre in the robot's firmware",
        "skew" => "the set-up has square axes; square those of the robot",
        "backlash" => "take the play out of the robot, or scan with order = \"raster\"",
        "lag" => "make settle_ms of the receiver longer",
        "receiver-directivity" | "aperture" => {
            "the simulators give the pressure at a point; use a smaller receiver, or one that hears all angles alike"
        }
        "saturation" | "clipping" => "lower the receiver's amplification",
        "noise-floor" => {
            "the simulations are free of noise; shield the receiver, or drive the array harder"
        }
        "reflection" | "standing-wave" => {
            "the simulators know a free field only; line what reflects, or take it away"
        }
        "gain-drift" => {
            "simulations do not know the time; let the rig warm up, or add a [reference] to the plan"
        }
        _ => "neither a rig file nor a scan.toml has a key for it",
    }
}
