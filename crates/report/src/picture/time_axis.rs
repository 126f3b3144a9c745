//! Ticks of an axis of time, at round minutes, hours and days.

use jiff::Timestamp;
use plotters::backend::DrawingBackend;

use super::PictureError;
use super::axes::{Axes, TICK_TEXT};
use super::canvas::{Align, BLACK, Canvas, Pen};

const MINUTE_S: i64 = 60;
const HOUR_S: i64 = 3600;
const DAY_S: i64 = 86_400;

/// Distances of ticks.
const STEPS_S: [i64; 14] = [
    MINUTE_S,
    5 * MINUTE_S,
    15 * MINUTE_S,
    HOUR_S,
    2 * HOUR_S,
    6 * HOUR_S,
    12 * HOUR_S,
    DAY_S,
    2 * DAY_S,
    7 * DAY_S,
    14 * DAY_S,
    28 * DAY_S,
    91 * DAY_S,
    364 * DAY_S,
];

/// Room for the label of a tick, CSS pixels.
const LABEL_WIDTH: f64 = 80.0;

/// Ticks below axes whose x is in seconds since 1970 (UTC); with `labels`, month and day, and the hour where ticks are closer than a day.
pub(super) fn time_ticks<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    axes: &Axes,
    labels: bool,
) -> Result<(), PictureError> {
    let bottom = axes.corner.1 + axes.height;
    let pen = Pen { colour: BLACK, width: 1.0 };
    for (seconds, label) in ticks(axes.x, axes.width / LABEL_WIDTH) {
        let (x, _) = axes.place(seconds, axes.y.0);
        canvas.line((x, bottom), (x, bottom + 5.0), pen)?;
        if labels {
            canvas.text(&label, (x, bottom + 8.0), TICK_TEXT, Align::Below)?;
        }
    }
    Ok(())
}

/// Times and labels of ticks, at most `most` of them unless the range is longer than centuries.
fn ticks((from, to): (f64, f64), most: f64) -> Vec<(f64, String)> {
    let fits = |step: &&i64| (to - from) / **step as f64 <= most;
    let step = *STEPS_S.iter().find(fits).unwrap_or(&STEPS_S[STEPS_S.len() - 1]);
    let form = match step {
        ..DAY_S => "%m-%d %H:%M",
        _ if to - from > 300.0 * DAY_S as f64 => "%Y-%m-%d",
        _ => "%m-%d",
    };
    let first = (from / step as f64).ceil() as i64;
    let last = (to / step as f64).floor() as i64;
    (first..=last)
        .filter_map(|count| {
            let at = Timestamp::from_second(count * step).ok()?;
            Some(((count * step) as f64, at.strftime(form).to_string()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(hours: i64, most: f64) -> Vec<String> {
        let from: Timestamp = "2026-11-20T10:30:00Z".parse().expect("a time");
        let from = from.as_second() as f64;
        ticks((from, from + (hours * HOUR_S) as f64), most).into_iter().map(|tick| tick.1).collect()
    }

    #[test]
    fn ticks_are_at_round_times() {
        assert_eq!(
            labels(1, 4.0),
            ["11-20 10:30", "11-20 10:45", "11-20 11:00", "11-20 11:15", "11-20 11:30"]
        );
        assert_eq!(labels(3, 6.0), ["11-20 11:00", "11-20 12:00", "11-20 13:00"]);
        assert_eq!(labels(24, 4.0), ["11-20 12:00", "11-20 18:00", "11-21 00:00", "11-21 06:00"]);
        assert_eq!(labels(96, 6.0), ["11-21", "11-22", "11-23", "11-24"]);
        assert!(labels(24 * 700, 8.0).iter().all(|label| label.starts_with("202")));
    }
}
