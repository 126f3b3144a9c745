//! Ends the sessions of users who were removed from the file of users.

use std::time::Duration;

use crate::app::App;
use crate::handlers::log_in::end_session;

/// Time between two looks at the file.
const LOOK: Duration = Duration::from_secs(1);

/// Follows the file of users, for as long as the server lives.
pub(crate) async fn follow_users(app: App) {
    loop {
        tokio::time::sleep(LOOK).await;
        for id in app.sessions_of_removed_users().await {
            end_session(&app, id).await;
        }
    }
}
