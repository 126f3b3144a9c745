//! The cell of each visit of a plan on a map.

use std::collections::BTreeMap;

use fieldgap_records::{Layers, Plan, PlanPart, Shape, Visit, VisitKind};

/// The readings of one focus in one plane or along one line, as cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    /// Title.
    pub label: String,
    /// Cells along x, or of a line.
    pub columns: usize,
    /// Cells along y; 1 for a line.
    pub rows: usize,
    cells: Vec<Option<f64>>,
}

/// The sheets of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheets {
    sheets: Vec<Sheet>,
    /// Sheet and cell of each visit; `None` for dark readings and references.
    places: Vec<Option<(usize, usize)>>,
}

impl Sheet {
    fn new(label: String, columns: usize, rows: usize) -> Self {
        Self { label, columns, rows, cells: vec![None; columns * rows] }
    }

    /// The reading of a cell, if it is measured.
    pub fn reading(&self, column: usize, row: usize) -> Option<f64> {
        self.cells[row * self.columns + column]
    }

    /// The largest reading so far.
    pub fn largest(&self) -> Option<f64> {
        self.cells.iter().flatten().copied().max_by(f64::total_cmp)
    }

    /// The sheet as at most `width` by `height` pixels. The first row is at the top, where y is largest. All cells have the
    /// same size: several pixels per cell, or the mean of several cells per pixel.
    pub(super) fn pixels(&self, width: usize, height: usize) -> Vec<Vec<Option<f64>>> {
        if width == 0 || height == 0 {
            return Vec::new();
        }
        let larger = (width / self.columns).min(height / self.rows);
        if larger > 0 {
            let at = |x: usize, y: usize| self.reading(x / larger, self.rows - 1 - y / larger);
            return (0..self.rows * larger)
                .map(|y| (0..self.columns * larger).map(|x| at(x, y)).collect())
                .collect();
        }
        let cells = self.columns.div_ceil(width).max(self.rows.div_ceil(height));
        (0..self.rows.div_ceil(cells))
            .map(|y| (0..self.columns.div_ceil(cells)).map(|x| self.mean(x, y, cells)).collect())
            .collect()
    }

    /// Mean of the readings in a square of cells, counted from the top left.
    fn mean(&self, x: usize, y: usize, cells: usize) -> Option<f64> {
        let columns = x * cells..((x + 1) * cells).min(self.columns);
        let (mut sum, mut count) = (0.0, 0.0);
        for from_top in y * cells..((y + 1) * cells).min(self.rows) {
            let row = self.rows - 1 - from_top;
            for reading in columns.clone().filter_map(|column| self.reading(column, row)) {
                sum += reading;
                count += 1.0;
            }
        }
        (count > 0.0).then(|| sum / count)
    }
}

impl Sheets {
    /// The sheets of the visits of a plan, empty, in the order of measurement.
    pub fn of(plan: &Plan, visits: &[Visit]) -> Self {
        let mut numbers: BTreeMap<(usize, usize, usize), usize> = BTreeMap::new();
        // Number of points so far of each list or line; its cells are in order.
        let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
        let mut sheets: Vec<Sheet> = Vec::new();
        let places = visits
            .iter()
            .map(|visit| {
                let (VisitKind::Point, PlanPart::Region(index), Some(focus)) =
                    (visit.kind, visit.part, visit.focus)
                else {
                    return None;
                };
                let shape = &plan.regions[index].shape;
                let (layer, at_cell) = match shape {
                    Shape::Planes(layers) | Shape::Volume(layers) => {
                        let (layer, cell) = cell_of(layers, visit);
                        (layer, Some(cell))
                    }
                    Shape::Line { .. } | Shape::Points(_) => (0, None),
                };
                let sheet = *numbers.entry((index, focus, layer)).or_insert_with(|| {
                    sheets.push(sheet_of(shape, focus, layer));
                    sheets.len() - 1
                });
                let cell = at_cell.unwrap_or_else(|| {
                    let count = counts.entry(sheet).or_default();
                    *count += 1;
                    *count - 1
                });
                Some((sheet, cell))
            })
            .collect();
        Self { sheets, places }
    }

    /// Stores the reading of a visit, and returns its sheet if it has one.
    pub fn set(&mut self, visit: usize, reading: f64) -> Option<usize> {
        let (sheet, cell) = *self.places.get(visit)?.as_ref()?;
        *self.sheets[sheet].cells.get_mut(cell)? = Some(reading);
        Some(sheet)
    }

    /// The sheets.
    pub fn all(&self) -> &[Sheet] {
        &self.sheets
    }
}

/// Layer and cell of a visit on a grid.
fn cell_of(layers: &Layers, visit: &Visit) -> (usize, usize) {
    let at_mm = visit.position_m * 1e3;
    let index = |axis: &fieldgap_records::Axis, at_mm: f64| {
        let step = ((at_mm - axis.first_mm) / axis.step_mm).round().max(0.0) as usize;
        step.min(axis.count - 1)
    };
    let away = |layer: &usize| (layers.z_mm[*layer] - at_mm.z).abs();
    let layer = (0..layers.z_mm.len())
        .min_by(|a, b| away(a).total_cmp(&away(b)))
        .expect("a grid has a layer");
    (layer, index(&layers.y, at_mm.y) * layers.x.count + index(&layers.x, at_mm.x))
}

fn sheet_of(shape: &Shape, focus: usize, layer: usize) -> Sheet {
    match shape {
        Shape::Planes(layers) | Shape::Volume(layers) => {
            let label = format!("focus {focus}, z = {:.1} mm", layers.z_mm[layer]);
            Sheet::new(label, layers.x.count, layers.y.count)
        }
        Shape::Line { count, .. } => Sheet::new(format!("focus {focus}, a line"), *count, 1),
        Shape::Points(points) => {
            Sheet::new(format!("focus {focus}, a list of points"), points.len(), 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use fieldgap_input::TomlSource;

    fn plan(regions: &str) -> Plan {
        let head = "name = \"p\"\n[simulator]\nmodel = \"corrected\"\n\
                    [[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 100.0\n[dark]\nbefore = 1\n";
        Plan::parse(TomlSource::new(Path::new("p.toml"), format!("{head}{regions}"))).expect("good")
    }

    #[test]
    fn a_serpentine_fills_its_cells_by_place() {
        let plan = plan("[[plane]]\nz_mm = [50, 100]\nsize_mm = [4, 2]\nstep_mm = 2\n");
        let visits = plan.visits();
        let mut sheets = Sheets::of(&plan, &visits);
        assert_eq!(sheets.set(0, 9.0), None, "a dark reading has no cell");
        for (visit, about) in visits.iter().enumerate().skip(1) {
            let at_mm = about.position_m * 1e3;
            let sheet = sheets.set(visit, at_mm.x + 10.0 * at_mm.y + 100.0 * at_mm.z);
            assert_eq!(sheet, Some(usize::from(at_mm.z > 60.0)));
        }
        let [low, high] = sheets.all() else { panic!("two planes") };
        assert_eq!((low.columns, low.rows), (3, 2));
        assert_eq!(high.label, "focus 0, z = 100.0 mm");
        for (sheet, z_mm) in [(low, 50.0), (high, 100.0)] {
            for (column, x_mm) in [-2.0, 0.0, 2.0].into_iter().enumerate() {
                for (row, y_mm) in [-1.0, 1.0].into_iter().enumerate() {
                    let reading = sheet.reading(column, row).expect("all is measured");
                    assert!((reading - (x_mm + 10.0 * y_mm + 100.0 * z_mm)).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn a_line_is_one_row_in_its_order() {
        let plan = plan("[[line]]\nfrom_mm = [0, 0, 50]\nto_mm = [0, 0, 60]\nstep_mm = 5\n");
        let visits = plan.visits();
        let mut sheets = Sheets::of(&plan, &visits);
        for visit in 0..visits.len() {
            sheets.set(visit, visit as f64);
        }
        let [line] = sheets.all() else { panic!("one line") };
        assert_eq!((line.columns, line.rows), (3, 1));
        assert_eq!(
            (0..3).map(|c| line.reading(c, 0)).collect::<Vec<_>>(),
            [1.0, 2.0, 3.0].map(Some)
        );
        assert_eq!(sheets.set(99, 1.0), None);
    }

    #[test]
    fn pixels_repeat_cells_or_average_them_with_y_upwards() {
        let mut sheet = Sheet::new("s".into(), 2, 2);
        sheet.cells = vec![Some(1.0), Some(2.0), Some(3.0), None];
        let at_top = |pixels: &[Vec<Option<f64>>]| pixels[0].clone();
        let pixels = sheet.pixels(5, 4);
        assert_eq!((pixels.len(), pixels[0].len()), (4, 4));
        assert_eq!(at_top(&pixels), [Some(3.0), Some(3.0), None, None]);
        assert_eq!(sheet.pixels(1, 9), [[Some(2.0)]]);
        assert!(sheet.pixels(0, 3).is_empty());
    }
}
