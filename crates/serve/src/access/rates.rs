//! How often an address may ask: a token bucket for each.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::failed_logins::network;

/// Requests a second that are answered for long. A jog sends 12.5, and twenty pages behind one address may do what one person does.
const A_SECOND: f64 = 200.0;

/// Requests that are answered at once: twenty pages that open at the same time ask for some 15 parts each.
const AT_ONCE: f64 = 1000.0;

/// Addresses that are counted by themselves; all others share one count.
const MOST_ADDRESSES: usize = 10_000;

#[derive(Debug, Clone, Copy)]
struct Bucket {
    left: f64,
    at: Instant,
}

/// The requests that each address has left.
#[derive(Debug, Default)]
pub(crate) struct Rates(Mutex<HashMap<IpAddr, Bucket>>);

impl Bucket {
    fn filled(self, now: Instant) -> Self {
        let passed = now.saturating_duration_since(self.at).as_secs_f64();
        Self { left: (self.left + A_SECOND * passed).min(AT_ONCE), at: now }
    }
}

impl Rates {
    /// Whether a request of this address is answered now.
    pub fn allow(&self, from: IpAddr, now: Instant) -> bool {
        let mut buckets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut from = network(from);
        if buckets.len() >= MOST_ADDRESSES && !buckets.contains_key(&from) {
            buckets.retain(|_, bucket| bucket.filled(now).left < AT_ONCE);
            if buckets.len() >= MOST_ADDRESSES {
                from = IpAddr::from([0, 0, 0, 0]);
            }
        }
        let bucket = buckets.entry(from).or_insert(Bucket { left: AT_ONCE, at: now });
        *bucket = bucket.filled(now);
        let allowed = bucket.left >= 1.0;
        if allowed {
            bucket.left -= 1.0;
        }
        allowed
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn who_asks_too_often_waits_and_nobody_else() {
        let (rates, now) = (Rates::default(), Instant::now());
        let (one, other) = (IpAddr::from([10, 0, 0, 1]), IpAddr::from([10, 0, 0, 2]));
        let answered = (0..5000).filter(|_| rates.allow(one, now)).count();
        assert_eq!(answered as f64, AT_ONCE);
        assert!(rates.allow(other, now));
        let later = now + Duration::from_secs(2);
        assert_eq!((0..5000).filter(|_| rates.allow(one, later)).count() as f64, 2.0 * A_SECOND);
    }

    #[test]
    fn more_addresses_than_are_counted_share_one_count() {
        let (rates, now) = (Rates::default(), Instant::now());
        let address = |n: u32| IpAddr::from((0x0a00_0000 + n).to_be_bytes());
        let answered = (0..20_000).filter(|&n| rates.allow(address(n), now)).count();
        assert_eq!(answered, MOST_ADDRESSES + AT_ONCE as usize);
        // They are forgotten once they have asked nothing for a while.
        let later = now + Duration::from_secs(10);
        assert!((0..MOST_ADDRESSES as u32).all(|n| rates.allow(address(50_000 + n), later)));
    }
}
