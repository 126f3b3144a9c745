//! `[motion.marlin]`

use crate::motion::firmware_table::{FirmwareKeys, firmware_table};
use crate::motion::g_code::HomeLine;

firmware_table! {
    /// `[motion.marlin]`: where the firmware is reached and how it homes.
    ///
    /// Where something stands in the way of homing, home the axis that clears it first, for instance
    /// `home = ["G28 Z", "G28 X Y"]`.
    MarlinConfig homes by HomeLine {}
}
