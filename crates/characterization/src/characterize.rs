//! The fit of every pair of laws to the readings.

use rayon::prelude::*;
use serde::Serialize;

use super::laws::described_transducer;
use super::pair_fit::AxisFit;
use super::{AxisLaw, AxisPose, CharacterizationError, LobeLaw, PairFit, Profile, Readings};
use fieldgap_input::Positive;
use fieldgap_records::TransducerFile;

/// Number of best pairs that are fitted again with a free axis.
const REFITTED: usize = 4;

/// Smallest share of the variance that the best pair must explain: far less than for a transducer's field, far more than for noise.
const MIN_R_SQUARED: f64 = 0.5;

/// The characterization of a transducer.
#[derive(Debug, Clone, Serialize)]
pub struct Characterization {
    /// Every pair of laws that could be fitted, the best by the Bayesian information criterion first.
    pub pairs: Vec<PairFit>,
    /// The readings along and around the axis of the best pair.
    pub profile: Profile,
}

/// Fits every law on the axis with every lobe.
///
/// # Errors
/// [`CharacterizationError::NoFit`] if none of them explains half of the readings' variance.
pub fn characterize(readings: &Readings) -> Result<Characterization, CharacterizationError> {
    // The axis is that of the most flexible pair; then every pair is fitted with this axis.
    let start = AxisFit::Free(AxisPose::estimate(readings));
    let flexible = PairFit::new(readings, AxisLaw::Absorbed, LobeLaw::Table, start)
        .or_else(|| PairFit::new(readings, AxisLaw::Power, LobeLaw::Gaussian, start))
        .ok_or(CharacterizationError::NoFit)?;
    let laws: Vec<(AxisLaw, LobeLaw)> = AxisLaw::ALL
        .into_iter()
        .flat_map(|axis| LobeLaw::ALL.into_iter().map(move |lobe| (axis, lobe)))
        .collect();
    let mut pairs: Vec<PairFit> = laws
        .into_par_iter()
        .filter_map(|(axis, lobe)| {
            PairFit::new(readings, axis, lobe, AxisFit::Fixed(flexible.axis))
        })
        .collect();
    sort_by_bic(&mut pairs);
    // The best pairs are fitted again with a free axis.
    let best_count = REFITTED.min(pairs.len());
    pairs[..best_count].par_iter_mut().for_each(|pair| {
        let start = AxisFit::Free(pair.axis);
        if let Some(refitted) = PairFit::new(readings, pair.axis_law, pair.lobe_law, start) {
            *pair = refitted;
        }
    });
    sort_by_bic(&mut pairs);
    let best = pairs
        .first()
        .filter(|best| best.r_squared >= MIN_R_SQUARED)
        .ok_or(CharacterizationError::NoFit)?;
    let profile = Profile::of(readings, best);
    Ok(Characterization { pairs, profile })
}

fn sort_by_bic(pairs: &mut [PairFit]) {
    pairs.sort_by(|a, b| a.bic.total_cmp(&b.bic));
}

impl Characterization {
    /// The pair with the best criterion.
    pub fn best(&self) -> &PairFit {
        &self.pairs[0]
    }

    /// The pair of two laws, if it could be fitted.
    pub fn pair(&self, axis: AxisLaw, lobe: LobeLaw) -> Option<&PairFit> {
        self.pairs.iter().find(|pair| pair.axis_law == axis && pair.lobe_law == lobe)
    }

    /// Each law on the axis with the best lobe, and the share of the on-axis variance that it explains.
    pub fn axis_laws(&self) -> Vec<(&PairFit, f64)> {
        let pairs = AxisLaw::ALL.into_iter().filter_map(|law| self.pair(law, self.best().lobe_law));
        pairs.map(|pair| (pair, self.profile.on_axis_r_squared(pair))).collect()
    }

    /// Each lobe with the best law on the axis, and the share of the variance about the axis that it explains.
    pub fn lobe_laws(&self) -> Vec<(&PairFit, f64)> {
        let pairs = LobeLaw::ALL.into_iter().filter_map(|law| self.pair(self.best().axis_law, law));
        pairs.map(|pair| (pair, self.profile.lobe_r_squared(pair))).collect()
    }

    /// A transducer file of the best pair, for rig files. Its pressure is relative, because the gain from pressure to
    /// reading is unknown.
    pub fn transducer_file(&self, name: &str, source: &str) -> TransducerFile {
        let best = self.best();
        let (transducer, radius_m) =
            described_transducer((best.axis_law, &best.axis_free), (&best.lobe, &best.lobe_free));
        let radius_m = radius_m.and_then(|radius_m| Positive::new(radius_m).ok());
        TransducerFile::describing(name, source, radius_m, transducer)
    }
}
