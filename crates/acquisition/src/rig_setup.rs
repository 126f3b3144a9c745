//! A rig file: array, medium and devices.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use fieldgap_acoustics::{Array, Medium};
use fieldgap_exposure::{Exposure, ExposureTable};
use fieldgap_input::{Fault, Label, TomlSource};
use fieldgap_level::Sensitivity;
use fieldgap_records::{
    ArraySection, ArrayTable, Hooks, MediumSection, MediumTable, SetupUncertainty,
};
use fieldgap_rig::{
    EnvironmentConfig, FocusArrayConfig, MotionConfig, ReceiverConfig, RigConfig, Role,
};
use fieldgap_sensing::SensingSection;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RigFileKeys {
    name: Label,
    array: Spanned<ArrayTable>,
    medium: Spanned<MediumTable>,
    uncertainty: Option<SetupUncertainty>,
    motion: MotionConfig,
    receiver: ReceiverConfig,
    focus_array: FocusArrayConfig,
    environment: Option<EnvironmentConfig>,
    exposure: Option<Spanned<ExposureTable>>,
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
    /// How well array, air and origin are known, where the rig file states it.
    pub uncertainty: Option<SetupUncertainty>,
    /// What the receiver reads at a sound pressure, where the rig file states it: in scans by this rig.
    pub receiver: Option<Sensitivity>,
    /// Places of people and limits of exposure, if any.
    pub exposure: Option<Exposure>,
    /// The devices.
    pub rig: RigConfig,
    /// The elements that receive reflections from a hand, if any.
    pub sensing: Option<SensingSection>,
    /// Programs to start on events of a scan, if the plan names none.
    pub hooks: Hooks,
    virtual_section: Option<VirtualSection>,
    real: Vec<Role>,
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
        let real = real_devices(&source);
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
        // A tolerance is the half width of an even distribution (GUM, 4.3.7).
        let place_m = file.motion.position_tolerance_m() / 3f64.sqrt();
        let receiver = file.receiver.sensitivity.clone();
        let receiver = receiver.map(|sensitivity| sensitivity.placed_within(place_m));
        let exposure =
            file.exposure.as_ref().map(|table| Exposure::read(table, &source)).transpose()?;
        Ok(Self {
            name: file.name.into(),
            array,
            medium: MediumSection::read(&file.medium, &source)?,
            uncertainty: file.uncertainty,
            receiver,
            exposure,
            rig: RigConfig {
                motion: file.motion,
                receiver: file.receiver,
                focus_array: file.focus_array,
                environment: file.environment,
            },
            sensing: file.sensing.map(Spanned::into_inner),
            hooks: file.hooks,
            virtual_section: file.virtual_rig,
            real,
            source,
        })
    }

    /// Whether all devices are simulated: the file has a section `[virtual]`, and no device has a port.
    pub fn is_virtual(&self) -> bool {
        self.real.is_empty()
    }

    /// The devices that are real: all without a section `[virtual]`, and those with a port beside it.
    pub fn real_devices(&self) -> &[Role] {
        &self.real
    }

    /// Where the port of a device stands in the file, if it has one.
    pub fn port_place(&self, role: Role) -> Option<Range<usize>> {
        let file = DeTable::parse(self.source.text()).ok()?;
        let (name, _) = SECTIONS.into_iter().find(|(_, section)| *section == role)?;
        port_of(&file, name)
    }

    /// Path of the truth file of the virtual devices; `None` for a real rig.
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

/// The sections of the devices.
const SECTIONS: [(&str, Role); 4] = [
    ("motion", Role::Robot),
    ("receiver", Role::Receiver),
    ("focus_array", Role::FocusArray),
    ("environment", Role::Environment),
];

/// The devices of a rig file that are real: with a section `[virtual]` those with a port.
pub(super) fn real_devices(source: &TomlSource) -> Vec<Role> {
    let Ok(file) = DeTable::parse(source.text()) else { return Vec::new() };
    let is_real = |name: &str| match file.get_ref().get("virtual") {
        Some(_) => port_of(&file, name).is_some(),
        None => true,
    };
    SECTIONS.into_iter().filter(|(name, _)| is_real(name)).map(|(_, role)| role).collect()
}

/// Where the port of a section stands.
fn port_of(file: &Spanned<DeTable<'_>>, section: &str) -> Option<Range<usize>> {
    port_in(file.get_ref().get(section)?.get_ref())
}

fn port_in(value: &DeValue<'_>) -> Option<Range<usize>> {
    let DeValue::Table(table) = value else { return None };
    table.iter().find_map(|(key, value)| match key.get_ref().as_ref() {
        "port" | "address" => Some(value.span()),
        _ => port_in(value.get_ref()),
    })
}
