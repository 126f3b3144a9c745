//! Probabilities of the sets of effects after each round, as columns of shares.

use super::Picture;
use super::axes::{Axes, LABEL_TEXT};
use super::marker::Series;
use super::panel_row::{self, PanelRow};
use fieldgap_canvas::{Align, Canvas, CanvasError, Pen, Rgb, WHITE};

const WIDTH: f64 = 860.0;
const NARROW: f64 = 440.0;
/// Width of a column, as a share of the distance of two.
const COLUMN: f64 = 0.72;

/// A part of every column.
#[derive(Debug, Clone)]
pub(crate) struct Share {
    pub name: String,
    pub colour: Rgb,
    /// Its probability in each column.
    pub probabilities: Vec<f64>,
}

impl Share {
    /// A set of effects, with a colour of its own among seven.
    pub fn of_set(name: String, number: usize, probabilities: Vec<f64>) -> Self {
        // The first series of curves is black, which hides the borders of a column.
        Self { name, colour: Series::Numbered(1 + number % 7).colour(), probabilities }
    }
}

/// The columns, one for each decision.
#[derive(Debug, Clone)]
pub(crate) struct SetShares {
    /// What stands below each column.
    columns: Vec<String>,
    /// From the bottom up.
    shares: Vec<Share>,
    row: PanelRow,
}

impl SetShares {
    /// Columns with these names, and the parts of each.
    pub fn new(columns: Vec<String>, shares: Vec<Share>) -> Self {
        let mut all = Self { columns, shares, row: PanelRow::new(1) };
        // This width has room for every legend.
        let _ = all.fit(WIDTH);
        all
    }

    /// The same for a narrow screen.
    pub fn narrow(&self) -> Self {
        let mut narrow = self.clone();
        let _ = narrow.fit(NARROW);
        narrow
    }

    fn axes(&self) -> Axes {
        self.row.axes(0, (-0.5, self.columns.len() as f64 - 0.5), (0.0, 100.0))
    }

    fn legend_widths(&self) -> Vec<f64> {
        self.shares.iter().map(|share| 44.0 + 7.0 * share.name.chars().count() as f64).collect()
    }
}

impl Picture for SetShares {
    fn size(&self) -> (u32, u32) {
        self.row.size()
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        // A name longer than the picture is wide still stands in it as far as it goes.
        let legend: Vec<f64> =
            self.legend_widths().into_iter().map(|entry| entry.min(width - 110.0)).collect();
        self.row.fit(width, &legend)
    }

    fn description(&self) -> String {
        let last = self.shares.iter().filter_map(|share| {
            let probability = share.probabilities.last()?;
            (*probability >= 0.005).then(|| format!("{} {:.0} %", share.name, 100.0 * probability))
        });
        format!(
            "Columns of the probabilities after each of {} rounds. After the last: {}. The table below has all of them.",
            self.columns.len(),
            last.collect::<Vec<_>>().join(", ")
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let axes = self.axes();
        for column in 0..self.columns.len() {
            let (left, right) = (column as f64 - COLUMN / 2.0, column as f64 + COLUMN / 2.0);
            let mut below = 0.0;
            for share in &self.shares {
                let above = below + 100.0 * share.probabilities[column];
                let [low, high] = [below, above].map(|p| axes.place(left, p).1);
                let (from, to) = (axes.place(left, 0.0).0, axes.place(right, 0.0).0);
                if low - high > 0.25 {
                    let corners = [(from, high), (to, high), (to, low), (from, low)];
                    canvas.fill(&corners, share.colour)?;
                    canvas.line((from, high), (to, high), Pen { colour: WHITE, width: 1.0 })?;
                }
                below = above;
            }
        }
        panel_row::frame(canvas, &axes, "", "probability (%)")?;
        axes.x_names(canvas, &self.columns, "readings so far")?;
        let widths = self.legend_widths();
        for (number, share) in self.shares.iter().enumerate() {
            let (x, y) = self.row.legend_place(number, &widths);
            let box_corners =
                [(x, y - 7.0), (x + 22.0, y - 7.0), (x + 22.0, y + 7.0), (x, y + 7.0)];
            canvas.fill(&box_corners, share.colour)?;
            canvas.text(&share.name, (x + 30.0, y), LABEL_TEXT, Align::Right)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Drawn;
    use super::*;

    #[test]
    fn a_column_is_parted_by_the_probabilities() {
        let share = |name: &str, number, probabilities: [f64; 2]| {
            Share::of_set(name.to_owned(), number, probabilities.to_vec())
        };
        let shares = SetShares::new(
            vec!["240".to_owned(), "336".to_owned()],
            vec![share("a", 0, [0.25, 0.9]), share("b", 1, [0.75, 0.1])],
        );
        let drawn = Drawn::new(&shares).expect("drawn");
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let pixel = |column: f64, percent: f64| {
            let (x, y) = shares.axes().place(column, percent);
            let image::Rgb(rgb) = *image.get_pixel((2.0 * x) as u32, (2.0 * y) as u32);
            (rgb[0], rgb[1], rgb[2])
        };
        let [a, b] = [0, 1].map(|number| shares.shares[number].colour);
        assert_eq!([pixel(0.0, 20.0), pixel(0.0, 30.0), pixel(1.0, 80.0)], [a, b, a]);
        assert_eq!([pixel(1.0, 95.0), pixel(0.5, 50.0)], [b, WHITE]);
    }
}
