//! The causes that remain possible, with their parameters, and those that are ruled out.

use maud::{Markup, html};

use super::super::html::table;
use super::evidence::MOST_BARS;
use super::figures::DiagnosisFigures;
use fieldgap_comparison::Uncertain;
use fieldgap_diagnosis::{Candidate, Diagnosis, FittedParameter};
use fieldgap_text::{ABSENT, fixed, percent, raised, significant, uncertain};

/// How probable the candidates are, and the parameters of those that remain possible.
pub(super) fn possible(diagnosis: &Diagnosis, figures: &DiagnosisFigures) -> Markup {
    let contenders = diagnosis.contenders();
    html! {
        @if let Some(figure) = &figures.evidence { (figure.markup(&evidence_note(diagnosis))) }
        @if !contenders.is_empty() { (parameters(diagnosis, &contenders)) }
    }
}

fn evidence_note(diagnosis: &Diagnosis) -> Markup {
    html! {
        p {
            "Probability of each cause or set of causes"
            @if diagnosis.ranked.len() > MOST_BARS { " (the " (MOST_BARS) " most probable)" }
            ", on a logarithmic scale. Unlikely causes and those ruled out are labelled with their odds against the best."
        }
    }
}

/// The columns of the parameters, with their classes.
const COLUMNS: [(&str, &str); 6] = [
    ("Cause", "name"),
    ("Probability", ""),
    ("Residual gap", ""),
    ("Parameter", "name"),
    ("Value", "value"),
    ("Meaning", "words"),
];

/// The table of the parameters.
fn parameters(diagnosis: &Diagnosis, contenders: &[&Candidate]) -> Markup {
    html! {
        div class="wide" {
            table class="names" {
                caption {
                    "The causes that remain possible, \u{b1} one standard error. The residual gap counts only readings that the fit \
                     did not use."
                }
                thead {
                    tr { @for (words, class) in COLUMNS { th scope="col" class=(class) { (words) } } }
                }
                tbody { @for candidate in contenders { (rows(diagnosis, candidate)) } }
            }
        }
    }
}

/// One row for each parameter; the cells about the cause span them.
fn rows(diagnosis: &Diagnosis, candidate: &Candidate) -> Markup {
    let mut values: Vec<(&str, String)> = candidate
        .parameters
        .iter()
        .map(|(name, value)| {
            let value = in_words(value, name, &diagnosis.reading_unit);
            // A number and its error stay on one line.
            (name.as_str(), value.replace(" ± ", "\u{a0}±\u{a0}"))
        })
        .collect();
    if values.is_empty() {
        values.push((ABSENT, ABSENT.to_owned()));
    }
    let span = values.len();
    html! {
        @for (place, (name, value)) in values.iter().enumerate() {
            tr {
                @if place == 0 {
                    th scope="rowgroup" class="name" rowspan=(span) { (candidate.name()) }
                    td rowspan=(span) { (fixed(candidate.probability, 3)) }
                    td rowspan=(span) { (percent(candidate.gap_after)) }
                }
                td class="name" { (name) }
                td class="value" { (value) }
                @if place == 0 {
                    td class="words" rowspan=(span) {
                        @for reading in &candidate.readings { p { (reading) } }
                    }
                }
            }
        }
    }
}

/// A parameter with its error and unit.
fn in_words(parameter: &FittedParameter, name: &str, reading_unit: &str) -> String {
    let number = |value, standard_error| uncertain(Uncertain { value, standard_error });
    let unit = FittedParameter::unit(name, reading_unit);
    match parameter {
        FittedParameter::Real { value, standard_error } => {
            format!("{} {unit}", number(*value, *standard_error)).trim_end().to_owned()
        }
        FittedParameter::Complex {
            value: [real, imaginary],
            standard_error: [of_real, of_imaginary],
        } => {
            format!(
                "({}) + ({}) i; magnitude {} at {}°",
                number(*real, *of_real),
                number(*imaginary, *of_imaginary),
                significant(real.hypot(*imaginary), 3),
                fixed(imaginary.atan2(*real).to_degrees(), 0)
            )
        }
        FittedParameter::Elements { .. } | FittedParameter::Each { .. } => {
            parameter.in_words(name, reading_unit)
        }
    }
}

/// The causes that are unlikely or ruled out, with their odds; `None` where there is none.
pub(super) fn ruled_out(diagnosis: &Diagnosis) -> Option<Markup> {
    let out = diagnosis.ruled_out();
    if out.is_empty() {
        return None;
    }
    let rows = out.iter().map(|candidate| {
        let (standing, odds) = diagnosis.standing(candidate);
        vec![
            candidate.name(),
            standing.to_string(),
            raised(&odds),
            fixed(candidate.log_evidence, 1),
            percent(candidate.gap_after),
        ]
    });
    let caption = "Unlikely: odds of 1 : 20 or worse. Ruled out: odds worse than 1 : 150. The residual gap is that of the best \
                   parameters.";
    let columns = [
        "Cause",
        "Status",
        "Odds against the best",
        "Log evidence relative to the best",
        "Residual gap",
    ];
    Some(table(caption, &columns, rows))
}
