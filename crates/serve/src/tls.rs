//! The certificate by which other computers know this one.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rcgen::{Certificate, CertificateParams, DistinguishedName, DnType, KeyPair};
use rustls::ServerConfig;
use rustls::crypto::ring;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};

use crate::access::secret::sha256;

/// A certificate and its private key.
#[derive(Debug, Clone)]
pub struct Identity {
    config: Arc<ServerConfig>,
    fingerprint: String,
}

/// Why there is no certificate.
#[derive(Debug, thiserror::Error)]
pub enum NoIdentity {
    /// A file cannot be read.
    #[error("{} holds no {what} that can be read: {problem}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Certificate or private key.
        what: &'static str,
        /// Why.
        problem: String,
    },
    /// They do not belong together.
    #[error("the private key {} does not fit the certificate {}: {problem}", key.display(), certificate.display())]
    Pair {
        /// File of the certificate.
        certificate: PathBuf,
        /// File of the key.
        key: PathBuf,
        /// Why.
        problem: String,
    },
    /// A self-signed one cannot be made.
    #[error("no certificate can be made for {names}: {problem}")]
    Make {
        /// The names that it was to hold.
        names: String,
        /// Why.
        problem: String,
    },
    /// A self-signed one cannot be kept.
    #[error("the certificate cannot be kept in {}: {source}", folder.display())]
    Keep {
        /// The folder.
        folder: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl Identity {
    /// Reads a certificate, with those of its issuers after it, and its private key; both PEM.
    ///
    /// # Errors
    /// A file cannot be read, or they do not belong together.
    pub fn read(certificate: &Path, key: &Path) -> Result<Self, NoIdentity> {
        let unreadable = |path: &Path, what, problem: String| NoIdentity::Read {
            path: path.to_owned(),
            what,
            problem,
        };
        let chain: Vec<CertificateDer<'static>> = CertificateDer::pem_file_iter(certificate)
            .and_then(Iterator::collect)
            .map_err(|error| unreadable(certificate, "certificate", error.to_string()))?;
        let first = chain.first().ok_or_else(|| {
            unreadable(certificate, "certificate", "there is none in PEM form".to_owned())
        })?;
        let pairs: Vec<String> = sha256(first).iter().map(|byte| format!("{byte:02X}")).collect();
        let secret = PrivateKeyDer::from_pem_file(key)
            .map_err(|error| unreadable(key, "private key", error.to_string()))?;
        let pair = |error: rustls::Error| NoIdentity::Pair {
            certificate: certificate.to_owned(),
            key: key.to_owned(),
            problem: error.to_string(),
        };
        let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(pair)?
            .with_no_client_auth()
            .with_single_cert(chain, secret)
            .map_err(pair)?;
        Ok(Self { config: Arc::new(config), fingerprint: pairs.join(":") })
    }

    /// The self-signed certificate in a folder, which is made at the first call, for these names and addresses of this computer.
    ///
    /// # Errors
    /// It cannot be made, kept or read.
    pub fn self_signed(folder: &Path, names: &[String]) -> Result<Self, NoIdentity> {
        let (certificate, key) = (folder.join("certificate.pem"), folder.join("private-key.pem"));
        if !certificate.exists() {
            let (cert, signing_key) = made(names).map_err(|error| NoIdentity::Make {
                names: names.join(", "),
                problem: error.to_string(),
            })?;
            let keep = |source| NoIdentity::Keep { folder: folder.to_owned(), source };
            fs::create_dir_all(folder).map_err(keep)?;
            // The key first: a certificate is only there together with its key. A temporary file is readable by its owner only.
            for (path, text) in [(&key, signing_key.serialize_pem()), (&certificate, cert.pem())] {
                let new = tempfile::NamedTempFile::new_in(folder).map_err(keep)?;
                fs::write(new.path(), text).map_err(keep)?;
                new.persist(path).map_err(|error| keep(error.error))?;
            }
        }
        Self::read(&certificate, &key)
    }

    /// SHA-256 of the certificate, as browsers show it: 32 pairs of hexadecimal digits with colons.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    pub(crate) fn config(&self) -> Arc<ServerConfig> {
        Arc::clone(&self.config)
    }
}

/// A certificate for these names, with its key. It does not expire: people know it by its fingerprint.
fn made(names: &[String]) -> Result<(Certificate, KeyPair), rcgen::Error> {
    let mut certificate = CertificateParams::new(names)?;
    certificate.distinguished_name = DistinguishedName::new();
    certificate.distinguished_name.push(DnType::CommonName, "fieldgap");
    let key = KeyPair::generate()?;
    Ok((certificate.self_signed(&key)?, key))
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn a_certificate_is_made_once_and_its_key_is_private() {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = folder.path().join("settings");
        let names = ["bench.example".to_owned(), "127.0.0.1".to_owned()];
        let first = Identity::self_signed(&settings, &names).expect("made");
        let again = Identity::self_signed(&settings, &names).expect("read");
        assert_eq!(first.fingerprint(), again.fingerprint());
        assert_eq!(first.fingerprint().len(), 32 * 3 - 1);
        let mode =
            fs::metadata(settings.join("private-key.pem")).expect("there").permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }

    #[test]
    fn files_that_do_not_fit_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let (one, other) = (folder.path().join("one"), folder.path().join("other"));
        let names = ["bench.example".to_owned()];
        Identity::self_signed(&one, &names).expect("made");
        Identity::self_signed(&other, &names).expect("made");
        let (certificate, key) = (one.join("certificate.pem"), other.join("private-key.pem"));
        assert!(matches!(Identity::read(&certificate, &key), Err(NoIdentity::Pair { .. })));
        let swapped = Identity::read(&key, &certificate).expect_err("swapped").to_string();
        assert!(swapped.contains("private-key.pem holds no certificate"), "{swapped}");
        let missing = Identity::read(&one.join("none.pem"), &key).expect_err("missing").to_string();
        assert!(missing.contains("none.pem"), "{missing}");
    }
}
