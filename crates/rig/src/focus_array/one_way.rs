//! The code shared by boards that never answer.
//!
//! Nothing confirms that a command arrived. So every pattern is sent whole, silence is sent to
//! both of the board's buffers, and each call returns only when its last byte has left the line.

use std::fmt::Debug;
use std::time::Duration;

use async_trait::async_trait;
use tokio::time::{Instant, sleep_until};

use super::wiring::{Slots, Wiring};
use super::{ArrayIdentity, ElementDelay, Modulation};
use crate::device::Device;
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};
use crate::{Emergency, FocusArray};

/// Carrier of every board here, Hz: it is made on the board and cannot be queried.
pub(super) const CARRIER_HZ: f64 = 40e3;

/// Time that a byte may lie in a USB bridge before it is on the line.
const BRIDGE: Duration = Duration::from_millis(2);

/// How long an echo may take beyond the line's own time.
const ECHO_WITHIN: Duration = Duration::from_secs(1);

/// How often silence is sent to a starting board until it echoes.
const TRIES_AT_START: u32 = 10;

/// What distinguishes one board from another: its bytes.
pub(super) trait OneWayBoard: Debug + Send + 'static {
    /// What it calls itself in messages.
    fn name(&self) -> String;

    /// Time slots in a period of the carrier.
    fn slots(&self) -> u8;

    /// Channels of all boards in the chain.
    fn channels(&self) -> usize;

    /// The bytes that a board in an unknown state gets first.
    fn wake(&self) -> Vec<u8>;

    /// The bytes that show a pattern on all boards at once.
    fn frame(&self, slots: &[Option<u8>]) -> Vec<u8>;

    /// The bytes that set the modulation, or why it cannot be set.
    fn modulate(&self, modulation: Modulation) -> Result<Vec<u8>, Cause>;

    /// The byte that comes back when a pattern was shown, where the line brings any back.
    fn echo(&self) -> Option<u8> {
        None
    }

    /// How long it starts up after its port was opened.
    fn starts_within(&self) -> Duration {
        Duration::ZERO
    }
}

/// An array behind boards that never answer.
///
/// It emits from its power-up until the first bytes have come; silenced when it is opened and when
/// this is dropped.
#[derive(Debug)]
pub(super) struct OneWayArray<L: ByteLink, B: OneWayBoard> {
    wire: Wire<L>,
    board: B,
    wiring: Wiring,
    identity: ArrayIdentity,
    slots: Slots,
    emitting: bool,
    byte_time: Duration,
    /// When the line has carried all that was sent.
    carried_at: Instant,
}

impl<L: ByteLink, B: OneWayBoard> OneWayArray<L, B> {
    /// Silences the array before anything else and sets its modulation.
    ///
    /// # Errors
    /// That the port fails, that an echo which is promised does not come, or that the board cannot modulate so.
    pub(super) async fn begin(
        wire: Wire<L>,
        board: B,
        wiring: Wiring,
        baud: u32,
        modulation: Modulation,
    ) -> Result<Self, RigError> {
        let identity = ArrayIdentity {
            name: board.name(),
            elements: wiring.elements(),
            clock_hz: CARRIER_HZ * f64::from(board.slots()),
            period_steps: u32::from(board.slots()),
            most_frames: 0,
            most_levels: 0,
            most_sensors: 0,
            acknowledges: board.echo().is_some(),
        };
        let mut array = Self {
            wire,
            wiring,
            identity,
            slots: vec![None; board.channels()],
            emitting: false,
            // A start bit, eight bits, a stop bit.
            byte_time: Duration::from_secs_f64(10.0 / f64::from(baud)),
            carried_at: Instant::now(),
            board,
        };
        array.start().await?;
        array.wire.attempting("setting the modulation");
        let bytes = array.board.modulate(modulation).map_err(|cause| array.wire.error(cause))?;
        array.carry(&bytes).await?;
        Ok(array)
    }

    /// Silences a board that may have been emitting since its power-up, and may be starting just now: opening its port
    /// resets many.
    async fn start(&mut self) -> Result<(), RigError> {
        self.wire.attempting("silencing the array on opening");
        let started_at = Instant::now() + self.board.starts_within();
        let wake = self.board.wake();
        if self.board.echo().is_some() {
            let mut last = Ok(());
            for _ in 0..TRIES_AT_START {
                self.carry(&wake).await?;
                last = self.show_silence().await;
                match &last {
                    Err(error) if matches!(error.cause(), Cause::Silent { .. }) => {}
                    _ => break,
                }
            }
            return last;
        }
        self.carry(&wake).await?;
        self.show_silence().await?;
        if started_at > Instant::now() {
            sleep_until(started_at).await;
            self.carry(&wake).await?;
            self.show_silence().await?;
        }
        Ok(())
    }

    /// Silence on both buffers: a swap that is sent or garbled later can only bring back silence.
    async fn show_silence(&mut self) -> Result<(), RigError> {
        let silence = vec![None; self.board.channels()];
        self.show(&silence).await?;
        self.show(&silence).await
    }

    /// Shows a pattern, and waits for its echo where there is one.
    async fn show(&mut self, slots: &[Option<u8>]) -> Result<(), RigError> {
        let Some(echo) = self.board.echo() else {
            return self.carry(&self.board.frame(slots)).await;
        };
        // What is left of earlier echoes is not this one's.
        while !self.wire.bytes(Instant::now()).await?.is_empty() {}
        self.carry(&self.board.frame(slots)).await?;
        let until = self.carried_at + ECHO_WITHIN;
        loop {
            let back = self.wire.bytes(until).await?;
            if back.contains(&echo) {
                return Ok(());
            }
            if back.is_empty() {
                return Err(self.wire.error(Cause::Silent { waited: ECHO_WITHIN }));
            }
        }
    }

    /// Sends bytes and waits until the line has carried them: only then is the array in the commanded state.
    async fn carry(&mut self, bytes: &[u8]) -> Result<(), RigError> {
        if bytes.is_empty() {
            return Ok(());
        }
        let takes = self.byte_time * u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        self.carried_at = self.carried_at.max(Instant::now()) + takes;
        self.wire.send(bytes).await?;
        sleep_until(self.carried_at + BRIDGE).await;
        Ok(())
    }
}

#[async_trait]
impl<L: ByteLink, B: OneWayBoard + Sync> FocusArray for OneWayArray<L, B> {
    fn device(&self) -> &Device {
        self.wire.device()
    }

    fn identity(&self) -> &ArrayIdentity {
        &self.identity
    }

    async fn silence(&mut self) -> Result<(), RigError> {
        self.wire.attempting("silencing the array");
        self.emitting = false;
        self.show_silence().await
    }

    fn emergency(&self) -> Option<Emergency> {
        // Behind a pattern that may have been broken off.
        self.wire.emergency([self.board.wake(), self.twice_silent()].concat())
    }

    async fn set_delays(&mut self, delays: &[ElementDelay]) -> Result<(), RigError> {
        self.wire.attempting("setting the delays");
        let (slots, channels) = (self.board.slots(), self.board.channels());
        self.slots = self
            .wiring
            .slots(delays, CARRIER_HZ, slots, channels)
            .map_err(|cause| self.wire.error(cause))?;
        if self.emitting { self.show(&self.slots.clone()).await } else { Ok(()) }
    }

    async fn continuous_wave(&mut self) -> Result<(), RigError> {
        self.wire.attempting("ending the modulation");
        let bytes =
            self.board.modulate(Modulation::NONE).map_err(|cause| self.wire.error(cause))?;
        self.carry(&bytes).await
    }

    async fn emit(&mut self) -> Result<(), RigError> {
        self.wire.attempting("starting emission");
        self.emitting = true;
        self.show(&self.slots.clone()).await
    }

    /// A board that was reset emits on all channels without reporting it.
    async fn refresh(&mut self) -> Result<(), RigError> {
        self.wire.attempting("sending the current pattern again");
        match self.emitting {
            true => self.show(&self.slots.clone()).await,
            false => self.show(&vec![None; self.board.channels()]).await,
        }
    }
}

impl<L: ByteLink, B: OneWayBoard> OneWayArray<L, B> {
    /// Silence for both buffers of a board.
    fn twice_silent(&self) -> Vec<u8> {
        self.board.frame(&vec![None; self.board.channels()]).repeat(2)
    }
}

impl<L: ByteLink, B: OneWayBoard> Drop for OneWayArray<L, B> {
    fn drop(&mut self) {
        let silence = self.twice_silent();
        self.wire.send_without_waiting(&silence);
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

    use super::super::wiring::WiringConfig;
    use super::*;
    use crate::device::Role;

    /// A board of two channels and four slots: a frame is `<`, a character a channel, `>`.
    #[derive(Debug)]
    struct Letters {
        echo: Option<u8>,
        starts_within: Duration,
    }

    impl OneWayBoard for Letters {
        fn name(&self) -> String {
            "letters".into()
        }
        fn slots(&self) -> u8 {
            4
        }
        fn channels(&self) -> usize {
            2
        }
        fn wake(&self) -> Vec<u8> {
            b"!".to_vec()
        }
        fn frame(&self, slots: &[Option<u8>]) -> Vec<u8> {
            let letter = |slot: &Option<u8>| slot.map_or(b'-', |slot| b'a' + slot);
            [b"<", &*slots.iter().map(letter).collect::<Vec<u8>>(), b">"].concat()
        }
        fn modulate(&self, modulation: Modulation) -> Result<Vec<u8>, Cause> {
            Ok(format!("m{}", modulation.frequency_hz).into_bytes())
        }
        fn echo(&self) -> Option<u8> {
            self.echo
        }
        fn starts_within(&self) -> Duration {
            self.starts_within
        }
    }

    async fn opened(
        board: Letters,
    ) -> (Result<OneWayArray<DuplexStream, Letters>, RigError>, DuplexStream) {
        let (near, far) = duplex(4096);
        let wire = Wire::new(near, Device::new(Role::FocusArray, "memory"));
        let wiring = WiringConfig::default().resolve(&[0, 1]).expect("two channels");
        (OneWayArray::begin(wire, board, wiring, 1000, Modulation::NONE).await, far)
    }

    fn plain() -> Letters {
        Letters { echo: None, starts_within: Duration::ZERO }
    }

    async fn said(far: &mut DuplexStream) -> String {
        let mut bytes = vec![0; 4096];
        let count = far.read(&mut bytes).await.expect("open");
        String::from_utf8_lossy(&bytes[..count]).into_owned()
    }

    #[tokio::test(start_paused = true)]
    async fn silence_goes_to_both_buffers_first_and_last() {
        let (array, mut far) = opened(plain()).await;
        let mut array = array.expect("opens");
        assert_eq!(said(&mut far).await, "!<--><-->m0");
        array
            .set_delays(&[ElementDelay::Seconds(6.25e-6), ElementDelay::Silent])
            .await
            .expect("two");
        array.emit().await.expect("open");
        assert_eq!(said(&mut far).await, "<b->", "delays alone do not make it sound");
        array.set_delays(&[ElementDelay::Silent, ElementDelay::Seconds(0.0)]).await.expect("two");
        assert_eq!(said(&mut far).await, "<-a>", "while it emits they are shown at once");
        array.refresh().await.expect("open");
        assert_eq!(said(&mut far).await, "<-a>");
        array.silence().await.expect("open");
        assert_eq!(said(&mut far).await, "<--><-->");
        array.refresh().await.expect("open");
        assert_eq!(said(&mut far).await, "<-->");
        drop(array);
        assert_eq!(said(&mut far).await, "<--><-->");
    }

    #[tokio::test(start_paused = true)]
    async fn a_call_returns_when_the_line_has_carried_its_bytes() {
        let (array, _far) = opened(plain()).await;
        let mut array = array.expect("opens");
        let start = Instant::now();
        array.silence().await.expect("open");
        // Eight bytes of ten bits at 1000 bits a second.
        assert!(start.elapsed() >= Duration::from_millis(80), "{:?}", start.elapsed());
        assert!(start.elapsed() < Duration::from_millis(90), "{:?}", start.elapsed());
    }

    #[tokio::test(start_paused = true)]
    async fn a_board_that_is_reset_by_opening_is_silenced_again_when_it_has_started() {
        let start = Instant::now();
        let board = Letters { starts_within: Duration::from_secs(2), ..plain() };
        let (array, mut far) = opened(board).await;
        assert!(array.is_ok() && start.elapsed() >= Duration::from_secs(2));
        assert_eq!(said(&mut far).await, "!<--><-->!<--><-->m0");
    }

    #[tokio::test(start_paused = true)]
    async fn an_echo_that_is_promised_and_does_not_come_is_an_error() {
        let (array, far) = opened(Letters { echo: Some(b'>'), ..plain() }).await;
        let error = array.expect_err("nobody echoes");
        let words = "focus array on memory, silencing the array on opening: no answer";
        assert!(error.to_string().starts_with(words), "{error}");
        drop(far);
    }

    #[tokio::test(start_paused = true)]
    async fn an_echo_is_an_acknowledgement() {
        let (near, far) = duplex(4096);
        let (mut hears, mut says) = tokio::io::split(far);
        tokio::spawn(async move { tokio::io::copy(&mut hears, &mut says).await });
        let wire = Wire::new(near, Device::new(Role::FocusArray, "memory"));
        let wiring = WiringConfig::default().resolve(&[0, 1]).expect("two channels");
        let board = Letters { echo: Some(b'>'), ..plain() };
        let mut array = OneWayArray::begin(wire, board, wiring, 1000, Modulation::NONE)
            .await
            .expect("it echoes");
        assert!(array.identity().acknowledges);
        array.silence().await.expect("it echoes");
    }

    #[tokio::test(start_paused = true)]
    async fn a_pulled_cable_is_a_disconnection_and_what_it_lacks_is_said() {
        let (array, far) = opened(plain()).await;
        let mut array = array.expect("opens");
        let error = array.listen(&[0], 100.0).await.expect_err("it has no microphones");
        assert!(matches!(error.cause(), Cause::NoSensors), "{error}");
        drop(far);
        let mut far_gone = array.silence().await.expect_err("the cable is pulled");
        assert!(matches!(far_gone.cause(), Cause::Disconnected), "{far_gone}");
        far_gone = array.emit().await.expect_err("it stays pulled");
        assert!(matches!(far_gone.cause(), Cause::Disconnected), "{far_gone}");
    }

    #[tokio::test(start_paused = true)]
    async fn an_echo_that_comes_late_is_not_the_next_patterns() {
        let (near, mut far) = duplex(4096);
        let wire = Wire::new(near, Device::new(Role::FocusArray, "memory"));
        let wiring = WiringConfig::default().resolve(&[0, 1]).expect("two channels");
        let board = Letters { echo: Some(b'>'), ..plain() };
        far.write_all(b">>>").await.expect("room");
        let begun = OneWayArray::begin(wire, board, wiring, 1000, Modulation::NONE).await;
        assert!(begun.is_err(), "old echoes are thrown away");
    }
}
