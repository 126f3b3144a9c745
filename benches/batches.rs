//! What a batch costs besides its work: `cargo bench --bench batches`.
//!
//! Items of next to no work are run in shards on one thread, and their results merged. The time of a shard is that of its file, which is
//! on disk before the next one begins; the folder is the system's for temporary files, or the one in TMPDIR.

use std::time::Instant;

use fieldgap::jobs::{Batch, Failure, MakeBatch, Product, Work, run_here};
use serde_json::Value;

/// Items whose results have a kilobyte.
struct Kilobytes(usize);

impl Work for Kilobytes {
    fn kind(&self) -> &str {
        "kilobytes"
    }

    fn description(&self) -> Value {
        Value::Null
    }

    fn items(&self) -> Vec<Value> {
        (0..self.0).map(Value::from).collect()
    }

    fn run(&self, item: &Value) -> Result<Product, Failure> {
        Product::json(&format!("{item:>1022}"))
    }
}

fn main() {
    println!("   items  shards  made (s)  run (s)  a shard (ms)  an item (us)  merged (s)");
    for (items, shards) in
        [(100, 100), (1_000, 100), (1_000, 1_000), (10_000, 1_000), (100_000, 1_000)]
    {
        let folder = std::env::temp_dir().join(format!("fieldgap-batches-{}", std::process::id()));
        let make = MakeBatch { software: "benchmark", made: "now", shards };
        let work = Kilobytes(items);
        let begun = Instant::now();
        let batch = Batch::make_or_open(&folder, &work, &make).expect("a folder for it");
        let made_s = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        run_here(&batch, &work, 1, &|_| ()).expect("room for it");
        let run_s = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        assert_eq!(batch.results().expect("room for it").count(), items);
        let merged_s = begun.elapsed().as_secs_f64();
        std::fs::remove_dir_all(&folder).expect("its own folder");
        println!(
            "{items:8}  {shards:6}  {made_s:8.3}  {run_s:7.3}  {:12.3}  {:12.2}  {merged_s:10.3}",
            1e3 * run_s / shards as f64,
            1e6 * run_s / items as f64
        );
    }
}
