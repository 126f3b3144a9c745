//! A diagnosis as text for a terminal. (JSON is the diagnosis itself, serialised.)

mod cause;
mod elements;
mod parameter;
mod standing;

use fieldgap_comparison::{Noise, NoiseSource};
use fieldgap_text::{fixed, paragraph, percent, significant, table, table_rows};
pub use standing::Standing;

use crate::effect_id::joined;
use crate::result::{
    Candidate, Diagnosis, ElementsAccount, PhaseFigures, PlaneShare, Region, Remainder,
    StatedFinding, Verdict, WithinUncertainty,
};

/// More heights than these are not listed; those with the largest shares are.
const MOST_HEIGHTS: usize = 12;
/// More causes than these are not listed among those that are ruled out.
const MOST_RULED_OUT: usize = 15;

impl Region {
    /// The region in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::MainLobe => "main lobe",
            Self::SideLobes => "side lobes",
            Self::Outside => "outside",
        }
    }
}

impl Diagnosis {
    /// The diagnosis as text, at most 80 columns wide but for a plan to copy.
    pub fn to_text(&self) -> String {
        let blocks = [
            paragraph(&self.sentence, 0, 0),
            self.what_was_diagnosed(),
            self.gaps(),
            self.elements.as_ref().map_or(String::new(), ElementsAccount::to_text),
            self.within_uncertainty(),
            self.candidates(),
            self.where_it_lies(),
            self.residual_structure(),
            self.what_is_ruled_out(),
            self.what_stays_open(),
            self.next(),
        ];
        let blocks: Vec<String> = blocks.into_iter().filter(|block| !block.is_empty()).collect();
        blocks.join("\n").replace('\u{a0}', " ")
    }

    fn what_was_diagnosed(&self) -> String {
        let verdict = match self.verdict {
            Verdict::Explained => format!("explained by {}", joined(&self.effects, " + ")),
            Verdict::MostlyExplained => {
                format!("mostly explained by {}", joined(&self.effects, " + "))
            }
            Verdict::Ambiguous => {
                let sets: Vec<String> =
                    self.alternatives.iter().map(|set| joined(set, " + ")).collect();
                format!("ambiguous: {}", sets.join(", or "))
            }
            Verdict::Unexplained => "unexplained".to_owned(),
            Verdict::None => format!("no gap beyond {}", self.nothing_but()),
        };
        let scans = if self.scans.len() > 1 { self.scans.join(", ") } else { self.scan.clone() };
        let left_out = match self.outliers {
            0 => String::new(),
            1 => " One more stands out from those beside it and is left out.".to_owned(),
            more => format!(" {more} more stand out from those beside them and are left out."),
        };
        let slow = self.slow_noise.map_or(String::new(), |share| {
            format!(" The level wanders by {}, slowly.", percent(share))
        });
        paragraph(&format!("Verdict: {verdict}."), 0, 2)
            + &paragraph(
                &format!(
                    "{scans} against {}: {} readings, noise of one {}.{slow}{left_out}",
                    self.simulator,
                    self.points,
                    noise(&self.noise, &self.reading_unit)
                ),
                0,
                2,
            )
            + &paragraph(&format!("Registration: {}", self.registration.why), 0, 2)
            + &self.phases()
    }

    fn phases(&self) -> String {
        let Some(PhaseFigures { readings, noise_rad, rms_before_rad, rms_after_rad }) = self.phase
        else {
            return String::new();
        };
        let differences = format!(
            "Phases of {readings} readings: off by {} rad (rms, the reference's phase and drift taken out) from the nominal simulation, by {} \
             rad from the best candidate; noise of one {} rad beside that of the quadratures.",
            significant(rms_before_rad, 2),
            significant(rms_after_rad, 2),
            significant(noise_rad, 2)
        );
        paragraph(&differences, 0, 2)
    }

    fn gaps(&self) -> String {
        let row = |label: &str, all: String, held_out: String| [label.to_owned(), all, held_out];
        let mut rows = vec![
            row("", "all readings".to_owned(), "held out".to_owned()),
            row("nominal simulation", percent(self.gap_before), percent(self.gap_before_held_out)),
        ];
        if let Some(best) = self.best().filter(|best| !best.effects.is_empty()) {
            rows.push(row(
                &format!("with {}", best.name()),
                percent(best.gap_after),
                percent(best.gap_after_held_out),
            ));
        }
        rows.push(row("noise alone", percent(self.noise_floor), String::new()));
        rows.push(row(
            "explained, of the squared gap beyond noise",
            String::new(),
            percent(self.explained_fraction),
        ));
        let of_what = self.held_out_of_what();
        let mut text =
            format!("Gap, relative to the scan's rms; held out: a fifth of the {of_what}\n");
        text += &table(&rows);
        if let Some(Remainder { share, gap, looks_like, .. }) = &self.remainder {
            let rest = format!(
                "left beyond noise: {}, which is {} of the squared gap; tests that find structure in it: {}",
                percent(*gap),
                percent(*share),
                looks_like.len()
            );
            text += &paragraph(&rest, 2, 2);
        }
        // With a single effect the waterfall says no more than the table.
        if self.waterfall.len() > 2 {
            let steps: Vec<String> = self
                .waterfall
                .iter()
                .map(|step| format!("{} {}", step.name(), percent(step.share)))
                .collect();
            text += &paragraph(&format!("one after another: {}", steps.join(", ")), 2, 2);
        }
        text
    }

    fn within_uncertainty(&self) -> String {
        let Some(WithinUncertainty { gap, departures }) = &self.uncertainty else {
            return String::new();
        };
        let alone = format!(
            "Within its stated uncertainty the set-up departs so, beside the best candidate (without any candidate the gap would be {}):",
            percent(*gap)
        );
        let each = departures.iter().map(|StatedFinding { sentence, in_uncertainties, .. }| {
            let size = significant(*in_uncertainties, 2);
            paragraph(&format!("{sentence} ({size} of the standard uncertainty)"), 2, 4)
        });
        paragraph(&alone, 0, 0) + &each.collect::<String>()
    }

    fn candidates(&self) -> String {
        let contenders = self.contenders();
        if contenders.is_empty() {
            return String::new();
        }
        let headings = ["", "probability", "odds", "gap after", "held out"].map(str::to_owned);
        let mut rows = vec![headings];
        rows.extend(contenders.iter().enumerate().map(|(place, candidate)| {
            [
                format!("{} {}", place + 1, candidate.name()),
                fixed(candidate.probability, 3),
                self.standing(candidate).1,
                percent(candidate.gap_after),
                percent(candidate.gap_after_held_out),
            ]
        }));
        let mut lines = table_rows(&rows).into_iter();
        let mut text = format!("Candidates\n{}", lines.next().unwrap_or_default());
        for (line, candidate) in lines.zip(contenders) {
            text += &line;
            text += &self.parameters(candidate);
        }
        text
    }

    fn parameters(&self, candidate: &Candidate) -> String {
        let rows: Vec<[String; 1]> = candidate
            .parameters
            .iter()
            .map(|(name, value)| {
                [format!("  {name} = {}", value.in_words(name, &self.reading_unit))]
            })
            .collect();
        let readings = candidate.readings.iter().map(|reading| paragraph(reading, 4, 0));
        table(&rows) + &readings.collect::<String>()
    }

    fn where_it_lies(&self) -> String {
        let mut planes: Vec<&PlaneShare> = self.r#where.planes.iter().collect();
        if planes.len() > MOST_HEIGHTS {
            planes.sort_by(|a, b| b.share.total_cmp(&a.share));
            planes.truncate(MOST_HEIGHTS);
        }
        let several_scans = self.scans.len() > 1;
        let several_drives = self.r#where.planes.iter().any(|plane| plane.focus > 0);
        let place = |plane: &PlaneShare| {
            let scan = if several_scans { format!("scan {}, ", plane.scan) } else { String::new() };
            let drive =
                if several_drives { format!("drive {}, ", plane.focus) } else { String::new() };
            format!("{scan}{drive}z = {} mm", fixed(plane.z_mm, 1))
        };
        let mut rows = vec![["", "share", "gap", "gap after"].map(str::to_owned)];
        rows.extend(planes.iter().map(|plane| {
            [place(plane), percent(plane.share), percent(plane.gap), percent(plane.gap_after)]
        }));
        let mut text = "Where the gap lies, as shares of the squared gap beyond noise\n".to_owned();
        if !planes.is_empty() {
            text += &table(&rows);
        }
        if let more @ 1.. = self.r#where.planes.len() - planes.len() {
            text += &format!("  (and {more} more heights with smaller shares)\n");
        }
        let shares = |shares: &[(&str, f64)]| {
            let shares: Vec<String> =
                shares.iter().map(|(name, share)| format!("{name} {}", percent(*share))).collect();
            shares.join(", ")
        };
        let regions: Vec<(&str, f64)> =
            self.r#where.regions.iter().map(|part| (part.region.name(), part.share)).collect();
        let kinds = &self.r#where.kinds;
        text += &paragraph(&format!("regions: {}", shares(&regions)), 2, 2);
        text + &paragraph(
            &format!(
                "kinds: {}",
                shares(&[
                    ("a separate gain for each height", kinds.gain),
                    ("a shift of each height", kinds.registration),
                    ("another shape", kinds.shape),
                    ("noise", kinds.noise),
                ])
            ),
            2,
            2,
        )
    }

    fn residual_structure(&self) -> String {
        if self.residual_tests.is_empty() {
            return String::new();
        }
        let mut rows = vec![["", "before", "after", ""].map(str::to_owned)];
        rows.extend(self.residual_tests.iter().map(|test| {
            let (name, left) = match (test.is_structure(), &test.sign_of) {
                (true, Some(sign)) => (format!("{} ({sign})", test.name), "still there"),
                (true, None) => (test.name.to_owned(), "still there"),
                (false, _) => (test.name.to_owned(), ""),
            };
            let before = test.z_before.map_or_else(String::new, |z| fixed(z, 1));
            [name, before, fixed(test.z, 1), left.to_owned()]
        }));
        "Structure in the residual, in standard deviations of the noise\n".to_owned()
            + &table(&rows)
    }

    fn what_is_ruled_out(&self) -> String {
        let out = self.ruled_out();
        if out.is_empty() {
            return String::new();
        }
        let rows: Vec<[String; 4]> = out
            .iter()
            .take(MOST_RULED_OUT)
            .map(|candidate| {
                let (standing, odds) = self.standing(candidate);
                [
                    candidate.name(),
                    standing.to_string(),
                    odds,
                    format!("leaves {}", percent(candidate.gap_after)),
                ]
            })
            .collect();
        let mut text = "Ruled out, with the odds against the best\n".to_owned() + &table(&rows);
        if let more @ 1.. = out.len().saturating_sub(MOST_RULED_OUT) {
            text += &format!("  (and {more} more with smaller odds)\n");
        }
        text
    }

    fn what_stays_open(&self) -> String {
        if self.undetermined.is_empty() {
            return String::new();
        }
        let sentences =
            self.undetermined.iter().map(|words| paragraph(&format!("- {words}"), 2, 2));
        "What these readings do not determine\n".to_owned() + &sentences.collect::<String>()
    }

    fn next(&self) -> String {
        let Some(next) = &self.next_measurement else { return String::new() };
        let mut text = "Next measurement\n".to_owned();
        text += &paragraph(&next.what, 2, 0);
        text += &paragraph(
            &format!(
                "It is expected to separate the rivals by {} standard deviations of the noise; this scan separates them by {}.",
                significant(next.expected_sigma, 2),
                significant(next.present_sigma, 2)
            ),
            2,
            0,
        );
        if let Some(plan) = &next.plan {
            text += &format!("  Its plan, for `fieldgap scan`:\n\n{}\n", plan.trim_end());
        }
        text
    }
}

/// The noise of a reading and where it is known from, in words.
fn noise(noise: &Noise, unit: &str) -> String {
    let additive = format!("{} {unit}", significant(noise.additive, 3));
    let multiplicative = if noise.multiplicative > 0.0 {
        format!(" and {} of the level", percent(noise.multiplicative))
    } else {
        String::new()
    };
    let source = match noise.source {
        NoiseSource::Repeats => "from points measured several times",
        NoiseSource::SilentReadings => "from dark readings",
        NoiseSource::Maps => {
            "from what the maps hold beyond the wavenumber, as nothing was read twice"
        }
        NoiseSource::Residual => "upper bound, from the residual of the simulation",
    };
    format!("{}{multiplicative}, {source}", additive.trim_end())
}
