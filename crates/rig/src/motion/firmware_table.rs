//! The keys that the tables of all G-code firmwares share, and the macro that adds a firmware's own to them.

use std::time::Duration;

use fieldgap_input::Time;

use super::limits::LONGEST_MOVE;
use crate::device::Role;
use crate::error::RigError;
use crate::link::{ByteLink, Wire, open_serial};

/// Where a firmware is reached and how it homes. `H` is a line that homes; its default homes all axes.
#[derive(Debug, Clone)]
pub struct FirmwareKeys<H> {
    /// The serial port; absent where a virtual rig gives it.
    pub port: Option<String>,
    /// Its speed, bits a second.
    pub baud: u32,
    /// The lines that home the robot, in order. The firmware chooses the path of homing, so no keep-out box is
    /// checked on it.
    pub home: Vec<H>,
    /// How long homing may take in all, s.
    pub home_within_s: Time,
}

impl<H: Default> Default for FirmwareKeys<H> {
    fn default() -> Self {
        Self {
            port: None,
            baud: 115_200,
            home: vec![H::default()],
            home_within_s: Time::new(180.0).expect("180 is above zero"),
        }
    }
}

impl<H> FirmwareKeys<H> {
    /// Opens the port: `chosen`, or else the one in the table.
    pub(super) fn open_port(
        &self,
        chosen: Option<&str>,
    ) -> Result<Wire<Box<dyn ByteLink>>, RigError> {
        open_serial(Role::Robot, chosen, self.port.as_deref(), self.baud)
    }

    /// How long homing may take in all.
    pub(super) fn home_within(&self) -> Duration {
        Duration::try_from_secs_f64(self.home_within_s.get()).unwrap_or(LONGEST_MOVE)
    }
}

/// Declares the table of one firmware: [`FirmwareKeys`], and keys of its own.
///
/// All keys are read by one struct. With `#[serde(flatten)]` an unknown key would be accepted, and faults would lose
/// their lines.
macro_rules! firmware_table {
    (
        $(#[$doc:meta])*
        $config:ident homes by $home:ty {
            $( $(#[$key_doc:meta])* $key:ident: $type:ty = $default:expr, )*
        }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone)]
        pub struct $config {
            /// The keys that all firmwares share.
            pub firmware: FirmwareKeys<$home>,
            $( $(#[$key_doc])* pub $key: $type, )*
        }

        impl Default for $config {
            fn default() -> Self {
                Self { firmware: Default::default(), $( $key: $default, )* }
            }
        }

        const _: () = {
            #[derive(serde::Deserialize)]
            #[serde(deny_unknown_fields, default)]
            struct Keys {
                port: Option<String>,
                baud: u32,
                home: Vec<$home>,
                home_within_s: fieldgap_input::Time,
                $( $key: $type, )*
            }

            impl Default for Keys {
                fn default() -> Self {
                    let $config { firmware, $( $key, )* } = $config::default();
                    let FirmwareKeys { port, baud, home, home_within_s } = firmware;
                    Self { port, baud, home, home_within_s, $( $key, )* }
                }
            }

            impl<'de> serde::Deserialize<'de> for $config {
                fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                    let Keys { port, baud, home, home_within_s, $( $key, )* } =
                        Keys::deserialize(deserializer)?;
                    let firmware = FirmwareKeys { port, baud, home, home_within_s };
                    Ok(Self { firmware, $( $key, )* })
                }
            }
        };
    };
}

pub(super) use firmware_table;
