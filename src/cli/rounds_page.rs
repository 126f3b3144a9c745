//! The page of the rounds of a closed loop, beside the report of its record.

use std::path::Path;

use miette::IntoDiagnostic;

use super::output::say;
use super::replay::{context, input_file};
use fieldgap_closed_loop::{ROUNDS_FILE, read_rounds};
use fieldgap_records::{Plan, RecordedScan};
use fieldgap_report::{LoopOfRounds, ReportContext, write_rounds};

/// The page in the report's folder.
const ROUNDS: &str = "rounds";

/// Writes the page, if the record in `folder` is one of a closed loop; its title and address from the report's first page.
pub(super) fn write_rounds_page(
    folder: &Path,
    record: &RecordedScan,
    report_folder: &Path,
) -> miette::Result<Option<(String, String)>> {
    let rounds = match read_rounds(folder) {
        Ok(rounds) if rounds.is_empty() => return Ok(None),
        Ok(rounds) => rounds,
        Err(error) => {
            // The comparison does not need it.
            say(format!("no page of the rounds: {error}"));
            return Ok(None);
        }
    };
    let plan = Plan::read(&folder.join("plan.toml"))?;
    let Some(settings) = &plan.closed_loop else { return Ok(None) };
    let mut context = ReportContext {
        pages: vec![("Scan and simulation".to_owned(), "../index.html".to_owned())],
        ..context(folder, record)?
    };
    context.inputs.push(input_file(folder, ROUNDS_FILE)?);
    let visits = plan.visits();
    let of = LoopOfRounds { rounds: &rounds, record, visits: &visits, settings };
    write_rounds(&report_folder.join(ROUNDS), &context, of).into_diagnostic()?;
    Ok(Some(("Rounds: what it measured and why".to_owned(), format!("{ROUNDS}/index.html"))))
}
