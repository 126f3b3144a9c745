//! What can go wrong between the program and a device.

use std::fmt;
use std::time::Duration;

use super::device::Device;
use super::motion::travel::PathFault;
use super::space::RobotPosition;

/// A fault of a device: which one, at which port, what was being tried, what was seen, what to do.
///
/// `Display` is one line without the remedy; as a [`miette::Diagnostic`] the remedy is its help.
#[derive(Debug)]
pub struct RigError(Box<Inner>);

#[derive(Debug)]
struct Inner {
    device: Device,
    attempt: String,
    cause: Cause,
    last_heard: Option<String>,
}

/// What was seen.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Cause {
    /// Neither the rig file nor a virtual rig gives a port.
    #[error("the rig file gives no port for it")]
    NoPort,
    /// The port does not exist.
    #[error("there is no such port; this machine has {}", listed(available))]
    PortMissing {
        /// The ports that do exist.
        available: Vec<String>,
    },
    /// Somebody else holds the port.
    #[error("the port is held by another program")]
    PortBusy,
    /// The port exists and cannot be used.
    #[error("the port cannot be opened: {0}")]
    PortUnusable(#[source] serialport::Error),
    /// The port closed: unplugged, or switched off.
    #[error("the port was disconnected")]
    Disconnected,
    /// The operating system refused to read or write.
    #[error("the port failed: {0}")]
    Io(#[source] std::io::Error),
    /// Nothing listens at a network address.
    #[error("nothing listens at this address")]
    NoListener,
    /// Nothing fitting came in time.
    #[error("no answer within {:.1} s", waited.as_secs_f64())]
    Silent {
        /// How long was waited in all.
        waited: Duration,
    },
    /// Bytes that are not the device's protocol.
    #[error("what came is not the expected protocol: {seen}")]
    Unreadable {
        /// The bytes, made printable and cut short.
        seen: String,
    },
    /// The device understood and declined.
    #[error("it refused: {reply}")]
    Refused {
        /// The device's words.
        reply: String,
    },
    /// The device restarted by itself.
    #[error("it restarted; what it was told before is gone")]
    Reset,
    /// The firmware stopped for good.
    #[error("its firmware has halted: {reply}")]
    Halted {
        /// The firmware's words.
        reply: String,
    },
    /// Another firmware answers than the rig file names.
    #[error("the rig file names {named}, and another firmware answers: `{heard}`")]
    OtherFirmware {
        /// The firmware that the driver is for.
        named: &'static str,
        /// The line that gave the other one away.
        heard: String,
    },
    /// The firmware has locked itself.
    #[error("its firmware is locked ({reply}): {meaning}")]
    Alarm {
        /// The firmware's words.
        reply: String,
        /// What they mean.
        meaning: &'static str,
    },
    /// Motion waits for a person.
    #[error("it is in the state `{state}`, which only a person can end")]
    Paused {
        /// The firmware's name of the state.
        state: String,
    },
    /// A move does not come to its end.
    #[error("it still moves, long after it should have arrived")]
    StillMoving,
    /// A setting that the firmware keeps makes scans impossible.
    #[error("its setting {name}: {problem}")]
    Setting {
        /// The setting.
        name: String,
        /// What it does.
        problem: String,
    },
    /// An axis ran into its end switch.
    #[error("an axis ran into its end switch: {reply}")]
    EndstopHit {
        /// The firmware's words.
        reply: String,
    },
    /// The device and the program do not agree on which lines were sent.
    #[error("it asks for line {wanted}, which was never sent or is long past")]
    OutOfStep {
        /// The line asked for.
        wanted: u32,
    },
    /// The line was sent several times and never came through whole.
    #[error("the line is garbled on its way; it was sent {times} times")]
    KeepsGarbling {
        /// How many times.
        times: u32,
    },
    /// A command longer than the device takes.
    #[error("the line is {length} characters long, more than the {most} that the device takes")]
    LineTooLong {
        /// Its length.
        length: usize,
        /// The longest that is taken whole.
        most: usize,
    },
    /// A move without a known position.
    #[error(
        "the robot does not know where it is: it has not been homed since it was last reset or stopped"
    )]
    NotHomed,
    /// A move that the rig file forbids.
    #[error("the move is not allowed: {0}")]
    Forbidden(#[source] PathFault),
    /// The robot says that it stands elsewhere than commanded.
    #[error("commanded to {commanded}, it reports {reported}, {:.3} mm off where {:.3} mm is allowed",
        commanded.largest_axis_difference_m(*reported) * 1e3, tolerance_m * 1e3)]
    Elsewhere {
        /// Where it was sent.
        commanded: RobotPosition,
        /// Where it says it is.
        reported: RobotPosition,
        /// The largest difference allowed along any axis, m.
        tolerance_m: f64,
    },
    /// Delays for another number of elements than the array has.
    #[error("it has {has} elements, and delays for {given} were given")]
    ElementCount {
        /// Elements of the array.
        has: usize,
        /// Delays given.
        given: usize,
    },
    /// A delay that is not a time.
    #[error("the delay of element {element} is {delay_s} s, which is not a time from zero upwards")]
    BadDelay {
        /// The element, from 0.
        element: usize,
        /// Its delay, s.
        delay_s: f64,
    },
    /// A display that the controller cannot play.
    #[error("it cannot play the display: {0}")]
    Display(#[source] super::focus_array::ProgramFault),
    /// A receiver that reads points only.
    #[error("it cannot sample without a pause while the robot moves")]
    NoRecording,
    /// A controller without memory for displays.
    #[error("it plays no displays")]
    NoDisplays,
    /// A controller whose elements only sound.
    #[error("its elements cannot listen")]
    NoSensors,
    /// More listeners than the controller has converters for.
    #[error("it listens with at most {most} elements at a time, and {asked} were asked for")]
    TooManySensors {
        /// Elements at a time.
        most: usize,
        /// Elements asked for.
        asked: usize,
    },
    /// A modulation that the controller does not make.
    #[error("it cannot modulate at {asked_hz} Hz, {asked_percent} % of the time: {offers}")]
    NoModulation {
        /// Frequency asked for, Hz.
        asked_hz: f64,
        /// Share of the time asked for, percent.
        asked_percent: f64,
        /// What it does make.
        offers: &'static str,
    },
    /// A wiring that does not fit the board.
    #[error("the wiring in the rig file does not fit: {0}")]
    Wiring(#[source] super::focus_array::WiringFault),
    /// A file that stands for a device cannot be written.
    #[error("the file cannot be written: {0}")]
    Unwritable(#[source] std::io::Error),
    /// A record of samples that cannot show the carrier.
    #[error("{0}")]
    Record(#[source] super::receiver::RecordFault),
    /// Not one reading came of a point.
    #[error("of {asked} readings asked for, none came that could be used")]
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
                "check that your user may open serial ports (on Linux, be in the group `dialout`) and that the device takes this baud rate"
            }
            Self::Disconnected => "check cable and power of the device, then `resume` the scan",
            Self::NoListener => {
                "check address and port number in the rig file, that the instrument is switched on, and that its network socket is enabled"
            }
            Self::Record(_) => {
                "set the instrument's time base so that its record holds some ten cycles of the carrier, by hand or by `setup` in the rig file"
            }
            Self::Io(_) => "check cable and power of the device",
            Self::Silent { .. } => {
                "check cable and power, that port and baud rate in the rig file are the device's, and that no other device answers there"
            }
            Self::Unreadable { .. } => {
                "check that port and baud rate in the rig file are the device's"
            }
            Self::Refused { .. } => {
                "check that the rig file names the right driver for this device and its firmware"
            }
            Self::Reset => {
                "look for a loose plug, a brown-out or a watchdog; `resume` homes the robot and goes on"
            }
            Self::Halted { .. } => "remove the cause, switch the robot off and on, then `resume`",
            Self::OtherFirmware { .. } => {
                "name the firmware that answers ([motion.marlin] or [motion.grbl]), or write [motion.auto], which finds out; and check that the port is the robot's"
            }
            Self::Alarm { .. } => {
                "look at the machine: free an axis that stands on its end switch, check `travel_mm` against $130 to $132; then `resume`, which homes the robot and goes on"
            }
            Self::Paused { .. } => {
                "close its door, release its hold button; then `resume`, which homes the robot and goes on"
            }
            Self::StillMoving => "check the robot's speeds and accelerations against `feed_mm_s`",
            Self::Setting { .. } => {
                "change the rig file, or the setting, in any G-code terminal: the firmware keeps it"
            }
            Self::EndstopHit { .. } => {
                "check `travel_mm` in the rig file against the machine; `resume` homes the robot and goes on"
            }
            Self::OutOfStep { .. } => {
                "check that no other program talks to the device; `resume` homes the robot and goes on"
            }
            Self::KeepsGarbling { .. } => {
                "use a shorter or shielded cable away from the motors' wires, or a lower baud rate"
            }
            Self::LineTooLong { .. } => "check the numbers in the rig file and in the plan",
            Self::NotHomed => "home the robot first",
            Self::Forbidden(_) => {
                "change the plan, or `travel_mm` and `[[motion.keep_out]]` in the rig file if the machine allows it"
            }
            Self::Elsewhere { .. } => {
                "look for a clamped move (the firmware's own soft limits), lost steps, or a `position_tolerance_mm` below what the firmware prints"
            }
            Self::ElementCount { .. } => "make [array] in the rig file the array that is connected",
            Self::BadDelay { .. } => "check focus and array of the plan",
            Self::Display(_) => {
                "take a longer `step_mm` or a shorter path; `fieldgap simulate --display` shows it without a rig"
            }
            Self::NoRecording => {
                "leave [fly] out of the plan: the robot then stands still at each point"
            }
            Self::NoDisplays => {
                "a display needs a controller whose answer to `hello` has `frames=` (crates/rig/src/focus_array/protocol.rs)"
            }
            Self::NoSensors | Self::TooManySensors { .. } => {
                "listening needs a controller whose answer to `hello` has `sensors=` (crates/rig/src/focus_array/protocol.rs)"
            }
            Self::NoModulation { .. } => {
                "set `modulation_hz` and `modulation_duty_percent` in [focus_array] to what the board makes; scans are made without"
            }
            Self::Wiring(_) => "correct [focus_array.….wiring] in the rig file",
            Self::Unwritable(_) => "check the path in the rig file, and that there is room",
            Self::NoReadings { .. } => {
                "check the receiver's cable; run `fieldgap rig check` to see its rate and its gaps"
            }
        }
    }
}

impl RigError {
    /// A fault of `device` met while `attempt` (“moving to …”), with the last thing it said.
    pub fn new(
        device: Device,
        attempt: impl Into<String>,
        cause: Cause,
        last_heard: Option<String>,
    ) -> Self {
        Self(Box::new(Inner { device, attempt: attempt.into(), cause, last_heard }))
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
    pub fn last_heard(&self) -> Option<&str> {
        self.0.last_heard.as_deref()
    }

    /// What a person at the rig can do about it.
    pub fn remedy(&self) -> &'static str {
        self.0.cause.remedy()
    }
}

impl fmt::Display for RigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Inner { device, attempt, cause, last_heard } = &*self.0;
        write!(f, "{device}, {attempt}: {cause}")?;
        match last_heard {
            Some(line) => write!(f, " (last heard: `{line}`)"),
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
    if ports.is_empty() { "no serial port at all".to_owned() } else { ports.join(", ") }
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
             (last heard: `echo:busy: processing`)"
        );
        assert!(error.remedy().contains("cable"));
    }

    #[test]
    fn a_missing_port_lists_those_that_exist() {
        let cause =
            Cause::PortMissing { available: vec!["/dev/ttyUSB1".into(), "/dev/ttyACM0".into()] };
        assert!(cause.to_string().ends_with("/dev/ttyUSB1, /dev/ttyACM0"));
        let cause = Cause::PortMissing { available: vec![] };
        assert!(cause.to_string().contains("no serial port at all"));
    }
}
