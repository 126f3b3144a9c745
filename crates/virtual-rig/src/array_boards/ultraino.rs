//! Ultraino's Arduinos in a chain.

use num_complex::Complex64;

use super::super::firmware::{Firmware, Wake};
use super::{PinPulse, Wired};
use fieldgap_rig::focus_array::UltrainoModel;

const SHOW: u8 = 0x00;
const TAKE_DURATIONS: u8 = 0x10;

/// Patterns that a MEGA holds in one buffer.
const PATTERNS: usize = 32;

/// One board's two buffers and durations.
struct Board {
    shown: Vec<u8>,
    written: Vec<u8>,
    /// Halves of bytes written so far.
    halves: usize,
}

/// The boards in their order along the line. Only the first pattern of a buffer is emitted: animations last longer than a
/// reading and are left out.
pub(super) struct UltrainoChain {
    model: UltrainoModel,
    boards: Vec<Board>,
    /// What the first board sends back up the line.
    back: Vec<u8>,
    wired: Wired,
}

impl UltrainoChain {
    pub(super) fn new(model: UltrainoModel, boards: usize, wired: Wired) -> Self {
        let boards = (0..boards).map(|_| Board::powered_up(model)).collect();
        Self { model, boards, back: Vec::new(), wired }
    }

    fn show(&self, now_s: f64) {
        let slots = usize::from(self.model.slots());
        let pin = |channel: usize| {
            let board = self.boards.get(channel / self.model.channels())?;
            let (port, bit) = self.model.bit(channel % self.model.channels());
            let high: Vec<bool> = (0..slots)
                .map(|slot| board.shown[slot * self.model.ports() + port] & bit != 0)
                .collect();
            fundamental(&high)
        };
        self.wired.drive(now_s, 1.0, pin);
    }

    /// Passes a byte along the line. Commands reach every board; a pattern reaches the board that it counts down to.
    fn take(&mut self, byte: u8, now_s: f64) {
        let is_mega = self.model == UltrainoModel::Mega;
        match byte {
            SHOW => {
                for board in &mut self.boards {
                    std::mem::swap(&mut board.shown, &mut board.written);
                    board.halves = 0;
                }
                self.back.push(byte);
                self.show(now_s);
            }
            TAKE_DURATIONS => {
                // A Nano begins its pattern anew.
                if !is_mega {
                    self.boards.iter_mut().for_each(|board| board.halves = 0);
                }
                self.back.push(byte);
            }
            // A duration: two bits in the highest.
            _ if is_mega && byte & 0x3f == 0x30 => self.back.push(byte),
            _ => {
                let number = usize::from(byte & 0x0f);
                if number != 1 {
                    self.back.push(byte.wrapping_sub(1));
                }
                if let Some(board) = number.checked_sub(1).and_then(|at| self.boards.get_mut(at)) {
                    board.half(byte);
                }
            }
        }
    }
}

impl Board {
    /// The first half of each period high on all pins, the other buffer empty.
    fn powered_up(model: UltrainoModel) -> Self {
        let patterns = if model == UltrainoModel::Mega { PATTERNS } else { 1 };
        let pattern = usize::from(model.slots()) * model.ports();
        let mut shown = vec![0; patterns * pattern];
        shown[..pattern / 2].fill(0xff);
        Self { shown, written: vec![0; patterns * pattern], halves: 0 }
    }

    /// Half of a byte of the pattern that is being written; beyond the buffer it is lost.
    fn half(&mut self, byte: u8) {
        if let Some(written) = self.written.get_mut(self.halves / 2) {
            match self.halves % 2 {
                0 => *written = byte & 0xf0,
                _ => *written |= byte >> 4,
            }
        }
        self.halves += 1;
    }
}

/// The fundamental of a pin that is high in some slots of a period, by its Fourier sum; `None` where there is none.
fn fundamental(high: &[bool]) -> Option<PinPulse> {
    let turn =
        |slot: f64| Complex64::from_polar(1.0, std::f64::consts::TAU * slot / high.len() as f64);
    let sum = |is_high: &dyn Fn(usize) -> bool| -> Complex64 {
        (0..high.len()).filter(|&slot| is_high(slot)).map(|slot| turn(slot as f64)).sum()
    };
    let relative = sum(&|slot| high[slot]) / sum(&|slot| slot < high.len() / 2);
    let late_periods = (relative.arg() / std::f64::consts::TAU).rem_euclid(1.0);
    (relative.norm() > 1e-9).then(|| PinPulse {
        // The remainder of a tiny negative number rounds to one whole period.
        late_periods: if late_periods < 1.0 { late_periods } else { 0.0 },
        amplitude: relative.norm(),
    })
}

impl Firmware for UltrainoChain {
    fn power_up(&mut self, now_s: f64, _out: &mut Vec<u8>) {
        let model = self.model;
        self.boards.iter_mut().for_each(|board| *board = Board::powered_up(model));
        self.back.clear();
        self.show(now_s);
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        self.take(byte, now_s);
    }

    fn step(&mut self, _now_s: f64, out: &mut Vec<u8>) {
        out.append(&mut self.back);
    }

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

    fn chain(model: UltrainoModel, boards: usize) -> UltrainoChain {
        let (world, _) = world("", Pace::Lockstep);
        let wired = Wired { channels: model.wired(boards), elements: 36, world };
        let mut chain = UltrainoChain::new(model, boards, wired);
        chain.power_up(0.0, &mut Vec::new());
        chain
    }

    fn tell(chain: &mut UltrainoChain, bytes: &[u8]) -> (Vec<Option<Output>>, Vec<u8>) {
        bytes.iter().for_each(|&byte| chain.receive(byte, 1.0));
        let mut back = Vec::new();
        chain.step(1.0, &mut back);
        (chain.wired.world.drive_at(1.0).outputs(), back)
    }

    #[test]
    fn it_powers_up_emitting_and_echoes_commands() {
        let mut chain = chain(UltrainoModel::Mega, 1);
        let (outputs, _) = tell(&mut chain, &[]);
        assert!(outputs.iter().flatten().all(|output| (output.amplitude - 1.0).abs() < 1e-12));
        assert_eq!(outputs.iter().flatten().count(), 36);
        let mut silence = vec![0x01; 200];
        silence.extend([0x30, 0x30, 0x30, 0x70, 0x30, 0x30, 0x30, 0x30, 0x10, 0x00]);
        let (outputs, back) = tell(&mut chain, &silence);
        assert!(outputs.iter().all(Option::is_none));
        assert_eq!(back, silence[200..], "the pattern is swallowed, commands come back");
    }

    #[test]
    fn a_bit_in_five_slots_is_a_pulse_of_full_amplitude_at_its_slot() {
        let mut chain = chain(UltrainoModel::Mega, 1);
        // Channel 7 is bit 31: byte 3, bit 7, which is in the high half. High in slots 3 to 7.
        let mut bytes = vec![0x01; 200];
        (3..8).for_each(|slot: usize| bytes[2 * (10 * slot + 3)] = 0x81);
        bytes.push(0x00);
        let (outputs, _) = tell(&mut chain, &bytes);
        let output = outputs[7].expect("it sounds");
        assert!((output.delay_s - 7.5e-6).abs() < 1e-15 && (output.amplitude - 1.0).abs() < 1e-12);
        assert_eq!(outputs.iter().flatten().count(), 1);
    }

    #[test]
    fn a_narrow_pulse_is_weaker_as_its_sine_says() {
        // Two of ten slots: sin(pi * 0.2), its middle one and a half slots before that of a half.
        let high: Vec<bool> = (0..10).map(|slot| slot < 2).collect();
        let pulse = fundamental(&high).expect("it sounds");
        let expected = (std::f64::consts::PI * 0.2).sin();
        assert!((pulse.amplitude - expected).abs() < 1e-12);
        assert!((pulse.late_periods - 0.85).abs() < 1e-12, "{}", pulse.late_periods);
        assert_eq!(fundamental(&[true; 10]), None, "a constant level makes no sound");
    }

    #[test]
    fn the_second_board_has_what_is_counted_down_to_it() {
        let mut chain = chain(UltrainoModel::Mega, 2);
        let silent_first: Vec<u8> = vec![0x01; 200];
        let half_second: Vec<u8> = (0..200).map(|at| if at < 100 { 0xf2 } else { 0x02 }).collect();
        let (_, back) = tell(&mut chain, &[&silent_first[..], &half_second, &[0x00]].concat());
        assert!(chain.boards[0].shown.iter().all(|byte| *byte == 0));
        assert_eq!(chain.boards[1].shown[..50], [0xff; 50]);
        // What goes on to the second board passes the first one's output.
        assert_eq!((back[0], back.len()), (0xf1, 201));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn no_bytes_make_the_chain_panic(bytes in prop::collection::vec(any::<u8>(), 0..900), model in 0..3usize) {
            let model = [UltrainoModel::Mega, UltrainoModel::Nano, UltrainoModel::Nano16][model];
            let mut chain = chain(model, 1);
            for output in tell(&mut chain, &bytes).0.into_iter().flatten() {
                prop_assert!(output.delay_s.abs() < 25e-6 && output.amplitude < 2.0);
            }
        }
    }
}
