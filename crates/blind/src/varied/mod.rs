//! Laboratories as they differ: radiators, arrays, drives, paths of the robot, receivers and noise; and what is a little wrong in all of
//! them.
//!
//! The ranges are those of published set-ups of airborne arrays at 40 kHz: 16 to some hundred transducers of 10 to 16 mm (Marzo, Barnes
//! and Drinkwater, Rev. Sci. Instrum. 88, 085105, 2017; Hirayama and others, Nature 575, 320, 2019), hydrophone-like scans of 30 to some
//! ten thousand points, and converters of 8 to 14 bits as oscilloscopes have them.

mod imperfections;
mod layouts;
mod paths;
mod radiators;
mod receivers;

use std::collections::BTreeMap;

use super::laboratory::{FREQUENCY_HZ, Laboratory, tenths_of_micrometre};
use super::random_sequence::RandomSequence;
pub(super) use imperfections::{beyond_the_ordinary, make_imperfect};
use paths::Path;

use fieldgap_acoustics::Vec3;
use fieldgap_records::FocusSection;

/// Fewest and most readings of a scan.
const READINGS: (f64, f64) = (30.0, 50_000.0);

/// Most products of elements and readings of a scan. It bounds the time in which a set is made.
const MOST_PATHS: usize = 1_800_000;

/// Share of the laboratories whose drives are coded.
const CODED: f64 = 0.12;

/// Draws a laboratory, without imperfections, in which the effects with these ids can show.
pub(super) fn laboratory(ids: &[&'static str], random: &mut RandomSequence) -> Laboratory {
    let mut strata = BTreeMap::new();
    let mut note = |axis: &str, class: &str| {
        strata.insert(axis.to_owned(), class.to_owned());
    };
    let (layout, class) = layouts::draw(random);
    note("layout", class);
    let elements = layout.section.array().len();
    note("elements", class_of_elements(elements));
    let most = (MOST_PATHS / elements) as f64;
    let readings = random.log_uniform(READINGS.0, READINGS.1).min(most) as usize;
    let (radiator, class) = radiators::draw(layout.diameter_mm, elements * readings, random);
    note("radiator", class);
    let array = layout.section.with_transducer("transducer", radiator.believed);
    let size = Size::of(array.array().elements().iter().map(|element| element.centre_m));

    let coded = random.chance(CODED);
    let foci = if coded { codes(elements, random) } else { size.foci(random) };
    let class = if coded { "coded".to_owned() } else { format!("{} foci", foci.len()) };
    note("drives", if class == "1 foci" { "1 focus" } else { &class });
    let path = Path::draw(ids, random);
    note("path", path.shape.name());
    note("order", path.order.name());
    let survey = path.survey(&size, &foci, coded, readings, elements, random);
    note("motion", if survey.flown { "flown" } else { "at rest" });
    note("readings", class_of_readings(survey.stops.len()));
    note("repeats", if survey.repeats > 0 { "with" } else { "without" });
    note("dark", if survey.driven().count() < survey.stops.len() { "with" } else { "without" });
    let receiver = receivers::draw(random);
    for (axis, class) in receiver.classes() {
        note(axis, class);
    }
    // The room at 15 to 28 °C, by the thermometer.
    let speed_m_s = (random.uniform(340.3, 347.9) * 10.0).round() / 10.0;
    Laboratory {
        array,
        foci,
        speed_m_s,
        simulator: fieldgap_acoustics::Simulator::Transducer,
        source: radiator.truly,
        survey,
        peak_v: random.log_uniform(0.1, 5.0),
        multiplicative: receiver.multiplicative,
        additive_over_peak: receiver.additive_over_peak,
        reception: receiver.reception,
        imperfections: Vec::new(),
        uncertainty: None,
        strata,
    }
}

/// The size of an array, from which those of the field follow.
#[derive(Debug, Clone, Copy)]
struct Size {
    /// Twice the distance of the outermost element from the axis, mm, at least that of the smallest common array.
    aperture_mm: f64,
}

impl Size {
    fn of(centres_m: impl Iterator<Item = Vec3>) -> Self {
        let outermost_m = centres_m.map(|at_m| at_m.xy().norm()).fold(0.0, f64::max);
        Self { aperture_mm: (2e3 * outermost_m + 10.0).clamp(50.0, 400.0) }
    }

    /// One to three foci within the middle of the beam, one aperture away or more.
    fn foci(&self, random: &mut RandomSequence) -> Vec<FocusSection> {
        let count = 1 + random.index(3);
        let aside_mm = 0.3 * self.aperture_mm;
        (0..count)
            .map(|_| {
                let mut within =
                    |low: f64, high: f64| tenths_of_micrometre(random.uniform(low, high));
                FocusSection::Point(Vec3::new(
                    within(-aside_mm, aside_mm),
                    within(-aside_mm, aside_mm),
                    within(0.9 * self.aperture_mm, 1.8 * self.aperture_mm).max(70.0),
                ))
            })
            .collect()
    }
}

/// Drives of phases 0 and π, or of four phases, at random: no two are alike, and no element is driven alone.
fn codes(elements: usize, random: &mut RandomSequence) -> Vec<FocusSection> {
    let count = 4 + random.index(9);
    let steps = if random.chance(0.5) { 2 } else { 4 };
    let step_rad = std::f64::consts::TAU / steps as f64;
    let code = |_| (0..elements).map(|_| step_rad * random.index(steps) as f64).collect();
    (0..count).map(code).map(FocusSection::Phases).collect()
}

fn class_of_elements(elements: usize) -> &'static str {
    match elements {
        0..=40 => "up to 40",
        41..=100 => "41 to 100",
        101..=300 => "101 to 300",
        _ => "above 300",
    }
}

fn class_of_readings(readings: usize) -> &'static str {
    match readings {
        0..=99 => "up to 99",
        100..=999 => "100 to 999",
        1000..=9_999 => "1,000 to 9,999",
        _ => "10,000 and more",
    }
}

/// Wavelength in usual air, mm.
fn wavelength_mm() -> f64 {
    343e3 / FREQUENCY_HZ
}

#[cfg(test)]
mod tests;
