//! The first screen of a report: the largest difference, its picture, its cause, and what to do.

mod cause;
mod headline;
mod remedy;

use maud::{Markup, html};

pub use self::headline::{headline, headline_of_diagnosis};
pub use self::remedy::{ProposedChange, ProposedCorrection};

use super::figures::{Figures, PlaneFigure};
use super::worst_plane::worst_plane;
use fieldgap_comparison::Comparison;
use fieldgap_diagnosis::Diagnosis;

/// Why scan and simulation differ, and what corrects it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cause<'a> {
    /// The diagnosis.
    pub diagnosis: &'a Diagnosis,
    /// The correction of the set-up, where there is one.
    pub correction: Option<&'a ProposedCorrection>,
}

/// Cause, remedy and picture of a comparison. The headline stands above them.
pub(super) fn answer(
    comparison: &Comparison,
    cause: Option<Cause<'_>>,
    figures: &Figures,
) -> Markup {
    html! {
        section id="answer" {
            @if let Some(cause) = cause {
                div class="cards" {
                    (cause::card(cause.diagnosis))
                    (remedy::card(cause))
                }
            }
            @if let Some(picture) = picture(comparison, figures) { (picture) }
        }
    }
}

/// The maps of the height at which scan and simulation differ most.
fn picture(comparison: &Comparison, figures: &Figures) -> Option<Markup> {
    let (worst, _) = worst_plane(comparison)?;
    let is_worst = |figure: &&PlaneFigure| figure.comparison == 0 && figure.plane == worst;
    let figure = figures.planes.iter().find(is_worst)?;
    Some(figure.picture.as_ref()?.uncaptioned())
}
