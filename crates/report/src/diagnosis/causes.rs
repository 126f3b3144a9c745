//! The causes that remain possible, with their parameters, and those that are ruled out.

use maud::{Markup, html};

use super::super::html::table;
use super::odds;
use fieldgap_comparison::Uncertain;
use fieldgap_diagnosis::{Candidate, Diagnosis, FittedParameter, Standing};
use fieldgap_text::{ABSENT, fixed, percent, significant, uncertain};

/// How probable the candidates are that are not ruled out, and the parameters of those that remain possible.
pub(super) fn possible(diagnosis: &Diagnosis) -> Markup {
    let contenders = diagnosis.contenders();
    let shown = diagnosis.ranked.iter().filter(|candidate| !is_ruled_out(diagnosis, candidate));
    html! {
        (ranking("Every cause or set of causes that is not ruled out", diagnosis, shown))
        @if !contenders.is_empty() { (parameters(diagnosis, &contenders)) }
    }
}

fn is_ruled_out(diagnosis: &Diagnosis, candidate: &Candidate) -> bool {
    diagnosis.standing(candidate).0 == Standing::RuledOut
}

/// Candidates with their probability and their odds in words.
fn ranking<'a>(
    caption: &str,
    diagnosis: &Diagnosis,
    candidates: impl Iterator<Item = &'a Candidate>,
) -> Markup {
    let rows = candidates.map(|candidate| {
        vec![
            candidate.name(),
            odds::probability(candidate.probability),
            odds::against_best(diagnosis, candidate),
            percent(candidate.gap_after),
        ]
    });
    let columns = ["Cause", "Probability", "Compared with the best", "Residual gap"];
    html! { div class="ranking" { (table(caption, &columns, rows)) } }
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
        div class="wide parameters" {
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
                    td rowspan=(span) { (odds::probability(candidate.probability)) }
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
        FittedParameter::Word { .. }
        | FittedParameter::Elements { .. }
        | FittedParameter::Each { .. } => parameter.in_words(name, reading_unit),
    }
}

/// The causes that are ruled out, folded; `None` where there is none.
pub(super) fn ruled_out(diagnosis: &Diagnosis) -> Option<Markup> {
    let out: Vec<&Candidate> =
        diagnosis.ranked.iter().filter(|candidate| is_ruled_out(diagnosis, candidate)).collect();
    let summary = match out.len() {
        0 => return None,
        1 => "1 cause or set of causes is ruled out".to_owned(),
        many => format!("{many} causes or sets of causes are ruled out"),
    };
    let caption = "More than 150 times less likely than the best account. The residual gap is that of the best parameters.";
    Some(html! {
        details { summary { (summary) } (ranking(caption, diagnosis, out.into_iter())) }
    })
}
