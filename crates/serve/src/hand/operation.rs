//! The task that has the rig open.

use std::any::Any;
use std::time::{Duration, Instant};

use tokio::sync::{mpsc, oneshot};
use tokio::time::sleep;

use fieldgap_acoustics::{Excitation, Vec3};
use fieldgap_acquisition::beam_axis::{
    AxisReport, AxisSearch, find_axis, in_words as axis_in_words,
};
use fieldgap_acquisition::{RigSetup, element_delays};
use fieldgap_input::Positive;
use fieldgap_rig::{Feed, Frame, ManualRig, RigError, RobotPosition};

use super::jog::Jogging;
use super::{Answered, HandRig, Opening, Order};
use crate::exposure::Exposing;
use crate::hand_state::HandState;
use crate::live::Live;

/// Time between two readings of the level.
const BETWEEN_LEVELS: Duration = Duration::from_millis(150);

/// Samples averaged per level.
const SAMPLES: usize = 16;

/// Most samples of a reading by hand: a minute at a thousand a second.
const MOST_SAMPLES: u32 = 65_536;

/// Most heights of a search for the beam; a line takes two.
const MOST_HEIGHTS: usize = 20;

/// Longest emission by hand. Whoever wants more presses again; an array that was forgotten falls silent.
const LONGEST_EMISSION_S: u64 = 600;

/// Opens the rig, carries out orders until their sender is gone, and leaves the rig safe.
pub(super) async fn operate(
    live: &Live,
    setup: &RigSetup,
    opening: Opening,
    exposing: &dyn Exposing,
    opened: oneshot::Sender<Result<(), String>>,
    ordered: mpsc::Receiver<(Order, Answered)>,
    stopped: mpsc::Receiver<oneshot::Sender<String>>,
) {
    let HandRig { rig, watchdog, keeps } = match opening.await {
        Ok(rig) => rig,
        Err(problem) => {
            let _ = opened.send(Err(problem));
            return;
        }
    };
    let mut operation = Operation {
        live,
        feed: setup.rig.motion.feed(),
        frame: setup.rig.motion.frame(),
        setup,
        exposing,
        rig,
        ordered,
        stopped,
        jogging: Jogging::default(),
        silent_at: None,
        sounds: None,
        state: HandState {
            open: true,
            doing: "stands still, not homed".to_owned(),
            ..HandState::default()
        },
    };
    operation.state.unit = operation.rig.receiver().identity().unit.clone();
    operation.show();
    let _ = opened.send(Ok(()));
    let work = async {
        operation.until_closed().await;
        operation.rig.make_safe("closed").await
    };
    let made = match &watchdog {
        Some(watchdog) => watchdog.follower().follow(work).await,
        None => work.await,
    };
    live.note(format!("rig by hand {made}"));
    drop(keeps);
}

struct Operation<'a> {
    live: &'a Live,
    setup: &'a RigSetup,
    exposing: &'a dyn Exposing,
    feed: Feed,
    frame: Frame,
    rig: ManualRig,
    ordered: mpsc::Receiver<(Order, Answered)>,
    stopped: mpsc::Receiver<oneshot::Sender<String>>,
    jogging: Jogging,
    silent_at: Option<Instant>,
    /// Keeps the time with the array driven.
    sounds: Option<Box<dyn Any + Send>>,
    state: HandState,
}

/// What interrupted a wait.
enum Next {
    Order(Option<(Order, Answered)>),
    Stop(oneshot::Sender<String>),
    Level(Result<f64, RigError>),
    Silence,
}

impl Operation<'_> {
    fn show(&mut self) {
        self.state.seconds_left =
            self.silent_at.map(|at| at.saturating_duration_since(Instant::now()).as_secs() + 1);
        self.live.show_hand(self.state.clone());
    }

    async fn until_closed(&mut self) {
        loop {
            if let Some((by_m, speed_m_s)) = self.jogging.next_move(Instant::now()) {
                self.jog(by_m, speed_m_s).await;
                continue;
            }
            match self.next().await {
                Next::Order(None) => return,
                Next::Order(Some((order, answer))) => {
                    let done = self.carry_out(order).await;
                    self.state.problem = done.as_ref().err().cloned();
                    let _ = answer.send(done);
                }
                Next::Stop(answer) => self.stop(answer).await,
                Next::Level(level) => match level {
                    Ok(level) => self.state.level = Some(level),
                    Err(error) => {
                        self.state.level = None;
                        self.state.problem = Some(error.to_string());
                    }
                },
                Next::Silence => {
                    if let Err(problem) = self.silence().await {
                        self.state.problem = Some(problem);
                    }
                }
            }
            self.show();
        }
    }

    async fn next(&mut self) -> Next {
        let silence = until(self.silent_at);
        let receiver = self.rig.receiver();
        let level = async {
            sleep(BETWEEN_LEVELS).await;
            receiver.read_point(Duration::ZERO, SAMPLES).await.map(|reading| reading.mean)
        };
        tokio::select! {
            biased;
            Some(answer) = self.stopped.recv() => Next::Stop(answer),
            order = self.ordered.recv() => Next::Order(order),
            () = silence => Next::Silence,
            level = level => Next::Level(level),
        }
    }

    async fn carry_out(&mut self, order: Order) -> Result<(), String> {
        match order {
            Order::Home => self.moves("homes", None).await,
            Order::Go { to_mm } => self.moves("moves", Some((place(to_mm)?, self.feed))).await,
            Order::Step { axis, by_mm } => {
                let at_mm = self.state.at_mm.ok_or("the robot must home before its first move")?;
                let to_mm = Vec3::from(at_mm) + axis.unit() * finite(by_mm)?;
                self.moves("moves", Some((to_mm, self.feed))).await
            }
            Order::Jog { hold, axis, speed_mm_s } => {
                self.state.at_mm.ok_or("the robot must home before its first move")?;
                let most = self.feed.mm_s().get();
                if self.jogging.beat(
                    hold,
                    axis,
                    finite(speed_mm_s)?.clamp(-most, most),
                    Instant::now(),
                ) {
                    self.live.note(format!("jog along {axis:?}").to_lowercase());
                }
                Ok(())
            }
            Order::Release { hold } => {
                self.jogging.release(hold);
                Ok(())
            }
            Order::Focus { at_mm, seconds, continuous, .. } => {
                self.focus(place(at_mm)?, seconds, continuous).await
            }
            Order::Silence => self.silence().await,
            Order::Sample { samples } => self.sample(samples).await,
            Order::FindAxis { heights_mm, reach_mm, .. } => {
                let heights_m = heights(heights_mm)?;
                let reach_m = positive(reach_mm)? * 1e-3;
                self.find_axis(&AxisSearch { heights_m, reach_m }).await
            }
        }
    }

    async fn focus(&mut self, at_mm: Vec3, seconds: u64, continuous: bool) -> Result<(), String> {
        if at_mm.z <= 0.0 {
            return Err("the focus does not lie above the array; its z must be positive".to_owned());
        }
        if !(1..=LONGEST_EMISSION_S).contains(&seconds) {
            return Err(format!(
                "the array emits for 1 to {LONGEST_EMISSION_S} s by hand, not for {seconds} s"
            ));
        }
        let delays = element_delays(self.setup, &Excitation::Focus(at_mm * 1e-3));
        // The time of an earlier focus ends here.
        drop(self.sounds.take());
        self.sounds = Some(self.exposing.sounds(self.setup));
        let array = self.rig.array();
        let set = async {
            // The modulation of the rig file is the controller's state after it was opened.
            if continuous {
                array.continuous_wave().await?;
            }
            array.set_delays(&delays).await?;
            array.emit().await
        };
        set.await.map_err(|error| in_words(&error))?;
        self.state.focus_mm = Some(at_mm.into());
        self.silent_at = Some(Instant::now() + Duration::from_secs(seconds));
        Ok(())
    }

    async fn silence(&mut self) -> Result<(), String> {
        self.silent_at = None;
        self.rig.array().silence().await.map_err(|error| in_words(&error))?;
        (self.state.focus_mm, self.sounds) = (None, None);
        Ok(())
    }

    async fn sample(&mut self, samples: u32) -> Result<(), String> {
        if !(1..=MOST_SAMPLES).contains(&samples) {
            return Err(format!("a reading averages 1 to {MOST_SAMPLES} samples, not {samples}"));
        }
        let settle = self.setup.rig.receiver.settle();
        let interrupted = {
            let reading = self.rig.receiver().read_point(settle, samples as usize);
            tokio::select! {
                biased;
                Some(answer) = self.stopped.recv() => Err(Some(answer)),
                () = until(self.silent_at) => Err(None),
                reading = reading => Ok(reading),
            }
        };
        match interrupted {
            Ok(reading) => {
                self.state.sample = Some(reading.map_err(|error| in_words(&error))?);
                Ok(())
            }
            Err(None) => {
                self.silence().await?;
                Err("the emission ended before the reading; emit for longer, or average fewer samples".to_owned())
            }
            Err(Some(answer)) => {
                self.stop(answer).await;
                Err("stopped".to_owned())
            }
        }
    }

    /// Finds the beam axis. A stop interrupts it; other orders are refused meanwhile.
    async fn find_axis(&mut self, search: &AxisSearch) -> Result<(), String> {
        self.state.at_mm.ok_or("the robot must home before its first move")?;
        self.silent_at = None;
        self.state.doing = "searches for the beam".to_owned();
        (self.state.problem, self.state.axis) = (None, None);
        self.show();
        drop(self.sounds.take());
        self.sounds = Some(self.exposing.sounds(self.setup));
        let interrupted = {
            let Self { rig, setup, ordered, stopped, live, .. } = self;
            let searching = find_axis(rig, setup, search, |cross| {
                let [x, y, z] = [cross.x_m.value, cross.y_m.value, cross.z_m].map(|m| m * 1e3);
                live.note(format!("beam at z = {z:.1} mm: x {x:+.3} mm, y {y:+.3} mm"));
            });
            tokio::pin!(searching);
            loop {
                tokio::select! {
                    biased;
                    Some(answer) = stopped.recv() => break Err(Some(answer)),
                    order = ordered.recv() => match order {
                        Some((_, answer)) => {
                            let _ = answer.send(Err("the beam is being searched for; wait, or stop".to_owned()));
                        }
                        // The rig is being closed, which makes it safe.
                        None => break Err(None),
                    },
                    found = &mut searching => break Ok(found),
                }
            }
        };
        match interrupted {
            Ok(found) => {
                // After an error the array may still emit.
                self.silence().await?;
                self.where_it_stands().await;
                let axis = found.map_err(|error| with_help(&error))?;
                let report = AxisReport::new(axis, self.frame);
                self.state.axis = Some(axis_in_words(&report, &self.state.unit));
                Ok(())
            }
            Err(Some(answer)) => {
                self.stop(answer).await;
                Err("stopped".to_owned())
            }
            Err(None) => Err("the rig was closed".to_owned()),
        }
    }

    async fn jog(&mut self, by_m: Vec3, speed_m_s: f64) {
        let Some(at_mm) = self.state.at_mm else { return self.jogging.end() };
        let feed = Positive::new(speed_m_s * 1e3).map_or(self.feed, Feed::from_mm_s);
        if let Err(problem) = self.moves("jogs", Some((Vec3::from(at_mm) + by_m * 1e3, feed))).await
        {
            self.jogging.end();
            self.state.problem = Some(problem);
        }
        if !self.jogging.is_held() {
            self.state.doing = "stands still".to_owned();
        }
        self.show();
    }

    /// Homes, or moves to a place in the array frame (mm). A stop interrupts it; heartbeats and releases of a jog are taken meanwhile.
    async fn moves(&mut self, doing: &str, to: Option<(Vec3, Feed)>) -> Result<(), String> {
        self.state.doing = doing.to_owned();
        self.state.problem = None;
        self.show();
        let interrupted = {
            let Self { rig, frame, ordered, stopped, jogging, silent_at, sounds, state, .. } = self;
            let (robot, array) = rig.robot_and_array();
            let moving = async {
                match to {
                    Some((to_mm, feed)) => robot.move_to(frame.to_robot(to_mm * 1e-3), feed).await,
                    None => robot.home().await,
                }
            };
            tokio::pin!(moving);
            loop {
                let due = *silent_at;
                tokio::select! {
                    biased;
                    Some(answer) = stopped.recv() => break Err(answer),
                    () = until(due) => {
                        *silent_at = None;
                        match array.silence().await {
                            Ok(()) => (state.focus_mm, *sounds) = (None, None),
                            Err(error) => state.problem = Some(in_words(&error)),
                        }
                    }
                    Some((order, answer)) = ordered.recv() => {
                        let _ = answer.send(meanwhile(order, jogging, silent_at));
                    }
                    arrived = &mut moving => break Ok(arrived),
                }
            }
        };
        match interrupted {
            Ok(Ok(at)) => {
                self.arrived(at);
                Ok(())
            }
            Ok(Err(error)) => {
                // A refused move leaves the robot where it stands; a failed one loses its place.
                self.where_it_stands().await;
                Err(in_words(&error))
            }
            Err(answer) => {
                self.stop(answer).await;
                Err("stopped".to_owned())
            }
        }
    }

    /// Asks the robot for its place.
    async fn where_it_stands(&mut self) {
        match self.rig.robot().confirm_place().await {
            Ok(at) => self.arrived(at),
            Err(_) => {
                self.state.at_mm = None;
                self.state.doing = "must home: its place is unknown".to_owned();
            }
        }
    }

    fn arrived(&mut self, at: RobotPosition) {
        self.state.at_mm = Some((self.frame.to_array(at) * 1e3).into());
        self.state.doing = "stands still".to_owned();
    }

    async fn stop(&mut self, answer: oneshot::Sender<String>) {
        self.jogging.end();
        self.silent_at = None;
        let made = self.rig.make_safe("stopped").await;
        self.state.at_mm = None;
        if made.array.as_ref().is_some_and(Result::is_ok) {
            (self.state.focus_mm, self.sounds) = (None, None);
        }
        self.state.doing = "must home: it was stopped".to_owned();
        let _ = answer.send(made.to_string());
    }
}

/// What is done about an order while the robot moves.
fn meanwhile(
    order: Order,
    jogging: &mut Jogging,
    silent_at: &mut Option<Instant>,
) -> Result<(), String> {
    match order {
        Order::Jog { hold, axis, speed_mm_s } if jogging.is_held() => {
            jogging.beat(hold, axis, finite(speed_mm_s)?, Instant::now());
            Ok(())
        }
        Order::Release { hold } => {
            jogging.release(hold);
            Ok(())
        }
        Order::Silence if silent_at.is_some() => {
            // The loop that moves the robot silences the array at once.
            *silent_at = Some(Instant::now());
            Ok(())
        }
        _ => Err("the robot is moving; wait, or stop it".to_owned()),
    }
}

/// Resolves at an instant; never without one.
async fn until(instant: Option<Instant>) {
    match instant {
        Some(at) => tokio::time::sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}

fn finite(number: f64) -> Result<f64, String> {
    if number.is_finite() { Ok(number) } else { Err("a number is not finite".to_owned()) }
}

fn positive(number: f64) -> Result<f64, String> {
    let positive = finite(number)? > 0.0;
    if positive { Ok(number) } else { Err(format!("{number} is not above zero")) }
}

/// Heights of crosses, m, in ascending order.
fn heights(mm: Vec<f64>) -> Result<Vec<f64>, String> {
    if !(1..=MOST_HEIGHTS).contains(&mm.len()) {
        return Err(format!("name 1 to {MOST_HEIGHTS} heights"));
    }
    let mut heights_m =
        mm.into_iter().map(|mm| Ok(positive(mm)? * 1e-3)).collect::<Result<Vec<f64>, String>>()?;
    heights_m.sort_by(f64::total_cmp);
    heights_m.dedup();
    Ok(heights_m)
}

fn place(mm: [f64; 3]) -> Result<Vec3, String> {
    mm.into_iter().try_for_each(|mm| finite(mm).map(drop))?;
    Ok(mm.into())
}

fn with_help(error: &dyn miette::Diagnostic) -> String {
    let help = error.help().map(|help| format!(". {help}")).unwrap_or_default();
    format!("{error}{help}")
}

fn in_words(error: &RigError) -> String {
    format!("{error}. {}", error.remedy())
}
