//! `[[condition]]`: what a person or a program sets before cells, such as a temperature or a screen, and how that is confirmed.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use fieldgap_input::{Fault, Label, NonNegative, Time, TomlSource, literal};
use fieldgap_records::HookCommand;

/// The place of the value in commands and questions.
const VALUE: &str = "{value}";

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ConditionTable {
    name: Spanned<Label>,
    values: Spanned<Vec<toml::Value>>,
    set: Option<HookCommand>,
    ask: Option<Label>,
    sets: Option<Spanned<String>>,
    confirm: Option<Spanned<ConfirmTable>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct ConfirmTable {
    sensor: Option<Sensor>,
    program: Option<HookCommand>,
    tolerance: Option<NonNegative>,
    #[serde(default = "half_an_hour")]
    within_min: Time,
    #[serde(default = "ten_seconds")]
    every_s: Time,
}

fn half_an_hour() -> Time {
    literal(30.0)
}

fn ten_seconds() -> Time {
    literal(10.0)
}

/// A condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Its name, such as `temperature`.
    pub name: String,
    /// Its values, at least one.
    pub values: Vec<ConditionValue>,
    /// Who sets it.
    pub setting: SetBy,
    /// The key of the plan or the rig file that takes the value, if any.
    pub sets: Option<String>,
    /// How it is confirmed; without it the program's exit code or the person's answer suffices.
    pub confirm: Option<Confirmation>,
    pub(super) place: std::ops::Range<usize>,
}

/// A value of a condition.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionValue {
    /// As it is shown.
    pub label: String,
    /// The number, if it is one.
    pub number: Option<f64>,
    value: toml::Value,
}

/// Who sets a condition.
#[derive(Debug, Clone, PartialEq)]
pub enum SetBy {
    /// A program, which ends with success when it has set it.
    Program(HookCommand),
    /// A person, who is asked this.
    Person(String),
}

/// How a condition is confirmed before a cell begins.
#[derive(Debug, Clone, PartialEq)]
pub struct Confirmation {
    /// What is read.
    pub by: ConfirmedBy,
    /// Longest wait until the reading agrees, s.
    pub within_s: f64,
    /// Time between readings, s.
    pub every_s: f64,
}

/// What confirms a condition.
#[derive(Debug, Clone, PartialEq)]
pub enum ConfirmedBy {
    /// The rig's sensor of the air reads the value within a tolerance.
    Sensor(Sensor, f64),
    /// A program prints the value within a tolerance.
    Number(HookCommand, f64),
    /// A program ends with success.
    Success(HookCommand),
}

/// A quantity that `[environment]` of a rig reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Temperature, °C.
    TemperatureC,
    /// Relative humidity, %.
    HumidityPercent,
}

impl Condition {
    pub(super) fn read(
        table: &Spanned<ConditionTable>,
        source: &TomlSource,
    ) -> Result<Self, Fault> {
        let keys = table.get_ref();
        let fault = |problem: &str, remedy: &str| Err(source.fault(table.span(), problem, remedy));
        let setting = match (&keys.set, &keys.ask) {
            (Some(program), None) => SetBy::Program(program.clone()),
            (None, Some(question)) => SetBy::Person(question.as_str().to_owned()),
            _ => {
                return fault(
                    "a condition needs either `set` or `ask`",
                    "give a program that sets it, set = [\"./chamber\", \"{value}\"], or a question for a person, ask = \"Set the chamber to {value} °C\"",
                );
            }
        };
        let values: Vec<ConditionValue> =
            keys.values.get_ref().iter().filter_map(ConditionValue::of).collect();
        if values.is_empty() || values.len() != keys.values.get_ref().len() {
            return Err(source.fault(
                keys.values.span(),
                "a condition has one value or several, each a number or a word",
                "write values = [20.0, 25.0] or values = [\"in place\", \"away\"]",
            ));
        }
        let confirm = keys.confirm.as_ref().map(|table| Confirmation::read(table, &values, source));
        Ok(Self {
            name: keys.name.get_ref().as_str().to_owned(),
            values,
            setting,
            sets: keys.sets.as_ref().map(|key| key.get_ref().clone()),
            confirm: confirm.transpose()?,
            place: table.span(),
        })
    }

    /// The programs of the condition, with the names of their keys.
    pub fn programs(&self) -> Vec<(String, HookCommand)> {
        let mut programs = Vec::new();
        if let SetBy::Program(program) = &self.setting {
            programs.push((format!("condition {}: set", self.name), program.clone()));
        }
        if let Some(ConfirmedBy::Number(program, _) | ConfirmedBy::Success(program)) =
            self.confirm.as_ref().map(|confirm| &confirm.by)
        {
            programs.push((format!("condition {}: confirm", self.name), program.clone()));
        }
        programs
    }

    pub(super) fn beside(mut self, folder: &Path) -> Self {
        if let SetBy::Program(program) = &mut self.setting {
            *program = program.clone().beside(folder);
        }
        if let Some(ConfirmedBy::Number(program, _) | ConfirmedBy::Success(program)) =
            self.confirm.as_mut().map(|confirm| &mut confirm.by)
        {
            *program = program.clone().beside(folder);
        }
        self
    }
}

impl ConditionValue {
    fn of(value: &toml::Value) -> Option<Self> {
        let (label, number) = match value {
            toml::Value::String(text) => (text.clone(), None),
            toml::Value::Integer(whole) => (value.to_string(), Some(*whole as f64)),
            toml::Value::Float(real) if real.is_finite() => (value.to_string(), Some(*real)),
            _ => return None,
        };
        Some(Self { label, number, value: value.clone() })
    }

    /// The value as it is written into a file.
    pub(super) fn in_toml(&self) -> toml_edit::Value {
        match &self.value {
            toml::Value::Integer(whole) => (*whole).into(),
            toml::Value::Float(real) => (*real).into(),
            _ => self.label.as_str().into(),
        }
    }

    /// A text with the value in the place of `{value}`.
    pub fn within(&self, text: &str) -> String {
        text.replace(VALUE, &self.label)
    }
}

impl Confirmation {
    fn read(
        table: &Spanned<ConfirmTable>,
        values: &[ConditionValue],
        source: &TomlSource,
    ) -> Result<Self, Fault> {
        let keys = table.get_ref();
        let tolerance = keys.tolerance.map(NonNegative::get);
        let by = match (&keys.program, keys.sensor, tolerance) {
            (None, Some(sensor), Some(tolerance)) => ConfirmedBy::Sensor(sensor, tolerance),
            (Some(program), None, Some(tolerance)) => {
                ConfirmedBy::Number(program.clone(), tolerance)
            }
            (Some(program), None, None) => ConfirmedBy::Success(program.clone()),
            _ => {
                return Err(source.fault(
                    table.span(),
                    "a confirmation needs a sensor and a tolerance, or a program",
                    "write confirm = { sensor = \"temperature_c\", tolerance = 0.5 }, or confirm = { program = [\"./read\"], tolerance = 0.5 }",
                ));
            }
        };
        let numbers = values.iter().all(|value| value.number.is_some());
        if tolerance.is_some() && !numbers {
            return Err(source.fault(
                table.span(),
                "a tolerance is for numbers, and a value of this condition is a word",
                "remove `tolerance`: the program then ends with success where the condition holds",
            ));
        }
        Ok(Self { by, within_s: keys.within_min.get() * 60.0, every_s: keys.every_s.get() })
    }
}

impl std::fmt::Display for Sensor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::TemperatureC => "temperature_c",
            Self::HumidityPercent => "humidity_percent",
        })
    }
}
