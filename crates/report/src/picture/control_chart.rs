//! A figure over time with its baseline, and below it the statistic of its control chart with the limits.

use jiff::Timestamp;

use super::Picture;
use super::axes::{Axes, LABEL_TEXT, TICK_TEXT};
use super::marker::Series;
use super::study_curves::axis_label;
use super::time_axis::time_ticks;
use fieldgap_canvas::{Align, BLACK, Canvas, CanvasError, GREY, Pen, Point, Rgb};
use fieldgap_monitoring::{ChartPoint, Sides};

const LEFT_ROOM: f64 = 84.0;
const RIGHT_ROOM: f64 = 24.0;
const TOP_ROOM: f64 = 34.0;
const FIGURE_HEIGHT: f64 = 200.0;
const BETWEEN: f64 = 22.0;
const STATISTIC_HEIGHT: f64 = 150.0;
const BOTTOM_ROOM: f64 = 86.0;
const USUAL_WIDTH: f64 = 760.0;
const LEAST_WIDTH: f64 = 420.0;

/// Baseline within two standard errors.
const BAND: Rgb = (214, 228, 240);
/// Limits and alarms: vermilion of Okabe and Ito, which colour-blind readers can distinguish from the rest.
const ALARM: Rgb = (213, 94, 0);

/// The chart of one figure of one cell, or of all cells.
pub(crate) struct ControlChart<'a> {
    points: Vec<&'a ChartPoint>,
    title: String,
    width: f64,
}

impl<'a> ControlChart<'a> {
    /// Of points of one chart, in any order; `None` without any.
    pub fn new(points: &'a [ChartPoint]) -> Option<Self> {
        let mut points: Vec<&ChartPoint> = points.iter().collect();
        points.sort_by_key(|point| point.at);
        let first = points.first()?;
        let title = format!("{}, {}", first.figure, first.scope);
        Some(Self { points, title, width: USUAL_WIDTH })
    }

    fn times(&self) -> (f64, f64) {
        let seconds = |point: &ChartPoint| point.at.as_second() as f64;
        let first = self.points.first().map_or(0.0, |point| seconds(point));
        let last = self.points.last().map_or(0.0, |point| seconds(point));
        let margin = (0.02 * (last - first)).max(600.0);
        (first - margin, last + margin)
    }

    /// The upper axes: the figure itself, or its differences from the baselines of the cells in standard errors.
    fn figure_axes(&self) -> Axes {
        let ends = self.points.iter().flat_map(|point| {
            let (value, error) = shown(point);
            let band = band(point);
            [value - error, value + error].into_iter().chain(band.into_iter().flatten())
        });
        self.axes(TOP_ROOM, FIGURE_HEIGHT, ends)
    }

    fn statistic_axes(&self) -> Axes {
        let ends = self.points.iter().flat_map(|point| {
            let limits = limits(point);
            point.statistic.into_iter().chain([0.0]).chain(limits)
        });
        self.axes(TOP_ROOM + FIGURE_HEIGHT + BETWEEN, STATISTIC_HEIGHT, ends)
    }

    fn axes(&self, top: f64, height: f64, values: impl Iterator<Item = f64>) -> Axes {
        let finite = values.filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let margin = if high > low { 0.08 * (high - low) } else { 0.5 * high.abs().max(1e-3) };
        Axes {
            corner: (LEFT_ROOM, top),
            width: self.width - LEFT_ROOM - RIGHT_ROOM,
            height,
            x: self.times(),
            y: (low - margin, high + margin),
        }
    }

    fn draw_figure(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let axes = self.figure_axes();
        let at = |point: &ChartPoint, value: f64| axes.place(point.at.as_second() as f64, value);
        let bands: Vec<(&ChartPoint, [f64; 2])> =
            self.points.iter().filter_map(|point| Some((*point, band(point)?))).collect();
        for pair in bands.windows(2) {
            let [(before, [from_low, from_high]), (after, [to_low, to_high])] = *pair else {
                continue;
            };
            let corners = [
                at(before, from_low),
                at(before, from_high),
                at(after, to_high),
                at(after, to_low),
            ];
            canvas.fill(&corners, BAND)?;
        }
        for pair in bands.windows(2) {
            let middle =
                |(point, [low, high]): (&ChartPoint, [f64; 2])| at(point, 0.5 * (low + high));
            canvas.line(middle(pair[0]), middle(pair[1]), Pen { colour: GREY, width: 1.5 })?;
        }
        for point in &self.points {
            let (value, error) = shown(point);
            if !value.is_finite() {
                continue;
            }
            let colour = if point.alarm { ALARM } else { BLACK };
            let pen = Pen { colour, width: 1.5 };
            if error.is_finite() && error > 0.0 {
                let (low, high) = (at(point, value - error), at(point, value + error));
                canvas.line(low, high, pen)?;
                for end in [low, high] {
                    canvas.line((end.0 - 3.0, end.1), (end.0 + 3.0, end.1), pen)?;
                }
            }
            mark(canvas, at(point, value), point.alarm)?;
        }
        axes.frame(canvas)?;
        let label = match of_all_cells(self.points[0]) {
            true => "z (standard errors)".to_owned(),
            false => {
                let name = self.points[0].figure.rsplit('.').next().unwrap_or_default();
                axis_label(&[name.to_owned()])
            }
        };
        axes.y_axis(canvas, &label)?;
        time_ticks(canvas, &axes, false)
    }

    fn draw_statistic(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let axes = self.statistic_axes();
        let (from, to) = axes.x;
        let zero = Pen { colour: GREY, width: 1.0 };
        canvas.line(axes.place(from, 0.0), axes.place(to, 0.0), zero)?;
        let pen = Pen { colour: ALARM, width: 1.5 };
        for limit in limits(self.points[0]) {
            canvas.dashed(&[axes.place(from, limit), axes.place(to, limit)], &[8.0, 4.0], pen)?;
        }
        let place =
            |point: &ChartPoint, statistic| axes.place(point.at.as_second() as f64, statistic);
        // No line across runs that could not be judged.
        for part in self.points.split(|point| point.statistic.is_none()) {
            let line: Vec<Point> =
                part.iter().filter_map(|point| Some(place(point, point.statistic?))).collect();
            canvas.dashed(&line, &[], Pen { colour: BLACK, width: 1.5 })?;
        }
        for point in &self.points {
            if let Some(statistic) = point.statistic {
                mark(canvas, place(point, statistic), point.alarm)?;
            }
        }
        axes.frame(canvas)?;
        axes.y_axis(canvas, "statistic")?;
        time_ticks(canvas, &axes, true)?;
        let middle = axes.corner.0 + axes.width / 2.0;
        let bottom = axes.corner.1 + axes.height;
        canvas.text("time (UTC)", (middle, bottom + 26.0), LABEL_TEXT, Align::Below)
    }

    fn draw_legend(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let y = f64::from(self.size().1) - 20.0;
        let mut x = LEFT_ROOM;
        if !of_all_cells(self.points[0]) {
            let corners = [(x, y - 6.0), (x + 22.0, y - 6.0), (x + 22.0, y + 6.0), (x, y + 6.0)];
            canvas.fill(&corners, BAND)?;
            canvas.line((x, y), (x + 22.0, y), Pen { colour: GREY, width: 1.5 })?;
            canvas.text("baseline ± 2 errors", (x + 28.0, y), TICK_TEXT, Align::Right)?;
            x += 174.0;
        }
        canvas.dashed(&[(x, y), (x + 26.0, y)], &[8.0, 4.0], Pen { colour: ALARM, width: 1.5 })?;
        canvas.text("limit", (x + 32.0, y), TICK_TEXT, Align::Right)?;
        mark(canvas, (x + 92.0, y), true)?;
        canvas.text("alarm", (x + 104.0, y), TICK_TEXT, Align::Right)
    }
}

/// What the upper panel shows of a point: the figure with its error, or z with error 1 where cells of different size are together.
fn shown(point: &ChartPoint) -> (f64, f64) {
    match of_all_cells(point) {
        true => (point.z.unwrap_or(f64::NAN), 1.0),
        false => (point.value.value, point.value.standard_error),
    }
}

fn of_all_cells(point: &ChartPoint) -> bool {
    !matches!(point.scope, fieldgap_monitoring::Scope::Cell(_))
}

/// Baseline less and plus two of its standard errors.
fn band(point: &ChartPoint) -> Option<[f64; 2]> {
    let baseline = point.baseline.filter(|_| !of_all_cells(point))?;
    let error = if baseline.standard_error.is_finite() { baseline.standard_error } else { 0.0 };
    Some([baseline.value - 2.0 * error, baseline.value + 2.0 * error])
}

/// The limits that count.
fn limits(point: &ChartPoint) -> Vec<f64> {
    match point.sides {
        Sides::Rises => vec![point.limit],
        Sides::Falls => vec![-point.limit],
        Sides::Both => vec![point.limit, -point.limit],
    }
}

/// A run: a black circle, or a larger vermilion square if it gave an alarm.
fn mark(canvas: &mut Canvas, at: Point, alarm: bool) -> Result<(), CanvasError> {
    if alarm {
        return Series::Numbered(1).mark_on_curve(canvas, at, true);
    }
    let corners: Vec<Point> = (0..16)
        .map(|corner| {
            let angle = std::f64::consts::TAU * f64::from(corner) / 16.0;
            (at.0 + 3.0 * angle.cos(), at.1 + 3.0 * angle.sin())
        })
        .collect();
    canvas.fill(&corners, BLACK)
}

impl Picture for ControlChart<'_> {
    fn size(&self) -> (u32, u32) {
        let height = TOP_ROOM + FIGURE_HEIGHT + BETWEEN + STATISTIC_HEIGHT + BOTTOM_ROOM;
        (self.width as u32, height as u32)
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        if width < LEAST_WIDTH {
            return Err(LEAST_WIDTH);
        }
        self.width = width;
        Ok(())
    }

    fn description(&self) -> String {
        let alarms = self.points.iter().filter(|point| point.alarm).count();
        let day = |at: Timestamp| at.strftime("%Y-%m-%d").to_string();
        format!(
            "Control chart of {}: {} runs from {} to {}, {} beyond the limit.",
            self.title,
            self.points.len(),
            day(self.points[0].at),
            day(self.points[self.points.len() - 1].at),
            if alarms == 0 { "none".to_owned() } else { alarms.to_string() }
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        canvas.text(&self.title, (LEFT_ROOM, TOP_ROOM - 8.0), LABEL_TEXT, Align::AboveRight)?;
        self.draw_figure(canvas)?;
        self.draw_statistic(canvas)?;
        self.draw_legend(canvas)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Drawn;
    use fieldgap_monitoring::{Baseline, Environment, Monitor, Run, Scope, Settings};
    use fieldgap_text::Uncertain;

    /// A gap that is a tenth larger from the twentieth run on.
    fn points() -> Vec<ChartPoint> {
        let run = |number: i64| {
            let noise = 0.0011 * ((7 * number % 11) as f64 - 5.0) / 3.0;
            let value = if number < 20 { 0.18 } else { 0.19 } + noise;
            Run {
                cell: ["near", "far"][number as usize % 2].to_owned(),
                at: Timestamp::from_second(1_795_000_000 + 7200 * number).expect("in range"),
                temperature_c: None,
                figures: [("gap".to_owned(), Uncertain { value, standard_error: 0.001 })].into(),
            }
        };
        let first: Vec<Run> = (0..8).map(run).collect();
        let baseline = Baseline::of_runs(&first, Environment::default()).expect("figures");
        let later: Vec<Run> = (8..26).map(run).collect();
        let (_, judged) = Monitor::replay(Settings::default(), &baseline, &later, &[]);
        judged.into_iter().flat_map(|judgement| judgement.charts).collect()
    }

    fn of_scope(scope: &Scope) -> Vec<ChartPoint> {
        points().into_iter().filter(|point| point.scope == *scope).collect()
    }

    #[test]
    fn the_chart_shows_limits_and_alarms() {
        let near = of_scope(&Scope::Cell("near".to_owned()));
        let chart = ControlChart::new(&near).expect("points");
        let drawn = Drawn::new(&chart).expect("drawn");
        for label in ["gap, cell near", "time (UTC)", "statistic", "baseline ± 2 errors", "19 Nov"]
        {
            assert!(drawn.svg.contains(label), "{label}");
        }
        let alarms = near.iter().filter(|point| point.alarm).count();
        assert!(alarms > 0 && drawn.description.contains(&format!("{alarms} beyond the limit")));
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let axes = chart.statistic_axes();
        let (x, y) = axes.place(axes.x.0, near[0].limit);
        let image::Rgb([red, green, blue]) =
            *image.get_pixel((2.0 * x) as u32 + 6, (2.0 * y) as u32);
        assert_eq!((red, green, blue), ALARM, "the limit is where it belongs");
        let last = near.last().expect("points");
        let place = axes.place(last.at.as_second() as f64, last.statistic.expect("judged"));
        let centre = image.get_pixel((2.0 * place.0) as u32, (2.0 * place.1) as u32);
        assert_eq!(centre.0, [ALARM.0, ALARM.1, ALARM.2], "the alarm is marked");
    }

    #[test]
    fn the_chart_of_all_cells_and_narrow_ones_are_drawn() {
        let all = of_scope(&Scope::AllCells);
        let mut chart = ControlChart::new(&all).expect("points");
        assert!(Drawn::new(&chart).expect("drawn").svg.contains("z (standard errors)"));
        assert_eq!(chart.fit(100.0), Err(LEAST_WIDTH));
        assert_eq!(chart.fit(500.0), Ok(()));
        assert_eq!(chart.size().0, 500);
        assert!(ControlChart::new(&[]).is_none());
        assert!(Drawn::new(&ControlChart::new(&all[..1]).expect("a point")).is_ok());
    }

    /// Writes both charts to be looked at: `FIELDGAP_CHARTS=FOLDER cargo test charts_to_look_at -- --ignored`.
    #[test]
    #[ignore = "writes files to look at"]
    fn charts_to_look_at() {
        let folder = std::env::var("FIELDGAP_CHARTS").expect("FIELDGAP_CHARTS names a folder");
        for (name, scope) in [("near", Scope::Cell("near".to_owned())), ("all", Scope::AllCells)] {
            let points = of_scope(&scope);
            let drawn = Drawn::new(&ControlChart::new(&points).expect("points")).expect("drawn");
            let path = std::path::Path::new(&folder).join(format!("{name}.png"));
            std::fs::write(path, drawn.png).expect("written");
        }
    }
}
