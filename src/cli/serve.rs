//! `fieldgap serve`: the rig in a browser.

use std::any::Any;
use std::net::{AddrParseError, SocketAddr};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Args, Subcommand};
use miette::{IntoDiagnostic, miette};

use super::exposure::Foreseen;
use super::output::{print, say};
use super::serve_user::{ServeUser, UserFileArg};
use super::settings::settings_folder;
use super::sounding::{Sounds, is_heard};
use super::stop::StopRequests;
use super::watchdog::guard_devices;
use crate::rig_file::RigFile;
use fieldgap_acoustics::Excitation;
use fieldgap_acquisition::{PlannedScan, RigSetup};
use fieldgap_rig::{DeviceSelection, ManualRig};
use fieldgap_serve::{
    Bench, CameraAddress, Exposing, Foresight, HandRig, Identity, Opening, Reach, Role, Server,
};
use fieldgap_virtual_rig::VirtualRig;

/// The `serve` command.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct Serve {
    #[command(subcommand)]
    task: Option<Task>,
    /// Rig file
    #[arg(required = true)]
    rig: Option<PathBuf>,
    /// Port on this computer; 0 takes any that is free
    #[arg(long, value_name = "PORT", default_value_t = USUAL_PORT)]
    port: u16,
    /// Let other computers in, encrypted, at this address of this computer (0.0.0.0: all addresses); it takes users, see `serve user add`
    #[arg(long, value_name = "ADDRESS[:PORT]", value_parser = address, conflicts_with = "port")]
    listen: Option<SocketAddr>,
    #[command(flatten)]
    network: Network,
    /// Folder of the plans
    #[arg(long, value_name = "DIR", default_value = "scans")]
    plans: PathBuf,
    /// Folder of the records, and of the audit log
    #[arg(long, value_name = "DIR", default_value = "out")]
    records: PathBuf,
    /// Page or MJPEG stream of a camera beside the rig, shown in the view of the rig
    #[arg(long, value_name = "ADDRESS")]
    camera: Option<CameraAddress>,
}

/// How other computers reach this one.
#[derive(Debug, Args)]
struct Network {
    /// Name of this computer in its network; may be repeated [default: its own name, also with .local]
    #[arg(long, value_name = "NAME", requires = "listen")]
    host_name: Vec<String>,
    /// Certificate for these names, PEM [default: a self-signed one, made at the first start]
    #[arg(long, value_name = "FILE", requires_all = ["listen", "key"])]
    certificate: Option<PathBuf>,
    /// Private key of the certificate, PEM
    #[arg(long, value_name = "FILE", requires = "certificate")]
    key: Option<PathBuf>,
    #[command(flatten)]
    users: UserFileArg,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Add, list or remove the users who may log in from other computers
    User(ServeUser),
}

/// The port unless another is chosen.
const USUAL_PORT: u16 = 8321;

fn address(text: &str) -> Result<SocketAddr, String> {
    let address = text.parse().or_else(|_| Ok(SocketAddr::new(text.parse()?, USUAL_PORT)));
    address.map_err(|error: AddrParseError| format!("{error}: name an address of this computer, such as 0.0.0.0 or 192.168.1.20:{USUAL_PORT}"))
}

impl Network {
    /// What is needed to let others in.
    fn open(self, address: SocketAddr) -> miette::Result<Reach> {
        let mut names = self.host_name;
        if names.is_empty() {
            let own = rustix::system::uname().nodename().to_string_lossy().into_owned();
            names.extend([own.clone(), format!("{own}.local")]);
        }
        let identity = match (self.certificate, self.key) {
            (Some(certificate), Some(key)) => Identity::read(&certificate, &key),
            _ => {
                let folder = settings_folder().ok_or_else(|| {
                    miette!(
                        help = "set HOME, or give --certificate and --key",
                        "there is no folder of settings to keep a certificate in"
                    )
                })?;
                let mut certified = names.clone();
                certified.push("localhost".to_owned());
                if !address.ip().is_unspecified() {
                    certified.push(address.ip().to_string());
                }
                Identity::self_signed(&folder, &certified)
            }
        }
        .into_diagnostic()?;
        say(format!(
            "the certificate has this SHA-256 fingerprint; a browser shows the same, or it talks to another computer:\n{}",
            identity.fingerprint()
        ));
        Ok(Reach::Others { address, names, identity, users: self.users.path()? })
    }
}

impl Serve {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let path = match (self.task, self.rig) {
            (Some(Task::User(user)), _) => return user.run(),
            (None, Some(rig)) => rig,
            (None, None) => return Err(miette!("no rig file was named")),
        };
        let rig_file = RigFile::read(&path)?;
        rig_file.check_truth()?;
        let reach = match self.listen {
            Some(address) => self.network.open(address)?,
            None => Reach::ThisComputer { port: self.port },
        };
        let bench = Bench {
            setup: rig_file.setup,
            rig: path.clone(),
            plans: self.plans,
            records: self.records,
            camera: self.camera,
            program: std::env::current_exe().into_diagnostic()?,
            open: Box::new(move || opening(path.clone())),
            exposing: Arc::new(ToPeople),
        };
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        let scan_goes_on = runtime.block_on(async {
            let stop = StopRequests::listen().into_diagnostic()?;
            let server = Server::bind(bench, reach).await.map_err(|error| {
                let help = error.remedy();
                miette!(help = help, "{error}")
            })?;
            print(&format!("{}\n", server.link("desk", Role::Admin)))?;
            say("open this address in a browser; it logs in once, within 15 minutes. Ctrl-C ends the server.");
            Ok::<_, miette::Report>(server.run(async { let _ = stop.first().await; }).await)
        })?;
        // A browser that stays connected must not keep the program.
        runtime.shutdown_background();
        if scan_goes_on {
            say("the scan goes on without the server; `fieldgap rig stop` stops it");
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// The exposure of people, as on the command line.
struct ToPeople;

impl Exposing for ToPeople {
    fn by_scan(&self, scan: &PlannedScan) -> Result<Option<Foresight>, String> {
        foresight(Foreseen::of_scan(scan), scan.rig_setup())
    }

    fn by_drives(
        &self,
        setup: &RigSetup,
        drives: &[Excitation],
        seconds: Option<f64>,
    ) -> Result<Option<Foresight>, String> {
        foresight(Foreseen::of_drives(setup, drives, seconds), setup)
    }

    fn sounds(&self, setup: &RigSetup) -> Box<dyn Any + Send> {
        Box::new(Sounds::begin(setup, "serve"))
    }
}

fn foresight(
    foreseen: miette::Result<Option<Foreseen>>,
    setup: &RigSetup,
) -> Result<Option<Foresight>, String> {
    let foreseen = foreseen.map_err(|error| error.to_string())?;
    Ok(foreseen.map(|foreseen| Foresight {
        text: foreseen.to_text(),
        concerns: foreseen.concerns(),
        heard: is_heard(setup),
    }))
}

/// Opening a device borrows across waits in a way that a task cannot be moved with; a thread that waits for it can.
fn opening(path: PathBuf) -> Opening {
    Box::pin(async move {
        let runtime = tokio::runtime::Handle::current();
        let opened = tokio::task::spawn_blocking(move || runtime.block_on(open_by_hand(path)));
        opened.await.map_err(|error| error.to_string())?
    })
}

/// Opens array, robot and receiver of a rig file, guarded by a watchdog where they are real.
async fn open_by_hand(path: PathBuf) -> Result<HandRig, String> {
    let in_words = |error: &dyn std::fmt::Display| error.to_string();
    let rig_file = RigFile::read(&path).map_err(|error| in_words(&error))?.on_wall_clock();
    let firmware = rig_file.open_virtual().map_err(|error| in_words(&error))?;
    let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
    let wanted = DeviceSelection { robot: true, array: true, receiver: true };
    let setup = &rig_file.setup;
    let mut rig = ManualRig::open(&setup.rig, &ports, wanted)
        .await
        .map_err(|error| format!("{error}. {}", error.remedy()))?;
    if let Some(shadow) = firmware.as_ref().and_then(VirtualRig::robot_shadow) {
        rig = rig.observed_by(Box::new(shadow));
    }
    let (believed, controller) = (setup.nominal_array().len(), rig.array().identity().elements);
    if believed != controller {
        return Err(format!(
            "the rig file has an array of {believed} elements, and the controller drives {controller}"
        ));
    }
    let watchdog = guard_devices(rig.emergencies(), setup).map_err(|error| in_words(&error))?;
    Ok(HandRig { rig, watchdog, keeps: Box::new(firmware) })
}
