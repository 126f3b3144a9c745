//! `fieldgap history`: the records below a folder, with their gaps and causes.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use jiff::Timestamp;
use jiff::civil::Date;
use jiff::tz::TimeZone;
use miette::IntoDiagnostic;

use super::output::{print, print_json, say};
use super::simulate::positive;
use fieldgap_archive::{
    Entry, Filter, Index, Place, Query, SeriesName, Sort, Updated, Wanted, compare_record, to_csv,
    to_text,
};
use fieldgap_diagnosis::{EffectId, Verdict};
use fieldgap_input::Positive;
use fieldgap_report::{Trend, write_trend};
use fieldgap_text::percent;

/// The `history` command.
#[derive(Debug, Args)]
pub(super) struct History {
    /// Folder that contains records, at any depth
    #[arg(default_value = "out")]
    folder: PathBuf,
    #[command(flatten)]
    conditions: Conditions,
    /// Order of the list; the newest or largest is last
    #[arg(long, value_enum, default_value = "recorded")]
    sort: Order,
    /// List only the last N of the order
    #[arg(long, value_name = "N")]
    limit: Option<usize>,
    /// Add a column with a figure, such as sound-speed.c_m_s or z100.focus0.peak_offset_mm; may be repeated
    #[arg(long, value_name = "NAME")]
    parameter: Vec<SeriesName>,
    /// Compare the records that were never compared, and keep their figures
    #[arg(long)]
    compare: bool,
    /// Write a page with gap and parameters over time: a file that ends in .html, or a folder
    #[arg(long, value_name = "FILE|DIR")]
    page: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// Which records are listed.
#[derive(Debug, Args)]
#[command(next_help_heading = "Conditions")]
struct Conditions {
    /// Records of this rig
    #[arg(long, value_name = "NAME")]
    rig: Option<String>,
    /// Records with this in their name
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    /// Recorded then or later: 2026-11-20, or 2026-11-20T17:00:00Z
    #[arg(long, value_name = "TIME", value_parser = start_of)]
    since: Option<Timestamp>,
    /// Recorded until then; a day is included
    #[arg(long, value_name = "TIME", value_parser = end_of)]
    until: Option<Timestamp>,
    /// Records with a focus within 1 mm of this point, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    focus: Option<PointMm>,
    /// Records with this verdict
    #[arg(long, value_name = "VERDICT", value_parser = verdict)]
    verdict: Option<Verdict>,
    /// Records in whose cause this effect is named
    #[arg(long, value_name = "EFFECT")]
    effect: Option<EffectId>,
    /// Records with a gap above this, %
    #[arg(long, value_name = "PERCENT", value_parser = positive)]
    gap_above: Option<Positive>,
    /// Records with a gap below this, %
    #[arg(long, value_name = "PERCENT", value_parser = positive)]
    gap_below: Option<Positive>,
    /// Records with this in a note
    #[arg(long, value_name = "TEXT")]
    noted: Option<String>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Order {
    /// Time of the record
    Recorded,
    /// Name
    Name,
    /// Name of the rig
    Rig,
    /// Gap
    Gap,
    /// Correlation
    Correlation,
    /// Number of readings
    Points,
    /// The first --parameter
    Parameter,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// A table
    Text,
    /// A row for each record
    Csv,
    /// Everything that is known of the records
    Json,
}

/// A point, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PointMm([f64; 3]);

impl History {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let cache = Place::user_cache();
        let mut index = Index::open(&self.folder, cache.as_deref())?;
        let mut updated = index.update()?;
        if self.compare && self.compare_missing(&mut index)? {
            updated = index.update()?;
        }
        let entries = index.query(&self.query()?)?;
        if let Some(why) = index.renewed() {
            say(format!("the index was made anew: {why}"));
        }
        match self.format {
            Format::Text => print(&to_text(&entries, &self.parameter))?,
            Format::Csv => print(&to_csv(&entries, &self.parameter).into_diagnostic()?)?,
            Format::Json => print_json(&entries)?,
        }
        self.tell(&updated, &entries);
        if let Some(page) = &self.page {
            let trend = Trend {
                root: &self.folder,
                entries: &entries,
                figures: &self.parameter,
                software: concat!("fieldgap ", env!("CARGO_PKG_VERSION")),
            };
            let files = write_trend(page, trend).into_diagnostic()?;
            say(format!("page: {}", files.page.display()));
        }
        Ok(ExitCode::SUCCESS)
    }

    fn query(&self) -> miette::Result<Query> {
        let sort = match self.sort {
            Order::Recorded => Sort::Recorded,
            Order::Name => Sort::Name,
            Order::Rig => Sort::Rig,
            Order::Gap => Sort::Gap,
            Order::Correlation => Sort::Correlation,
            Order::Points => Sort::Points,
            Order::Parameter => {
                let first = self.parameter.first().cloned();
                Sort::Figure(first.ok_or_else(|| {
                    miette::miette!(
                        help = "give --parameter NAME too",
                        "it is not said by which parameter to sort"
                    )
                })?)
            }
        };
        let figures = match self.format {
            Format::Json => Wanted::All,
            _ if self.page.is_some() => Wanted::All,
            _ => Wanted::Named(self.parameter.clone()),
        };
        Ok(Query { filter: self.conditions.filter(), sort, limit: self.limit, figures })
    }

    /// Compares what was never compared; whether there was anything.
    fn compare_missing(&self, index: &mut Index) -> miette::Result<bool> {
        let query = Query { filter: self.conditions.filter(), ..Query::default() };
        let mut any = false;
        for entry in index.query(&query)? {
            if entry.gap.is_some() || entry.fault.is_some() {
                continue;
            }
            any = true;
            let folder = self.folder.join(&entry.folder);
            match compare_record(&folder) {
                Ok(figures) => {
                    say(format!(
                        "compared {}: gap {}",
                        folder.display(),
                        percent(figures.gap.value)
                    ));
                }
                Err(error) => say(format!("not compared: {}: {error}", folder.display())),
            }
        }
        Ok(any)
    }

    /// Says what the list does not show.
    fn tell(&self, updated: &Updated, entries: &[Entry]) {
        for (folder, error) in &updated.unreadable {
            say(format!("not searched: {}: {error}", self.folder.join(folder).display()));
        }
        let listed = entries.iter().filter(|entry| entry.fault.is_some()).count();
        if let hidden @ 1.. = updated.damaged.saturating_sub(listed) {
            let records = if hidden == 1 { "damaged record" } else { "damaged records" };
            say(format!(
                "{hidden} {records} not listed here; `fieldgap history` without conditions lists all"
            ));
        }
        let missing = entries.iter().filter(|e| e.gap.is_none() && e.fault.is_none()).count();
        if missing > 0 && !self.compare {
            say(format!("{missing} of {} were never compared; --compare does it", entries.len()));
        }
        if updated.records == 0 {
            say(format!("there is no record below {}", self.folder.display()));
        }
    }
}

impl Conditions {
    fn filter(&self) -> Filter {
        let ratio = |percent: Option<Positive>| percent.map(|percent| percent.get() / 100.0);
        Filter {
            rig: self.rig.clone(),
            name: self.name.clone(),
            since: self.since,
            before: self.until,
            focus_mm: self.focus.map(|PointMm(at_mm)| at_mm),
            verdict: self.verdict,
            effect: self.effect,
            gap_above: ratio(self.gap_above),
            gap_below: ratio(self.gap_below),
            noted: self.noted.clone(),
        }
    }
}

/// A time, or the start of a day in the computer's time zone.
fn start_of(text: &str) -> Result<Timestamp, String> {
    at(text, |day| day)
}

/// A time, or the end of a day.
fn end_of(text: &str) -> Result<Timestamp, String> {
    at(text, |day| day.saturating_add(jiff::Span::new().days(1)))
}

fn at(text: &str, of_day: impl Fn(Date) -> Date) -> Result<Timestamp, String> {
    if let Ok(at) = text.parse::<Timestamp>() {
        return Ok(at);
    }
    let day: Date = text.parse().map_err(|_| {
        "this is neither a day, such as 2026-11-20, nor a time, such as 2026-11-20T17:00:00Z"
            .to_owned()
    })?;
    let zoned = of_day(day).to_zoned(TimeZone::system()).map_err(|error| error.to_string())?;
    Ok(zoned.timestamp())
}

fn point(text: &str) -> Result<PointMm, String> {
    let wrong = || "this is no point: three numbers in mm, such as 0,0,100".to_owned();
    let numbers: Vec<f64> = text
        .split(',')
        .map(|number| number.trim().parse().map_err(|_| wrong()))
        .collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, z] if [x, y, z].iter().all(|mm| mm.is_finite()) => Ok(PointMm([x, y, z])),
        _ => Err(wrong()),
    }
}

fn verdict(name: &str) -> Result<Verdict, String> {
    let names = Verdict::ALL.map(Verdict::as_str).join(", ");
    let found = Verdict::ALL.into_iter().find(|verdict| verdict.as_str() == name);
    found.ok_or_else(|| format!("this is no verdict; the verdicts are {names}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_included_and_times_are_exact() {
        let day = jiff::Span::new().hours(24);
        let (start, end) =
            (start_of("2026-11-20").expect("a day"), end_of("2026-11-20").expect("a day"));
        assert!(start < end && end.since(start).expect("later").compare(day).is_ok());
        assert_eq!(start_of("2026-11-20T17:00:00Z"), end_of("2026-11-20T17:00:00Z"));
        assert!(start_of("yesterday").is_err());
    }

    #[test]
    fn a_point_has_three_numbers() {
        assert_eq!(point("0, -1.5,100"), Ok(PointMm([0.0, -1.5, 100.0])));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,nan"] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
    }
}
