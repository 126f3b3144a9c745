//! A set of effects held against readings that were taken after its fit.

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::Pose;
use fieldgap_records::{RecordedScan, ScanSetup};

use crate::effect_id::EffectId;
use crate::model::effect::Context;
use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;
use crate::selection::scored_model::ScoredModel;
use crate::verdict::gap_size::{as_believed, gap_with_error, scatter_beside};

/// A set of effects held against readings that no fit has seen. Gaps are relative to the rms of these readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreshTest {
    /// Number of these readings.
    pub readings: usize,
    /// Gap of the simulation as believed, with the gain of the earlier readings.
    pub gap_before: f64,
    /// Its standard error.
    pub gap_before_error: f64,
    /// Gap with the effects added, all parameters and the gain as fitted to the earlier readings.
    pub gap_after: f64,
    /// Its standard error.
    pub gap_after_error: f64,
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

/// The same readings simulated with a corrected set-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectedTest {
    /// Gap of its simulation.
    pub gap: f64,
    /// Its standard error.
    pub gap_error: f64,
    /// Mean square of the standardized residuals.
    pub chi_square: f64,
    /// Root mean square by which its simulation departs from that of the fit, in standard deviations of a reading.
    pub departure: f64,
}

/// A fit to the first `seen` driven readings of a scan, to be held against the others.
pub(crate) struct FreshReadings<'a> {
    seen: &'a Observations,
    whole: &'a RecordedScan,
    scored: &'a ScoredModel,
    context: &'a Context,
    fresh: Observations,
}

impl<'a> FreshReadings<'a> {
    pub fn of(
        seen: &'a Observations,
        whole: &'a RecordedScan,
        simulator: Simulator,
        scored: &'a ScoredModel,
        context: &'a Context,
    ) -> Self {
        let fresh = after(seen, whole, simulator);
        Self { seen, whole, scored, context, fresh }
    }

    /// Nothing is fitted to them.
    pub fn test(&self) -> FreshTest {
        let fit = &self.scored.fit;
        let before =
            ForwardModel::believed().expected_readings(&self.fresh, &as_believed(self.seen));
        let (gap_before, gap_before_error) = gap_with_error(&self.fresh, &before);
        let model = fit.model(self.context);
        let after = model.expected_readings(&self.fresh, &fit.nuisance);
        let (gap_after, gap_after_error) = gap_with_error(&self.fresh, &after);
        FreshTest {
            readings: self.fresh.len(),
            gap_before,
            gap_before_error,
            gap_after,
            gap_after_error,
            noise: scatter_beside(&self.fresh, fit, self.context),
            chi_square: chi_square(&model, &self.fresh, &fit.nuisance),
        }
    }

    /// A set-up that was corrected by the fit, and the effects of the fit that it does not hold: these act as fitted. So do the near
    /// field and the small shift of the coordinates. The gain is the one at which the simulation lies nearest to that of the fit.
    pub fn corrected(&self, setup: &ScanSetup, accounted: &[EffectId]) -> CorrectedTest {
        let fit = &self.scored.fit;
        let again = RecordedScan { setup: setup.clone(), samples: self.whole.samples.clone() };
        let fresh = after(self.seen, &again, setup.simulator);
        let context = Context { believed: fresh.first().believed.clone(), ..self.context.clone() };
        let kept = fit.instances.iter().zip(&fit.values);
        let (instances, values): (Vec<_>, Vec<_>) = kept
            .filter(|(instance, _)| accounted.contains(&instance.effect.id()))
            .map(|(instance, values)| (instance.clone(), values.clone()))
            .unzip();
        let departures = &fit.nuisance.departures;
        let model = ForwardModel::beside_departures(&instances, &values, departures, &context);
        let fitted = fit.model(self.context).expected_readings(&self.fresh, &fit.nuisance);
        let mut nuisance = fit.nuisance.clone();
        let simulated = model.expected_readings(&fresh, &nuisance);
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        nuisance[0].log_gain +=
            (product(&fitted, &simulated) / product(&simulated, &simulated)).ln();
        let simulated = model.expected_readings(&fresh, &nuisance);
        let scale = &fresh.scans[0].scale;
        let apart = fitted.iter().zip(&simulated).map(|(a, b)| scale.of(*a) - scale.of(*b));
        let (gap, gap_error) = gap_with_error(&fresh, &simulated);
        CorrectedTest {
            gap,
            gap_error,
            chi_square: chi_square(&model, &fresh, &nuisance),
            departure: (apart.map(|d| d * d).sum::<f64>() / fresh.len() as f64).sqrt(),
        }
    }
}

/// The driven readings of `whole` after those that were seen.
fn after(seen: &Observations, whole: &RecordedScan, simulator: Simulator) -> Observations {
    let count = seen.len() + seen.outliers();
    let mut fresh =
        Observations::of(std::slice::from_ref(whole), simulator, &[Pose::default()], false)
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
    fresh
}

/// Mean square of the standardized residuals.
fn chi_square(model: &ForwardModel<'_>, fresh: &Observations, nuisance: &[Nuisance]) -> f64 {
    let pressures = model.pressures(fresh, nuisance);
    let residuals = model.residuals(fresh, &pressures, nuisance).scaled;
    residuals.iter().map(|r| r * r).sum::<f64>() / fresh.len() as f64
}
