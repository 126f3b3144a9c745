//! How the gap of a scan shrinks once its set-up is corrected: the same readings against two simulations.

use std::fmt::Write;

use super::agreement::rms;
use super::comparison::{Comparison, Noise};
use fieldgap_records::{RecordedSample, RecordedScan, SAME_HEIGHT_MM};
use fieldgap_text::{percent, table};

/// The gap of one scan before and after its set-up was corrected.
#[derive(Debug, Clone, PartialEq)]
pub struct Closing {
    /// By drive, then by height, as in the comparisons.
    pub planes: Vec<PlaneClosing>,
    /// All readings together.
    pub overall: Gaps,
}

/// The gaps over one height, for one drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneClosing {
    /// Number of the drive.
    pub focus: usize,
    /// Height in the scan's coordinates, mm.
    pub z_mm: f64,
    /// The gaps.
    pub gaps: Gaps,
}

/// Root mean square residuals over some readings at their comparison's gain, relative to the rms of these readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaps {
    /// Of the simulation of the set-up as believed.
    pub before: f64,
    /// Of the simulation of the corrected set-up.
    pub after: f64,
    /// What noise alone leaves of a right simulation, on average.
    pub noise: f64,
}

impl Gaps {
    /// Share of the squared gap beyond noise that the correction took away: 1 if what is left is noise, below 0 if
    /// the gap grew; `None` where there was no gap beyond noise.
    pub fn closed(&self) -> Option<f64> {
        let beyond = |gap: f64| (gap * gap - self.noise * self.noise).max(0.0);
        let before = beyond(self.before);
        (before > 0.0).then(|| 1.0 - beyond(self.after) / before)
    }
}

impl Closing {
    /// Lays the comparisons of `scan` before and after a correction of its set-up beside one another, and beside the noise of
    /// the first, which depends on no cause where the scan has repeats or silence to tell it by.
    pub fn between(scan: &RecordedScan, before: &Comparison, after: &Comparison) -> Self {
        let planes = scan.planes(SAME_HEIGHT_MM).into_iter().filter_map(|plane| {
            let of = |comparison: &Comparison| {
                let same = comparison.planes.iter().find(|compared| {
                    compared.focus == plane.focus
                        && (compared.z_m * 1e3 - plane.z_mm).abs() < SAME_HEIGHT_MM
                })?;
                Some(same.agreement.residual_rms_ratio)
            };
            let noise = noise_ratio(&before.noise, &plane.samples);
            let gaps = Gaps { before: of(before)?, after: of(after)?, noise };
            Some(PlaneClosing { focus: plane.focus, z_mm: plane.z_mm, gaps })
        });
        let driven: Vec<&RecordedSample> =
            scan.samples.iter().filter(|sample| sample.focus.is_some()).collect();
        let overall = Gaps {
            before: before.overall.residual_rms_ratio,
            after: after.overall.residual_rms_ratio,
            noise: noise_ratio(&before.noise, &driven),
        };
        Self { planes: planes.collect(), overall }
    }

    /// A table for people, one line a height (and drive, where there are several) and one for all, and a sentence.
    pub fn to_text(&self) -> String {
        let headings = ["gap, relative to the scan's rms", "before", "after", "noise alone"];
        let row = |name: String, gaps: &Gaps| {
            [name, percent(gaps.before), percent(gaps.after), percent(gaps.noise)]
        };
        let several = self.planes.iter().any(|plane| plane.focus != self.planes[0].focus);
        let mut rows = vec![headings.map(str::to_owned)];
        rows.extend(self.planes.iter().map(|plane| {
            let drive = if several { format!("drive {}, ", plane.focus) } else { String::new() };
            row(format!("{drive}z = {:.1} mm", plane.z_mm), &plane.gaps)
        }));
        rows.push(row("all readings".to_owned(), &self.overall));
        let mut text = table(&rows);
        let Gaps { before, after, noise } = self.overall;
        let what = match self.overall.closed() {
            None => "There was no gap beyond noise to close.".to_owned(),
            Some(_) if after >= before => "The correction does not close the gap.".to_owned(),
            Some(closed) => format!(
                "The correction closes {} of the squared gap beyond noise; what is left is {:.1} times what noise alone leaves.",
                percent(closed),
                after / noise
            ),
        };
        writeln!(text, "  {what}").expect("a string takes what is written to it");
        text.replace('\u{a0}', " ")
    }
}

/// Rms of the noise over the rms of the readings.
fn noise_ratio(noise: &Noise, samples: &[&RecordedSample]) -> f64 {
    let levels = || samples.iter().map(|sample| sample.reading);
    rms(levels().map(|level| noise.at(level))) / rms(levels())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaps(before: f64, after: f64, noise: f64) -> Gaps {
        Gaps { before, after, noise }
    }

    fn closing(overall: Gaps) -> Closing {
        let plane = |focus, z_mm| PlaneClosing { focus, z_mm, gaps: gaps(0.08, 0.009, 0.01) };
        Closing { planes: vec![plane(0, 100.0), plane(1, 100.0)], overall }
    }

    #[test]
    fn a_gap_is_closed_by_what_goes_beyond_noise() {
        // 5² - 3² = 16; of that 4² - 3² = 7 remain.
        let closed = gaps(0.05, 0.04, 0.03).closed().expect("there was a gap");
        assert!((closed - 9.0 / 16.0).abs() < 1e-12, "{closed}");
        assert_eq!(gaps(0.05, 0.02, 0.03).closed(), Some(1.0));
        assert!(gaps(0.05, 0.06, 0.03).closed().is_some_and(|closed| closed < 0.0));
        assert_eq!(gaps(0.02, 0.02, 0.03).closed(), None);
    }

    #[test]
    fn the_words_of_a_closing() {
        let text = closing(gaps(0.0812, 0.011, 0.01)).to_text();
        let lines: Vec<String> = text
            .lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
            .collect();
        assert_eq!(
            lines,
            [
                "gap, relative to the scan's rms before after noise alone",
                "drive 0, z = 100.0 mm 8.00 % 0.90 % 1.00 %",
                "drive 1, z = 100.0 mm 8.00 % 0.90 % 1.00 %",
                "all readings 8.12 % 1.10 % 1.00 %",
                "The correction closes 99.7 % of the squared gap beyond noise; what is left is 1.1 times what noise alone leaves.",
            ]
        );
    }

    #[test]
    fn a_gap_that_stays_is_not_called_closed() {
        let grown = closing(gaps(0.05, 0.06, 0.01)).to_text();
        assert!(grown.contains("does not close the gap"), "{grown}");
        let none = closing(gaps(0.009, 0.009, 0.01)).to_text();
        assert!(none.contains("no gap beyond noise"), "{none}");
    }
}
