//! `[focus_array.thesis]`

use serde::Deserialize;

/// `[focus_array.thesis]`: where the controller is reached.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThesisConfig {
    /// The serial port; absent where a virtual rig gives it.
    pub port: Option<String>,
    /// Its speed, bits a second.
    #[serde(default = "default_baud")]
    pub baud: u32,
}

fn default_baud() -> u32 {
    115_200
}
