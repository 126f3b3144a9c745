//! A focus in space and time: its path, divided into pieces of known duration.

use super::path::{Path, PathGeometry};
use fieldgap_acoustics::Vec3;

/// Fewest positions per oscillation of a lateral modulation.
const MIN_POSITIONS_PER_OSCILLATION: usize = 8;

/// Speed along a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// Constant speed, with a rest at each corner.
    Speed {
        /// m/s, above zero.
        speed_m_s: f64,
        /// Rest at each corner, s.
        dwell_s: f64,
    },
    /// Time at each point, s.
    Dwell(f64),
    /// Loops per second, Hz.
    Rate(f64),
}

/// An oscillation of a focus about its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Direction, unit vector.
    pub along: Vec3,
}

/// A position and how long the focus stays there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Position, m.
    pub at_m: Vec3,
    /// Duration, s, above zero.
    pub lasts_s: f64,
}

/// A loop of at least one piece.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    pieces: Vec<Piece>,
    still: bool,
}

impl Track {
    /// How many pieces a track would have, without making them.
    pub(super) fn count(path: &Path, pace: Pace, swing: Option<Swing>, step_m: f64) -> f64 {
        let (pieces, loop_s) = match path.geometry() {
            PathGeometry::Still(_) => (1.0, swing.map_or(1.0, |swing| 1.0 / swing.frequency_hz)),
            PathGeometry::Jumps(places) => {
                let pieces = places.len() as f64;
                let loop_s = match pace {
                    Pace::Dwell(dwell_s) | Pace::Speed { dwell_s, .. } => dwell_s * pieces,
                    Pace::Rate(rate_hz) => 1.0 / rate_hz,
                };
                (pieces, loop_s)
            }
            PathGeometry::Legs(legs) => {
                let whole_m: f64 = legs.iter().map(|leg| leg.length_m).sum();
                let loop_s = match pace {
                    Pace::Speed { speed_m_s, dwell_s } => {
                        whole_m / speed_m_s + dwell_s * legs.len() as f64
                    }
                    Pace::Rate(rate_hz) => 1.0 / rate_hz,
                    Pace::Dwell(loop_s) => loop_s,
                };
                (whole_m / step_m + 2.0 * legs.len() as f64, loop_s)
            }
        };
        let oscillating = swing.map_or(0.0, |swing| {
            let places =
                (4.0 * swing.amplitude_m / step_m).max(MIN_POSITIONS_PER_OSCILLATION as f64);
            (loop_s * swing.frequency_hz).max(1.0) * places
        });
        pieces.max(oscillating)
    }

    /// Divides a path into pieces no longer than `step_m`. Each piece is represented by its centre.
    pub fn new(path: &Path, pace: Pace, step_m: f64) -> Self {
        let legs = match path.geometry() {
            PathGeometry::Still(at_m) => {
                return Self { pieces: vec![Piece { at_m, lasts_s: 1.0 }], still: true };
            }
            PathGeometry::Jumps(places) => {
                let lasts_s = match pace {
                    Pace::Dwell(dwell_s) | Pace::Speed { dwell_s, .. } => dwell_s,
                    Pace::Rate(rate_hz) => 1.0 / (rate_hz * places.len() as f64),
                };
                let pieces = places.into_iter().map(|at_m| Piece { at_m, lasts_s }).collect();
                return Self { pieces, still: false };
            }
            PathGeometry::Legs(legs) => legs,
        };
        let whole_m: f64 = legs.iter().map(|leg| leg.length_m).sum();
        let (speed_m_s, dwell_s) = match pace {
            Pace::Speed { speed_m_s, dwell_s } => (speed_m_s, dwell_s),
            Pace::Rate(rate_hz) => (whole_m * rate_hz, 0.0),
            Pace::Dwell(loop_s) => (whole_m / loop_s, 0.0),
        };
        let mut pieces = Vec::new();
        for leg in &legs {
            if dwell_s > 0.0 && legs.len() > 1 {
                pieces.push(Piece { at_m: leg.at(0.0), lasts_s: dwell_s });
            }
            let parts = (leg.length_m / step_m).ceil().max(1.0) as usize;
            let lasts_s = leg.length_m / speed_m_s / parts as f64;
            pieces.extend((0..parts).map(|part| {
                let at_m = leg.at((part as f64 + 0.5) / parts as f64);
                Piece { at_m, lasts_s }
            }));
        }
        Self { pieces, still: false }
    }

    /// The same track with an oscillation, in steps no longer than `step_m`.
    ///
    /// The frequency is rounded so that a loop has a whole number of oscillations.
    pub fn swinging(&self, swing: Swing, step_m: f64) -> Self {
        let loop_s = if self.still { 1.0 / swing.frequency_hz } else { self.loop_s() };
        let swings = (loop_s * swing.frequency_hz).round().max(1.0);
        let places =
            ((4.0 * swing.amplitude_m / step_m).ceil() as usize).max(MIN_POSITIONS_PER_OSCILLATION);
        let count = swings as usize * places;
        let lasts_s = loop_s / count as f64;
        let pieces = (0..count)
            .map(|place| {
                let time_s = (place as f64 + 0.5) * lasts_s;
                let phase = std::f64::consts::TAU * swings * time_s / loop_s;
                let at_m = self.at(time_s) + swing.along * (swing.amplitude_m * phase.sin());
                Piece { at_m, lasts_s }
            })
            .collect();
        Self { pieces, still: false }
    }

    /// Its pieces, at least one.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Whether it is at rest; it then fits a loop of any duration.
    pub fn is_still(&self) -> bool {
        self.still
    }

    /// Duration of the loop, s.
    pub fn loop_s(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.lasts_s).sum()
    }

    /// The same track with another loop duration.
    pub fn lasting(&self, loop_s: f64) -> Self {
        let factor = loop_s / self.loop_s();
        let stretched = |piece: &Piece| Piece { lasts_s: piece.lasts_s * factor, ..*piece };
        Self { pieces: self.pieces.iter().map(stretched).collect(), still: self.still }
    }

    /// Position at a time from the start, s.
    pub fn at(&self, time_s: f64) -> Vec3 {
        let mut remaining_s = if self.still { 0.0 } else { time_s.rem_euclid(self.loop_s()) };
        for piece in &self.pieces {
            if remaining_s < piece.lasts_s {
                return piece.at_m;
            }
            remaining_s -= piece.lasts_s;
        }
        self.pieces[self.pieces.len() - 1].at_m
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn path(text: &str) -> Path {
        #[derive(serde::Deserialize)]
        struct File {
            path: Path,
        }
        toml::from_str::<File>(text).expect("valid").path
    }

    proptest! {
        #[test]
        fn a_track_has_the_given_speed_and_step(
            radius in 2.0..30.0f64, speed in 10.0..2000.0f64, step in 0.3..5.0f64,
        ) {
            let circle = path(&format!("path.circle = {{ centre_mm = [0, 0, 100], radius_mm = {radius} }}"));
            let track = Track::new(&circle, Pace::Speed { speed_m_s: speed * 1e-3, dwell_s: 0.0 }, step * 1e-3);
            let length = std::f64::consts::TAU * radius;
            prop_assert!((track.loop_s() - length / speed).abs() < 1e-9 * track.loop_s());
            let pieces = track.pieces();
            for (piece, next) in pieces.iter().zip(pieces.iter().cycle().skip(1)) {
                prop_assert!((next.at_m - piece.at_m).norm() <= step * 1e-3 + 1e-12);
                prop_assert!(((piece.at_m - Vec3::new(0.0, 0.0, 0.1)).norm() - radius * 1e-3).abs() < 1e-12);
            }
        }

        #[test]
        fn positions_are_defined_at_every_time(time in -5.0..20.0f64) {
            let square = path("path.polygon.corners_mm = [[0, 0, 100], [20, 0, 100], [20, 20, 100], [0, 20, 100]]");
            let track = Track::new(&square, Pace::Speed { speed_m_s: 0.04, dwell_s: 0.1 }, 1e-3);
            prop_assert!((track.loop_s() - (4.0 * 0.5 + 4.0 * 0.1)).abs() < 1e-12);
            let at = track.at(time);
            let within = time.rem_euclid(2.4);
            let (side, into) = ((within / 0.6) as usize, within % 0.6);
            let travelled = ((into - 0.1).max(0.0) * 0.04).min(0.02);
            let corner = [(0.0, 0.0), (0.02, 0.0), (0.02, 0.02), (0.0, 0.02)][side];
            let along = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][side];
            let truth = Vec3::new(corner.0 + along.0 * travelled, corner.1 + along.1 * travelled, 0.1);
            prop_assert!((at - truth).norm() <= 0.5e-3 + 1e-9, "{} {}", at, truth);
        }
    }

    #[test]
    fn jumps_dwell_at_each_point() {
        let places = path("path.points_mm = [[0, 0, 100], [20, 0, 100], [0, 20, 100]]");
        let track = Track::new(&places, Pace::Dwell(0.25), 1e-3);
        assert_eq!(track.pieces().len(), 3);
        assert_eq!(track.at(0.3).x, 0.02);
        let fast = Track::new(&places, Pace::Rate(100.0), 1e-3);
        assert!((fast.loop_s() - 0.01).abs() < 1e-15);
    }

    #[test]
    fn an_oscillation_reaches_its_amplitude_on_both_sides() {
        let still = Track::new(&path("path.point_mm = [0, 5, 100]"), Pace::Dwell(1.0), 1e-3);
        let swing = Swing { frequency_hz: 200.0, amplitude_m: 4e-3, along: Vec3::x() };
        let track = still.swinging(swing, 0.5e-3);
        assert!((track.loop_s() - 5e-3).abs() < 1e-15);
        let xs: Vec<f64> = track.pieces().iter().map(|piece| piece.at_m.x).collect();
        let (least, most) = xs.iter().fold((0.0f64, 0.0f64), |(a, b), &x| (a.min(x), b.max(x)));
        assert!(least < -3.9e-3 && most > 3.9e-3 && (least + most).abs() < 1e-9, "{least} {most}");
        assert!(track.pieces().iter().all(|piece| piece.at_m.y == 5e-3));
        // On a path that takes two seconds: 400 oscillations.
        let line = path("path.line = { from_mm = [0, 0, 100], to_mm = [0, 20, 100] }");
        let moving = Track::new(&line, Pace::Rate(0.5), 1e-3).swinging(swing, 2e-3);
        assert_eq!(moving.pieces().len(), 400 * 8);
        assert!((moving.loop_s() - 2.0).abs() < 1e-9);
    }
}
