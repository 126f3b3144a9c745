//! A rate with its interval and its target.

use serde::Serialize;

/// The two-sided 95 % quantile of the normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// The required range of a number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Target {
    /// At least this.
    AtLeast(f64),
    /// At most this.
    AtMost(f64),
    /// From the first to the second.
    Within(f64, f64),
}

impl Target {
    /// Whether a number meets it.
    pub fn is_met_by(self, value: f64) -> bool {
        match self {
            Self::AtLeast(least) => value >= least,
            Self::AtMost(most) => value <= most,
            Self::Within(least, most) => (least..=most).contains(&value),
        }
    }
}

/// A count out of a total.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rate {
    /// What is counted.
    pub what: String,
    /// The count.
    pub count: usize,
    /// The total.
    pub of: usize,
    /// The share, 0 to 1; `None` for a total of zero.
    pub share: Option<f64>,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// Its target.
    pub target: Option<Target>,
    /// Whether the share meets the target.
    pub met: Option<bool>,
}

impl Rate {
    /// Counts the items for which `is_so` holds.
    pub fn of<T>(
        what: impl Into<String>,
        all: impl IntoIterator<Item = T>,
        is_so: impl Fn(&T) -> bool,
    ) -> Self {
        let (mut count, mut of) = (0, 0);
        for one in all {
            of += 1;
            count += usize::from(is_so(&one));
        }
        Self::counted(what, count, of)
    }

    /// A rate from known counts.
    pub fn counted(what: impl Into<String>, count: usize, of: usize) -> Self {
        let share = (of > 0).then(|| count as f64 / of as f64);
        let interval = wilson(count, of);
        Self { what: what.into(), count, of, share, interval, target: None, met: None }
    }

    /// Adds a target.
    pub fn with(mut self, target: Target) -> Self {
        self.target = Some(target);
        self.met = self.share.map(|share| target.is_met_by(share));
        self
    }
}

/// A number that is not a rate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is.
    pub what: String,
    /// The number; `None` without scans.
    pub value: Option<f64>,
    /// Number of scans.
    pub of: usize,
    /// Its target.
    pub target: Target,
    /// Whether it meets it.
    pub met: Option<bool>,
}

impl Figure {
    /// A number with its target.
    pub fn new(what: &str, value: Option<f64>, of: usize, target: Target) -> Self {
        let met = value.map(|value| target.is_met_by(value));
        Self { what: what.to_owned(), value, of, target, met }
    }
}

/// The 95 % interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22, 209, 1927), which is also valid near 0 and 1.
fn wilson(count: usize, of: usize) -> [f64; 2] {
    if of == 0 {
        return [0.0, 1.0];
    }
    let (n, z2) = (of as f64, Z_95 * Z_95);
    let share = count as f64 / n;
    let centre = share + z2 / (2.0 * n);
    let half = Z_95 * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    [centre - half, centre + half].map(|edge| (edge / (1.0 + z2 / n)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_the_one_of_the_tables() {
        // 81 of 263: 0.2553 to 0.3662 (R. G. Newcombe, Stat. Med. 17, 857, 1998, table I).
        let [low, high] = wilson(81, 263);
        assert!((low - 0.2553).abs() < 5e-5 && (high - 0.3662).abs() < 5e-5, "{low} {high}");
        // 0 of 20: 0 to 0.1611.
        let [low, high] = wilson(0, 20);
        assert!(low == 0.0 && (high - 0.1611).abs() < 5e-5);
    }

    proptest::proptest! {
        #[test]
        fn at_both_edges_the_share_deviates_by_the_quantile(of in 1usize..500, part in 0.0..1.0f64) {
            let count = (part * of as f64) as usize;
            let share = count as f64 / of as f64;
            for edge in wilson(count, of) {
                let deviations = (share - edge).abs() / (edge * (1.0 - edge) / of as f64).sqrt();
                let at_the_end = edge == 0.0 || edge == 1.0;
                proptest::prop_assert!(at_the_end || (deviations - Z_95).abs() < 1e-6);
            }
        }
    }
}
