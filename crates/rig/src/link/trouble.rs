//! Trouble on a link, on purpose: lines that are lost, damaged, doubled, late, and worse, at given rates and from a seed.
//!
//! A fate is drawn for each piece, a line or at most 64 bytes of what does not come in lines. The same seed and the
//! same bytes give the same trouble.

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

/// What passes at once through a link with trouble, bytes.
const CAPACITY: usize = 4096;

/// How often what happens to a piece, as shares of all pieces.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TroubleRates {
    /// The piece is lost.
    pub lose: Share,
    /// One bit of it is another.
    pub flip: Share,
    /// Several of its bytes are others, its end among them.
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

impl TroubleRates {
    /// Each of the damages that a line can do at the same rate, restarts and cuts a hundred times less often.
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

/// What comes of a piece.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Bytes pass.
    Pass(Vec<u8>),
    /// Nothing passes for so long.
    Wait(Duration),
    /// The device restarts.
    Reset,
    /// The link is cut.
    Cut,
}

/// The trouble of one direction of a link.
#[derive(Debug)]
pub struct Trouble {
    rates: TroubleRates,
    draws: ChaCha8Rng,
    pieces: u64,
}

impl Trouble {
    /// Trouble at these rates. `direction` parts the chances of links that share a seed.
    pub fn new(rates: TroubleRates, seed: u64, direction: u64) -> Self {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        draws.set_stream(direction);
        Self { rates, draws, pieces: 0 }
    }

    /// How many pieces came by.
    pub fn pieces(&self) -> u64 {
        self.pieces
    }

    /// What comes of some bytes, in order.
    pub fn meet(&mut self, bytes: &[u8]) -> VecDeque<Outcome> {
        if self.rates.is_none() {
            return VecDeque::from([Outcome::Pass(bytes.to_vec())]);
        }
        let mut outcomes = VecDeque::new();
        let pieces = bytes.split_inclusive(|&byte| byte == b'\n');
        for piece in pieces.flat_map(|line| line.chunks(PIECE)) {
            self.pieces += 1;
            self.decide(piece, &mut outcomes);
        }
        outcomes
    }

    fn decide(&mut self, piece: &[u8], outcomes: &mut VecDeque<Outcome>) {
        let mut drawn: f64 = self.draws.random();
        let mut falls = |share: Share| {
            let falls = drawn < share.0;
            drawn -= share.0;
            falls
        };
        let rates = self.rates;
        let pass = |bytes: &[u8]| Outcome::Pass(bytes.to_vec());
        if falls(rates.lose) {
        } else if falls(rates.flip) {
            let mut damaged = piece.to_vec();
            let at = self.draws.random_range(0..damaged.len());
            damaged[at] ^= 1 << self.draws.random_range(0..8);
            outcomes.push_back(Outcome::Pass(damaged));
        } else if falls(rates.garble) {
            let mut damaged = piece.to_vec();
            let from = self.draws.random_range(0..damaged.len());
            damaged[from..].iter_mut().for_each(|byte| *byte = self.draws.random());
            outcomes.push_back(Outcome::Pass(damaged));
        } else if falls(rates.double) {
            outcomes.extend([pass(piece), pass(piece)]);
        } else if falls(rates.delay) {
            let late = LATE.mul_f64(self.draws.random());
            outcomes.extend([Outcome::Wait(late), pass(piece)]);
        } else if falls(rates.stall) {
            outcomes.extend([Outcome::Wait(STALLED), pass(piece)]);
        } else if falls(rates.wrong_ok) {
            outcomes.extend([pass(b"ok\n"), pass(piece)]);
        } else if falls(rates.reset) {
            outcomes.extend([pass(piece), Outcome::Reset]);
        } else if falls(rates.disconnect) {
            outcomes.push_back(Outcome::Cut);
        } else {
            outcomes.push_back(pass(piece));
        }
    }
}

/// A link through which `link` is reached with trouble. A restart, which is the device's own, does not happen on it.
///
/// Must be called within a Tokio runtime.
pub fn troubled(link: impl ByteLink, rates: TroubleRates, seed: u64) -> DuplexStream {
    let (near, far) = duplex(CAPACITY);
    let (from_host, to_host) = split(far);
    let (from_device, to_device) = split(link);
    let [down, up] = [0, 1].map(|direction| Trouble::new(rates, seed, direction));
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
    mut trouble: Trouble,
) {
    let mut buffer = [0; 512];
    while let Ok(count @ 1..) = from.read(&mut buffer).await {
        for outcome in trouble.meet(&buffer[..count]) {
            match outcome {
                Outcome::Pass(bytes) => {
                    if to.write_all(&bytes).await.is_err() {
                        return;
                    }
                }
                Outcome::Wait(time) => sleep(time).await,
                Outcome::Reset => {}
                Outcome::Cut => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &[u8] = b"N7 G1 X1.000*99\n";

    /// The outcomes of so many lines under one rate.
    fn outcomes(rates: TroubleRates, lines: usize) -> Vec<Vec<Outcome>> {
        let mut trouble = Trouble::new(rates, 1, 0);
        (0..lines).map(|_| trouble.meet(LINE).into()).collect()
    }

    #[test]
    fn without_rates_all_passes_as_it_is() {
        assert_eq!(outcomes(TroubleRates::default(), 1), [[Outcome::Pass(LINE.to_vec())]]);
    }

    #[test]
    fn each_trouble_comes_at_its_rate_and_the_same_seed_gives_the_same() {
        let rates = TroubleRates::even(0.02).expect("a rate");
        let (one, other) = (outcomes(rates, 50_000), outcomes(rates, 50_000));
        assert_eq!(one, other);
        let share = |met: &dyn Fn(&[Outcome]) -> bool| {
            one.iter().filter(|outcome| met(outcome)).count() as f64 / one.len() as f64
        };
        let passed = |bytes: &[u8]| Outcome::Pass(bytes.to_vec());
        for (rate, seen) in [
            (0.02, share(&|met| met.is_empty())),
            (0.02, share(&|met| met == [passed(LINE), passed(LINE)])),
            (0.02, share(&|met| met == [passed(b"ok\n"), passed(LINE)])),
            (0.02, share(&|met| matches!(met, [Outcome::Wait(late), _] if *late < STALLED))),
            (0.04, share(&|met| matches!(met, [Outcome::Pass(bytes)] if bytes != LINE))),
        ] {
            assert!((seen - rate).abs() < 0.004, "{seen} where {rate} is meant");
        }
        let one_bit = |met: &[Outcome]| match met {
            [Outcome::Pass(bytes)] => {
                let bits = bytes.iter().zip(LINE).map(|(a, b)| (a ^ b).count_ones());
                bits.sum::<u32>() == 1
            }
            _ => false,
        };
        assert!(share(&one_bit) > 0.018);
        assert!(share(&|met| met.contains(&Outcome::Cut)) > 0.0);
        assert!(share(&|met| met.contains(&Outcome::Reset)) > 0.0);
    }

    #[test]
    fn a_rate_is_a_share() {
        assert!(TroubleRates::even(1.5).is_err() && TroubleRates::even(-0.1).is_err());
    }

    #[tokio::test(start_paused = true)]
    async fn a_link_with_trouble_passes_lines_and_is_cut_as_a_whole() {
        let (host_end, mut device) = duplex(256);
        let mut host = troubled(host_end, TroubleRates::default(), 1);
        host.write_all(LINE).await.expect("it passes");
        let mut heard = vec![0; LINE.len()];
        device.read_exact(&mut heard).await.expect("it comes");
        assert_eq!(heard, LINE);

        let cut = TroubleRates { disconnect: Share(1.0), ..TroubleRates::default() };
        let (host_end, mut device) = duplex(256);
        let mut host = troubled(host_end, cut, 1);
        host.write_all(LINE).await.expect("it is taken");
        assert_eq!(device.read(&mut heard).await.expect("an end"), 0);
        assert_eq!(host.read(&mut heard).await.expect("an end"), 0);
    }
}
