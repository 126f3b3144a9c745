//! Compares two folders of diagnoses (`NAME.json`, as `fieldgap diagnose --json` prints them), for instance before and after a
//! change of the program that must not change a verdict:
//!
//! ```sh
//! cargo run --release --package fieldgap-diagnosis --example compare_diagnoses -- BEFORE AFTER
//! ```
//!
//! Words must be equal, but for the sentence and the texts, whose wording may change. Numbers must agree to one part in a million
//! of their size, or to a hundredth of the standard error that stands beside them. Exit code 1 where anything differs.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::ExitCode;

use serde_json::Value;

/// Agreement of two numbers, relative to their size.
const RELATIVE: f64 = 1e-6;
/// Agreement of two numbers, relative to the standard error beside them.
const OF_STANDARD_ERROR: f64 = 1e-2;
/// Keys whose values are sentences.
const WORDED: [&str; 9] =
    ["sentence", "text", "reason", "name", "readings", "what", "plan", "why", "undetermined"];

fn main() -> ExitCode {
    let folders: Vec<String> = std::env::args().skip(1).collect();
    let [before, after] = folders.as_slice() else {
        eprintln!("usage: compare_diagnoses BEFORE AFTER");
        return ExitCode::from(2);
    };
    match compare(Path::new(before), Path::new(after)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn compare(before: &Path, after: &Path) -> Result<bool, Box<dyn std::error::Error>> {
    let mut names = BTreeSet::new();
    for folder in [before, after] {
        for entry in folder.read_dir().map_err(|error| format!("{}: {error}", folder.display()))? {
            let path = entry?.path();
            if path.extension().is_some_and(|extension| extension == "json") {
                names.extend(path.file_name().map(ToOwned::to_owned));
            }
        }
    }
    let (mut compared, mut differing) = (0, 0);
    for name in &names {
        let read = |folder: &Path| -> Result<Option<Value>, Box<dyn std::error::Error>> {
            let path = folder.join(name);
            if !path.exists() {
                return Ok(None);
            }
            let text = std::fs::read_to_string(&path)?;
            let value = serde_json::from_str(&text);
            Ok(Some(value.map_err(|error| format!("{}: {error}", path.display()))?))
        };
        let mut differences = Vec::new();
        match (read(before)?, read(after)?) {
            (Some(before), Some(after)) => {
                compared += 1;
                differ(&before, &after, "", None, &mut differences);
            }
            (Some(_), None) => differences.push("missing after".to_owned()),
            (None, _) => differences.push("missing before".to_owned()),
        }
        if !differences.is_empty() {
            differing += 1;
            println!("{}", name.to_string_lossy());
            for difference in &differences {
                println!("  {difference}");
            }
        }
    }
    println!("{compared} pairs of diagnoses compared, {differing} names with a difference");
    Ok(differing == 0 && compared > 0)
}

/// Notes where two values differ; `error` is the standard error beside a number.
fn differ(
    before: &Value,
    after: &Value,
    path: &str,
    error: Option<&Value>,
    differences: &mut Vec<String>,
) {
    match (before, after) {
        (Value::Object(a), Value::Object(b)) => {
            let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for key in keys.into_iter().filter(|key| !WORDED.contains(&key.as_str())) {
                let of = |object: &serde_json::Map<String, Value>| {
                    object.get(key).cloned().unwrap_or(Value::Null)
                };
                let error = a.get("standard_error").filter(|_| key == "value");
                differ(&of(a), &of(b), &format!("{path}.{key}"), error, differences);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (n, (a, b)) in a.iter().zip(b).enumerate() {
                let error = error.and_then(|errors| errors.get(n).or(Some(errors)));
                differ(a, b, &format!("{path}[{n}]"), error, differences);
            }
        }
        (Value::Number(a), Value::Number(b)) => {
            let (Some(a), Some(b)) = (a.as_f64(), b.as_f64()) else { return };
            let error = error.and_then(Value::as_f64).unwrap_or(0.0);
            let allowed = (RELATIVE * a.abs().max(b.abs())).max(OF_STANDARD_ERROR * error);
            if (a - b).abs() > allowed {
                differences.push(format!("{path}: {a} before, {b} after"));
            }
        }
        _ if before == after => {}
        _ => differences.push(format!("{path}: {before} before, {after} after")),
    }
}
