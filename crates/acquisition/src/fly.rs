//! Rows flown over: how fast and how far, and what becomes of the readings.

use super::dry_run::USUAL_ACCELERATION_M_S2;
use super::error::AcquisitionError;
use super::placement::{LEAST_SAMPLES, Lag, RowTiming};
use super::rig_setup::RigSetup;
use super::rows::Line;
use super::sequencer::{Measurement, PointSequencer};
use fieldgap_acoustics::Vec3;
use fieldgap_records::{Fly, RecordedSample, Spread, Visit};
use fieldgap_rig::{Feed, Recording, SafeRig};

/// How often a row is flown before it is given up.
const FLIGHTS: usize = 3;

/// Share of a wavelength, to either side of a point, from which its samples are taken: a parabola follows a field that far to a
/// thousandth.
const OF_WAVELENGTH: f64 = 0.125;

/// A lead has this much more way than speeding up takes, m, and its share of it.
const SPARE_M: f64 = 0.5e-3;
const SPARE: f64 = 1.2;

/// How much longer than a move of no length a firmware may talk about a flight, s.
const MORE_TALK_S: f64 = 0.03;

/// How well the place of a reading must be known for a lag to be one, m.
const PLACED_WITHIN_M: f64 = 0.05e-3;

/// Why a row cannot be flown as the plan says.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum FlightFault {
    /// Too few samples come over a point.
    #[error(
        "at {speed_mm_s} mm/s a receiver of {rate_hz} Hz gives {samples:.1} samples to a point, and {LEAST_SAMPLES} are needed"
    )]
    #[diagnostic(help("lower `speed_mm_s` in [fly] of the plan to {most_mm_s:.0} at most"))]
    TooFast {
        /// The plan's speed.
        speed_mm_s: f64,
        /// The receiver's rate.
        rate_hz: f64,
        /// Samples that a reading would be made of.
        samples: f64,
        /// The largest speed that does.
        most_mm_s: f64,
    },
    /// The robot was slower than the plan says.
    #[error(
        "the robot took {took_s:.3} s for a row of {way_mm:.1} mm; at {speed_mm_s} mm/s with leads of {lead_mm:.1} mm it takes {most_s:.3} s at most"
    )]
    #[diagnostic(help(
        "raise `lead_mm` in [fly] of the plan, so that the robot is at full speed over the points; or lower `speed_mm_s`, where the \
         firmware does not allow it"
    ))]
    Slow {
        /// Time of the flight.
        took_s: f64,
        /// The longest that it may take.
        most_s: f64,
        /// Its way, leads included.
        way_mm: f64,
        /// The plan's speed.
        speed_mm_s: f64,
        /// The lead.
        lead_mm: f64,
    },
    /// Samples were lost, each time that a row was flown.
    #[error(
        "over ({x_mm:.1}, {y_mm:.1}, {z_mm:.1}) mm too few samples came, though the row was flown {FLIGHTS} times"
    )]
    #[diagnostic(help(
        "check the receiver's cable and rate with `fieldgap rig check`; a lead that is too short leaves the ends of rows without samples"
    ))]
    Thin {
        /// Where.
        x_mm: f64,
        /// Where.
        y_mm: f64,
        /// Where.
        z_mm: f64,
    },
    /// The row there and back does not show by how much readings are late.
    #[error("the row past ({x_mm:.1}, {y_mm:.1}, {z_mm:.1}) mm, flown there and back, does not tell how far the readings lag behind the robot{}",
        found.map_or_else(String::new, |(ms, error)| format!(": {ms:.2} ± {error:.2} ms")))]
    #[diagnostic(help(
        "let the plan have a row through the focus, where the field has structure; or give the lag as `lag_ms` in [fly]"
    ))]
    NoLag {
        /// The row's middle.
        x_mm: f64,
        /// The row's middle.
        y_mm: f64,
        /// The row's middle.
        z_mm: f64,
        /// What was found, with its standard error, ms.
        found: Option<(f64, f64)>,
    },
}

/// How the rows of a plan are flown on a rig.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flight {
    feed: Feed,
    lead_m: f64,
    widest_m: f64,
    lag_s: Option<f64>,
}

impl Flight {
    /// As a plan says, on a rig.
    pub fn new(fly: &Fly, rig_setup: &RigSetup) -> Self {
        let feed = Feed::from_mm_s(fly.speed_mm_s);
        let wavelength_m =
            rig_setup.nominal_medium().speed_of_sound_m_s / rig_setup.array.frequency_hz();
        let usual_m = feed.m_s().powi(2) / (2.0 * USUAL_ACCELERATION_M_S2) * SPARE + SPARE_M;
        Self {
            feed,
            lead_m: fly.lead_mm.map_or(usual_m, |lead_mm| lead_mm.get() * 1e-3),
            widest_m: OF_WAVELENGTH * wavelength_m,
            lag_s: fly.lag_ms.map(|lag_ms| lag_ms.get() * 1e-3),
        }
    }

    /// The way before and behind a row, m.
    pub fn lead_m(&self) -> f64 {
        self.lead_m
    }

    /// The speed over its points.
    pub fn feed(&self) -> Feed {
        self.feed
    }

    /// Makes sure that a receiver is quick enough for a row.
    ///
    /// # Errors
    /// [`FlightFault::TooFast`].
    pub fn fits(&self, line: &Line, rate_hz: f64) -> Result<(), FlightFault> {
        let samples = self.timing(line).samples_at(rate_hz);
        let least = LEAST_SAMPLES as f64 + 1.0;
        if samples >= least {
            return Ok(());
        }
        let speed_mm_s = self.feed.m_s() * 1e3;
        Err(FlightFault::TooFast {
            speed_mm_s,
            rate_hz,
            samples,
            most_mm_s: speed_mm_s * samples / least,
        })
    }

    fn timing(&self, line: &Line) -> RowTiming {
        RowTiming {
            points: line.points,
            step_m: line.step_m(),
            speed_m_s: self.feed.m_s(),
            half_width_m: line.step_m().min(self.widest_m),
        }
    }

    /// How much longer than its way at full speed a flight took, s.
    fn over_s(&self, line: &Line, recording: &Recording, talk_s: f64) -> Result<f64, FlightFault> {
        let speed_m_s = self.feed.m_s();
        let way_m = line.step_m() * (line.points - 1) as f64 + 2.0 * self.lead_m;
        let took_s = recording.ended_s - recording.began_s;
        let most_s = way_m / speed_m_s + 2.0 * self.lead_m / speed_m_s + talk_s + MORE_TALK_S;
        if took_s <= most_s {
            return Ok(took_s - way_m / speed_m_s);
        }
        Err(FlightFault::Slow {
            took_s,
            most_s,
            way_mm: way_m * 1e3,
            speed_mm_s: speed_m_s * 1e3,
            lead_mm: self.lead_m * 1e3,
        })
    }
}

/// A row that was flown.
struct Flown {
    recording: Recording,
    /// Where the robot said it was, before and after, array frame, m.
    ends_m: [Vec3; 2],
    over_s: f64,
}

/// The rows flown so far, and how evenly.
#[derive(Debug)]
pub(super) struct Flights {
    flight: Flight,
    over_s: Vec<f64>,
    /// How long a move of no length takes, s, once that is known.
    talk_s: Option<f64>,
}

impl Flights {
    pub fn new(flight: Flight) -> Self {
        Self { flight, over_s: Vec::new(), talk_s: None }
    }

    /// Whether it is still to be found how far readings lag behind.
    pub fn want_lag(&self) -> bool {
        self.flight.lag_s.is_none()
    }

    /// Flies over a row there and back, and finds how far the readings lag behind the robot.
    ///
    /// # Errors
    /// A device that failed; a row that cannot be flown so, or does not tell.
    pub async fn find_lag(
        &mut self,
        sequencer: &mut PointSequencer,
        rig: &mut SafeRig,
        row: &[Visit],
    ) -> Result<Lag, AcquisitionError> {
        let line = Line::of(row);
        let there = self.fly(sequencer, rig, line, row[0].focus).await?;
        let back = self.fly(sequencer, rig, line.back(), row[0].focus).await?;
        let lag = self.flight.timing(&line).lag(&there.recording, &back.recording);
        let is_one = |lag: &Lag| lag.standard_error_s * self.flight.feed.m_s() <= PLACED_WITHIN_M;
        match lag {
            Some(lag) if is_one(&lag) => {
                self.flight.lag_s = Some(lag.lag_s);
                Ok(lag)
            }
            lag => {
                let middle_mm = 0.5e3 * (line.first_m + line.last_m);
                Err(FlightFault::NoLag {
                    x_mm: middle_mm.x,
                    y_mm: middle_mm.y,
                    z_mm: middle_mm.z,
                    found: lag.map(|lag| (lag.lag_s * 1e3, lag.standard_error_s * 1e3)),
                }
                .into())
            }
        }
    }

    /// Flies over a row and reads each of its points. The lag is known.
    ///
    /// # Errors
    /// A device that failed; a row that cannot be flown so.
    pub async fn measure(
        &mut self,
        sequencer: &mut PointSequencer,
        rig: &mut SafeRig,
        row: &[Visit],
    ) -> Result<Vec<Measurement>, AcquisitionError> {
        let line = Line::of(row);
        let course = self.flight.timing(&line);
        let mut thin = row[0].position_m;
        for _ in 0..FLIGHTS {
            let flown = self.fly(sequencer, rig, line, row[0].focus).await?;
            let placed = course.place(&flown.recording, self.flight.lag_s.unwrap_or(0.0));
            if let Some(point) = placed.iter().position(Option::is_none) {
                thin = row[point].position_m;
                continue;
            }
            self.over_s.push(flown.over_s);
            let [from_m, to_m] = line.ends_m(self.flight.lead_m);
            let off_m = [flown.ends_m[0] - from_m, flown.ends_m[1] - to_m];
            let measured = row.iter().zip(placed.into_iter().flatten()).enumerate();
            return Ok(measured
                .map(|(point, (visit, placed))| {
                    let share = point as f64 / (row.len() - 1) as f64;
                    let at_m = visit.position_m + off_m[0] * (1.0 - share) + off_m[1] * share;
                    Measurement {
                        sample: RecordedSample::measured(
                            sequencer.time_s(placed.t_s),
                            visit.focus,
                            at_m,
                            placed.value.max(0.0),
                            Some(Spread { std: placed.std, count: placed.count }),
                        ),
                        clipped: placed.clipped,
                        lost: placed.lost,
                    }
                })
                .collect());
        }
        let at_mm = thin * 1e3;
        Err(FlightFault::Thin { x_mm: at_mm.x, y_mm: at_mm.y, z_mm: at_mm.z }.into())
    }

    /// How evenly the rows were flown, for a person; `None` before the first.
    pub fn evenness(&self) -> Option<String> {
        let n = self.over_s.len() as f64;
        let mean_s = self.over_s.iter().sum::<f64>() / n;
        let squares: f64 = self.over_s.iter().map(|over_s| (over_s - mean_s).powi(2)).sum();
        let spread_s = (squares / (n - 1.0).max(1.0)).sqrt();
        // The middle of a flight is off by half of what its time is off by.
        let placed_mm = 0.5e3 * spread_s * self.flight.feed.m_s();
        (n > 0.0).then(|| {
            format!(
                "{n} rows at {} mm/s; speeding up, slowing down and talk took {:.1} ± {:.1} ms a row, so its place is good to {placed_mm:.3} mm",
                self.flight.feed.m_s() * 1e3, mean_s * 1e3, spread_s * 1e3
            )
        })
    }

    async fn fly(
        &mut self,
        sequencer: &mut PointSequencer,
        rig: &mut SafeRig,
        line: Line,
        focus: Option<usize>,
    ) -> Result<Flown, AcquisitionError> {
        self.flight.fits(&line, rig.receiver().identity().rate_hz)?;
        sequencer.excite(rig, focus).await?;
        let frame = sequencer.frame();
        let [from, to] = line.ends_m(self.flight.lead_m).map(|end_m| frame.to_robot(end_m));
        let begins = rig.move_to(from, sequencer.feed()).await?;
        let talk_s = match self.talk_s {
            Some(talk_s) => talk_s,
            None => {
                let (_, stood) = rig.move_while_recording(from, self.flight.feed).await?;
                stood.ended_s - stood.began_s
            }
        };
        self.talk_s = Some(talk_s);
        let (ends, recording) = rig.move_while_recording(to, self.flight.feed).await?;
        rig.confirm(focus.is_some()).await?;
        let over_s = self.flight.over_s(&line, &recording, talk_s)?;
        let ends_m = [begins, ends].map(|end| frame.to_array(end));
        Ok(Flown { recording, ends_m, over_s })
    }
}
