//! A frame with two linear axes.

use fieldgap_canvas::{Align, BLACK, Canvas, CanvasError, Pen, Point};

/// Line heights of labels, CSS pixels.
pub(super) const TICK_TEXT: f64 = 14.0;
pub(super) const LABEL_TEXT: f64 = 15.0;

const TICK_LENGTH: f64 = 5.0;
const FRAME_PEN: Pen = Pen { colour: BLACK, width: 1.0 };

/// A rectangle on the sheet and the ranges of x and y that it shows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes {
    /// Upper left corner, CSS pixels.
    pub corner: Point,
    pub width: f64,
    pub height: f64,
    /// Values at the left and the right side; the first is less than the second.
    pub x: (f64, f64),
    /// Values at the bottom and the top.
    pub y: (f64, f64),
}

impl Axes {
    /// The point of a pair of values on the sheet.
    pub fn place(&self, x: f64, y: f64) -> Point {
        let fraction = |value: f64, (from, to): (f64, f64)| (value - from) / (to - from);
        (
            self.corner.0 + self.width * fraction(x, self.x),
            self.corner.1 + self.height * (1.0 - fraction(y, self.y)),
        )
    }

    /// Whether a pair of values is inside the frame.
    pub fn holds(&self, x: f64, y: f64) -> bool {
        (self.x.0..=self.x.1).contains(&x) && (self.y.0..=self.y.1).contains(&y)
    }

    /// The frame without ticks.
    pub fn frame(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let (left, top) = self.corner;
        let (right, bottom) = (left + self.width, top + self.height);
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
        canvas.outline(&corners, FRAME_PEN)
    }

    /// Ticks, their numbers and the label below the frame.
    pub fn x_axis(&self, canvas: &mut Canvas, label: &str) -> Result<(), CanvasError> {
        let bottom = self.corner.1 + self.height;
        for tick in ticks(self.x, self.width / 40.0) {
            let (x, _) = self.place(tick.value, self.y.0);
            canvas.line((x, bottom), (x, bottom + TICK_LENGTH), FRAME_PEN)?;
            canvas.text(&tick.label, (x, bottom + TICK_LENGTH + 3.0), TICK_TEXT, Align::Below)?;
        }
        let middle = self.corner.0 + self.width / 2.0;
        canvas.text(label, (middle, bottom + 26.0), LABEL_TEXT, Align::Below)
    }

    /// Names below the frame, at 0, 1, 2, ... along x, and the label.
    pub fn x_names(
        &self,
        canvas: &mut Canvas,
        names: &[String],
        label: &str,
    ) -> Result<(), CanvasError> {
        let bottom = self.corner.1 + self.height;
        for (index, name) in names.iter().enumerate() {
            let (x, _) = self.place(index as f64, self.y.0);
            canvas.line((x, bottom), (x, bottom + TICK_LENGTH), FRAME_PEN)?;
            canvas.text(name, (x, bottom + TICK_LENGTH + 3.0), TICK_TEXT, Align::Below)?;
        }
        let middle = self.corner.0 + self.width / 2.0;
        canvas.text(label, (middle, bottom + 26.0), LABEL_TEXT, Align::Below)
    }

    /// Ticks, their numbers and the label left of the frame.
    pub fn y_axis(&self, canvas: &mut Canvas, label: &str) -> Result<(), CanvasError> {
        let left = self.corner.0;
        let ticks = ticks(self.y, self.height / 40.0);
        for tick in &ticks {
            let (_, y) = self.place(self.x.0, tick.value);
            canvas.line((left, y), (left - TICK_LENGTH, y), FRAME_PEN)?;
            canvas.text(&tick.label, (left - TICK_LENGTH - 3.0, y), TICK_TEXT, Align::Left)?;
        }
        let middle = self.corner.1 + self.height / 2.0;
        canvas.text(label, (left - room_for(&ticks), middle), LABEL_TEXT, Align::Upwards)
    }

    /// Ticks and their numbers right of the frame.
    pub fn right_axis(&self, canvas: &mut Canvas, label: &str) -> Result<(), CanvasError> {
        self.ticks_on_the_right(canvas, &ticks(self.y, self.height / 40.0), label)
    }

    /// The same with ticks at given values, which have the given labels.
    pub fn marked_right_axis(
        &self,
        canvas: &mut Canvas,
        marks: &[(f64, String)],
        label: &str,
    ) -> Result<(), CanvasError> {
        let tick = |(value, label): &(f64, String)| Tick { value: *value, label: label.clone() };
        let ticks: Vec<Tick> = marks.iter().map(tick).collect();
        self.ticks_on_the_right(canvas, &ticks, label)
    }

    fn ticks_on_the_right(
        &self,
        canvas: &mut Canvas,
        ticks: &[Tick],
        label: &str,
    ) -> Result<(), CanvasError> {
        let right = self.corner.0 + self.width;
        for tick in ticks {
            let (_, y) = self.place(self.x.0, tick.value);
            canvas.line((right, y), (right + TICK_LENGTH, y), FRAME_PEN)?;
            canvas.text(&tick.label, (right + TICK_LENGTH + 3.0, y), TICK_TEXT, Align::Right)?;
        }
        let middle = self.corner.1 + self.height / 2.0;
        canvas.text(label, (right + room_for(ticks), middle), LABEL_TEXT, Align::Upwards)
    }
}

/// A value on an axis that is marked.
#[derive(Debug, Clone, PartialEq)]
struct Tick {
    value: f64,
    label: String,
}

/// From the frame to the middle of the label beyond the numbers of some ticks, CSS pixels.
fn room_for(ticks: &[Tick]) -> f64 {
    let longest = ticks.iter().map(|tick| tick.label.chars().count()).max().unwrap_or(0);
    TICK_LENGTH + 3.0 + 0.55 * TICK_TEXT * longest as f64 + LABEL_TEXT
}

/// Round values inside a range, `about` as many or fewer: multiples of 1, 2 or 5 times a power of ten.
fn ticks((from, to): (f64, f64), about: f64) -> Vec<Tick> {
    let rough = (to - from) / about.max(2.0);
    if !rough.is_finite() || rough <= 0.0 {
        return Vec::new();
    }
    let unit = 10f64.powf(rough.log10().floor());
    let steps = [0.5, 1.0, 2.0, 5.0, 10.0].map(|m| m * unit);
    let enough = steps.iter().position(|&step| step >= rough).unwrap_or(steps.len() - 1);
    // A step wider than the range may have no multiple in it; the next smaller one then has.
    let wide = multiples(steps[enough], from, to);
    if wide.is_empty() { multiples(steps[enough.saturating_sub(1)], from, to) } else { wide }
}

/// The multiples of a step inside a range.
fn multiples(step: f64, from: f64, to: f64) -> Vec<Tick> {
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    // A hair of slack, so that an end that is itself a tick is not lost to rounding.
    let first = (from / step - 1e-9).ceil() as i64;
    let last = (to / step + 1e-9).floor() as i64;
    (first..=last)
        .map(|count| {
            let value = count as f64 * step;
            let label = format!("{value:.decimals$}").replace('-', "\u{2212}");
            Tick { value, label }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn labels(range: (f64, f64), about: f64) -> Vec<String> {
        ticks(range, about).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(labels((-36.0, 36.0), 5.0), ["−20", "0", "20"]);
        assert_eq!(labels((0.0, 0.5), 6.0), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(labels((0.0, 25_000.0), 6.0), ["0", "5000", "10000", "15000", "20000", "25000"]);
        assert!(labels((1.0, 1.0), 5.0).is_empty());
    }

    proptest! {
        #[test]
        fn ticks_lie_inside_and_are_neither_many_nor_absent(from in -1e3..1e3f64, width in 1e-3..1e4f64, about in 2.0..12.0f64) {
            let found = ticks((from, from + width), about);
            let slack = 1e-6 * width;
            prop_assert!(found.iter().all(|t| t.value > from - slack && t.value < from + width + slack));
            prop_assert!(!found.is_empty() && found.len() as f64 <= about + 1.0 + 1e-9, "{}", found.len());
        }
    }
}
