//! Passes the controls on when nobody asks for it at the moment.

use std::time::{Duration, Instant};

use crate::app::App;

/// Passes the controls to an admin whose warning is over, and takes them from who has left, for as long as the server lives.
pub(crate) async fn settle_lease(app: App) {
    loop {
        tokio::time::sleep(Duration::from_millis(250)).await;
        if let Some(id) = app.live().has_left(Instant::now())
            && app.live().lease(|lease| lease.release(id))
        {
            app.live()
                .note("the controls are free: their holder has had no page open for a minute");
            app.controls_were_released().await;
        }
        let due = app.live().lease_is_taken();
        if due && app.live().lease(|lease| lease.settle(Instant::now())) {
            app.controls_were_released().await;
        }
    }
}
