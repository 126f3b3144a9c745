//! Authenticated encryption (XChaCha20-Poly1305): without the key nobody can read the bytes, and every change is detected.
//!
//! The sealed bytes are a random nonce of 24 bytes and the cipher text with its tag (RFC 8439 with the longer nonce of
//! draft-irtf-cfrg-xchacha). A key file holds 64 hexadecimal digits.

use chacha20poly1305::aead::{Aead, Generate, KeyInit, Payload};
use chacha20poly1305::{XChaCha20Poly1305, XNonce};

const NONCE_BYTES: usize = 24;

/// A key of 32 bytes.
#[derive(Clone, PartialEq, Eq)]
pub struct Key(chacha20poly1305::Key);

/// The system gave no random numbers.
#[derive(Debug, thiserror::Error)]
#[error("the system gave no random numbers: {0}")]
pub struct NoRandomness(String);

impl Key {
    /// A random key.
    ///
    /// # Errors
    /// [`NoRandomness`] if the system gives no random numbers.
    pub fn draw() -> Result<Self, NoRandomness> {
        random().map(Self)
    }

    /// Reads the text of a key file; `None` unless it is 64 hexadecimal digits.
    pub fn parse(text: &[u8]) -> Option<Self> {
        let digits = text.trim_ascii();
        let byte = |pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
        let bytes: Vec<u8> = digits.chunks(2).map(byte).collect::<Option<_>>()?;
        chacha20poly1305::Key::try_from(bytes.as_slice()).ok().map(Self)
    }

    /// The text of a key file.
    pub fn text(&self) -> String {
        hex(&self.0) + "\n"
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// Encrypts `plain`. The same `bound` bytes are needed to open it; they are authenticated and not encrypted.
    ///
    /// # Errors
    /// [`NoRandomness`] if the system gives no random numbers.
    pub fn seal(&self, plain: &[u8], bound: &[u8]) -> Result<Vec<u8>, NoRandomness> {
        let nonce: XNonce = random()?;
        let payload = Payload { msg: plain, aad: bound };
        let mut sealed = nonce.to_vec();
        let cipher = XChaCha20Poly1305::new(&self.0);
        sealed.extend(cipher.encrypt(&nonce, payload).expect("what is sealed fits into memory"));
        Ok(sealed)
    }

    /// Decrypts; `None` if key, bytes or `bound` are not those of [`Key::seal`].
    pub fn open(&self, sealed: &[u8], bound: &[u8]) -> Option<Vec<u8>> {
        let (nonce, cipher_text) = sealed.split_at_checked(NONCE_BYTES)?;
        let nonce = XNonce::try_from(nonce).ok()?;
        let payload = Payload { msg: cipher_text, aad: bound };
        XChaCha20Poly1305::new(&self.0).decrypt(&nonce, payload).ok()
    }
}

/// A random number from the system.
///
/// # Errors
/// [`NoRandomness`] if the system gives none.
pub fn fresh_number() -> Result<u64, NoRandomness> {
    let key = Key::draw()?;
    Ok(key.bytes().iter().take(8).fold(0, |number, &byte| number << 8 | u64::from(byte)))
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn random<T: Generate>() -> Result<T, NoRandomness> {
    T::try_generate().map_err(|error| NoRandomness(error.to_string()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `draft-irtf-cfrg-xchacha-03`, appendix A.3.1: key, nonce, bound bytes, plain text, cipher text.
    #[test]
    fn the_vector_of_the_draft_opens() {
        let key: String = (0x80..=0x9f).map(|byte: u8| format!("{byte:02x}")).collect();
        let key = Key::parse(key.as_bytes()).expect("a key");
        let bound = [0x50, 0x51, 0x52, 0x53, 0xc0, 0xc1, 0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7];
        let nonce = 0x40..=0x57;
        let cipher_text_and_tag = "bd6d179d3e83d43b9576579493c0e939572a1700252bfaccbed2902c21396cbb\
                                   731c7f1b0b4aa6440bf3a82f4eda7e39ae64c6708c54c216cb96b72e1213b452\
                                   2f8c9ba40db5d945b11b69b982c1bb9e3f3fac2bc369488f76b2383565d3fff9\
                                   21f9664c97637da9768812f615c68b13b52e\
                                   c0875924c1c7987947deafd8780acf49";
        let pair = |at| {
            u8::from_str_radix(&cipher_text_and_tag[at..at + 2], 16).expect("hexadecimal digits")
        };
        let sealed: Vec<u8> =
            nonce.chain((0..cipher_text_and_tag.len()).step_by(2).map(pair)).collect();
        let plain = key.open(&sealed, &bound).expect("it is its own key");
        assert!(plain.starts_with(b"Ladies and Gentlemen of the class of '99"), "{plain:?}");
    }

    proptest! {
        #[test]
        fn sealed_bytes_open_unchanged_and_not_after_any_change(
            plain in prop::collection::vec(any::<u8>(), 0..200), flip in any::<prop::sample::Index>(), bit in 0u8..8
        ) {
            let key = Key::draw().expect("random numbers");
            let mut sealed = key.seal(&plain, b"bound").expect("random numbers");
            prop_assert_eq!(key.open(&sealed, b"bound"), Some(plain));
            prop_assert_eq!(key.open(&sealed, b"other"), None);
            prop_assert_eq!(Key::draw().expect("random numbers").open(&sealed, b"bound"), None);
            let at = flip.index(sealed.len());
            sealed[at] ^= 1 << bit;
            prop_assert_eq!(key.open(&sealed, b"bound"), None);
        }

        #[test]
        fn a_parsed_key_is_written_and_parsed_again(text in prop::collection::vec(any::<u8>(), 0..80)) {
            if let Some(key) = Key::parse(&text) {
                prop_assert!(Key::parse(key.text().as_bytes()) == Some(key));
            }
        }
    }
}
