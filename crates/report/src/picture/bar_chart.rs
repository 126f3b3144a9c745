//! Horizontal bars with their names on the left.

use plotters::backend::DrawingBackend;

use super::axes::{LABEL_TEXT, TICK_TEXT};
use super::canvas::{Align, BLACK, Canvas, GREY, Pen, Rgb, WHITE};
use super::{Picture, PictureError};

const WIDTH: f64 = 1100.0;
/// Above the bars, with and without guides.
const TOP_ROOM: (f64, f64) = (30.0, 8.0);
const ROW: f64 = 30.0;
const BAR: f64 = 18.0;
const BOTTOM_ROOM: f64 = 62.0;
/// Right of the scale, for the note after a bar that reaches its end.
const RIGHT_ROOM: f64 = 170.0;
/// A character of a label, CSS pixels; names longer than the room for them are cut.
const CHARACTER: f64 = 0.56 * LABEL_TEXT;
const LONGEST_NAME: usize = 52;

/// How prominent a bar is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weight {
    /// The main bars.
    Strong,
    /// Bars for comparison.
    Plain,
    /// Bars of little weight.
    Faint,
}

impl Weight {
    /// From dark to light, so that the chart can be read without colour.
    fn colour(self) -> Rgb {
        match self {
            Self::Strong => (0, 90, 150),
            Self::Plain => (120, 175, 215),
            Self::Faint => (200, 200, 200),
        }
    }
}

/// A bar from one value to another.
pub(crate) struct Bar {
    pub name: String,
    pub from: f64,
    pub to: f64,
    /// The text right of it.
    pub note: String,
    pub weight: Weight,
}

/// The bars, from the top down, over one scale.
pub(crate) struct BarChart {
    pub bars: Vec<Bar>,
    /// Values at the left and the right end of the scale; the first is less.
    pub range: (f64, f64),
    /// Marked values and their labels.
    pub ticks: Vec<(f64, String)>,
    /// The label of the scale.
    pub label: String,
    /// Values with a dashed line over the whole chart, the label above it, and the side on which the label stands.
    pub guides: Vec<(f64, &'static str, Align)>,
    /// A description for readers who cannot see it.
    pub description: String,
}

impl BarChart {
    fn left(&self) -> f64 {
        let longest = self.bars.iter().map(|bar| bar.name.chars().count()).max().unwrap_or(0);
        30.0 + CHARACTER * longest.min(LONGEST_NAME) as f64
    }

    fn x(&self, value: f64) -> f64 {
        let (from, to) = self.range;
        let share = ((value - from) / (to - from)).clamp(0.0, 1.0);
        self.left() + share * (WIDTH - RIGHT_ROOM - self.left())
    }

    fn top(&self) -> f64 {
        if self.guides.is_empty() { TOP_ROOM.1 } else { TOP_ROOM.0 }
    }

    fn bottom(&self) -> f64 {
        self.top() + ROW * self.bars.len() as f64
    }
}

impl Picture for BarChart {
    fn size(&self) -> (u32, u32) {
        (WIDTH as u32, (self.bottom() + BOTTOM_ROOM) as u32)
    }

    fn description(&self) -> String {
        self.description.clone()
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<B>) -> Result<(), PictureError> {
        let thin = Pen { colour: BLACK, width: 1.0 };
        for (index, bar) in self.bars.iter().enumerate() {
            let middle = self.top() + ROW * (index as f64 + 0.5);
            let (left, right) = (self.x(bar.from.min(bar.to)), self.x(bar.from.max(bar.to)));
            // A bar of no length remains visible.
            let right = right.max(left + 1.5);
            let (top, bottom) = (middle - BAR / 2.0, middle + BAR / 2.0);
            let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
            canvas.fill(&corners, bar.weight.colour())?;
            canvas.text(&cut(&bar.name), (self.left() - 10.0, middle), LABEL_TEXT, Align::Left)?;
        }
        for &(value, words, align) in &self.guides {
            let x = self.x(value);
            let line = [(x, self.top() - 4.0), (x, self.bottom())];
            canvas.dashed(&line, &[2.0, 3.0], Pen { colour: GREY, width: 1.25 })?;
            let beside = if align == Align::Left { -5.0 } else { 5.0 };
            canvas.text(words, (x + beside, self.top() - 14.0), TICK_TEXT, align)?;
        }
        // After the guides, so that none crosses a label.
        for (index, bar) in self.bars.iter().enumerate() {
            let middle = self.top() + ROW * (index as f64 + 0.5);
            let left = self.x(bar.from.max(bar.to)) + 8.0;
            let right = left + CHARACTER * bar.note.chars().count() as f64;
            let (top, bottom) = (middle - BAR / 2.0, middle + BAR / 2.0);
            let room = [(left, top), (right, top), (right, bottom), (left, bottom)];
            canvas.fill(&room, WHITE)?;
            canvas.text(&bar.note, (left, middle), LABEL_TEXT, Align::Right)?;
        }
        let (from, to) = (self.x(self.range.0), self.x(self.range.1));
        canvas.line((from, self.bottom()), (to, self.bottom()), thin)?;
        for (value, words) in &self.ticks {
            let x = self.x(*value);
            canvas.line((x, self.bottom()), (x, self.bottom() + 5.0), thin)?;
            canvas.text(words, (x, self.bottom() + 8.0), TICK_TEXT, Align::Below)?;
        }
        let middle = (from + to) / 2.0;
        canvas.text(&self.label, (middle, self.bottom() + 32.0), LABEL_TEXT, Align::Below)
    }
}

/// A name that has room.
fn cut(name: &str) -> String {
    if name.chars().count() <= LONGEST_NAME {
        return name.to_owned();
    }
    name.chars().take(LONGEST_NAME - 3).chain("...".chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Drawn;
    use super::*;

    fn chart() -> BarChart {
        let bar = |from, to, weight| Bar {
            name: "a cause".to_owned(),
            from,
            to,
            note: String::new(),
            weight,
        };
        BarChart {
            bars: vec![bar(0.0, 1.0, Weight::Strong), bar(1.0, 0.5, Weight::Faint)],
            range: (0.0, 1.0),
            ticks: vec![(0.0, "0".to_owned()), (1.0, "1".to_owned())],
            label: "share".to_owned(),
            guides: vec![(0.25, "here", Align::Right)],
            description: "Bars.".to_owned(),
        }
    }

    #[test]
    fn bars_reach_from_value_to_value() {
        let chart = chart();
        let drawn = Drawn::new(&chart).expect("drawn");
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let pixel = |value: f64, row: f64| {
            let (x, y) = (chart.x(value), chart.top() + ROW * (row + 0.5) + 4.0);
            let image::Rgb([red, green, blue]) =
                *image.get_pixel((2.0 * x) as u32, (2.0 * y) as u32);
            (red, green, blue)
        };
        assert_eq!(pixel(0.1, 0.0), Weight::Strong.colour());
        assert_eq!(pixel(0.9, 0.0), Weight::Strong.colour());
        assert_eq!(pixel(0.4, 1.0), (255, 255, 255));
        assert_eq!(pixel(0.6, 1.0), Weight::Faint.colour());
    }

    #[test]
    fn long_names_are_cut() {
        assert_eq!(cut("pitch"), "pitch");
        assert_eq!(cut(&"x".repeat(80)).chars().count(), LONGEST_NAME);
    }
}
