//! Arrays of many shapes, which the set-up knows rightly.

use std::f64::consts::TAU;
use std::num::NonZeroU32;

use super::super::laboratory::FREQUENCY_HZ;
use super::super::random_sequence::RandomSequence;
use fieldgap_acoustics::Element;
use fieldgap_input::{Frequency, Gap, Length};
use fieldgap_records::{ArraySection, Layout, Rims};

/// Diameters of common transducers, mm.
const DIAMETERS_MM: [f64; 4] = [10.0, 10.5, 12.7, 16.0];

/// Gaps between their rims, mm.
const SPACINGS_MM: [f64; 4] = [0.0, 0.0, 0.5, 1.0];

/// Sides of square arrays, the common ones more often; 32 is the largest that is built of single transducers.
const SIDES: [u32; 12] = [4, 4, 6, 6, 6, 6, 8, 8, 8, 16, 16, 32];

/// An array.
pub(super) struct DrawnLayout {
    pub section: ArraySection,
    /// Diameter of an element's housing, mm.
    pub diameter_mm: f64,
}

/// An array and the name of its shape.
pub(super) fn draw(random: &mut RandomSequence) -> (DrawnLayout, &'static str) {
    let diameter_mm = DIAMETERS_MM[random.index(DIAMETERS_MM.len())];
    let spacing_mm = SPACINGS_MM[random.index(SPACINGS_MM.len())];
    let rims = Rims {
        diameter_mm: Length::new(diameter_mm).expect("above zero"),
        spacing_mm: Gap::new(spacing_mm).expect("not below zero"),
    };
    let shape = random.uniform(0.0, 1.0);
    let whole = |number: usize| NonZeroU32::new(number as u32).expect("above zero");
    let (section, name) = if shape < 0.45 {
        let side = whole(SIDES[random.index(SIDES.len())] as usize);
        (lattice(Layout::Square { columns: side, rows: side, rims }), "square")
    } else if shape < 0.57 {
        let (columns, rows) = (whole(5 + random.index(8)), whole(2 + random.index(3)));
        (lattice(Layout::Square { columns, rows, rims }), "rectangle")
    } else if shape < 0.77 {
        let rings = 3 + random.index(3) as u32;
        (lattice(Layout::Hexagonal { rings, rims }), "hexagonal")
    } else if shape < 0.87 {
        (of_elements(rings(rims.pitch_m(), random)), "ring")
    } else {
        (of_elements(disk(rims.pitch_m(), random)), "disk")
    };
    (DrawnLayout { section, diameter_mm }, name)
}

fn lattice(layout: Layout) -> ArraySection {
    ArraySection::of_layout(carrier(), layout).expect("every lattice above has elements")
}

fn of_elements(elements: Vec<Element>) -> ArraySection {
    ArraySection::of_elements(carrier(), elements).expect("there are several")
}

fn carrier() -> Frequency {
    Frequency::new(FREQUENCY_HZ).expect("ultrasound")
}

/// One to three rings about one centre without an element in it, each turned by an angle of its own.
fn rings(pitch_m: f64, random: &mut RandomSequence) -> Vec<Element> {
    let first = 12 + random.index(9);
    let mut elements = Vec::new();
    let mut radius_m = pitch_m * first as f64 / TAU * random.uniform(1.02, 1.3);
    for _ in 0..=random.index(3) {
        let count = (TAU * radius_m / (1.02 * pitch_m)) as usize;
        let turn = random.angle_rad();
        elements.extend((0..count).map(|n| {
            let (sin, cos) = (turn + TAU * n as f64 / count as f64).sin_cos();
            Element::at(micrometre(radius_m * cos), micrometre(radius_m * sin))
        }));
        radius_m += pitch_m * random.uniform(1.02, 1.3);
    }
    elements
}

/// Elements at random places in a disc, none nearer to another than the pitch.
fn disk(pitch_m: f64, random: &mut RandomSequence) -> Vec<Element> {
    let count = 20 + random.index(61);
    // Discs placed at random one after another fill at most 55 % of an area (Feder, J. Theor. Biol. 87, 237, 1980); these fill 35 %.
    let mut radius_m = 0.5 * pitch_m * (count as f64 / 0.35).sqrt();
    let mut elements: Vec<Element> = Vec::new();
    while elements.len() < count {
        let (sin, cos) = random.angle_rad().sin_cos();
        let away_m = radius_m * random.uniform(0.0, 1.0).sqrt();
        let drawn = Element::at(micrometre(away_m * cos), micrometre(away_m * sin));
        let is_free = |other: &Element| (other.centre_m - drawn.centre_m).norm() > pitch_m;
        if elements.iter().all(is_free) {
            elements.push(drawn);
        } else {
            // A crowded disc grows until there is room.
            radius_m *= 1.0002;
        }
    }
    elements
}

fn micrometre(metres: f64) -> f64 {
    (metres * 1e6).round() / 1e6
}
