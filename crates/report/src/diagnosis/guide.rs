//! How to read the page, for a first reader.

use maud::{Markup, html};

use super::super::html::glossary;

/// What the words and pictures mean.
pub(super) fn guide() -> Markup {
    let terms = [
        (
            "Gap",
            "The root mean square (rms) of scan minus simulation at the best gain, divided by the rms of the scan. \
             0\u{a0}% is a perfect match; noise always leaves a little. The gap is computed from readings that the fit did \
             not use, so that overfitting cannot make it small.",
        ),
        (
            "Nominal, corrected",
            "The nominal simulation uses the set-up as the files of the scan state it. The corrected simulation adds the \
             best candidate.",
        ),
        (
            "Cause",
            "A physical effect that the simulation omits or gets wrong, by its name in the catalogue of effects. It was \
             added to the simulation and fitted to the readings, alone and with others.",
        ),
        (
            "Probability",
            "How probable a cause, or a set of causes, is among all that were fitted. A cause with more parameters has to \
             explain more to be equally probable.",
        ),
        (
            "Times less likely",
            "How many times more probable the best candidate is. Up to 20 times a cause remains possible. Beyond that it is \
             unlikely, and beyond 150 times it is ruled out (limits of Kass and Raftery, 1995).",
        ),
        (
            "Explained",
            "The share of the squared gap beyond noise that the best candidate removes, over readings that the fit did not \
             use.",
        ),
        (
            "Regions",
            "The main lobe is the connected region around the peak of a height in which the field exceeds half of the \
             peak. Side lobes are other places above a tenth of the peak.",
        ),
        ("\u{b1}", "One standard error. Two thirds of repeated scans would fall within it."),
    ];
    html! {
        p {
            "A robot moved a receiver through the ultrasonic field of a phased array. The same set-up was simulated. If the \
             two differ by more than noise, the set-up or the simulation is not as assumed. This page states the cause."
        }
        (glossary(terms))
    }
}
