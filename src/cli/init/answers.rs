//! The questions of `init`: each is answered by a flag, at the terminal, or by its default.

use std::fmt::Display;
use std::io::{BufRead, IsTerminal};
use std::str::FromStr;

use clap::{Args, ValueEnum};
use miette::{IntoDiagnostic, miette};

use crate::cli::output::{ask, say};
use fieldgap_input::{Finite, Frequency, Length, Place};

/// The robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Robot {
    /// None: a virtual one
    Virtual,
    /// Marlin, as most printers
    Marlin,
    /// GRBL or grblHAL
    Grbl,
    /// Klipper's host software
    Klipper,
    /// Whatever answers
    Auto,
}

/// The receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Receiver {
    /// None: a virtual one
    Virtual,
    /// A receiver that samples on request
    Stream,
    /// A receiver that sends lines of time and value without being asked
    FreeRunning,
    /// An oscilloscope, by its network address
    Scpi,
}

/// The array's driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Driver {
    /// None: a virtual one
    Virtual,
    /// The thesis's controller
    Thesis,
    /// SonicSurface
    SonicSurface,
    /// Ultraino, Arduino MEGA
    Ultraino,
}

/// The answers that were given on the command line.
#[derive(Debug, Args)]
pub(super) struct Given {
    /// Name of the rig
    #[arg(long)]
    name: Option<String>,
    /// Columns and rows of the square array
    #[arg(long, value_name = "COLUMNS,ROWS", value_parser = counts)]
    array: Option<[u32; 2]>,
    /// Distance between neighbouring elements, mm
    #[arg(long, value_name = "MM", value_parser = length)]
    pitch_mm: Option<f64>,
    /// Frequency of the drive, Hz
    #[arg(long, value_name = "HZ", value_parser = frequency)]
    frequency_hz: Option<f64>,
    /// Temperature of the air, °C
    #[arg(long, value_name = "C", value_parser = number, allow_hyphen_values = true)]
    temperature_c: Option<f64>,
    /// The robot's firmware
    #[arg(long, value_enum)]
    robot: Option<Robot>,
    /// The robot's serial port
    #[arg(long, value_name = "PORT")]
    robot_port: Option<String>,
    /// Travel along x, y and z in the robot's own axes, mm
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = travel, allow_hyphen_values = true)]
    travel_mm: Option<[f64; 6]>,
    /// The array's centre in the robot's own axes, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    centre_mm: Option<[f64; 3]>,
    /// The receiver
    #[arg(long, value_enum)]
    receiver: Option<Receiver>,
    /// The receiver's serial port; for an oscilloscope its address, `host:port`
    #[arg(long, value_name = "PORT")]
    receiver_port: Option<String>,
    /// The array's driver
    #[arg(long, value_enum)]
    driver: Option<Driver>,
    /// The driver's serial port
    #[arg(long, value_name = "PORT")]
    driver_port: Option<String>,
    /// Take the default of every question that no flag answers
    #[arg(long)]
    yes: bool,
}

/// All answers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Answers {
    pub(super) name: String,
    pub(super) array: [u32; 2],
    pub(super) pitch_mm: f64,
    pub(super) frequency_hz: f64,
    pub(super) temperature_c: f64,
    pub(super) robot: Robot,
    /// Absent for a virtual robot.
    pub(super) robot_port: Option<String>,
    pub(super) travel_mm: [f64; 6],
    pub(super) centre_mm: [f64; 3],
    pub(super) receiver: Receiver,
    pub(super) receiver_port: Option<String>,
    pub(super) driver: Driver,
    pub(super) driver_port: Option<String>,
}

impl Given {
    /// Asks for what no flag answers. `ports` are the serial ports of this machine.
    ///
    /// # Errors
    /// Nobody can be asked, and `--yes` was not given; or the terminal was closed.
    pub(super) fn answers(self, ports: &[String]) -> miette::Result<Answers> {
        let asks = !self.yes;
        if asks && !(std::io::stdin().is_terminal() && std::io::stderr().is_terminal()) {
            return Err(miette!(
                help = "give --yes to take the default of every question that no flag answers",
                "nobody can be asked without a terminal, so nothing was written"
            ));
        }
        if asks {
            say("Press Enter for the value in brackets.");
        }
        let name = question(asks, self.name, "Name of the rig", "my-rig".to_owned(), text)?;
        let array = question(asks, self.array, "Columns and rows of the array", [6, 6], counts)?;
        let pitch_mm =
            question(asks, self.pitch_mm, "Distance between elements, mm", 10.5, length)?;
        let frequency_hz =
            question(asks, self.frequency_hz, "Frequency of the drive, Hz", 40e3, frequency)?;
        let temperature_c =
            question(asks, self.temperature_c, "Temperature of the air, °C", 20.0, number)?;
        let robot = choice(asks, self.robot, "Robot", Robot::Virtual)?;
        let robot_port = match robot {
            Robot::Virtual => None,
            Robot::Klipper => port(asks, self.robot_port, "Robot", &["/tmp/printer".to_owned()])?,
            _ => port(asks, self.robot_port, "Robot", ports)?,
        };
        let travel_default = [0.0, 300.0, 0.0, 300.0, 0.0, 250.0];
        let travel_mm = question(
            asks,
            self.travel_mm,
            "Travel in the robot's axes, mm: x from, to, y from, to, z from, to",
            travel_default,
            travel,
        )?;
        let [x0, x1, y0, y1, z0, _] = travel_mm;
        let centre_default = [0.5 * (x0 + x1), 0.5 * (y0 + y1), z0 - 20.0];
        let centre_mm = question(
            asks,
            self.centre_mm,
            "Centre of the array in the robot's axes, mm",
            centre_default,
            place,
        )?;
        let receiver = choice(asks, self.receiver, "Receiver", Receiver::Virtual)?;
        let receiver_port = match receiver {
            Receiver::Virtual => None,
            Receiver::Scpi => {
                port(asks, self.receiver_port, "Oscilloscope", &["192.168.1.20:5555".to_owned()])?
            }
            _ => port(asks, self.receiver_port, "Receiver", ports.get(1..).unwrap_or_default())?,
        };
        let driver = choice(asks, self.driver, "Driver of the array", Driver::Virtual)?;
        let driver_port = match driver {
            Driver::Virtual => None,
            _ => port(asks, self.driver_port, "Driver", ports.get(2..).unwrap_or_default())?,
        };
        if receiver == Receiver::Virtual && driver != Driver::Virtual {
            return Err(miette!(
                help = "give the receiver too, or begin with --driver virtual",
                "a virtual receiver measures the field of a virtual array alone, so nothing was written"
            ));
        }
        Ok(Answers {
            name,
            array,
            pitch_mm,
            frequency_hz,
            temperature_c,
            robot,
            robot_port,
            travel_mm,
            centre_mm,
            receiver,
            receiver_port,
            driver,
            driver_port,
        })
    }
}

/// An answer as it is shown in brackets.
trait Shown {
    fn shown(&self) -> String;
}

impl Shown for String {
    fn shown(&self) -> String {
        self.clone()
    }
}

impl Shown for f64 {
    fn shown(&self) -> String {
        self.to_string()
    }
}

impl<T: Display, const N: usize> Shown for [T; N] {
    fn shown(&self) -> String {
        self.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
    }
}

/// The given answer, or one from the terminal, or the default.
fn question<T: Shown>(
    asks: bool,
    given: Option<T>,
    words: &str,
    default: T,
    parse: fn(&str) -> Result<T, String>,
) -> miette::Result<T> {
    if given.is_some() || !asks {
        return Ok(given.unwrap_or(default));
    }
    loop {
        ask(format!("{words} [{}]: ", default.shown()));
        let mut line = String::new();
        if std::io::stdin().lock().read_line(&mut line).into_diagnostic()? == 0 {
            return Err(miette!("the terminal was closed, so nothing was written"));
        }
        match line.trim() {
            "" => return Ok(default),
            answer => match parse(answer) {
                Ok(answer) => return Ok(answer),
                Err(wrong) => say(wrong),
            },
        }
    }
}

/// One of several kinds, by its name.
fn choice<T: ValueEnum + Copy>(
    asks: bool,
    given: Option<T>,
    words: &str,
    default: T,
) -> miette::Result<T> {
    let name = |kind: &T| {
        kind.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
    };
    let names: Vec<String> = T::value_variants().iter().map(name).collect();
    if given.is_some() || !asks {
        return Ok(given.unwrap_or(default));
    }
    loop {
        let words = format!("{words}: {}", names.join(", "));
        let answer = question(true, None, &words, name(&default), text)?;
        match T::from_str(&answer, true) {
            Ok(kind) => return Ok(kind),
            Err(_) => say(format!("`{answer}` is none of {}", names.join(", "))),
        }
    }
}

/// A serial port; the first of this machine by default.
fn port(
    asks: bool,
    given: Option<String>,
    words: &str,
    ports: &[String],
) -> miette::Result<Option<String>> {
    let default = ports.first().cloned().unwrap_or("/dev/ttyUSB0".to_owned());
    let words = match ports.len() {
        0 | 1 => format!("{words}: its port"),
        _ => format!("{words}: its port, one of {}", ports.join(", ")),
    };
    question(asks, given, &words, default, text).map(Some)
}

fn text(text: &str) -> Result<String, String> {
    fieldgap_input::Label::try_from(text.to_owned())
        .map(Into::into)
        .map_err(|wrong| wrong.to_string())
}

fn quantity<T: TryFrom<f64, Error = fieldgap_input::OutOfRange> + Into<f64>>(
    text: &str,
) -> Result<f64, String> {
    let value: f64 = text.trim().parse().map_err(|_| format!("`{text}` is not a number"))?;
    T::try_from(value).map(Into::into).map_err(|refused| refused.to_string())
}

fn number(text: &str) -> Result<f64, String> {
    quantity::<Finite>(text)
}

fn length(text: &str) -> Result<f64, String> {
    quantity::<Length>(text)
}

fn frequency(text: &str) -> Result<f64, String> {
    quantity::<Frequency>(text)
}

fn several<T: FromStr, const N: usize>(
    text: &str,
    parse: impl Fn(&str) -> Result<T, String>,
) -> Result<[T; N], String> {
    let parts: Result<Vec<T>, String> = text.split(',').map(|part| parse(part.trim())).collect();
    let parts = parts?;
    let count = parts.len();
    <[T; N]>::try_from(parts).map_err(|_| format!("{N} numbers are expected, not {count}"))
}

fn counts(text: &str) -> Result<[u32; 2], String> {
    let counts: [u32; 2] =
        several(text, |part| part.parse().map_err(|_| format!("`{part}` is not a whole number")))?;
    match counts.iter().all(|count| (1..=64).contains(count)) {
        true => Ok(counts),
        false => Err("an array has 1 to 64 columns and rows".to_owned()),
    }
}

fn place(text: &str) -> Result<[f64; 3], String> {
    several(text, quantity::<Place>)
}

fn travel(text: &str) -> Result<[f64; 6], String> {
    let ends: [f64; 6] = several(text, quantity::<Place>)?;
    match ends.chunks(2).all(|ends| ends[1] - ends[0] >= 20.0) {
        true => Ok(ends),
        false => {
            Err("each axis runs from a smaller to a larger number, over 20 mm at least".to_owned())
        }
    }
}
