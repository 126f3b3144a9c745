//! The places of a map in an order of which every beginning is spread evenly.
//!
//! Multiples of the powers of 1/g, g⁴ = g + 1, modulo one, fill a cube as multiples of the golden section fill a line. (The sequence is M. Roberts's;
//! that it is the one of slowest clumping in three dimensions is a conjecture. A line of the golden section through all places of a grid, row by row, would
//! leave whole columns out.) Each goes to the column, row and height that it falls on.

use fieldgap_records::Layers;

/// The root of g⁴ = g + 1.
const G: f64 = 1.220_744_084_605_759_6;

/// Draws for each place of a map after which those that are left follow in their own order.
const DRAWS: usize = 12;

/// Numbers of the places of `foci` maps on one grid, each once: focus by focus, height by height, row by row. The foci take turns.
pub(crate) fn evenly(grid: &Layers, foci: usize) -> Vec<usize> {
    let counts = [grid.x.count, grid.y.count, grid.z_mm.len()];
    let places = grid.points();
    let mut taken = vec![false; places * foci];
    let mut order = Vec::with_capacity(taken.len());
    for draw in 0..DRAWS * taken.len() {
        let mut power = 1.0;
        let [x, y, z] = counts.map(|count| {
            power /= G;
            ((((draw + 1) as f64 * power).fract() * count as f64) as usize).min(count - 1)
        });
        let number = (draw % foci) * places + (z * counts[1] + y) * counts[0] + x;
        if !std::mem::replace(&mut taken[number], true) {
            order.push(number);
        }
    }
    let left = taken.iter().enumerate().filter(|(_, taken)| !**taken);
    order.extend(left.map(|(number, _)| number));
    order
}

#[cfg(test)]
mod tests {
    use fieldgap_records::Axis;
    use proptest::prelude::*;

    use super::*;

    fn grid(columns: usize, rows: usize, heights: usize) -> Layers {
        let axis = |count| Axis { first_mm: 0.0, step_mm: 1.0, count };
        Layers { x: axis(columns), y: axis(rows), z_mm: (0..heights).map(|n| n as f64).collect() }
    }

    proptest! {
        #[test]
        fn every_place_comes_once(
            columns in 1usize..20, rows in 1usize..20, heights in 1usize..5, foci in 1usize..4,
        ) {
            let mut order = evenly(&grid(columns, rows, heights), foci);
            order.sort_unstable();
            prop_assert_eq!(order, (0..columns * rows * heights * foci).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_sixteenth_of_a_plane_gets_its_share_of_any_beginning() {
        let order = evenly(&grid(36, 36, 2), 1);
        for from in [0, 150] {
            let mut shares = [0; 32];
            for number in &order[from..from + 160] {
                let (z, y, x) = (number / 1296, number / 36 % 36, number % 36);
                shares[z * 16 + y / 9 * 4 + x / 9] += 1;
            }
            // Five each.
            assert!(shares.iter().all(|share| (2..=9).contains(share)), "{shares:?}");
        }
    }
}
