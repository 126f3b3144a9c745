//! The on-axis decay exp(-0.052927 z) was fitted with z in centimetres and is fed metres.
//!
//! Only the simulator as written has this defect; adding the effect feeds it centimetres.

use super::defect::Defect;

pub(super) static ON_AXIS_UNIT: Defect = Defect {
    id: "on-axis-unit",
    sentence: "the simulator fed metres to an on-axis decay that was fitted in centimetres",
    mend: |supposed| supposed.decay_mended = true,
};
