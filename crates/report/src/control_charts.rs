//! Pictures of control charts as files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use fieldgap_monitoring::{ChartPoint, Scope};

use super::error::ReportError;
use super::figure::Figure;
use super::folder::Folder;
use super::picture::{ControlChart, Drawn, PrintStyle};

/// Writes a picture of every chart as PNG and SVG into `dir`, in the order of figures, then cells; the chart of all cells is the last of
/// its figure. Gives the paths.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or written.
pub fn write_control_charts(
    dir: &Path,
    points: &[ChartPoint],
    style: PrintStyle,
) -> Result<Vec<PathBuf>, ReportError> {
    let mut charts: BTreeMap<(&str, &Scope), Vec<ChartPoint>> = BTreeMap::new();
    for point in points {
        charts.entry((&point.figure, &point.scope)).or_default().push(point.clone());
    }
    let mut figures = Vec::new();
    for ((figure, scope), points) in &charts {
        if let Some(chart) = ControlChart::new(points) {
            figures.push(Figure::new(file_name(figure, scope), Drawn::printed(chart, style)?));
        }
    }
    Folder::make(dir)?.put_figures(figures.iter())
}

/// A name with nothing that a file system treats in its own way.
fn file_name(figure: &str, scope: &Scope) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    format!("chart-{figure}-{scope}").chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_cells_do_not_lead_elsewhere() {
        let name = file_name("z100.focus0.peak_offset_mm", &Scope::Cell("../22 °C".to_owned()));
        assert_eq!(name, "chart-z100.focus0.peak-offset-mm-cell-..-22--C");
    }
}
