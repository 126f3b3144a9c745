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
