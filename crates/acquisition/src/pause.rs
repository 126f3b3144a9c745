//! Pausing a scan and continuing it.

use tokio::sync::watch;

/// The switch that pauses a scan.
#[derive(Debug)]
pub struct PauseSwitch(watch::Sender<bool>);

/// The scan's end of the switch, read between points.
#[derive(Debug, Clone)]
pub struct Pause(Option<watch::Receiver<bool>>);

impl PauseSwitch {
    /// A switch and the scan's end of it.
    pub fn new() -> (Self, Pause) {
        let (tell, told) = watch::channel(false);
        (Self(tell), Pause(Some(told)))
    }

    /// Pauses the scan, or lets it continue.
    pub fn set(&self, paused: bool) {
        self.0.send_replace(paused);
    }
}

impl Pause {
    /// For a scan that cannot be paused.
    pub(super) fn never() -> Self {
        Self(None)
    }

    /// Whether a pause is requested now.
    pub(super) fn is_asked(&self) -> bool {
        self.0.as_ref().is_some_and(|told| *told.borrow())
    }

    /// Returns when the scan may continue: the switch is off or was dropped.
    pub(super) async fn over(&mut self) {
        if let Some(told) = &mut self.0 {
            let _ = told.wait_for(|paused| !paused).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_scan_continues_when_the_switch_is_off_or_dropped() {
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
