//! `[motion.klipper]`

use crate::motion::firmware_table::{FirmwareKeys, firmware_table};
use crate::motion::g_code::HomeLine;

firmware_table! {
    /// `[motion.klipper]`: where the host software is reached (`port = "/tmp/printer"`) and how the robot homes.
    ///
    /// Where something stands in the way of homing, home the axis that clears it first, for instance
    /// `home = ["G28 Z", "G28 X Y"]`.
    KlipperConfig homes by HomeLine {}
}
