//! Names that are used as file names.

use toml::Spanned;

use super::{Fault, TomlSource};

/// A name that is a valid file name: letters, digits, `-`, `_`, `.`, `+` and blanks, at least one letter or digit. `names` says what it
/// is the name of.
///
/// # Errors
/// A [`Fault`] at the name.
pub fn file_name(
    name: &Spanned<String>,
    names: &str,
    source: &TomlSource,
) -> Result<String, Fault> {
    let text = name.get_ref();
    let fit = |letter: char| letter.is_alphanumeric() || "-_.+ ".contains(letter);
    if text.chars().all(fit) && text.chars().any(char::is_alphanumeric) {
        return Ok(text.clone());
    }
    Err(source.fault(
        name.span(),
        format!("`{text}` cannot name {names}"),
        "use letters, digits, `-`, `_`, `.`, `+` and blanks",
    ))
}
