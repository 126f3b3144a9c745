//! How to read the page, for those who never saw one.

use maud::{Markup, html};

use super::super::html::glossary;

/// What the words and pictures mean.
pub(super) fn guide() -> Markup {
    let terms = [
        (
            "Gap",
            "The root mean square (rms) of scan less simulation at the gain that suits best, over the rms of the scan: \
             0\u{a0}% is a perfect match, and noise leaves a little in any case. Gaps over readings kept out of the fit \
             cannot be made small by fitting too much.",
        ),
        (
            "Cause",
            "A physical effect that the simulation leaves out or gets wrong, by the name that it has in the catalogue of \
             effects. It was added to the simulation and fitted to the readings, alone and with others.",
        ),
        (
            "Probability",
            "How probable a cause, or a set of causes, is among all that were tried. A cause with more parameters has to \
             explain more to be as probable.",
        ),
        (
            "Odds",
            "How many times as probable the best is. Up to 1 : 20 a cause stays in question; from there on it is unlikely, \
             and beyond 1 : 150 ruled out (the limits of Kass and Raftery, 1995).",
        ),
        (
            "Explained",
            "The share of the squared gap beyond noise, over readings kept out of the fit, that the best candidate \
             takes away.",
        ),
        (
            "Regions",
            "The main lobe is what is connected to a height's peak and above half of it; side lobes are other places \
             above a tenth of it.",
        ),
        ("\u{b1}", "One standard error; two thirds of repeated scans would fall within it."),
    ];
    html! {
        p {
            "A robot carried a receiver through the ultrasonic field of a phased array, and the same set-up was simulated. \
             Where the two differ by more than noise, something is not as the simulation believes. This page says what."
        }
        (glossary(terms))
    }
}
