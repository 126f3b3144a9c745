//! The on-axis decay exp(-0.052927 z) was fitted with z in centimetres and is fed metres.
//!
//! Only the simulator as written has this defect; adding the effect feeds it centimetres.

use fieldgap_acoustics::transducer::MurataFit;

use super::defect::Defect;
use crate::effect_id::EffectId;

pub(crate) static ON_AXIS_UNIT: Defect = Defect {
    id: EffectId::OnAxisUnit,
    sentence: "the simulator fed metres to an on-axis decay that was fitted in centimetres",
    mend: |radiation| radiation.transducer = &MurataFit::CENTIMETRES,
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, radiation};
    use crate::model::effect::Effect;
    use fieldgap_acoustics::transducer::OnAxis;

    /// exp(-0.052927 z) with z in centimetres falls by exp(-0.52927) over 10 cm.
    #[test]
    fn the_mended_simulator_decays_with_centimetres() {
        let bench = Bench::new();
        let mut radiation = radiation();
        ON_AXIS_UNIT.radiation(bench.at(&[]), &mut radiation);
        let OnAxis::Exponential { decay_per_m, .. } = radiation.transducer.on_axis() else {
            panic!("the thesis's fit is exponential")
        };
        assert!((decay_per_m * 0.1 - 0.52927).abs() < 1e-9);
    }
}
