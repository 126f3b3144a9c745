//! The air during a scan: rows of `environment.csv` at intervals, and the medium at the start.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;

use super::AcquisitionError;
use fieldgap_input::Fault;
use fieldgap_records::{AIR_FILE as FILE, MediumSection};
use fieldgap_rig::{AirReading, AirSensor, EnvironmentConfig};

const HEADER: &str = "time_s,temperature_c,humidity_percent,pressure_kpa\n";

/// Shortest time before a failed sensor is read again, s: each attempt may take its full time limit.
const AFTER_FAULT_S: f64 = 60.0;

/// Writes the readings of an environment sensor to the record.
pub(super) struct AirLog {
    sensor: Box<dyn AirSensor>,
    file: Option<File>,
    every_s: f64,
    /// Scan time of the next reading, s.
    due_s: f64,
    failed: bool,
}

/// Result of [`AirLog::poll`].
#[derive(Debug)]
pub(super) enum Polled {
    /// The reading was written, or none was due.
    Kept,
    /// The sensor or the file failed, for this reason. The scan continues.
    Lost(String),
    /// Readings are written again after a failure.
    Back,
}

impl AirLog {
    /// For a sensor that is read at the interval of `config`.
    pub(super) fn new(sensor: Box<dyn AirSensor>, config: &EnvironmentConfig) -> Self {
        Self { sensor, file: None, every_s: config.every_s.get(), due_s: 0.0, failed: false }
    }

    /// The medium that follows from a reading. Values that the sensor does not give are taken from the rig file.
    ///
    /// # Errors
    /// The sensor failed, or the speed of sound cannot be computed for such air.
    pub(super) async fn medium(
        &mut self,
        config: &EnvironmentConfig,
    ) -> Result<MediumSection, AcquisitionError> {
        let AirReading { temperature_c, humidity_percent, pressure_kpa } =
            self.sensor.air().await?;
        let humidity_percent = humidity_percent.unwrap_or(config.humidity_percent.get());
        let pressure_kpa = pressure_kpa.unwrap_or(config.pressure_kpa.get());
        MediumSection::of_air(temperature_c, humidity_percent, pressure_kpa)
            .ok_or(AcquisitionError::NoMedium { temperature_c, humidity_percent, pressure_kpa })
    }

    /// Appends rows to the file in a scan's folder from now on. An incomplete last row is removed.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write_to(&mut self, folder: &Path) -> Result<(), AcquisitionError> {
        let path = folder.join(FILE);
        let file = open_whole(&path).map_err(|error| {
            let remedy = "check that the folder may be written and that its disk has room";
            Fault::of_file(&path, format!("cannot be written: {error}"), remedy)
        })?;
        self.file = Some(file);
        Ok(())
    }

    /// Reads the sensor if that is due at scan time `time_s`, s, and writes the reading. A failing sensor or a full disk is
    /// reported once and does not end the scan.
    pub(super) async fn poll(&mut self, time_s: f64) -> Polled {
        if time_s < self.due_s {
            return Polled::Kept;
        }
        let kept = match self.sensor.air().await {
            Ok(air) => self.keep(time_s, air).map_err(|error| format!("{FILE}: {error}")),
            Err(error) => Err(error.to_string()),
        };
        let was_lost = std::mem::replace(&mut self.failed, kept.is_err());
        self.due_s =
            time_s + if self.failed { self.every_s.max(AFTER_FAULT_S) } else { self.every_s };
        match kept {
            Ok(()) if was_lost => Polled::Back,
            Err(reason) if !was_lost => Polled::Lost(reason),
            _ => Polled::Kept,
        }
    }

    fn keep(&mut self, time_s: f64, air: AirReading) -> io::Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let end = file.stream_position()?;
        let or_none = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
        let row = format!(
            "{time_s},{},{},{}\n",
            air.temperature_c,
            or_none(air.humidity_percent),
            or_none(air.pressure_kpa)
        );
        let written = file.write_all(row.as_bytes()).and_then(|()| file.sync_data());
        if written.is_err() {
            // Remove the incomplete row.
            file.set_len(end)?;
            file.seek(SeekFrom::Start(end))?;
        }
        written
    }
}

/// Opens the file for appending, and truncates it after its last complete line.
fn open_whole(path: &Path) -> io::Result<File> {
    let options = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
    let mut file = options?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    let whole = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
    file.set_len(whole as u64)?;
    file.seek(SeekFrom::End(0))?;
    if whole == 0 {
        file.write_all(HEADER.as_bytes())?;
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use async_trait::async_trait;

    use super::*;
    use fieldgap_rig::{Cause, Device, RigError, Role};

    /// Says one degree more each time; fails at the questions of `fails`.
    struct Double {
        device: Device,
        asked: u32,
        fails: std::ops::Range<u32>,
    }

    #[async_trait]
    impl AirSensor for Double {
        fn device(&self) -> &Device {
            &self.device
        }
        async fn air(&mut self) -> Result<AirReading, RigError> {
            self.asked += 1;
            if self.fails.contains(&self.asked) {
                return Err(RigError::new(
                    self.device.clone(),
                    "asking",
                    Cause::Disconnected,
                    None,
                ));
            }
            Ok(AirReading {
                temperature_c: 20.0 + f64::from(self.asked),
                humidity_percent: Some(45.5),
                pressure_kpa: None,
            })
        }
    }

    fn log(fails: std::ops::Range<u32>) -> AirLog {
        AirLog {
            sensor: Box::new(Double {
                device: Device::new(Role::Environment, "memory"),
                asked: 0,
                fails,
            }),
            file: None,
            every_s: 10.0,
            due_s: 0.0,
            failed: false,
        }
    }

    #[tokio::test]
    async fn rows_are_written_at_intervals_and_an_incomplete_one_is_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(FILE);
        std::fs::write(&path, "time_s,temperature_c,humidity_percent,pressure_kpa\n1,20,,\n2.5,2")
            .expect("written");
        let mut log = log(0..0);
        log.write_to(folder.path()).expect("it can be written");
        for time_s in [12.0, 13.0, 21.9, 22.0] {
            assert!(matches!(log.poll(time_s).await, Polled::Kept));
        }
        let kept = std::fs::read_to_string(&path).expect("it is there");
        assert_eq!(kept, format!("{HEADER}1,20,,\n12,21,45.5,\n22,22,45.5,\n"));
    }

    #[tokio::test]
    async fn a_failing_sensor_is_reported_once_and_again_on_recovery() {
        let mut log = log(2..4);
        let mut told = Vec::new();
        for time_s in [0.0, 10.0, 20.0, 70.0, 130.0, 140.0] {
            told.push(match log.poll(time_s).await {
                Polled::Kept => "kept",
                Polled::Lost(_) => "lost",
                Polled::Back => "back",
            });
        }
        assert_eq!(told, ["kept", "lost", "kept", "kept", "back", "kept"]);
    }
}
