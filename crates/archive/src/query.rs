//! Which records are asked for, and how they are found in the index.

use fieldgap_acoustics::Simulator;
use fieldgap_diagnosis::{EffectId, Verdict};
use fieldgap_records::{Note, NoteKind};
use fieldgap_text::Uncertain;
use jiff::Timestamp;
use rusqlite::types::Value;
use rusqlite::{Row, Transaction, params_from_iter};

use crate::entry::{Entry, State};
use crate::series::SeriesName;
use crate::store::{folded, folder_of};

/// A focus counts as the one asked for within this distance, mm.
pub const SAME_FOCUS_MM: f64 = 1.0;

/// What records must have to be listed. Without any condition every record is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Filter {
    /// The name of the rig, in upper or lower case.
    pub rig: Option<String>,
    /// A part of the name, in upper or lower case.
    pub name: Option<String>,
    /// Recorded then or later.
    pub since: Option<Timestamp>,
    /// Recorded before.
    pub before: Option<Timestamp>,
    /// A drive with a focus within [`SAME_FOCUS_MM`] of this point, mm.
    pub focus_mm: Option<[f64; 3]>,
    /// The verdict.
    pub verdict: Option<Verdict>,
    /// An effect that is named.
    pub effect: Option<EffectId>,
    /// A gap above this, relative.
    pub gap_above: Option<f64>,
    /// A gap below this, relative.
    pub gap_below: Option<f64>,
    /// A part of a note, in upper or lower case.
    pub noted: Option<String>,
}

/// The order of a list. What has no such figure comes first; records that are alike are in the order of their folders.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Sort {
    /// By time, the newest last.
    #[default]
    Recorded,
    /// By name.
    Name,
    /// By the rig's name.
    Rig,
    /// By gap, the largest last.
    Gap,
    /// By correlation.
    Correlation,
    /// By number of readings.
    Points,
    /// By a figure.
    Figure(SeriesName),
}

/// Which figures by name are wanted of each record.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Wanted {
    /// None.
    #[default]
    None,
    /// These.
    Named(Vec<SeriesName>),
    /// All.
    All,
}

/// A question to the index.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Query {
    /// Which records.
    pub filter: Filter,
    /// In which order.
    pub sort: Sort,
    /// At most so many: the last ones of the order.
    pub limit: Option<usize>,
    /// With which figures.
    pub figures: Wanted,
}

/// A condition on `records`, and its values.
struct Conditions {
    words: Vec<String>,
    values: Vec<Value>,
}

impl Conditions {
    /// Adds a condition in which `?` stands for the values.
    fn add<const N: usize>(&mut self, words: &str, values: [Value; N]) {
        self.words.push(words.to_owned());
        self.values.extend(values);
    }
}

impl Filter {
    fn conditions(&self) -> Conditions {
        let mut all = Conditions { words: vec!["true".to_owned()], values: Vec::new() };
        let text = |text: &str| Value::Text(text.to_owned());
        if let Some(rig) = &self.rig {
            all.add("rig_folded = ?", [text(&folded(rig))]);
        }
        if let Some(name) = &self.name {
            all.add("instr(name_folded, ?) > 0", [text(&folded(name))]);
        }
        if let Some(since) = self.since {
            all.add("recorded_us >= ?", [Value::Integer(since.as_microsecond())]);
        }
        if let Some(before) = self.before {
            all.add("recorded_us < ?", [Value::Integer(before.as_microsecond())]);
        }
        if let Some([x, y, z]) = self.focus_mm {
            let within = "exists (select 1 from foci where record = id and (x_mm - ?) * (x_mm - ?) + (y_mm - ?) * (y_mm - ?) + \
                          (z_mm - ?) * (z_mm - ?) <= ?)";
            let values = [x, x, y, y, z, z, SAME_FOCUS_MM * SAME_FOCUS_MM].map(Value::Real);
            all.add(within, values);
        }
        if let Some(verdict) = self.verdict {
            all.add("verdict = ?", [text(verdict.as_str())]);
        }
        if let Some(effect) = self.effect {
            all.add("id in (select record from effects where effect = ?)", [text(effect.as_str())]);
        }
        if let Some(above) = self.gap_above {
            all.add("gap > ?", [Value::Real(above)]);
        }
        if let Some(below) = self.gap_below {
            all.add("gap < ?", [Value::Real(below)]);
        }
        if let Some(words) = &self.noted {
            all.add(
                "id in (select record from notes where instr(folded, ?) > 0)",
                [text(&folded(words))],
            );
        }
        all
    }
}

impl Query {
    /// The records, read in a transaction so that they are of one moment.
    pub(crate) fn run(&self, transaction: &Transaction<'_>) -> rusqlite::Result<Vec<Entry>> {
        let Conditions { words, mut values } = self.filter.conditions();
        let by = match &self.sort {
            Sort::Recorded => "recorded_us",
            Sort::Name => "name",
            Sort::Rig => "rig",
            Sort::Gap => "gap",
            Sort::Correlation => "correlation",
            Sort::Points => "points",
            Sort::Figure(name) => {
                values.push(Value::Text(name.as_str().to_owned()));
                "(select value from figures where record = id and name = ?)"
            }
        };
        let limit = self.limit.and_then(|limit| i64::try_from(limit).ok()).unwrap_or(-1);
        values.push(Value::Integer(limit));
        let mut select = transaction.prepare(&format!(
            "select id, folder, fault, name, recorded, rig, state, points, simulator, gap, gap_error, noise_floor, level, level_error, \
             correlation, correlation_error, verdict, temperature_c, temperature_error_c from records where {} order by {by} desc, \
             folder desc limit ?",
            words.join(" and ")
        ))?;
        let found =
            select.query_map(params_from_iter(values), |row| Ok((row.get(0)?, entry_of(row)?)))?;
        let mut found = found.collect::<Result<Vec<(i64, Entry)>, _>>()?;
        found.reverse();
        Details { transaction, figures: &self.figures }.add_to(&mut found)?;
        Ok(found.into_iter().map(|(_, entry)| entry).collect())
    }
}

fn entry_of(row: &Row<'_>) -> rusqlite::Result<Entry> {
    let uncertain = |value: usize| -> rusqlite::Result<Option<Uncertain>> {
        let error: Option<f64> = row.get(value + 1)?;
        let standard_error = error.unwrap_or(f64::NAN);
        Ok(row.get::<_, Option<f64>>(value)?.map(|value| Uncertain { value, standard_error }))
    };
    let text = |column: usize| row.get::<_, Option<String>>(column);
    let verdict = |name: String| Verdict::ALL.into_iter().find(|verdict| verdict.as_str() == name);
    let state = |name: String| State::ALL.into_iter().find(|state| state.as_str() == name);
    Ok(Entry {
        folder: folder_of(row.get_ref(1)?),
        fault: text(2)?,
        name: text(3)?,
        recorded: text(4)?.and_then(|at| at.parse::<Timestamp>().ok()),
        rig: text(5)?,
        state: text(6)?.and_then(state).unwrap_or_default(),
        points: row.get::<_, Option<i64>>(7)?.and_then(|points| points.try_into().ok()),
        simulator: text(8)?.and_then(|name| name.parse::<Simulator>().ok()),
        gap: uncertain(9)?,
        noise_floor: row.get(11)?,
        level: uncertain(12)?,
        correlation: uncertain(14)?,
        verdict: text(16)?.and_then(verdict),
        temperature_c: uncertain(17)?,
        ..Entry::default()
    })
}

/// Reads what other tables have of the records that were found.
struct Details<'t> {
    transaction: &'t Transaction<'t>,
    figures: &'t Wanted,
}

impl Details<'_> {
    fn add_to(&self, found: &mut [(i64, Entry)]) -> rusqlite::Result<()> {
        let prepare = |words: &str| self.transaction.prepare(words);
        let mut foci =
            prepare("select x_mm, y_mm, z_mm from foci where record = ?1 order by number")?;
        let mut heights = prepare("select z_mm from heights where record = ?1 order by z_mm")?;
        let mut effects =
            prepare("select effect from effects where record = ?1 order by position")?;
        let mut notes =
            prepare("select at, who, kind, text from notes where record = ?1 order by position")?;
        let mut all = prepare("select name, value, standard_error from figures where record = ?1")?;
        let mut named = prepare(
            "select name, value, standard_error from figures where record = ?1 and name = ?2",
        )?;
        for (id, entry) in found {
            let id = *id;
            entry.foci_mm = foci.query_map([id], focus_of)?.collect::<Result<_, _>>()?;
            entry.heights_mm =
                heights.query_map([id], |row| row.get(0))?.collect::<Result<_, _>>()?;
            let ids = effects.query_map([id], |row| row.get::<_, String>(0))?;
            let known =
                |id: rusqlite::Result<String>| id.map(|id| id.parse::<EffectId>().ok()).transpose();
            entry.effects = ids.filter_map(known).collect::<Result<_, _>>()?;
            let read = notes.query_map([id], note_of)?;
            entry.notes = read.filter_map(Result::transpose).collect::<Result<_, _>>()?;
            match self.figures {
                Wanted::None => {}
                Wanted::All => {
                    let figures = all.query_map([id], figure_of)?;
                    entry.figures =
                        figures.filter_map(Result::transpose).collect::<Result<_, _>>()?;
                }
                Wanted::Named(names) => {
                    for name in names {
                        let figures = named.query_map((id, name.as_str()), figure_of)?;
                        let figures = figures.filter_map(Result::transpose);
                        entry.figures.extend(figures.collect::<Result<Vec<_>, _>>()?);
                    }
                }
            }
        }
        Ok(())
    }
}

fn focus_of(row: &Row<'_>) -> rusqlite::Result<Option<[f64; 3]>> {
    let at = |axis| row.get::<_, Option<f64>>(axis);
    Ok(match (at(0)?, at(1)?, at(2)?) {
        (Some(x), Some(y), Some(z)) => Some([x, y, z]),
        _ => None,
    })
}

fn note_of(row: &Row<'_>) -> rusqlite::Result<Option<Note>> {
    let text = |column| row.get::<_, String>(column);
    let (at, who, kind, text) = (text(0)?, text(1)?, text(2)?, text(3)?);
    let kind = NoteKind::ALL.into_iter().find(|known| known.as_str() == kind).unwrap_or_default();
    let note = at.parse().ok().and_then(|at| Note::new(at, &who, &text).ok());
    Ok(note.map(|note| note.of_kind(kind)))
}

fn figure_of(row: &Row<'_>) -> rusqlite::Result<Option<(SeriesName, Uncertain)>> {
    let name: String = row.get(0)?;
    let value: Option<f64> = row.get(1)?;
    let standard_error: Option<f64> = row.get(2)?;
    let standard_error = standard_error.unwrap_or(f64::NAN);
    let figure = value.map(|value| Uncertain { value, standard_error });
    Ok(name.parse().ok().zip(figure))
}
