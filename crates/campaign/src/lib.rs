//! Many scans against many simulations, by a schedule, on several rigs.
//!
//! [`Campaign`] is what the file says: a base plan, axes over keys of plan and rig file, conditions, a schedule, budgets. A [`Cell`] is one
//! setting in one round, and its record an ordinary one. [`Runner`] measures cells in a [`CampaignFolder`], whose log survives a kill at any
//! time; a [`Laboratory`] gives it clock, rigs, persons and programs. [`Follower`] keeps the control charts.
//!
//! | file | what it holds |
//! |---|---|
//! | `file`, `condition`, `schedule`, `budget`, `bench` | the file of a campaign, as types |
//! | `design` | which cells there are, in what order, and the scan of each |
//! | `forecast` | what all of it is going to take |
//! | `folder` | the log on disk, and the state that it says |
//! | `follow` | figures on control charts |
//! | `overview` | what pages and tables show |
//! | `laboratory`, `runner` | what is needed from outside, and the run itself |

mod bench;
mod budget;
mod condition;
mod design;
mod error;
mod file;
mod folder;
mod follow;
mod forecast;
mod laboratory;
mod overview;
mod runner;
mod schedule;

pub use bench::Bench;
pub use budget::{Budget, Use};
pub use condition::{Condition, ConditionValue, Confirmation, ConfirmedBy, Sensor, SetBy};
pub use design::{Block, Cell, fresh_seed};
pub use error::CampaignError;
pub use file::{After, Axis, BaselineSource, Campaign, CampaignHooks, Order, Retry};
pub use folder::{
    CampaignFolder, CellLog, CellState, Entry, LoggedAlarm, State, What, cell_folder,
};
pub use follow::{BaselineRuns, CellFigures, FollowedRun, Follower, GAP};
pub use forecast::Forecast;
pub use laboratory::{Laboratory, Measured, News};
pub use overview::{AlarmOverview, CellOverview, CellStatus, Dimension, Overview};
pub use runner::{CampaignEnd, FiguresOf, Runner, Selection, followed};
pub use schedule::Schedule;
