//! The causes that are in question, with their parameters, and those that are not.

use super::super::html::{Html, element, paragraph, table, text};
use super::evidence::MOST_BARS;
use super::figures::DiagnosisFigures;
use fieldgap_comparison::Uncertain;
use fieldgap_diagnosis::{Candidate, Diagnosis, FittedParameter};
use fieldgap_text::{ABSENT, fixed, percent, raised, significant, uncertain};

/// How probable the candidates are, and the parameters of those in question.
pub(super) fn in_question(diagnosis: &Diagnosis, figures: &DiagnosisFigures) -> Vec<Html> {
    let mut content = Vec::new();
    if let Some(figure) = &figures.evidence {
        let note = format!(
            "Probability of each cause or set of causes{}; for those out of the question, the odds against the best. \
             The scale goes in powers of ten.",
            if diagnosis.ranked.len() > MOST_BARS {
                format!(", the {MOST_BARS} most probable")
            } else {
                String::new()
            }
        );
        let caption = element("figcaption", &[], [paragraph(&note), figure.files()]);
        content.push(element("figure", &[], [figure.image(), caption]));
    }
    let contenders = diagnosis.contenders();
    if !contenders.is_empty() {
        content.push(parameters(diagnosis, &contenders));
    }
    content
}

/// How the cells of a parameter look.
const NAME: [(&str, &str); 1] = [("class", "name")];
const VALUE: [(&str, &str); 1] = [("class", "value")];

/// One row a parameter; what is said of the cause stands beside its first.
fn parameters(diagnosis: &Diagnosis, contenders: &[&Candidate]) -> Html {
    let columns = ["Cause", "Probability", "Gap after", "Parameter", "Value", "What it means"];
    let classes = ["name", "", "", "name", "value", "words"];
    let head = columns
        .into_iter()
        .zip(classes)
        .map(|(words, class)| element("th", &[("scope", "col"), ("class", class)], [text(words)]));
    let rows = contenders.iter().flat_map(|candidate| {
        let count = candidate.parameters.len().max(1).to_string();
        let spanning = [("rowspan", count.as_str())];
        let cause = element(
            "th",
            &[("scope", "rowgroup"), ("class", "name"), spanning[0]],
            [text(&candidate.name())],
        );
        let cell = |words: &str| element("td", &spanning, [text(words)]);
        let meaning = candidate.readings.iter().map(|reading| paragraph(reading));
        let first = [
            cause,
            cell(&fixed(candidate.probability, 3)),
            cell(&percent(candidate.gap_after_held_out)),
        ];
        let meaning = element("td", &[("class", "words"), spanning[0]], meaning);
        let mut values: Vec<[Html; 2]> = candidate
            .parameters
            .iter()
            .map(|(name, value)| {
                let value = in_words(value, name, &diagnosis.reading_unit);
                // A number and its error stay on one line.
                let value = value.replace(" ± ", "\u{a0}±\u{a0}");
                [element("td", &NAME, [text(name)]), element("td", &VALUE, [text(&value)])]
            })
            .collect();
        if values.is_empty() {
            values.push([NAME, VALUE].map(|class| element("td", &class, [text(ABSENT)])));
        }
        let mut first = Some((first, meaning));
        let rows: Vec<Html> = values
            .into_iter()
            .map(|value| match first.take() {
                Some((first, meaning)) => {
                    element("tr", &[], first.into_iter().chain(value).chain([meaning]))
                }
                None => element("tr", &[], value),
            })
            .collect();
        rows
    });
    let rows: Vec<Html> = rows.collect();
    let caption = "The causes in question, \u{b1} one standard error. The gap after is over readings kept out of the fit.";
    let table = element(
        "table",
        &[("class", "names")],
        [
            element("caption", &[], [text(caption)]),
            element("thead", &[], [element("tr", &[], head)]),
            element("tbody", &[], rows),
        ],
    );
    element("div", &[("class", "wide")], [table])
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
                "({}) + ({}) i; size {} at {}°",
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

/// The causes that are out, and how firmly; `None` where there is none.
pub(super) fn ruled_out(diagnosis: &Diagnosis) -> Option<Vec<Html>> {
    let out = diagnosis.ruled_out();
    if out.is_empty() {
        return None;
    }
    let rows = out.iter().map(|candidate| {
        let (standing, odds) = diagnosis.standing(candidate);
        vec![
            text(&candidate.name()),
            text(&standing.to_string()),
            text(&raised(&odds)),
            text(&fixed(candidate.log_evidence, 1)),
            text(&percent(candidate.gap_after_held_out)),
        ]
    });
    let caption = "Unlikely from odds of 1 : 20 on, ruled out beyond 1 : 150. What a cause leaves is over readings kept out \
                   of the fit, at its best parameters.";
    let columns = [
        "Cause",
        "Standing",
        "Odds against the best",
        "Log evidence, best = 0",
        "Gap that it leaves",
    ];
    Some(vec![table(caption, &columns, rows)])
}
