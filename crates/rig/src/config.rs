//! The sections `[motion]`, `[receiver]`, `[focus_array]` and `[environment]` of a rig file, and the registry of drivers.
//!
//! What a driver needs stands in a table of its own (`[motion.marlin]`), and a section has exactly one such
//! table. **A new driver is one file and one line here**, in the list of its section.

use std::path::Path;
use std::time::Duration;

use nalgebra::Vector3;
use serde::Deserialize;

use super::focus_array::Modulation;
use super::space::{Feed, Frame};
use super::travel::{AxisBox, Envelope, KeepOut};
use super::{AirSensor, FocusArray, Motion, Receiver, RigError};
use fieldgap_input::{
    Coordinate, Delay, Exact, Finite, Fraction, Gap, Label, Length, NonNegative, ONE_TABLE_OF,
    Positive, Speed, Time,
};
use fieldgap_level::{Reads, Sensitivity, SensitivityKeys};

/// The three devices of a rig, as its file describes them.
#[derive(Debug, Clone)]
pub struct RigConfig {
    /// `[motion]`
    pub motion: MotionConfig,
    /// `[receiver]`
    pub receiver: ReceiverConfig,
    /// `[focus_array]`
    pub focus_array: FocusArrayConfig,
    /// `[environment]`, where there is one.
    pub environment: Option<EnvironmentConfig>,
}

/// Opens a driver with what its section tells every driver of its kind.
macro_rules! open_with {
    ($table:ident, $section:ident, ($($told:ident),*), $port:ident) => {
        $table.open($($section.$told(),)* $port)
    };
}

/// Declares one section: its common keys, its drivers, how it is read and how its driver is opened.
///
/// Keys that belong together are joined into one value by a function, which may refuse them.
/// Each driver's table is a type with `async fn open(&self, …, port) -> Result<Box<dyn …>, RigError>`.
macro_rules! section {
    (
        $(#[$section_doc:meta])*
        $section:ident {
            $( $(#[$key_doc:meta])* $([default = $default:literal])? $key:ident : $type:ty, )*
        }
        $(+ {
            $(#[$group_doc:meta])*
            $group:ident : $group_type:ty = $join:path [ $keys_type:ident { $( $group_key:ident : $group_key_type:ty, )+ } ]
        })?
        $(#[$driver_doc:meta])*
        $driver:ident opens $device:ident with $told:tt {
            $( $(#[$variant_doc:meta])* $table:literal => $variant:ident($config:ty), )+
        }
    ) => {
        $(#[$section_doc])*
        #[derive(Debug, Clone)]
        pub struct $section {
            $( $(#[$key_doc])* pub $key: $type, )*
            $( $(#[$group_doc])* pub $group: $group_type, )?
            /// The one driver table.
            pub driver: $driver,
        }

        $(#[$driver_doc])*
        #[derive(Debug, Clone)]
        pub enum $driver {
            $( $(#[$variant_doc])* $variant($config), )+
        }

        const _: () = {
            #[derive(Deserialize)]
            #[serde(deny_unknown_fields)]
            #[allow(non_snake_case)]
            struct Keys {
                $( $(#[serde(default = $default)])? $key: $type, )*
                $( $( $group_key: Option<$group_key_type>, )+ )?
                $( #[serde(rename = $table)] $variant: Option<$config>, )+
            }

            impl TryFrom<Keys> for $section {
                type Error = String;
                fn try_from(keys: Keys) -> Result<Self, String> {
                    let mut found: Vec<(&str, $driver)> = Vec::new();
                    $( found.extend(keys.$variant.map(|table| ($table, $driver::$variant(table)))); )+
                    let known = [$($table),+];
                    let driver = exactly_one(found, &known)?;
                    $(
                        let joined = $keys_type { $( $group_key: keys.$group_key, )+ };
                        let $group = $join(joined).map_err(|wrong| wrong.to_string())?;
                    )?
                    Ok(Self { $( $key: keys.$key, )* $( $group, )? driver })
                }
            }

            impl<'de> Deserialize<'de> for $section {
                fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                    Keys::deserialize(deserializer)?.try_into().map_err(serde::de::Error::custom)
                }
            }
        };

        impl $section {
            /// Opens the device by its driver, at `port` or else at the port that its table names.
            pub(super) async fn open(&self, port: Option<&str>) -> Result<Box<dyn $device>, RigError> {
                match &self.driver {
                    $( $driver::$variant(table) => open_with!(table, self, $told, port).await, )+
                }
            }
        }
    };
}

fn exactly_one<D>(found: Vec<(&str, D)>, known: &[&str]) -> Result<D, String> {
    let names: Vec<&str> = found.iter().map(|(name, _)| *name).collect();
    match names.len() {
        0 => Err(format!("no driver is given; {ONE_TABLE_OF}{}", known.join(", "))),
        1 => Ok(found.into_iter().map(|(_, driver)| driver).next().expect("there is one")),
        _ => Err(format!("more than one driver is given ({}); keep one", names.join(", "))),
    }
}

section! {
    /// `[motion]`: where the array lies in the robot's axes, where the robot may go, and how fast.
    MotionConfig {
        /// The array's centre in the robot's axes, mm.
        origin_mm: Exact<Coordinate, 3>,
        /// Where the robot may go, robot's axes.
        travel_mm: Travel,
        /// Speed of the moves between points, mm/s.
        feed_mm_s: Speed,
        /// How far the reported position may be from the commanded one along any axis, mm.
        position_tolerance_mm: Length,
        /// What stands within the travel, robot's axes.
        [default = "Vec::new"]
        keep_out: Vec<KeepOutBox>,
    }
    /// The robots that can be driven.
    MotionDriver opens Motion with (envelope, feed) {
        /// Marlin's dialect of G-code on a serial port.
        "marlin" => Marlin(super::motion::marlin::MarlinConfig),
        /// GRBL 1.1 or grblHAL on a serial port.
        "grbl" => Grbl(super::motion::grbl::GrblConfig),
        /// Klipper's dialect of G-code on the pseudo-terminal of its host software.
        "klipper" => Klipper(super::motion::klipper::KlipperConfig),
        /// Whichever of them answers on a serial port.
        "auto" => Auto(super::motion::auto::AutoConfig),
    }
}

section! {
    /// `[receiver]`: how a point is read.
    ReceiverConfig {
        /// How long to wait after standstill, on the receiver's clock, ms.
        settle_ms: Delay,
        /// Readings averaged at a point.
        samples: std::num::NonZeroU32,
    }
    + {
        /// What it reads at a sound pressure, where it is known.
        sensitivity: Option<Sensitivity> = Sensitivity::of_keys [SensitivityKeys {
            sensitivity_v_pa: Positive,
            sensitivity_reading_pa: Positive,
            sensitivity_u_percent: NonNegative,
            reads: Reads,
            amplifier_gain_db: Finite,
            amplifier_u_db: NonNegative,
            response_angle_deg: Vec<Finite>,
            response_db: Vec<Finite>,
            response_u_db: NonNegative,
            face_radius_mm: Length,
            face_radius_u_mm: Gap,
            tilt_u_deg: NonNegative,
            place_u_mm: Gap,
            temperature_u_c: NonNegative,
            humidity_u_percent: NonNegative,
        }]
    }
    /// The receivers that can be read.
    ReceiverDriver opens Receiver with () {
        /// A receiver that samples when it is asked.
        "stream" => Stream(super::receiver::StreamConfig),
        /// A receiver that streams without being asked and takes no commands.
        "free-running" => FreeRunning(super::receiver::FreeRunningConfig),
        /// An oscilloscope that speaks SCPI.
        "scpi" => Scpi(super::receiver::ScpiConfig),
        /// An analog pin of a board with Marlin's firmware.
        "marlin_pin" => MarlinPin(super::receiver::MarlinPinConfig),
    }
}

section! {
    /// `[focus_array]`: how the array's emission is modulated.
    FocusArrayConfig {
        /// Modulation frequency, Hz; 0 = a continuous wave.
        modulation_hz: NonNegative,
        /// Share of each modulation period that the array emits, percent.
        modulation_duty_percent: Percent,
    }
    /// The array controllers that can be driven.
    FocusArrayDriver opens FocusArray with (modulation) {
        /// The thesis's controller: programmable logic behind a serial port.
        "thesis" => Thesis(super::focus_array::ThesisConfig),
        /// One or two SonicSurface boards of 256 channels.
        "sonic_surface" => SonicSurface(super::focus_array::SonicSurfaceConfig),
        /// Ultraino's boards: MEGA of 64 channels, also in a chain, Nano, DriverNano16.
        "ultraino" => Ultraino(super::focus_array::UltrainoConfig),
        /// A file with the commands, for a program of the laboratory's own.
        "file" => File(super::focus_array::FileSinkConfig),
    }
}

section! {
    /// `[environment]`: how the air is watched during a scan.
    EnvironmentConfig {
        /// Time between two rows of `environment.csv`, s.
        [default = "ten_seconds"]
        every_s: Time,
        /// Whether the sensor's first reading sets a scan's medium, in place of `[medium]`.
        [default = "bool::default"]
        sound_speed: bool,
        /// Relative humidity where the sensor does not report it, percent.
        [default = "usual_humidity"]
        humidity_percent: Percent,
        /// Pressure where the sensor does not report it, kPa.
        [default = "standard_pressure"]
        pressure_kpa: Positive,
    }
    /// The sensors that can be read.
    EnvironmentDriver opens AirSensor with () {
        /// Lines of text on a serial port.
        "lines" => Lines(super::air_sensor::AirLinesConfig),
    }
}

fn ten_seconds() -> Time {
    Time::new(10.0).expect("a literal above zero")
}

fn usual_humidity() -> Percent {
    Percent::try_from(50.0).expect("a literal from 0 to 100")
}

fn standard_pressure() -> Positive {
    Positive::new(101.325).expect("a literal above zero")
}

impl FocusArrayConfig {
    /// Takes the paths of files that it names from `folder`, which is the rig file's.
    pub fn beside(&mut self, folder: &Path) {
        match &mut self.driver {
            FocusArrayDriver::Thesis(_) => {}
            FocusArrayDriver::SonicSurface(board) => board.wiring.beside(folder),
            FocusArrayDriver::Ultraino(board) => board.wiring.beside(folder),
            FocusArrayDriver::File(file) => file.beside(folder),
        }
    }

    /// How the emission is modulated.
    pub(super) fn modulation(&self) -> Modulation {
        Modulation {
            frequency_hz: self.modulation_hz.get(),
            duty_percent: self.modulation_duty_percent.get(),
        }
    }
}

impl MotionConfig {
    /// How the array lies in the robot's axes.
    pub fn frame(&self) -> Frame {
        Frame { origin_m: Vector3::from(self.origin_mm.map(|mm| mm.get() * 1e-3)) }
    }

    /// Where the robot may go.
    pub fn envelope(&self) -> Envelope {
        let Travel { x, y, z } = self.travel_mm;
        let keep_out = self.keep_out.iter().map(|keep_out| keep_out.0.clone()).collect();
        Envelope {
            travel: AxisBox {
                least_m: [x.0, y.0, z.0].map(|[least, _]| least * 1e-3),
                largest_m: [x.0, y.0, z.0].map(|[_, largest]| largest * 1e-3),
            },
            keep_out,
        }
    }

    /// Speed of the moves between points.
    pub fn feed(&self) -> Feed {
        Feed::from_mm_s(self.feed_mm_s.into())
    }

    /// How far the reported position may be from the commanded one along any axis, m.
    pub fn position_tolerance_m(&self) -> f64 {
        self.position_tolerance_mm.get() * 1e-3
    }
}

impl ReceiverConfig {
    /// How long to wait after standstill, on the receiver's clock.
    pub fn settle(&self) -> Duration {
        Duration::try_from_secs_f64(self.settle_ms.get() * 1e-3).unwrap_or(Duration::MAX)
    }

    /// Readings averaged at a point.
    pub fn count(&self) -> usize {
        self.samples.get() as usize
    }
}

/// The travel of the three axes, mm.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Travel {
    /// From and to along x, mm.
    pub x: Span,
    /// From and to along y, mm.
    pub y: Span,
    /// From and to along z, mm.
    pub z: Span,
}

/// From and to, the first below the second.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Exact<Coordinate, 2>")]
pub struct Span([f64; 2]);

impl TryFrom<Exact<Coordinate, 2>> for Span {
    type Error = String;
    fn try_from(span: Exact<Coordinate, 2>) -> Result<Self, String> {
        let [from, to] = span.map(Coordinate::get);
        if from < to {
            Ok(Self([from, to]))
        } else {
            Err(format!(
                "an axis range goes from the smaller to the larger value, not from {from} to {to}"
            ))
        }
    }
}

/// `[[motion.keep_out]]`: a named box with faces along the robot's axes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "KeepOutKeys")]
pub struct KeepOutBox(KeepOut);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KeepOutKeys {
    name: Label,
    min_mm: Exact<Coordinate, 3>,
    max_mm: Exact<Coordinate, 3>,
}

impl TryFrom<KeepOutKeys> for KeepOutBox {
    type Error = String;
    fn try_from(keys: KeepOutKeys) -> Result<Self, String> {
        let (least, largest) = (keys.min_mm.map(Coordinate::get), keys.max_mm.map(Coordinate::get));
        if (0..3).any(|axis| least[axis] > largest[axis]) {
            return Err(format!(
                "keep-out box `{}`: min_mm lies beyond max_mm",
                keys.name.as_str()
            ));
        }
        let space =
            AxisBox { least_m: least.map(|mm| mm * 1e-3), largest_m: largest.map(|mm| mm * 1e-3) };
        Ok(Self(KeepOut { name: keys.name.into(), space }))
    }
}

/// From 0 to 100.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
pub struct Percent(Fraction);

impl Percent {
    /// The value, 0 to 100.
    pub fn get(self) -> f64 {
        self.0.get() * 100.0
    }
}

impl TryFrom<f64> for Percent {
    type Error = String;
    fn try_from(percent: f64) -> Result<Self, String> {
        Fraction::new(percent / 100.0)
            .map(Self)
            .map_err(|_| format!("{percent} is not a percentage from 0 to 100"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::{Fault, toml_text};

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        motion: MotionConfig,
    }

    fn motion(text: &str) -> Result<MotionConfig, Fault> {
        toml_text::<File>(Path::new("rig.toml"), text).map(|file| file.motion)
    }

    const COMMON: &str = "[motion]\norigin_mm = [150.0, 150.0, -20.0]\n\
        travel_mm = { x = [0.0, 300.0], y = [0.0, 300.0], z = [0.0, 250.0] }\n\
        feed_mm_s = 80.0\nposition_tolerance_mm = 0.05\n";

    #[test]
    fn millimetres_become_metres() {
        let text = format!(
            "{COMMON}[[motion.keep_out]]\nname = \"array\"\nmin_mm = [0.0, 0.0, 0.0]\nmax_mm = [1.0, 2.0, 3.0]\n[motion.marlin]\n"
        );
        let motion = motion(&text).expect("valid");
        assert_eq!(motion.envelope().travel.largest_m, [0.3, 0.3, 0.25]);
        assert_eq!(motion.envelope().keep_out[0].space.largest_m, [0.001, 0.002, 0.003]);
        assert_eq!(motion.frame().origin_m, Vector3::new(0.15, 0.15, -0.02));
        assert!((motion.feed().m_s() - 0.08).abs() < 1e-15);
    }

    #[test]
    fn a_section_without_a_driver_lists_the_drivers() {
        let fault = motion(COMMON).expect_err("no driver");
        assert!(fault.to_string().contains("marlin"), "{fault}");
        assert!(fault.line_column().is_some(), "{fault}");
    }

    #[test]
    fn an_unknown_driver_key_is_shown_at_its_line() {
        let text = format!("{COMMON}[motion.marlin]\nbuad = 9600\n");
        let fault = motion(&text).expect_err("misspelt");
        assert_eq!(fault.line_column(), Some((7, 1)), "{fault}");
        let fault = motion(&format!("{COMMON}[motion.merlin]\n")).expect_err("misspelt");
        assert_eq!(fault.line_column(), Some((6, 9)), "{fault}");
    }

    #[test]
    fn tables_of_firmwares_share_their_keys_and_refuse_each_others_own() {
        let open = |table: &str| motion(&format!("{COMMON}{table}")).map(|motion| motion.driver);
        let shared = "port = \"/dev/ttyUSB3\"\nhome_within_s = 60.0\n";
        let Ok(MotionDriver::Marlin(marlin)) = open(&format!("[motion.marlin]\n{shared}")) else {
            panic!("a Marlin table")
        };
        let own = "hold_motors = false\n";
        let Ok(MotionDriver::Grbl(grbl)) = open(&format!("[motion.grbl]\n{shared}{own}")) else {
            panic!("a GRBL table")
        };
        assert_eq!(marlin.firmware.port, grbl.firmware.port);
        assert_eq!(marlin.firmware.home_within_s.get(), 60.0);
        assert_eq!((grbl.firmware.baud, grbl.hold_motors), (115_200, false));
        assert_eq!(marlin.firmware.home[0].as_str(), "G28");
        assert_eq!(grbl.firmware.home[0].as_str(), "$H");

        let fault = open(&format!("[motion.marlin]\n{shared}{own}")).expect_err("not Marlin's");
        assert_eq!(fault.line_column(), Some((9, 1)), "{fault}");
        for key in ["hold_motors", "port", "baud", "home", "home_within_s"] {
            assert!(fault.to_string().contains(key), "{fault}");
        }
        let fault = open("[motion.grbl]\nhome_within_s = -1.0\n").expect_err("negative");
        assert_eq!(fault.line_column().map(|(line, _)| line), Some(7), "{fault}");
    }

    #[test]
    fn an_axis_that_ends_before_it_begins_is_shown_at_its_line() {
        let text = COMMON.replace("z = [0.0, 250.0]", "z = [250.0, 0.0]") + "[motion.marlin]\n";
        let fault = motion(&text).expect_err("reversed");
        assert_eq!(fault.line_column().map(|(line, _)| line), Some(3), "{fault}");
    }

    #[test]
    fn one_driver_is_enough() {
        assert_eq!(exactly_one(vec![("a", 1)], &["a", "b"]), Ok(1));
        let refusal = exactly_one(vec![("a", 1), ("b", 2)], &["a", "b"]).expect_err("two");
        assert!(refusal.contains("a, b"), "{refusal}");
    }

    #[test]
    fn a_percentage_is_one_number_from_0_to_100() {
        assert!((Percent::try_from(50.0).expect("valid").get() - 50.0).abs() < 1e-12);
        assert!(Percent::try_from(100.1).is_err() && Percent::try_from(-0.1).is_err());
    }
}
