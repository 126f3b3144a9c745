//! Horizontal bars with their names on the left.

use super::Picture;
use super::axes::{LABEL_TEXT, TICK_TEXT};
use fieldgap_canvas::{Align, BLACK, Canvas, CanvasError, Pen, Rgb};

/// Width of the picture; with long names it is wider, so that none is cut.
const WIDTH: f64 = 1100.0;
/// Least width of the scale.
const LEAST_SCALE: f64 = 400.0;
/// Above the bars.
const TOP_ROOM: f64 = 8.0;
const ROW: f64 = 30.0;
const BAR: f64 = 18.0;
const BOTTOM_ROOM: f64 = 62.0;
/// Right of the scale, for the note after a bar that reaches its end.
const RIGHT_ROOM: f64 = 170.0;
/// A character of a label, CSS pixels.
const CHARACTER: f64 = 0.56 * LABEL_TEXT;

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
    /// A description for readers who cannot see it.
    pub description: String,
}

impl BarChart {
    fn left(&self) -> f64 {
        let longest = self.bars.iter().map(|bar| bar.name.chars().count()).max().unwrap_or(0);
        30.0 + CHARACTER * longest as f64
    }

    fn x(&self, value: f64) -> f64 {
        let (from, to) = self.range;
        let share = ((value - from) / (to - from)).clamp(0.0, 1.0);
        self.left() + share * (self.width() - RIGHT_ROOM - self.left())
    }

    fn width(&self) -> f64 {
        WIDTH.max(self.left() + LEAST_SCALE + RIGHT_ROOM)
    }

    fn bottom(&self) -> f64 {
        TOP_ROOM + ROW * self.bars.len() as f64
    }
}

impl Picture for BarChart {
    fn size(&self) -> (u32, u32) {
        (self.width() as u32, (self.bottom() + BOTTOM_ROOM) as u32)
    }

    fn description(&self) -> String {
        self.description.clone()
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let thin = Pen { colour: BLACK, width: 1.0 };
        for (index, bar) in self.bars.iter().enumerate() {
            let middle = TOP_ROOM + ROW * (index as f64 + 0.5);
            let (left, right) = (self.x(bar.from.min(bar.to)), self.x(bar.from.max(bar.to)));
            // A bar of no length remains visible.
            let right = right.max(left + 1.5);
            let (top, bottom) = (middle - BAR / 2.0, middle + BAR / 2.0);
            let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
            canvas.fill(&corners, bar.weight.colour())?;
            canvas.text(&bar.name, (self.left() - 10.0, middle), LABEL_TEXT, Align::Left)?;
            let after = self.x(bar.from.max(bar.to)) + 8.0;
            canvas.text(&bar.note, (after, middle), LABEL_TEXT, Align::Right)?;
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
            description: "Bars.".to_owned(),
        }
    }

    #[test]
    fn bars_reach_from_value_to_value() {
        let chart = chart();
        let drawn = Drawn::new(&chart).expect("drawn");
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let pixel = |value: f64, row: f64| {
            let (x, y) = (chart.x(value), TOP_ROOM + ROW * (row + 0.5) + 4.0);
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
    fn long_names_are_not_cut() {
        let mut chart = chart();
        chart.bars[0].name = "a cause of many words ".repeat(8);
        let drawn = Drawn::new(&chart).expect("drawn");
        assert!(drawn.svg.contains(chart.bars[0].name.trim_end()), "{}", drawn.svg);
        assert!(chart.x(0.0) >= CHARACTER * chart.bars[0].name.len() as f64);
        assert!(chart.x(1.0) - chart.x(0.0) >= LEAST_SCALE - 1.0);
    }
}
