//! The drive of each element reaches its neighbours too: through the board, the supply or the wiring.
//!
//! An element that is driven with the complex amplitude d emits that of d + c Σ d' over its neighbours (coupling of adjacent channels, as in
//! R. J. Mailloux, *Phased Array Antenna Handbook*, section 6.2, with one coefficient).

use fieldgap_acoustics::{Element, Simulator};
use num_complex::Complex64;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Observations;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Crosstalk;

/// Elements nearer to each other than this, over the distance of the nearest two, are neighbours: those along the rows of a lattice, and not
/// those across (1.41).
const NEIGHBOURS: f64 = 1.1;

const PART: Parameter = Parameter { neutral: 0.0, scale: 0.003, least: -0.5, most: 0.5 };

impl Effect for Crosstalk {
    fn id(&self) -> EffectId {
        EffectId::Crosstalk
    }

    /// Real and imaginary part of the coefficient.
    fn parameters(&self) -> &'static [Parameter] {
        &[PART, PART]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::ElementPhase],
            independent_check: Some(
                "an oscilloscope at a channel that is off shows what its neighbours send it",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "simulations drive each element alone; separate the channels' wires and supplies",
        )
    }

    fn can_act(&self, observations: &Observations) -> bool {
        observations.elements() > 1
    }

    fn couples(&self) -> bool {
        true
    }

    fn coupled(&self, at: Setting<'_>, phases_rad: &[f64], elements: &mut [Element]) {
        let coefficient = Complex64::new(at.values[0], at.values[1]);
        let nominal = at.context.believed.array.elements();
        let drives: Vec<Complex64> = nominal
            .iter()
            .zip(phases_rad)
            .map(|(element, phase_rad)| Complex64::from_polar(element.amplitude, *phase_rad))
            .collect();
        let mut received = vec![Complex64::ZERO; drives.len()];
        for &(one, other) in &*at.context.neighbours {
            received[one] += drives[other];
            received[other] += drives[one];
        }
        for ((element, drive), received) in elements.iter_mut().zip(&drives).zip(received) {
            // (A silent element has no drive to refer to: what it receives is left out.)
            if *drive != Complex64::ZERO {
                let change = 1.0 + coefficient * received / drive;
                element.amplitude *= change.norm();
                element.phase_rad += change.arg();
            }
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [re, im] = [fitted[0], fitted[1]];
        let coefficient = FittedParameter::Complex {
            value: [re.value, im.value],
            standard_error: [re.error, im.error],
        };
        let sentence = format!(
            "each element also emits {:.1} % of what its neighbours are driven with",
            100.0 * re.value.hypot(im.value)
        );
        Finding::new([("coefficient", coefficient)], sentence)
    }
}

/// Pairs of elements that are nearest to each other.
pub(crate) fn neighbours(elements: &[Element]) -> Vec<(usize, usize)> {
    let apart_m = |a: usize, b: usize| (elements[a].centre_m - elements[b].centre_m).norm();
    let pairs = || (0..elements.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    let nearest_m = pairs().map(|(a, b)| apart_m(a, b)).fold(f64::INFINITY, f64::min);
    pairs().filter(|&(a, b)| apart_m(a, b) < NEIGHBOURS * nearest_m).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    /// Driven alike, an element at a corner of a lattice has two neighbours, one at its edge three, one within it four.
    #[test]
    fn elements_driven_alike_gain_by_the_number_of_their_neighbours() {
        let bench = Bench::new();
        let mut elements = bench.believed().array.elements().to_vec();
        Crosstalk.coupled(bench.at(&[0.1, 0.0]), &[0.3; 16], &mut elements);
        for (n, neighbours) in [(0, 2.0), (1, 3.0), (5, 4.0), (15, 2.0)] {
            assert!((elements[n].amplitude - (1.0 + 0.1 * neighbours)).abs() < 1e-12, "{n}");
            assert!(elements[n].phase_rad.abs() < 1e-12);
        }
    }

    #[test]
    fn a_neighbour_in_quadrature_turns_the_phase() {
        let bench = Bench::new();
        let mut elements = bench.believed().array.elements().to_vec();
        // Element 0 has the neighbours 1 and 4.
        let mut phases_rad = [0.0; 16];
        (phases_rad[1], phases_rad[4]) = (0.5 * std::f64::consts::PI, 0.5 * std::f64::consts::PI);
        Crosstalk.coupled(bench.at(&[0.1, 0.0]), &phases_rad, &mut elements);
        assert!((elements[0].phase_rad - 0.2f64.atan()).abs() < 1e-12);
        assert!((elements[0].amplitude - 1.04f64.sqrt()).abs() < 1e-12);
    }
}
