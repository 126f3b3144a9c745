//! Random secrets, and the digests by which they are known.

use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use sha2::{Digest as _, Sha256};

/// A secret of 256 bits from the operating system, 43 characters that may stand in an address.
pub(crate) fn secret() -> String {
    let mut bytes = [0; 32];
    // Without random numbers nobody may be let in: it is better to end the request than to go on.
    getrandom::fill(&mut bytes).expect("the operating system gives random numbers");
    URL_SAFE_NO_PAD.encode(bytes)
}

/// The digest of a secret. Only digests are stored and compared, so the time of a comparison tells nothing of the secret.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Digest([u8; 32]);

impl Digest {
    pub fn of(secret: &str) -> Self {
        Self(sha256(secret.as_bytes()))
    }
}

/// The SHA-256 of a text, in hexadecimal digits.
pub(crate) fn fingerprint(text: &[u8]) -> String {
    sha256(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The SHA-256 of bytes.
pub(crate) fn sha256(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_differ_and_are_known_by_their_digest() {
        let (one, other) = (secret(), secret());
        assert_eq!(one.len(), 43);
        assert_ne!(one, other);
        assert_ne!(Digest::of(&one), Digest::of(&other));
        // FIPS 180-2, appendix B.1.
        assert_eq!(
            fingerprint(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }
}
