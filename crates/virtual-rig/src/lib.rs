//! A laboratory without hardware: firmware on three pseudo-terminals, and physics behind the receiver.
//!
//! The robot plans and runs moves that take their time, the array controller sets delays, and the receiver
//! hears the field where the nozzle really is at that instant of [virtual time](clock). The field is not the
//! simulator's: every element's vibrating face is summed by its Rayleigh integral, or radiates as its transducer file has it,
//! in the air, with the array and on the robot that the [truth file](truth) describes.
//!
//! ```text
//!  clock ── robot's firmware ─ trajectory ─┐
//!    │                                     ├─ world ── true_field ── effects
//!    ├───── array_firmware ──── drive ─────┤
//!    │            └─ listens ── hand ──────┤
//!    └───── receiver_firmware ── converter ┘
//! ```
//! Firmware is [bytes in, bytes out](firmware), and a board puts it behind a pseudo-terminal, so drivers
//! talk to it as they would to the real device, and so does anybody's G-code sender.

pub mod air_firmware;
pub mod array_boards;
pub mod array_firmware;
mod board;
pub mod cipher;
pub mod clock;
pub mod config;
pub mod converter;
pub mod drive;
pub mod effects;
pub mod faults;
pub mod firmware;
pub mod grbl_firmware;
pub mod hand;
pub mod luck;
pub mod marlin_firmware;
pub mod memory;
mod noise_free;
pub mod pin_firmware;
pub mod planner;
mod pty;
mod radiator;
pub mod receiver_firmware;
pub mod robot;
pub mod scope_firmware;
pub mod sealed_truth;
mod tcp_bridge;
#[cfg(test)]
mod testing;
pub mod trajectory;
pub mod true_field;
pub mod truth;
pub mod world;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

use nalgebra::Vector3;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio_util::sync::CancellationToken;

use air_firmware::AirFirmware;
use board::{Order, WireTrouble};
pub use clock::{Clock, Pace};
pub use config::VirtualConfig;
pub use faults::{Fault, LineFault};
use fieldgap_acoustics::{Array, Medium};
use fieldgap_rig::{Frame, Ports};
use firmware::Firmware;
pub use noise_free::{Visit, noise_free_readings};
use pty::PseudoTerminal;
use receiver_firmware::Mode;
use trajectory::Trajectory;
pub use truth::Truth;
pub use world::{Believed, World};

/// How long an injected fault may take to happen, wall time.
const FAULT_TIMEOUT: Duration = Duration::from_secs(5);

/// Why a virtual rig does not open.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum VirtualRigError {
    /// The truth file cannot be used.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Truth(#[from] fieldgap_input::Fault),
    /// Two settings contradict each other.
    #[error(
        "a free-running receiver needs time that passes by itself; in lockstep it stands still. Set \
         `pace = {{ times = 20.0 }}` in [virtual], or `mode = \"stream\"` in [virtual.receiver]"
    )]
    FreeRunningInLockstep,
    /// The system gave no pseudo-terminal.
    #[error(
        "no pseudo-terminal for the virtual {device}: {source}. The system's limit is in \
         /proc/sys/kernel/pty/max; closing other programs may free some"
    )]
    PseudoTerminal {
        /// Which device it was for.
        device: &'static str,
        /// What the system said.
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
    stop: CancellationToken,
    thread: Option<JoinHandle<()>>,
}

impl VirtualRig {
    /// Powers the rig up; its ports can be opened when this returns.
    ///
    /// `folder` is the rig file's, from which the path of the truth file is taken; array, medium, carrier and frame are
    /// what the laboratory believes, and what the truth's effects start from.
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

    /// As [`VirtualRig::open`], with a truth that was read before.
    ///
    /// # Errors
    /// See [`VirtualRigError`].
    pub fn with_truth(
        config: &VirtualConfig,
        truth: Truth,
        believed: &Believed,
    ) -> Result<Self, VirtualRigError> {
        if config.receiver.mode.runs_freely() && config.pace == Pace::Lockstep {
            return Err(VirtualRigError::FreeRunningInLockstep);
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
            let trouble = [0, 1, 2, 3].map(|n| WireTrouble::new(config.faults, config.seed, n));
            move || run(devices, [robot, receiver, array], trouble, &clock, &stop, &opened)
        })?;
        let ports = wait_for_ports.recv().unwrap_or_else(|_| {
            Err(VirtualRigError::Thread(std::io::Error::other("it ended before it had begun")))
        })?;
        Ok(Self {
            ports,
            world,
            clock,
            orders: [robot_orders, receiver_orders, array_orders],
            homing_jam,
            stop,
            thread: Some(thread),
        })
    }

    /// The paths to open.
    pub fn ports(&self) -> Ports {
        self.ports.clone()
    }

    /// The rig's time.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// What is true of nozzle and field, for tests that compare it with what was measured.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Lets a fault happen to a device; returns when it has.
    ///
    /// Returns whether it has: a device that was unplugged, or that is stuck on output which nobody reads, does
    /// not obey.
    pub fn inject(&self, part: Part, fault: Fault) -> bool {
        let (done, wait) = mpsc::sync_channel(1);
        self.orders[part as usize].send(Order { fault, done }).is_ok()
            && wait.recv_timeout(FAULT_TIMEOUT).is_ok()
    }

    /// Lets every homing of the robot fail from now on, as with a broken switch, or succeed again.
    pub fn jam_homing(&self, jammed: bool) {
        self.homing_jam.store(jammed, Ordering::Relaxed);
    }
}

impl Drop for VirtualRig {
    fn drop(&mut self) {
        self.stop.cancel();
        if let Some(thread) = self.thread.take() {
            // It has nothing to tell: a panic in it was reported when it happened.
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
    /// The three, in a world of their own.
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
        // The world counts from the switches, the laboratory from the robot's zero.
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

/// The rig's thread: opens the ports, says which they are, and runs the three devices until it is told to stop.
fn run(
    devices: Devices,
    orders: [UnboundedReceiver<Order>; 3],
    trouble: [WireTrouble; 4],
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
        let [trouble_1, trouble_2, trouble_3, trouble_4] = trouble;
        let shared = || (clock.clone(), stop.clone());
        if let Some((listener, _)) = socket {
            let bridge = tcp_bridge::serve(listener, receiver.path().to_owned(), stop.clone());
            tokio::spawn(bridge);
        }
        let (clock_1, stop_1) = shared();
        let (clock_2, stop_2) = shared();
        let (clock_3, stop_3) = shared();
        // Nobody injects faults into the air.
        let (_, no_orders) = unbounded_channel();
        let air = async {
            if let Some((firmware, wire)) = environment {
                let shared = (clock.clone(), no_orders, stop.clone());
                board::run(firmware, wire, trouble_4, shared.0, shared.1, shared.2).await;
            }
        };
        tokio::join!(
            air,
            board::run(devices.robot, robot, trouble_1, clock_1, robot_orders, stop_1),
            board::run(devices.receiver, receiver, trouble_2, clock_2, receiver_orders, stop_2),
            board::run(devices.array, array, trouble_3, clock_3, array_orders, stop_3),
        );
    });
}
