//! The simulator takes path lengths at the focal height instead of the observed one (the thesis's listing computes them
//! once, for `target_z`).
//!
//! Only the simulator as written has this defect; adding the effect takes path lengths where the field is observed.

use fieldgap_acoustics::PathLengths;

use super::defect::Defect;
use crate::effect_id::EffectId;

pub(crate) static PHASE_PLANE: Defect = Defect {
    id: EffectId::PhasePlane,
    sentence: "the simulator froze its path lengths at the focal height; they belong where the field is observed",
    mend: |radiation| radiation.paths = PathLengths::Observed,
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, radiation};
    use crate::model::effect::Effect;
    use crate::model::effect::Radiation;

    #[test]
    fn the_mended_simulator_takes_paths_where_the_field_is_observed() {
        let bench = Bench::new();
        let mut radiation = Radiation { paths: PathLengths::FrozenAt(0.1), ..radiation() };
        PHASE_PLANE.radiation(bench.at(&[]), &mut radiation);
        assert_eq!(radiation.paths, PathLengths::Observed);
    }
}
