//! `[[sweep]]`: the values of a swept key.

use std::num::NonZeroU32;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;
use toml_edit::Value;

use fieldgap_input::{Fault, Label, TomlSource};

/// Most values of one sweep.
const MOST_VALUES: usize = 10_000;

/// The keys of a `[[sweep]]` or of an axis; [`Sweep::read`] checks them.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepTable {
    name: Option<Label>,
    parameter: Spanned<Parameters>,
    values: Option<Spanned<Vec<Spanned<toml::Value>>>>,
    labels: Option<Spanned<Vec<String>>>,
    from: Option<Spanned<Number>>,
    to: Option<Spanned<Number>>,
    step: Option<Spanned<Number>>,
    count: Option<Spanned<NonZeroU32>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(untagged, expecting = "expected a key such as \"array.spacing_mm\", or a list of keys")]
enum Parameters {
    One(String),
    Several(Vec<String>),
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "expected a number")]
enum Number {
    Whole(i64),
    Real(f64),
}

impl Number {
    fn get(self) -> f64 {
        match self {
            Self::Whole(number) => number as f64,
            Self::Real(number) => number,
        }
    }
}

/// One key, or several, and its values.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Its name, if the file gives one.
    pub given_name: Option<String>,
    /// The dotted keys (`array.spacing_mm`), at least one. Several take the same value, or one each of a list as long as they are many.
    pub parameters: Vec<String>,
    /// The values, at least one.
    pub values: Vec<SweptValue>,
    /// Position of the sweep in its file, bytes.
    pub place: Range<usize>,
}

/// A value of a sweep.
#[derive(Debug, Clone)]
pub struct SweptValue {
    /// Label in tables and pictures.
    pub label: String,
    /// The number, if it is one.
    pub number: Option<f64>,
    value: Value,
}

impl SweptValue {
    /// The value of key `number` of `keys`: the whole value, or its entry where it is a list as long as the keys are many.
    pub fn for_key(&self, number: usize, keys: usize) -> Value {
        let entries = self.value.as_array().filter(|entries| keys > 1 && entries.len() == keys);
        let entry = entries.and_then(|entries| entries.get(number));
        entry.unwrap_or(&self.value).clone().decorated(" ", "")
    }

    /// A number that is not from a file.
    pub(super) fn of_number(number: f64) -> Self {
        Self { label: format!("{number}"), number: Some(number), value: Value::from(number) }
    }
}

impl Sweep {
    /// Reads a `[[sweep]]` of `source`; `item` is the same table of the editable document.
    ///
    /// # Errors
    /// A [`Fault`] at contradictory keys, at an invalid range, or if labels and values differ in number.
    pub fn read(
        table: &Spanned<SweepTable>,
        item: &toml_edit::Table,
        source: &TomlSource,
    ) -> Result<Self, Fault> {
        let keys = table.get_ref();
        let parameters = match keys.parameter.get_ref().clone() {
            Parameters::One(key) => vec![key],
            Parameters::Several(keys) => keys,
        };
        if parameters.is_empty() {
            return Err(source.fault(keys.parameter.span(), "no key is given", "name a key"));
        }
        let mut values = match (&keys.values, &keys.from, &keys.to) {
            (Some(given), None, None) => {
                if let Some(place) = keys.step.as_ref().map(Spanned::span) {
                    return Err(source.fault(
                        place,
                        "`step` needs `from` and `to`, not `values`",
                        ONE_OF,
                    ));
                }
                listed(given, item)
            }
            (None, Some(from), Some(to)) => ranged(from, to, keys, source)?,
            _ => {
                return Err(source.fault(table.span(), "a sweep needs values", ONE_OF));
            }
        };
        if values.is_empty() {
            return Err(source.fault(table.span(), "the sweep has no values", ONE_OF));
        }
        if let Some(labels) = &keys.labels {
            let (named, count) = (labels.get_ref().len(), values.len());
            if named != count {
                let problem = format!("{named} labels for {count} values");
                return Err(source.fault(labels.span(), problem, "give each value one label"));
            }
            for (value, label) in values.iter_mut().zip(labels.get_ref()) {
                value.label.clone_from(label);
            }
        }
        let given_name = keys.name.as_ref().map(|name| name.as_str().to_owned());
        Ok(Self { given_name, parameters, values, place: table.span() })
    }

    /// The given name, or the keys as one.
    pub fn name(&self) -> String {
        self.given_name.clone().unwrap_or_else(|| self.parameters.join(" = "))
    }

    /// The values, if all are numbers in ascending order.
    pub fn ascending_numbers(&self) -> Option<Vec<f64>> {
        let numbers: Vec<f64> =
            self.values.iter().map(|value| value.number).collect::<Option<_>>()?;
        numbers.windows(2).all(|pair| pair[0] < pair[1]).then_some(numbers)
    }
}

const ONE_OF: &str = "give `values = [ ... ]`, or `from`, `to` and `step` (or `count`)";

fn listed(given: &Spanned<Vec<Spanned<toml::Value>>>, item: &toml_edit::Table) -> Vec<SweptValue> {
    let array = item.get("values").and_then(|values| values.as_array());
    let editable = array.into_iter().flat_map(toml_edit::Array::iter);
    given
        .get_ref()
        .iter()
        .zip(editable)
        .map(|(parsed, editable)| {
            let number = match parsed.get_ref() {
                toml::Value::Integer(whole) => Some(*whole as f64),
                toml::Value::Float(real) => Some(*real),
                _ => None,
            };
            let value = editable.clone().decorated(" ", "");
            let label = match parsed.get_ref() {
                toml::Value::String(text) => text.clone(),
                _ => value.to_string().trim().to_owned(),
            };
            SweptValue { label, number, value }
        })
        .collect()
}

fn ranged(
    from: &Spanned<Number>,
    to: &Spanned<Number>,
    keys: &SweepTable,
    source: &TomlSource,
) -> Result<Vec<SweptValue>, Fault> {
    let (first, last) = (from.get_ref().get(), to.get_ref().get());
    let (count, step, place) = match (&keys.step, &keys.count) {
        (Some(step), None) => {
            let size = step.get_ref().get();
            let steps = ((last - first) / size + 1e-9).floor();
            (steps + 1.0, size, step.span())
        }
        (None, Some(count)) => {
            let count_of = f64::from(count.get_ref().get());
            (count_of, (last - first) / (count_of - 1.0).max(1.0), count.span())
        }
        _ => return Err(source.fault(to.span(), "either `step` or `count` is needed", ONE_OF)),
    };
    if !(first.is_finite() && step.is_finite() && count >= 1.0 && count <= MOST_VALUES as f64) {
        return Err(source.fault(
            place,
            format!("{first} to {last} in steps of {step} must give 1 to {MOST_VALUES} values"),
            "choose a step that leads from `from` to `to`",
        ));
    }
    let whole = [Some(from), Some(to), keys.step.as_ref()]
        .into_iter()
        .flatten()
        .all(|number| matches!(number.get_ref(), Number::Whole(_)))
        && step.fract() == 0.0;
    Ok((0..count as usize)
        .map(|index| {
            let number = round_number(first + step * index as f64);
            if whole {
                SweptValue {
                    label: format!("{number}"),
                    number: Some(number),
                    value: Value::from(number as i64),
                }
            } else {
                SweptValue::of_number(number)
            }
        })
        .collect())
}

/// A number to twelve digits, so that 0.1 + 2 * 0.1 is written as 0.3.
fn round_number(number: f64) -> f64 {
    format!("{number:.11e}").parse().expect("a formatted number")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use toml_edit::DocumentMut;

    use super::*;

    #[derive(Debug, Deserialize)]
    struct File {
        sweep: Vec<Spanned<SweepTable>>,
    }

    fn read(keys: &str) -> Result<Sweep, Fault> {
        let source = TomlSource::new(Path::new("s.toml"), format!("[[sweep]]\n{keys}"));
        let file: File = source.parse()?;
        let document: DocumentMut = source.text().parse().expect("TOML");
        let items = document["sweep"].as_array_of_tables().expect("tables");
        Sweep::read(&file.sweep[0], items.get(0).expect("one"), &source)
    }

    #[test]
    fn ranges_and_lists_give_values() {
        let labels = |keys: &str| -> Vec<String> {
            let sweep = read(&format!("parameter = \"a.b\"\n{keys}")).expect(keys);
            sweep.values.into_iter().map(|value| value.label).collect()
        };
        assert_eq!(labels("from = 1\nto = 5\nstep = 2"), ["1", "3", "5"]);
        assert_eq!(labels("from = 0.1\nto = 0.35\nstep = 0.1"), ["0.1", "0.2", "0.3"]);
        assert_eq!(labels("from = 2\nto = -2\ncount = 3"), ["2", "0", "-2"]);
        assert_eq!(labels("values = [1, 2.5, \"x\", { a = 1 }]"), ["1", "2.5", "x", "{ a = 1 }"]);
        assert_eq!(labels("values = [1, 2]\nlabels = [\"one\", \"two\"]"), ["one", "two"]);
    }

    #[test]
    fn whole_numbers_stay_whole() {
        let sweep =
            read("parameter = [\"a.b\", \"a.c\"]\nfrom = 1\nto = 3\nstep = 1").expect("good");
        assert!(sweep.values.iter().all(|value| value.value.is_integer()));
        assert_eq!(sweep.name(), "a.b = a.c");
        assert_eq!(sweep.ascending_numbers(), Some(vec![1.0, 2.0, 3.0]));
    }

    #[test]
    fn faults_have_the_right_line() {
        let cases = [
            ("parameter = \"a\"", 1, "needs values"),
            ("parameter = []\nvalues = [1]", 2, "no key"),
            ("parameter = 3\nvalues = [1]", 2, "expected a key"),
            ("parameter = \"a\"\nvalues = []", 1, "no values"),
            ("parameter = \"a\"\nvalues = [1]\nstep = 2", 4, "`step`"),
            ("parameter = \"a\"\nvalues = [1]\nlabels = []", 4, "0 labels for 1 values"),
            ("parameter = \"a\"\nfrom = 1\nto = 2", 4, "is needed"),
            ("parameter = \"a\"\nfrom = 1\nto = 2\nstep = 0", 5, "steps of 0"),
            ("parameter = \"a\"\nfrom = 1\nto = 2\nstep = -1", 5, "steps of -1"),
            ("parameter = \"a\"\nfrom = 0\nto = 1\nstep = 1e-9", 5, "10000"),
            ("parameter = \"a\"\nfrom = nan\nto = 2\nstep = 1", 5, "NaN"),
            ("parameter = \"a\"\nfrom = \"b\"\nto = 2\nstep = 1", 3, "expected a number"),
            ("parameter = \"a\"\nvalue = [1]", 3, "value"),
        ];
        for (keys, line, message) in cases {
            let fault = read(keys).expect_err(keys);
            assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{keys}: {fault}");
            assert!(fault.problem().contains(message), "{keys}: {fault}");
        }
    }
}
