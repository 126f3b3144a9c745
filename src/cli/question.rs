//! Questions to the person at the terminal.

use std::io::IsTerminal;

use miette::{IntoDiagnostic, miette};

use super::output::ask;

/// Shows a text and asks for agreement.
///
/// # Errors
/// It was refused, or nobody can be asked; both with `remedy`.
pub(super) fn agree(text: &str, question: &str, remedy: &'static str) -> miette::Result<()> {
    if !(std::io::stdin().is_terminal() && std::io::stderr().is_terminal()) {
        return Err(miette!(
            help = remedy,
            "{text}\nNobody can be asked without a terminal, so nothing was done"
        ));
    }
    ask(format!("{text}\n{question} [y/N] "));
    let mut answer = String::new();
    std::io::stdin().read_line(&mut answer).into_diagnostic()?;
    match answer.trim().to_ascii_lowercase().as_str() {
        "y" | "yes" => Ok(()),
        _ => Err(miette!(help = remedy, "nothing was done")),
    }
}
