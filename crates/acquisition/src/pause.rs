//! A scan told to wait, and to go on.

use tokio::sync::watch;

/// Whoever may let a scan wait.
#[derive(Debug)]
pub struct PauseSwitch(watch::Sender<bool>);

/// What a scan looks at between points.
#[derive(Debug, Clone)]
pub struct Pause(Option<watch::Receiver<bool>>);

impl PauseSwitch {
    /// A switch, and what it switches.
    pub fn new() -> (Self, Pause) {
        let (tell, told) = watch::channel(false);
        (Self(tell), Pause(Some(told)))
    }

    /// Lets the scan wait from now on, or go on.
    pub fn set(&self, waits: bool) {
        self.0.send_replace(waits);
    }
}

impl Pause {
    /// Nobody may let the scan wait.
    pub(super) fn never() -> Self {
        Self(None)
    }

    /// Whether the scan is to wait now.
    pub(super) fn is_asked(&self) -> bool {
        self.0.as_ref().is_some_and(|told| *told.borrow())
    }

    /// Returns when the scan may go on; also when whoever let it wait has gone.
    pub(super) async fn over(&mut self) {
        if let Some(told) = &mut self.0 {
            let _ = told.wait_for(|waits| !waits).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_scan_goes_on_when_it_may_and_when_nobody_is_left_to_say_so() {
        let (switch, mut pause) = PauseSwitch::new();
        assert!(!pause.is_asked());
        switch.set(true);
        assert!(pause.is_asked());
        let waiting = tokio::spawn({
            let mut pause = pause.clone();
            async move { pause.over().await }
        });
        switch.set(false);
        waiting.await.expect("it goes on");
        switch.set(true);
        drop(switch);
        pause.over().await;
        let mut never = Pause::never();
        assert!(!never.is_asked());
        never.over().await;
    }
}
