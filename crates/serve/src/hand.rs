//! The rig under hand: opened, operated and left safe by one task, which takes orders and never waits for a page.

mod jog;
mod operation;

use std::any::Any;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Deserialize;
use tokio::sync::{mpsc, oneshot, watch};

use fieldgap_acoustics::{Excitation, Vec3};
use fieldgap_acquisition::RigSetup;
use fieldgap_acquisition::beam_axis::AxisSearch;
use fieldgap_rig::ManualRig;
use fieldgap_rig::watchdog::Watchdog;

pub use self::jog::HEARTBEAT_WITHIN;
use crate::exposure::{Accepted, Exposing};
use crate::hand_state::HandState;
use crate::live::Live;
use crate::refusal::Refusal;

/// Orders that may wait while the rig carries one out.
const WAITING_ORDERS: usize = 32;

/// An open rig with what must live as long as it does.
pub struct HandRig {
    /// The devices.
    pub rig: ManualRig,
    /// Makes the rig safe if this process dies.
    pub watchdog: Option<Watchdog>,
    /// The virtual devices, where there are any.
    pub keeps: Box<dyn Any + Send>,
}

/// The opening of a rig by hand.
pub type Opening = Pin<Box<dyn Future<Output = Result<HandRig, String>> + Send>>;

/// An axis of the array frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Axis {
    X,
    Y,
    Z,
}

/// An order to the rig under hand.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "order", deny_unknown_fields)]
pub(crate) enum Order {
    /// Finds the origin of the axes.
    Home,
    /// Moves straight to a place in the array frame, mm.
    Go { to_mm: [f64; 3] },
    /// Moves by a distance along an axis of the array frame, mm.
    Step { axis: Axis, by_mm: f64 },
    /// Moves along an axis of the array frame for as long as this is repeated with the same number of the hold.
    Jog { hold: u64, axis: Axis, speed_mm_s: f64 },
    /// Ends a jog.
    Release { hold: u64 },
    /// Emits a focus at a place in the array frame, mm, for so many seconds; a continuous wave or as the rig file modulates.
    Focus {
        at_mm: [f64; 3],
        seconds: u64,
        continuous: bool,
        #[serde(default)]
        accepts: Accepted,
    },
    /// Ends all emission.
    Silence,
    /// Averages so many samples.
    Sample { samples: u32 },
    /// Scans crosses through the beam at heights above the array, mm, and fits its axis; searches within this distance at the first, mm.
    FindAxis {
        heights_mm: Vec<f64>,
        reach_mm: f64,
        #[serde(default)]
        accepts: Accepted,
    },
}

impl Order {
    /// The drives of the array that it asks for, the time of it where it is known, s, and what was accepted of the exposure of people.
    pub fn drives(&self) -> Option<(Vec<Excitation>, Option<f64>, &Accepted)> {
        match self {
            Self::Focus { at_mm, seconds, accepts, .. } => {
                let focus = Excitation::Focus(Vec3::from(*at_mm) * 1e-3);
                Some((vec![focus], Some(*seconds as f64), accepts))
            }
            Self::FindAxis { heights_mm, reach_mm, accepts } => {
                let heights_m = heights_mm.iter().map(|mm| mm * 1e-3).collect();
                let search = AxisSearch { heights_m, reach_m: reach_mm * 1e-3 };
                Some((search.drives(), None, accepts))
            }
            _ => None,
        }
    }
}

type Answered = oneshot::Sender<Result<(), String>>;

#[derive(Debug)]
struct Active {
    orders: mpsc::Sender<(Order, Answered)>,
    stops: mpsc::Sender<oneshot::Sender<String>>,
    ended: watch::Receiver<bool>,
}

/// The way to the task that has the rig open, if there is one.
#[derive(Debug, Default)]
pub(crate) struct Hand(Mutex<Option<Active>>);

impl Hand {
    fn active(&self) -> MutexGuard<'_, Option<Active>> {
        let mut active = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if active.as_ref().is_some_and(|active| *active.ended.borrow()) {
            *active = None;
        }
        active
    }

    /// Whether the rig is open.
    pub fn is_open(&self) -> bool {
        self.active().is_some()
    }

    /// Opens the rig that `setup` describes by `opening`, and shows it in `live`. `exposing` keeps the time with the array driven.
    ///
    /// # Errors
    /// It is open, or cannot be opened.
    pub async fn open(
        &self,
        live: &Arc<Live>,
        setup: RigSetup,
        opening: Opening,
        exposing: Arc<dyn Exposing>,
    ) -> Result<(), Refusal> {
        let (opened, told) = oneshot::channel();
        {
            let mut active = self.active();
            if active.is_some() {
                return Err(Refusal::conflict(
                    "the rig is open already",
                    "operate it, or close it first",
                ));
            }
            let (orders, ordered) = mpsc::channel(WAITING_ORDERS);
            let (stops, stopped) = mpsc::channel(WAITING_ORDERS);
            let (end, ended) = watch::channel(false);
            let live = Arc::clone(live);
            tokio::spawn(async move {
                operation::operate(&live, &setup, opening, &*exposing, opened, ordered, stopped)
                    .await;
                live.show_hand(HandState::default());
                end.send_replace(true);
            });
            *active = Some(Active { orders, stops, ended });
        }
        match told.await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(problem)) => {
                Err(Refusal::failed(problem, "see the advice of `fieldgap rig check`"))
            }
            Err(_) => Err(Refusal::failed("the rig could not be opened", "see the server's log")),
        }
    }

    /// Carries out an order.
    ///
    /// # Errors
    /// The rig is not open, is busy, or refuses.
    pub async fn order(&self, order: Order) -> Result<(), Refusal> {
        let (answer, answered) = oneshot::channel();
        let sent = self.active().as_ref().map(|active| active.orders.try_send((order, answer)));
        match sent {
            None => return Err(Refusal::conflict("the rig is not open", "open it by hand first")),
            Some(Err(_)) => {
                return Err(Refusal::conflict(
                    "the rig is busy",
                    "wait for the last order, or stop",
                ));
            }
            Some(Ok(())) => {}
        }
        match answered.await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(problem)) => Err(Refusal::conflict(problem, "see the message on the page")),
            Err(_) => Err(Refusal::conflict("the rig was closed", "open it again")),
        }
    }

    /// Makes the rig safe at once; how it was left, or `None` if it is not open.
    pub async fn stop(&self) -> Option<String> {
        let (answer, answered) = oneshot::channel();
        let sent = self.active().as_ref().map(|active| active.stops.try_send(answer))?;
        sent.ok()?;
        answered.await.ok()
    }

    /// Leaves the rig safe and closes its ports; returns when that is done.
    pub async fn close(&self) {
        let ended = {
            let Some(active) = self.active().take() else { return };
            active.ended
            // Dropping the way of the orders ends the task.
        };
        let mut ended = ended;
        let _ = ended.wait_for(|ended| *ended).await;
    }
}
