//! A set of effects held against readings that were taken after its fit.

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::Pose;
use fieldgap_records::RecordedScan;

use crate::model::effect::Context;
use crate::model::forward_model::ForwardModel;
use crate::model::observations::Observations;
use crate::selection::scored_model::ScoredModel;
use crate::verdict::gap_size::{as_believed, gap, scatter_beside};

/// A set of effects held against readings that no fit has seen. Gaps are relative to the rms of these readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreshTest {
    /// Number of these readings.
    pub readings: usize,
    /// Gap of the simulation as believed, with the gain of the earlier readings.
    pub gap_before: f64,
    /// Gap with the effects added, all parameters and the gain as fitted to the earlier readings.
    pub gap_after: f64,
    /// What noise alone leaves, with the scatter that the effects themselves predict.
    pub noise: f64,
    /// Mean square of the standardized residuals; one for noise alone.
    pub chi_square: f64,
}

impl FreshTest {
    /// Standard error of [`chi_square`](Self::chi_square) for noise alone: √(2/n).
    pub fn standard_error(&self) -> f64 {
        (2.0 / self.readings as f64).sqrt()
    }
}

/// Holds a fit to the first `seen` driven readings of a scan against the others.
pub(crate) fn fresh_test(
    seen: &Observations,
    whole: &RecordedScan,
    simulator: Simulator,
    scored: &ScoredModel,
    context: &Context,
) -> FreshTest {
    let count = seen.len();
    let mut fresh = Observations::of(std::slice::from_ref(whole), simulator, &[Pose::default()])
        .part(|_, visit| visit.number >= count);
    let scan = &mut fresh.scans[0];
    scan.set_scatter(seen.scans[0].scatter.clone());
    // A drift goes on at the pace of the readings that it was fitted to.
    let driven: Vec<f64> = whole
        .samples
        .iter()
        .filter(|sample| sample.focus.is_some())
        .map(|sample| sample.time_s)
        .collect();
    let length_s = |last: usize| driven[last] - driven[0];
    let longer = length_s(driven.len() - 1) / length_s(count - 1).max(f64::MIN_POSITIVE);
    let visits = scan.drives.iter_mut().flat_map(|drive| &mut drive.visits);
    visits.for_each(|visit| visit.progress *= longer);
    let fit = &scored.fit;
    let model = fit.model(context);
    let before = ForwardModel::believed().expected_readings(&fresh, &as_believed(seen));
    let after = model.expected_readings(&fresh, &fit.nuisance);
    let pressures = model.pressures(&fresh, &fit.nuisance);
    let residuals = model.residuals(&fresh, &pressures, &fit.nuisance).scaled;
    let readings = fresh.len();
    FreshTest {
        readings,
        gap_before: gap(&fresh, &before),
        gap_after: gap(&fresh, &after),
        noise: scatter_beside(&fresh, fit, context),
        chi_square: residuals.iter().map(|r| r * r).sum::<f64>() / readings as f64,
    }
}
