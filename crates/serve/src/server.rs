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
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tower_service::Service;

use crate::access::audit::Audit;
use crate::access::names::Names;
use crate::access::role::Role;
use crate::app::{App, Bench};
use crate::check::Peer;
use crate::{background, routes};

/// Most connections at once. A page keeps one for its events and opens a few more.
const MOST_CONNECTIONS: usize = 4096;

/// How long the head of a request may take to arrive.
const HEAD_WITHIN: Duration = Duration::from_secs(5);

/// The server cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address is in use.
    #[error("port {port} on this computer cannot be opened: {source}")]
    Port {
        /// The port.
        port: u16,
        /// Why.
        source: std::io::Error,
    },
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
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Port { .. } => "choose another port with --port, or end the program that uses it",
            Self::AuditLog { .. } => "choose a folder with --records that you may write to",
        }
    }
}

/// A server that listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    app: App,
}

impl Server {
    /// Listens on 127.0.0.1; port 0 is any free one. Other computers cannot reach it.
    ///
    /// # Errors
    /// [`ServeError`].
    pub async fn bind(bench: Bench, port: u16) -> Result<Self, ServeError> {
        let failed = |source| ServeError::Port { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let path = bench.records.join("audit.jsonl");
        let audit = Audit::open(&path).map_err(|source| ServeError::AuditLog { path, source })?;
        let app = App::new(bench, Names::loopback(address.port()), audit);
        Ok(Self { listener, address, app })
    }

    /// An address that logs one person in, once, within 15 minutes.
    pub fn link(&self, name: &str, role: Role) -> String {
        let secret = self.app.sessions().invite(name, role, Instant::now());
        format!("http://{}/#link={secret}", self.address)
    }

    /// Answers until `stop` resolves; then leaves a rig under hand safe. A running scan goes on; whether there is one.
    pub async fn run(self, stop: impl Future<Output = ()>) -> bool {
        let Self { listener, app, .. } = self;
        let tasks = [
            tokio::spawn(background::follow_all(app.clone())),
            tokio::spawn(background::run_queue(app.clone())),
            tokio::spawn(background::settle_lease(app.clone())),
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
                    tokio::spawn(connection(stream, from, router.clone(), place));
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
    router: Router,
    _place: OwnedSemaphorePermit,
) {
    let _ = stream.set_nodelay(true);
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
