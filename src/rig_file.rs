//! A rig file with its `[virtual]` section: where there is one, a virtual rig takes the place of the devices without a port.
//!
//! The acquisition knows no virtual rig. It asks [`simulated_devices`] for the ports to open.

use std::path::Path;

use serde::Deserialize;

use fieldgap_acquisition::{AcquisitionError, RigSetup, SimulatedDevices};
use fieldgap_input::{Fault, TomlSource};
use fieldgap_rig::{RobotObserver, Role};
use fieldgap_virtual_rig::{Truth, VirtualConfig, VirtualRig, VirtualRigError};

/// A rig file as it was read.
#[derive(Debug, Clone)]
pub struct RigFile {
    /// Array, medium and devices.
    pub setup: RigSetup,
    /// The section `[virtual]`; `None` for a real rig.
    pub virtual_rig: Option<VirtualConfig>,
}

/// The one section that [`RigSetup`] does not read; it has read all others.
#[derive(Deserialize)]
struct VirtualSection {
    #[serde(rename = "virtual")]
    virtual_rig: Option<VirtualConfig>,
}

impl RigFile {
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
    /// As [`RigFile::read`].
    pub fn parse(source: TomlSource) -> Result<Self, Fault> {
        Self::of(RigSetup::parse(source)?)
    }

    /// Reads the section `[virtual]` of a rig file whose other sections were read before.
    ///
    /// # Errors
    /// A [`Fault`] at the line of the section that is wrong.
    pub fn of(setup: RigSetup) -> Result<Self, Fault> {
        let VirtualSection { virtual_rig } = setup.source().parse()?;
        if let Some(config) = &virtual_rig {
            can_be_mixed(&setup, config)?;
        }
        Ok(Self { setup, virtual_rig })
    }

    /// The same, with virtual time that passes at least as real time does: for people and programs that wait.
    pub fn on_wall_clock(mut self) -> Self {
        if let Some(config) = &mut self.virtual_rig {
            config.keep_wall_clock();
        }
        self
    }

    /// Checks the truth file of a virtual rig, without opening the rig.
    ///
    /// # Errors
    /// A [`Fault`] of the truth file.
    pub fn check_truth(&self) -> Result<(), Fault> {
        match &self.virtual_rig {
            Some(config) => Truth::read(&config.truth_path(self.folder())).map(drop),
            None => Ok(()),
        }
    }

    /// Opens the virtual rig; `None` for a real rig.
    ///
    /// # Errors
    /// [`VirtualRigError`] if its truth file is wrong or the system gives no pseudo-terminals.
    pub fn open_virtual(&self) -> Result<Option<VirtualRig>, VirtualRigError> {
        let Some(config) = &self.virtual_rig else { return Ok(None) };
        let setup = &self.setup;
        let opened = VirtualRig::open(
            config,
            self.folder(),
            setup.array.uncalibrated(),
            setup.nominal_medium(),
            setup.array.frequency_hz(),
            setup.rig.motion.frame(),
        )?;
        Ok(Some(opened.beside_real(setup.real_devices())))
    }

    fn folder(&self) -> &Path {
        self.setup.source().path().parent().unwrap_or(Path::new(""))
    }
}

/// Checks that the real devices of a rig file, if any, can work with the virtual ones.
fn can_be_mixed(setup: &RigSetup, config: &VirtualConfig) -> Result<(), Fault> {
    let real = setup.real_devices();
    let fault = |role: Role, problem: &str, remedy: &str| {
        let place = setup.port_place(role).unwrap_or_default();
        Err(setup.source().fault(place, problem, remedy))
    };
    match real.first() {
        Some(&role) if !config.runs_in_real_time() => fault(
            role,
            "a device with a port is real, and beside real devices virtual time must pass as the computer's does",
            "set `pace = { times = 1.0 }` in [virtual], or remove the port to simulate this device too",
        ),
        Some(_) if real.contains(&Role::FocusArray) && !real.contains(&Role::Receiver) => fault(
            Role::FocusArray,
            "this array is real, and a virtual receiver measures the field of the virtual array alone",
            "remove this port, or give the table in [receiver] a port",
        ),
        _ => Ok(()),
    }
}

/// Opens the virtual rig of a rig file for a scan; `None` for a real rig.
///
/// # Errors
/// [`AcquisitionError`] if the section `[virtual]` or its truth file is wrong, or if the system gives no pseudo-terminals.
pub fn simulated_devices(setup: &RigSetup) -> Result<Option<SimulatedDevices>, AcquisitionError> {
    let opened = RigFile::of(setup.clone())?.open_virtual().map_err(|error| match error {
        VirtualRigError::Truth(fault) => AcquisitionError::File(fault),
        other => AcquisitionError::SimulatedDevices(Box::new(other)),
    })?;
    Ok(opened.map(|rig| {
        let follows = rig.robot_shadow().map(|shadow| Box::new(shadow) as Box<dyn RobotObserver>);
        SimulatedDevices::new(rig.ports(), rig).following(follows)
    }))
}
