//! Which keys of a set-up file a correction changes, with their values before and after.

use serde::{Deserialize, Serialize};
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value};

/// More numbers than this in an array are counted instead of listed.
const MOST_NUMBERS: usize = 4;

/// A key with another value than before.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangedKey {
    /// The key with its table: `medium.speed_of_sound_m_s`.
    pub key: String,
    /// The value before, as TOML; `None` where the file did not have the key.
    pub before: Option<String>,
    /// The value after it, as TOML; `None` where the key is removed.
    pub after: Option<String>,
}

/// The keys that differ between two documents. Drives are left out: a record keeps those that were emitted, in another form.
pub(super) fn changed_keys(before: &DocumentMut, after: &DocumentMut) -> Vec<ChangedKey> {
    let (before, after) = (values(before), values(after));
    let find = |values: &[(String, String)], key: &str| {
        values.iter().find(|(other, _)| other == key).map(|(_, value)| value.clone())
    };
    let mut keys: Vec<&String> = after.iter().map(|(key, _)| key).collect();
    let removed = before.iter().map(|(key, _)| key);
    keys.extend(removed.filter(|key| find(&after, key).is_none()));
    keys.into_iter()
        .map(|key| ChangedKey {
            key: key.clone(),
            before: find(&before, key),
            after: find(&after, key),
        })
        .filter(|changed| changed.before != changed.after)
        .collect()
}

/// Every value of a document with its key, in the document's order; arrays of tables are left out.
fn values(document: &DocumentMut) -> Vec<(String, String)> {
    let mut values = Vec::new();
    of_table(document.as_table(), "", &mut values);
    values
}

fn of_table(table: &Table, prefix: &str, values: &mut Vec<(String, String)>) {
    for (key, item) in table {
        let key = format!("{prefix}{key}");
        match item {
            Item::Table(inner) => of_table(inner, &format!("{key}."), values),
            Item::Value(Value::InlineTable(inner)) => of_inline_table(inner, &key, values),
            Item::Value(value) => values.push((key, in_words(value))),
            Item::ArrayOfTables(_) | Item::None => {}
        }
    }
}

fn of_inline_table(table: &InlineTable, prefix: &str, values: &mut Vec<(String, String)>) {
    for (key, value) in table {
        values.push((format!("{prefix}.{key}"), in_words(value)));
    }
}

fn in_words(value: &Value) -> String {
    match value {
        Value::Array(array) if array.len() > MOST_NUMBERS => counted(array),
        value => value.clone().decorated("", "").to_string(),
    }
}

/// A long array: its length, and its first values, so that two of one length can differ.
fn counted(array: &Array) -> String {
    let first: Vec<String> = array
        .iter()
        .take(MOST_NUMBERS)
        .map(|value| value.clone().decorated("", "").to_string())
        .collect();
    format!("[{}, …] ({} values)", first.join(", "), array.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(before: &str, after: &str) -> Vec<(String, Option<String>, Option<String>)> {
        let [before, after] = [before, after].map(|text| text.parse().expect("TOML"));
        let changed = changed_keys(&before, &after);
        changed.into_iter().map(|change| (change.key, change.before, change.after)).collect()
    }

    #[test]
    fn a_key_has_its_values_before_and_after() {
        let before = "name = \"a\" # mine\n[medium]\ntemperature_c = 20.0\n[array]\npitch = 1\n";
        let after = "name = \"a\"\n[medium]\n# found\nspeed_of_sound_m_s = 347.1 # m/s\n[array]\npitch = 2\n";
        let some = |text: &str| Some(text.to_owned());
        assert_eq!(
            changed(before, after),
            [
                ("medium.speed_of_sound_m_s".to_owned(), None, some("347.1")),
                ("array.pitch".to_owned(), some("1"), some("2")),
                ("medium.temperature_c".to_owned(), some("20.0"), None),
            ]
        );
    }

    #[test]
    fn an_inline_table_is_the_same_as_a_table() {
        assert_eq!(changed("medium = { c = 1.0 }\n", "[medium]\nc = 1.0\n"), []);
    }

    #[test]
    fn drives_are_left_out_and_long_arrays_are_counted() {
        let after = "gains = [1.0, 2.0, 3.0, 4.0, 5.0]\n[[focus]]\nphases_rad = [0.0]\n";
        let changed = changed("[[focus]]\nx_mm = 1.0\n", after);
        let value = changed[0].2.as_deref();
        assert_eq!((changed.len(), value), (1, Some("[1.0, 2.0, 3.0, 4.0, …] (5 values)")));
    }
}
