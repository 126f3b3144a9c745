//! Names and units that people write.

use serde::{Deserialize, Serialize};

use super::visible::is_hidden;

/// Most characters of a label.
const MOST: usize = 200;

/// A name or a unit: one line of at most 200 characters that are all visible.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Label(String);

/// Why a text is no [`Label`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoLabel {
    /// It is too long.
    #[error("the text has {0} characters; at most {MOST} are allowed here")]
    Long(usize),
    /// It has a character that cannot be seen.
    #[error("the text has the control character {}; only visible characters are allowed here", .0.escape_unicode())]
    Hidden(char),
}

impl Label {
    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for Label {
    type Error = NoLabel;
    fn try_from(text: String) -> Result<Self, NoLabel> {
        if let Some(hidden) = text.chars().find(|character| is_hidden(*character)) {
            return Err(NoLabel::Hidden(hidden));
        }
        match text.chars().count() {
            count if count > MOST => Err(NoLabel::Long(count)),
            _ => Ok(Self(text)),
        }
    }
}

impl From<Label> for String {
    fn from(label: Label) -> Self {
        label.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_is_one_visible_line() {
        let label = |text: &str| Label::try_from(text.to_owned());
        assert_eq!(label("6 × 6, 40 kHz").expect("visible").as_str(), "6 × 6, 40 kHz");
        assert_eq!(label("a\nb"), Err(NoLabel::Hidden('\n')));
        assert_eq!(label("\u{202e}"), Err(NoLabel::Hidden('\u{202e}')));
        assert_eq!(label(&"x".repeat(201)), Err(NoLabel::Long(201)));
    }
}
