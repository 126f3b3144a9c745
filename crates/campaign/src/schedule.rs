//! When rounds begin, and when cells may begin.
//!
//! Days and times of day are those of the campaign's time zone, so that a start at 08:00 stays at 08:00 when the clocks change.

use jiff::civil::{Date, Time, Weekday};
use jiff::tz::TimeZone;
use jiff::{Span, Timestamp, ToSpan, Zoned};
use serde::Deserialize;

/// Most rounds of a campaign: every hour for ten years.
const MOST_ROUNDS: u32 = 100_000;

/// How far ahead a permitted day or time is sought: longer than the longest gap between two of a year.
const HORIZON_DAYS: i64 = 400;

/// `[schedule]`, as it is written.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScheduleTable {
    /// Rounds in all.
    rounds: Option<u32>,
    /// Time between the starts of two rounds, such as `6h` or `1 day`.
    every: Option<String>,
    /// Times of day at which rounds begin, such as `08:00`.
    at: Option<Vec<String>>,
    /// Days on which cells may begin: `mon` to `sun`, or dates.
    days: Option<Vec<String>>,
    /// Times of day between which cells may begin.
    window: Option<[String; 2]>,
    /// Name of the time zone, such as `Europe/Vienna`.
    time_zone: Option<String>,
    /// Nothing begins before.
    from: Option<String>,
    /// No round begins after.
    until: Option<String>,
}

/// When rounds and cells begin.
#[derive(Debug, Clone)]
pub struct Schedule {
    /// Rounds in all.
    pub rounds: u32,
    starts: Starts,
    days: Vec<Day>,
    window: Option<(Time, Time)>,
    time_zone: TimeZone,
    from: Option<Timestamp>,
    until: Option<Timestamp>,
}

#[derive(Debug, Clone)]
enum Starts {
    /// A round begins when the one before has ended.
    OneAfterAnother,
    /// At this interval from the first start.
    Every(Span),
    /// At these times of day, ascending.
    At(Vec<Time>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Day {
    Weekday(Weekday),
    Date(Date),
}

/// Why a schedule cannot be followed: the key, what is wrong, and what to write.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{key}`: {problem}")]
pub(super) struct WrongSchedule {
    pub(super) key: &'static str,
    pub(super) problem: String,
    pub(super) remedy: &'static str,
}

impl ScheduleTable {
    /// The schedule.
    ///
    /// # Errors
    /// [`WrongSchedule`] at the first value that is none, or at keys that exclude each other.
    pub(super) fn read(&self) -> Result<Schedule, WrongSchedule> {
        let wrong = |key, problem: String, remedy| WrongSchedule { key, problem, remedy };
        let time_zone = match &self.time_zone {
            None => TimeZone::system(),
            Some(name) => TimeZone::get(name).map_err(|error| {
                wrong(
                    "time_zone",
                    error.to_string(),
                    "give a name such as \"Europe/Vienna\" or \"UTC\"",
                )
            })?,
        };
        let starts = match (&self.every, &self.at) {
            (Some(_), Some(_)) => {
                let problem = "`every` and `at` exclude each other".to_owned();
                return Err(wrong("every", problem, "remove one of the two"));
            }
            (Some(every), None) => Starts::Every(interval(every).map_err(|problem| {
                wrong("every", problem, "give a time such as \"6h\", \"90 min\" or \"1 day\"")
            })?),
            (None, Some(at)) => {
                let mut times =
                    at.iter().map(|text| time_of_day("at", text)).collect::<Result<Vec<_>, _>>()?;
                times.sort_unstable();
                times.dedup();
                if times.is_empty() {
                    return Err(wrong("at", "the list is empty".to_owned(), TIME_OF_DAY));
                }
                Starts::At(times)
            }
            (None, None) => Starts::OneAfterAnother,
        };
        let rounds = self.rounds.unwrap_or(1);
        if !(1..=MOST_ROUNDS).contains(&rounds) {
            let problem = format!("{rounds} rounds; 1 to {MOST_ROUNDS} are possible");
            return Err(wrong("rounds", problem, "give a number of rounds"));
        }
        let days =
            self.days.iter().flatten().map(|text| Day::read(text)).collect::<Result<Vec<_>, _>>();
        let days = days.map_err(|text| {
            wrong(
                "days",
                format!("`{text}` is no day"),
                "give days such as \"mon\" or dates such as \"2026-12-01\"",
            )
        })?;
        let window = match &self.window {
            None => None,
            Some([from, to]) => {
                let (from, to) = (time_of_day("window", from)?, time_of_day("window", to)?);
                if from == to {
                    let problem = "it begins and ends at the same time".to_owned();
                    return Err(wrong(
                        "window",
                        problem,
                        "leave it out if cells may begin at any time",
                    ));
                }
                Some((from, to))
            }
        };
        let instant = |key, text: &Option<String>| -> Result<Option<Timestamp>, WrongSchedule> {
            let Some(text) = text else { return Ok(None) };
            let civil: Result<jiff::civil::DateTime, _> = text.parse();
            civil
                .and_then(|civil| civil.to_zoned(time_zone.clone()))
                .map(|zoned| Some(zoned.timestamp()))
                .map_err(|error| {
                    wrong(
                        key,
                        error.to_string(),
                        "give a date and a time of day, such as \"2026-12-01T08:00\"",
                    )
                })
        };
        let (from, until) = (instant("from", &self.from)?, instant("until", &self.until)?);
        if from.zip(until).is_some_and(|(from, until)| until <= from) {
            return Err(wrong("until", "it is not after `from`".to_owned(), "give a later time"));
        }
        Ok(Schedule { rounds, starts, days, window, time_zone, from, until })
    }
}

const TIME_OF_DAY: &str = "give times of day such as \"08:00\"";

fn time_of_day(key: &'static str, text: &str) -> Result<Time, WrongSchedule> {
    text.parse().map_err(|error: jiff::Error| WrongSchedule {
        key,
        problem: format!("`{text}` is no time of day: {error}"),
        remedy: TIME_OF_DAY,
    })
}

/// A span of a minute at least, so that a campaign cannot spin.
fn interval(text: &str) -> Result<Span, String> {
    let span: Span = text.parse().map_err(|error: jiff::Error| error.to_string())?;
    let day = jiff::SpanRelativeTo::days_are_24_hours();
    let minutes = span.total((jiff::Unit::Minute, day));
    // Months have no fixed length; they are longer than a minute.
    let long_enough = minutes.map_or(span.is_positive(), |minutes| minutes >= 1.0);
    if long_enough { Ok(span) } else { Err(format!("`{text}` is less than a minute")) }
}

impl Day {
    fn read(text: &str) -> Result<Self, String> {
        const NAMES: [(&str, Weekday); 7] = [
            ("mon", Weekday::Monday),
            ("tue", Weekday::Tuesday),
            ("wed", Weekday::Wednesday),
            ("thu", Weekday::Thursday),
            ("fri", Weekday::Friday),
            ("sat", Weekday::Saturday),
            ("sun", Weekday::Sunday),
        ];
        let lower = text.to_ascii_lowercase();
        let weekday = NAMES.iter().find(|(name, _)| *name == lower);
        match weekday {
            Some((_, weekday)) => Ok(Self::Weekday(*weekday)),
            None => text.parse().map(Self::Date).map_err(|_| text.to_owned()),
        }
    }

    fn is(self, date: Date) -> bool {
        match self {
            Self::Weekday(weekday) => date.weekday() == weekday,
            Self::Date(day) => date == day,
        }
    }
}

impl Schedule {
    /// The first start of a round at or after `after`, of a campaign that began at `began`; `None` if there is none.
    pub fn start_from(&self, began: Timestamp, after: Timestamp) -> Option<Timestamp> {
        let after = self.from.map_or(after, |from| from.max(after));
        let start = match &self.starts {
            Starts::OneAfterAnother => self.may_begin(after)?,
            Starts::Every(span) => {
                let first = self.zoned(self.from.unwrap_or(began));
                let start = (0..=i64::from(MOST_ROUNDS) * 10)
                    .map_while(|number| first.checked_add(span.checked_mul(number).ok()?).ok())
                    .map(|start| start.timestamp())
                    .find(|start| *start >= after && self.may_begin(*start) == Some(*start));
                start?
            }
            Starts::At(times) => {
                let today = self.zoned(after).date();
                (0..HORIZON_DAYS)
                    .filter_map(|day| today.checked_add(day.days()).ok())
                    .flat_map(|date| times.iter().map(move |time| date.to_datetime(*time)))
                    .filter_map(|civil| civil.to_zoned(self.time_zone.clone()).ok())
                    .map(|start| start.timestamp())
                    .find(|start| *start >= after && self.may_begin(*start) == Some(*start))?
            }
        };
        self.until.is_none_or(|until| start <= until).then_some(start)
    }

    /// How many starts lie between two times, the first excluded and the second included: those that a long round leaves out.
    pub fn starts_between(&self, began: Timestamp, from: Timestamp, to: Timestamp) -> u32 {
        if matches!(self.starts, Starts::OneAfterAnother) {
            return 0;
        }
        let nanosecond = jiff::SignedDuration::from_nanos(1);
        let after = |at: Timestamp| at.checked_add(nanosecond).ok();
        let mut count = 0;
        let mut next = after(from).and_then(|from| self.start_from(began, from));
        while let Some(start) = next.filter(|start| *start <= to) {
            count += 1;
            next = after(start).and_then(|start| self.start_from(began, start));
        }
        count
    }

    /// The first time at or after `at` at which a cell may begin, by days and window; `None` if there is none within a year.
    pub fn may_begin(&self, at: Timestamp) -> Option<Timestamp> {
        let now = self.zoned(at);
        if self.is_open(&now) {
            return Some(at);
        }
        let today = now.date();
        let opening = self.window.map_or(Time::midnight(), |(from, _)| from);
        // A day may also open at midnight, in a window that runs over it.
        let times = [Time::midnight(), opening];
        (0..HORIZON_DAYS)
            .filter_map(|day| today.checked_add(day.days()).ok())
            .flat_map(|date| times.map(|time| date.to_datetime(time)))
            .filter_map(|civil| civil.to_zoned(self.time_zone.clone()).ok())
            .find(|start| start.timestamp() >= at && self.is_open(start))
            .map(|start| start.timestamp())
    }

    fn is_open(&self, at: &Zoned) -> bool {
        let day = self.days.is_empty() || self.days.iter().any(|day| day.is(at.date()));
        let time = at.time();
        let open = self.window.is_none_or(|(from, to)| {
            if from < to { from <= time && time < to } else { from <= time || time < to }
        });
        day && open
    }

    fn zoned(&self, at: Timestamp) -> Zoned {
        at.to_zoned(self.time_zone.clone())
    }

    /// A time in the campaign's zone, to the minute.
    pub fn show(&self, at: Timestamp) -> String {
        self.zoned(at).strftime("%Y-%m-%d %H:%M %Z").to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule(text: &str) -> Schedule {
        let table: ScheduleTable = toml::from_str(text).expect("TOML");
        table.read().expect("a schedule")
    }

    fn at(text: &str) -> Timestamp {
        text.parse().expect("a time")
    }

    #[test]
    fn a_start_every_day_keeps_its_time_of_day_when_the_clocks_change() {
        // In Vienna summer time ended on 2026-10-25: UTC+2 before, UTC+1 after.
        let daily = schedule("rounds = 3\nevery = \"1 day\"\ntime_zone = \"Europe/Vienna\"");
        let began = at("2026-10-24T06:00:00Z");
        let second = daily.start_from(began, at("2026-10-24T06:00:01Z"));
        assert_eq!(second, Some(at("2026-10-25T07:00:00Z")));
        let every_24_hours = schedule("every = \"24h\"\ntime_zone = \"Europe/Vienna\"");
        let second = every_24_hours.start_from(began, at("2026-10-24T06:00:01Z"));
        assert_eq!(second, Some(at("2026-10-25T06:00:00Z")));
    }

    #[test]
    fn times_of_day_are_taken_in_turn_on_the_given_days() {
        let text =
            "at = [\"20:00\", \"08:00\"]\ndays = [\"mon\", \"2026-11-24\"]\ntime_zone = \"UTC\"";
        let schedule = schedule(text);
        let began = at("2026-11-23T07:00:00Z");
        let mut starts = Vec::new();
        let mut after = began;
        for _ in 0..5 {
            let start = schedule.start_from(began, after).expect("a start");
            starts.push(start.to_string());
            after = start + 1.second();
        }
        let days =
            ["2026-11-23T08", "2026-11-23T20", "2026-11-24T08", "2026-11-24T20", "2026-11-30T08"];
        assert_eq!(starts, days.map(|hour| format!("{hour}:00:00Z")));
        assert_eq!(
            schedule.starts_between(began, at("2026-11-23T08:00:00Z"), at("2026-11-24T09:00:00Z")),
            2
        );
    }

    #[test]
    fn a_window_may_run_over_midnight() {
        let night = schedule("window = [\"22:00\", \"06:00\"]\ntime_zone = \"UTC\"");
        let same = |text: &str| assert_eq!(night.may_begin(at(text)), Some(at(text)), "{text}");
        same("2026-11-24T22:00:00Z");
        same("2026-11-24T05:59:00Z");
        assert_eq!(night.may_begin(at("2026-11-24T06:00:00Z")), Some(at("2026-11-24T22:00:00Z")));
        let weekend =
            schedule("window = [\"22:00\", \"06:00\"]\ndays = [\"sat\"]\ntime_zone = \"UTC\"");
        // Saturday opens at midnight, inside the window.
        assert_eq!(weekend.may_begin(at("2026-11-24T12:00:00Z")), Some(at("2026-11-28T00:00:00Z")));
    }

    #[test]
    fn nothing_begins_before_or_after_the_bounds() {
        let text = "every = \"2h\"\nfrom = \"2026-12-01T08:00\"\nuntil = \"2026-12-01T11:00\"\ntime_zone = \"UTC\"";
        let schedule = schedule(text);
        let began = at("2026-11-24T00:00:00Z");
        assert_eq!(schedule.start_from(began, began), Some(at("2026-12-01T08:00:00Z")));
        assert_eq!(
            schedule.start_from(began, at("2026-12-01T08:00:01Z")),
            Some(at("2026-12-01T10:00:00Z"))
        );
        assert_eq!(schedule.start_from(began, at("2026-12-01T10:00:01Z")), None);
    }

    #[test]
    fn without_a_schedule_rounds_follow_each_other() {
        let none = schedule("rounds = 2");
        let now = at("2026-11-24T00:00:00Z");
        assert_eq!(none.start_from(now, now), Some(now));
        assert_eq!(none.starts_between(now, now, at("2026-11-25T00:00:00Z")), 0);
    }

    #[test]
    fn a_wrong_schedule_names_its_key() {
        for (text, key) in [
            ("every = \"6 parsecs\"", "every"),
            ("every = \"10s\"", "every"),
            ("every = \"-1h\"", "every"),
            ("every = \"1h\"\nat = [\"08:00\"]", "every"),
            ("at = [\"25:00\"]", "at"),
            ("at = []", "at"),
            ("days = [\"noday\"]", "days"),
            ("window = [\"08:00\", \"08:00\"]", "window"),
            ("time_zone = \"Mars/Olympus\"", "time_zone"),
            ("from = \"soon\"", "from"),
            ("from = \"2026-12-02T00:00\"\nuntil = \"2026-12-01T00:00\"", "until"),
            ("rounds = 0", "rounds"),
        ] {
            let table: ScheduleTable = toml::from_str(text).expect("TOML");
            assert_eq!(table.read().expect_err(text).key, key);
        }
    }
}
