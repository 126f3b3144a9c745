//! Fault injection on a link: bytes are lost, damaged, repeated or delayed at given rates, drawn from a seed.
//!
//! Each piece is drawn for separately: a line, or at most 64 bytes of what does not come in lines. The same seed and the
//! same bytes give the same faults.

use std::collections::VecDeque;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf, duplex, split};
use tokio::time::sleep;

use super::ByteLink;
use fieldgap_input::Fraction;

/// The longest piece, bytes.
const PIECE: usize = 64;

/// How late a delayed piece is, at most.
const LATE: Duration = Duration::from_millis(400);

/// How long a link that stalls passes nothing: longer than drivers wait before they ask again.
const STALLED: Duration = Duration::from_secs(8);

/// Bytes that a link with faults holds at once.
const CAPACITY: usize = 4096;

/// The share of all pieces that meets each fault.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FaultRates {
    /// The piece is lost.
    pub lose: Share,
    /// One bit of it is inverted.
    pub flip: Share,
    /// Several of its bytes are replaced, its end among them.
    pub garble: Share,
    /// It comes twice.
    pub double: Share,
    /// It comes late.
    pub delay: Share,
    /// Nothing passes for a while.
    pub stall: Share,
    /// An `ok` that nobody sent comes before it.
    pub wrong_ok: Share,
    /// The device restarts.
    pub reset: Share,
    /// The link is cut.
    pub disconnect: Share,
}

/// From 0 to 1; 0 if it is not given.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(try_from = "f64")]
pub struct Share(f64);

impl TryFrom<f64> for Share {
    type Error = String;
    fn try_from(share: f64) -> Result<Self, String> {
        Fraction::new(share).map(|share| Self(share.get())).map_err(|error| error.to_string())
    }
}

impl FaultRates {
    /// Frequent faults at the same rate; stalls, restarts and cuts a hundred times less often.
    ///
    /// # Errors
    /// A rate beyond 0 to 1.
    pub fn even(rate: f64) -> Result<Self, String> {
        let (often, rarely) = (Share::try_from(rate)?, Share::try_from(rate / 100.0)?);
        Ok(Self {
            lose: often,
            flip: often,
            garble: often,
            double: often,
            delay: often,
            stall: rarely,
            wrong_ok: often,
            reset: rarely,
            disconnect: rarely,
        })
    }

    fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// What is done with a piece.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Delivery {
    /// Bytes pass.
    Pass(Vec<u8>),
    /// Nothing passes for so long.
    Wait(Duration),
    /// The device restarts.
    Reset,
    /// The link is cut.
    Cut,
}

/// Injects faults into one direction of a link.
#[derive(Debug)]
pub struct FaultInjector {
    rates: FaultRates,
    draws: ChaCha8Rng,
    pieces: u64,
}

impl FaultInjector {
    /// Faults at these rates. `direction` gives links that share a seed independent draws.
    pub fn new(rates: FaultRates, seed: u64, direction: u64) -> Self {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        draws.set_stream(direction);
        Self { rates, draws, pieces: 0 }
    }

    /// How many pieces have passed.
    pub fn pieces(&self) -> u64 {
        self.pieces
    }

    /// What is done with some bytes, in order.
    pub fn apply(&mut self, bytes: &[u8]) -> VecDeque<Delivery> {
        if self.rates.is_none() {
            return VecDeque::from([Delivery::Pass(bytes.to_vec())]);
        }
        let mut deliveries = VecDeque::new();
        let pieces = bytes.split_inclusive(|&byte| byte == b'\n');
        for piece in pieces.flat_map(|line| line.chunks(PIECE)) {
            self.pieces += 1;
            self.decide(piece, &mut deliveries);
        }
        deliveries
    }

    fn decide(&mut self, piece: &[u8], deliveries: &mut VecDeque<Delivery>) {
        let mut drawn: f64 = self.draws.random();
        let mut drawn_is = |share: Share| {
            let drawn_is = drawn < share.0;
            drawn -= share.0;
            drawn_is
        };
        let rates = self.rates;
        let pass = |bytes: &[u8]| Delivery::Pass(bytes.to_vec());
        if drawn_is(rates.lose) {
        } else if drawn_is(rates.flip) {
            let mut damaged = piece.to_vec();
            let at = self.draws.random_range(0..damaged.len());
            damaged[at] ^= 1 << self.draws.random_range(0..8);
            deliveries.push_back(Delivery::Pass(damaged));
        } else if drawn_is(rates.garble) {
            let mut damaged = piece.to_vec();
            let from = self.draws.random_range(0..damaged.len());
            damaged[from..].iter_mut().for_each(|byte| *byte = self.draws.random());
            deliveries.push_back(Delivery::Pass(damaged));
        } else if drawn_is(rates.double) {
            deliveries.extend([pass(piece), pass(piece)]);
        } else if drawn_is(rates.delay) {
            let late = LATE.mul_f64(self.draws.random());
            deliveries.extend([Delivery::Wait(late), pass(piece)]);
        } else if drawn_is(rates.stall) {
            deliveries.extend([Delivery::Wait(STALLED), pass(piece)]);
        } else if drawn_is(rates.wrong_ok) {
            deliveries.extend([pass(b"ok\n"), pass(piece)]);
        } else if drawn_is(rates.reset) {
            deliveries.extend([pass(piece), Delivery::Reset]);
        } else if drawn_is(rates.disconnect) {
            deliveries.push_back(Delivery::Cut);
        } else {
            deliveries.push_back(pass(piece));
        }
    }
}

/// A link through which `link` is reached with injector. A restart, which is the device's own, does not happen on it.
///
/// Must be called within a Tokio runtime.
pub fn with_faults(link: impl ByteLink, rates: FaultRates, seed: u64) -> DuplexStream {
    let (near, far) = duplex(CAPACITY);
    let (from_host, to_host) = split(far);
    let (from_device, to_device) = split(link);
    let [down, up] = [0, 1].map(|direction| FaultInjector::new(rates, seed, direction));
    tokio::spawn(async move {
        // Where one direction is cut, both are.
        tokio::select! {
            () = pass_on(from_host, to_device, down) => {}
            () = pass_on(from_device, to_host, up) => {}
        }
    });
    near
}

async fn pass_on(
    mut from: ReadHalf<impl ByteLink>,
    mut to: WriteHalf<impl ByteLink>,
    mut injector: FaultInjector,
) {
    let mut buffer = [0; 512];
    while let Ok(count @ 1..) = from.read(&mut buffer).await {
        for delivery in injector.apply(&buffer[..count]) {
            match delivery {
                Delivery::Pass(bytes) => {
                    if to.write_all(&bytes).await.is_err() {
                        return;
                    }
                }
                Delivery::Wait(time) => sleep(time).await,
                Delivery::Reset => {}
                Delivery::Cut => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &[u8] = b"N7 G1 X1.000*99\n";

    /// What is done with so many lines at these rates.
    fn deliveries(rates: FaultRates, lines: usize) -> Vec<Vec<Delivery>> {
        let mut injector = FaultInjector::new(rates, 1, 0);
        (0..lines).map(|_| injector.apply(LINE).into()).collect()
    }

    #[test]
    fn without_rates_all_passes_as_it_is() {
        assert_eq!(deliveries(FaultRates::default(), 1), [[Delivery::Pass(LINE.to_vec())]]);
    }

    #[test]
    fn each_fault_comes_at_its_rate_and_the_same_seed_gives_the_same() {
        let rates = FaultRates::even(0.02).expect("a rate");
        let (one, other) = (deliveries(rates, 50_000), deliveries(rates, 50_000));
        assert_eq!(one, other);
        let share = |met: &dyn Fn(&[Delivery]) -> bool| {
            one.iter().filter(|outcome| met(outcome)).count() as f64 / one.len() as f64
        };
        let passed = |bytes: &[u8]| Delivery::Pass(bytes.to_vec());
        for (rate, seen) in [
            (0.02, share(&|met| met.is_empty())),
            (0.02, share(&|met| met == [passed(LINE), passed(LINE)])),
            (0.02, share(&|met| met == [passed(b"ok\n"), passed(LINE)])),
            (0.02, share(&|met| matches!(met, [Delivery::Wait(late), _] if *late < STALLED))),
            (0.04, share(&|met| matches!(met, [Delivery::Pass(bytes)] if bytes != LINE))),
        ] {
            assert!((seen - rate).abs() < 0.004, "{seen} where {rate} is meant");
        }
        let one_bit = |met: &[Delivery]| match met {
            [Delivery::Pass(bytes)] => {
                let bits = bytes.iter().zip(LINE).map(|(a, b)| (a ^ b).count_ones());
                bits.sum::<u32>() == 1
            }
            _ => false,
        };
        assert!(share(&one_bit) > 0.018);
        assert!(share(&|met| met.contains(&Delivery::Cut)) > 0.0);
        assert!(share(&|met| met.contains(&Delivery::Reset)) > 0.0);
    }

    #[test]
    fn a_rate_is_a_share() {
        assert!(FaultRates::even(1.5).is_err() && FaultRates::even(-0.1).is_err());
    }

    #[tokio::test(start_paused = true)]
    async fn a_link_with_faults_passes_lines_and_is_cut_as_a_whole() {
        let (host_end, mut device) = duplex(256);
        let mut host = with_faults(host_end, FaultRates::default(), 1);
        host.write_all(LINE).await.expect("it passes");
        let mut received = vec![0; LINE.len()];
        device.read_exact(&mut received).await.expect("it comes");
        assert_eq!(received, LINE);

        let cut = FaultRates { disconnect: Share(1.0), ..FaultRates::default() };
        let (host_end, mut device) = duplex(256);
        let mut host = with_faults(host_end, cut, 1);
        host.write_all(LINE).await.expect("it is taken");
        assert_eq!(device.read(&mut received).await.expect("an end"), 0);
        assert_eq!(host.read(&mut received).await.expect("an end"), 0);
    }
}
