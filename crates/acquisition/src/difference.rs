//! The keys in which two TOML files differ.

use toml::{Table, Value};

/// A key that differs.
#[derive(Debug, PartialEq)]
pub(super) struct Difference {
    /// Its whole name: `focus[0].x_mm`.
    pub(super) key: String,
    /// Its value in the first file, where it has one.
    pub(super) then: Option<Value>,
    /// Its value in the second.
    pub(super) now: Option<Value>,
}

/// All keys in which two files differ, without those whose last name is in `except`.
pub(super) fn differences(then: Table, now: Table, except: &[&str]) -> Vec<Difference> {
    let mut found = Vec::new();
    collect(String::new(), Some(&Value::Table(then)), Some(&Value::Table(now)), except, &mut found);
    found
}

fn collect(
    key: String,
    then: Option<&Value>,
    now: Option<&Value>,
    except: &[&str],
    found: &mut Vec<Difference>,
) {
    match (then, now) {
        (Some(Value::Table(before)), Some(Value::Table(after))) => {
            let new = after.keys().filter(|name| !before.contains_key(*name));
            for name in before.keys().chain(new).filter(|name| !except.contains(&name.as_str())) {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                collect(key, before.get(name), after.get(name), except, found);
            }
        }
        (Some(Value::Array(before)), Some(Value::Array(after)))
            if before.iter().chain(after).any(Value::is_table) =>
        {
            for number in 0..before.len().max(after.len()) {
                let key = format!("{key}[{number}]");
                collect(key, before.get(number), after.get(number), except, found);
            }
        }
        _ if then == now => {}
        _ => found.push(Difference { key, then: then.cloned(), now: now.cloned() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_key_is_named_also_within_lists_of_tables() {
        let then = "a = 1\nport = 2\n[[focus]]\nx = 1.0\n[[focus]]\nx = 2.0\n";
        let now = "b = 1\nport = 3\n[[focus]]\nx = 1.0\n[[focus]]\nx = 2.5\n[[focus]]\nx = 3.0\n";
        let [then, now] = [then, now].map(|text| text.parse::<Table>().expect("TOML"));
        let found = differences(then, now, &["port"]);
        let keys: Vec<&str> = found.iter().map(|difference| difference.key.as_str()).collect();
        assert_eq!(keys, ["a", "focus[1].x", "focus[2]", "b"]);
        assert_eq!(found[1].then, Some(Value::Float(2.0)));
        assert_eq!(found[1].now, Some(Value::Float(2.5)));
        assert_eq!((&found[3].then, &found[0].now), (&None, &None));
    }
}
