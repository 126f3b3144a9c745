//! The colours of the table of cells, and what each of them means.

use std::fmt::Write;
use std::sync::LazyLock;

use super::super::picture::{ColourScale, DivergingScale, Rgb};
use fieldgap_text::Uncertain;

/// Steps of a scale from low to high.
pub(super) const STEPS: usize = 8;

/// Steps of a scale about zero: as many below as above, and one in the middle.
pub(super) const SIGNED_STEPS: usize = 9;

/// A range in equal steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steps {
    low: f64,
    high: f64,
    count: usize,
}

impl Steps {
    /// From the lowest to the highest of some values, but no step is smaller than the middle one of their errors: what noise alone does then
    /// is about one step. `None` without a value.
    pub fn over(values: impl Iterator<Item = Uncertain>) -> Option<Self> {
        let values: Vec<Uncertain> = values.filter(|one| one.value.is_finite()).collect();
        let low = values.iter().map(|one| one.value).min_by(f64::total_cmp)?;
        let high = values.iter().map(|one| one.value).max_by(f64::total_cmp)?;
        let least = STEPS as f64 * middle_error(&values);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).max(least));
        // Values that are all alike lie in the middle of a range that shows three digits of them.
        let half = if half > 0.0 { half } else { 5e-3 * middle.abs().max(1e-3) };
        Some(Self { low: middle - half, high: middle + half, count: STEPS })
    }

    /// About zero, as far as the largest value; no step is smaller than `error`. `None` without a value.
    pub fn about_zero(values: impl Iterator<Item = f64>, error: f64) -> Option<Self> {
        let sizes = values.filter(|value| value.is_finite()).map(f64::abs);
        let largest = sizes.max_by(f64::total_cmp)?;
        let least = if error.is_finite() { 0.5 * SIGNED_STEPS as f64 * error } else { 0.0 };
        let reach = largest.max(least);
        let reach = if reach > 0.0 { reach } else { 0.01 };
        Some(Self { low: -reach, high: reach, count: SIGNED_STEPS })
    }

    /// The number of the step of a value; those beyond the ends belong to the first and the last.
    pub fn step(&self, value: f64) -> Option<usize> {
        let along = (value - self.low) / (self.high - self.low);
        let last = self.count - 1;
        value.is_finite().then(|| ((along * self.count as f64).max(0.0) as usize).min(last))
    }

    /// The two ends.
    pub fn ends(&self) -> [f64; 2] {
        [self.low, self.high]
    }
}

/// The middle one of the errors that are stated; zero without any.
fn middle_error(values: &[Uncertain]) -> f64 {
    let mut errors: Vec<f64> = values
        .iter()
        .map(|one| one.standard_error)
        .filter(|error| error.is_finite() && *error > 0.0)
        .collect();
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() / 2).copied().unwrap_or(0.0)
}

/// The relative error of a gap that is usual among these.
pub(super) fn usual_relative_error(values: impl Iterator<Item = Uncertain>) -> f64 {
    let relative: Vec<Uncertain> = values
        .filter(|one| one.value > 0.0)
        .map(|one| Uncertain { value: 1.0, standard_error: one.standard_error / one.value })
        .collect();
    middle_error(&relative)
}

/// Verdicts of a diagnosis: the word in a record, the word on the page, the colour.
pub(super) const VERDICTS: [(&str, &str, Rgb); 5] = [
    ("none", "no gap", (226, 226, 226)),
    ("explained", "explained", (86, 180, 233)),
    ("mostly-explained", "mostly", (160, 210, 240)),
    ("ambiguous", "ambiguous", (240, 228, 66)),
    ("unexplained", "unexplained", (230, 159, 0)),
];

/// How far a cell is: the word, its meaning, the colour.
pub(super) const STATUSES: [(&str, &str, Rgb); 6] = [
    ("open", "not begun", (255, 255, 255)),
    ("scanning", "the scan is going on", (240, 228, 66)),
    ("measured", "scanned, not compared yet", (160, 210, 240)),
    ("done", "scanned and compared", (0, 130, 96)),
    ("changed", "done; plan, rig or campaign file changed since", (86, 180, 233)),
    ("failed", "no complete scan", (213, 94, 0)),
];

/// The classes of all colours as a style sheet.
pub(super) static CLASSES: LazyLock<String> = LazyLock::new(|| {
    let scale = ColourScale { top: 1.0 };
    let signed = DivergingScale { reach: 1.0 };
    let mut sheet = String::new();
    for step in 0..STEPS {
        let colour = scale.colour((step as f64 + 0.5) / STEPS as f64);
        class(&mut sheet, &format!("g{step}"), "gap", colour);
        class(&mut sheet, &format!("c{step}"), "correlation", colour);
    }
    for step in 0..SIGNED_STEPS {
        let middle = (SIGNED_STEPS / 2) as f64;
        class(
            &mut sheet,
            &format!("d{step}"),
            "change",
            signed.colour((step as f64 - middle) / middle),
        );
    }
    for (number, (.., colour)) in VERDICTS.into_iter().enumerate() {
        class(&mut sheet, &format!("v{number}"), "verdict", colour);
    }
    for (number, (.., colour)) in STATUSES.into_iter().enumerate() {
        class(&mut sheet, &format!("s{number}"), "status", colour);
    }
    sheet
});

fn class(sheet: &mut String, name: &str, measure: &str, colour: Rgb) {
    let hex = |(red, green, blue): Rgb| format!("#{red:02x}{green:02x}{blue:02x}");
    let _ = writeln!(
        sheet,
        ".{name}{{--{measure}:{};--{measure}-ink:{}}}",
        hex(colour),
        hex(ink(colour))
    );
}

/// Black or white, whichever contrasts more: at least 4.5 to 1, which WCAG 2.2 (success criterion 1.4.3) asks for.
fn ink(colour: Rgb) -> Rgb {
    let [black, white] = [(0, 0, 0), (255, 255, 255)];
    if contrast(colour, black) >= contrast(colour, white) { black } else { white }
}

/// The contrast ratio of WCAG 2.2.
fn contrast(one: Rgb, other: Rgb) -> f64 {
    let (one, other) = (luminance(one), luminance(other));
    (one.max(other) + 0.05) / (one.min(other) + 0.05)
}

fn luminance((red, green, blue): Rgb) -> f64 {
    let linear = |channel: u8| {
        let value = f64::from(channel) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn exact(value: f64) -> Uncertain {
        Uncertain { value, standard_error: f64::NAN }
    }

    #[test]
    fn steps_share_the_range_from_lowest_to_highest() {
        let steps = Steps::over([0.1, 0.18, 0.14].map(exact).into_iter()).expect("values");
        let numbers = [0.1, 0.1099, 0.1101, 0.1799, 0.18, 5.0, -1.0].map(|value| steps.step(value));
        assert_eq!(numbers, [0, 0, 1, 7, 7, 7, 0].map(Some));
        assert_eq!(steps.step(f64::NAN), None);
        assert_eq!(Steps::over([exact(f64::NAN)].into_iter()), None);
    }

    #[test]
    fn noise_alone_is_about_one_step() {
        let noisy = |value| Uncertain { value, standard_error: 0.01 };
        let steps = Steps::over([0.2, 0.205].map(noisy).into_iter()).expect("values");
        let [low, high] = steps.ends();
        assert!((high - low - 0.08).abs() < 1e-12, "eight steps of an error each: {low} to {high}");
    }

    #[test]
    fn no_change_is_in_the_middle() {
        let steps = Steps::about_zero([0.09, -0.02].into_iter(), 0.001).expect("values");
        assert_eq!([-0.09, 0.0, 0.09].map(|value| steps.step(value)), [0, 4, 8].map(Some));
        assert_eq!(
            Steps::about_zero([0.0].into_iter(), f64::NAN).expect("a value").step(0.0),
            Some(4)
        );
    }

    #[test]
    fn contrast_is_that_of_known_colours() {
        assert!((contrast((0, 0, 0), (255, 255, 255)) - 21.0).abs() < 1e-9);
        // (118, 118, 118) is the lightest grey with 4.5 to 1 on white.
        assert!(contrast((118, 118, 118), (255, 255, 255)) >= 4.5);
        assert!(contrast((119, 119, 119), (255, 255, 255)) < 4.5);
    }

    #[test]
    fn every_class_is_in_the_style_sheet() {
        let count = 2 * STEPS + SIGNED_STEPS + VERDICTS.len() + STATUSES.len();
        assert_eq!(CLASSES.lines().count(), count);
        assert!(CLASSES.contains(".d4{--change:#fafafa;--change-ink:#000000}"), "{}", *CLASSES);
    }

    proptest! {
        #[test]
        fn letters_are_readable_on_every_colour(colour: (u8, u8, u8)) {
            prop_assert!(contrast(colour, ink(colour)) >= 4.5);
        }

        #[test]
        fn larger_values_have_no_lower_step(values in prop::collection::vec(-1e3..1e3f64, 1..20)) {
            let steps = Steps::over(values.iter().copied().map(exact)).expect("values");
            let mut sorted = values;
            sorted.sort_by(f64::total_cmp);
            let numbers: Vec<_> = sorted.iter().map(|value| steps.step(*value)).collect();
            prop_assert!(numbers.is_sorted(), "{numbers:?}");
        }
    }
}
