//! One simulated field of a study.

use super::Picture;
use super::axes::LABEL_TEXT;
use super::colour_scale::ColourScale;
use super::map_layout::MapLayout;
use super::marker::{Series, focus_on_map};
use fieldgap_acoustics::metrics::{PlaneMap, peak};
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_canvas::{Align, Canvas, CanvasError};

/// The field at one combination of a study's values.
pub(crate) struct StudyField<'a> {
    title: String,
    map: &'a PlaneMap,
    focus_m: Option<Vec3>,
    layout: MapLayout,
    scale: ColourScale,
}

impl<'a> StudyField<'a> {
    /// A map under a title, with a mark over the focus.
    pub fn new(title: String, map: &'a PlaneMap, focus_m: Option<Vec3>) -> Option<Self> {
        let layout = MapLayout::new(map.x_m(), map.y_m())?;
        let top = map.values().iter().copied().fold(0.0, f64::max);
        let scale = ColourScale { top: if top > 0.0 { top } else { 1.0 } };
        Some(Self { title, map, focus_m, layout, scale })
    }
}

impl Picture for StudyField<'_> {
    fn size(&self) -> (u32, u32) {
        self.layout.size(1)
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        self.layout.fit(1, width)
    }

    fn description(&self) -> String {
        format!("Map over x and y of the simulated pressure, {}.", self.title)
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let colour = |value| self.scale.colour(value);
        let axes = self.layout.map(canvas, 0, &self.title, self.map.values(), colour)?;
        let y = f64::from(self.size().1) - 18.0;
        if let Some(top) = peak(self.map).filter(|top| !top.at_edge) {
            let series = Series::Simulated(Simulator::Corrected);
            series.mark_on_map(canvas, axes.place(top.x_m * 1e3, top.y_m * 1e3))?;
            let x = axes.corner.0 + 8.0;
            series.mark_on_map(canvas, (x, y))?;
            canvas.text("peak", (x + 17.0, y), LABEL_TEXT, Align::Right)?;
        }
        let focus_mm = self.focus_m.map(|focus_m| focus_m * 1e3);
        if let Some(focus_mm) = focus_mm.filter(|focus_mm| axes.holds(focus_mm.x, focus_mm.y)) {
            focus_on_map(canvas, axes.place(focus_mm.x, focus_mm.y))?;
            let x = axes.corner.0 + 108.0;
            focus_on_map(canvas, (x, y))?;
            canvas.text("focus", (x + 17.0, y), LABEL_TEXT, Align::Right)?;
        }
        let range = (0.0, self.scale.top);
        self.layout.colour_bar(canvas, 0, range, "pressure (simulator's unit)", colour)
    }
}
