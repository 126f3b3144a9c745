//! Two elements are exchanged: each is driven by the other's output.

use super::of_elements::{Act, OfElements};
use crate::effect_id::EffectId;
use crate::model::effect::Search;
use crate::remedy::SetupKey;

pub(crate) static SWAPPED_CHANNELS: OfElements = OfElements {
    id: EffectId::SwappedChannels,
    search: Search::Exchanges,
    words: "driven by each other's outputs",
    mimics: &[EffectId::ElementPhase],
    key: SetupKey::SwappedElements,
    act: Act::Exchange,
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, amplitudes_with};
    use crate::model::effect::Carrier;
    use crate::model::effect::Choice;
    use crate::model::effect::Effect;
    use crate::model::instance::Setting;

    #[test]
    fn two_elements_are_driven_with_each_others_phases() {
        let bench = Bench::new();
        let choice = Choice::Elements(vec![0, 2]);
        let mut phases_rad = [0.1, 0.2, 0.3];
        let carrier = Carrier { speed_ratio: 1.0, frequency_ratio: 1.0 };
        let at = Setting { choice: &choice, ..bench.at(&[]) };
        SWAPPED_CHANNELS.drive_phases(at, 0, &carrier, &mut phases_rad);
        assert_eq!(phases_rad, [0.3, 0.2, 0.1]);
        assert_eq!(amplitudes_with(&SWAPPED_CHANNELS, &[0, 2]), [1.0; 3]);
    }
}
