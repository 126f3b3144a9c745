//! The uncertainty that a record states, as departures of the set-up that effects make.

use fieldgap_records::{ScanSetup, SetupUncertainty};

use super::effect;
use crate::effect_id::EffectId;
use crate::limits::SHIFT_PRIOR_M;
use crate::model::effect::Choice;
use crate::model::instance::Instance;
use crate::model::stated_uncertainty::{StatedDeparture, StatedUncertainty};

/// Standard uncertainty of a height by a tape measure, mm.
const TAPE_MM: f64 = 5.0;

/// Those of a set-up with an array of so many elements. What is stated as zero does not depart, nor does a plane so high that the catalogue's reflection has no
/// such height.
pub(crate) fn stated_uncertainty(setup: &ScanSetup, elements: usize) -> StatedUncertainty {
    let Some(stated) = setup.uncertainty else { return StatedUncertainty::default() };
    let SetupUncertainty { element_gain, element_phase_rad, origin_mm, .. } = stated;
    let SetupUncertainty { temperature_k, level_drift, reflection, .. } = stated;
    let of_elements = |id, sd: f64| departure(id, vec![(0.0, sd); elements]);
    let speed = |kelvin: f64| {
        // c² is proportional to the absolute temperature.
        let c_m_s = setup.medium.medium().speed_of_sound_m_s;
        let at_k = 273.15 * (c_m_s / 331.3).powi(2);
        departure(EffectId::SoundSpeed, vec![(1.0, 0.5 * kelvin / at_k)])
    };
    let departures = [
        temperature_k.map(|kelvin| speed(kelvin.get())),
        element_gain.map(|sd| of_elements(EffectId::ElementGain, sd.get())),
        element_phase_rad.map(|sd| of_elements(EffectId::ElementPhase, sd.get())),
        reflection.map(|plane| {
            // Each quadrature has half of the mean square.
            let quadrature = (0.0, plane.coefficient.get() / 2f64.sqrt());
            let height = (plane.height_mm.get(), TAPE_MM);
            departure(EffectId::Reflection, vec![height, quadrature, quadrature])
        }),
        level_drift.map(|sd| departure(EffectId::GainDrift, vec![(0.0, sd.get())])),
    ];
    let can_depart = |departure: &StatedDeparture| {
        let Instance { effect, choice } = &departure.instance;
        let ranges = effect.parameters_of(choice).iter().map(|p| p.least..=p.most);
        departure.priors.iter().all(|(_, sd)| *sd > 0.0)
            && departure.means().iter().zip(ranges).all(|(mean, range)| range.contains(mean))
    };
    StatedUncertainty {
        origin_m: origin_mm.map(|mm| 1e-3 * mm.get()).filter(|m| *m > SHIFT_PRIOR_M.get()),
        departures: departures.into_iter().flatten().filter(can_depart).collect(),
    }
}

fn departure(id: EffectId, priors: Vec<(f64, f64)>) -> StatedDeparture {
    let effect = effect(id);
    // The first law: of a drift that is linear in time.
    let choice = effect.choices().first().cloned().unwrap_or(Choice::None);
    StatedDeparture { instance: Instance { effect, choice }, priors }
}
