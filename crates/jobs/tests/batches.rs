//! Batches on this computer: the same results in any number of shards, from any number of threads and processes, and after any interruption.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use fieldgap_jobs::{
    Batch, Failure, ItemDone, JobError, MakeBatch, Product, ShardRun, Threads, Work, run_here,
    run_shard,
};
use serde_json::{Value, json};

/// Squares of numbers; multiples of seven fail, and thirteen panics.
struct Squares {
    count: u64,
    threads: Threads,
    runs: AtomicUsize,
}

fn squares(count: u64) -> Squares {
    Squares { count, threads: Threads::One, runs: AtomicUsize::new(0) }
}

impl Work for Squares {
    fn kind(&self) -> &str {
        "squares"
    }

    fn description(&self) -> Value {
        json!({ "power": 2 })
    }

    fn items(&self) -> Vec<Value> {
        (0..self.count).map(Value::from).collect()
    }

    fn threads(&self) -> Threads {
        self.threads
    }

    fn run(&self, item: &Value) -> Result<Product, Failure> {
        self.runs.fetch_add(1, Ordering::Relaxed);
        let number = item.as_u64().expect("a number");
        // Later items are done first.
        let spin = 200 * (self.count - number);
        std::hint::black_box((0..spin).sum::<u64>());
        match number {
            13 => panic!("thirteen"),
            number if number % 7 == 3 => Err(Failure::new(format!("{number} \"fails\""))),
            number if number % 5 == 0 => Ok(Product::Bytes(number.to_le_bytes().to_vec())),
            number => {
                Product::json(&json!({ "square": number * number, "root": (number as f64).sqrt() }))
            }
        }
    }
}

fn make<'m>(shards: usize) -> MakeBatch<'m> {
    MakeBatch { software: "test 1", made: "2026-11-24T00:00:00Z", shards }
}

fn nothing(_: ItemDone) {}

/// The merged results of so many shards, on so many threads.
fn merged(work: &Squares, shards: usize, threads: usize) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let batch = Batch::make_or_open(folder.path(), work, &make(shards)).expect("made");
    let done = AtomicUsize::new(0);
    run_here(&batch, work, threads, &|_| {
        done.fetch_add(1, Ordering::Relaxed);
    })
    .expect("run");
    assert_eq!(done.into_inner() as u64, work.count);
    drop(batch.results().expect("merged"));
    std::fs::read(batch.merged_path()).expect("there")
}

#[test]
fn shards_and_threads_do_not_change_the_results() {
    let work = squares(40);
    let expected = merged(&work, 1, 1);
    for (shards, threads) in [(1, 4), (3, 1), (7, 3), (40, 4), (1000, 2)] {
        assert_eq!(merged(&work, shards, threads), expected, "{shards} shards, {threads} threads");
    }
    let all = Squares { threads: Threads::All, ..squares(40) };
    assert_eq!(merged(&all, 7, 3), expected);
}

#[test]
fn every_item_has_its_result_or_its_failure() {
    let folder = tempfile::tempdir().expect("a folder");
    let work = squares(20);
    let batch = Batch::make_or_open(folder.path(), &work, &make(4)).expect("made");
    run_here(&batch, &work, 2, &nothing).expect("run");
    let results: Vec<_> = batch.results().expect("merged").collect::<Result<_, _>>().expect("good");
    assert_eq!(results.len(), 20);
    for (number, result) in results.into_iter().enumerate() {
        assert_eq!(result.item, number);
        match number {
            13 => assert!(result.product.expect_err("panics").to_string().contains("thirteen")),
            number if number % 7 == 3 => {
                let said = result.product.expect_err("fails").to_string();
                assert_eq!(said, format!("{number} \"fails\""));
            }
            number if number % 5 == 0 => {
                let bytes = (number as u64).to_le_bytes().to_vec();
                assert_eq!(result.product, Ok(Product::Bytes(bytes)));
            }
            number => {
                let Ok(Product::Json(json)) = result.product else { panic!("{number}") };
                let value: Value = serde_json::from_str(&json).expect("JSON");
                assert_eq!(value["root"].as_f64(), Some((number as f64).sqrt()));
            }
        }
    }
}

#[test]
fn an_interrupted_batch_is_continued() {
    let folder = tempfile::tempdir().expect("a folder");
    let work = squares(30);
    let batch = Batch::make_or_open(folder.path(), &work, &make(10)).expect("made");
    for shard in [7, 2] {
        assert!(matches!(
            run_shard(&batch, shard, &work, 1, &nothing),
            Ok(ShardRun::Run { items: 3, .. })
        ));
    }
    // What a killed process leaves.
    std::fs::write(folder.path().join("shards/.00003.jsonl.node.17.0.part"), "{").expect("written");
    assert!(matches!(batch.results(), Err(JobError::Unfinished { missing: 8, shards: 10, .. })));
    let again = Batch::make_or_open(folder.path(), &work, &make(3)).expect("the same work");
    assert_eq!((again.shards(), again.digest()), (10, batch.digest()));
    let before = work.runs.load(Ordering::Relaxed);
    run_here(&again, &work, 2, &nothing).expect("run");
    assert_eq!(work.runs.load(Ordering::Relaxed) - before, 24);
    assert_eq!(again.results().expect("merged").count(), 30);
    assert_eq!(run_shard(&batch, 2, &work, 1, &nothing).expect("known"), ShardRun::Known);
    let left = std::fs::read_dir(folder.path().join("shards")).expect("a folder").count();
    assert_eq!(left, 10, "unfinished files are removed");
}

#[test]
fn two_that_run_the_same_shard_at_once_leave_the_same_results() {
    let folder = tempfile::tempdir().expect("a folder");
    let work = squares(200);
    let batch = Batch::make_or_open(folder.path(), &work, &make(2)).expect("made");
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                for shard in [0, 1] {
                    run_shard(&batch, shard, &work, 1, &nothing).expect("run or known");
                }
            });
        }
    });
    drop(batch.results().expect("merged"));
    let merged_here = std::fs::read(batch.merged_path()).expect("there");
    assert_eq!(merged_here, merged(&squares(200), 1, 1));
}

#[test]
fn other_work_other_versions_and_damage_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = Batch::make_or_open(folder.path(), &squares(9), &make(3)).expect("made");
    let other = Batch::make_or_open(folder.path(), &squares(8), &make(3));
    assert!(matches!(other, Err(JobError::AnotherWork { differs: "list of items", .. })));
    made.is_of(&squares(8)).expect("the same kind, with other items");
    let later = MakeBatch { software: "test 2", ..make(3) };
    let error =
        Batch::make_or_open(folder.path(), &squares(9), &later).expect_err("another version");
    assert!(error.to_string().ends_with("was made by test 1, and this is test 2"), "{error}");
    assert!(matches!(
        Batch::make_or_open(&folder.path().join("none"), &squares(0), &make(3)),
        Err(JobError::NoItems)
    ));
    assert!(matches!(Batch::open(&folder.path().join("none")), Err(JobError::NoBatch(_))));
    let none = run_shard(&made, 3, &squares(9), 1, &nothing);
    assert!(matches!(none, Err(JobError::NoShard { number: 3, last: 2, .. })));

    run_here(&made, &squares(9), 1, &nothing).expect("run");
    let path = made.shard_path(1);
    let good = std::fs::read_to_string(&path).expect("there");
    for (damage, line) in [
        (good.replacen("\"item\":4", "\"item\":5", 1), 3),
        (good[..good.len() - 3].to_owned(), 4),
        (good.replacen("\"first\":3", "\"first\":2", 1), 1),
        (format!("{good}{{}}\n"), 5),
        (String::new(), 1),
    ] {
        std::fs::write(&path, damage).expect("written");
        match made.results().map(|_| ()) {
            Err(JobError::Damaged { path: named, line: at, .. }) => {
                assert_eq!((named, at), (path.clone(), line))
            }
            other => panic!("{other:?}"),
        }
    }
    // As the help says.
    std::fs::remove_file(&path).expect("removed");
    run_here(&made, &squares(9), 1, &nothing).expect("run");
    assert_eq!(made.results().expect("merged").count(), 9);

    let batch_file = folder.path().join("batch.json");
    let text = std::fs::read_to_string(&batch_file).expect("there");
    for wrong in [
        text.replace("\"power\":2", "\"power\":3"),
        text.replace("\"shards\":3", "\"shards\":0"),
        "{}".to_owned(),
    ] {
        assert!(matches!(
            Batch::parse(Path::new("b").to_owned(), wrong.as_bytes()),
            Err(JobError::NotABatch { .. })
        ));
    }
}
