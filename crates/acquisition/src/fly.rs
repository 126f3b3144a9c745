//! Rows scanned in motion (`[fly]` of a plan): speed, leads, and the readings of a pass.

use super::error::{AcquisitionError, FlightFault};
use super::placement::{LEAST_SAMPLES, Lag, RowTiming};
use super::rig_setup::RigSetup;
use super::rows::Line;
use super::sequencer::{Measurement, PointSequencer};
use fieldgap_acoustics::Vec3;
use fieldgap_input::Speed;
use fieldgap_records::{Fly, RecordedSample, Spread, Visit};
use fieldgap_rig::{Feed, Recording, SafeRig};

use super::error::FLIGHTS;

/// Half width of the window of samples about a point, in wavelengths: within it a parabola fits the field to a thousandth.
const OF_WAVELENGTH: f64 = 0.125;

/// Assumed acceleration of the robot, m/s²: a usual setting of printer firmware.
pub(super) const USUAL_ACCELERATION_M_S2: f64 = 1.0;

/// A lead is longer than the acceleration distance by this length, m, and by this factor.
const SPARE_M: f64 = 0.5e-3;
const SPARE: f64 = 1.2;

/// How much longer than measured the firmware may take to handle a pass, s.
const MORE_HANDLING_S: f64 = 0.03;

/// Length of the first flight by which the handling is measured, m; the second is four times as long. Marlin's steps are a tenth
/// of it at most.
const SHORT_FLIGHT_M: f64 = 0.25e-3;

/// How often each short flight is made: what delays one of them only lengthens it, and the shortest counts.
const SHORT_FLIGHTS: usize = 3;

/// A pass is flown again where its duration, compared with the shortest, may have shifted it by more than this share of a
/// wavelength: the level of a standing wave changes by at most a fifth of its range over that distance.
const EVEN_OF_WAVELENGTH: f64 = 1.0 / 32.0;

/// Largest standard error of a position that a usable lag may cause, m.
const PLACED_WITHIN_M: f64 = 0.05e-3;

/// How rows are scanned in motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flight {
    feed: Feed,
    lead_m: f64,
    widest_m: f64,
    /// How much longer than the shortest a pass may take, s.
    uneven_s: f64,
    lag_s: Option<f64>,
}

impl Flight {
    /// From the section `[fly]` of a plan and the rig set-up.
    pub fn new(fly: &Fly, rig_setup: &RigSetup) -> Self {
        let lag_s = fly.lag_ms.map(|lag_ms| lag_ms.get() * 1e-3);
        Self::at(fly.speed_mm_s, Some(fly), lag_s, rig_setup)
    }

    /// At the speed of a list of readings. Without `lag_ms` a lag of zero is assumed, and not found: play between robot and nozzle looks
    /// like a lag at one speed, and a record in which each speed has a lag of its own would show neither.
    pub fn listed(speed_mm_s: Speed, fly: Option<&Fly>, rig_setup: &RigSetup) -> Self {
        let lag_s = fly.and_then(|fly| fly.lag_ms).map_or(0.0, |lag_ms| lag_ms.get() * 1e-3);
        Self::at(speed_mm_s, fly, Some(lag_s), rig_setup)
    }

    fn at(speed_mm_s: Speed, fly: Option<&Fly>, lag_s: Option<f64>, rig_setup: &RigSetup) -> Self {
        let feed = Feed::from_mm_s(speed_mm_s.into());
        let wavelength_m =
            rig_setup.nominal_medium().speed_of_sound_m_s / rig_setup.array.frequency_hz();
        Self {
            feed,
            lead_m: lead_m(fly, speed_mm_s),
            widest_m: OF_WAVELENGTH * wavelength_m,
            // An error of the duration shifts the centre of a pass by half of it.
            uneven_s: 2.0 * EVEN_OF_WAVELENGTH * wavelength_m / feed.m_s(),
            lag_s,
        }
    }

    /// Length of the lead before and after a row, m.
    pub fn lead_m(&self) -> f64 {
        self.lead_m
    }

    /// Whether the lag of the readings has to be found.
    pub fn wants_lag(&self) -> bool {
        self.lag_s.is_none()
    }

    /// Speed over the points.
    pub fn feed(&self) -> Feed {
        self.feed
    }

    /// Checks that a receiver is fast enough for a row.
    ///
    /// # Errors
    /// [`FlightFault::TooFast`].
    pub fn fits(&self, line: &Line, rate_hz: f64) -> Result<(), FlightFault> {
        let samples = self.timing(line).samples_at(rate_hz);
        // One more, since the first may fall just outside the window.
        let least = LEAST_SAMPLES + 1;
        if samples >= least as f64 {
            return Ok(());
        }
        let speed_mm_s = self.feed.m_s() * 1e3;
        Err(FlightFault::TooFast {
            speed_mm_s,
            rate_hz,
            samples,
            least,
            most_mm_s: speed_mm_s * samples / least as f64,
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

    /// Duration of a pass beyond its length over its speed, s.
    fn over_s(
        &self,
        line: &Line,
        recording: &Recording,
        handling_s: f64,
    ) -> Result<f64, FlightFault> {
        let speed_m_s = self.feed.m_s();
        let way_m = line.step_m() * (line.points - 1) as f64 + 2.0 * self.lead_m;
        let took_s = recording.ended_s - recording.began_s;
        let most_s =
            way_m / speed_m_s + 2.0 * self.lead_m / speed_m_s + handling_s + MORE_HANDLING_S;
        if took_s <= most_s {
            return Ok(took_s - way_m / speed_m_s);
        }
        Err(FlightFault::Slow {
            took_s,
            most_s,
            way_mm: way_m * 1e3,
            speed_mm_s: speed_m_s * 1e3,
            lead_mm: self.lead_m * 1e3,
            handling_ms: handling_s * 1e3,
        })
    }
}

/// Length of the lead before and after a row at a speed, m: that of `[fly]`, unless this speed is higher and needs a longer one.
pub fn lead_m(fly: Option<&Fly>, speed_mm_s: Speed) -> f64 {
    let speed_m_s = speed_mm_s.get() * 1e-3;
    let usual_m = speed_m_s.powi(2) / (2.0 * USUAL_ACCELERATION_M_S2) * SPARE + SPARE_M;
    match fly.and_then(|fly| Some((fly.lead_mm?.get() * 1e-3, fly.speed_mm_s))) {
        None => usual_m,
        Some((lead_m, of_fly)) if speed_mm_s <= of_fly => lead_m,
        Some((lead_m, _)) => lead_m.max(usual_m),
    }
}

/// One pass over a row.
struct Flown {
    recording: Recording,
    /// Reported positions before and after, array frame, m.
    ends_m: [Vec3; 2],
    /// Duration beyond the length over the speed, s.
    over_s: f64,
}

/// Scans rows in motion, and keeps how long each pass took.
#[derive(Debug)]
pub(super) struct Flights {
    flight: Flight,
    over_s: Vec<f64>,
    /// That of the shortest pass.
    least_over_s: f64,
    /// Time that the firmware takes to handle a move, s, once measured.
    handling_s: Option<f64>,
}

impl Flights {
    pub fn new(flight: Flight) -> Self {
        Self { flight, over_s: Vec::new(), least_over_s: f64::INFINITY, handling_s: None }
    }

    /// The same with the handling that flights of another speed measured: it is not that of the motion.
    pub fn handled_like(self, other: Option<&Self>) -> Self {
        Self { handling_s: other.and_then(|other| other.handling_s), ..self }
    }

    /// Scans a row in both directions and finds the lag of the readings behind the robot.
    ///
    /// What delays one of these passes shifts every row. So both are flown again, three times at most, until neither took longer
    /// than the shortest, and the shortest in each direction count.
    ///
    /// # Errors
    /// A device failed, or [`FlightFault`].
    pub async fn find_lag(
        &mut self,
        sequencer: &mut PointSequencer,
        rig: &mut SafeRig,
        row: &[Visit],
    ) -> Result<Lag, AcquisitionError> {
        let line = Line::of(row);
        let even_s = 2.0 * PLACED_WITHIN_M / self.flight.feed.m_s();
        let (mut there, mut back): (Option<Flown>, Option<Flown>) = (None, None);
        for _ in 0..FLIGHTS {
            for (shortest, line) in [(&mut there, line), (&mut back, line.back())] {
                let flown = self.fly_evenly(sequencer, rig, line, row[0].focus).await?;
                if shortest.as_ref().is_none_or(|other| flown.over_s < other.over_s) {
                    *shortest = Some(flown);
                }
            }
            if [&there, &back].into_iter().flatten().all(|flown| self.late_s(flown) <= even_s) {
                break;
            }
        }
        let lag = there.zip(back).and_then(|(there, back)| {
            self.flight.timing(&line).lag(&there.recording, &back.recording)
        });
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
            let flown = self.fly_evenly(sequencer, rig, line, row[0].focus).await?;
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

    /// Summary of the passes, for a person; `None` before the first.
    pub fn evenness(&self) -> Option<String> {
        let n = self.over_s.len() as f64;
        let mean_s = self.over_s.iter().sum::<f64>() / n;
        let squares: f64 = self.over_s.iter().map(|over_s| (over_s - mean_s).powi(2)).sum();
        let spread_s = (squares / (n - 1.0).max(1.0)).sqrt();
        // An error of the duration shifts the centre of a pass by half of it.
        let placed_mm = 0.5e3 * spread_s * self.flight.feed.m_s();
        (n > 0.0).then(|| {
            format!(
                "{n} rows at {} mm/s; acceleration and communication took {:.1} ± {:.1} ms per row, which leaves a position error of {placed_mm:.3} mm",
                self.flight.feed.m_s() * 1e3, mean_s * 1e3, spread_s * 1e3
            )
        })
    }

    /// How much longer a pass took than the shortest, s.
    fn late_s(&self, flown: &Flown) -> f64 {
        flown.over_s - self.least_over_s
    }

    /// Flies over a row again while the pass takes longer than others, as where the computer was busy: the most even pass.
    async fn fly_evenly(
        &mut self,
        sequencer: &mut PointSequencer,
        rig: &mut SafeRig,
        line: Line,
        focus: Option<usize>,
    ) -> Result<Flown, AcquisitionError> {
        let (mut best, mut slow): (Option<Flown>, _) = (None, None);
        for _ in 0..FLIGHTS {
            match self.fly(sequencer, rig, line, focus).await {
                Ok(flown) => {
                    self.least_over_s = self.least_over_s.min(flown.over_s);
                    let is_even = self.late_s(&flown) <= self.flight.uneven_s;
                    if best.as_ref().is_none_or(|best| flown.over_s < best.over_s) {
                        best = Some(flown);
                    }
                    if is_even {
                        break;
                    }
                }
                Err(AcquisitionError::Flight(fault @ FlightFault::Slow { .. })) => {
                    slow = Some(fault);
                }
                Err(error) => return Err(error),
            }
        }
        let middle_mm = 0.5e3 * (line.first_m + line.last_m);
        match (best, slow) {
            (Some(best), _) if self.late_s(&best) <= MORE_HANDLING_S => Ok(best),
            (None, Some(fault)) => Err(fault.into()),
            (best, _) => {
                let late_s = best.map_or(f64::INFINITY, |best| self.late_s(&best));
                Err(FlightFault::Uneven {
                    x_mm: middle_mm.x,
                    y_mm: middle_mm.y,
                    z_mm: middle_mm.z,
                    late_ms: late_s * 1e3,
                    off_mm: 0.5e3 * late_s * self.flight.feed.m_s(),
                }
                .into())
            }
        }
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
        let handling_s = match self.handling_s {
            Some(handling_s) => handling_s,
            None => self.handling_s(sequencer, rig, line).await?,
        };
        self.handling_s = Some(handling_s);
        let (ends, recording) = rig.move_while_recording(to, self.flight.feed).await?;
        rig.confirm(focus.is_some()).await?;
        let over_s = self.flight.over_s(&line, &recording, handling_s)?;
        // The firmware handles a move before it makes it, and answers within milliseconds of the last step: Marlin and GRBL
        // within 3 ms, Klipper within 40 ms.
        let recording = Recording { began_s: recording.began_s + handling_s, ..recording };
        let ends_m = [begins, ends].map(|end| frame.to_array(end));
        Ok(Flown { recording, ends_m, over_s })
    }

    /// Time that the firmware takes to handle a move beside the motion itself, s: the longer of both directions.
    ///
    /// Marlin, for instance, holds the first move for 100 ms, but not one of zero length. So short moves are made along the
    /// row. One of length d that only accelerates and decelerates takes 2 √(d/a), one of 4 d takes twice as long: twice the
    /// first duration less the second is free of the motion.
    async fn handling_s(
        &self,
        sequencer: &PointSequencer,
        rig: &mut SafeRig,
        line: Line,
    ) -> Result<f64, AcquisitionError> {
        let [from_m, to_m] = line.ends_m(self.flight.lead_m);
        let along = (to_m - from_m).normalize();
        // A slow flight would be at its speed within the short moves, which then take longer.
        let feeds = [self.flight.feed, sequencer.feed()];
        let feed = if feeds[0].m_s() < feeds[1].m_s() { feeds[1] } else { feeds[0] };
        let mut took_s = [f64::INFINITY; 4];
        for _ in 0..SHORT_FLIGHTS {
            for (least_s, length_m) in
                took_s.iter_mut().zip([SHORT_FLIGHT_M, 0.0, 4.0 * SHORT_FLIGHT_M, 0.0])
            {
                let to = sequencer.frame().to_robot(from_m + along * length_m);
                let (_, recording) = rig.move_while_recording(to, feed).await?;
                *least_s = least_s.min(recording.ended_s - recording.began_s);
            }
        }
        let handling_s = |short_s: f64, long_s: f64| 2.0 * short_s - long_s;
        let there_s = handling_s(took_s[0], took_s[2]);
        Ok(there_s.max(handling_s(took_s[1], took_s[3])).max(0.0))
    }
}

#[cfg(test)]
mod tests;
