//! A diagnosis of a change as text of 80 columns for a terminal.

use fieldgap_text::{ABSENT, fixed, paragraph, percent, significant, table, uncertain};

use crate::change::result::{ChangeCandidate, ChangeDiagnosis, ChangeVerdict};
use crate::effect_id::joined;

/// Candidates less probable than this are not listed, but for the best.
const LEAST_PROBABILITY: f64 = 1e-3;

impl ChangeDiagnosis {
    /// The diagnosis as text, at most 80 columns wide.
    pub fn to_text(&self) -> String {
        let verdict = match self.verdict {
            ChangeVerdict::None => "no change beyond noise".to_owned(),
            ChangeVerdict::Level => "a change of level".to_owned(),
            ChangeVerdict::Explained => format!("explained by {}", joined(&self.effects, " + ")),
            ChangeVerdict::MostlyExplained => {
                format!("mostly explained by {}", joined(&self.effects, " + "))
            }
            ChangeVerdict::Ambiguous => {
                let rivals: Vec<String> =
                    self.alternatives.iter().map(|set| joined(set, " + ")).collect();
                format!("ambiguous: {}", rivals.join(", or "))
            }
            ChangeVerdict::Unexplained => "unexplained".to_owned(),
        };
        let mut text = paragraph(&self.sentence, 0, 0);
        text += &format!("\nVerdict: {verdict}.\n");
        for (letter, record) in [("A", &self.a), ("B", &self.b)] {
            text += &format!("{letter}: {}, {}\n", record.name, record.recorded);
        }
        let left_out = match self.left_out {
            0 => String::new(),
            n => format!(" {n} readings of B have no partner in A."),
        };
        text += &paragraph(
            &format!(
                "{} pairs of readings against {}.{left_out} Level B/A {}.",
                self.pairs,
                self.simulator,
                uncertain(self.level)
            ),
            0,
            2,
        );
        text += "\nMean squared difference, in units of its variance\n";
        let mut rows = vec![
            ["nothing changed".to_owned(), significant(self.chi_square_unchanged, 3)],
            ["the level alone changed".to_owned(), significant(self.chi_square_with_level, 3)],
        ];
        if let Some(best) = self.best().filter(|best| !best.effects.is_empty()) {
            rows.push([
                format!("with {}", joined(&best.effects, " + ")),
                significant(best.chi_square, 3),
            ]);
        }
        rows.push(["noise alone".to_owned(), "1".to_owned()]);
        text += &table(&rows);
        text += "\n";
        text += &self.candidates();
        text += &paragraph(
            &format!(
                "What both have in common: of A's squared residual per reading, {} with the simulation as believed, its model leaves {}. That is \
                 taken for a property of each place.",
                significant(self.common.chi_square_believed, 3),
                significant(self.common.chi_square_fitted, 3)
            ),
            0,
            2,
        );
        text.replace('\u{a0}', " ")
    }

    fn candidates(&self) -> String {
        let listed: Vec<&ChangeCandidate> = self
            .ranked
            .iter()
            .enumerate()
            .filter(|(n, candidate)| *n == 0 || candidate.probability >= LEAST_PROBABILITY)
            .map(|(_, candidate)| candidate)
            .collect();
        let mut rows = vec![["what changed", "probability", "explains", "χ²"].map(str::to_owned)];
        rows.extend(listed.iter().map(|candidate| {
            let name = match candidate.effects.is_empty() {
                true => "nothing but the level".to_owned(),
                false => joined(&candidate.effects, " + "),
            };
            let explained = match self.verdict {
                ChangeVerdict::None => ABSENT.to_owned(),
                _ => percent(candidate.explained_fraction),
            };
            [name, fixed(candidate.probability, 3), explained, significant(candidate.chi_square, 3)]
        }));
        let mut text = table(&rows);
        for candidate in listed.iter().filter(|candidate| !candidate.effects.is_empty()) {
            text += &paragraph(
                &format!(
                    "{}: {}.",
                    joined(&candidate.effects, " + "),
                    candidate.readings.join("; ")
                ),
                2,
                4,
            );
        }
        text + "\n"
    }
}
