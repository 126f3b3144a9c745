//! The statistic of one chart, run after run.

use serde::{Deserialize, Serialize};

use crate::run_length::{Statistic, ewma_deviation};
use crate::settings::{ChartKind, Sides};

/// State of a chart: two numbers at most.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Chart {
    rises: f64,
    falls: f64,
}

impl ChartKind {
    /// The statistic whose run length is computed.
    pub fn statistic(self, sides: Sides) -> Statistic {
        let two_sided = sides == Sides::Both;
        match self {
            Self::Ewma { lambda } => Statistic::Ewma { lambda, two_sided },
            Self::Cusum { k } => Statistic::Cusum { k, two_sided },
        }
    }
}

impl Chart {
    /// Takes the next score, and gives the statistic in the unit of its limit; below zero for a fall.
    pub fn step(&mut self, kind: ChartKind, sides: Sides, score: f64) -> f64 {
        match kind {
            ChartKind::Ewma { lambda } => {
                let averaged = |before: f64, score: f64| (1.0 - lambda) * before + lambda * score;
                match sides {
                    Sides::Both => self.rises = averaged(self.rises, score),
                    Sides::Rises => self.rises = averaged(self.rises, score).max(0.0),
                    Sides::Falls => self.falls = averaged(self.falls, -score).max(0.0),
                }
                (self.rises - self.falls) / ewma_deviation(lambda)
            }
            ChartKind::Cusum { k } => {
                if sides != Sides::Falls {
                    self.rises = (self.rises + score - k).max(0.0);
                }
                if sides != Sides::Rises {
                    self.falls = (self.falls - score - k).max(0.0);
                }
                if self.rises >= self.falls { self.rises } else { -self.falls }
            }
        }
    }
}
