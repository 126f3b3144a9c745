//! How to read the page, for those who never saw one.

use maud::{Markup, html};

use super::super::judgement::{LEAST_CORRELATION, SAME_PLACE_SHARE};
use super::super::picture::LEAST_SIGNED_SHARE;
use super::html::{glossary, section};

pub(super) fn guide() -> Markup {
    let terms = [
        (
            "The three maps of a height",
            format!(
                "The scan, the simulation and the size of their difference, seen against the z axis, one cell for each \
                 measured point. Dark is quiet, light is loud, on one colour scale for the three. On the \
                 difference, + stands where the scan is louder than the simulation and \u{2212} where it is quieter, \
                 wherever they differ by more than {}\u{a0}% of the scale. Hatched cells were not measured.",
                LEAST_SIGNED_SHARE * 100.0
            ),
        ),
        (
            "Marks",
            "The lying cross is the focus that the array was asked for, the circle the peak of the scan; \
             square, diamond and triangle are peaks of simulations, one shape for each simulator."
                .to_owned(),
        ),
        (
            "Peak",
            "The largest value of a map, its place refined below the step of the grid by a parabola through its \
             neighbours."
                .to_owned(),
        ),
        (
            "Focal radius",
            "The distance from the largest cell to where the field first falls below half of it, \
             averaged over the directions +x, \u{2212}x, +y and \u{2212}y. A direction in which it does not fall so \
             far before the map ends is cut off and left out of the mean."
                .to_owned(),
        ),
        (
            "Sub-peak",
            "Another local maximum of at least half the peak: a second place where a hand would feel something."
                .to_owned(),
        ),
        (
            "Registration, gain",
            "The simulation knows neither the unit of the receiver nor exactly where the robot stood. One factor (the \
             gain) and, where it says so, a shift or turn bring the two together; all readings share them. \
             What is left is the gap."
                .to_owned(),
        ),
        (
            "Correlation, residual",
            "Correlation is 1 where the two fields have the same shape, 0 where they have nothing in common. The \
             residual is the rms (root mean square) of scan less simulation, over the rms of the scan: 0\u{a0}% is a perfect match."
                .to_owned(),
        ),
        (
            "Agree",
            format!(
                "Said of a height where the peaks stand within {} of the focal radius of each other and the maps \
                 correlate at {LEAST_CORRELATION} or better.",
                if SAME_PLACE_SHARE == 0.5 { "half".to_owned() } else { format!("{SAME_PLACE_SHARE}") }
            ),
        ),
        (
            "\u{b1}",
            "One standard error, from the noise of the readings and the registration; two thirds of repeated scans \
             would fall within it."
                .to_owned(),
        ),
    ];
    let content = html! {
        p {
            "A robot carried a receiver through the ultrasonic field of a phased array and took a reading at every \
             point of a grid. The same set-up was simulated. This page shows where the two differ."
        }
        (glossary(terms.iter().map(|(term, meaning)| (*term, meaning.as_str()))))
    };
    section("guide", "How to read this page", &content)
}
