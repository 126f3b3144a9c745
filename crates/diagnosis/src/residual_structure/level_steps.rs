//! Whether the level of a scan steps at one moment.
//!
//! Slow noise that is taken out of the residuals takes most of a step with it: the level wanders, only never so far from one reading to the next.

use crate::model::observations::Observations;
use crate::residual_structure::patterns::mean_square;
use crate::residual_structure::test::Test;
use crate::statistics::significance::less_by_chance;

/// The test for the strongest step in these residuals; `None` where no scan has slow noise.
pub(crate) fn test(observations: &Observations, residuals: &[f64]) -> Option<Test> {
    let deviation = mean_square(residuals).sqrt();
    let mut from = 0;
    let of_scans = observations.scans.iter().filter_map(|scan| {
        let of_scan = from..from + scan.len();
        from = of_scan.end;
        let (step, after) = scan.slow_level.as_ref()?.strongest_step(&residuals[of_scan])?;
        // At every reading, upwards or downwards.
        Some((less_by_chance(step / deviation, 2.0 * scan.len() as f64), after))
    });
    let (z, after) = of_scans.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let sign = format!("after {:.0} % of its time", 100.0 * after);
    Some(Test::of_one_thing("a step of the level", z, Some(sign)))
}
