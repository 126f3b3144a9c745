//! Options for pictures in a paper, of every command that writes pictures.

use clap::Args;
use miette::IntoDiagnostic;

use fieldgap_report::PrintStyle;

/// Size, letters and resolution of static pictures.
#[derive(Debug, Args)]
#[command(next_help_heading = "Pictures for a paper")]
pub(super) struct PictureArgs {
    /// Width of the pictures, mm, such as 85 for one column; panels stand one below the other where they have no room
    #[arg(long, value_name = "MM")]
    width_mm: Option<f64>,
    /// Size of the labels, pt [default: 9.1]
    #[arg(long, value_name = "PT")]
    font_pt: Option<f64>,
    /// Resolution of PNG pictures, pixels an inch [default: 192]
    #[arg(long, value_name = "DPI")]
    dpi: Option<f64>,
}

impl PictureArgs {
    pub(super) fn style(&self) -> miette::Result<PrintStyle> {
        PrintStyle::new(self.width_mm, self.font_pt, self.dpi).into_diagnostic()
    }
}
