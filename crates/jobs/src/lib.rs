//! Independent pieces of work, on this computer or by Slurm.
//!
//! A [`Work`] is a list of items that do not depend on each other: records to diagnose, cells of a study, planes of a volume. A [`Batch`] is
//! such a work in a folder. Its items are divided into *shards*, contiguous pieces of the list. A shard is run by any process on any
//! computer that sees the folder, and its results appear there whole or not at all. A shard may therefore be killed at any moment, and run
//! twice. The results of all shards, merged in the order of the items, are the same bytes wherever they were computed.
//!
//! | file in the folder | content |
//! |---|---|
//! | `batch.json` | kind, software, digest, items and number of shards |
//! | `shards/NNNNN.jsonl` | the results of a shard, one line an item |
//! | `merged.jsonl` | the results of all items |
//! | `submit.sh`, `slurm.json`, `logs/` | with Slurm: the job script, what was submitted, and what the tasks wrote |
//!
//! ```
//! use fieldgap_jobs::{Batch, Failure, MakeBatch, Product, Work, run_here};
//! use serde_json::{Value, json};
//!
//! struct Squares;
//!
//! impl Work for Squares {
//!     fn kind(&self) -> &str {
//!         "squares"
//!     }
//!     fn description(&self) -> Value {
//!         json!(null)
//!     }
//!     fn items(&self) -> Vec<Value> {
//!         (0..10).map(Value::from).collect()
//!     }
//!     fn run(&self, item: &Value) -> Result<Product, Failure> {
//!         let number = item.as_i64().ok_or_else(|| Failure::new("not a number"))?;
//!         Product::json(&(number * number))
//!     }
//! }
//!
//! # let scratch = std::env::temp_dir().join(format!("fieldgap-squares-{}", std::process::id()));
//! # let folder = scratch.as_path();
//! let make = MakeBatch { software: "1.0", made: "2026-11-24T12:00:00Z", shards: 4 };
//! let batch = Batch::make_or_open(folder, &Squares, &make)?;
//! run_here(&batch, &Squares, 2, &|_| ())?;
//! let last = batch.results()?.last().expect("ten items")?;
//! assert_eq!(last.product, Ok(Product::Json("81".to_owned())));
//! # std::fs::remove_dir_all(folder).expect("removed");
//! # Ok::<(), fieldgap_jobs::JobError>(())
//! ```
//!
//! | to | begin with |
//! |---|---|
//! | describe work | [`Work`] |
//! | make or continue a batch | [`Batch::make_or_open`] |
//! | run it on this computer | [`run_here`] |
//! | run it by Slurm | [`slurm::Slurm`] |
//! | run one shard of it | [`run_shard`] |
//! | read its results | [`Batch::results`] |

mod batch;
mod error;
mod here;
mod merge;
mod results;
mod shard;
pub mod slurm;
mod whole_file;
mod work;

pub use batch::{Batch, MakeBatch, USUAL_SHARDS};
pub use error::{FailedShard, JobError};
pub use here::run_here;
pub use results::{ItemResult, Results};
pub use shard::{ItemDone, ShardRun, run_shard};
pub use work::{Failure, Product, Threads, Work};
