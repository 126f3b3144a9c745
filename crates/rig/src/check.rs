//! `rig check`: queries each device, measures its replies, and reports what to repair. Nothing moves, nothing emits.

mod distribution;
mod latency;
mod noise;

use std::fmt;
use std::time::Duration;

use serde::Serialize;
use tokio::time::{Instant, sleep};

use super::call::Call;
use super::config::RigConfig;
use super::device::Role;
use super::error::RigError;
use super::link::WireLogs;
use super::receiver::Reading;
use super::safety::{Ports, open_air_sensor, open_array, open_motion, recorded};
use super::{AirReading, AirSensor, ArrayIdentity, FocusArray, Motion, Receiver, ReceiverIdentity};
pub use distribution::{BINS, Distribution};
pub use latency::Latency;
use noise::TimedValue;
pub use noise::{Hum, Noise};

/// Queries of which the reply latency is taken.
const QUERIES: usize = 100;

/// Readings of which the noise is taken.
const NOISE_READINGS: usize = 200;

/// Means of which it is seen whether the noise averages out.
const MEANS: usize = 40;

/// How far the measured rate may be from the stated one, as a share of it: crystals are a hundred times better.
const RATE_TOLERANCE: f64 = 0.01;

/// Noise above this share of full scale hides the field.
const NOISY: f64 = 0.05;

/// What was found.
#[derive(Debug, Serialize)]
pub struct CheckReport {
    /// The focus array, and the fault that kept it from being opened.
    pub focus_array: Section<ArrayCheck>,
    /// The receiver.
    pub receiver: Section<ReceiverCheck>,
    /// The robot.
    pub motion: Section<MotionCheck>,
    /// The environment sensor; empty also where the rig file has none.
    pub environment: Section<AirCheck>,
    /// What is not as it should be.
    pub findings: Vec<Finding>,
}

/// What was found at one device; empty where it could not be opened.
pub type Section<T> = Option<T>;

/// How the focus array answered.
#[derive(Debug, Serialize)]
pub struct ArrayCheck {
    /// Its port.
    pub port: String,
    /// Properties that it states.
    pub identity: ArrayIdentity,
    /// How fast it answers.
    pub latency: Latency,
}

/// How the receiver answered, the array silent.
#[derive(Debug, Serialize)]
pub struct ReceiverCheck {
    /// Its port.
    pub port: String,
    /// Properties that it states.
    pub identity: ReceiverIdentity,
    /// Samples a second by its own time stamps, Hz.
    pub measured_rate_hz: Option<f64>,
    /// Mean, deviation and gaps with the array silent.
    pub silent: Reading,
    /// Whether that averages out, drifts, hums.
    pub noise: Noise,
    /// How long a single reading takes.
    pub latency: Latency,
}

/// How the robot answered.
#[derive(Debug, Serialize)]
pub struct MotionCheck {
    /// Its port.
    pub port: String,
    /// What its firmware calls itself.
    pub firmware: String,
    /// The reported position, mm; not meaningful before homing.
    pub position_mm: [f64; 3],
    /// How fast it answers.
    pub latency: Latency,
}

/// The environment sensor's reading.
#[derive(Debug, Serialize)]
pub struct AirCheck {
    /// Its port.
    pub port: String,
    /// The newest reading.
    pub air: AirReading,
}

/// One thing that is not as it should be.
#[derive(Debug, Serialize)]
pub struct Finding {
    /// Where.
    pub device: Role,
    /// Whether a scan is impossible with it, or only poor.
    pub severity: Severity,
    /// What was seen.
    pub problem: String,
    /// What to do.
    pub remedy: String,
}

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// No scan is possible.
    Fault,
    /// A scan is possible and poorer or slower than it need be.
    Warning,
}

/// Checks the three devices, one after the other, each also when another fails.
///
/// `elements` is how many elements the lab believes its array to have. `logs` records the calls beside the bytes, for a replay.
pub async fn check(
    config: &RigConfig,
    ports: &Ports,
    elements: usize,
    logs: Option<&WireLogs>,
) -> CheckReport {
    let mut findings = Vec::new();
    // The array is opened first and kept, so that it is silent while the receiver's noise is taken.
    let mut array = match open_array(config, ports).await {
        Ok(array) => Some(array),
        Err(error) => {
            findings.push(Finding::fault(Role::FocusArray, &error));
            None
        }
    };
    let focus_array = match &mut array {
        Some(array) => note(
            check_array(&mut **array, elements, logs, &mut findings).await,
            Role::FocusArray,
            &mut findings,
        ),
        None => None,
    };
    let receiver = match config.receiver.open(ports.receiver.as_deref()).await {
        Ok(mut receiver) => {
            check_receiver(&mut *receiver, config.receiver.count(), logs, &mut findings).await
        }
        Err(error) => Err(error),
    };
    let receiver = note(receiver, Role::Receiver, &mut findings);
    let motion = match open_motion(&config.motion, ports).await {
        Ok(mut motion) => check_motion(&mut *motion, logs, &mut findings).await,
        Err(error) => Err(error),
    };
    let motion = note(motion, Role::Robot, &mut findings);
    let environment = match open_air_sensor(config, ports).await {
        Ok(None) => None,
        Ok(Some(mut sensor)) => {
            note(check_air(&mut *sensor).await, Role::Environment, &mut findings)
        }
        Err(error) => note(Err(error), Role::Environment, &mut findings),
    };
    CheckReport { focus_array, receiver, motion, environment, findings }
}

async fn check_air(sensor: &mut dyn AirSensor) -> Result<AirCheck, RigError> {
    let air = sensor.air().await?;
    Ok(AirCheck { port: sensor.device().port.clone(), air })
}

fn note<T>(result: Result<T, RigError>, role: Role, findings: &mut Vec<Finding>) -> Option<T> {
    result.map_err(|error| findings.push(Finding::fault(role, &error))).ok()
}

async fn check_array(
    array: &mut dyn FocusArray,
    elements: usize,
    logs: Option<&WireLogs>,
    findings: &mut Vec<Finding>,
) -> Result<ArrayCheck, RigError> {
    let mut times = Vec::with_capacity(QUERIES);
    for _ in 0..QUERIES {
        let start = Instant::now();
        recorded(logs, &Call::Silence, array.silence()).await?;
        times.push(start.elapsed());
    }
    let identity = array.identity().clone();
    if identity.elements != elements {
        findings.push(Finding {
            device: Role::FocusArray,
            severity: Severity::Fault,
            problem: format!(
                "the controller has {} elements, and the rig file describes {elements}",
                identity.elements
            ),
            remedy: "describe the connected array under [array] in the rig file".to_owned(),
        });
    }
    let latency = Latency::of(times);
    if identity.acknowledges {
        latency.judge(Role::FocusArray, findings);
    } else {
        findings.push(Finding {
            device: Role::FocusArray,
            severity: Severity::Warning,
            problem: "this controller never answers, so its commands cannot be confirmed".to_owned(),
            remedy: "hold the receiver over the array: readings with emission must differ from dark readings"
                .to_owned(),
        });
    }
    Ok(ArrayCheck { port: array.device().port.clone(), identity, latency })
}

async fn check_receiver(
    receiver: &mut dyn Receiver,
    count: usize,
    logs: Option<&WireLogs>,
    findings: &mut Vec<Finding>,
) -> Result<ReceiverCheck, RigError> {
    let mut read = async |count: usize| {
        let call = Call::ReadPoint { settle: Duration::ZERO, count };
        recorded(logs, &call, receiver.read_point(Duration::ZERO, count)).await
    };
    let mut times = Vec::with_capacity(QUERIES);
    let mut singles = Vec::with_capacity(QUERIES);
    for _ in 0..QUERIES {
        let start = Instant::now();
        let reading = read(1).await?;
        times.push(start.elapsed());
        singles.push(TimedValue { t_s: reading.first_t_s, value: reading.mean });
    }
    let mut means = Vec::with_capacity(MEANS);
    for _ in 0..MEANS {
        let reading = read(count).await?;
        means.push(TimedValue { t_s: reading.first_t_s, value: reading.mean });
    }
    let silent = read(NOISE_READINGS).await?;
    let identity = receiver.identity().clone();
    let measured_rate_hz = measured_rate_hz(&silent).filter(|_| identity.own_clock);
    findings.extend(receiver_findings(&identity, &silent, measured_rate_hz));
    let noise = Noise::of(&means, count, silent.std, &singles);
    findings.extend(noise.findings(&identity.unit).into_iter().map(|(problem, remedy)| Finding {
        device: Role::Receiver,
        severity: Severity::Warning,
        problem,
        remedy: remedy.to_owned(),
    }));
    let latency = Latency::of(times);
    latency.judge(Role::Receiver, findings);
    let port = receiver.device().port.clone();
    Ok(ReceiverCheck { port, identity, measured_rate_hz, silent, noise, latency })
}

async fn check_motion(
    motion: &mut dyn Motion,
    logs: Option<&WireLogs>,
    findings: &mut Vec<Finding>,
) -> Result<MotionCheck, RigError> {
    let mut times = Vec::with_capacity(QUERIES);
    let first = recorded(logs, &Call::Position, motion.position()).await?;
    let mut position = first;
    let mut wanders_m = 0.0_f64;
    for _ in 0..QUERIES {
        // The driver's own pause is no latency of the link.
        sleep(motion.query_pause()).await;
        let start = Instant::now();
        position = recorded(logs, &Call::Position, motion.position()).await?;
        times.push(start.elapsed());
        wanders_m = wanders_m.max(first.largest_axis_difference_m(position));
    }
    let latency = Latency::of(times);
    latency.judge(Role::Robot, findings);
    if wanders_m > 0.0 {
        findings.push(Finding {
            device: Role::Robot,
            severity: Severity::Warning,
            problem: format!(
                "the reported position changes by {:.3} mm while the robot is not commanded to move",
                wanders_m * 1e3
            ),
            remedy: "check that nobody jogs the robot, that no other program drives it, and that its encoders work"
                .to_owned(),
        });
    }
    findings.extend(motion.advice().iter().map(|advice| Finding {
        device: Role::Robot,
        severity: Severity::Warning,
        problem: advice.problem.clone(),
        remedy: advice.remedy.to_owned(),
    }));
    Ok(MotionCheck {
        port: motion.device().port.clone(),
        firmware: motion.firmware().to_owned(),
        position_mm: position.axes_mm(),
        latency,
    })
}

/// Samples a second between the first and the last reading. Lost ones would make it too low, so none may be lost.
fn measured_rate_hz(reading: &Reading) -> Option<f64> {
    let span_s = reading.last_t_s - reading.first_t_s;
    (reading.gaps == 0 && span_s > 0.0).then(|| (reading.count - 1) as f64 / span_s)
}

fn receiver_findings(
    identity: &ReceiverIdentity,
    silent: &Reading,
    measured_rate_hz: Option<f64>,
) -> Vec<Finding> {
    let unit = &identity.unit;
    let warn = |problem: String, remedy: &str| Finding {
        device: Role::Receiver,
        severity: Severity::Warning,
        problem,
        remedy: remedy.to_owned(),
    };
    let mut findings = Vec::new();
    if silent.gaps > 0 {
        findings.push(warn(
            format!("{} samples of {} were lost", silent.gaps, silent.count + silent.gaps as usize),
            "lower the sampling rate or raise the baud rate; keep the cable away from the motor cables",
        ));
    }
    if silent.clipped {
        findings.push(warn(
            format!(
                "the receiver clips at {} {unit} although the array is silent",
                identity.full_scale
            ),
            "lower the gain; look for another source of ultrasound or a loose wire",
        ));
    }
    if silent.std > NOISY * identity.full_scale {
        findings.push(warn(
            format!(
                "the noise is {:.4} {unit}, {:.0} % of full scale",
                silent.std,
                100.0 * silent.std / identity.full_scale
            ),
            "shield the cable, lower the gain, look for another source of ultrasound",
        ));
    }
    if silent.std == 0.0 {
        findings.push(warn(
            format!("all readings are {} {unit}", silent.mean),
            "a working receiver has noise: check that the sensor is connected to its converter",
        ));
    }
    if let Some(rate_hz) = measured_rate_hz
        && (rate_hz / identity.rate_hz - 1.0).abs() > RATE_TOLERANCE
    {
        findings.push(warn(
            format!(
                "the receiver samples at {rate_hz:.1} Hz but states {:.1} Hz",
                identity.rate_hz
            ),
            "correct the stated rate: settling times are counted in samples",
        ));
    }
    findings
}

impl Finding {
    fn fault(device: Role, error: &RigError) -> Self {
        Self {
            device,
            severity: Severity::Fault,
            problem: error.to_string(),
            remedy: error.remedy().to_owned(),
        }
    }
}

impl CheckReport {
    /// Whether a scan is possible.
    pub fn can_scan(&self) -> bool {
        self.findings.iter().all(|finding| finding.severity != Severity::Fault)
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(ArrayCheck { port, identity, latency }) = &self.focus_array {
            writeln!(
                f,
                "focus array  {port}: {}, {} elements, clock {:.2} MHz, {} steps a period",
                identity.name,
                identity.elements,
                identity.clock_hz * 1e-6,
                identity.period_steps
            )?;
            writeln!(f, "             replies in {latency}")?;
        }
        if let Some(ReceiverCheck { port, identity, measured_rate_hz, silent, noise, latency }) =
            &self.receiver
        {
            let unit = &identity.unit;
            writeln!(
                f,
                "receiver     {port}: {:.1} Hz, full scale {} {unit}",
                identity.rate_hz, identity.full_scale
            )?;
            if let Some(rate_hz) = measured_rate_hz {
                writeln!(f, "             measured rate {rate_hz:.1} Hz")?;
            }
            writeln!(
                f,
                "             array silent: {:.5} {unit} ± {:.5} {unit} over {} readings, {} lost",
                silent.mean, silent.std, silent.count, silent.gaps
            )?;
            writeln!(
                f,
                "             means of a point scatter by {:.5} {unit} (white noise: {:.5} {unit})",
                noise.of_means, noise.of_means_if_white
            )?;
            writeln!(f, "             a reading in {latency}")?;
        }
        if let Some(MotionCheck { port, firmware, position_mm: [x, y, z], latency }) = &self.motion
        {
            writeln!(f, "robot        {port}: {firmware}")?;
            writeln!(f, "             says ({x:.2}, {y:.2}, {z:.2}) mm; replies in {latency}")?;
        }
        if let Some(AirCheck { port, air }) = &self.environment {
            write!(f, "environment  {port}: {:.1} °C", air.temperature_c)?;
            if let Some(percent) = air.humidity_percent {
                write!(f, ", {percent:.0} %")?;
            }
            if let Some(kpa) = air.pressure_kpa {
                write!(f, ", {kpa:.1} kPa")?;
            }
            writeln!(f)?;
        }
        for finding in &self.findings {
            let mark = match finding.severity {
                Severity::Fault => "fault",
                Severity::Warning => "warning",
            };
            writeln!(f, "{mark}: {}: {}\n  {}", finding.device, finding.problem, finding.remedy)?;
        }
        if self.findings.is_empty() {
            writeln!(f, "all is well")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity() -> ReceiverIdentity {
        ReceiverIdentity {
            rate_hz: 1000.0,
            full_scale: 5.0,
            unit: "V".into(),
            own_clock: true,
            phase: false,
        }
    }

    fn reading() -> Reading {
        Reading {
            mean: 0.01,
            phase_rad: None,
            std: 0.002,
            count: 201,
            clipped: false,
            gaps: 0,
            first_t_s: 2.0,
            last_t_s: 2.2,
        }
    }

    fn problems(reading: &Reading) -> String {
        let findings = receiver_findings(&identity(), reading, measured_rate_hz(reading));
        findings.into_iter().map(|finding| finding.problem + "\n").collect()
    }

    #[test]
    fn the_rate_is_taken_from_the_receivers_own_time() {
        assert!((measured_rate_hz(&reading()).expect("no gaps") - 1000.0).abs() < 1e-6);
        assert_eq!(measured_rate_hz(&Reading { gaps: 1, ..reading() }), None);
        assert_eq!(measured_rate_hz(&Reading { count: 1, last_t_s: 2.0, ..reading() }), None);
    }

    #[test]
    fn a_good_receiver_gives_no_finding_and_each_fault_one() {
        assert_eq!(problems(&reading()), "");
        assert!(
            problems(&Reading { gaps: 3, ..reading() }).starts_with("3 samples of 204 were lost")
        );
        assert!(problems(&Reading { clipped: true, ..reading() }).contains("clips at 5 V"));
        assert!(problems(&Reading { std: 0.5, ..reading() }).contains("10 % of full scale"));
        assert!(problems(&Reading { std: 0.0, ..reading() }).contains("all readings are 0.01 V"));
        assert!(problems(&Reading { last_t_s: 2.25, ..reading() }).contains("samples at 800.0 Hz"));
    }
}
