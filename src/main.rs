//! The `fieldgap` program; everything it does is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    fieldgap::cli::main()
}
