//! The drive of an element reaches its neighbours too: through the board, the supply or the wiring.

use num_complex::Complex64;
use serde::Deserialize;

use super::Effect;
use fieldgap_acoustics::Element;
use fieldgap_input::{Exact, Finite};

/// Elements nearer to each other than this, over the distance of the nearest two, are neighbours.
const NEIGHBOURS: f64 = 1.1;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Crosstalk {
    /// Amplitude at a neighbour over that of the driven element, real and imaginary part.
    coefficient: Exact<Finite, 2>,
}

impl Effect for Crosstalk {
    fn emit(&self, weights: &mut [Complex64], elements: &[Element]) {
        let [re, im] = self.coefficient.map(Finite::get);
        let coefficient = Complex64::new(re, im);
        let apart_m2 =
            |a: usize, b: usize| (elements[a].centre_m - elements[b].centre_m).norm_squared();
        let pairs = || (0..elements.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let nearest_m2 = pairs().map(|(a, b)| apart_m2(a, b)).fold(f64::INFINITY, f64::min);
        let driven = weights.to_vec();
        for (a, b) in pairs() {
            if apart_m2(a, b) < NEIGHBOURS * NEIGHBOURS * nearest_m2 {
                weights[a] += coefficient * driven[b];
                weights[b] += coefficient * driven[a];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;
    use fieldgap_acoustics::Array;

    #[test]
    fn the_neighbours_of_an_element_driven_alone_emit_too() {
        let crosstalk: Crosstalk = effect("coefficient = [0.1, 0.02]");
        let square = Array::square(6, 6, 10.5e-3).expect("not empty");
        for (array, alone, neighbours) in [
            (square, 14, vec![8, 13, 14, 15, 20]),
            (Array::hexagonal(2, 10.5e-3), 0, vec![0, 1, 2, 3, 4, 5, 6]),
        ] {
            let mut weights = vec![Complex64::ZERO; array.len()];
            weights[alone] = Complex64::ONE;
            crosstalk.emit(&mut weights, array.elements());
            let emitting: Vec<usize> =
                (0..array.len()).filter(|&n| weights[n].norm() > 0.0).collect();
            assert_eq!(emitting, neighbours);
            assert_eq!(weights[neighbours[1]], Complex64::new(0.1, 0.02));
        }
    }
}
