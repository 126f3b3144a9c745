//! Figures that each round has, with their errors, side by side.

use super::Picture;
use super::axes::{Axes, LABEL_TEXT};
use super::marker::{Series, error_bar};
use super::panel_row::{self, PanelRow, a_little_above};
use fieldgap_canvas::{Align, Canvas, CanvasError, Pen};

const WIDTH: f64 = 860.0;
const NARROW: f64 = 440.0;
/// Distance of the marks of one round, as a share of the distance of two rounds.
const APART: f64 = 0.12;

/// A figure of every round; `None` where it has none. Its error is zero where it has none.
#[derive(Debug, Clone)]
pub(crate) struct RoundFigure {
    pub name: String,
    pub values: Vec<Option<(f64, f64)>>,
}

/// Figures over the rounds.
#[derive(Debug, Clone)]
pub(crate) struct OverRounds {
    rounds: Vec<String>,
    label: &'static str,
    figures: Vec<RoundFigure>,
    row: PanelRow,
}

impl OverRounds {
    /// Figures in their order, above the names of the rounds.
    pub fn new(rounds: Vec<String>, label: &'static str, figures: Vec<RoundFigure>) -> Self {
        let mut all = Self { rounds, label, figures, row: PanelRow::new(1) };
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
        let values = self.figures.iter().flat_map(|figure| figure.values.iter().flatten());
        let top = values.fold(0.0, |top: f64, (value, error)| top.max(value + error));
        self.row.axes(0, (-0.5, self.rounds.len() as f64 - 0.5), (0.0, a_little_above(top)))
    }

    /// Where the mark of a figure stands beside the round.
    fn x(&self, figure: usize, round: usize) -> f64 {
        round as f64 + APART * (figure as f64 - 0.5 * (self.figures.len() - 1) as f64)
    }

    fn legend_widths(&self) -> Vec<f64> {
        self.figures.iter().map(|figure| 44.0 + 7.0 * figure.name.chars().count() as f64).collect()
    }
}

impl Picture for OverRounds {
    fn size(&self) -> (u32, u32) {
        self.row.size()
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        let legend = self.legend_widths();
        self.row.fit(width, &legend)
    }

    fn description(&self) -> String {
        let names: Vec<&str> = self.figures.iter().map(|figure| figure.name.as_str()).collect();
        format!(
            "{} of {} rounds, {}. The table below has all values.",
            self.label,
            self.rounds.len(),
            names.join(", ")
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let axes = self.axes();
        for (number, figure) in self.figures.iter().enumerate() {
            let series = Series::Numbered(number);
            let pen = Pen { colour: series.colour(), width: 1.5 };
            for (round, value) in figure.values.iter().enumerate() {
                let Some((value, error)) = *value else { continue };
                let x = self.x(number, round);
                if error > 0.0 {
                    let ends = [(value - error).max(0.0), value + error];
                    error_bar(canvas, ends.map(|value| axes.place(x, value)), pen)?;
                }
                series.mark_on_curve(canvas, axes.place(x, value), true)?;
            }
        }
        panel_row::frame(canvas, &axes, "", self.label)?;
        axes.x_names(canvas, &self.rounds, "round")?;
        let widths = self.legend_widths();
        for (number, figure) in self.figures.iter().enumerate() {
            let (x, y) = self.row.legend_place(number, &widths);
            Series::Numbered(number).mark_on_curve(canvas, (x + 10.0, y), true)?;
            canvas.text(&figure.name, (x + 24.0, y), LABEL_TEXT, Align::Right)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Drawn;
    use super::*;

    #[test]
    fn a_mark_stands_at_its_value_and_none_where_there_is_none() {
        let figure = |name: &str, values: &[Option<(f64, f64)>]| RoundFigure {
            name: name.to_owned(),
            values: values.to_vec(),
        };
        let over = OverRounds::new(
            vec!["1".to_owned(), "2".to_owned()],
            "gap (%)",
            vec![
                figure("before", &[Some((30.0, 3.0)), None]),
                figure("after", &[Some((10.0, 0.0)), Some((20.0, 0.0))]),
            ],
        );
        let drawn = Drawn::new(&over).expect("drawn");
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let is_marked = |figure: usize, round: usize, value: f64| {
            let (x, y) = over.axes().place(over.x(figure, round), value);
            image.get_pixel((2.0 * x) as u32, (2.0 * y) as u32).0 != [255; 3]
        };
        assert!(is_marked(0, 0, 30.0) && is_marked(0, 0, 32.0) && !is_marked(0, 0, 20.0));
        assert!(is_marked(1, 1, 20.0) && !is_marked(0, 1, 30.0));
    }
}
