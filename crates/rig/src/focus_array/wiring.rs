//! Which channel of a board drives which element, and how late and which way round each element sounds.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::ElementDelay;
use crate::error::{Cause, WiringFault};
use fieldgap_input::{Finite, MOST_TEXT, read_text};

/// `[focus_array.<board>.wiring]`: what the board itself does not know of the array that hangs on it.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WiringConfig {
    /// The channel of each element, in the elements' order; absent: as the board's maker numbers them.
    channels: Option<Channels>,
    /// By how much each element sounds later than commanded, radians; its command is advanced by as much. Empty: none does.
    late_rad: Vec<Finite>,
    /// Elements with their two pins exchanged; their commands are delayed by half a period.
    inverted: Vec<usize>,
}

/// Channels, written out or in a file.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
enum Channels {
    List(Vec<usize>),
    /// Numbers with commas, spaces or line ends between them; what follows a `#` is a remark.
    File(PathBuf),
}

impl WiringConfig {
    /// Takes the path of the channels' file from `folder`, which is the rig file's.
    pub fn beside(&mut self, folder: &Path) {
        if let Some(Channels::File(path)) = &mut self.channels {
            *path = folder.join(&*path);
        }
    }

    /// The wiring on a board with these channels, in the order in which elements are on them where nothing else is given.
    pub(super) fn resolve(&self, channels_of_board: &[usize]) -> Result<Wiring, WiringFault> {
        let channels = match &self.channels {
            None => channels_of_board.to_vec(),
            Some(Channels::List(channels)) => channels.clone(),
            Some(Channels::File(path)) => read_channels(path)?,
        };
        let elements = channels.len();
        if elements == 0 {
            return Err(WiringFault::Empty);
        }
        let mut users = HashMap::new();
        for (element, &channel) in channels.iter().enumerate() {
            if !channels_of_board.contains(&channel) {
                return Err(WiringFault::NoChannel { element, channel });
            }
            if let Some(first) = users.insert(channel, element) {
                return Err(WiringFault::Shared { first, second: element, channel });
            }
        }
        if !self.late_rad.is_empty() && self.late_rad.len() != elements {
            return Err(WiringFault::LateCount { elements, given: self.late_rad.len() });
        }
        let mut late_periods = vec![0.0; elements];
        for (late, given) in late_periods.iter_mut().zip(&self.late_rad) {
            *late = given.get() / TAU;
        }
        for &element in &self.inverted {
            *late_periods
                .get_mut(element)
                .ok_or(WiringFault::NoElement { element, elements })? -= 0.5;
        }
        Ok(Wiring { channels, late_periods })
    }
}

fn read_channels(path: &Path) -> Result<Vec<usize>, WiringFault> {
    let text = read_text(path, MOST_TEXT)
        .map_err(|source| WiringFault::Unreadable { path: path.to_owned(), source })?;
    text.lines()
        .filter_map(|line| line.split('#').next())
        .flat_map(|line| line.split([',', ' ', '\t', '\r']))
        .filter(|word| !word.is_empty())
        .map(|word| {
            let fault = || WiringFault::NoNumber { path: path.to_owned(), word: word.to_owned() };
            word.parse().map_err(|_| fault())
        })
        .collect()
}

/// Elements on the channels of one board or a chain of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wiring {
    channels: Vec<usize>,
    /// How late each element sounds of itself, in periods of the carrier.
    late_periods: Vec<f64>,
}

/// The time slot of each channel's pulse; `None`: no pulse.
pub(super) type Slots = Vec<Option<u8>>;

impl Wiring {
    /// How many elements are wired.
    pub(super) fn elements(&self) -> usize {
        self.channels.len()
    }

    /// The time slot, of `slots` in a period, that is nearest to each element's delay, on `channels` channels.
    ///
    /// A slot is counted from the common trigger as a delay is, so that a later pulse has a larger one. What rounds up to
    /// a whole period is slot 0: boards take the number of slots itself for silence.
    pub(super) fn slots(
        &self,
        delays: &[ElementDelay],
        carrier_hz: f64,
        slots: u8,
        channels: usize,
    ) -> Result<Slots, Cause> {
        let mut slot_of_channel = vec![None; channels];
        let delays_s = ElementDelay::checked_s(delays, self.elements())?;
        for (element, delay_s) in delays_s.into_iter().enumerate() {
            let Some(delay_s) = delay_s else { continue };
            let periods = (delay_s * carrier_hz - self.late_periods[element]).rem_euclid(1.0);
            let slot = (periods * f64::from(slots)).round() as u8 % slots;
            slot_of_channel[self.channels[element]] = Some(slot);
        }
        Ok(slot_of_channel)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn config(text: &str) -> WiringConfig {
        fieldgap_input::toml_text(Path::new("rig.toml"), text).expect("valid")
    }

    fn resolved(text: &str, channels: usize) -> Result<Wiring, WiringFault> {
        config(text).resolve(&(0..channels).collect::<Vec<_>>())
    }

    #[test]
    fn without_a_word_the_elements_are_on_the_boards_channels_in_order() {
        let wiring = resolved("", 3).expect("fits");
        let delays =
            [ElementDelay::Seconds(0.0), ElementDelay::Silent, ElementDelay::Seconds(6e-6)];
        let slots = wiring.slots(&delays, 40e3, 10, 3).expect("three");
        // 6 µs of 25 µs are 2.4 slots of ten.
        assert_eq!(slots, [Some(0), None, Some(2)]);
    }

    #[test]
    fn a_delay_goes_to_its_elements_channel_and_other_channels_stay_off() {
        let wiring = resolved("channels = [3, 0]", 4).expect("fits");
        let delays = [ElementDelay::Seconds(12.5e-6), ElementDelay::Seconds(25e-6)];
        let slots = wiring.slots(&delays, 40e3, 32, 4).expect("two");
        assert_eq!(slots, [Some(0), None, None, Some(16)]);
    }

    #[test]
    fn a_late_element_is_told_earlier_and_an_inverted_one_half_a_period_later() {
        // A quarter of a period late: 8 of 32 slots earlier. Both: 8 later.
        let late = std::f64::consts::FRAC_PI_2;
        let text = format!("late_rad = [0.0, {late}, 0.0, {late}]\ninverted = [2, 3]");
        let wiring = resolved(&text, 4).expect("fits");
        let slots = wiring.slots(&[ElementDelay::Seconds(0.0); 4], 40e3, 32, 4).expect("four");
        assert_eq!(slots, [Some(0), Some(24), Some(16), Some(8)]);
    }

    #[test]
    fn the_correction_is_taken_before_rounding() {
        // 0.4 and 0.4 slots: rounded each by itself they would be none, together they are one.
        let late = -0.4 * TAU / 32.0;
        let wiring = resolved(&format!("late_rad = [{late}]"), 1).expect("fits");
        let delays = [ElementDelay::Seconds(0.4 / 32.0 * 25e-6)];
        assert_eq!(wiring.slots(&delays, 40e3, 32, 1).expect("one"), [Some(1)]);
    }

    #[test]
    fn a_file_of_channels_is_read_from_beside_the_rig_file() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("map.txt"), "# x, y\n2, 1\n0 # last\n").expect("written");
        let mut wiring = config("channels = \"map.txt\"");
        wiring.beside(folder.path());
        assert_eq!(wiring.resolve(&[0, 1, 2]).expect("fits").channels, [2, 1, 0]);
        std::fs::write(folder.path().join("map.txt"), "2, one").expect("written");
        let fault = wiring.resolve(&[0, 1, 2]).expect_err("no number");
        assert!(fault.to_string().contains("`one`"), "{fault}");
    }

    #[test]
    fn what_does_not_fit_is_named() {
        for (text, words) in [
            ("channels = [0, 7]", "element 1 is wired to channel 7"),
            ("channels = [1, 1]", "elements 0 and 1 are both wired to channel 1"),
            ("channels = []", "no element"),
            ("late_rad = [0.1]", "1 values for 3 elements"),
            ("inverted = [3]", "element 3"),
            ("channels = \"nowhere.txt\"", "nowhere.txt"),
        ] {
            let fault = resolved(text, 3).expect_err(text);
            assert!(fault.to_string().contains(words), "{fault}");
        }
    }

    proptest! {
        #[test]
        fn a_slot_errs_by_half_a_slot_at_most_and_is_never_the_boards_word_for_silence(
            delay_s in 0.0..1e-3f64, late_rad in -7.0..7.0f64, slots in prop_oneof![Just(10u8), Just(16), Just(24), Just(32)],
        ) {
            let wiring = resolved(&format!("late_rad = [{late_rad:.15}]"), 1).expect("fits");
            let slot_of_channel = wiring.slots(&[ElementDelay::Seconds(delay_s)], 40e3, slots, 1).expect("one");
            let slot = slot_of_channel[0].expect("it sounds");
            prop_assert!(slot < slots);
            let sounds = f64::from(slot) / f64::from(slots) + late_rad / TAU;
            let off = (sounds - delay_s * 40e3).rem_euclid(1.0);
            prop_assert!(off.min(1.0 - off) <= 0.5 / f64::from(slots) + 1e-9);
        }

        #[test]
        fn what_is_no_delay_is_refused(delay_s in prop_oneof![Just(f64::NAN), Just(f64::INFINITY), -1.0..-1e-9f64]) {
            let wiring = resolved("", 1).expect("fits");
            let refused = wiring.slots(&[ElementDelay::Seconds(delay_s)], 40e3, 32, 1);
            let bad = matches!(refused, Err(Cause::BadDelay { element: 0, .. }));
            prop_assert!(bad);
        }
    }
}
