//! All records of a reanalysis in one table.

use fieldgap_archive::RecordFigures;
use fieldgap_diagnosis::{EffectId, Verdict, joined};
use serde::Serialize;

use crate::before::Before;
use crate::reanalysed::Reanalysed;

/// All records of a reanalysis.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    /// A row for each record, in the order of their paths.
    pub rows: Vec<SummaryRow>,
}

/// One record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SummaryRow {
    /// The record's folder, relative to that of the reanalysis.
    pub record: String,
    /// Why it failed; `None` for one that did not.
    pub failed: Option<String>,
    /// What was known before; `None` for one that failed.
    pub before: Option<Before>,
    /// What is known now.
    pub after: Option<After>,
}

/// What is known of a record now.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct After {
    /// The gap, relative to the scan's rms.
    pub gap: f64,
    /// Its standard error.
    pub gap_error: f64,
    /// The verdict; `None` without a diagnosis.
    pub verdict: Option<Verdict>,
    /// The named effects.
    pub effects: Vec<EffectId>,
}

impl SummaryRow {
    /// The row of a record.
    pub fn of(record: String, result: Result<&Reanalysed, String>) -> Self {
        match result {
            Err(why) => Self { record, failed: Some(why), before: None, after: None },
            Ok(Reanalysed { before, figures, .. }) => Self {
                record,
                failed: None,
                before: Some(before.clone()),
                after: Some(After::of(figures)),
            },
        }
    }
}

impl After {
    fn of(figures: &RecordFigures) -> Self {
        let cause = figures.cause.as_ref();
        Self {
            gap: figures.gap.value,
            gap_error: figures.gap.standard_error,
            verdict: cause.map(|cause| cause.verdict),
            effects: cause.map(|cause| cause.effects.clone()).unwrap_or_default(),
        }
    }
}

impl Summary {
    /// Records that failed.
    pub fn failed(&self) -> usize {
        self.rows.iter().filter(|row| row.failed.is_some()).count()
    }

    /// The table as text.
    pub fn to_text(&self) -> String {
        let width =
            self.rows.iter().map(|row| row.record.chars().count()).max().unwrap_or(0).max(6);
        let mut text =
            format!("{:<width$}  {:>8}  {:>8}  verdict\n", "record", "gap (%)", "now (%)");
        for row in &self.rows {
            let (Some(before), Some(after)) = (&row.before, &row.after) else {
                let why = row.failed.as_deref().unwrap_or_default();
                text += &format!("{:<width$}  failed: {why}\n", row.record);
                continue;
            };
            let gap = before.gap.map_or("-".to_owned(), percent);
            let mark = if before.from_report { ' ' } else { '*' };
            let (was, is) =
                (told(before.verdict, &before.effects), told(after.verdict, &after.effects));
            let verdict = if was == is { is } else { format!("{was} -> {is}") };
            text += &format!(
                "{:<width$}  {gap:>7}{mark}  {:>8}  {verdict}\n",
                row.record,
                percent(after.gap)
            );
        }
        let computed = |row: &&SummaryRow| row.before.as_ref().is_some_and(|b| !b.from_report);
        match self.rows.iter().filter(computed).count() {
            0 => {}
            count => {
                text += &format!(
                    "* {count} without figures in report/: the gap is computed now, with the record's own simulator\n"
                );
            }
        }
        if self.failed() > 0 {
            text += &format!("{} of {} records failed\n", self.failed(), self.rows.len());
        }
        text
    }

    /// The table as CSV.
    pub fn to_csv(&self) -> String {
        let mut csv = "record,simulator_before,gap_before,before_from,verdict_before,effects_before,gap_after,gap_after_error,\
                       verdict_after,effects_after,failed\n"
            .to_owned();
        for row in &self.rows {
            let mut cells = vec![row.record.clone()];
            match &row.before {
                Some(before) => cells.extend([
                    before.simulator.to_string(),
                    number(before.gap),
                    if before.from_report { "report" } else { "computed" }.to_owned(),
                    word(before.verdict),
                    joined(&before.effects, " "),
                ]),
                None => cells.extend([const { String::new() }; 5]),
            }
            match &row.after {
                Some(after) => cells.extend([
                    number(Some(after.gap)),
                    number(Some(after.gap_error)),
                    word(after.verdict),
                    joined(&after.effects, " "),
                ]),
                None => cells.extend([const { String::new() }; 4]),
            }
            cells.push(row.failed.clone().unwrap_or_default());
            let cells: Vec<String> = cells.iter().map(|cell| quoted(cell)).collect();
            csv += &(cells.join(",") + "\n");
        }
        csv
    }
}

fn percent(gap: f64) -> String {
    format!("{:.2}", 100.0 * gap)
}

fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map_or(String::new(), |value| value.to_string())
}

/// Verdict and effects as one phrase.
fn told(verdict: Option<Verdict>, effects: &[EffectId]) -> String {
    match (verdict, effects) {
        (None, _) => "-".to_owned(),
        (verdict, []) => word(verdict),
        (verdict, effects) => format!("{} ({})", word(verdict), joined(effects, ", ")),
    }
}

/// The verdict as in JSON.
fn word(verdict: Option<Verdict>) -> String {
    let json = verdict.and_then(|verdict| serde_json::to_value(verdict).ok());
    json.as_ref().and_then(|json| json.as_str()).unwrap_or_default().to_owned()
}

/// A cell of CSV (RFC 4180).
fn quoted(cell: &str) -> String {
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::Simulator;

    use super::*;

    fn row(
        record: &str,
        before: Before,
        gap: f64,
        verdict: Verdict,
        effects: &[EffectId],
    ) -> SummaryRow {
        let after =
            After { gap, gap_error: 0.0005, verdict: Some(verdict), effects: effects.to_vec() };
        SummaryRow {
            record: record.to_owned(),
            failed: None,
            before: Some(before),
            after: Some(after),
        }
    }

    fn summary() -> Summary {
        let known = Before {
            simulator: Simulator::AsWritten,
            gap: Some(0.1834),
            verdict: Some(Verdict::Unexplained),
            effects: Vec::new(),
            from_report: true,
        };
        let unknown = Before { gap: None, verdict: None, from_report: false, ..known.clone() };
        let pitch = [EffectId::Pitch];
        let failed = "samples.csv:2:1: `a, \"b\"` is not a number".to_owned();
        Summary {
            rows: vec![
                row("2026/a", known.clone(), 0.0312, Verdict::Explained, &pitch),
                row("2026/b", known, 0.2, Verdict::Unexplained, &[]),
                row("2026/c", unknown, 0.03, Verdict::None, &[]),
                SummaryRow {
                    record: "d".to_owned(),
                    failed: Some(failed),
                    before: None,
                    after: None,
                },
            ],
        }
    }

    #[test]
    fn the_table_as_text() {
        insta::assert_snapshot!(summary().to_text(), @r#"
        record   gap (%)   now (%)  verdict
        2026/a    18.34       3.12  unexplained -> explained (pitch)
        2026/b    18.34      20.00  unexplained
        2026/c        -*      3.00  - -> none
        d       failed: samples.csv:2:1: `a, "b"` is not a number
        * 1 without figures in report/: the gap is computed now, with the record's own simulator
        1 of 4 records failed
        "#);
    }

    #[test]
    fn the_table_as_csv() {
        insta::assert_snapshot!(summary().to_csv(), @r#"
        record,simulator_before,gap_before,before_from,verdict_before,effects_before,gap_after,gap_after_error,verdict_after,effects_after,failed
        2026/a,as-written,0.1834,report,unexplained,,0.0312,0.0005,explained,pitch,
        2026/b,as-written,0.1834,report,unexplained,,0.2,0.0005,unexplained,,
        2026/c,as-written,,computed,,,0.03,0.0005,none,,
        d,,,,,,,,,,"samples.csv:2:1: `a, ""b""` is not a number"
        "#);
    }
}
