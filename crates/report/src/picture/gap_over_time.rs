//! The gap of every setting of a campaign over time.

use super::Picture;
use super::axes::{Axes, LABEL_TEXT, TICK_TEXT};
use super::marker::{Series, dot};
use super::time_axis::time_ticks;
use fieldgap_canvas::{Align, BLACK, Canvas, CanvasError, GREY, Pen, Point, Rgb};

const LEFT_ROOM: f64 = 84.0;
const RIGHT_ROOM: f64 = 24.0;
const TOP_ROOM: f64 = 14.0;
const HEIGHT: f64 = 240.0;
const BOTTOM_ROOM: f64 = 62.0;
const WIDTH: f64 = 760.0;

/// Settings with an alarm: vermilion of Okabe and Ito, as on a control chart.
const ALARM: Rgb = (213, 94, 0);

/// The most settings that are drawn one by one with marks; more are thin lines.
const MOST_MARKED: usize = 12;

/// The gap of a setting over time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GapLine {
    /// Time, s since 1970, and gap, of each run.
    pub points: Vec<(f64, f64)>,
    /// Whether a run raised an alarm, as many as there are points.
    pub alarms: Vec<bool>,
}

/// The gaps of all settings.
pub(crate) struct GapOverTime {
    lines: Vec<GapLine>,
    x: (f64, f64),
    y: (f64, f64),
}

impl GapOverTime {
    /// Of some settings; `None` without two runs at different times.
    pub fn new(lines: Vec<GapLine>) -> Option<Self> {
        let all = || lines.iter().flat_map(|line| &line.points);
        let ends = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            })
        };
        let (first, last) = ends(&mut all().map(|(time, _)| *time));
        let (low, high) = ends(&mut all().map(|(_, gap)| *gap));
        if !(first < last && (high - low).is_finite()) {
            return None;
        }
        // In percent. At least a hundredth of the gap is shown, so that noise of equal gaps does not fill the picture.
        let margin = (0.08 * (high - low)).max(0.005 * high.abs()).max(1e-6);
        let side = 0.02 * (last - first);
        let y = (100.0 * (low - margin), 100.0 * (high + margin));
        Some(Self { lines, x: (first - side, last + side), y })
    }

    fn axes(&self) -> Axes {
        Axes {
            corner: (LEFT_ROOM, TOP_ROOM),
            width: WIDTH - LEFT_ROOM - RIGHT_ROOM,
            height: HEIGHT,
            x: self.x,
            y: self.y,
        }
    }

    fn line(&self, canvas: &mut Canvas, axes: &Axes, line: &GapLine) -> Result<(), CanvasError> {
        let places: Vec<Point> =
            line.points.iter().map(|(time, gap)| axes.place(*time, 100.0 * gap)).collect();
        let alarm = line.alarms.contains(&true);
        let pen = match alarm {
            true => Pen { colour: ALARM, width: 2.0 },
            false => Pen { colour: GREY, width: 1.2 },
        };
        for pair in places.windows(2) {
            canvas.line(pair[0], pair[1], pen)?;
        }
        for (at, alarm) in places.iter().zip(&line.alarms) {
            if *alarm {
                Series::Numbered(1).mark_on_curve(canvas, *at, true)?;
            } else if self.lines.len() <= MOST_MARKED {
                dot(canvas, *at, 2.5, BLACK)?;
            }
        }
        Ok(())
    }
}

impl Picture for GapOverTime {
    fn size(&self) -> (u32, u32) {
        (WIDTH as u32, (TOP_ROOM + HEIGHT + BOTTOM_ROOM) as u32)
    }

    fn description(&self) -> String {
        let runs: usize = self.lines.iter().map(|line| line.points.len()).sum();
        let alarms = self.lines.iter().filter(|line| line.alarms.contains(&true)).count();
        format!(
            "The gap over time: {} settings, {runs} runs, {:.2} % to {:.2} %. Settings with an open alarm: {alarms}.",
            self.lines.len(),
            self.y.0,
            self.y.1
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let axes = self.axes();
        let (quiet, alarmed): (Vec<&GapLine>, Vec<&GapLine>) =
            self.lines.iter().partition(|line| !line.alarms.contains(&true));
        // Those with an alarm lie above the others.
        for line in quiet.iter().chain(&alarmed) {
            self.line(canvas, &axes, line)?;
        }
        axes.frame(canvas)?;
        axes.y_axis(canvas, "gap (%)")?;
        time_ticks(canvas, &axes, true)?;
        let y = TOP_ROOM + HEIGHT + 44.0;
        canvas.text(
            "time (UTC); a line for each setting",
            (LEFT_ROOM, y),
            LABEL_TEXT,
            Align::Right,
        )?;
        if !alarmed.is_empty() {
            let x = LEFT_ROOM + 330.0;
            canvas.line((x, y), (x + 26.0, y), Pen { colour: ALARM, width: 2.0 })?;
            Series::Numbered(1).mark_on_curve(canvas, (x + 13.0, y), true)?;
            canvas.text("setting with an open alarm", (x + 34.0, y), TICK_TEXT, Align::Right)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Drawn;

    fn line(gaps: &[f64], alarm: bool) -> GapLine {
        let points = gaps
            .iter()
            .enumerate()
            .map(|(day, gap)| (1.795e9 + 86_400.0 * day as f64, *gap))
            .collect();
        let mut alarms = vec![false; gaps.len()];
        *alarms.last_mut().expect("a run") = alarm;
        GapLine { points, alarms }
    }

    #[test]
    fn alarms_are_marked_where_they_belong() {
        let lines = vec![line(&[0.18, 0.181, 0.18], false), line(&[0.2, 0.2, 0.25], true)];
        let picture = GapOverTime::new(lines).expect("times");
        let drawn = Drawn::new(&picture).expect("drawn");
        assert!(drawn.svg.contains("gap (%)") && drawn.svg.contains("setting with an open alarm"));
        assert!(
            drawn.description.contains("2 settings, 6 runs")
                && drawn.description.contains("alarm: 1.")
        );
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let (x, y) = picture.axes().place(1.795e9 + 2.0 * 86_400.0, 25.0);
        let image::Rgb([red, green, blue]) = *image.get_pixel((2.0 * x) as u32, (2.0 * y) as u32);
        assert_eq!((red, green, blue), ALARM);
    }

    #[test]
    fn one_time_is_no_course() {
        assert!(GapOverTime::new(vec![line(&[0.2], false), line(&[0.3], false)]).is_none());
        assert!(GapOverTime::new(Vec::new()).is_none());
        assert!(GapOverTime::new(vec![line(&[0.2, f64::NAN], false)]).is_some());
        let alike = GapOverTime::new(vec![line(&[0.2, 0.2], false)]).expect("times");
        assert!(Drawn::new(&alike).is_ok());
    }
}
