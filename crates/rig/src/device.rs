//! Which device of the rig, and at which port.

use std::fmt;

/// What a device does in the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Carries the receiver through the field.
    Robot,
    /// Measures the field.
    Receiver,
    /// Emits the field.
    FocusArray,
    /// Feels the air.
    Environment,
}

impl Role {
    /// All that a rig may have.
    pub const ALL: [Self; 4] = [Self::Robot, Self::Receiver, Self::FocusArray, Self::Environment];
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Robot => "robot",
            Self::Receiver => "receiver",
            Self::FocusArray => "focus array",
            Self::Environment => "environment sensor",
        })
    }
}

/// One device at one port, as messages name it: `robot on /dev/ttyUSB0`.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Device {
    /// What it does.
    pub role: Role,
    /// Where it is reached; empty as long as no port is known.
    pub port: String,
}

impl Device {
    /// A device at a port.
    pub fn new(role: Role, port: impl Into<String>) -> Self {
        Self { role, port: port.into() }
    }
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.port.is_empty() {
            write!(f, "{}", self.role)
        } else {
            write!(f, "{} on {}", self.role, self.port)
        }
    }
}
