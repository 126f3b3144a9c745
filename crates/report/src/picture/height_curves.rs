//! Peak, focal radius and position of the peak as functions of height.

use super::axes::{Axes, LABEL_TEXT};
use super::marker::Series;
use super::panel_row::PanelRow;
use super::plane_maps::reading_label;
use super::{Picture, panel_row};
use crate::peak_distance::peak_distance_m;
use fieldgap_canvas::{Align, Canvas, CanvasError, GREY, Pen, Point};
use fieldgap_comparison::{Comparison, FieldFigures, PlaneComparison, Uncertain};

/// The curves of one drive over its heights.
pub(crate) struct HeightCurves {
    row: PanelRow,
    panels: Vec<Panel>,
    series: Vec<Series>,
    heights_mm: (f64, f64),
    focus_height_mm: Option<f64>,
}

struct Panel {
    title: &'static str,
    label: String,
    curves: Vec<(Series, Vec<CurvePoint>)>,
}

/// A value at a height.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CurvePoint {
    height_mm: f64,
    value: f64,
    /// Standard error; NaN where it is not known.
    error: f64,
    /// Whether no side is cut off and the peak is inside the map.
    complete: bool,
}

/// The figures of the scan or of a simulation, plane by plane.
type Field<'a> = (Series, Vec<(&'a PlaneComparison, &'a FieldFigures)>);

impl HeightCurves {
    /// The curves of a drive, the scan's with those of each simulator; `None` with fewer than two heights.
    pub fn new(comparisons: &[Comparison], focus: usize) -> Option<Self> {
        let first = comparisons.first()?;
        let own: Vec<&PlaneComparison> =
            first.planes.iter().filter(|plane| plane.focus == focus).collect();
        let heights_mm = range(own.iter().map(|plane| plane.z_m * 1e3))?;
        if heights_mm.0 == heights_mm.1 {
            return None;
        }
        let mut fields: Vec<Field> =
            vec![(Series::Scan, own.iter().map(|plane| (*plane, &plane.scan)).collect())];
        for comparison in comparisons {
            let planes = comparison.planes.iter().filter(|plane| plane.focus == focus);
            let figures = planes.map(|plane| (plane, &plane.simulation)).collect();
            fields.push((Series::Simulated(comparison.simulator), figures));
        }
        let targets = own.iter().find_map(|plane| plane.target_in_scan_m);
        let aside = match targets {
            Some(_) => Panel {
                title: "distance of the peak from the focal axis",
                label: "distance (mm)".to_owned(),
                curves: curves(&fields, distance_from_focus),
            },
            None => Panel {
                title: "distance of the peaks",
                label: "distance (mm)".to_owned(),
                curves: curves(&fields[1..], |plane, figures| {
                    let inside = !figures.peak_at_edge && !plane.scan.peak_at_edge;
                    Some((plane.discrepancy.peak_distance_m, 1e3, inside))
                }),
            },
        };
        let panels = vec![
            Panel {
                title: "peak",
                label: reading_label(&first.reading_unit),
                curves: curves(&fields, |_, figures| {
                    Some((figures.peak, 1.0, !figures.peak_at_edge))
                }),
            },
            Panel {
                title: "focal radius",
                label: "radius (mm)".to_owned(),
                curves: curves(&fields, |_, figures| {
                    let radius = figures.focal_radius.as_ref()?;
                    Some((radius.radius_m?, 1e3, radius.sides_m.iter().all(Option::is_some)))
                }),
            },
            aside,
        ];
        let row = PanelRow::new(panels.len());
        let series = fields.iter().map(|(series, _)| *series).collect();
        let focus_height_mm = targets.map(|target| target.z * 1e3);
        Some(Self { panels, row, series, heights_mm, focus_height_mm })
    }

    fn panel(&self, canvas: &mut Canvas, index: usize, panel: &Panel) -> Result<(), CanvasError> {
        let margin = 0.06 * (self.heights_mm.1 - self.heights_mm.0);
        let x = (self.heights_mm.0 - margin, self.heights_mm.1 + margin);
        let axes = self.row.axes(index, x, (0.0, panel.top()));
        if let Some(z) = self.focus_height_mm.filter(|&z| axes.holds(z, 0.0)) {
            let line = [axes.place(z, axes.y.0), axes.place(z, axes.y.1)];
            canvas.dashed(&line, &[1.0, 4.0], Pen { colour: GREY, width: 1.25 })?;
        }
        panel_row::frame(canvas, &axes, panel.title, &panel.label)?;
        axes.x_axis(canvas, "height z (mm)")?;
        // The scan last, on top.
        panel
            .curves
            .iter()
            .rev()
            .try_for_each(|(series, points)| curve(canvas, &axes, *series, points))
    }

    /// Widths of the entries of the legend: the series, and the focal height.
    fn legend_widths(&self) -> Vec<f64> {
        let of_series =
            self.series.iter().map(|series| 84.0 + 7.0 * series.name().chars().count() as f64);
        of_series.chain(self.focus_height_mm.map(|_| 110.0)).collect()
    }

    fn legend(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let widths = self.legend_widths();
        for (index, series) in self.series.iter().enumerate() {
            let (x, y) = self.row.legend_place(index, &widths);
            let pen = Pen { colour: series.colour(), width: 1.75 };
            canvas.dashed(&[(x, y), (x + 40.0, y)], series.dash(), pen)?;
            series.mark_on_curve(canvas, (x + 20.0, y), true)?;
            canvas.text(&series.name(), (x + 48.0, y), LABEL_TEXT, Align::Right)?;
        }
        if self.focus_height_mm.is_some() {
            let (x, y) = self.row.legend_place(self.series.len(), &widths);
            let line = [(x, y - 9.0), (x, y + 9.0)];
            canvas.dashed(&line, &[1.0, 4.0], Pen { colour: GREY, width: 1.25 })?;
            canvas.text("focal height", (x + 10.0, y), LABEL_TEXT, Align::Right)?;
        }
        Ok(())
    }
}

impl Panel {
    /// A little above the largest value with its error.
    fn top(&self) -> f64 {
        let reach = |point: &CurvePoint| {
            point.value + if point.error.is_finite() { point.error } else { 0.0 }
        };
        let largest = self.curves.iter().flat_map(|(_, points)| points.iter().map(reach));
        let top = largest.filter(|value| value.is_finite()).fold(0.0, f64::max);
        panel_row::a_little_above(top)
    }
}

impl Picture for HeightCurves {
    fn size(&self) -> (u32, u32) {
        self.row.size()
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        let legend = self.legend_widths();
        self.row.fit(width, &legend)
    }

    fn description(&self) -> String {
        let titles: Vec<&str> = self.panels.iter().map(|panel| panel.title).collect();
        let series: Vec<String> = self.series.iter().map(|series| series.name()).collect();
        format!("Curves against height of {}, for {}.", titles.join(", "), series.join(", "))
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        for (index, panel) in self.panels.iter().enumerate() {
            self.panel(canvas, index, panel)?;
        }
        self.legend(canvas)
    }
}

/// The curve of each field: `read` gives the value, the factor to the axis's unit, and whether it is complete.
fn curves(
    fields: &[Field],
    read: impl Fn(&PlaneComparison, &FieldFigures) -> Option<(Uncertain, f64, bool)>,
) -> Vec<(Series, Vec<CurvePoint>)> {
    let point = |plane: &PlaneComparison, figures: &FieldFigures| {
        let (read, factor, complete) = read(plane, figures)?;
        let (value, error) = (read.value * factor, read.standard_error * factor);
        value.is_finite().then_some(CurvePoint {
            height_mm: plane.z_m * 1e3,
            value,
            error,
            complete,
        })
    };
    fields
        .iter()
        .map(|(series, planes)| {
            (*series, planes.iter().filter_map(|(plane, figures)| point(plane, figures)).collect())
        })
        .collect()
}

/// The distance of the peak from the vertical axis through the focus.
fn distance_from_focus(
    plane: &PlaneComparison,
    figures: &FieldFigures,
) -> Option<(Uncertain, f64, bool)> {
    let target_m = plane.target_in_scan_m?;
    let distance = peak_distance_m(figures.peak_position_m, (target_m.x, target_m.y));
    Some((distance, 1e3, !figures.peak_at_edge))
}

/// A line through the points, their error bars and marks.
fn curve(
    canvas: &mut Canvas,
    axes: &Axes,
    series: Series,
    points: &[CurvePoint],
) -> Result<(), CanvasError> {
    let pen = Pen { colour: series.colour(), width: 1.75 };
    let line: Vec<Point> = points.iter().map(|p| axes.place(p.height_mm, p.value)).collect();
    canvas.dashed(&line, series.dash(), pen)?;
    for point in points {
        let at = axes.place(point.height_mm, point.value);
        if point.error.is_finite() && point.error > 0.0 {
            let (_, high) = axes.place(point.height_mm, point.value + point.error);
            let (_, low) = axes.place(point.height_mm, (point.value - point.error).max(axes.y.0));
            canvas.line((at.0, low), (at.0, high), pen)?;
            for y in [low, high] {
                canvas.line((at.0 - 5.0, y), (at.0 + 5.0, y), pen)?;
            }
        }
        series.mark_on_curve(canvas, at, point.complete)?;
    }
    Ok(())
}

/// Least and largest of some finite values.
fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .filter(|value| value.is_finite())
        .map(|value| (value, value))
        .reduce(|(least, largest), (value, _)| (least.min(value), largest.max(value)))
}
