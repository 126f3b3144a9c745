//! Opening the devices of a rig file, real or simulated.

use std::path::Path;
use std::process::Command;

use tokio::sync::watch;

use super::AcquisitionError;
use super::air_log::AirLog;
use super::event::Event;
use super::rig_setup::RigSetup;
use fieldgap_records::JournalError;
use fieldgap_rig::link::WireLogs;
use fieldgap_rig::watchdog::{Duties, Follower, Standing, Watchdog};
use fieldgap_rig::{AirReading, Emergency, Ports, RobotObserver, Role, SafeRig};

/// Simulated devices that take the place of those in a rig file.
pub struct SimulatedDevices {
    ports: Ports,
    follows: Option<Box<dyn RobotObserver>>,
    _simulator: Box<dyn Send>,
}

impl SimulatedDevices {
    /// Devices that answer at `ports` for as long as `simulator` lives.
    pub fn new(ports: Ports, simulator: impl Send + 'static) -> Self {
        Self { ports, follows: None, _simulator: Box::new(simulator) }
    }

    /// The same, with an observer that follows a real robot.
    pub fn following(self, follows: Option<Box<dyn RobotObserver>>) -> Self {
        Self { follows, ..self }
    }
}

/// Opens the simulated devices of a rig file; `None` where its devices are real.
pub type OpenSimulated = fn(&RigSetup) -> Result<Option<SimulatedDevices>, AcquisitionError>;

/// The folder of the wire logs, in that of a scan.
pub(super) const WIRE_LOGS: &str = "wire";

/// An open rig: the array is silent, the robot stands still.
pub struct OpenRig {
    // Dropped in this order: the drivers close their ports before the simulated devices end.
    rig: SafeRig,
    logs: WireLogs,
    watchdog: Option<Watchdog>,
    air: Option<AirLog>,
    /// The devices that are not simulated.
    real: Vec<Role>,
    _simulated: Option<SimulatedDevices>,
}

/// One reading of a rig's sensor of the air, with no other device opened; `None` if the rig has none.
///
/// # Errors
/// [`AcquisitionError`] if the sensor cannot be opened or does not answer.
pub async fn read_air(
    rig_setup: &RigSetup,
    open_simulated: OpenSimulated,
) -> Result<Option<AirReading>, AcquisitionError> {
    if rig_setup.rig.environment.is_none() {
        return Ok(None);
    }
    let simulated = open_simulated(rig_setup)?;
    let ports = simulated.as_ref().map(|devices| devices.ports.clone()).unwrap_or_default();
    let Some(mut sensor) = fieldgap_rig::open_air_sensor(&rig_setup.rig, &ports).await? else {
        return Ok(None);
    };
    Ok(Some(sensor.air().await?))
}

impl OpenRig {
    /// Opens the three devices. Nothing moves.
    ///
    /// # Errors
    /// [`AcquisitionError`] if a device cannot be opened, or if the controller drives another number of elements than the rig
    /// file describes.
    pub async fn open(
        rig_setup: &RigSetup,
        open_simulated: OpenSimulated,
    ) -> Result<Self, AcquisitionError> {
        let mut simulated = open_simulated(rig_setup)?;
        let ports = simulated.as_ref().map(|devices| devices.ports.clone()).unwrap_or_default();
        let logs = WireLogs::default();
        let rig = logs.around(fieldgap_rig::open(&rig_setup.rig, &ports)).await?;
        let mut rig = rig.recording_calls(logs.clone());
        if let Some(follows) = simulated.as_mut().and_then(|devices| devices.follows.take()) {
            rig = rig.observed_by(follows);
        }
        let (believed, controller) =
            (rig_setup.nominal_array().len(), rig.array().identity().elements);
        if believed != controller {
            return Err(AcquisitionError::OtherArray { believed, controller });
        }
        let sensor = logs.around(fieldgap_rig::open_air_sensor(&rig_setup.rig, &ports)).await?;
        let air = sensor
            .zip(rig_setup.rig.environment.as_ref())
            .map(|(sensor, config)| AirLog::new(sensor, config));
        let real = rig_setup.real_devices().to_vec();
        Ok(Self { rig, logs, watchdog: None, air, real, _simulated: simulated })
    }

    /// Writes the wire logs and the air readings of the scan in `folder` from now on. The wire logs include what was sent
    /// and received since the ports were opened.
    ///
    /// # Errors
    /// [`AcquisitionError`] if a file cannot be written.
    pub(super) fn log_to(&mut self, folder: &Path) -> Result<(), AcquisitionError> {
        let wire = folder.join(WIRE_LOGS);
        self.logs
            .keep_in(&wire)
            .map_err(|source| JournalError::Write { path: wire.clone(), source })?;
        match &mut self.air {
            Some(air) => air.write_to(folder),
            None => Ok(()),
        }
    }

    /// Starts a watchdog process for the real devices: `program`, which calls [`guard`](super::watchdog::guard). If it has to act,
    /// it writes what it does to `log`, and `note` tells it whom to notify. Simulated devices end with this process and need no
    /// watchdog to be safe.
    ///
    /// # Errors
    /// [`AcquisitionError::Watchdog`] if it does not start.
    pub fn guard(
        &mut self,
        program: Command,
        log: Option<&Path>,
        note: Option<String>,
    ) -> Result<(), AcquisitionError> {
        let is_real = |emergency: &Emergency| self.real.contains(&emergency.device.role);
        let emergencies = self.rig.emergencies().into_iter().filter(is_real).collect();
        let duties = Duties { emergencies, log: log.map(Path::to_owned), note };
        self.watchdog = Watchdog::start(program, duties).map_err(AcquisitionError::Watchdog)?;
        Ok(())
    }

    /// Tells whether the watchdog is there; `None` without one.
    pub(super) fn standing(&self) -> Option<watch::Receiver<Standing>> {
        self.watchdog.as_ref().map(Watchdog::standing)
    }

    /// Shows the watchdog that work responds; `None` without one.
    pub(super) fn follower(&self) -> Option<Follower> {
        self.watchdog.as_ref().map(Watchdog::follower)
    }

    /// The devices.
    pub fn rig(&mut self) -> &mut SafeRig {
        &mut self.rig
    }

    /// The log of the environment sensor, if there is one.
    pub(super) fn air(&mut self) -> Option<&mut AirLog> {
        self.air.as_mut()
    }

    /// The devices that answered.
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
