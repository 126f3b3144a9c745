//! What can go wrong between the program and a device.

mod program_fault;
mod record_fault;
mod wiring_fault;

use std::fmt;
use std::time::Duration;

use super::device::Device;
use super::space::RobotPosition;
use super::travel::PathFault;
pub use program_fault::ProgramFault;
pub use record_fault::RecordFault;
pub(crate) use record_fault::{FEWEST_CYCLES, FEWEST_SAMPLES_A_CYCLE};
pub use wiring_fault::WiringFault;

/// A fault of a device: which device, at which port, what was tried, what was seen, and what to do.
///
/// `Display` is one line without the remedy; as a [`miette::Diagnostic`] the remedy is its help.
#[derive(Debug)]
pub struct RigError(Box<Inner>);

#[derive(Debug)]
struct Inner {
    device: Device,
    attempt: String,
    cause: Cause,
    last_received: Option<String>,
}

/// What was seen.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Cause {
    /// Neither the rig file nor a virtual rig gives a port.
    #[error("the rig file names no port for this device")]
    NoPort,
    /// The port does not exist.
    #[error("the port does not exist; ports on this machine: {}", listed(available))]
    PortMissing {
        /// The ports that do exist.
        available: Vec<String>,
    },
    /// Another program uses the port.
    #[error("another program is using the port")]
    PortBusy,
    /// The port exists and cannot be used.
    #[error("the port cannot be opened: {0}")]
    PortUnusable(#[source] serialport::Error),
    /// The port closed: unplugged, or switched off.
    #[error("the port was disconnected")]
    Disconnected,
    /// The operating system refused to read or write.
    #[error("reading or writing failed: {0}")]
    Io(#[source] std::io::Error),
    /// Nothing listens at a network address.
    #[error("nothing accepts connections at this address")]
    NoListener,
    /// No valid answer came in time.
    #[error("no answer within {:.1} s", waited.as_secs_f64())]
    Silent {
        /// How long the driver waited in all.
        waited: Duration,
    },
    /// Bytes that are not the device's protocol.
    #[error("the data received do not follow the expected protocol: {seen}")]
    Unreadable {
        /// The bytes, made printable and cut short.
        seen: String,
    },
    /// The device understood the command and refused it.
    #[error("the device refused the command: {reply}")]
    Refused {
        /// The device's reply.
        reply: String,
    },
    /// The device restarted without being told to.
    #[error("the device restarted and lost its settings")]
    Reset,
    /// The firmware stopped for good.
    #[error("the firmware has halted: {reply}")]
    Halted {
        /// The firmware's reply.
        reply: String,
    },
    /// The host software has shut the firmware down.
    #[error("Klipper has shut down: {reply}")]
    Shutdown {
        /// Its reason.
        reply: String,
    },
    /// Another firmware answers than the rig file names.
    #[error("the rig file names {named}, but another firmware answered: `{received}`")]
    OtherFirmware {
        /// The firmware that the driver is for.
        named: &'static str,
        /// The line that identifies the other firmware.
        received: String,
    },
    /// The firmware has locked itself.
    #[error("the firmware is locked ({reply}): {meaning}")]
    Alarm {
        /// The firmware's reply.
        reply: String,
        /// What they mean.
        meaning: &'static str,
    },
    /// Motion waits for somebody at the machine.
    #[error("the firmware is in the state `{state}`, which has to be ended at the machine")]
    Paused {
        /// The firmware's name of the state.
        state: String,
    },
    /// A move does not come to its end.
    #[error("the robot is still moving, long after it should have arrived")]
    StillMoving,
    /// A setting that the firmware keeps makes scans impossible.
    #[error("firmware setting {name}: {problem}")]
    Setting {
        /// The setting.
        name: String,
        /// What it does.
        problem: String,
    },
    /// An axis ran into its end switch.
    #[error("an axis hit its end switch: {reply}")]
    EndstopHit {
        /// The firmware's reply.
        reply: String,
    },
    /// The device asks for a line that cannot be sent again.
    #[error("the firmware asks for line {wanted} again, which was never sent or is no longer kept")]
    LineNotKept {
        /// The line asked for.
        wanted: u32,
    },
    /// A command was repeated, and each time it or its answer was damaged.
    #[error(
        "the command was sent {times} times, and each time the command or its answer was damaged"
    )]
    RepeatedlyDamaged {
        /// How many times.
        times: u32,
    },
    /// A command longer than the device takes.
    #[error("the command is {length} characters long, and the device accepts at most {most}")]
    LineTooLong {
        /// Its length.
        length: usize,
        /// The longest that is taken whole.
        most: usize,
    },
    /// A move without a known position.
    #[error(
        "the position is unknown: the robot has not been homed since its last reset, stop or failed move"
    )]
    NotHomed,
    /// A move that the rig file forbids.
    #[error("the move is not allowed: {0}")]
    Forbidden(#[source] PathFault),
    /// The robot reports another position than commanded.
    #[error("the robot was sent to {commanded} and reports {reported}: {:.3} mm off, where {:.3} mm is allowed",
        commanded.largest_axis_difference_m(*reported) * 1e3, tolerance_m * 1e3)]
    WrongPosition {
        /// Where it was sent.
        commanded: RobotPosition,
        /// The position that it reports.
        reported: RobotPosition,
        /// The largest difference allowed along any axis, m.
        tolerance_m: f64,
    },
    /// Delays for another number of elements than the array has.
    #[error("the array has {has} elements, and delays for {given} were given")]
    ElementCount {
        /// Elements of the array.
        has: usize,
        /// Delays given.
        given: usize,
    },
    /// A delay that is not a time.
    #[error(
        "the delay of element {element} is {delay_s} s; it must be a finite time of zero or more"
    )]
    BadDelay {
        /// The element, from 0.
        element: usize,
        /// Its delay, s.
        delay_s: f64,
    },
    /// A display that the controller cannot play.
    #[error("the controller cannot play the display: {0}")]
    Display(#[source] ProgramFault),
    /// A receiver that reads points only.
    #[error("this receiver cannot record while the robot moves")]
    NoRecording,
    /// A controller without memory for displays.
    #[error("this controller cannot play displays")]
    NoDisplays,
    /// A controller whose elements only sound.
    #[error("this controller cannot receive with its elements")]
    NoSensors,
    /// More listeners than the controller has converters for.
    #[error(
        "the controller can receive with at most {most} elements at a time, and {asked} were requested"
    )]
    TooManySensors {
        /// Elements at a time.
        most: usize,
        /// Elements asked for.
        asked: usize,
    },
    /// A modulation that the controller does not make.
    #[error(
        "a modulation of {asked_hz} Hz with a duty of {asked_percent} % is not available: {offers}"
    )]
    NoModulation {
        /// Frequency asked for, Hz.
        asked_hz: f64,
        /// Share of the time asked for, percent.
        asked_percent: f64,
        /// What it does make.
        offers: &'static str,
    },
    /// A wiring that does not fit the board.
    #[error("the wiring in the rig file does not fit the board: {0}")]
    Wiring(#[source] WiringFault),
    /// A file that stands for a device cannot be written.
    #[error("the file cannot be written: {0}")]
    Unwritable(#[source] std::io::Error),
    /// A file that stands for a device holds something else.
    #[error("the file exists and holds something else; nothing is added to it")]
    ForeignFile,
    /// A record of samples that cannot show the carrier.
    #[error("{0}")]
    Record(#[source] RecordFault),
    /// Samples arrive ever later than they were taken.
    #[error(
        "the samples that arrive are {:.1} s old: this computer does not keep up with the receiver", behind.as_secs_f64()
    )]
    FallenBehind {
        /// The age of the newest sample.
        behind: Duration,
    },
    /// A point gave no reading.
    #[error("none of the {asked} requested readings could be used")]
    NoReadings {
        /// How many were asked for.
        asked: usize,
    },
}

impl Cause {
    /// What a person at the rig can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NoPort => {
                "add `port = \"/dev/tty…\"` to the device's driver table in the rig file"
            }
            Self::PortMissing { .. } => {
                "check that the device is plugged in and switched on, and that the rig file names its port"
            }
            Self::PortBusy => {
                "close the other program (a G-code sender, a serial monitor) and try again"
            }
            Self::PortUnusable(_) => {
                "check that you may open serial ports (on Linux: membership of the group `dialout`) and that the device supports this baud rate"
            }
            Self::Disconnected => "check the device's cable and power, then `resume` the scan",
            Self::NoListener => {
                "check the address and port number in the rig file, that the instrument is switched on, and that its network socket is enabled"
            }
            Self::Record(RecordFault::NoSync { .. } | RecordFault::Unequal { .. }) => {
                "check that the clock of the drives hangs on `sync_channel`, that this channel is switched on, and its volts a division: the clock should fill \
                 a good part of the screen"
            }
            Self::Record(_) => {
                "set the instrument's time base so that a record holds about ten cycles of the carrier, on the instrument or with `setup` in the rig file"
            }
            Self::Io(_) => "check the device's cable and power",
            Self::Silent { .. } => {
                "check cable and power, and that port and baud rate in the rig file belong to this device. A robot that has halted answers nothing: reset it"
            }
            Self::Unreadable { .. } => {
                "check that port and baud rate in the rig file belong to this device"
            }
            Self::Refused { .. } => {
                "check that the rig file names the right driver for this device and its firmware"
            }
            Self::Reset => {
                "look for a loose plug or a supply voltage that drops; `resume` homes the robot and continues"
            }
            Self::Halted { .. } => {
                "remove the cause (an emergency stop, a temperature, an end switch), reset the board or switch the robot off and on, then `resume` the scan"
            }
            Self::Shutdown { .. } => {
                "remove the cause, send FIRMWARE_RESTART (by Klipper's web page or `echo FIRMWARE_RESTART > /tmp/printer`), then `resume`, which homes the robot and continues"
            }
            Self::OtherFirmware { .. } => {
                "name the firmware that answered ([motion.marlin], [motion.grbl] or [motion.klipper]), or use [motion.auto], which detects it; check that the port is the robot's"
            }
            Self::Alarm { .. } => {
                "move any axis off its end switch, compare `travel_mm` with $130 to $132, then `resume`, which homes the robot and continues"
            }
            Self::Paused { .. } => {
                "close the door or release the hold button, then `resume`, which homes the robot and continues. Noise on the line of a robot under GRBL can hold it as well (a digit 1 becomes `!`)"
            }
            Self::StillMoving => {
                "compare the speed and acceleration limits in the firmware with `feed_mm_s`"
            }
            Self::Setting { .. } => {
                "change the rig file, or change the setting in a G-code terminal; the firmware stores it"
            }
            Self::EndstopHit { .. } => {
                "compare `travel_mm` in the rig file with the machine; `resume` homes the robot and continues"
            }
            Self::LineNotKept { .. } => {
                "check that no other program uses the device; `resume` homes the robot and continues"
            }
            Self::RepeatedlyDamaged { .. } => {
                "use a shorter or shielded cable, keep it away from the motor cables, or lower the baud rate"
            }
            Self::LineTooLong { .. } => "check the numbers in the rig file and in the plan",
            Self::NotHomed => "home the robot first",
            Self::Forbidden(_) => {
                "change the plan, or, if the machine allows it, `travel_mm` and `[[motion.keep_out]]` in the rig file"
            }
            Self::WrongPosition { .. } => {
                "check the firmware's soft limits and look for lost steps; `position_tolerance_mm` must not be below the resolution of the firmware's reports. GRBL and Klipper check no checksum, so noise on the line can send the robot elsewhere as well: use a shorter or shielded cable"
            }
            Self::ElementCount { .. } => {
                "describe the connected array under [array] in the rig file"
            }
            Self::BadDelay { .. } => "check the focus and the array in the plan",
            Self::Display(_) => {
                "use a longer `step_mm` or a shorter path; `fieldgap simulate --display` shows the display without a rig"
            }
            Self::NoRecording => "remove [fly] from the plan; the robot then stops at each point",
            Self::NoDisplays => {
                "use a controller that holds displays; its answer to `hello` has `frames=` (crates/rig/src/focus_array/protocol.rs)"
            }
            Self::NoSensors | Self::TooManySensors { .. } => {
                "use fewer elements, or a controller that can receive; its answer to `hello` has `sensors=` (crates/rig/src/focus_array/protocol.rs)"
            }
            Self::NoModulation { .. } => {
                "set `modulation_hz` and `modulation_duty_percent` in [focus_array] to values that the board supports; scans use no modulation"
            }
            Self::Wiring(_) => "correct [focus_array.….wiring] in the rig file",
            Self::Unwritable(_) => "check the path in the rig file and the free space on the disk",
            Self::FallenBehind { .. } => {
                "close other programs on this computer, or lower the receiver's rate; check that `rate_hz` in the rig file is the rate at which it sends"
            }
            Self::ForeignFile => {
                "give `path` in [focus_array.file] the name of a new file, of a named pipe, or of one that this driver has written"
            }
            Self::NoReadings { .. } => {
                "check the receiver's cable; `fieldgap rig check` shows its rate and lost samples"
            }
        }
    }
}

impl RigError {
    /// A fault of `device` met while `attempt` (“moving to …”), with the last line received.
    pub fn new(
        device: Device,
        attempt: impl Into<String>,
        cause: Cause,
        last_received: Option<String>,
    ) -> Self {
        Self(Box::new(Inner { device, attempt: attempt.into(), cause, last_received }))
    }

    /// The device at fault.
    pub fn device(&self) -> &Device {
        &self.0.device
    }

    /// What was being tried.
    pub fn attempt(&self) -> &str {
        &self.0.attempt
    }

    /// What was seen.
    pub fn cause(&self) -> &Cause {
        &self.0.cause
    }

    /// The last line that the device sent, where there was one.
    pub fn last_received(&self) -> Option<&str> {
        self.0.last_received.as_deref()
    }

    /// What a person at the rig can do about it.
    pub fn remedy(&self) -> &'static str {
        self.0.cause.remedy()
    }
}

impl fmt::Display for RigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Inner { device, attempt, cause, last_received } = &*self.0;
        write!(f, "{device}, {attempt}: {cause}")?;
        match last_received {
            Some(line) => write!(f, " (last line received: `{line}`)"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for RigError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        // The cause is part of this error's own line, so the chain goes on behind it.
        self.0.cause.source()
    }
}

impl miette::Diagnostic for RigError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.remedy()))
    }
}

fn listed(ports: &[String]) -> String {
    if ports.is_empty() { "none".to_owned() } else { ports.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Role;

    #[test]
    fn an_error_names_device_port_attempt_and_what_was_heard() {
        let error = RigError::new(
            Device::new(Role::Robot, "/dev/ttyUSB0"),
            "moving to (1.00, 2.00, 3.00) mm",
            Cause::Silent { waited: Duration::from_secs(5) },
            Some("echo:busy: processing".to_owned()),
        );
        assert_eq!(
            error.to_string(),
            "robot on /dev/ttyUSB0, moving to (1.00, 2.00, 3.00) mm: no answer within 5.0 s \
             (last line received: `echo:busy: processing`)"
        );
        assert!(error.remedy().contains("cable"));
    }

    #[test]
    fn a_missing_port_lists_those_that_exist() {
        let cause =
            Cause::PortMissing { available: vec!["/dev/ttyUSB1".into(), "/dev/ttyACM0".into()] };
        assert!(cause.to_string().ends_with("/dev/ttyUSB1, /dev/ttyACM0"));
        let cause = Cause::PortMissing { available: vec![] };
        assert!(cause.to_string().ends_with(": none"));
    }
}
