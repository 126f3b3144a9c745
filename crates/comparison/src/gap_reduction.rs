//! The gap of a scan before and after its set-up was corrected: the same readings and two simulations.

use std::fmt::Write;

use super::agreement::rms;
use super::comparison::{Comparison, Noise};
use fieldgap_records::{RecordedSample, RecordedScan, SAME_HEIGHT_MM};
use fieldgap_text::{percent, table};

/// The gap of one scan before and after its set-up was corrected.
#[derive(Debug, Clone, PartialEq)]
pub struct GapReduction {
    /// By drive, then by height, as in the comparisons.
    pub planes: Vec<PlaneGaps>,
    /// All readings together.
    pub overall: Gaps,
}

/// The gaps over one height, for one drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneGaps {
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
    /// With the simulation of the assumed set-up.
    pub before: f64,
    /// With the simulation of the corrected set-up.
    pub after: f64,
    /// The mean residual of a perfect simulation, from noise alone.
    pub noise: f64,
}

impl Gaps {
    /// The fraction of the squared gap beyond noise that the correction explains: 1 if the residual is noise, below 0 if the gap grew.
    /// `None` if there was no gap beyond noise.
    pub fn explained_fraction(&self) -> Option<f64> {
        let beyond = |gap: f64| (gap * gap - self.noise * self.noise).max(0.0);
        let before = beyond(self.before);
        (before > 0.0).then(|| 1.0 - beyond(self.after) / before)
    }
}

impl GapReduction {
    /// The gaps of `scan` from its comparisons before and after a correction of its set-up. The noise is that of the first comparison;
    /// it does not depend on the gap if the scan has repeats or silent readings.
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
            Some(PlaneGaps { focus: plane.focus, z_mm: plane.z_mm, gaps })
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

    /// The same with the noise known from elsewhere: over all readings, and by drive and height in mm. Where a diagnosis names the
    /// noise, this states the same number.
    pub fn with_noise(
        mut self,
        overall: f64,
        of_plane: impl Fn(usize, f64) -> Option<f64>,
    ) -> Self {
        self.overall.noise = overall;
        for plane in &mut self.planes {
            plane.gaps.noise = of_plane(plane.focus, plane.z_mm).unwrap_or(plane.gaps.noise);
        }
        self
    }

    /// A table with one line for each height (and drive, if there are several) and one for all readings, and a sentence.
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
        let what = match self.overall.explained_fraction() {
            None => "There was no gap beyond noise.".to_owned(),
            Some(_) if after >= before => "The correction does not reduce the gap.".to_owned(),
            Some(explained) => format!(
                "The correction explains {} of the squared gap beyond noise; the residual is {:.1} times that of noise alone.",
                percent(explained),
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

    fn reduction(overall: Gaps) -> GapReduction {
        let plane = |focus, z_mm| PlaneGaps { focus, z_mm, gaps: gaps(0.08, 0.009, 0.01) };
        GapReduction { planes: vec![plane(0, 100.0), plane(1, 100.0)], overall }
    }

    #[test]
    fn the_explained_fraction_is_of_the_gap_beyond_noise() {
        // 5² - 3² = 16; of that 4² - 3² = 7 remain.
        let explained = gaps(0.05, 0.04, 0.03).explained_fraction().expect("there was a gap");
        assert!((explained - 9.0 / 16.0).abs() < 1e-12, "{explained}");
        assert_eq!(gaps(0.05, 0.02, 0.03).explained_fraction(), Some(1.0));
        assert!(
            gaps(0.05, 0.06, 0.03).explained_fraction().is_some_and(|explained| explained < 0.0)
        );
        assert_eq!(gaps(0.02, 0.02, 0.03).explained_fraction(), None);
    }

    #[test]
    fn the_text_of_a_gap_reduction() {
        let text = reduction(gaps(0.0812, 0.011, 0.01)).to_text();
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
                "The correction explains 99.7 % of the squared gap beyond noise; the residual is 1.1 times that of noise alone.",
            ]
        );
    }

    #[test]
    fn a_gap_that_remains_is_not_called_explained() {
        let grown = reduction(gaps(0.05, 0.06, 0.01)).to_text();
        assert!(grown.contains("does not reduce the gap"), "{grown}");
        let none = reduction(gaps(0.009, 0.009, 0.01)).to_text();
        assert!(none.contains("no gap beyond noise"), "{none}");
    }
}
