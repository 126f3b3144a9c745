//! A link in place of a port, for the driver that opens one: a log that is run again.

use std::cell::RefCell;

use tokio::io::DuplexStream;

tokio::task_local! {
    static LINK: RefCell<Option<DuplexStream>>;
}

/// Does some work, in which the first port that is opened is `link`.
pub(in crate::rig) async fn through<T>(link: DuplexStream, work: impl Future<Output = T>) -> T {
    LINK.scope(RefCell::new(Some(link)), work).await
}

/// The link that takes the place of a port, once.
pub(super) fn take() -> Option<DuplexStream> {
    LINK.try_with(RefCell::take).ok().flatten()
}
