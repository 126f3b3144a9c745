//! A figure of many records over time, with its errors, and what was noted meanwhile.

use super::Picture;
use super::axes::{Axes, LABEL_TEXT, TICK_TEXT};
use super::marker::{Series, error_bar};
use super::panel_row::{self, PanelRow};
use super::time_axis::round_times;
use fieldgap_canvas::{Align, BLACK, Canvas, CanvasError, GREY, Pen, Point, Rgb};
use fieldgap_records::NoteKind;

/// Width on a page, CSS pixels.
const WIDTH: f64 = 1100.0;

/// Width of a tick's name and its distance from the next, CSS pixels.
const TICK_ROOM: f64 = 110.0;

/// More records than these are not joined by a line, which would fill the panel.
const MOST_JOINED: usize = 200;

/// A record's figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrendPoint {
    /// Seconds since 1970.
    pub at_s: f64,
    pub value: f64,
    /// Standard error; NaN if unknown.
    pub error: f64,
}

/// One figure over time.
#[derive(Debug, Clone)]
pub(crate) struct TrendCurves {
    pub title: String,
    /// Label of the axis of values.
    pub label: String,
    /// Name and points of each rig, in the order of time.
    pub rigs: Vec<(String, Vec<TrendPoint>)>,
    /// What noise alone makes of it; empty where that is not known.
    pub floor: Vec<(f64, f64)>,
    /// Times of notes, seconds since 1970, and their kinds.
    pub notes: Vec<(f64, NoteKind)>,
    /// The least value that it can have.
    pub least: Option<f64>,
    row: PanelRow,
}

/// How a note is drawn: its letter, colour and dashes.
fn look(kind: NoteKind) -> (&'static str, Rgb, &'static [f64]) {
    match kind {
        NoteKind::Alarm => ("A", (178, 34, 34), &[]),
        NoteKind::Calibration => ("C", (0, 114, 178), &[8.0, 4.0]),
        NoteKind::Repair => ("R", (0, 110, 80), &[8.0, 3.0, 2.0, 3.0]),
        NoteKind::Note => ("N", (120, 120, 120), &[1.0, 4.0]),
    }
}

impl TrendCurves {
    /// A figure with a title and a label of its axis.
    pub fn new(title: String, label: String, rigs: Vec<(String, Vec<TrendPoint>)>) -> Self {
        let mut curves = Self {
            title,
            label,
            rigs,
            floor: Vec::new(),
            notes: Vec::new(),
            least: None,
            row: PanelRow::new(1),
        };
        // The width of a page has room for every legend.
        let _ = curves.fit(WIDTH);
        curves
    }

    /// The same with what noise alone makes of it, and with notes.
    pub fn with(mut self, floor: Vec<(f64, f64)>, notes: Vec<(f64, NoteKind)>) -> Self {
        (self.floor, self.notes) = (floor, notes);
        let _ = self.fit(WIDTH);
        self
    }

    /// The same for a narrow screen.
    pub fn narrow(&self) -> Self {
        let mut narrow = self.clone();
        let _ = narrow.fit(440.0);
        narrow
    }

    fn points(&self) -> impl Iterator<Item = &TrendPoint> {
        self.rigs.iter().flat_map(|(_, points)| points)
    }

    fn times(&self) -> (f64, f64) {
        let times =
            self.points().map(|point| point.at_s).chain(self.notes.iter().map(|(at, _)| *at));
        let (from, to) =
            times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| (a.min(at), b.max(at)));
        if from > to {
            return (0.0, 1.0);
        }
        // One record alone, or several at once, have an hour about them.
        let margin = (0.03 * (to - from)).max(1800.0);
        (from - margin, to + margin)
    }

    fn values(&self) -> (f64, f64) {
        let ends = self.points().flat_map(|point| {
            let error = if point.error.is_finite() { point.error } else { 0.0 };
            [point.value - error, point.value + error]
        });
        let all = ends.chain(self.floor.iter().map(|(_, value)| *value));
        let (low, high) = all
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)));
        if low > high {
            return (0.0, 1.0);
        }
        let margin = (0.08 * (high - low)).max(1e-3 * high.abs()).max(1e-12);
        match self.least {
            Some(least) => (least, (high + margin).max(least + margin)),
            None => (low - margin, high + margin),
        }
    }

    /// The kinds of notes that there are, as the legend names them.
    fn kinds(&self) -> Vec<NoteKind> {
        NoteKind::ALL.into_iter().filter(|kind| self.notes.iter().any(|(_, k)| k == kind)).collect()
    }

    fn legend_words(&self) -> Vec<String> {
        let rigs = self.rigs.iter().map(|(name, _)| name.clone());
        let floor = (!self.floor.is_empty()).then(|| "noise alone".to_owned());
        rigs.chain(floor)
            .chain(self.kinds().into_iter().map(|kind| kind.as_str().to_owned()))
            .collect()
    }

    fn legend_widths(&self) -> Vec<f64> {
        self.legend_words().iter().map(|words| 84.0 + 7.0 * words.chars().count() as f64).collect()
    }

    fn legend(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let (words, widths) = (self.legend_words(), self.legend_widths());
        let after_rigs = self.rigs.len() + usize::from(!self.floor.is_empty());
        let kinds = self.kinds();
        for (index, words) in words.iter().enumerate() {
            let (x, y) = self.row.legend_place(index, &widths);
            if index < self.rigs.len() {
                Series::Numbered(index).mark_on_curve(canvas, (x + 20.0, y), true)?;
            } else if index < after_rigs {
                canvas.dashed(
                    &[(x, y), (x + 40.0, y)],
                    &[4.0, 3.0],
                    Pen { colour: GREY, width: 1.75 },
                )?;
            } else {
                let (letter, colour, dash) = look(kinds[index - after_rigs]);
                canvas.dashed(
                    &[(x + 12.0, y - 9.0), (x + 12.0, y + 9.0)],
                    dash,
                    Pen { colour, width: 1.5 },
                )?;
                canvas.text(letter, (x + 20.0, y), TICK_TEXT, Align::Right)?;
            }
            canvas.text(words, (x + 48.0, y), LABEL_TEXT, Align::Right)?;
        }
        Ok(())
    }

    fn draw_notes(&self, canvas: &mut Canvas, axes: &Axes) -> Result<(), CanvasError> {
        let mut last_x = f64::NEG_INFINITY;
        for &(at_s, kind) in &self.notes {
            let (letter, colour, dash) = look(kind);
            let line = [axes.place(at_s, axes.y.0), axes.place(at_s, axes.y.1)];
            canvas.dashed(&line, dash, Pen { colour, width: 1.5 })?;
            let (x, y) = line[1];
            // Notes of one moment share a letter's place: the first is written.
            if x - last_x > 12.0 {
                canvas.text(letter, (x + 3.0, y + 10.0), TICK_TEXT, Align::Right)?;
                last_x = x;
            }
        }
        Ok(())
    }

    fn draw_rig(
        &self,
        canvas: &mut Canvas,
        axes: &Axes,
        index: usize,
        points: &[TrendPoint],
    ) -> Result<(), CanvasError> {
        let series = Series::Numbered(index);
        let colour = series.colour();
        if points.len() <= MOST_JOINED {
            let line: Vec<Point> = points.iter().map(|p| axes.place(p.at_s, p.value)).collect();
            canvas.dashed(&line, series.dash(), Pen { colour, width: 1.0 })?;
        }
        let pen = Pen { colour, width: 1.25 };
        for point in points {
            if point.error.is_finite() && point.error > 0.0 {
                let low = (point.value - point.error).max(axes.y.0);
                let high = (point.value + point.error).min(axes.y.1);
                error_bar(canvas, [low, high].map(|value| axes.place(point.at_s, value)), pen)?;
            }
            series.mark_on_curve(canvas, axes.place(point.at_s, point.value), true)?;
        }
        Ok(())
    }
}

impl Picture for TrendCurves {
    fn size(&self) -> (u32, u32) {
        self.row.size()
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        let legend = self.legend_widths();
        self.row.fit(width, &legend)
    }

    fn description(&self) -> String {
        let records = self.points().count();
        let values = self.points().map(|point| point.value);
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let rigs: Vec<&str> = self.rigs.iter().map(|(name, _)| name.as_str()).collect();
        format!(
            "{} of {records} records over time, between {low:.4} and {high:.4}; {}. {} notes are marked.",
            self.label,
            rigs.join(", "),
            self.notes.len()
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let axes = self.row.axes(0, self.times(), self.values());
        self.draw_notes(canvas, &axes)?;
        let floor: Vec<Point> =
            self.floor.iter().map(|&(at, value)| axes.place(at, value)).collect();
        canvas.dashed(&floor, &[4.0, 3.0], Pen { colour: GREY, width: 1.75 })?;
        for (index, (_, points)) in self.rigs.iter().enumerate() {
            self.draw_rig(canvas, &axes, index, points)?;
        }
        panel_row::frame(canvas, &axes, &self.title, &self.label)?;
        let most = (axes.width / TICK_ROOM).max(2.0) as usize;
        let pen = Pen { colour: BLACK, width: 1.0 };
        let bottom = axes.corner.1 + axes.height;
        for (at, name) in round_times(axes.x, most) {
            let (x, _) = axes.place(at, axes.y.0);
            canvas.line((x, bottom), (x, bottom + 5.0), pen)?;
            canvas.text(&name, (x, bottom + 8.0), TICK_TEXT, Align::Below)?;
        }
        let middle = axes.corner.0 + axes.width / 2.0;
        canvas.text("time (UTC)", (middle, bottom + 26.0), LABEL_TEXT, Align::Below)?;
        self.legend(canvas)
    }
}
