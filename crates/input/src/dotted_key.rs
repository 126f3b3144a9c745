//! Setting a value of a TOML document by a dotted key, as `--set` and sweeps do.

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

/// Parts of a key at most: the longest in the scans and rigs of this repository has five. A document writes every section with its whole path, so that
/// a campaign with a key of a thousand parts took a second for each cell.
const MOST_PARTS: usize = 12;

/// Characters of its first part that are shown.
const SHOWN: usize = 40;

/// A key that cannot be set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotAKey {
    /// A part of its path is a value and not a section.
    #[error("`{0}` is not a key of a section, such as `array.spacing_mm`")]
    NotInASection(String),
    /// It has too many parts.
    #[error("a key that begins with `{begins}` has {parts} parts; a key has {MOST_PARTS} at most")]
    TooDeep {
        /// Its first part.
        begins: String,
        /// How many it has.
        parts: usize,
    },
    /// An array of tables has no entry of this number.
    #[error(
        "`{key}`: there is no `{array}.{index}`; [[{array}]] has {count} entries, numbered from 0"
    )]
    NoEntry {
        /// The whole key.
        key: String,
        /// The array of tables.
        array: String,
        /// The number that was given.
        index: String,
        /// How many entries it has.
        count: usize,
    },
}

/// Sets a dotted key such as `array.spacing_mm`. A number after the name of an array of tables is an entry, counted from 0:
/// `focus.0.x_mm`. Missing sections are added; comments around an old value are kept.
///
/// # Errors
/// [`NotAKey`] if a part of the path is a value, an entry is missing, or the key has more than 12 parts.
pub fn set_key(document: &mut DocumentMut, key: &str, mut value: Value) -> Result<(), NotAKey> {
    let not_in_a_section = || NotAKey::NotInASection(key.to_owned());
    let mut sections: Vec<&str> = key.split('.').collect();
    if sections.len() > MOST_PARTS {
        let begins = sections[0].chars().take(SHOWN).collect();
        return Err(NotAKey::TooDeep { begins, parts: sections.len() });
    }
    let last = sections.pop().filter(|last| !last.is_empty()).ok_or_else(not_in_a_section)?;
    let mut table: &mut dyn TableLike = document.as_table_mut();
    let mut sections = sections.into_iter();
    while let Some(section) = sections.next() {
        let item = table.entry(section).or_insert(Item::Table(Table::new()));
        table = match item {
            Item::ArrayOfTables(entries) => {
                let index = sections.next().unwrap_or(last);
                let count = entries.len();
                let no_entry = || NotAKey::NoEntry {
                    key: key.to_owned(),
                    array: section.to_owned(),
                    index: index.to_owned(),
                    count,
                };
                let number: usize = index.parse().map_err(|_| no_entry())?;
                entries.get_mut(number).ok_or_else(no_entry)?
            }
            item => item.as_table_like_mut().ok_or_else(not_in_a_section)?,
        };
    }
    if let Some(before) = table.get(last).and_then(Item::as_value) {
        *value.decor_mut() = before.decor().clone();
    }
    table.insert(last, Item::Value(value));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "name = \"n\"\n[array]\ncolumns = 6 # across\n[[focus]]\nx_mm = 1.0\n[[focus]]\nx_mm = 2.0\n";

    fn with(key: &str, value: impl Into<Value>) -> Result<String, NotAKey> {
        let mut document: DocumentMut = TEXT.parse().expect("TOML");
        set_key(&mut document, key, value.into())?;
        Ok(document.to_string())
    }

    #[test]
    fn a_value_is_replaced_and_the_rest_is_unchanged() {
        assert_eq!(with("array.columns", 3).expect("a key"), TEXT.replace("6 #", "3 #"));
        assert_eq!(
            with("map.step_mm", 0.5).expect("a key"),
            format!("{TEXT}\n[map]\nstep_mm = 0.5\n")
        );
    }

    #[test]
    fn an_entry_of_an_array_of_tables_is_counted_from_zero() {
        assert_eq!(with("focus.1.x_mm", 5.0).expect("a key"), TEXT.replace("2.0", "5.0"));
        let missing = with("focus.2.x_mm", 5.0).expect_err("two entries");
        assert_eq!(
            missing.to_string(),
            "`focus.2.x_mm`: there is no `focus.2`; [[focus]] has 2 entries, numbered from 0"
        );
        assert!(with("focus.x_mm", 5.0).is_err());
    }

    #[test]
    fn a_key_of_thousands_of_parts_is_refused() {
        let deepest = ["a"; MOST_PARTS].join(".");
        assert!(with(&deepest, 1).is_ok());
        let refused = with(&format!("{deepest}.{deepest}"), 1).expect_err("too deep");
        assert_eq!(
            refused.to_string(),
            "a key that begins with `a` has 24 parts; a key has 12 at most"
        );
    }

    #[test]
    fn a_value_is_not_a_section() {
        for key in ["name.x", "array.columns.x", "array.", ""] {
            assert!(with(key, 1).is_err(), "{key}");
        }
    }
}
