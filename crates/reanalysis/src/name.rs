//! The name of a reanalysis, which is that of a folder in each record.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Most characters: a file name has at most 255 bytes.
const MOST: usize = 100;

/// The name of a reanalysis.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ReanalysisName(String);

/// A text that is no name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no name for a reanalysis; it has 1 to {MOST} letters, digits and - _ . + =, and does not begin with . or -"
)]
pub struct NoName(String);

impl FromStr for ReanalysisName {
    type Err = NoName;

    fn from_str(text: &str) -> Result<Self, NoName> {
        let good = |c: char| c.is_ascii_alphanumeric() || "-_.+=".contains(c);
        match (1..=MOST).contains(&text.len())
            && text.chars().all(good)
            && !text.starts_with(['.', '-'])
        {
            true => Ok(Self(text.to_owned())),
            false => Err(NoName(text.to_owned())),
        }
    }
}

impl TryFrom<String> for ReanalysisName {
    type Error = NoName;

    fn try_from(text: String) -> Result<Self, NoName> {
        text.parse()
    }
}

impl From<ReanalysisName> for String {
    fn from(name: ReanalysisName) -> Self {
        name.0
    }
}

impl fmt::Display for ReanalysisName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stays_in_its_folder() {
        assert!("simulator=piston".parse::<ReanalysisName>().is_ok());
        for wrong in ["", "..", ".hidden", "a/b", "-x", "a b", "ä", &"x".repeat(101)] {
            assert!(wrong.parse::<ReanalysisName>().is_err(), "{wrong}");
        }
    }
}
