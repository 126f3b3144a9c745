//! Ultraino's boards: Arduinos that play a pattern of bits at 40 kHz (Marzo, Corkett and Drinkwater, IEEE Trans. Ultrason.
//! Ferroelectr. Freq. Control 65, 102, 2018).
//!
//! A pattern is a bitmap: for each time slot of a period the bits of the board's ports. Each of its bytes goes out as
//! two, high half first, the halves in the high four bits and the number of the board in the chain, from 1, in the low
//! four. The byte 0 shows what was sent. A MEGA needs to know before that how many periods the pattern lasts, and that no other follows.
//!
//! **They emit from their power-up until they are commanded otherwise, and opening their port resets them**: the array
//! sounds for a moment each time. They never answer; a board on USB sends some bytes back, of which 0 is the last.

use std::time::Duration;

use serde::Deserialize;

use super::Modulation;
use super::one_way::{OneWayArray, OneWayBoard};
use super::wiring::WiringConfig;
use crate::FocusArray;
use crate::device::Role;
use crate::error::{Cause, RigError};
use crate::link::open_serial;
use fieldgap_input::Delay;

const SHOW: u8 = 0x00;

/// One period for the pattern, four bytes of two bits each, high bits first; then none for the next; then both are taken.
const LASTS_ONE_PERIOD: [u8; 9] = [0x30, 0x30, 0x30, 0x70, 0x30, 0x30, 0x30, 0x30, 0x10];

/// Boards that one chain can number.
const LONGEST_CHAIN: usize = 14;

/// A board takes one byte in a period of the carrier: a line faster than this loses some, bits a second.
const FASTEST_BAUD: u32 = 399_999;

/// The bit of each channel of a MEGA in the ten bytes of its ports A C L B K F H D G J: eight times the byte, and the bit.
const MEGA_BITS: [u8; 64] = [
    51, 52, 53, 54, 28, 29, 30, 31, 47, 46, 45, 44, 43, 42, 41, 40, 56, 57, 58, 59, 48, 49, 72, 69,
    39, 38, 37, 36, 35, 34, 33, 32, 21, 23, 65, 63, 9, 11, 13, 15, 20, 22, 64, 66, 8, 10, 12, 14,
    24, 25, 26, 27, 16, 17, 18, 19, 7, 6, 5, 4, 3, 2, 1, 0,
];

/// `[focus_array.ultraino]`: which boards, and where they are reached.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "Keys")]
pub struct UltrainoConfig {
    port: Option<String>,
    baud: u32,
    model: Model,
    boards: usize,
    expects_echo: bool,
    starts_within: Duration,
    pub(crate) wiring: WiringConfig,
}

/// Which of the boards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Arduino MEGA: 64 channels, 10 slots, up to 14 boards in a chain.
    #[default]
    Mega,
    /// Arduino Nano: 8 channels, 24 slots.
    Nano,
    /// Arduino Nano with DriverNano16: 12 channels that have pins, 16 slots.
    Nano16,
}

impl Model {
    /// Time slots in a period of the carrier.
    pub fn slots(self) -> u8 {
        match self {
            Self::Mega => 10,
            Self::Nano => 24,
            Self::Nano16 => 16,
        }
    }

    /// Bytes of the bitmap in each slot.
    pub fn ports(self) -> usize {
        match self {
            Self::Mega => 10,
            Self::Nano => 1,
            Self::Nano16 => 2,
        }
    }

    /// Channels of one board by their numbers, with and without pins.
    pub fn channels(self) -> usize {
        match self {
            Self::Mega => 64,
            Self::Nano => 8,
            Self::Nano16 => 16,
        }
    }

    /// The byte within a slot, and the bit within that byte, of a channel.
    pub fn bit(self, channel: usize) -> (usize, u8) {
        let bit = match self {
            Self::Mega => usize::from(MEGA_BITS[channel]),
            Self::Nano | Self::Nano16 => channel,
        };
        (bit / 8, 1 << (bit % 8))
    }

    /// The channels that have pins, in their order, on so many boards.
    pub fn wired(self, boards: usize) -> Vec<usize> {
        let has_pin = |channel: &usize| match self {
            Self::Mega | Self::Nano => true,
            // Port C has six pins; the first two of port D are the serial line.
            Self::Nano16 => !(6..10).contains(&(channel % 16)),
        };
        (0..boards * self.channels()).filter(has_pin).collect()
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    port: Option<String>,
    baud: Option<u32>,
    #[serde(default)]
    model: Model,
    boards: Option<usize>,
    #[serde(default)]
    expects_echo: bool,
    starts_within_s: Option<Delay>,
    #[serde(default)]
    wiring: WiringConfig,
}

impl TryFrom<Keys> for UltrainoConfig {
    type Error = String;
    fn try_from(keys: Keys) -> Result<Self, String> {
        let boards = keys.boards.unwrap_or(1);
        let most = if keys.model == Model::Mega { LONGEST_CHAIN } else { 1 };
        if !(1..=most).contains(&boards) {
            return Err(format!("`boards` is {boards}; this model allows 1 to {most} on a line"));
        }
        let baud = keys.baud.unwrap_or(115_200);
        if !(1..=FASTEST_BAUD).contains(&baud) {
            return Err(format!(
                "`baud` is {baud}; it must be 1 to {FASTEST_BAUD}, because a board accepts one byte per 25 µs"
            ));
        }
        let starts_within_s = keys.starts_within_s.map_or(2.5, Delay::get);
        Ok(Self {
            port: keys.port,
            baud,
            model: keys.model,
            boards,
            expects_echo: keys.expects_echo,
            starts_within: Duration::try_from_secs_f64(starts_within_s).map_err(|_| {
                format!("`starts_within_s` is {starts_within_s}, which is too long")
            })?,
            wiring: keys.wiring,
        })
    }
}

impl UltrainoConfig {
    pub(crate) async fn open(
        &self,
        modulation: Modulation,
        port: Option<&str>,
    ) -> Result<Box<dyn FocusArray>, RigError> {
        let wire = open_serial(Role::FocusArray, port, self.port.as_deref(), self.baud)?;
        let wiring = self.wiring.resolve(&self.model.wired(self.boards));
        let wiring = wiring.map_err(|fault| wire.error(Cause::Wiring(fault)))?;
        let board = Ultraino {
            model: self.model,
            boards: self.boards,
            expects_echo: self.expects_echo,
            starts_within: self.starts_within,
        };
        Ok(Box::new(OneWayArray::begin(wire, board, wiring, self.baud, modulation).await?))
    }
}

#[derive(Debug)]
struct Ultraino {
    model: Model,
    boards: usize,
    expects_echo: bool,
    starts_within: Duration,
}

impl Ultraino {
    /// The bits of one board: slot after slot its ports. A channel that sounds is high for half of a period.
    fn bitmap(&self, slots: &[Option<u8>]) -> Vec<u8> {
        let (in_period, ports) = (usize::from(self.model.slots()), self.model.ports());
        let mut bitmap = vec![0; in_period * ports];
        for (channel, slot) in slots.iter().enumerate() {
            let Some(first) = slot else { continue };
            let (port, bit) = self.model.bit(channel);
            for high in 0..in_period / 2 {
                let slot = (usize::from(*first) + high) % in_period;
                bitmap[slot * ports + port] |= bit;
            }
        }
        bitmap
    }
}

impl OneWayBoard for Ultraino {
    fn name(&self) -> String {
        match (self.model, self.boards) {
            (Model::Mega, 1) => "Ultraino MEGA".to_owned(),
            (Model::Mega, boards) => format!("Ultraino MEGA x {boards}"),
            (Model::Nano, _) => "Ultraino Nano".to_owned(),
            (Model::Nano16, _) => "Ultraino DriverNano16".to_owned(),
        }
    }

    fn slots(&self) -> u8 {
        self.model.slots()
    }

    fn channels(&self) -> usize {
        self.boards * self.model.channels()
    }

    /// Gives up a pattern that an earlier program left half written.
    fn wake(&self) -> Vec<u8> {
        vec![SHOW]
    }

    fn frame(&self, slots: &[Option<u8>]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (number, board) in (1u8..).zip(slots.chunks(self.model.channels())) {
            for byte in self.bitmap(board) {
                bytes.extend([byte & 0xf0 | number, byte << 4 | number]);
            }
        }
        if self.model == Model::Mega {
            bytes.extend(LASTS_ONE_PERIOD);
        }
        bytes.push(SHOW);
        bytes
    }

    fn modulate(&self, modulation: Modulation) -> Result<Vec<u8>, Cause> {
        if modulation.frequency_hz > 0.0 {
            return Err(Cause::NoModulation {
                asked_hz: modulation.frequency_hz,
                asked_percent: modulation.duty_percent,
                offers: "this board emits continuous waves only",
            });
        }
        Ok(Vec::new())
    }

    fn echo(&self) -> Option<u8> {
        self.expects_echo.then_some(SHOW)
    }

    fn starts_within(&self) -> Duration {
        self.starts_within
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use fieldgap_input::{Fault, toml_text};

    fn config(text: &str) -> Result<UltrainoConfig, Fault> {
        toml_text(Path::new("rig.toml"), text)
    }

    fn board(model: Model, boards: usize) -> Ultraino {
        Ultraino { model, boards, expects_echo: false, starts_within: Duration::ZERO }
    }

    fn only(channels: usize, at: usize, slot: u8) -> Vec<Option<u8>> {
        let mut slots = vec![None; channels];
        slots[at] = Some(slot);
        slots
    }

    const TAIL: [u8; 10] = [0x30, 0x30, 0x30, 0x70, 0x30, 0x30, 0x30, 0x30, 0x10, 0x00];

    #[test]
    fn silence_on_a_mega_has_its_golden_bytes() {
        let frame = board(Model::Mega, 1).frame(&[None; 64]);
        assert_eq!(frame.len(), 210);
        assert!(frame[..200].iter().all(|byte| *byte == 0x01));
        assert_eq!(frame[200..], TAIL);
    }

    #[test]
    fn one_channel_of_a_mega_has_its_golden_bytes() {
        // Channel 0 is bit 51: port byte 6 (H), bit 3. Slot 8: high in slots 8, 9, 0, 1, 2.
        let frame = board(Model::Mega, 1).frame(&only(64, 0, 8));
        let mut expected = vec![0x01; 200];
        for slot in [8, 9, 0, 1, 2] {
            // The low half of the byte 0x08, which is the second of its two.
            expected[2 * (10 * slot + 6) + 1] = 0x81;
        }
        expected.extend(TAIL);
        assert_eq!(frame, expected);
        // Channel 63 is bit 0: port byte 0 (A); channel 22 bit 72: byte 9 (J), bit 0; channel 3 bit 54: byte 6, bit 6.
        let byte = |channel| {
            let frame = board(Model::Mega, 1).frame(&only(64, channel, 0));
            frame[..20].iter().position(|byte| *byte != 0x01).map(|at| (at, frame[at]))
        };
        assert_eq!(byte(63), Some((1, 0x11)));
        assert_eq!(byte(22), Some((19, 0x11)));
        assert_eq!(byte(3), Some((12, 0x41)));
    }

    #[test]
    fn the_second_board_of_a_chain_has_the_next_number() {
        let frame = board(Model::Mega, 2).frame(&only(128, 64 + 63, 0));
        assert_eq!(frame.len(), 410);
        assert!(frame[..200].iter().all(|byte| *byte == 0x01));
        assert_eq!((frame[200], frame[201], frame[400..].to_vec()), (0x02, 0x12, TAIL.to_vec()));
    }

    #[test]
    fn a_nano_has_its_golden_bytes() {
        // Channel 5 from slot 23 on, for twelve of 24: 23 and 0 to 10. Bit 5 is in the high half.
        let frame = board(Model::Nano, 1).frame(&only(8, 5, 23));
        let mut expected = vec![0x01; 48];
        for slot in (0..11).chain([23]) {
            expected[2 * slot] = 0x21;
        }
        expected.push(0x00);
        assert_eq!(frame, expected);
    }

    #[test]
    fn a_nano16_has_its_golden_bytes() {
        // Channel 10 is port D, bit 2. Slot 0: high for eight of 16.
        let frame = board(Model::Nano16, 1).frame(&only(16, 10, 0));
        let mut expected = vec![0x01; 64];
        for slot in 0..8 {
            expected[4 * slot + 3] = 0x41;
        }
        expected.push(0x00);
        assert_eq!(frame, expected);
        assert_eq!(Model::Nano16.wired(1), [0, 1, 2, 3, 4, 5, 10, 11, 12, 13, 14, 15]);
    }

    #[test]
    fn every_channel_of_a_mega_has_a_bit_of_its_own() {
        let mut bits = MEGA_BITS.to_vec();
        bits.sort_unstable();
        bits.dedup();
        assert_eq!(bits.len(), 64);
        assert!(bits.iter().all(|bit| *bit < 80));
    }

    #[test]
    fn no_byte_of_a_pattern_is_taken_for_a_command() {
        for model in [Model::Mega, Model::Nano, Model::Nano16] {
            let board = board(model, 1);
            let all: Vec<_> =
                (0..board.channels()).map(|n| Some(n as u8 % model.slots())).collect();
            let pattern = 2 * usize::from(model.slots()) * model.ports();
            assert!(board.frame(&all)[..pattern].iter().all(|byte| byte & 0x0f == 1));
        }
    }

    #[test]
    fn what_cannot_be_on_a_line_is_refused_in_the_rig_file() {
        let board = config("").expect("all has a default");
        assert_eq!((board.baud, board.model, board.boards), (115_200, Model::Mega, 1));
        assert_eq!(config("model = \"nano16\"").expect("a model").model, Model::Nano16);
        for wrong in ["boards = 15", "boards = 0", "model = \"nano\"\nboards = 2", "baud = 500000"]
        {
            assert!(config(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_modulation_is_refused() {
        let asked = Modulation { frequency_hz: 200.0, duty_percent: 50.0 };
        let refused = board(Model::Mega, 1).modulate(asked);
        assert!(matches!(refused, Err(Cause::NoModulation { .. })));
    }
}
