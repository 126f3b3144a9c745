//! Where a closed loop measured, round by round: from above and from the side.

use super::Picture;
use super::axes::{Axes, LABEL_TEXT};
use super::colour_scale::ColourScale;
use super::marker::{diamond, dot, triangle};
use super::panel_row::{self, PanelRow};
use fieldgap_canvas::{Align, Canvas, CanvasError, Rgb};

/// Radius of a mark, CSS pixels.
const MARK: f64 = 2.6;
const WIDTH: f64 = 860.0;
const NARROW: f64 = 440.0;
/// Of the viridis colours the lightest are too faint on white.
const DARKER_PART: f64 = 0.88;

/// The places of one round.
#[derive(Debug, Clone)]
pub(crate) struct PlacesOfRound {
    pub name: String,
    /// Whether they are fresh places that test a cause, which have a mark of their own.
    pub is_fresh: bool,
    /// Places, array frame, mm, and whether each was read in motion, which has a mark of its own too.
    pub places: Vec<([f64; 3], bool)>,
}

/// The places of all rounds in plan and side view.
#[derive(Debug, Clone)]
pub(crate) struct RoundPlaces {
    rounds: Vec<PlacesOfRound>,
    row: PanelRow,
}

impl RoundPlaces {
    /// Of some rounds, in their order.
    pub fn new(rounds: Vec<PlacesOfRound>) -> Self {
        let mut places = Self { rounds, row: PanelRow::new(2) };
        // This width has room for every legend.
        let _ = places.fit(WIDTH);
        places
    }

    /// The same for a narrow screen.
    pub fn narrow(&self) -> Self {
        let mut narrow = self.clone();
        let _ = narrow.fit(NARROW);
        narrow
    }

    fn colour(&self, round: usize) -> Rgb {
        let scale = ColourScale { top: 1.0 };
        scale.colour(DARKER_PART * round as f64 / (self.rounds.len().max(2) - 1) as f64)
    }

    /// Least and largest place along an axis with a margin, mm.
    fn range(&self, axis: usize) -> (f64, f64) {
        let along =
            self.rounds.iter().flat_map(|round| &round.places).map(|(at_mm, _)| at_mm[axis]);
        let (low, high) = along
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)));
        if low > high {
            return (0.0, 1.0);
        }
        let margin = (0.05 * (high - low)).max(1.0);
        (low - margin, high + margin)
    }

    fn legend_widths(&self) -> Vec<f64> {
        self.rounds.iter().map(|round| 34.0 + 7.0 * round.name.chars().count() as f64).collect()
    }

    fn mark(
        &self,
        canvas: &mut Canvas,
        round: usize,
        at: (f64, f64),
        is_flown: bool,
    ) -> Result<(), CanvasError> {
        let colour = self.colour(round);
        match (is_flown, self.rounds[round].is_fresh) {
            (true, _) => diamond(canvas, at, 1.4 * MARK, colour),
            (false, true) => triangle(canvas, at, 1.8 * MARK, colour),
            (false, false) => dot(canvas, at, MARK, colour),
        }
    }

    fn draw_view(
        &self,
        canvas: &mut Canvas,
        axes: &Axes,
        vertical: usize,
    ) -> Result<(), CanvasError> {
        for (number, round) in self.rounds.iter().enumerate() {
            for (at_mm, is_flown) in &round.places {
                self.mark(canvas, number, axes.place(at_mm[0], at_mm[vertical]), *is_flown)?;
            }
        }
        Ok(())
    }
}

impl Picture for RoundPlaces {
    fn size(&self) -> (u32, u32) {
        self.row.size()
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        let legend = self.legend_widths();
        self.row.fit(width, &legend)
    }

    fn description(&self) -> String {
        let rounds: Vec<String> = self
            .rounds
            .iter()
            .map(|round| format!("{} at {} places", round.name, round.places.len()))
            .collect();
        format!(
            "Places of the readings from above and from the side, coloured by round: {}. The table below has their ranges.",
            rounds.join(", ")
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        for (panel, (axis, title, label)) in
            [(1, "from above", "y (mm)"), (2, "from the side", "z (mm)")].into_iter().enumerate()
        {
            let axes = self.row.axes(panel, self.range(0), self.range(axis));
            self.draw_view(canvas, &axes, axis)?;
            panel_row::frame(canvas, &axes, title, label)?;
            axes.x_axis(canvas, "x (mm)")?;
        }
        let widths = self.legend_widths();
        for (number, round) in self.rounds.iter().enumerate() {
            let (x, y) = self.row.legend_place(number, &widths);
            self.mark(canvas, number, (x + 8.0, y), false)?;
            canvas.text(&round.name, (x + 18.0, y), LABEL_TEXT, Align::Right)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Drawn;
    use super::*;

    #[test]
    fn each_round_has_its_colour_at_its_places() {
        let round = |name: &str, is_fresh, at_mm| PlacesOfRound {
            name: name.to_owned(),
            is_fresh,
            places: vec![(at_mm, false)],
        };
        let places = RoundPlaces::new(vec![
            round("round 0", false, [-20.0, -20.0, 60.0]),
            round("round 1", false, [20.0, 20.0, 140.0]),
            round("round 2", true, [20.0, -20.0, 60.0]),
        ]);
        let drawn = Drawn::new(&places).expect("drawn");
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let pixel = |view: usize, axis: usize, x: f64, along: f64| {
            let axes = places.row.axes(view, places.range(0), places.range(axis));
            let (x, y) = axes.place(x, along);
            let image::Rgb(rgb) = *image.get_pixel((2.0 * x) as u32, (2.0 * y) as u32);
            (rgb[0], rgb[1], rgb[2])
        };
        assert_eq!(pixel(0, 1, -20.0, -20.0), places.colour(0));
        assert_eq!(pixel(0, 1, 20.0, 20.0), places.colour(1));
        assert_eq!(pixel(1, 2, 20.0, 60.0), places.colour(2));
        assert_eq!(pixel(1, 2, 0.0, 100.0), (255, 255, 255));
        // A diamond is wider than a dot at the height of its middle.
        let mut flown = places.clone();
        flown.rounds[1].places[0].1 = true;
        let coloured = |places: &RoundPlaces| {
            let drawn = Drawn::new(places).expect("drawn");
            let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
            let (x, y) = places.row.axes(0, places.range(0), places.range(1)).place(20.0, 20.0);
            let (x, y) = ((2.0 * x) as u32, (2.0 * y) as u32);
            let is_drawn = |at: &u32| image.get_pixel(*at, y).0 != [255, 255, 255];
            (x - 15..x + 15).filter(is_drawn).count()
        };
        assert!(coloured(&flown) > coloured(&places));
        assert!(places.narrow().size().0 < 450);
    }
}
