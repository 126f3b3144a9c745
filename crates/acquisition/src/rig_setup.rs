//! A rig file: array, medium and devices.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use fieldgap_acoustics::{Array, Medium};
use fieldgap_input::{Fault, Label, TomlSource};
use fieldgap_records::{ArraySection, ArrayTable, Hooks, MediumSection, MediumTable};
use fieldgap_rig::{EnvironmentConfig, FocusArrayConfig, MotionConfig, ReceiverConfig, RigConfig};
use fieldgap_sensing::SensingSection;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RigFileKeys {
    name: Label,
    array: Spanned<ArrayTable>,
    medium: Spanned<MediumTable>,
    motion: MotionConfig,
    receiver: ReceiverConfig,
    focus_array: FocusArrayConfig,
    environment: Option<EnvironmentConfig>,
    sensing: Option<Spanned<SensingSection>>,
    #[serde(default)]
    hooks: Hooks,
    #[serde(rename = "virtual")]
    virtual_rig: Option<VirtualSection>,
}

/// `[virtual]`, as far as an acquisition needs it. Its other keys are for the virtual rig to read.
#[derive(Debug, Clone, Deserialize)]
struct VirtualSection {
    truth: PathBuf,
}

/// The rig set-up that a rig file describes.
#[derive(Debug, Clone)]
pub struct RigSetup {
    /// Name of the rig.
    pub name: String,
    /// The array, as the rig file describes it.
    pub array: ArraySection,
    /// The medium, as the rig file describes it.
    pub medium: MediumSection,
    /// The devices.
    pub rig: RigConfig,
    /// The elements that receive reflections from a hand, if any.
    pub sensing: Option<SensingSection>,
    /// Programs to start on events of a scan, if the plan names none.
    pub hooks: Hooks,
    virtual_section: Option<VirtualSection>,
    source: TomlSource,
}

impl RigSetup {
    /// Reads a rig file.
    ///
    /// # Errors
    /// A [`Fault`] at the line that is wrong.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        Self::parse(TomlSource::read(path)?)
    }

    /// Reads a text as a rig file.
    ///
    /// # Errors
    /// As [`RigSetup::read`].
    pub fn parse(source: TomlSource) -> Result<Self, Fault> {
        let mut file: RigFileKeys = source.parse()?;
        if file.virtual_rig.is_some() {
            refuse_ports(&source)?;
        }
        file.focus_array.beside(source.path().parent().unwrap_or(Path::new("")));
        let array = ArraySection::read(&file.array, &source)?;
        if let Some(sensing) = &file.sensing {
            let elements = array.array().len();
            if let Some(n) = sensing.get_ref().elements().into_iter().find(|&n| n >= elements) {
                return Err(source.fault(
                    sensing.span(),
                    format!("there is no element {n}: the array has {elements} elements"),
                    "elements are numbered from 0",
                ));
            }
        }
        Ok(Self {
            name: file.name.into(),
            array,
            medium: MediumSection::read(&file.medium, &source)?,
            rig: RigConfig {
                motion: file.motion,
                receiver: file.receiver,
                focus_array: file.focus_array,
                environment: file.environment,
            },
            sensing: file.sensing.map(Spanned::into_inner),
            hooks: file.hooks,
            virtual_section: file.virtual_rig,
            source,
        })
    }

    /// Whether the file has a section `[virtual]`: its devices are then simulated.
    pub fn is_virtual(&self) -> bool {
        self.virtual_section.is_some()
    }

    /// Path of the truth file of a virtual rig; `None` for a real rig.
    pub fn truth_path(&self) -> Option<PathBuf> {
        let folder = self.source.path().parent().unwrap_or(Path::new(""));
        self.virtual_section.as_ref().map(|section| folder.join(&section.truth))
    }

    /// The text and path of the file.
    pub fn source(&self) -> &TomlSource {
        &self.source
    }

    /// The array, as the rig file describes it.
    pub fn nominal_array(&self) -> &Array {
        self.array.array()
    }

    /// The medium, as the rig file describes it.
    pub fn nominal_medium(&self) -> Medium {
        self.medium.medium()
    }
}

/// Refuses a port beside `[virtual]`: all devices are simulated then, and a real one would be ignored.
fn refuse_ports(source: &TomlSource) -> Result<(), Fault> {
    let Ok(file) = DeTable::parse(source.text()) else { return Ok(()) };
    let devices = ["motion", "receiver", "focus_array", "environment"];
    for (_, table) in
        file.get_ref().iter().filter(|(key, _)| devices.contains(&key.get_ref().as_ref()))
    {
        if let Some(place) = port_in(table.get_ref()) {
            return Err(source.fault(
                place,
                "[virtual] simulates all devices, so this port would not be used",
                "remove the port, or, to use the real devices, remove [virtual]",
            ));
        }
    }
    Ok(())
}

fn port_in(value: &DeValue<'_>) -> Option<Range<usize>> {
    let DeValue::Table(table) = value else { return None };
    table.iter().find_map(|(key, value)| match key.get_ref().as_ref() {
        "port" | "address" => Some(value.span()),
        _ => port_in(value.get_ref()),
    })
}
