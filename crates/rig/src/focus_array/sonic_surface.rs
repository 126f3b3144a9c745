//! SonicSurface: 256 channels behind one serial line, one board or two in a chain (Morales et al., Applied Sciences 11, 2981, 2021).
//!
//! | byte | open firmware | tactile-modulation firmware |
//! |---|---|---|
//! | 254 | phases begin, at channel 0 | the same |
//! | 0 to 31 | slot of the next channel's pulse, of 32 | the same, its lowest bit dropped: 16 slots |
//! | 32 | the next channel is off | the same |
//! | 253 | what was sent is shown, what was shown is written next | the same |
//! | 192, 193 | the first, the second board listens, the other does not | taken for a phase |
//! | 151 | outputs on | taken for a phase |
//! | 160 + n | taken for a phase | modulation at 1250 / (n + 1) Hz; n = 0: none |
//!
//! **It emits on all channels from its power-up until it is commanded otherwise**; the tactile-modulation firmware does not.
//! It never answers.

use serde::Deserialize;

use super::Modulation;
use super::one_way::{OneWayArray, OneWayBoard};
use super::wiring::WiringConfig;
use crate::FocusArray;
use crate::device::Role;
use crate::error::{Cause, RigError};
use crate::link::open_serial;

/// Channels of one board.
const CHANNELS: usize = 256;

/// Columns of one board, and lines.
const SIDE: usize = 16;

const START: u8 = 254;
const SWAP: u8 = 253;
const OFF: u8 = 32;
const OUTPUTS_ON: u8 = 151;
const FIRST_BOARD: u8 = 192;
const MODULATION: u8 = 160;

/// Frequency of the tactile-modulation firmware's fastest step, Hz; the step n divides it by n + 1.
const FASTEST_MODULATION_HZ: f64 = 1250.0;

/// `[focus_array.sonic_surface]`: where the board is reached, and which it is.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "Keys")]
pub struct SonicSurfaceConfig {
    port: Option<String>,
    baud: u32,
    boards: usize,
    firmware: Firmware,
    pub(crate) wiring: WiringConfig,
}

/// What is in the board's programmable logic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Firmware {
    /// As its makers publish it: 32 slots, no modulation.
    #[default]
    Open,
    /// 16 slots, and a modulation of all channels.
    TactileModulation,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    port: Option<String>,
    baud: Option<u32>,
    #[serde(default = "one")]
    boards: usize,
    #[serde(default)]
    firmware: Firmware,
    #[serde(default)]
    wiring: WiringConfig,
}

fn one() -> usize {
    1
}

impl TryFrom<Keys> for SonicSurfaceConfig {
    type Error = String;
    fn try_from(keys: Keys) -> Result<Self, String> {
        let Keys { port, baud, boards, firmware, wiring } = keys;
        match (boards, firmware) {
            (1, _) | (2, Firmware::Open) => {}
            (2, Firmware::TactileModulation) => {
                return Err("the tactile-modulation firmware supports one board: it would read the byte that selects a board as a phase".to_owned());
            }
            _ => return Err(format!("`boards` is {boards}; one or two can be on a line")),
        }
        let baud = baud.unwrap_or(230_400);
        if baud == 0 {
            return Err("`baud` must be above 0".to_owned());
        }
        Ok(Self { port, baud, boards, firmware, wiring })
    }
}

impl SonicSurfaceConfig {
    pub(crate) async fn open(
        &self,
        modulation: Modulation,
        port: Option<&str>,
    ) -> Result<Box<dyn FocusArray>, RigError> {
        let wire = open_serial(Role::FocusArray, port, self.port.as_deref(), self.baud)?;
        let wiring = self.wiring.resolve(&channels_by_position(self.boards));
        let wiring = wiring.map_err(|fault| wire.error(Cause::Wiring(fault)))?;
        let board =
            SonicSurface { boards: self.boards, firmware: self.firmware, asked: modulation };
        Ok(Box::new(OneWayArray::begin(wire, board, wiring, self.baud, modulation).await?))
    }
}

/// Where a channel's element stands on its board: its column from the left (smallest x) and its line from the top
/// (largest y), seen from where it sounds to.
fn position_of(channel: usize) -> (usize, usize) {
    const COLUMN: [usize; 8] = [0, 2, 3, 1, 0, 3, 2, 1];
    const LINE: [usize; 8] = [0, 0, 0, 1, 1, 1, 1, 0];
    let (block, pair, within) = (channel / 64 % 4, channel % 64 / 8, channel % 8);
    (4 * block + COLUMN[within], 2 * pair + LINE[within])
}

/// The channel of each element of square layouts of 16 by 16, numbered line by line from the top left, one layout a board.
pub fn channels_by_position(boards: usize) -> Vec<usize> {
    let mut channels = vec![0; boards * CHANNELS];
    for channel in 0..boards * CHANNELS {
        let (column, line) = position_of(channel % CHANNELS);
        channels[channel / CHANNELS * CHANNELS + SIDE * line + column] = channel;
    }
    channels
}

#[derive(Debug)]
struct SonicSurface {
    boards: usize,
    firmware: Firmware,
    asked: Modulation,
}

impl SonicSurface {
    /// The modulation step nearest to a frequency, by its divisor; `None` outside of what there is.
    fn divisor(modulation: Modulation) -> Option<u8> {
        let divisor = (FASTEST_MODULATION_HZ / modulation.frequency_hz).round();
        ((2.0..=32.0).contains(&divisor) && modulation.duty_percent == 50.0)
            .then_some(divisor as u8)
    }
}

impl OneWayBoard for SonicSurface {
    fn name(&self) -> String {
        let boards = if self.boards == 2 { " x 2" } else { "" };
        match (self.firmware, Self::divisor(self.asked)) {
            (Firmware::Open, _) => format!("SonicSurface{boards}"),
            (Firmware::TactileModulation, None) => "SonicSurface, tactile modulation".to_owned(),
            (Firmware::TactileModulation, Some(divisor)) => format!(
                "SonicSurface, tactile modulation at {:.1} Hz",
                FASTEST_MODULATION_HZ / f64::from(divisor)
            ),
        }
    }

    fn slots(&self) -> u8 {
        match self.firmware {
            Firmware::Open => 32,
            Firmware::TactileModulation => 16,
        }
    }

    fn channels(&self) -> usize {
        self.boards * CHANNELS
    }

    /// In case a stray 150 came before, which ends all output.
    fn wake(&self) -> Vec<u8> {
        match self.firmware {
            Firmware::Open => vec![OUTPUTS_ON],
            Firmware::TactileModulation => Vec::new(),
        }
    }

    fn frame(&self, slots: &[Option<u8>]) -> Vec<u8> {
        let width = 32 / self.slots();
        let mut bytes = vec![START];
        for (select, board) in (FIRST_BOARD..).zip(slots.chunks(CHANNELS)) {
            if self.boards > 1 {
                bytes.push(select);
            }
            bytes.extend(board.iter().map(|slot| slot.map_or(OFF, |slot| slot * width)));
        }
        bytes.push(SWAP);
        bytes
    }

    fn modulate(&self, modulation: Modulation) -> Result<Vec<u8>, Cause> {
        let refused = |offers| Cause::NoModulation {
            asked_hz: modulation.frequency_hz,
            asked_percent: modulation.duty_percent,
            offers,
        };
        match (self.firmware, modulation.frequency_hz > 0.0) {
            (Firmware::Open, false) => Ok(Vec::new()),
            (Firmware::Open, true) => Err(refused("this firmware emits continuous waves only")),
            (Firmware::TactileModulation, false) => Ok(vec![MODULATION]),
            (Firmware::TactileModulation, true) => Self::divisor(modulation)
                .map(|divisor| vec![MODULATION + divisor - 1])
                .ok_or_else(|| {
                    refused("this firmware offers a triangle of 39 to 625 Hz with a duty of 50 %")
                }),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::ElementDelay;
    use fieldgap_acoustics::{Array, Excitation, Medium, Vec3, delays_s};
    use fieldgap_input::{Fault, toml_text};

    /// A focus 100 mm above the board's centre at 343 m/s: the slots of channels 0 to 255, by hand from the published
    /// positions (10.5 mm apart): the farthest element's path less each one's own, in 32nds of 8.575 mm.
    #[rustfmt::skip]
    const FOCUS_100_MM: [u8; 256] = [
        0, 5, 20, 8, 20, 10, 26, 20, 5, 13, 29, 10, 20, 14, 29, 26,
        0, 10, 28, 0, 10, 6, 21, 22, 16, 28, 14, 10, 19, 17, 31, 7,
        19, 31, 17, 7, 16, 14, 28, 10, 10, 21, 6, 22, 0, 28, 10, 0,
        20, 29, 14, 26, 5, 29, 13, 10, 20, 26, 10, 20, 0, 20, 5, 8,
        0, 16, 19, 0, 22, 10, 7, 10, 10, 28, 31, 6, 28, 17, 14, 21,
        10, 29, 0, 0, 21, 12, 8, 21, 29, 16, 20, 12, 0, 24, 20, 8,
        0, 20, 24, 8, 29, 20, 16, 12, 21, 8, 12, 21, 10, 0, 29, 0,
        28, 14, 17, 21, 10, 31, 28, 6, 22, 7, 10, 10, 0, 19, 16, 0,
        19, 10, 0, 7, 10, 22, 0, 16, 31, 21, 10, 14, 17, 28, 6, 28,
        0, 21, 10, 8, 12, 21, 0, 29, 20, 8, 29, 20, 24, 0, 12, 16,
        24, 12, 0, 16, 20, 29, 8, 20, 12, 0, 21, 29, 0, 10, 21, 8,
        17, 6, 28, 28, 31, 10, 21, 14, 10, 0, 22, 16, 19, 0, 10, 7,
        20, 20, 0, 26, 10, 20, 8, 5, 29, 26, 5, 29, 14, 20, 10, 13,
        28, 22, 0, 21, 6, 10, 0, 10, 14, 7, 16, 31, 17, 19, 10, 28,
        17, 10, 19, 28, 14, 16, 7, 31, 6, 0, 10, 10, 28, 0, 22, 21,
        14, 10, 20, 13, 29, 5, 26, 29, 10, 8, 20, 5, 20, 0, 20, 26,
    ];

    fn config(text: &str) -> Result<SonicSurfaceConfig, Fault> {
        toml_text(Path::new("rig.toml"), text)
    }

    fn board(boards: usize, firmware: Firmware) -> SonicSurface {
        SonicSurface { boards, firmware, asked: Modulation::NONE }
    }

    fn focus(firmware: Firmware) -> Vec<u8> {
        let array = Array::square(16, 16, 10.5e-3).expect("not empty");
        let medium = Medium { speed_of_sound_m_s: 343.0 };
        let excitation = Excitation::Focus(Vec3::new(0.0, 0.0, 0.1));
        let delays: Vec<ElementDelay> = delays_s(&excitation, &array, &medium, 40e3)
            .into_iter()
            .map(ElementDelay::Seconds)
            .collect();
        let wiring = WiringConfig::default().resolve(&channels_by_position(1)).expect("fits");
        let board = board(1, firmware);
        let slots = wiring.slots(&delays, 40e3, board.slots(), 256).expect("256");
        board.frame(&slots)
    }

    #[test]
    fn a_focus_above_the_centre_has_its_golden_bytes() {
        let frame = focus(Firmware::Open);
        assert_eq!((frame.len(), frame[0], frame[257]), (258, 254, 253));
        assert_eq!(frame[1..257], FOCUS_100_MM);
    }

    #[test]
    fn its_slots_are_alike_under_the_four_mirror_images() {
        let frame = focus(Firmware::Open);
        let at =
            |column: usize, line: usize| frame[1 + channels_by_position(1)[16 * line + column]];
        for column in 0..16 {
            for line in 0..16 {
                let slot = at(column, line);
                let images = [at(15 - column, line), at(column, 15 - line), at(line, column)];
                assert!(images.into_iter().all(|image| image == slot), "{column} {line}");
            }
        }
        // The centre is nearest, and so last: 5.7623 periods after the corners, 0.7623 * 32 = 24.4.
        assert_eq!((at(0, 0), at(7, 7)), (0, 24));
    }

    #[test]
    fn sixteen_slots_are_sent_as_even_codes() {
        let frame = focus(Firmware::TactileModulation);
        assert!(frame[1..257].iter().all(|code| code % 2 == 0 && *code < 32));
        // 0.7623 * 16 = 12.2 at the centre.
        assert_eq!(frame[1 + channels_by_position(1)[16 * 7 + 7]], 24);
    }

    #[test]
    fn every_channel_stands_at_a_place_of_its_own() {
        // From the published positions: the first channels of the first block, and its last.
        let places = [0, 1, 2, 3, 4, 8, 63, 64, 255].map(position_of);
        assert_eq!(
            places,
            [(0, 0), (2, 0), (3, 0), (1, 1), (0, 1), (0, 2), (1, 14), (4, 0), (13, 14)]
        );
        let mut channels = channels_by_position(2);
        channels.sort_unstable();
        assert!(channels.into_iter().eq(0..512));
    }

    #[test]
    fn silence_is_the_board_s_word_for_it_on_every_channel() {
        let frame = board(1, Firmware::Open).frame(&[None; 256]);
        assert!(frame[1..257].iter().all(|code| *code == 32));
    }

    #[test]
    fn two_boards_are_told_one_after_the_other_and_shown_together() {
        let mut slots = vec![Some(1); 256];
        slots.extend([Some(2); 256]);
        let frame = board(2, Firmware::Open).frame(&slots);
        assert_eq!(frame.len(), 516);
        assert_eq!((frame[0], frame[1], frame[258], frame[515]), (254, 192, 193, 253));
        assert!(frame[2..258].iter().all(|code| *code == 1));
        assert!(frame[259..515].iter().all(|code| *code == 2));
    }

    #[test]
    fn the_outputs_are_switched_on_only_where_that_is_no_phase() {
        assert_eq!(board(1, Firmware::Open).wake(), [151]);
        assert!(board(1, Firmware::TactileModulation).wake().is_empty());
    }

    #[test]
    fn the_nearest_modulation_is_taken_and_what_there_is_none_of_refused() {
        let at = |frequency_hz: f64, duty_percent: f64| Modulation { frequency_hz, duty_percent };
        let tactile = board(1, Firmware::TactileModulation);
        // 1250 / 6 = 208.3 Hz is nearest to 200, 1250 / 11 = 113.6 Hz is the maker's default.
        let byte = |hz| tactile.modulate(at(hz, 50.0)).expect("there is one");
        assert_eq!((byte(200.0), byte(113.6), byte(625.0)), (vec![165], vec![170], vec![161]));
        assert_eq!(tactile.modulate(Modulation::NONE).expect("none"), [160]);
        for refused in [at(1000.0, 50.0), at(20.0, 50.0), at(200.0, 30.0)] {
            assert!(matches!(tactile.modulate(refused), Err(Cause::NoModulation { .. })));
        }
        let open = board(1, Firmware::Open);
        assert!(matches!(open.modulate(at(200.0, 50.0)), Err(Cause::NoModulation { .. })));
        assert!(open.modulate(Modulation::NONE).expect("a continuous wave").is_empty());
        let named = SonicSurface { asked: at(200.0, 50.0), ..tactile };
        assert_eq!(named.name(), "SonicSurface, tactile modulation at 208.3 Hz");
    }

    #[test]
    fn what_cannot_be_on_a_line_is_refused_in_the_rig_file() {
        assert_eq!(config("").expect("all has a default").baud, 230_400);
        assert_eq!(config("boards = 2\nbaud = 227556").expect("two can").boards, 2);
        for wrong in
            ["boards = 3", "boards = 2\nfirmware = \"tactile-modulation\"", "baud = 0", "bord = 1"]
        {
            assert!(config(wrong).is_err(), "{wrong}");
        }
    }
}
