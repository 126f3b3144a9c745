//! The rig of a rig file, opened: behind real ports, or behind those of a virtual rig made for it.

use std::path::Path;
use std::process::Command;

use super::AcquisitionError;
use super::air_log::AirLog;
use super::event::Event;
use super::rig_setup::RigSetup;
use fieldgap_records::JournalError;
use fieldgap_rig::SafeRig;
use fieldgap_rig::link::WireLogs;
use fieldgap_rig::watchdog::Watchdog;
use fieldgap_virtual_rig::VirtualRig;

/// An open rig: silent, standing still.
pub struct OpenRig {
    // Dropped in this order: the drivers let go of the ports before the firmware behind them ends.
    rig: SafeRig,
    logs: WireLogs,
    watchdog: Option<Watchdog>,
    air: Option<AirLog>,
    firmware: Option<VirtualRig>,
}

impl OpenRig {
    /// Opens the three devices. Nothing moves.
    ///
    /// # Errors
    /// [`AcquisitionError`] if a device cannot be opened, or if the controller drives another number of elements than the rig
    /// file says.
    pub async fn open(rig_setup: &RigSetup) -> Result<Self, AcquisitionError> {
        let firmware = open_virtual(rig_setup)?;
        let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
        let logs = WireLogs::default();
        let rig = logs.around(fieldgap_rig::open(&rig_setup.rig, &ports)).await?;
        let mut rig = rig.recording_calls(logs.clone());
        let (believed, controller) =
            (rig_setup.nominal_array().len(), rig.array().identity().elements);
        if believed != controller {
            return Err(AcquisitionError::OtherArray { believed, controller });
        }
        let sensor = logs.around(fieldgap_rig::open_air_sensor(&rig_setup.rig, &ports)).await?;
        let air = sensor
            .zip(rig_setup.rig.environment.as_ref())
            .map(|(sensor, config)| AirLog::new(sensor, config));
        Ok(Self { rig, logs, watchdog: None, air, firmware })
    }

    /// Keeps all that is said on the wires in a folder, what was said since they were opened included.
    ///
    /// # Errors
    /// [`AcquisitionError::Journal`] with what the file system refused.
    pub fn keep_wire_logs(&self, folder: &Path) -> Result<(), AcquisitionError> {
        self.logs
            .keep_in(folder)
            .map_err(|source| JournalError::Write { path: folder.to_owned(), source }.into())
    }

    /// Has the rig guarded by a process of its own from now on: `program`, which calls
    /// [`fieldgap_rig::watchdog::guard`]. What it does is written to `log`, where there is one. A virtual rig of this process
    /// ends with it, and needs no guard.
    ///
    /// # Errors
    /// [`AcquisitionError::Watchdog`] if it does not start.
    pub fn guard(&mut self, program: Command, log: Option<&Path>) -> Result<(), AcquisitionError> {
        if self.firmware.is_none() {
            let started = Watchdog::start(program, &self.rig.emergencies(), log);
            self.watchdog = started.map_err(AcquisitionError::Watchdog)?;
        }
        Ok(())
    }

    /// The devices.
    pub fn rig(&mut self) -> &mut SafeRig {
        &mut self.rig
    }

    /// What the environment sensor says, where there is one.
    pub(super) fn air(&mut self) -> Option<&mut AirLog> {
        self.air.as_mut()
    }

    /// Who answered.
    pub(super) fn greeting(&mut self) -> Event {
        let robot = self.rig.motion().firmware().to_owned();
        let receiver = self.rig.receiver().identity().clone();
        let array = self.rig.array().identity().clone();
        Event::Opened {
            robot,
            receiver: format!(
                "{} Hz, up to {} {}",
                receiver.rate_hz, receiver.full_scale, receiver.unit
            ),
            array: format!(
                "{}, {} elements, {} steps a period{}",
                array.name,
                array.elements,
                array.period_steps,
                if array.acknowledges { "" } else { ", never answers" }
            ),
        }
    }
}

/// Opens the virtual rig that a rig file describes, if it does.
///
/// # Errors
/// [`AcquisitionError`] if its truth file is wrong or the system gives no pseudo-terminals.
pub fn open_virtual(rig_setup: &RigSetup) -> Result<Option<VirtualRig>, AcquisitionError> {
    let Some(config) = &rig_setup.virtual_rig else { return Ok(None) };
    let believed = rig_setup.nominal_array();
    let folder = rig_setup.source().path().parent().unwrap_or(std::path::Path::new(""));
    let opened = VirtualRig::open(
        config,
        folder,
        believed,
        rig_setup.nominal_medium(),
        rig_setup.array.frequency_hz(),
        rig_setup.rig.motion.frame(),
    )?;
    Ok(Some(opened))
}
