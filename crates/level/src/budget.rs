//! Uncertainty budgets of a level, by the GUM (JCGM 100:2008).
//!
//! A level is a function L = f(x1, x2, ...) of quantities with standard uncertainties u(xi). The combined standard uncertainty is the
//! root of the sum of the squared contributions (GUM, equation 10), and the expanded one is twice this. The quantities are taken as
//! independent.

use serde::Serialize;

use crate::DB_PER_NEPER;
use fieldgap_text::{fixed, paragraph, significant, table};

/// Factor of the expanded uncertainty. It covers about 95 % if the level is nearly normally distributed (GUM, 6.3.3).
pub const COVERAGE_FACTOR: f64 = 2.0;

/// How a standard uncertainty was evaluated (GUM, 4.2 and 4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Kind {
    /// By statistics of repeated observations.
    A,
    /// By other knowledge: certificates, data sheets, judgement.
    B,
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::A => "A",
            Self::B => "B",
        })
    }
}

/// One source of uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// What is uncertain.
    pub source: String,
    /// How its uncertainty was evaluated.
    pub kind: Kind,
    /// Standard uncertainty, in `unit`.
    pub standard_uncertainty: f64,
    /// Unit of the quantity.
    pub unit: &'static str,
    /// Change of the level with the quantity, dB per unit.
    pub sensitivity_db: f64,
    /// Contribution to the standard uncertainty of the level, dB, zero or above. Where the level is curved it is more than the product of the
    /// two above.
    pub contribution_db: f64,
    /// Degrees of freedom; `None` if the uncertainty is taken as exactly known.
    pub degrees_of_freedom: Option<f64>,
    /// Whether nobody stated the uncertainty, and the program's own value was taken.
    pub assumed: bool,
}

impl Line {
    /// A source that changes the level by `sensitivity_db` dB per unit, everywhere.
    pub fn linear(
        source: impl Into<String>,
        kind: Kind,
        standard_uncertainty: f64,
        unit: &'static str,
        sensitivity_db: f64,
    ) -> Self {
        Self {
            source: source.into(),
            kind,
            standard_uncertainty,
            unit,
            sensitivity_db,
            contribution_db: (standard_uncertainty * sensitivity_db).abs(),
            degrees_of_freedom: None,
            assumed: false,
        }
    }

    /// A source in decibels of the level itself.
    pub fn decibels(source: impl Into<String>, kind: Kind, standard_uncertainty_db: f64) -> Self {
        Self::linear(source, kind, standard_uncertainty_db, "dB", 1.0)
    }

    /// A factor of the pressure with a relative standard uncertainty.
    pub fn relative(source: impl Into<String>, kind: Kind, relative: f64) -> Self {
        Self::linear(source, kind, 100.0 * relative, "%", 0.01 * DB_PER_NEPER)
    }

    /// A source of which `level_db` gives the level, dB, at a deviation of the quantity.
    ///
    /// Slope and curvature come from the level at one standard uncertainty to either side (GUM, 5.1.3, note 2). The contribution
    /// contains the square term of the note to 5.1.2, by which it does not vanish at a maximum of the field:
    /// u² = (f' u)² + (f'' u²)²/2.
    pub fn of_model(
        source: impl Into<String>,
        kind: Kind,
        standard_uncertainty: f64,
        unit: &'static str,
        level_db: impl Fn(f64) -> f64,
    ) -> Self {
        let u = standard_uncertainty;
        if u == 0.0 {
            return Self::linear(source, kind, 0.0, unit, 0.0);
        }
        let [below, at, above] = [-u, 0.0, u].map(level_db);
        let (first, second) = ((above - below) / 2.0, above - 2.0 * at + below);
        Self {
            contribution_db: first.hypot(second * std::f64::consts::FRAC_1_SQRT_2),
            ..Self::linear(source, kind, u, unit, first / u)
        }
    }

    /// Several components of one quantity, each with the same standard uncertainty, such as the three of a place, as one source.
    pub fn joined(source: impl Into<String>, components: &[Self]) -> Option<Self> {
        let root = |of: fn(&Self) -> f64| {
            components.iter().map(|line| of(line).powi(2)).sum::<f64>().sqrt()
        };
        Some(Self {
            source: source.into(),
            sensitivity_db: root(|line| line.sensitivity_db),
            contribution_db: root(|line| line.contribution_db),
            ..components.first()?.clone()
        })
    }

    /// The same with degrees of freedom.
    #[must_use]
    pub fn with_degrees_of_freedom(self, degrees: f64) -> Self {
        Self { degrees_of_freedom: Some(degrees), ..self }
    }

    /// The same, marked as an uncertainty that nobody stated.
    #[must_use]
    pub fn assumed_if(self, assumed: bool) -> Self {
        Self { assumed, ..self }
    }

    /// Source, type, standard uncertainty, its unit, sensitivity coefficient and contribution, as text.
    pub fn cells(&self) -> [String; 6] {
        let mark = if self.assumed { " *" } else { "" };
        [
            format!("{}{mark}", self.source),
            self.kind.to_string(),
            significant(self.standard_uncertainty, 2),
            self.unit.to_owned(),
            significant(self.sensitivity_db, 2),
            fixed(self.contribution_db, 3),
        ]
    }
}

/// The sources of uncertainty of a level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Budget {
    /// The sources.
    pub lines: Vec<Line>,
    /// Combined standard uncertainty, dB.
    pub combined_db: f64,
    /// Expanded uncertainty, k = 2, dB.
    expanded_db: f64,
    /// Effective degrees of freedom; `None` if all uncertainties are taken as exactly known.
    pub degrees_of_freedom: Option<f64>,
}

impl Budget {
    /// Combines the sources.
    pub fn new(lines: Vec<Line>) -> Self {
        let combined_db = lines.iter().map(|line| line.contribution_db.powi(2)).sum::<f64>().sqrt();
        // Welch and Satterthwaite (GUM, G.4.1).
        let weight = |line: &Line| Some(line.contribution_db.powi(4) / line.degrees_of_freedom?);
        let weights: f64 = lines.iter().filter_map(weight).sum();
        let degrees_of_freedom = (weights > 0.0).then(|| combined_db.powi(4) / weights);
        Self { lines, combined_db, expanded_db: COVERAGE_FACTOR * combined_db, degrees_of_freedom }
    }

    /// Expanded uncertainty of the level, k = 2, dB.
    pub fn expanded_db(&self) -> f64 {
        self.expanded_db
    }

    /// The budget as a table of at most 80 columns, with its sum below.
    pub fn to_text(&self) -> String {
        let heading = ["source", "type", "u", "", "dB per unit", "dB"].map(str::to_owned);
        let rows: Vec<[String; 6]> =
            std::iter::once(heading).chain(self.lines.iter().map(Line::cells)).collect();
        let mut text = table(&rows);
        text += &format!(
            "  combined {} dB; expanded (k = 2) {} dB\n",
            fixed(self.combined_db, 2),
            fixed(self.expanded_db, 2)
        );
        for note in self.notes() {
            text += &paragraph(&note, 2, 2);
        }
        text
    }

    /// What a reader of the budget must know beside its numbers.
    pub fn notes(&self) -> Vec<String> {
        let assumed = self.lines.iter().any(|line| line.assumed);
        let assumed = assumed.then(|| "* not stated; the program's own value was taken".to_owned());
        /// With fewer, two standard deviations cover less than 93 % (GUM, table G.2).
        const ENOUGH: f64 = 10.0;
        let few = self.degrees_of_freedom.filter(|degrees| *degrees < ENOUGH);
        let few = few.map(|degrees| {
            format!(
                "k = 2 covers less than 95 %: the type A uncertainty has {} effective degrees of freedom",
                degrees.floor()
            )
        });
        assumed.into_iter().chain(few).collect()
    }

    /// Standard uncertainty of the pressure, relative.
    pub fn relative(&self) -> f64 {
        self.combined_db / DB_PER_NEPER
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn contributions_add_in_squares() {
        let budget = Budget::new(vec![
            Line::decibels("a", Kind::B, 0.3),
            Line::linear("b", Kind::B, 2.0, "mm", -0.2),
        ]);
        assert!((budget.combined_db - 0.5).abs() < 1e-12);
        assert!((budget.expanded_db() - 1.0).abs() < 1e-12);
        assert_eq!(budget.degrees_of_freedom, None);
    }

    #[test]
    fn components_of_a_place_join_to_its_gradient() {
        let along = |slope: f64| Line::linear("x", Kind::B, 0.1, "mm", slope);
        let joined = Line::joined("place", &[along(2.0), along(-1.0), along(2.0)]).expect("three");
        assert_eq!((joined.sensitivity_db, joined.source.as_str()), (3.0, "place"));
        assert!((joined.contribution_db - 0.3).abs() < 1e-12);
        assert_eq!(Line::joined("place", &[]), None);
    }

    #[test]
    fn a_relative_uncertainty_is_in_decibels_what_it_is_in_pressure() {
        let budget = Budget::new(vec![Line::relative("sensitivity", Kind::B, 0.03)]);
        // 20 lg(1.03) is 0.257 dB; its linear term 0.261 dB.
        assert!((budget.combined_db - 0.2606).abs() < 1e-4);
        assert!((budget.relative() - 0.03).abs() < 1e-12);
    }

    #[test]
    fn the_effective_degrees_of_freedom_are_those_of_the_guides_example() {
        // GUM, H.1.6, the length of an end gauge: 25 (18), 9.7 (25.6), 2.9 (50) and 16.6 nm (2) make 32 nm with 16 degrees.
        let parts = [(25.0, 18.0), (9.7, 25.6), (2.9, 50.0), (16.6, 2.0)];
        let lines = parts.map(|(u, degrees)| {
            Line::decibels("part", Kind::B, u).with_degrees_of_freedom(degrees)
        });
        let budget = Budget::new(lines.to_vec());
        assert!((budget.combined_db - 32.0).abs() < 0.5, "{}", budget.combined_db);
        assert_eq!(budget.degrees_of_freedom.map(f64::floor), Some(16.0));
    }

    #[test]
    fn the_contribution_of_a_curved_source_is_the_standard_deviation_of_its_level() {
        let mut draws = ChaCha8Rng::seed_from_u64(7);
        let at_maximum = |mm: f64| 120.0 - 0.4 * mm * mm;
        let on_slope = |mm: f64| 120.0 + 0.7 * mm - 0.2 * mm * mm;
        for level in [&at_maximum as &dyn Fn(f64) -> f64, &on_slope] {
            let line = Line::of_model("place", Kind::B, 0.5, "mm", level);
            let levels: Vec<f64> = (0..200_000)
                .map(|_| {
                    let normal: f64 = StandardNormal.sample(&mut draws);
                    level(0.5 * normal)
                })
                .collect();
            let mean = levels.iter().sum::<f64>() / levels.len() as f64;
            let variance =
                levels.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / levels.len() as f64;
            assert!(
                (line.contribution_db / variance.sqrt() - 1.0).abs() < 0.01,
                "{line:?} {variance}"
            );
        }
    }
}
