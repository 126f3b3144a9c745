//! A virtual rig: device firmware on pseudo-terminals, and the physics of array, air, robot and receiver behind it.
//!
//! Drivers and other serial programs, such as G-code senders, talk to the virtual devices as to real ones. The robot needs time
//! for its moves, the array's controller sets delays, and the receiver reads the field at the true position of the nozzle at
//! that instant of virtual time ([`Clock`]). No simulator takes part: every element's vibrating face is summed by its Rayleigh
//! integral, or radiates as its transducer file states. The [truth file](Truth) describes the real array, air and robot, and the
//! [`effects`] by which they differ from the assumed ones.
//!
//! ```text
//!  clock ── robot's firmware ─ trajectory ─┐
//!    │                                     ├─ world ── true_field ── effects
//!    ├───── array_firmware ──── drive ─────┤
//!    │         └─ elements as receivers ───┤── gestures
//!    └───── receiver_firmware ── converter ┘
//! ```
//!
//! Types to begin with:
//!
//! - [`VirtualRig`] runs the devices; [`VirtualConfig`] is the section `[virtual]` of a rig file.
//! - [`World`] gives the true position of the nozzle and the true signal, for tests.
//! - [`memory::MemoryRig`] runs without pseudo-terminals, in paused time.
//! - [`firmware::Firmware`] is the interface of a device: bytes in, bytes out.
//! - [`noise_free_readings`] gives readings without noise and without a robot, as the reference for a forward model:
//!
//! ```
//! use fieldgap_acoustics::{Array, Excitation, Medium, Simulation, Simulator, Vec3};
//! use fieldgap_virtual_rig::{Visit, noise_free_readings};
//!
//! let focus_m = Vec3::new(0.0, 0.0, 0.1);
//! let setup = Simulation {
//!     simulator: Simulator::Rayleigh,
//!     array: Array::square(6, 6, 10.5e-3)?,
//!     medium: Medium { speed_of_sound_m_s: 343.0 },
//!     frequency_hz: 40e3,
//!     excitation: Excitation::Focus(focus_m),
//! };
//! let visits = [Visit { position_m: focus_m, velocity_m_s: Vec3::zeros(), time_s: 0.0 }];
//! let two_silent = toml::toml! { dead-elements = { elements = [14, 15] } };
//! let whole_v = noise_free_readings(&setup, &toml::Table::new(), 1.0, &visits, 1)?[0];
//! let without_two_v = noise_free_readings(&setup, &two_silent, 1.0, &visits, 1)?[0];
//! assert!(without_two_v < whole_v);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod air_firmware;
mod answers;
mod array_boards;
pub mod array_firmware;
mod board;
pub mod cipher;
mod clock;
mod config;
mod converter;
pub mod counter_rng;
pub mod drive;
pub mod effects;
pub mod face_motion;
mod faults;
pub mod firmware;
mod gantry;
pub mod gestures;
mod grbl_firmware;
mod marlin_firmware;
pub mod memory;
mod noise_free;
mod pin_firmware;
mod planner;
mod pty;
mod radiator;
mod receiver_firmware;
pub mod rigid_sphere;
mod robot;
mod scope_firmware;
pub mod sealed_truth;
mod shadow;
mod tcp_bridge;
#[cfg(test)]
mod testing;
pub mod trajectory;
pub mod true_field;
pub mod truth;
mod world;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

use nalgebra::Vector3;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio_util::sync::CancellationToken;

use air_firmware::AirFirmware;
pub use answers::{AnswerSettings, AnswerTiming, Pause, SliceBytes};
use board::{Order, WireFaults};
pub use clock::{Clock, Pace};
pub use config::VirtualConfig;
pub use faults::{Fault, LineFault};
use fieldgap_acoustics::{Array, Medium};
use fieldgap_rig::{Frame, Ports, Role};
use firmware::Firmware;
pub use noise_free::{
    Visit, elements_with, noise_free_coded_phasors, noise_free_coded_readings, noise_free_readings,
};
use pty::PseudoTerminal;
use receiver_firmware::Mode;
use robot::RobotSettings;
pub use shadow::RobotShadow;
use trajectory::Trajectory;
pub use truth::Truth;
pub use world::{Believed, World};

/// Longest wait for an injected fault to happen, wall time.
const FAULT_TIMEOUT: Duration = Duration::from_secs(5);

/// Why a virtual rig does not open.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum VirtualRigError {
    /// The truth file cannot be used.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Truth(#[from] fieldgap_input::Fault),
    /// A free-running receiver whose time is not the computer's.
    #[error(
        "the samples of a free-running receiver are tied to the computer's time, which must be that of the virtual rig. Set \
         `pace = {{ times = 1.0 }}` in [virtual], or `mode = \"stream\"` in [virtual.receiver]"
    )]
    FreeRunningPace,
    /// The system gave no pseudo-terminal.
    #[error(
        "no pseudo-terminal for the virtual {device}: {source}. The system's limit is in \
         /proc/sys/kernel/pty/max; close other programs to free some"
    )]
    PseudoTerminal {
        /// The device.
        device: &'static str,
        /// The system's error.
        source: tokio_serial::Error,
    },
    /// The system gave no thread or event loop.
    #[error("cannot start the virtual rig's thread: {0}")]
    Thread(#[from] std::io::Error),
}

/// One of the three devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The robot.
    Robot,
    /// The receiver.
    Receiver,
    /// The array's controller.
    Array,
}

/// A virtual rig that runs until it is dropped.
pub struct VirtualRig {
    ports: Ports,
    world: Arc<World>,
    clock: Arc<Clock>,
    orders: [UnboundedSender<Order>; 3],
    homing_jam: Arc<AtomicBool>,
    robot: RobotSettings,
    stop: CancellationToken,
    thread: Option<JoinHandle<()>>,
}

impl VirtualRig {
    /// Powers the rig up. Its ports can be opened when this returns.
    ///
    /// `folder` is that of the rig file; the path of the truth file is relative to it. Array, medium, carrier and frame are the
    /// assumed ones, which the effects of the truth file change.
    ///
    /// # Errors
    /// See [`VirtualRigError`].
    pub fn open(
        config: &VirtualConfig,
        folder: &Path,
        array: &Array,
        medium: Medium,
        frequency_hz: f64,
        frame: Frame,
    ) -> Result<Self, VirtualRigError> {
        let truth = Truth::read(&config.truth_path(folder))?;
        let believed =
            Believed { array: array.clone(), medium, frequency_hz, array_origin_m: frame.origin_m };
        Self::with_truth(config, truth, &believed)
    }

    /// As [`VirtualRig::open`], with a truth that is read already.
    ///
    /// # Errors
    /// See [`VirtualRigError`].
    pub fn with_truth(
        config: &VirtualConfig,
        truth: Truth,
        believed: &Believed,
    ) -> Result<Self, VirtualRigError> {
        if config.receiver.mode.runs_freely() && !config.runs_in_real_time() {
            return Err(VirtualRigError::FreeRunningPace);
        }
        let clock = Arc::new(Clock::new(config.pace));
        let homing_jam = Arc::new(AtomicBool::new(false));
        let (devices, world) = Devices::new(config, truth, believed, &clock, &homing_jam)?;

        let (robot_orders, robot) = unbounded_channel();
        let (receiver_orders, receiver) = unbounded_channel();
        let (array_orders, array) = unbounded_channel();
        let stop = CancellationToken::new();
        let (opened, wait_for_ports) = mpsc::sync_channel(1);
        let thread = std::thread::Builder::new().name("virtual-rig".to_owned()).spawn({
            let (clock, stop) = (clock.clone(), stop.clone());
            let wire_faults = WireFaults::of(config);
            move || run(devices, [robot, receiver, array], wire_faults, &clock, &stop, &opened)
        })?;
        let ports = wait_for_ports.recv().unwrap_or_else(|_| {
            Err(VirtualRigError::Thread(std::io::Error::other(
                "it ended before its ports were open",
            )))
        })?;
        Ok(Self {
            ports,
            world,
            clock,
            orders: [robot_orders, receiver_orders, array_orders],
            homing_jam,
            robot: config.robot,
            stop,
            thread: Some(thread),
        })
    }

    /// The paths to open.
    pub fn ports(&self) -> Ports {
        self.ports.clone()
    }

    /// Leaves the devices of these roles to real ones: their ports are not given. Virtual time must then be the computer's
    /// ([`VirtualConfig::runs_in_real_time`]), and a virtual receiver needs the virtual array.
    pub fn beside_real(mut self, roles: &[Role]) -> Self {
        for role in roles {
            match role {
                Role::Robot => self.ports.motion = None,
                Role::Receiver => self.ports.receiver = None,
                Role::FocusArray => self.ports.focus_array = None,
                Role::Environment => self.ports.environment = None,
            }
        }
        self
    }

    /// Follows a real robot, so that the virtual receiver is where that reports to be; `None` if the robot is virtual.
    pub fn robot_shadow(&self) -> Option<RobotShadow> {
        self.ports.motion.is_none().then(|| RobotShadow {
            trajectory: self.world.trajectory(),
            clock: self.clock.clone(),
            acceleration_mm_s2: self.robot.acceleration_mm_s2(),
            zero_mm: Vector3::from(self.robot.zero_mm()),
        })
    }

    /// The rig's time.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The true set-up, for tests that compare it with measurements.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Injects a fault into a device, and waits until it has happened.
    ///
    /// Returns false if it does not happen: the device is unplugged, or blocked by output that nobody reads.
    pub fn inject(&self, part: Part, fault: Fault) -> bool {
        let (done, wait) = mpsc::sync_channel(1);
        self.orders[part as usize].send(Order { fault, done }).is_ok()
            && wait.recv_timeout(FAULT_TIMEOUT).is_ok()
    }

    /// Makes every homing of the robot fail from now on, as with a broken switch, or succeed again.
    pub fn jam_homing(&self, jammed: bool) {
        self.homing_jam.store(jammed, Ordering::Relaxed);
    }
}

impl Drop for VirtualRig {
    fn drop(&mut self) {
        self.stop.cancel();
        if let Some(thread) = self.thread.take() {
            // A panic in the thread was reported when it happened.
            let _ = thread.join();
        }
    }
}

struct Devices {
    robot: Box<dyn Firmware>,
    receiver: Box<dyn Firmware>,
    environment: Option<AirFirmware>,
    receiver_has_socket: bool,
    array: Box<dyn Firmware>,
}

impl Devices {
    /// The devices and their world.
    fn new(
        config: &VirtualConfig,
        truth: Truth,
        believed: &Believed,
        clock: &Arc<Clock>,
        homing_jam: &Arc<AtomicBool>,
    ) -> Result<(Self, Arc<World>), VirtualRigError> {
        let parked_mm = Vector3::from(config.robot.parked_mm().map(f64::from));
        let travel_mm = Vector3::from(config.robot.travel_mm().map(f64::from));
        let trajectory = Arc::new(Mutex::new(Trajectory::new(parked_mm, travel_mm)));
        // The world's coordinates begin at the switches, the rig file's at the robot's zero.
        let mut believed = believed.clone();
        believed.array_origin_m += Vector3::from(config.robot.zero_mm()) * 1e-3;
        let believed = &believed;
        let world = World::new(believed, truth, config.seed, trajectory.clone(), clock.clone())?;
        let world = Arc::new(world);
        let devices = Self {
            robot: config.robot.firmware(trajectory, homing_jam.clone()),
            receiver: receiver_firmware::of(config.receiver, world.clone()),
            environment: config.environment.map(AirFirmware::new),
            receiver_has_socket: config.receiver.mode == Mode::Scpi,
            array: array_boards::firmware(
                &config.array,
                believed.array.len(),
                believed.frequency_hz,
                world.clone(),
            ),
        };
        Ok((devices, world))
    }
}

/// The rig's thread: opens the ports, reports them, and runs the devices until `stop`.
fn run(
    devices: Devices,
    orders: [UnboundedReceiver<Order>; 3],
    wire_faults: [WireFaults; 4],
    clock: &Arc<Clock>,
    stop: &CancellationToken,
    opened: &mpsc::SyncSender<Result<Ports, VirtualRigError>>,
) {
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return drop(opened.send(Err(error.into()))),
    };
    runtime.block_on(async {
        let wire = |device| {
            PseudoTerminal::open()
                .map_err(|source| VirtualRigError::PseudoTerminal { device, source })
        };
        let wires = wire("robot")
            .and_then(|robot| Ok((robot, wire("receiver")?, wire("array controller")?)));
        let (robot, receiver, array) = match wires {
            Ok(wires) => wires,
            Err(error) => return drop(opened.send(Err(error))),
        };
        let environment =
            devices.environment.map(|firmware| Ok((firmware, wire("environment sensor")?)));
        let environment = match environment.transpose() {
            Ok(environment) => environment,
            Err(error) => return drop(opened.send(Err(error))),
        };
        let socket = match devices.receiver_has_socket {
            true => match tcp_bridge::listen().await {
                Ok(socket) => Some(socket),
                Err(error) => return drop(opened.send(Err(error.into()))),
            },
            false => None,
        };
        let address = socket.as_ref().map(|(_, address)| address.clone());
        let ports = Ports {
            motion: Some(robot.path().to_owned()),
            receiver: Some(address.unwrap_or_else(|| receiver.path().to_owned())),
            focus_array: Some(array.path().to_owned()),
            environment: environment.as_ref().map(|(_, wire)| wire.path().to_owned()),
        };
        if opened.send(Ok(ports)).is_err() {
            return;
        }
        let [robot_orders, receiver_orders, array_orders] = orders;
        let [faults_1, faults_2, faults_3, faults_4] = wire_faults;
        let shared = || (clock.clone(), stop.clone());
        if let Some((listener, _)) = socket {
            let bridge = tcp_bridge::serve(listener, receiver.path().to_owned(), stop.clone());
            tokio::spawn(bridge);
        }
        let (clock_1, stop_1) = shared();
        let (clock_2, stop_2) = shared();
        let (clock_3, stop_3) = shared();
        // No faults are injected into the air sensor.
        let (_, no_orders) = unbounded_channel();
        let air = async {
            if let Some((firmware, wire)) = environment {
                let shared = (clock.clone(), no_orders, stop.clone());
                board::run(firmware, wire, faults_4, shared.0, shared.1, shared.2).await;
            }
        };
        tokio::join!(
            air,
            board::run(devices.robot, robot, faults_1, clock_1, robot_orders, stop_1),
            board::run(devices.receiver, receiver, faults_2, clock_2, receiver_orders, stop_2),
            board::run(devices.array, array, faults_3, clock_3, array_orders, stop_3),
        );
    });
}
