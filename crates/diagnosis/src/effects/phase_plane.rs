//! The simulator takes path lengths at the focal height instead of the observed one (the thesis's listing computes them
//! once, for `target_z`).
//!
//! Only the simulator as written has this defect; adding the effect takes path lengths where the field is observed.

use super::defect::Defect;

pub(super) static PHASE_PLANE: Defect = Defect {
    id: "phase-plane",
    sentence: "the simulator froze its path lengths at the focal height; they belong where the field is observed",
    mend: |supposed| supposed.paths_mended = true,
};
