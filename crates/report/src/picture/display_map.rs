//! A plane of a display: sound pressure or radiation pressure on skin, with the foci and their paths.

use super::Picture;
use super::axes::LABEL_TEXT;
use super::colour_scale::ColourScale;
use super::map_layout::MapLayout;
use super::marker::focus_on_map;
use fieldgap_acoustics::PlaneGrid;
use fieldgap_canvas::{Align, Canvas, CanvasError, Pen, Point, WHITE};

/// One map.
pub(crate) struct DisplayPanel {
    /// The title above it.
    pub title: String,
    /// The colour bar's label.
    pub label: String,
    /// Row by row.
    pub values: Vec<f64>,
    /// The value of the lightest colour.
    pub top: f64,
    /// The positions of the foci, x and y, mm.
    pub foci_mm: Vec<Point>,
}

/// Maps of a plane, one or two.
pub(crate) struct DisplayMap {
    maps: Vec<DisplayPanel>,
    /// The paths of the foci, x and y, mm.
    paths_mm: Vec<Vec<Point>>,
    layout: MapLayout,
}

impl DisplayMap {
    /// One or two maps of a grid; `None` for a grid without points.
    pub fn new(
        grid: &PlaneGrid,
        maps: Vec<DisplayPanel>,
        paths_mm: Vec<Vec<Point>>,
    ) -> Option<Self> {
        let layout = MapLayout::new(&grid.x_m, &grid.y_m)?;
        let layout = if maps.len() > 1 { layout.with_bar_after_first() } else { layout };
        Some(Self { maps, paths_mm, layout })
    }
}

impl Picture for DisplayMap {
    fn size(&self) -> (u32, u32) {
        self.layout.size(self.maps.len())
    }

    fn description(&self) -> String {
        let titles: Vec<&str> = self.maps.iter().map(|map| map.title.as_str()).collect();
        format!("Maps over x and y: {}.", titles.join("; "))
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        for (index, map) in self.maps.iter().enumerate() {
            let scale = ColourScale { top: if map.top > 0.0 { map.top } else { 1.0 } };
            let axes = self
                .layout
                .map(canvas, index, &map.title, &map.values, |value| scale.colour(value))?;
            let pen = Pen { colour: WHITE, width: 1.0 };
            for path in &self.paths_mm {
                let inside = path.iter().all(|&(x, y)| axes.holds(x, y));
                let places: Vec<Point> = path.iter().map(|&(x, y)| axes.place(x, y)).collect();
                if inside && places.len() > 1 {
                    canvas.dashed(&places, &[2.0, 3.0], pen)?;
                }
            }
            for &(x, y) in map.foci_mm.iter().filter(|(x, y)| axes.holds(*x, *y)) {
                focus_on_map(canvas, axes.place(x, y))?;
            }
            let range = (0.0, scale.top);
            self.layout
                .colour_bar(canvas, index, range, &map.label, |value| scale.colour(value))?;
        }
        if self.maps.iter().any(|map| !map.foci_mm.is_empty()) {
            let at = (self.layout.panel(0).corner.0 + 8.0, f64::from(self.size().1) - 18.0);
            focus_on_map(canvas, at)?;
            canvas.text("focus", (at.0 + 17.0, at.1), LABEL_TEXT, Align::Right)?;
        }
        Ok(())
    }
}
