//! How to read the page, for a first reader.

use fieldgap_text::percent;
use maud::{Markup, html};

use super::super::judgement::{MOST_RESIDUAL, SAME_PLACE_SHARE};
use super::super::picture::LEAST_SIGNED_SHARE;
use super::html::{glossary, section};

pub(super) fn guide() -> Markup {
    let signed_percent = LEAST_SIGNED_SHARE * 100.0;
    let same_place = if SAME_PLACE_SHARE == 0.5 {
        "half of the focal radius".to_owned()
    } else {
        format!("{SAME_PLACE_SHARE} of the focal radius")
    };
    let terms = [
        (
            "The three maps at a height",
            format!(
                "The scan, the simulation, and the magnitude of their difference, viewed from above (against the z \
                 axis). Each cell is one measured point. The three maps share one colour scale, from dark (quiet) to \
                 light (loud). On the difference map, + means that the scan is louder than the simulation and \u{2212} \
                 that it is quieter, by more than {signed_percent}\u{a0}% of the scale. Hatched cells were not measured."
            ),
        ),
        (
            "Marks",
            "The diagonal cross marks the focus that was set, the circle the peak of the scan. Squares, diamonds and \
             triangles mark peaks of simulations, one shape for each simulator."
                .to_owned(),
        ),
        (
            "Peak",
            "The largest value of a map. Its position is interpolated between the grid points by a parabola.".to_owned(),
        ),
        (
            "Focal radius",
            "The distance from the largest cell to the point where the field first falls below half of it, averaged over \
             the directions +x, \u{2212}x, +y and \u{2212}y. A direction in which the map ends first is reported as cut \
             off and left out of the mean."
                .to_owned(),
        ),
        (
            "Sub-peak",
            "Another local maximum of at least half the peak. A hand would feel it as a second spot.".to_owned(),
        ),
        (
            "Registration, gain",
            "The simulation knows neither the unit of the receiver nor the exact position of the robot. One factor (the \
             gain) and, where stated, a shift or rotation align the two. They are the same for all readings. The \
             remaining difference is the gap."
                .to_owned(),
        ),
        (
            "Correlation, residual",
            "Correlation is 1 if the two fields have the same shape and 0 if they are unrelated. The residual is the rms \
             (root mean square) of scan minus simulation, divided by the rms of the scan. 0\u{a0}% is a perfect match."
                .to_owned(),
        ),
        (
            "Agree",
            format!(
                "Scan and simulation agree at a height if their peaks are at most {same_place} apart and the residual is at \
                 most {}. If only another gain for this height would bring the residual below that, the level differs.",
                percent(MOST_RESIDUAL)
            ),
        ),
        (
            "\u{b1}",
            "One standard error, from the noise of the readings and the registration. Two thirds of repeated scans would \
             fall within it."
                .to_owned(),
        ),
    ];
    let content = html! {
        p {
            "A robot moved a receiver through the ultrasonic field of a phased array and took a reading at every point \
             of a grid. The same set-up was simulated. This page shows where the two differ."
        }
        (glossary(terms.iter().map(|(term, meaning)| (*term, meaning.as_str()))))
    };
    section("guide", "How to read this page", &content)
}
