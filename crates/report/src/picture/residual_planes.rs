//! The residuals of a model at several heights.

use super::Picture;
use super::axes::LABEL_TEXT;
use super::diverging_scale::DivergingScale;
use super::map_layout::MapLayout;
use fieldgap_acoustics::metrics::PlaneMap;
use fieldgap_canvas::{Align, Canvas, CanvasError};

/// Panels, at most.
const MOST: usize = 4;
/// Where the colours end, in rms residuals.
const REACH: f64 = 4.0;

/// Reading minus model at a few heights, divided by the rms residual over all readings.
pub(crate) struct ResidualPlanes {
    planes: Vec<(f64, PlaneMap)>,
    layout: MapLayout,
}

impl ResidualPlanes {
    /// The maps of some heights (millimetres) on one grid: the lowest, the highest and those between, evenly; `None` if there
    /// is none.
    pub fn new(planes: Vec<(f64, PlaneMap)>) -> Option<Self> {
        let (_, first) = planes.first()?;
        let (x, y) = (first.x_m().to_vec(), first.y_m().to_vec());
        let alike: Vec<(f64, PlaneMap)> = planes
            .into_iter()
            .filter(|(_, map)| map.x_m().len() == x.len() && map.y_m().len() == y.len())
            .collect();
        let panels = alike.len().min(MOST);
        let chosen: Vec<usize> =
            (0..panels).map(|panel| panel * (alike.len() - 1) / (panels - 1).max(1)).collect();
        let planes = chosen.into_iter().map(|index| alike[index].clone()).collect();
        Some(Self { planes, layout: MapLayout::new(&x, &y)? })
    }
}

impl Picture for ResidualPlanes {
    fn size(&self) -> (u32, u32) {
        self.layout.size(self.planes.len())
    }

    fn description(&self) -> String {
        let heights: Vec<String> = self.planes.iter().map(|(z, _)| format!("{z:.1}")).collect();
        format!("Maps over x and y of reading minus model at {} mm.", heights.join(", "))
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let scale = DivergingScale { reach: REACH };
        let colour = |value| scale.colour(value);
        for (index, (z_mm, map)) in self.planes.iter().enumerate() {
            let title = format!("z = {z_mm:.1} mm");
            let axes = self.layout.map(canvas, index, &title, map.values(), colour)?;
            let contrast = |value| scale.contrast(value);
            self.layout.signs(canvas, &axes, map.values(), 0.75 * REACH, contrast)?;
        }
        let label = "reading \u{2212} model (in rms residuals)";
        self.layout.colour_bar(canvas, self.planes.len() - 1, (-REACH, REACH), label, colour)?;
        let at = (self.layout.panel(0).corner.0, f64::from(self.size().1) - 18.0);
        canvas.text(
            "+ reading louder, \u{2212} quieter, by more than 3",
            at,
            LABEL_TEXT,
            Align::Right,
        )
    }
}
