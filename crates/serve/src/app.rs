//! What all requests share.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use fieldgap_acquisition::RigSetup;

use crate::access::audit::Audit;
use crate::access::failed_logins::FailedLogins;
use crate::access::names::Names;
use crate::access::rates::Rates;
use crate::access::sessions::{Sessions, Who};
use crate::access::users::{User, UserFile};
use crate::camera::CameraAddress;
use crate::exposure::Exposing;
use crate::hand::{Hand, Opening};
use crate::live::Live;
use crate::queue::Queue;
use crate::scan_process;

/// What the server is for: the rig, the folders, the program that runs scans.
pub struct Bench {
    /// The rig file.
    pub rig: PathBuf,
    /// The rig, as the file describes it.
    pub setup: RigSetup,
    /// Folder of the plans.
    pub plans: PathBuf,
    /// Folder of the records.
    pub records: PathBuf,
    /// The fieldgap program, which runs scans.
    pub program: PathBuf,
    /// The page or MJPEG stream of a camera beside the rig.
    pub camera: Option<CameraAddress>,
    /// Opens the rig for operation by hand.
    pub open: Box<dyn Fn() -> Opening + Send + Sync>,
    /// Foresees the exposure of people, and keeps the time with the array driven.
    pub exposing: Arc<dyn Exposing>,
}

struct Shared {
    bench: Bench,
    names: Names,
    sessions: Sessions,
    audit: Audit,
    live: Arc<Live>,
    hand: Hand,
    queue: Queue,
    failed_logins: FailedLogins,
    rates: Rates,
    users: Option<tokio::sync::Mutex<UserFile>>,
    hashing: tokio::sync::Mutex<()>,
    correcting: tokio::sync::Mutex<()>,
}

/// What all requests share; cheap to clone.
#[derive(Clone)]
pub(crate) struct App(Arc<Shared>);

impl App {
    pub fn new(bench: Bench, names: Names, users: Option<UserFile>, audit: Audit) -> Self {
        Self(Arc::new(Shared {
            bench,
            names,
            sessions: Sessions::default(),
            audit,
            live: Arc::new(Live::new()),
            hand: Hand::default(),
            queue: Queue::default(),
            failed_logins: FailedLogins::default(),
            rates: Rates::default(),
            users: users.map(tokio::sync::Mutex::new),
            hashing: tokio::sync::Mutex::new(()),
            correcting: tokio::sync::Mutex::new(()),
        }))
    }

    pub fn names(&self) -> &Names {
        &self.0.names
    }

    pub fn sessions(&self) -> &Sessions {
        &self.0.sessions
    }

    pub fn audit(&self) -> &Audit {
        &self.0.audit
    }

    pub fn live(&self) -> &Arc<Live> {
        &self.0.live
    }

    pub fn hand(&self) -> &Hand {
        &self.0.hand
    }

    pub fn queue(&self) -> &Queue {
        &self.0.queue
    }

    pub fn rig(&self) -> &Path {
        &self.0.bench.rig
    }

    pub fn plans(&self) -> &Path {
        &self.0.bench.plans
    }

    pub fn records(&self) -> &Path {
        &self.0.bench.records
    }

    pub fn camera(&self) -> Option<&CameraAddress> {
        self.0.bench.camera.as_ref()
    }

    pub fn program(&self) -> &Path {
        &self.0.bench.program
    }

    /// The rig as its file describes it now, or as it did at the start if the file has become wrong.
    pub fn rig_setup(&self) -> RigSetup {
        RigSetup::read(self.rig()).unwrap_or_else(|_| self.0.bench.setup.clone())
    }

    /// An opening of the rig for operation by hand.
    pub fn opening(&self) -> Opening {
        (self.0.bench.open)()
    }

    /// Foresees the exposure of people.
    pub fn exposing(&self) -> &Arc<dyn Exposing> {
        &self.0.bench.exposing
    }

    /// Waits for its turn to correct the rig file.
    pub async fn correcting(&self) -> tokio::sync::MutexGuard<'_, ()> {
        self.0.correcting.lock().await
    }

    /// Whether a session has the controls.
    pub fn has_controls(&self, id: u64) -> bool {
        self.live().has_controls(id)
    }

    /// Whether a scan of this server runs, or its report is written.
    pub fn is_busy(&self) -> bool {
        self.queue().runs()
    }

    /// The name of a record's folder.
    pub fn name_of(&self, folder: &Path) -> String {
        folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }

    /// The folder of the scan that is shown.
    pub fn shown_folder(&self) -> Option<PathBuf> {
        self.live().with_scan(|scan| scan.map(|scan| self.records().join(scan.folder())))
    }

    /// The log-ins that failed.
    pub fn failed_logins(&self) -> &FailedLogins {
        &self.0.failed_logins
    }

    /// How often each address has asked.
    pub fn rates(&self) -> &Rates {
        &self.0.rates
    }

    /// The user of the file with this name and password. One password is looked at at a time: guesses must not keep the processor from a scan.
    pub async fn user_with_password(&self, name: String, password: String) -> Option<User> {
        let users = self.0.users.as_ref()?.lock().await.users().clone();
        let _turn = self.0.hashing.lock().await;
        let found =
            tokio::task::spawn_blocking(move || users.with_password(&name, &password).cloned());
        found.await.ok().flatten()
    }

    /// The sessions to end because the file of users has changed.
    pub async fn sessions_of_removed_users(&self) -> Vec<u64> {
        let Some(users) = &self.0.users else { return Vec::new() };
        let mut users = users.lock().await;
        match users.refresh() {
            Ok(false) => return Vec::new(),
            Ok(true) => {}
            Err(fault) => self.live().note(format!("nobody can log in by password: {fault}")),
        }
        self.sessions().of_others_than(users.users())
    }

    /// Stops whatever uses the rig: the array silent, the robot still; how that was left. The queue is held.
    pub async fn stop(&self, who: &str) -> String {
        self.queue().hold(true);
        self.live().show_queue(self.queue().shown());
        let scan = async {
            match self.shown_folder() {
                Some(folder) => scan_process::stop(&folder, self.program()).await,
                None => None,
            }
        };
        let (hand, scan) = tokio::join!(biased; self.hand().stop(), scan);
        let left = match (hand, scan) {
            (None, None) => self.stop_by_command().await,
            (hand, scan) => [hand, scan].into_iter().flatten().collect::<Vec<_>>().join("; "),
        };
        self.live().note(format!("STOP by {who}: {left}"));
        left
    }

    /// Nothing of this server uses the rig: whatever else does is stopped by the command for it.
    async fn stop_by_command(&self) -> String {
        let mut command = tokio::process::Command::new(self.program());
        command.arg("rig").arg("stop").arg(self.rig()).stdin(std::process::Stdio::null());
        match command.output().await {
            Ok(done) => {
                let said = String::from_utf8_lossy(if done.stdout.is_empty() {
                    &done.stderr
                } else {
                    &done.stdout
                });
                said.split_whitespace().collect::<Vec<_>>().join(" ")
            }
            Err(error) => format!("THE RIG COULD NOT BE STOPPED: {error}; SWITCH OFF ITS POWER"),
        }
    }

    /// Leaves the rig safe if nobody has the controls any more.
    pub async fn controls_were_released(&self) {
        if self.hand().is_open() {
            self.live().note("the controls were released: the rig under hand is closed");
            self.hand().close().await;
        }
    }

    /// Whether the scan that is shown still runs.
    pub fn scan_runs(&self) -> bool {
        use crate::scan_view::Stage;
        self.live().with_scan(|scan| {
            scan.is_some_and(|scan| matches!(scan.stage(), Stage::Scanning | Stage::Paused))
        })
    }

    /// The name of a person for the log.
    pub fn name(who: Option<&Who>) -> String {
        who.map_or_else(
            || "nobody".to_owned(),
            |who| fieldgap_input::visible_line(&who.name).into_owned(),
        )
    }
}
