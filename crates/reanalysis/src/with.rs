//! What is done differently from the first analysis: `--with KEY=VALUE`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::Registering;
use fieldgap_diagnosis::{EffectId, Options};
use serde::{Deserialize, Serialize};

/// What is done differently from the first analysis; by default all is done as `compare` and `diagnose` do it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<String, String>", into = "BTreeMap<String, String>")]
pub struct With {
    /// The simulator; without it, that of each record.
    pub simulator: Option<Simulator>,
    /// How scans are registered for the comparison.
    pub register: Registering,
    /// The only effects that are tried; without it, all.
    pub effects: Option<BTreeSet<EffectId>>,
    /// No diagnosis.
    pub only_compare: bool,
}

/// A key or value of `--with` that is not understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WrongWith {
    /// The key.
    #[error("there is no key `{0}`; the keys are simulator, register, effects and diagnose")]
    Key(String),
    /// The value.
    #[error("{key}={value}: {why}")]
    Value {
        /// The key.
        key: String,
        /// The value.
        value: String,
        /// What is wrong.
        why: String,
    },
    /// A key twice.
    #[error(
        "`{0}` is given twice; several effects are one list, such as effects=sound-speed,pitch"
    )]
    Twice(String),
    /// Effects without a diagnosis.
    #[error("effects are tried by a diagnosis, and diagnose=no asks for none")]
    EffectsOfNothing,
}

/// The names of registrations, as `compare --register` has them.
const REGISTERING: [(&str, Registering); 6] = [
    ("auto", Registering::Auto),
    ("pose", Registering::Pose),
    ("shift", Registering::Shift),
    ("gain-and-shift", Registering::GainAndShift),
    ("gain", Registering::GainOnly),
    ("none", Registering::None),
];

impl With {
    /// Reads keys and values.
    ///
    /// # Errors
    /// [`WrongWith`] at the first that is not understood.
    pub fn read<'t>(
        given: impl IntoIterator<Item = (&'t str, &'t str)>,
    ) -> Result<Self, WrongWith> {
        let mut with = Self::default();
        let mut known: Vec<&str> = Vec::new();
        for (key, value) in given {
            if known.contains(&key) {
                return Err(WrongWith::Twice(key.to_owned()));
            }
            known.push(key);
            with.set(key, value)?;
        }
        match with.only_compare && with.effects.is_some() {
            true => Err(WrongWith::EffectsOfNothing),
            false => Ok(with),
        }
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), WrongWith> {
        let wrong =
            |why: String| WrongWith::Value { key: key.to_owned(), value: value.to_owned(), why };
        match key {
            "simulator" => {
                self.simulator = Some(value.parse().map_err(|error| wrong(format!("{error}")))?);
            }
            "register" => {
                let found = REGISTERING.iter().find(|(name, _)| *name == value);
                let names: Vec<&str> = REGISTERING.iter().map(|(name, _)| *name).collect();
                let none = || wrong(format!("the registrations are {}", names.join(", ")));
                self.register = found.ok_or_else(none)?.1;
            }
            "effects" => {
                let effects: Result<BTreeSet<EffectId>, _> =
                    value.split(',').map(|effect| effect.trim().parse()).collect();
                self.effects = Some(effects.map_err(|error| wrong(format!("{error}")))?);
            }
            "diagnose" => {
                self.only_compare = match value {
                    "yes" => false,
                    "no" => true,
                    _ => return Err(wrong("expected yes or no".to_owned())),
                };
            }
            _ => return Err(WrongWith::Key(key.to_owned())),
        }
        Ok(())
    }

    /// The keys that differ from the defaults, with their values.
    pub fn keys(&self) -> BTreeMap<String, String> {
        let mut keys = BTreeMap::new();
        if let Some(simulator) = self.simulator {
            keys.insert("simulator".to_owned(), simulator.to_string());
        }
        if self.register != Registering::default() {
            let name = REGISTERING.iter().find(|(_, register)| *register == self.register);
            keys.extend(name.map(|(name, _)| ("register".to_owned(), (*name).to_owned())));
        }
        if let Some(effects) = &self.effects {
            let names: Vec<&str> = effects.iter().map(|effect| effect.as_str()).collect();
            keys.insert("effects".to_owned(), names.join(","));
        }
        if self.only_compare {
            keys.insert("diagnose".to_owned(), "no".to_owned());
        }
        keys
    }

    /// How a diagnosis is made; `None` for none.
    pub fn diagnosis(&self) -> Option<Options> {
        let options = Options {
            simulator: self.simulator,
            effects: self.effects.clone(),
            ..Options::default()
        };
        (!self.only_compare).then_some(options)
    }
}

impl fmt::Display for With {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let keys: Vec<String> =
            self.keys().iter().map(|(key, value)| format!("{key}={value}")).collect();
        f.write_str(&if keys.is_empty() { "the defaults".to_owned() } else { keys.join(" ") })
    }
}

impl TryFrom<BTreeMap<String, String>> for With {
    type Error = WrongWith;

    fn try_from(keys: BTreeMap<String, String>) -> Result<Self, WrongWith> {
        Self::read(keys.iter().map(|(key, value)| (key.as_str(), value.as_str())))
    }
}

impl From<With> for BTreeMap<String, String> {
    fn from(with: With) -> Self {
        with.keys()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_values_read_back_as_they_are_written() {
        let given =
            [("effects", "pitch, sound-speed"), ("simulator", "piston"), ("register", "gain")];
        let with = With::read(given).expect("good");
        assert_eq!(with.to_string(), "effects=sound-speed,pitch register=gain simulator=piston");
        let json = serde_json::to_string(&with).expect("JSON");
        assert_eq!(serde_json::from_str::<With>(&json).expect("its own"), with);
        assert_eq!(With::default().to_string(), "the defaults");
    }

    #[test]
    fn what_is_not_understood_is_named() {
        let said = |given: &[(&'static str, &'static str)]| {
            With::read(given.iter().copied()).expect_err("wrong").to_string()
        };
        assert!(said(&[("model", "piston")]).starts_with("there is no key `model`"));
        assert!(said(&[("simulator", "x")]).starts_with("simulator=x: there is no simulator `x`"));
        assert!(said(&[("effects", "pitch,x")]).contains('x'));
        assert!(said(&[("register", "x")]).contains("gain-and-shift"));
        assert!(said(&[("diagnose", "no"), ("diagnose", "yes")]).contains("twice"));
        assert!(said(&[("diagnose", "no"), ("effects", "pitch")]).contains("asks for none"));
    }
}
