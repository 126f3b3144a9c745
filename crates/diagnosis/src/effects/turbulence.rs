//! Random phases along the paths: the coherent part fades with distance, and a speckle is added that differs from
//! reading to reading.
//!
//! The phase of a path of length d through many eddies is normal with variance s² d (Ostashev and Wilson, *Acoustics in Moving
//! Inhomogeneous Media*, chapter 7): coherent amplitudes fade as exp(-s² d/2), and the power that they lose is the
//! speckle's. It changes the readings' variance more than their mean. Where the phases of the paths change by little and each by
//! itself, the speckle stands across what the paths bring, and a focus hardly flickers; where sound is scattered many times it
//! is alike in both quadratures. Both are tried.

use fieldgap_acoustics::{FieldSum, Simulator};

use crate::effect_id::EffectId;
use crate::model::effect::{
    AttenuatedSums, Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement,
    Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;
use crate::statistics::fluctuation::Fluctuation;
use crate::statistics::scatter::Scatter;

/// The effect.
pub(crate) struct Turbulence;

/// The choice of phases that change a little, each path by itself.
pub(crate) const OF_PATHS: Choice = Choice::Law(0);

/// The choice of sound that is scattered many times.
const CIRCULAR: Choice = Choice::Law(1);

impl Effect for Turbulence {
    fn id(&self) -> EffectId {
        EffectId::Turbulence
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.05, least: 0.0, most: 6.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::PositionJitter],
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators model still air of one temperature only; keep draughts and heat sources away",
        )
    }

    fn choices(&self) -> Vec<Choice> {
        vec![OF_PATHS, CIRCULAR]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        // Its square acts: at zero there is no slope to follow.
        vec![vec![0.05], vec![0.2], vec![1.0]]
    }

    fn begins_flat(&self, _believed: &Context) -> bool {
        true
    }

    fn scatters_repeats(&self) -> bool {
        true
    }

    fn changes_scatter(&self, at: Setting<'_>) -> bool {
        at.values[0] > 0.0
    }

    fn most(&self, scatter: &Scatter, _context: &Context) -> Vec<f64> {
        vec![scatter.most_turbulence]
    }

    fn fluctuation(&self, values: &[f64], choice: &Choice) -> Option<(f64, Fluctuation)> {
        let cause = match *choice == CIRCULAR {
            true => Fluctuation::Circular,
            false => Fluctuation::OfPaths,
        };
        Some((values[0], cause))
    }

    /// The coherent part of each path fades as exp(-s² d / 2), its square as exp(-2 s² d); what it loses is the speckle's.
    fn scintillating(&self, at: Setting<'_>, sums: &AttenuatedSums<'_>) -> Option<Vec<Pressure>> {
        if at.values[0] == 0.0 {
            return None;
        }
        let faded_np_m = 0.5 * at.values[0] * at.values[0];
        let [whole, steady] = [0.0, 1.0].map(|times| sums(times * faded_np_m));
        let twice = match *at.choice == CIRCULAR {
            true => steady.clone(),
            false => sums(2.0 * faded_np_m),
        };
        let pressure = |((steady, whole), twice): ((FieldSum, FieldSum), FieldSum)| Pressure {
            coherent: steady.field,
            speckle: (whole.incoherent_power - steady.incoherent_power).max(0.0),
            speckle_square: twice.square - steady.square,
        };
        Some(steady.into_iter().zip(whole).zip(twice).map(pressure).collect())
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let sentence = format!(
            "turbulent air makes phases fluctuate by {:.2} ± {:.2} rad over one metre",
            fitted[0].value, fitted[0].error
        );
        Finding::new([("rad_per_sqrt_m", fitted[0].real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use num_complex::Complex64;

    /// Of one path of length d the coherent part is exp(-s² d/2), and the rest of its power is scattered.
    #[test]
    fn the_power_that_the_coherent_part_loses_is_the_speckles() {
        let bench = Bench::new();
        let (s, d) = (2.0, 0.3);
        let sums = |attenuation_np_m: f64| {
            let field = Complex64::from((-attenuation_np_m * d).exp());
            vec![FieldSum { field, incoherent_power: field.norm_sqr(), square: field * field }]
        };
        for choice in [OF_PATHS, CIRCULAR] {
            let values = [s];
            let at = Setting { choice: &choice, ..bench.at(&values) };
            let found = Turbulence.scintillating(at, &sums).expect("it scatters")[0];
            assert!((found.coherent.re - (-0.5 * s * s * d).exp()).abs() < 1e-12);
            assert!((found.coherent.norm_sqr() + found.speckle - 1.0).abs() < 1e-12);
        }
        assert!(Turbulence.scintillating(bench.at(&[0.0]), &sums).is_none());
    }
}
