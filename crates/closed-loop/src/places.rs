//! Places spread evenly in a box: a Halton sequence in bases 2, 3 and 5 (J. H. Halton, Numer. Math. 2, 84, 1960).
//!
//! Its first n places fill the box evenly for every n, so that a later round goes on where an earlier one ended.

use fieldgap_acoustics::Vec3;
use fieldgap_records::BoxMm;

/// Bases along x, y and z.
const BASES: [u32; 3] = [2, 3, 5];

/// Places in a box, metres, from the given number of the sequence on.
pub(crate) fn places_m(within: &BoxMm, first: usize) -> impl Iterator<Item = Vec3> {
    let (least, size) = (within.least, within.most - within.least);
    (first..).map(move |number| {
        let fractions = Vec3::from(BASES.map(|base| radical_inverse(number as u32 + 1, base)));
        rounded_m(least + size.component_mul(&fractions))
    })
}

/// Millimetres as metres, rounded to a hundredth of a millimetre: plans are read by people, and no robot here is finer.
pub(crate) fn rounded_m(at_mm: Vec3) -> Vec3 {
    at_mm.map(|mm| (mm * 100.0).round() / 1e5)
}

/// The digits of a number behind the point, in reverse order; in (0, 1).
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut inverse, mut place) = (0.0, 1.0 / f64::from(base));
    while number > 0 {
        inverse += f64::from(number % base) * place;
        number /= base;
        place /= f64::from(base);
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_numbers_are_those_of_the_sequence() {
        let of_base = |base| [1, 2, 3, 4, 5].map(|number| radical_inverse(number, base));
        assert_eq!(of_base(2), [0.5, 0.25, 0.75, 0.125, 0.625]);
        let ninths = [3.0, 6.0, 1.0, 4.0, 7.0].map(|ninths| ninths / 9.0);
        assert!(of_base(3).iter().zip(ninths).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn every_eighth_of_a_box_gets_its_share() {
        let within =
            BoxMm { least: Vec3::new(-40.0, -40.0, 50.0), most: Vec3::new(40.0, 40.0, 150.0) };
        for first in [0, 100] {
            let mut counts = [0; 8];
            for at_m in places_m(&within, first).take(120) {
                let above =
                    (at_m * 1e3 - (within.least + within.most) / 2.0).map(|d| usize::from(d > 0.0));
                counts[above.x + 2 * above.y + 4 * above.z] += 1;
            }
            assert!(counts.iter().all(|count| (11..=19).contains(count)), "{counts:?}");
        }
    }
}
