//! The logic of SonicSurface boards on one line.

use super::super::firmware::{Firmware, Wake};
use super::{PinPulse, Wired};

const CHANNELS: usize = 256;
const OFF: u8 = 32;

/// Modulation step of the tactile firmware at its power-up.
const USUAL_STEP: u8 = 10;

/// The firmware's command set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    Open,
    Tactile,
}

/// One board: its active phases, those being written, and whether it takes commands.
struct Board {
    shown: [u8; CHANNELS],
    written: [u8; CHANNELS],
    counter: u8,
    enabled: bool,
}

/// One board, or two in a chain.
pub(super) struct SonicSurfaceBoards {
    dialect: Dialect,
    boards: Vec<Board>,
    outputs_on: bool,
    step: u8,
    wired: Wired,
}

impl SonicSurfaceBoards {
    pub(super) fn new(dialect: Dialect, boards: usize, wired: Wired) -> Self {
        let boards = (0..boards).map(|_| Board::powered_up(dialect)).collect();
        Self { dialect, boards, outputs_on: true, step: USUAL_STEP, wired }
    }

    fn show(&self, now_s: f64) {
        let pin = |channel: usize| {
            let code = *self.boards.get(channel / CHANNELS)?.shown.get(channel % CHANNELS)?;
            let start = f64::from(code) / 32.0;
            match self.dialect {
                _ if code == OFF || !self.outputs_on => None,
                Dialect::Open => Some(PinPulse::new(start, 0.5)),
                Dialect::Tactile => Some(PinPulse::new(start, 7.0 / 16.0)),
            }
        };
        // A triangle in the number of channels: half of them in the mean.
        let modulated = self.dialect == Dialect::Tactile && self.step > 0;
        self.wired.drive(now_s, if modulated { 0.5 } else { 1.0 }, pin);
    }
}

impl Board {
    fn powered_up(dialect: Dialect) -> Self {
        let code = if dialect == Dialect::Open { 0 } else { OFF };
        Self { shown: [code; CHANNELS], written: [code; CHANNELS], counter: 0, enabled: true }
    }

    fn phase(&mut self, code: u8, dialect: Dialect) {
        let kept = match (code, dialect) {
            (OFF, _) => OFF,
            (_, Dialect::Open) => code & 31,
            (_, Dialect::Tactile) => code & 30,
        };
        self.written[usize::from(self.counter)] = kept;
        self.counter = self.counter.wrapping_add(1);
    }
}

impl Firmware for SonicSurfaceBoards {
    fn power_up(&mut self, now_s: f64, _out: &mut Vec<u8>) {
        let dialect = self.dialect;
        self.boards.iter_mut().for_each(|board| *board = Board::powered_up(dialect));
        self.outputs_on = true;
        self.step = USUAL_STEP;
        self.show(now_s);
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        let (dialect, open) = (self.dialect, self.dialect == Dialect::Open);
        match byte {
            254 => self.boards.iter_mut().filter(|board| board.enabled).for_each(|b| b.counter = 0),
            253 => {
                for board in &mut self.boards {
                    std::mem::swap(&mut board.shown, &mut board.written);
                    board.counter = 0;
                }
                self.show(now_s);
            }
            192 | 193 if open => {
                let selected = usize::from(byte - 192);
                for (number, board) in self.boards.iter_mut().enumerate() {
                    board.enabled = number == selected;
                }
            }
            150 | 151 if open => {
                self.outputs_on = byte == 151;
                self.show(now_s);
            }
            160..=191 if !open => {
                self.step = byte - 160;
                self.show(now_s);
            }
            code => {
                let listening = self.boards.iter_mut().filter(|board| board.enabled);
                listening.for_each(|board| board.phase(code, dialect));
            }
        }
    }

    fn step(&mut self, _now_s: f64, _out: &mut Vec<u8>) {}

    fn wake(&self) -> Option<Wake> {
        None
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::super::clock::Pace;
    use super::super::super::drive::Output;
    use super::super::super::testing::world;
    use super::*;

    /// Boards whose first 36 channels carry the elements of the tests' array.
    fn boards(dialect: Dialect, count: usize) -> SonicSurfaceBoards {
        let (world, _) = world("", Pace::Lockstep);
        let wired = Wired { channels: (0..36).collect(), elements: 36, world };
        let mut boards = SonicSurfaceBoards::new(dialect, count, wired);
        boards.power_up(0.0, &mut Vec::new());
        boards
    }

    fn tell(boards: &mut SonicSurfaceBoards, bytes: &[u8]) -> Vec<Option<Output>> {
        bytes.iter().for_each(|&byte| boards.receive(byte, 1.0));
        boards.wired.world.drive_at(1.0).outputs()
    }

    fn frame(codes: impl IntoIterator<Item = u8>) -> Vec<u8> {
        [254].into_iter().chain(codes).chain([253]).collect()
    }

    #[test]
    fn it_powers_up_emitting_and_the_tactile_one_silent() {
        let sounds = tell(&mut boards(Dialect::Open, 1), &[]);
        assert!(
            sounds.iter().all(|output| *output == Some(Output { delay_s: 0.0, amplitude: 1.0 }))
        );
        assert!(tell(&mut boards(Dialect::Tactile, 1), &[]).iter().all(Option::is_none));
    }

    #[test]
    fn codes_are_slots_of_a_period_and_32_alone_is_off() {
        let mut boards = boards(Dialect::Open, 1);
        let outputs = tell(&mut boards, &frame([8, 32, 33, 31]));
        assert_eq!(outputs[0].map(|output| output.delay_s), Some(6.25e-6));
        assert_eq!(outputs[1], None);
        assert_eq!(outputs[2].map(|output| output.delay_s), Some(25e-6 / 32.0));
        // Channels that were not sent keep what the buffer held.
        assert_eq!(outputs[4].map(|output| output.delay_s), Some(0.0));
    }

    #[test]
    fn a_swap_alone_brings_the_pattern_before_back() {
        let mut boards = boards(Dialect::Open, 1);
        assert!(tell(&mut boards, &frame([32; 256])).iter().all(Option::is_none));
        assert!(tell(&mut boards, &[253]).iter().all(Option::is_some));
        assert!(tell(&mut boards, &frame([32; 256])).iter().all(Option::is_none));
        assert!(tell(&mut boards, &frame([32; 256])).iter().all(Option::is_none));
        assert!(tell(&mut boards, &[253]).iter().all(Option::is_none), "silence on both buffers");
    }

    #[test]
    fn outputs_can_be_switched_off_and_on_and_one_board_of_two_selected() {
        let mut boards = boards(Dialect::Open, 2);
        assert!(tell(&mut boards, &[150]).iter().all(Option::is_none));
        assert!(tell(&mut boards, &[151]).iter().all(Option::is_some));
        // The second board is silenced alone.
        let bytes: Vec<u8> = [254, 193].into_iter().chain([32; 256]).chain([253]).collect();
        assert!(tell(&mut boards, &bytes).iter().all(Option::is_some));
        assert!(boards.boards[1].shown.iter().all(|code| *code == OFF));
        assert!(boards.boards[0].shown.iter().all(|code| *code == 0));
    }

    #[test]
    fn the_tactile_firmware_drops_the_lowest_bit_and_modulates() {
        let mut boards = boards(Dialect::Tactile, 1);
        let outputs = tell(&mut boards, &frame([9, 32]));
        let first = outputs[0].expect("it sounds");
        // 7 of 16 slots from 8/32 on: the middle half a slot of 16 before that of a full half.
        assert!((first.delay_s - (0.25 - 1.0 / 32.0) * 25e-6).abs() < 1e-12);
        assert_eq!(outputs[1], None);
        assert_eq!(boards.wired.world.drive_at(1.0).duty, 0.5);
        tell(&mut boards, &[160]);
        assert_eq!(boards.wired.world.drive_at(1.0).duty, 1.0);
        // What selects a board elsewhere is a phase here.
        let outputs = tell(&mut boards, &[254, 192, 253]);
        assert!(outputs[0].is_some());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn no_bytes_make_the_board_panic(bytes in prop::collection::vec(any::<u8>(), 0..600), tactile: bool) {
            let dialect = if tactile { Dialect::Tactile } else { Dialect::Open };
            let mut boards = boards(dialect, 2);
            for output in tell(&mut boards, &bytes).into_iter().flatten() {
                prop_assert!(output.delay_s.abs() < 25e-6 && output.amplitude <= 1.0);
            }
        }
    }
}
