//! The drive of an element reaches its neighbours too: through the board, the supply or the wiring.

use num_complex::Complex64;

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Element;

pub(super) const NAME: &str = "crosstalk";

#[derive(Debug, Clone, Copy)]
struct Crosstalk {
    /// Complex amplitude at a neighbour, relative to that of the driven element.
    share: Complex64,
}

pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let angle_rad = random.angle_rad();
    Draw::new(0.25, move |size| Crosstalk { share: Complex64::from_polar(size, angle_rad) })
}

/// Elements nearer to each other than this, over the distance of the nearest two, are neighbours.
const NEIGHBOURS: f64 = 1.1;

impl Unmodelled for Crosstalk {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let share = self.share;
        toml::toml! { share = [(share.re), (share.im)] }
    }

    fn emit(&self, weights: &mut [Complex64], elements: &[Element]) {
        let apart_m = |a: usize, b: usize| (elements[a].centre_m - elements[b].centre_m).norm();
        let pairs: Vec<_> = (0..elements.len()).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
        let nearest_m = pairs.iter().map(|&(a, b)| apart_m(a, b)).fold(f64::INFINITY, f64::min);
        let driven = weights.to_vec();
        for (a, b) in pairs {
            if apart_m(a, b) < NEIGHBOURS * nearest_m {
                weights[a] += self.share * driven[b];
                weights[b] += self.share * driven[a];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Array;

    #[test]
    fn the_four_neighbours_of_an_element_driven_alone_emit_too() {
        let array = Array::square(6, 6, 10.5e-3).expect("not empty");
        let mut weights = vec![Complex64::ZERO; 36];
        weights[14] = Complex64::ONE;
        Crosstalk { share: Complex64::new(0.1, 0.02) }.emit(&mut weights, array.elements());
        let emitting: Vec<usize> = (0..36).filter(|&n| weights[n].norm() > 0.0).collect();
        assert_eq!(emitting, [8, 13, 14, 15, 20]);
        assert_eq!(weights[8], Complex64::new(0.1, 0.02));
    }
}
