//! Round times along an axis.

use jiff::civil::{Date, DateTime};
use jiff::tz::TimeZone;
use jiff::{Span, Timestamp, ToSpan};

use super::axes::{Axes, TICK_TEXT};
use fieldgap_canvas::{Align, BLACK, Canvas, CanvasError, Pen};

/// Room for the label of a tick, CSS pixels.
const LABEL_WIDTH: f64 = 80.0;

/// Ticks below axes whose x is in seconds since 1970 (UTC); with `labels`, month and day, and the hour where ticks are closer than a day.
pub(super) fn time_ticks(
    canvas: &mut Canvas,
    axes: &Axes,
    labels: bool,
) -> Result<(), CanvasError> {
    let bottom = axes.corner.1 + axes.height;
    let pen = Pen { colour: BLACK, width: 1.0 };
    let most = (axes.width / LABEL_WIDTH) as usize;
    for (seconds, label) in round_times(axes.x, most) {
        let (x, _) = axes.place(seconds, axes.y.0);
        canvas.line((x, bottom), (x, bottom + 5.0), pen)?;
        if labels {
            canvas.text(&label, (x, bottom + 8.0), TICK_TEXT, Align::Below)?;
        }
    }
    Ok(())
}

/// Distances of ticks that people read at a glance, the smallest first, and how a tick is then written.
fn distances() -> [(Span, &'static str); 17] {
    const CLOCK: &str = "%H:%M";
    const HOUR: &str = "%d %b %H:%M";
    const DAY: &str = "%d %b";
    const MONTH: &str = "%b %Y";
    const YEAR: &str = "%Y";
    [
        (1.minute(), CLOCK),
        (5.minutes(), CLOCK),
        (15.minutes(), CLOCK),
        (1.hour(), HOUR),
        (3.hours(), HOUR),
        (6.hours(), HOUR),
        (12.hours(), HOUR),
        (1.day(), DAY),
        (2.days(), DAY),
        (7.days(), DAY),
        (14.days(), DAY),
        (1.month(), MONTH),
        (3.months(), MONTH),
        (6.months(), MONTH),
        (1.year(), YEAR),
        (5.years(), YEAR),
        (20.years(), YEAR),
    ]
}

/// At most `most` round times between two times, both in seconds since 1970 (UTC), with their names.
pub(super) fn round_times((from_s, to_s): (f64, f64), most: usize) -> Vec<(f64, String)> {
    let time = |s: f64| {
        Timestamp::from_second(s as i64).ok().map(|at| at.to_zoned(TimeZone::UTC).datetime())
    };
    let (Some(from), Some(to)) = (time(from_s), time(to_s)) else { return Vec::new() };
    for (distance, format) in distances() {
        let Some(mut at) = first(from, distance) else { continue };
        let mut ticks = Vec::new();
        while at <= to && ticks.len() <= most {
            let Ok(zoned) = at.to_zoned(TimeZone::UTC) else { break };
            let seconds = zoned.timestamp().as_second() as f64;
            if seconds >= from_s {
                ticks.push((seconds, at.strftime(format).to_string()));
            }
            let Ok(next) = at.checked_add(distance) else { break };
            at = next;
        }
        if ticks.len() <= most {
            return ticks;
        }
    }
    Vec::new()
}

/// The last round time that is not after `from`. Days are counted from the first of 1970, so that ticks are where they were last week.
fn first(from: DateTime, distance: Span) -> Option<DateTime> {
    let (years, months, days) = (distance.get_years(), distance.get_months(), distance.get_days());
    let day = if years > 0 {
        Date::new(from.year().div_euclid(years) * years, 1, 1)
    } else if months > 0 {
        Date::new(from.year(), (from.month() - 1) / months as i8 * months as i8 + 1, 1)
    } else if days > 0 {
        let epoch = Date::new(1970, 1, 1).ok()?;
        let since = epoch.until(from.date()).ok()?.get_days();
        epoch.checked_add((since - since.rem_euclid(days)).days())
    } else {
        // Hours and minutes divide the day.
        Ok(from.date())
    };
    let start = day.ok()?.at(0, 0, 0, 0);
    if distance.get_hours() == 0 && distance.get_minutes() == 0 {
        return Some(start);
    }
    let step_min = i64::from(distance.get_hours()) * 60 + distance.get_minutes();
    let now_min = i64::from(from.hour()) * 60 + i64::from(from.minute());
    start.checked_add((now_min - now_min % step_min).minutes()).ok()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn names(from: &str, to: &str) -> Vec<String> {
        let seconds = |at: &str| at.parse::<Timestamp>().expect("a time").as_second() as f64;
        round_times((seconds(from), seconds(to)), 6).into_iter().map(|(_, name)| name).collect()
    }

    #[test]
    fn ticks_are_round_times() {
        assert_eq!(
            names("2026-11-20T08:10:00Z", "2026-11-20T13:00:00Z"),
            ["20 Nov 09:00", "20 Nov 10:00", "20 Nov 11:00", "20 Nov 12:00", "20 Nov 13:00"]
        );
        assert_eq!(
            names("2026-01-20T08:10:00Z", "2026-05-02T00:00:00Z"),
            ["Feb 2026", "Mar 2026", "Apr 2026", "May 2026"]
        );
        assert_eq!(
            names("2019-06-01T00:00:00Z", "2023-02-01T00:00:00Z"),
            ["2020", "2021", "2022", "2023"]
        );
    }

    proptest! {
        #[test]
        fn ticks_lie_inside_in_order_and_are_few(from_s in 0.0..4e9f64, width_s in 60.0..1e9f64, most in 2usize..12) {
            let ticks = round_times((from_s, from_s + width_s), most);
            prop_assert!(ticks.len() <= most);
            prop_assert!(ticks.iter().all(|(at, _)| (from_s..=from_s + width_s).contains(at)));
            prop_assert!(ticks.windows(2).all(|pair| pair[0].0 < pair[1].0));
        }
    }
}
