//! A link in place of a port, for the driver that opens one: a log that is run again.

use std::cell::RefCell;

use tokio::io::DuplexStream;

tokio::task_local! {
    static LINK: RefCell<Option<(DuplexStream, u16)>>;
}

/// Does some work, in which the first port that is opened is `link`, under the number that it was opened with then.
pub(crate) async fn through<T>(
    link: DuplexStream,
    opening: u16,
    work: impl Future<Output = T>,
) -> T {
    LINK.scope(RefCell::new(Some((link, opening))), work).await
}

/// The link that takes the place of a port, and its number, once.
pub(super) fn take() -> Option<(DuplexStream, u16)> {
    LINK.try_with(RefCell::take).ok().flatten()
}
