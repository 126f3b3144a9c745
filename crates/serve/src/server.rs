//! The server: its listener and its limits.

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use miette::Diagnostic;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;
use tower_service::Service;

use fieldgap_input::Fault;

use crate::access::audit::Audit;
use crate::access::names::Names;
use crate::access::role::Role;
use crate::access::users::{UserFile, Users};
use crate::app::{App, Bench};
use crate::check::Peer;
use crate::tls::Identity;
use crate::{background, routes};

/// Most connections at once. A page keeps one for its events and opens a few more.
const MOST_CONNECTIONS: usize = 4096;

/// How long the head of a request may take to arrive.
const HEAD_WITHIN: Duration = Duration::from_secs(5);

/// Who can reach the server.
pub enum Reach {
    /// This computer alone, on 127.0.0.1, not encrypted; port 0 is any free one.
    ThisComputer {
        /// The port.
        port: u16,
    },
    /// Other computers too, encrypted.
    Others {
        /// Where to listen.
        address: SocketAddr,
        /// The names of this computer in its network.
        names: Vec<String>,
        /// The certificate.
        identity: Identity,
        /// The file of the users who may log in by password.
        users: PathBuf,
    },
}

/// The server cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address is in use, or not one of this computer.
    #[error("{address} on this computer cannot be opened: {source}")]
    Address {
        /// The address.
        address: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
    /// Others could reach it, and there is nobody who may.
    #[error("there are no users in {}, so nobody on other computers could log in", path.display())]
    NoUsers {
        /// The file.
        path: PathBuf,
    },
    /// The users cannot be read.
    #[error(transparent)]
    Users(#[from] Fault),
    /// The audit log cannot be written.
    #[error("the audit log {} cannot be written: {source}", path.display())]
    AuditLog {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl ServeError {
    /// What to do.
    pub fn remedy(&self) -> String {
        match self {
            Self::Address { .. } => {
                "choose another port or address, or end the program that uses it".to_owned()
            }
            Self::NoUsers { .. } => {
                "add one with `fieldgap serve user add NAME --role operator`".to_owned()
            }
            Self::Users(fault) => fault.help().map(|help| help.to_string()).unwrap_or_default(),
            Self::AuditLog { .. } => {
                "choose a folder with --records that you may write to".to_owned()
            }
        }
    }
}

/// A server that listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    identity: Option<Identity>,
    host: Option<String>,
    app: App,
}

impl Server {
    /// Listens.
    ///
    /// # Errors
    /// [`ServeError`].
    pub async fn bind(bench: Bench, reach: Reach) -> Result<Self, ServeError> {
        let wanted = match &reach {
            Reach::ThisComputer { port } => SocketAddr::from((Ipv4Addr::LOCALHOST, *port)),
            Reach::Others { address, .. } => *address,
        };
        let users = match &reach {
            Reach::ThisComputer { .. } => None,
            Reach::Others { users: path, .. } => {
                let users = Users::read(path)?;
                if users.all().is_empty() {
                    return Err(ServeError::NoUsers { path: path.clone() });
                }
                Some(UserFile::new(path.clone(), users))
            }
        };
        let failed = |source| ServeError::Address { address: wanted, source };
        let listener = TcpListener::bind(wanted).await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let path = bench.records.join("audit.jsonl");
        let audit = Audit::open(&path).map_err(|source| ServeError::AuditLog { path, source })?;
        let (names, identity, host) = match reach {
            Reach::ThisComputer { .. } => (Names::loopback(address.port()), None, None),
            Reach::Others { names, identity, .. } => {
                // An address that stands for all is none to open in a browser.
                let host = address.ip().is_unspecified().then(|| names.first().cloned()).flatten();
                (Names::network(&names, address.port()), Some(identity), host)
            }
        };
        let app = App::new(bench, names, users, audit);
        Ok(Self { listener, address, identity, host, app })
    }

    /// An address that logs one person in, once, within 15 minutes.
    pub fn link(&self, name: &str, role: Role) -> String {
        let secret = self.app.sessions().invite(name, role, Instant::now());
        let scheme = if self.identity.is_some() { "https" } else { "http" };
        match &self.host {
            Some(host) => format!("{scheme}://{host}:{}/#link={secret}", self.address.port()),
            None => format!("{scheme}://{}/#link={secret}", self.address),
        }
    }

    /// Answers until `stop` resolves; then leaves a rig under hand safe. A running scan goes on; whether there is one.
    pub async fn run(self, stop: impl Future<Output = ()>) -> bool {
        let Self { listener, identity, app, .. } = self;
        let tls = identity.map(|identity| TlsAcceptor::from(identity.config()));
        let tasks = [
            tokio::spawn(background::follow_all(app.clone())),
            tokio::spawn(background::run_queue(app.clone())),
            tokio::spawn(background::settle_lease(app.clone())),
            tokio::spawn(background::follow_users(app.clone())),
        ];
        let router = routes::router(app.clone());
        let places = Arc::new(Semaphore::new(MOST_CONNECTIONS));
        let accept = async {
            loop {
                let Ok((stream, from)) = listener.accept().await else {
                    // No file handle is left; some connection will end.
                    tokio::time::sleep(Duration::from_millis(50)).await;
                    continue;
                };
                if let Ok(place) = Arc::clone(&places).try_acquire_owned() {
                    tokio::spawn(connection(stream, from, tls.clone(), router.clone(), place));
                }
            }
        };
        tokio::select! {
            () = stop => {}
            () = accept => {}
        }
        tasks.iter().for_each(tokio::task::JoinHandle::abort);
        app.hand().close().await;
        app.scan_runs()
    }
}

async fn connection(
    stream: TcpStream,
    from: SocketAddr,
    tls: Option<TlsAcceptor>,
    router: Router,
    _place: OwnedSemaphorePermit,
) {
    let _ = stream.set_nodelay(true);
    match tls {
        None => answer(stream, from, router).await,
        Some(tls) => {
            // A connection that breaks off, or speaks another language, concerns nobody else.
            if let Ok(Ok(stream)) = timeout(HEAD_WITHIN, tls.accept(stream)).await {
                answer(stream, from, router).await;
            }
        }
    }
}

async fn answer(stream: impl AsyncRead + AsyncWrite + Unpin, from: SocketAddr, router: Router) {
    let service = service_fn(move |request: Request<Incoming>| {
        let mut router = router.clone();
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(Peer(from));
        async move {
            Ok::<_, Infallible>(router.call(request).await.unwrap_or_else(|never| match never {}))
        }
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD_WITHIN);
    // A connection that breaks off concerns nobody else.
    let _ = http.serve_connection(TokioIo::new(stream), service).await;
}
