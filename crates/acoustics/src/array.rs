//! Arrangements of elements.
//!
//! Every regular layout takes the pitch, the distance between the centres of neighbours. Elements are numbered from 0 in the order
//! given with each layout.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::transducer::DescribedTransducer;
use super::{Element, Vec3};

/// Random positions tried for one element before the array is started again: its first elements may have left no room.
const DRAWS: usize = 1_000;

/// Starts of a random array before it is given up as too crowded.
const STARTS: usize = 1_000;

/// Why an arrangement of elements cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// No elements.
    #[error("an array needs at least one element")]
    Empty,
    /// More rings than the thesis defines.
    #[error(
        "the thesis's hexagonal layout has 0 to 3 rings, not {0}; `hexagonal` takes any number"
    )]
    RingsOfThesis(usize),
    /// The random layout found no free position.
    #[error(
        "no room for {count} elements without overlap in {STARTS} tries; use more elements (the square grows with their number) or \
         a smaller spacing"
    )]
    Crowded {
        /// Elements asked for.
        count: usize,
    },
}

/// One or more elements, in their numbered order.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    elements: Vec<Element>,
    transducer: Option<Arc<DescribedTransducer>>,
}

impl Array {
    /// Takes any elements.
    ///
    /// # Errors
    /// [`LayoutError::Empty`] if there are none.
    pub fn from_elements(elements: Vec<Element>) -> Result<Self, LayoutError> {
        if elements.is_empty() {
            Err(LayoutError::Empty)
        } else {
            Ok(Self { elements, transducer: None })
        }
    }

    /// A rectangular lattice, row by row from the corner with the largest y and the smallest x.
    ///
    /// # Errors
    /// [`LayoutError::Empty`] if `columns` or `rows` is zero.
    pub fn square(columns: usize, rows: usize, pitch_m: f64) -> Result<Self, LayoutError> {
        let centred = |index: usize, count: usize| index as f64 - (count as f64 - 1.0) / 2.0;
        Self::from_elements(
            (0..rows)
                .flat_map(|row| {
                    (0..columns).map(move |column| {
                        Element::at(
                            pitch_m * centred(column, columns),
                            -pitch_m * centred(row, rows),
                        )
                    })
                })
                .collect(),
        )
    }

    /// One row along x, from the smallest x.
    ///
    /// # Errors
    /// [`LayoutError::Empty`] if `count` is zero.
    pub fn linear(count: usize, pitch_m: f64) -> Result<Self, LayoutError> {
        Self::square(count, 1, pitch_m)
    }

    /// A triangular lattice of rings about the centre. Ring k has 6 k elements, clockwise from the corner at 90°.
    pub fn hexagonal(rings: usize, pitch_m: f64) -> Self {
        let corner = |ring: usize, index: usize| {
            let angle = (90.0 - 60.0 * index as f64).to_radians();
            ring as f64 * pitch_m * Vec3::new(angle.cos(), angle.sin(), 0.0)
        };
        let mut elements = vec![Element::at(0.0, 0.0)];
        for ring in 1..=rings {
            for side in 0..6 {
                let (from, to) = (corner(ring, side), corner(ring, side + 1));
                elements.extend((0..ring).map(|step| {
                    let place = from.lerp(&to, step as f64 / ring as f64);
                    Element::at(place.x, place.y)
                }));
            }
        }
        Self { elements, transducer: None }
    }

    /// The hexagonal layout of the thesis's listing, in its order. Between the corners its third ring lies on a circle and not on the
    /// triangular lattice, so that neighbours touch.
    ///
    /// # Errors
    /// [`LayoutError::RingsOfThesis`] above three rings, which the listing does not define.
    pub fn hexagonal_thesis(rings: usize, pitch_m: f64) -> Result<Self, LayoutError> {
        if rings > 3 {
            return Err(LayoutError::RingsOfThesis(rings));
        }
        let mut elements = vec![Element::at(0.0, 0.0)];
        for ring in 1..=rings {
            let step_deg = 60.0 / ring as f64;
            // The listing starts each ring so that its first corner is at 90 degrees, counting clockwise.
            let sides_before_corner = ring - 1;
            let side_radius = match ring {
                2 => pitch_m * 3f64.sqrt(),
                _ => 0.5 * pitch_m / 10f64.to_radians().sin(),
            };
            for index in 0..6 * ring {
                let at_corner = index % ring == sides_before_corner;
                let distance = if at_corner { ring as f64 * pitch_m } else { side_radius };
                let angle =
                    (90.0 + step_deg * (sides_before_corner as f64 - index as f64)).to_radians();
                elements.push(Element::at(distance * angle.cos(), distance * angle.sin()));
            }
        }
        Ok(Self { elements, transducer: None })
    }

    /// Elements at random positions, without overlap, in a square of side `count` times half the pitch.
    ///
    /// The same seed gives the same array.
    ///
    /// # Errors
    /// [`LayoutError::Empty`], or [`LayoutError::Crowded`] if no free position is found.
    pub fn random(count: usize, pitch_m: f64, seed: u64) -> Result<Self, LayoutError> {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        let half_side = 0.25 * count as f64 * pitch_m;
        let mut place_all = || {
            let mut elements: Vec<Element> = Vec::with_capacity(count);
            while elements.len() < count {
                let free = (0..DRAWS).find_map(|_| {
                    let mut along = || half_side * (2.0 * draws.random::<f64>() - 1.0);
                    let drawn = Element::at(along(), along());
                    let apart = |placed: &Element| (placed.centre_m - drawn.centre_m).norm();
                    elements.iter().all(|placed| apart(placed) > pitch_m).then_some(drawn)
                })?;
                elements.push(free);
            }
            Some(elements)
        };
        let elements =
            (0..STARTS).find_map(|_| place_all()).ok_or(LayoutError::Crowded { count })?;
        Self::from_elements(elements)
    }

    /// The same array with a description of its transducers.
    pub fn with_transducer(self, transducer: Arc<DescribedTransducer>) -> Self {
        Self { transducer: Some(transducer), ..self }
    }

    /// The description of its transducers, where there is one.
    pub fn transducer(&self) -> Option<&DescribedTransducer> {
        self.transducer.as_deref()
    }

    /// The description of its transducers, to be shared with another array.
    pub fn shared_transducer(&self) -> Option<Arc<DescribedTransducer>> {
        self.transducer.clone()
    }

    /// The elements, in their numbered order; at least one.
    pub fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// How many elements there are; at least one.
    #[allow(clippy::len_without_is_empty)] // an array is never empty
    pub fn len(&self) -> usize {
        self.elements.len()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn nearest_distance(array: &Array) -> f64 {
        let elements = array.elements();
        let mut nearest = f64::INFINITY;
        for (i, a) in elements.iter().enumerate() {
            for b in &elements[..i] {
                nearest = nearest.min((a.centre_m - b.centre_m).norm());
            }
        }
        nearest
    }

    #[test]
    fn a_square_starts_at_the_top_left_and_continues_along_the_row() {
        let array = Array::square(6, 6, 10.5e-3).expect("not empty");
        let at = |n: usize| array.elements()[n].centre_m * 1e3;
        assert!((at(0) - Vec3::new(-26.25, 26.25, 0.0)).norm() < 1e-12);
        assert!((at(1) - Vec3::new(-15.75, 26.25, 0.0)).norm() < 1e-12);
        assert!((at(35) - Vec3::new(26.25, -26.25, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn a_hexagon_ring_starts_at_ninety_degrees_and_goes_clockwise() {
        let array = Array::hexagonal(2, 1.0);
        assert_eq!(array.len(), 19);
        assert!((array.elements()[1].centre_m - Vec3::new(0.0, 1.0, 0.0)).norm() < 1e-12);
        assert!((array.elements()[7].centre_m - Vec3::new(0.0, 2.0, 0.0)).norm() < 1e-12);
        let side = array.elements()[8].centre_m;
        assert!((side.norm() - 3f64.sqrt()).abs() < 1e-12 && side.x > 0.0);
    }

    #[test]
    fn the_third_ring_of_the_thesis_lies_off_the_lattice() {
        let thesis = Array::hexagonal_thesis(3, 10.5e-3).expect("three rings");
        assert_eq!(thesis.len(), 37);
        let side = thesis.elements()[19].centre_m;
        let angle = side.y.atan2(side.x).to_degrees();
        assert!((angle - 130.0).abs() < 1e-9, "{angle}");
        assert!((side.norm() * 1e3 - 5.25 / 10f64.to_radians().sin()).abs() < 1e-9);
        // On the lattice the same element is at a distance of sqrt(28) radii.
        let lattice = Array::hexagonal(3, 10.5e-3);
        assert!((lattice.elements()[20].centre_m.norm() * 1e3 - 28f64.sqrt() * 5.25).abs() < 1e-9);
        assert!(Array::hexagonal_thesis(4, 1.0).is_err());
    }

    proptest! {
        #[test]
        fn lattices_are_centred_and_keep_their_pitch(columns in 1usize..9, rows in 1usize..9, pitch_mm in 1.0..20.0f64) {
            let pitch_m = pitch_mm * 1e-3;
            for array in [Array::square(columns, rows, pitch_m).expect("not empty"), Array::hexagonal(rows, pitch_m)] {
                let centre: Vec3 = array.elements().iter().map(|e| e.centre_m).sum();
                prop_assert!(centre.norm() < 1e-12 * array.len() as f64);
                if array.len() > 1 {
                    prop_assert!((nearest_distance(&array) - pitch_m).abs() < 1e-9);
                }
            }
        }

        #[test]
        fn a_random_array_does_not_overlap_and_follows_its_seed(count in 2usize..60, seed: u64) {
            let array = Array::random(count, 10.5e-3, seed).expect("room enough");
            prop_assert!(nearest_distance(&array) > 10.5e-3);
            prop_assert_eq!(&array, &Array::random(count, 10.5e-3, seed).expect("room enough"));
        }
    }
}
