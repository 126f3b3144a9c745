//! Failed log-ins slow further ones down, by address.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Wait after the first failure; each further one doubles it.
const FIRST_WAIT: Duration = Duration::from_millis(100);

/// Longest wait. Somebody who mistyped must not wait longer than a person's patience.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// How long failures count.
const REMEMBERED: Duration = Duration::from_secs(15 * 60);

/// Addresses that are remembered; whoever has more of them than this is slowed down as one.
const MOST_ADDRESSES: usize = 10_000;

/// The failures of each address.
#[derive(Debug, Default)]
pub(crate) struct FailedLogins(Mutex<HashMap<IpAddr, (u32, Instant)>>);

impl FailedLogins {
    fn known(&self) -> MutexGuard<'_, HashMap<IpAddr, (u32, Instant)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins an attempt, which counts as failed until [`FailedLogins::succeeded`]: many at once do not escape the wait. How long to wait.
    pub fn attempt(&self, from: IpAddr, now: Instant) -> Duration {
        let mut known = self.known();
        known.retain(|_, (_, last)| now.saturating_duration_since(*last) < REMEMBERED);
        let from = if known.len() < MOST_ADDRESSES || known.contains_key(&network(from)) {
            network(from)
        } else {
            IpAddr::from([0, 0, 0, 0])
        };
        let (failures, last) = known.entry(from).or_insert((0, now));
        let before = *failures;
        (*failures, *last) = (before.saturating_add(1), now);
        match before {
            0 => Duration::ZERO,
            n => FIRST_WAIT.saturating_mul(1 << (n - 1).min(16)).min(LONGEST_WAIT),
        }
    }

    /// The attempt succeeded: what failed before from this address is forgotten.
    pub fn succeeded(&self, from: IpAddr) {
        self.known().remove(&network(from));
    }
}

/// The address, or for IPv6 its network of 64 bits, which one host has to itself.
pub(super) fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => {
            let [a, b, c, d, ..] = address.segments();
            IpAddr::from([a, b, c, d, 0, 0, 0, 0])
        }
        v4 => v4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_slow_down_their_address_alone() {
        let (failed, now) = (FailedLogins::default(), Instant::now());
        let (mallory, ada) = (IpAddr::from([10, 0, 0, 1]), IpAddr::from([10, 0, 0, 2]));
        let waits: Vec<u128> = (0..8).map(|_| failed.attempt(mallory, now).as_millis()).collect();
        assert_eq!(waits, [0, 100, 200, 400, 800, 1600, 3200, 5000]);
        assert_eq!(failed.attempt(ada, now), Duration::ZERO);
        failed.succeeded(mallory);
        assert_eq!(failed.attempt(mallory, now), Duration::ZERO);
        assert_eq!(failed.attempt(mallory, now + REMEMBERED), Duration::ZERO);
    }

    #[test]
    fn a_host_is_one_address_whatever_it_calls_itself() {
        let text = |text: &str| network(text.parse().expect("an address"));
        assert_eq!(text("2001:db8:1:2:3:4:5:6"), text("2001:db8:1:2::1"));
        assert_ne!(text("2001:db8:1:2::1"), text("2001:db8:1:3::1"));
        assert_eq!(text("::ffff:10.0.0.1"), text("10.0.0.1"));
    }

    #[test]
    fn many_addresses_share_one_wait() {
        let (failed, now) = (FailedLogins::default(), Instant::now());
        let address = |n: u32| IpAddr::from((0x0a00_0000 + n).to_be_bytes());
        for n in 0..MOST_ADDRESSES as u32 {
            failed.attempt(address(n), now);
        }
        let waits = (0..4).map(|n| failed.attempt(address(1_000_000 + n), now));
        assert!(waits.last() > Some(FIRST_WAIT));
        assert!(failed.known().len() <= MOST_ADDRESSES + 1);
    }
}
