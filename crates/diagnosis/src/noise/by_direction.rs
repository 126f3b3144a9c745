//! Play or lag that repeats show, found before these tell how readings scatter.
//!
//! A row that is flown again in the other direction differs from the first time by the play or by twice the lag. Such a difference follows the
//! slope of the field along the way and changes sign with it. A scattered position makes differences as large where the field is as steep, but
//! of either sign. Either effect is fitted to the differences of repeats that were not approached alike: errors of level and pose hardly
//! change these.

use std::collections::HashSet;

use crate::effect_id::EffectId;
use crate::effects::effect;
use crate::limits::FEWEST_REPEATS;
use crate::model::effect::{Choice, Context};
use crate::model::forward_model::ForwardModel;
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;
use crate::noise::repeats::{SHOWN, repeats, usual_noise};

/// Steps of the fit: the differences are nearly linear in a small part of a wavelength.
const STEPS: usize = 3;

/// The model with the play or the lag that repeats show, whichever explains more, if either.
pub(crate) fn with_play_or_lag<'c>(
    model: ForwardModel<'c>,
    observations: &Observations,
    nuisance: &[Nuisance],
    context: &'c Context,
) -> ForwardModel<'c> {
    let differences = Differences::of(observations);
    if differences.pairs.len() < FEWEST_REPEATS {
        return model;
    }
    let found = [EffectId::Backlash, EffectId::Lag]
        .into_iter()
        .filter_map(|id| differences.explained_by(id, &model, nuisance, context))
        .reduce(|best, other| if other.left < best.left { other } else { best });
    match found {
        Some(found) => model.and(&found.instance, &[found.value], context),
        None => model,
    }
}

/// Readings of one place that were not approached alike.
struct Differences {
    /// These readings alone.
    observations: Observations,
    /// Numbers of both among them, in their order, and what their difference usually scatters by.
    pairs: Vec<([usize; 2], f64)>,
}

/// An effect that explains differences.
struct Found {
    instance: Instance,
    value: f64,
    /// Sum of the squares that it leaves.
    left: f64,
}

impl Differences {
    fn of(observations: &Observations) -> Self {
        let mut wanted = HashSet::new();
        for (scan_number, scan) in observations.scans.iter().enumerate() {
            for repeat in repeats(scan).into_iter().filter(|repeat| !repeat.is_alike) {
                let visits = &scan.drives[repeat.drive].visits;
                wanted.extend(repeat.visits.map(|index| (scan_number, visits[index].number)));
            }
        }
        let observations = observations.part(|scan, visit| wanted.contains(&(scan, visit.number)));
        let mut pairs = Vec::new();
        let mut read = 0;
        for scan in &observations.scans {
            let mut firsts = Vec::new();
            for drive in &scan.drives {
                firsts.push(read);
                read += drive.readings.len();
            }
            for repeat in repeats(scan).into_iter().filter(|repeat| !repeat.is_alike) {
                let drive = &scan.drives[repeat.drive];
                let readings = repeat.visits.map(|index| drive.readings[index]);
                let variances = repeat.visits.map(|index| drive.visits[index].variance);
                let level = 0.5 * (readings[0] + readings[1]);
                let noise = usual_noise(scan, level) * (variances[0] + variances[1]).sqrt();
                pairs.push((repeat.visits.map(|index| firsts[repeat.drive] + index), noise));
            }
        }
        Self { observations, pairs }
    }

    /// The differences of these readings, on a scale on which they usually scatter by one.
    fn scaled(&self, readings: &[f64]) -> Vec<f64> {
        self.pairs
            .iter()
            .map(|([before, after], noise)| (readings[*after] - readings[*before]) / noise)
            .collect()
    }

    /// The value of an effect of one parameter that explains them, if it clearly differs from none.
    fn explained_by(
        &self,
        id: EffectId,
        model: &ForwardModel<'_>,
        nuisance: &[Nuisance],
        context: &Context,
    ) -> Option<Found> {
        let instance = Instance { effect: effect(id), choice: Choice::None };
        let parameter = instance.effect.parameters()[0];
        let seen = self.scaled(&self.observations.readings());
        let expected = |value: f64| {
            let model = model.and(&instance, &[value], context);
            self.scaled(&model.expected_readings(&self.observations, nuisance))
        };
        let sum = |of: &dyn Fn(usize) -> f64| (0..seen.len()).map(of).sum::<f64>();
        let mut value = parameter.neutral;
        let mut now = expected(value);
        let unexplained = sum(&|n| (seen[n] - now[n]).powi(2));
        let mut slopes = Vec::new();
        for _ in 0..STEPS {
            let beside = expected(value + parameter.scale);
            slopes = now.iter().zip(&beside).map(|(a, b)| (b - a) / parameter.scale).collect();
            let step = sum(&|n| slopes[n] * (seen[n] - now[n])) / sum(&|n| slopes[n].powi(2));
            value = (value + step).clamp(parameter.least, parameter.most);
            if !value.is_finite() {
                return None;
            }
            now = expected(value);
        }
        let left = sum(&|n| (seen[n] - now[n]).powi(2));
        // How readings scatter is not yet known, and a scattered position scatters most those of the greatest slopes: the error is estimated from what is left of
        // each (J. G. MacKinnon and H. White, J. Econometrics 29, 305, 1985, equation 13).
        let information = sum(&|n| slopes[n].powi(2));
        let variance = sum(&|n| {
            let leverage = slopes[n].powi(2) / information;
            (slopes[n] * (seen[n] - now[n]) / (1.0 - leverage)).powi(2)
        }) / information.powi(2);
        let is_shown = (value - parameter.neutral).abs() > SHOWN * variance.sqrt();
        (is_shown && left < unexplained).then_some(Found { instance, value, left })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Flown, nuisance};
    use crate::noise::settle::settle_scatter;

    /// The effects that the repeats show with their values, and the fluctuation that is left.
    fn shown(id: EffectId, value: f64, scatter_mm: f64) -> (Vec<(EffectId, f64)>, f64) {
        let Flown { bench, mut observations } = Flown::with(id, value, scatter_mm);
        let believed = ForwardModel::believed();
        let found =
            with_play_or_lag(believed.clone(), &observations, &[nuisance()], &bench.context);
        let effects = found.effects().map(|found| (found.effect.id(), found.setting().values[0]));
        let effects = effects.collect();
        settle_scatter(&mut observations, &believed, &[nuisance()], &bench.context, false);
        (effects, observations.scans[0].scatter.fluctuation)
    }

    #[test]
    fn rows_flown_in_both_directions_show_play_or_lag_and_no_scattered_position() {
        for (id, value, error) in [
            (EffectId::Backlash, 0.7, 0.05),
            (EffectId::Backlash, -0.4, 0.05),
            (EffectId::Lag, 5e-3, 0.5e-3),
        ] {
            let (effects, fluctuation) = shown(id, value, 0.0);
            let [(found, by)] = effects[..] else { panic!("{effects:?}") };
            assert!(found == id && (by - value).abs() < error, "{id} {value}: {effects:?}");
            assert_eq!(fluctuation, 0.0, "{id} {value}");
        }
    }

    #[test]
    fn a_scattered_position_is_no_play() {
        let (effects, fluctuation) = shown(EffectId::Backlash, 0.0, 0.4);
        assert!(effects.is_empty(), "{effects:?}");
        assert!((fluctuation / 0.4 - 1.0).abs() < 0.3, "{fluctuation}");
    }

    #[test]
    fn steady_repeats_show_neither() {
        assert_eq!(shown(EffectId::Backlash, 0.0, 0.0), (Vec::new(), 0.0));
    }
}
