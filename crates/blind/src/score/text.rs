//! A score as text.

use std::fmt::Write as _;

use super::super::parsed_diagnosis::ParsedVerdict;
use super::rate::{Rate, Target};
use super::{ConfusionRow, Score, StratumScore};

/// Largest number of scans listed in a row of the confusion table.
const NAMED_SCANS: usize = 6;

impl Score {
    /// The score as text tables.
    pub fn to_text(&self) -> String {
        let mut text = format!("{} scans scored", self.scored);
        match self.not_diagnosed.len() {
            0 => text += "\n",
            missing => {
                let _ = writeln!(
                    text,
                    ", {missing} WITHOUT A DIAGNOSIS are left out of everything below"
                );
            }
        }
        self.verdicts_to(&mut text);
        self.rates_to(&mut text);
        self.confusion_to(&mut text);
        self.calibration_to(&mut text);
        self.parameters_to(&mut text);
        self.strata_to(&mut text);
        text
    }

    fn verdicts_to(&self, text: &mut String) {
        use ParsedVerdict::{Ambiguous, Explained, MostlyExplained, None, Unexplained};
        let verdicts = [Explained, MostlyExplained, Ambiguous, Unexplained, None];
        *text += "\ntruth        explained  mostly-explained  ambiguous  unexplained  none\n";
        for row in &self.verdicts {
            let [explained, mostly, ambiguous, unexplained, none] =
                verdicts.map(|verdict| row.verdicts.get(&verdict).copied().unwrap_or_default());
            let _ = writeln!(
                text,
                "{:<11}  {explained:>9}  {mostly:>16}  {ambiguous:>9}  {unexplained:>11}  {none:>4}",
                name(&row.category)
            );
        }
    }

    fn rates_to(&self, text: &mut String) {
        let _ = writeln!(
            text,
            "\n{:<66}  {:>9}  {:>7}  {:<17}  target",
            "rate", "count", "share", "95 % interval"
        );
        for rate in self.rates.iter().filter(|rate| rate.of > 0) {
            let Rate { what, count, of, share, interval: [low, high], target, met } = rate;
            let share = 100.0 * share.unwrap_or_default();
            let interval = format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high);
            let asked = asked(*target, *met, 100.0, " %");
            let row = format!(
                "{what:<66}  {:>9}  {share:>5.1} %  {interval:<17}  {asked}",
                format!("{count}/{of}")
            );
            let _ = writeln!(text, "{}", row.trim_end());
        }
        *text += "\n";
        for figure in &self.figures {
            let value = figure.value.map_or("-".to_owned(), |value| format!("{value:.4}"));
            let asked = asked(Some(figure.target), figure.met, 1.0, "");
            let _ = writeln!(
                text,
                "{:<66}  {:>9}  {value:>7}  {:<17}  {asked}",
                figure.what, figure.of, ""
            );
        }
    }

    fn confusion_to(&self, text: &mut String) {
        *text += "\ntrue -> named (rows that are all right left out)\n";
        for row in self.confusion.iter().filter(|row| row.exact < row.of) {
            let ConfusionRow { truth, of, named, missed, .. } = row;
            let named: Vec<String> =
                named.iter().map(|(name, count)| format!("{name} {count}")).collect();
            let more = if missed.len() > NAMED_SCANS { " ..." } else { "" };
            let missed = &missed[..missed.len().min(NAMED_SCANS)];
            let _ = writeln!(
                text,
                "{truth} ({of}) -> {}  [{}{more}]",
                named.join(", "),
                missed.join(" ")
            );
        }
    }

    fn calibration_to(&self, text: &mut String) {
        *text += "\nstated probability  share right  scans\n";
        for bin in &self.calibration.bins {
            let _ = writeln!(text, "{:>18.3}  {:>11.3}  {:>5}", bin.stated, bin.right, bin.of);
        }
    }

    fn strata_to(&self, text: &mut String) {
        if self.strata.is_empty() {
            return;
        }
        let _ = write!(text, "\n{:<16} {:<20} {:>5}", "laboratories", "", "scans");
        for column in StratumScore::COLUMNS {
            let _ = write!(text, "  {column:>10}");
        }
        *text += "  calibration\n";
        let mut before = "";
        for StratumScore { axis, class, of, rates, calibration } in &self.strata {
            let shown = if axis == before { "" } else { axis };
            before = axis;
            let _ = write!(text, "{shown:<16} {class:<20} {of:>5}");
            for rate in rates {
                let cell = match rate.of {
                    0 => "-".to_owned(),
                    of => format!("{}/{of}", rate.count),
                };
                let _ = write!(text, "  {cell:>10}");
            }
            let error = calibration.error.map_or("-".to_owned(), |error| format!("{error:.3}"));
            let _ = writeln!(text, "  {error:>11}");
        }
        *text += "one, two: named exactly; or rivals: or among two or three; one, or rivals and outside: at 0.5 sigma and more; \
                  outside: not explained; three true: every named one true, where explained\n";
    }

    fn parameters_to(&self, text: &mut String) {
        let _ = writeln!(
            text,
            "\n{:<36}  {:>9}  {:>8}  {:>8}",
            "parameter, where the cause is right", "within 2", "mean z", "rms z"
        );
        for score in &self.parameters {
            let within = format!("{}/{}", score.within_two, score.of);
            let _ = writeln!(
                text,
                "{:<36}  {within:>9}  {:>8.2}  {:>8.2}",
                score.parameter, score.mean_z, score.rms_z
            );
        }
    }
}

fn asked(target: Option<Target>, met: Option<bool>, scale: f64, unit: &str) -> String {
    let Some(target) = target else { return String::new() };
    let asked = match target {
        Target::AtLeast(least) => format!(">= {}{unit}", rounded(scale * least)),
        Target::AtMost(most) => format!("<= {}{unit}", rounded(scale * most)),
        Target::Within(least, most) => {
            format!("{} to {}{unit}", rounded(scale * least), rounded(scale * most))
        }
    };
    match met {
        Some(true) => asked + "  met",
        Some(false) => asked + "  MISSED",
        None => asked,
    }
}

/// Rounded, without the last digits of a multiplication.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// The name of a value in JSON.
fn name(value: &impl serde::Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}
