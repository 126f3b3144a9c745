//! All keys that a TOML file lacks, and all that it should not have, in one fault.
//!
//! A parser stops at the first of them. Here it is run again with that key added or removed, until it finds no further one. A key that is
//! added needs a value that the parser accepts; this value is the example in the message.

use std::borrow::Cow;
use std::fmt::Write;
use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer, Error};

use super::examples::{candidates, unit};
use super::{Fault, TomlSource};

/// How a message ends that asks for one table of several; their names follow, with commas between them.
pub const ONE_TABLE_OF: &str = "add the table of one: ";

/// Most faults of a file that are told at once.
const MOST_FAULTS: usize = 60;
/// Most runs of the parser.
const MOST_RUNS: usize = 600;
/// Most bytes of a file that is parsed so often.
const MOST_BYTES: usize = 256 << 10;

/// A key or value of the tree that is parsed: its number stands in place of its byte range, so that an error names one node.
#[derive(Clone)]
struct Node {
    /// The table that it is or lies in: `motion.marlin`, empty for the file itself.
    table: String,
    /// Bytes of the file; those of the nearest table that is in the file, for what was added.
    place: Range<usize>,
    /// Which of the added keys it belongs to.
    added: Option<usize>,
}

/// A key that is missing.
struct Added {
    table: String,
    place: Range<usize>,
    key: String,
    /// The number of the table that gets it.
    holder: usize,
    /// Values that the parser may accept, as TOML; those that are not constants are strings.
    values: Vec<Cow<'static, str>>,
    /// Which of `values` is tried.
    tried: usize,
    /// The tables of which this is one, with commas between them, where any of them would do.
    one_of: Option<String>,
}

/// A key that is unknown, or the first other error.
struct Wrong {
    place: Range<usize>,
    problem: String,
}

/// The tree that is parsed, and what is known of it.
struct Search<'s> {
    source: &'s TomlSource,
    root: DeTable<'s>,
    nodes: Vec<Node>,
    added: Vec<Added>,
    wrong: Vec<Wrong>,
}

/// A fault that names every missing and every unknown key of the file; `None` where the first error is another one.
pub(super) fn every_key<T: DeserializeOwned>(source: &TomlSource) -> Option<Fault> {
    if source.text().len() > MOST_BYTES {
        return None;
    }
    let root = DeTable::parse(source.text()).ok()?.into_inner();
    let top = Node { table: String::new(), place: 0..0, added: None };
    let mut search =
        Search { source, root: DeTable::new(), nodes: vec![top], added: vec![], wrong: vec![] };
    search.root = search.numbered(root, 0);
    for _ in 0..MOST_RUNS {
        let numbered = Spanned::new(0..1, search.root.clone());
        let Err(error) = T::deserialize(Deserializer::from(numbered)) else { break };
        let found = search.added.len() + search.wrong.len();
        if found >= MOST_FAULTS || search.take(&error).is_none() {
            break;
        }
    }
    search.fault()
}

impl<'s> Search<'s> {
    /// The same table with a number in place of each byte range; `parent` is the table's own number.
    fn numbered(&mut self, table: DeTable<'s>, parent: usize) -> DeTable<'s> {
        table
            .into_iter()
            .map(|(key, value)| {
                let Node { table, added, .. } = self.nodes[parent].clone();
                let path = match table.as_str() {
                    "" => key.get_ref().to_string(),
                    outer => format!("{outer}.{}", key.get_ref()),
                };
                let number = self.push(Node { table, place: key.span(), added });
                let key = Spanned::new(number..number + 1, key.into_inner());
                (key, self.numbered_value(value, parent, &path))
            })
            .collect()
    }

    fn numbered_value(
        &mut self,
        value: Spanned<DeValue<'s>>,
        parent: usize,
        path: &str,
    ) -> Spanned<DeValue<'s>> {
        let Node { table, added, .. } = self.nodes[parent].clone();
        let table = if value.get_ref().is_table() { path.to_owned() } else { table };
        let number = self.push(Node { table, place: value.span(), added });
        let inner = match value.into_inner() {
            DeValue::Table(table) => DeValue::Table(self.numbered(table, number)),
            DeValue::Array(mut list) => {
                for item in list.iter_mut() {
                    let taken = std::mem::replace(item, Spanned::new(0..0, DeValue::Boolean(true)));
                    *item = self.numbered_value(taken, number, path);
                }
                DeValue::Array(list)
            }
            plain => plain,
        };
        Spanned::new(number..number + 1, inner)
    }

    fn push(&mut self, node: Node) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Takes an error of the parser, and changes the tree so that the next run finds the next one. `None` where that is impossible.
    fn take(&mut self, error: &Error) -> Option<()> {
        let number = error.span()?.start;
        let node = self.nodes.get(number)?.clone();
        let message = error.message().trim();
        if let Some(key) =
            message.strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`'))
        {
            return self.add(number, node, key, None);
        }
        if let Some((_, tables)) = message.split_once(ONE_TABLE_OF) {
            let key = tables.split(',').next()?;
            return self.add(number, node, key, Some(tables.to_owned()));
        }
        if let Some(added) = node.added {
            return self.try_next(added, message);
        }
        let problem = message.to_owned();
        self.wrong.push(Wrong { place: node.place, problem });
        if message.starts_with("unknown field `") {
            return remove(&mut self.root, number).then_some(());
        }
        None
    }

    /// Adds a key to the table `holder`.
    fn add(&mut self, holder: usize, node: Node, key: &str, one_of: Option<String>) -> Option<()> {
        let Node { table, place, .. } = node;
        let values = if one_of.is_some() { vec!["{}".into()] } else { candidates(key) };
        let key = key.to_owned();
        self.added.push(Added { table, place, key, holder, values, tried: 0, one_of });
        self.put(self.added.len() - 1)
    }

    /// Puts the value under trial of an added key into its table.
    fn put(&mut self, added: usize) -> Option<()> {
        let new = &self.added[added];
        let value = Spanned::new(new.place.clone(), parsed(new.values.get(new.tried)?.clone())?);
        let (holder, path, key) = (new.holder, new.path(), Cow::Owned(new.key.clone()));
        let (table, place) = (new.table.clone(), new.place.clone());
        let parent = self.push(Node { table, place: place.clone(), added: Some(added) });
        let value = self.numbered_value(value, parent, &path);
        // The parts of the value have places of their own text; what is shown is the table in the file.
        for node in &mut self.nodes[parent..] {
            node.place = place.clone();
        }
        table_numbered(&mut self.root, 0, holder)?
            .insert(Spanned::new(parent..parent + 1, key), value);
        Some(())
    }

    /// Tries the next value of an added key, after the parser has refused one.
    fn try_next(&mut self, added: usize, message: &str) -> Option<()> {
        let variants = message.strip_prefix("unknown variant").and_then(|rest| {
            let (_, expected) = rest.split_once("expected")?;
            expected.split('`').nth(1)
        });
        let trial = self.added.get_mut(added)?;
        trial.tried += 1;
        if let Some(variant) = variants {
            trial.values.insert(trial.tried, format!("\"{variant}\"").into());
        }
        self.put(added)
    }

    fn fault(self) -> Option<Fault> {
        // Anything but a key that is missing or unknown is told alone, as the parser does.
        if self.added.is_empty() && self.wrong.len() < 2 {
            return None;
        }
        let mut problems: Vec<String> = Vec::new();
        let line = |place: &Range<usize>| {
            self.source.text().get(..place.start).map_or(1, |text| text.matches('\n').count() + 1)
        };
        for wrong in &self.wrong {
            problems.push(format!("{} (line {})", wrong.problem, line(&wrong.place)));
        }
        let names: Vec<String> = self.added.iter().map(Added::described).collect();
        match &names[..] {
            [] => {}
            [one] => problems.push(format!("the key {one} is missing")),
            several => {
                let list = several.join(", ");
                problems.push(format!("{} keys are missing: {list}", several.len()));
            }
        }
        let place = match (self.wrong.first(), self.added.first()) {
            (Some(wrong), _) => wrong.place.clone(),
            (None, Some(added)) => added.place.clone(),
            (None, None) => return None,
        };
        let mut remedy = String::new();
        if !self.wrong.is_empty() {
            remedy += "remove or correct what is unknown";
        }
        if !self.added.is_empty() {
            remedy += if remedy.is_empty() { "add" } else { "; add" };
            remedy += " what is missing, with your values:\n";
            remedy += &self.example(line);
        }
        Some(self.source.fault(place, problems.join("; "), remedy))
    }

    /// The missing keys as lines of TOML, table by table in the order in which they were found.
    fn example(&self, line: impl Fn(&Range<usize>) -> usize) -> String {
        let mut tables: Vec<&str> = Vec::new();
        for key in &self.added {
            if !tables.contains(&key.table.as_str()) {
                tables.push(&key.table);
            }
        }
        // The keys of the file itself stand before its tables.
        tables.sort_by_key(|table| !table.is_empty());
        let mut text = String::new();
        for table in tables {
            let keys = || self.added.iter().filter(|key| key.table == table);
            let place = keys().map(|key| line(&key.place)).next().unwrap_or(1);
            let has_values = keys().any(|key| key.value() != "{}");
            let is_new = self.added.iter().any(|key| key.path() == table);
            match (table, is_new) {
                ("", _) if has_values => text += "# before the first table\n",
                ("", _) => {}
                (table, true) => _ = writeln!(text, "[{table}]"),
                (table, false) => _ = writeln!(text, "[{table}]  # is there, line {place}"),
            }
            for key in keys() {
                let value = key.value();
                let has_keys = self.added.iter().any(|inner| inner.table == key.path());
                match unit(&key.key) {
                    _ if value == "{}" && has_keys => {}
                    _ if value == "{}" => {
                        let others =
                            key.one_of.as_ref().map(|tables| format!("  # one of {tables}"));
                        _ = writeln!(text, "[{}]{}", key.path(), others.unwrap_or_default());
                    }
                    Some(unit) => _ = writeln!(text, "{} = {value}  # {unit}", key.key),
                    None => _ = writeln!(text, "{} = {value}", key.key),
                }
            }
        }
        text.trim_end().to_owned()
    }
}

impl Added {
    /// `pitch_mm` (mm) in [array]
    fn described(&self) -> String {
        if let Some(tables) = &self.one_of {
            return format!("a table of one of {tables} in [{}]", self.table);
        }
        let unit = unit(&self.key).map_or(String::new(), |unit| format!(" ({unit})"));
        match self.table.as_str() {
            "" => format!("`{}`{unit}", self.key),
            table => format!("`{}`{unit} in [{table}]", self.key),
        }
    }

    /// The example; dots where the parser accepts none.
    fn value(&self) -> &str {
        self.values.get(self.tried).map_or("...", |value| value.as_ref())
    }

    fn path(&self) -> String {
        if self.table.is_empty() {
            self.key.clone()
        } else {
            format!("{}.{}", self.table, self.key)
        }
    }
}

/// An example as a value.
fn parsed(example: Cow<'static, str>) -> Option<DeValue<'static>> {
    match example {
        Cow::Borrowed(toml) => DeValue::parse(toml).ok().map(Spanned::into_inner),
        Cow::Owned(quoted) => Some(DeValue::String(quoted.trim_matches('"').to_owned().into())),
    }
}

/// Removes the key with a number from its table; whether it was there.
fn remove(table: &mut DeTable<'_>, number: usize) -> bool {
    let before = table.len();
    let kept = std::mem::take(table).into_iter().filter(|(key, _)| key.span().start != number);
    *table = kept.collect();
    table.len() < before || table.iter_mut().any(|(_, value)| remove_in(value, number))
}

fn remove_in(value: &mut Spanned<DeValue<'_>>, number: usize) -> bool {
    match value.get_mut() {
        DeValue::Table(table) => remove(table, number),
        DeValue::Array(list) => list.iter_mut().any(|item| remove_in(item, number)),
        _ => false,
    }
}

/// The table with a number; `own` is the number of `table`.
fn table_numbered<'t, 's>(
    table: &'t mut DeTable<'s>,
    own: usize,
    wanted: usize,
) -> Option<&'t mut DeTable<'s>> {
    if own == wanted {
        return Some(table);
    }
    table.iter_mut().find_map(|(_, value)| in_value(value, wanted))
}

fn in_value<'t, 's>(
    value: &'t mut Spanned<DeValue<'s>>,
    wanted: usize,
) -> Option<&'t mut DeTable<'s>> {
    let own = value.span().start;
    match value.get_mut() {
        DeValue::Table(table) => table_numbered(table, own, wanted),
        DeValue::Array(list) => list.iter_mut().find_map(|item| in_value(item, wanted)),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
