//! A TOML file edited in place; unchanged parts, comments included, are preserved.

use std::path::Path;

use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, Value};

use super::change::{Change, Correction};
use super::changed_key::{ChangedKey, changed_keys};
use super::not_correctable::Unwritten;
use fieldgap_input::Fault;
use fieldgap_records::{ArraySection, Layout, MediumSection};

/// The keys of `[array]` that only some layouts have.
const LATTICE_KEYS: [&str; 9] = [
    "columns",
    "rows",
    "count",
    "rings",
    "seed",
    "file",
    "element_diameter_mm",
    "spacing_mm",
    "pitch_mm",
];
/// The keys of `[medium]` that give the speed of sound by the state of the air.
const AIR_KEYS: [&str; 3] = ["temperature_c", "humidity_percent", "pressure_kpa"];

/// A set-up file that is being corrected, and as it was.
pub(super) struct Document {
    corrected: DocumentMut,
    before: DocumentMut,
}

impl Document {
    /// Parses the text of a file that was read without error.
    ///
    /// # Errors
    /// A [`Fault`] if it is not valid TOML.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Fault> {
        let before: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| {
            let range = error.span().unwrap_or(0..0);
            Fault::at(path, text, range, error.message(), "correct this line")
        })?;
        Ok(Self { corrected: before.clone(), before })
    }

    /// The text, with a comment at its head.
    pub fn text(&self, head: &str) -> String {
        let comment: String = head.lines().map(comment).collect();
        format!("{comment}\n{}", self.corrected)
    }

    /// The keys that were changed.
    pub fn changes(&self) -> Vec<ChangedKey> {
        changed_keys(&self.before, &self.corrected)
    }

    /// A section as a table that can hold comments.
    pub fn section(&mut self, name: &str) -> &mut Table {
        if let Some(mut key) = self.corrected.key_mut(name) {
            // Remove the blank between the name of an inline table and its equals sign.
            key.leaf_decor_mut().set_suffix("");
        }
        let item = self.corrected.entry(name).or_insert(Item::Table(Table::new()));
        as_table(item)
    }

    /// Every `[[focus]]`.
    pub fn foci(&mut self) -> impl Iterator<Item = &mut Table> {
        let item =
            self.corrected.entry("focus").or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
        let taken = std::mem::take(item);
        *item = Item::ArrayOfTables(taken.into_array_of_tables().unwrap_or_default());
        item.as_array_of_tables_mut().into_iter().flat_map(ArrayOfTables::iter_mut)
    }

    /// Corrects `[medium]`.
    pub fn correct_medium(&mut self, correction: &Correction, nominal: &MediumSection) {
        let Change::SpeedOfSound(m_s) = correction.change else { return };
        let before = nominal.medium().speed_of_sound_m_s;
        let medium = self.section("medium");
        for key in AIR_KEYS {
            medium.remove(key);
        }
        let note = format!("{}; {before:.2} before", correction.found);
        set(medium, "speed_of_sound_m_s", m_s.into(), &note);
    }

    /// Corrects the frequency and, for a lattice, the pitch.
    pub fn correct_array(&mut self, correction: &Correction, nominal: &ArraySection) {
        match (&correction.change, nominal.layout()) {
            (Change::Frequency(ratio, _), _) => {
                let before = nominal.frequency_hz();
                let note = format!("{}; {before} before", correction.found);
                let corrected_hz = round_to(before * ratio, 1e-3);
                set(self.section("array"), "frequency_hz", corrected_hz.into(), &note);
            }
            (
                Change::Pitch(ratio),
                Layout::Square { rims, .. }
                | Layout::Linear { rims, .. }
                | Layout::Hexagonal { rims, .. }
                | Layout::HexagonalThesis { rims, .. }
                | Layout::Random { rims, .. },
            ) => {
                let pitch_mm = rims.pitch_m() * 1e3;
                let spacing_mm = round_to(pitch_mm * ratio - rims.diameter_mm.get(), 1e-5);
                let note = format!(
                    "{}; a pitch of {} mm before",
                    correction.found,
                    round_to(pitch_mm, 1e-6)
                );
                let array = self.section("array");
                if array.contains_key("pitch_mm") {
                    let corrected_mm = round_to(pitch_mm * ratio, 1e-5);
                    set(array, "pitch_mm", corrected_mm.into(), &note);
                    if spacing_mm < 0.0 {
                        set(array, "element_diameter_mm", corrected_mm.into(), "");
                    }
                } else if spacing_mm >= 0.0 {
                    set(array, "spacing_mm", spacing_mm.into(), &note);
                } else {
                    // The diameter only determines the pitch.
                    let diameter_mm = round_to(pitch_mm * ratio, 1e-5);
                    set(array, "element_diameter_mm", diameter_mm.into(), &note);
                    set(array, "spacing_mm", 0.0.into(), "");
                }
            }
            _ => {}
        }
    }

    /// Replaces the layout by a file of elements.
    pub fn name_elements(&mut self, file: &str, note: &str) {
        let array = self.section("array");
        // The file has the elements as a calibration found them.
        for key in LATTICE_KEYS.into_iter().chain(["calibration", "compensate"]) {
            array.remove(key);
        }
        set(array, "layout", "elements".into(), note);
        set(array, "file", file.into(), "");
    }
}

/// Sets the value of a key, with a comment above it. A comment after the old value is kept.
pub(super) fn set(table: &mut Table, key: &str, mut value: Value, note: &str) {
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *value.decor_mut() = old.decor().clone();
    }
    table.insert(key, Item::Value(value));
    if note.is_empty() {
        return;
    }
    let Some(mut key) = table.key_mut(key) else { return };
    let decor = key.leaf_decor_mut();
    let before = decor.prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default().to_owned();
    decor.set_prefix(before + &comment(note));
}

/// A line of comment. TOML comments must not contain control characters, but names of scans and units may.
fn comment(words: &str) -> String {
    let words: String = words.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!("# {}\n", words.trim_end())
}

/// Numbers as a TOML array.
pub(super) fn numbers(numbers: impl IntoIterator<Item = f64>) -> Value {
    Value::Array(numbers.into_iter().collect::<Array>())
}

/// The comment at the head of a corrected file.
pub(super) fn head(
    from: &Path,
    scans: &[String],
    probability: f64,
    written: &[&Correction],
    unwritten: &[Unwritten],
) -> String {
    let scans: Vec<String> = scans.iter().map(|scan| format!("`{scan}`")).collect();
    let mut head = format!(
        "{}, corrected by `fieldgap diagnose` from {} (probability {probability:.3}):\n",
        from.file_name().unwrap_or_default().to_string_lossy(),
        scans.join(", ")
    );
    for correction in written {
        head += &format!("  {}\n", correction.found);
    }
    if !unwritten.is_empty() {
        head += "Not corrected in this file:\n";
        for effect in unwritten {
            head += &format!("  {effect}\n");
        }
    }
    head
}

fn as_table(item: &mut Item) -> &mut Table {
    if !item.is_table() {
        let taken = std::mem::take(item);
        *item = Item::Table(taken.into_table().unwrap_or_default());
    }
    item.as_table_mut().expect("a table")
}

/// A number rounded to a decimal step.
pub(super) fn round_to(value: f64, step: f64) -> f64 {
    let decimals = (-step.log10()).round().max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    // No minus before a number rounded to zero.
    text.parse::<f64>().expect("a formatted number") + 0.0
}

#[cfg(test)]
mod tests {
    use fieldgap_input::literal;
    use fieldgap_records::Rims;

    use super::*;

    fn document(text: &str) -> Document {
        Document::parse(Path::new("rig.toml"), text).expect("TOML")
    }

    #[test]
    fn comments_and_order_are_kept() {
        let mut document = document("# mine\n[a]\nx = 1.0   # metres\ny = 2 # two\n");
        set(document.section("a"), "x", 1.5.into(), "found");
        assert_eq!(
            document.text("why\n"),
            "# why\n\n# mine\n[a]\n# found\nx = 1.5   # metres\ny = 2 # two\n"
        );
    }

    #[test]
    fn an_inline_section_becomes_a_table() {
        let mut document = document("medium = { temperature_c = 20.0 }\n");
        set(document.section("medium"), "speed_of_sound_m_s", 347.1.into(), "found");
        let text = document.text("");
        assert!(
            text.contains("[medium]") && text.contains("# found\nspeed_of_sound_m_s = 347.1"),
            "{text}"
        );
    }

    #[test]
    fn a_pitch_is_corrected_by_the_key_that_gives_it() {
        let keys =
            "frequency_hz = 40000.0\nlayout = \"linear\"\ncount = 3\nelement_diameter_mm = 10.0\n";
        let correction = |ratio| Correction {
            effect: fieldgap_diagnosis::EffectId::Pitch,
            change: Change::Pitch(ratio),
            found: "found".to_owned(),
        };
        let rims = Rims { diameter_mm: literal(10.0), spacing_mm: literal(0.5) };
        let layout = Layout::Linear { count: 3.try_into().expect("three"), rims };
        let nominal = ArraySection::of_layout(literal(40e3), layout).expect("an array");
        let corrected = |spacing: &str, ratio| {
            let text = format!("[array]\n{keys}{spacing}\n");
            let mut document = document(&text);
            document.correct_array(&correction(ratio), &nominal);
            document.text("")
        };
        let by_pitch = corrected("pitch_mm = 10.5", 1.02);
        assert!(
            by_pitch.contains("pitch_mm = 10.71") && !by_pitch.contains("spacing_mm"),
            "{by_pitch}"
        );
        let narrow = corrected("pitch_mm = 10.5", 0.9);
        assert!(
            narrow.contains("pitch_mm = 9.45") && narrow.contains("element_diameter_mm = 9.45"),
            "{narrow}"
        );
        assert!(corrected("spacing_mm = 0.5", 1.02).contains("spacing_mm = 0.71"));
    }

    #[test]
    fn numbers_are_rounded_to_the_step() {
        assert_eq!(round_to(10.3 - 0.1 - 10.2, 1e-5), 0.0);
        assert_eq!(round_to(10.71 - 10.5, 1e-5), 0.21);
        assert_eq!(round_to(-0.03, 1e-3), -0.03);
    }
}
