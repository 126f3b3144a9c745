//! The height at which scan and simulation differ most.

use std::cmp::Ordering;

use crate::judgement::{Judgement, judge};
use fieldgap_comparison::{Comparison, PlaneComparison};

/// The worst plane of a comparison, with the gravest judgement. Among peaks that are apart, those inside their maps come first, because a
/// true peak may lie beyond the edge, and then the larger distance. Among others the larger residual relative to the scan comes first.
/// Its index comes first. `None` where no plane can be judged.
pub(crate) fn worst_plane(comparison: &Comparison) -> Option<(usize, &PlaneComparison)> {
    let planes = comparison.planes.iter().enumerate();
    let judged = planes.filter(|(_, plane)| judge(plane) != Judgement::Unknown);
    judged.max_by(|(_, a), (_, b)| {
        let (judgement, of_other) = (judge(a), judge(b));
        let gravity = gravity(judgement).cmp(&gravity(of_other));
        let inside =
            |plane: &PlaneComparison| !plane.scan.peak_at_edge && !plane.simulation.peak_at_edge;
        let size = |plane: &PlaneComparison| match judgement {
            Judgement::PeakApart => plane.discrepancy.peak_distance_m.value,
            _ => plane.agreement.residual_rms_ratio,
        };
        let inside = match judgement {
            Judgement::PeakApart => inside(a).cmp(&inside(b)),
            _ => Ordering::Equal,
        };
        gravity.then(inside).then(size(a).total_cmp(&size(b)))
    })
}

fn gravity(judgement: Judgement) -> u8 {
    match judgement {
        Judgement::Unknown => 0,
        Judgement::Agrees => 1,
        Judgement::LevelDiffers => 2,
        Judgement::OtherMaximum => 3,
        Judgement::ShapeDiffers => 4,
        Judgement::PeakApart => 5,
    }
}
