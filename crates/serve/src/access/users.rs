//! The users who may log in from other computers: a TOML file with a name, a role and the Argon2id hash of a password for each.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::SystemTime;

use argon2::Argon2;
use argon2::password_hash::phc::PasswordHash;
use argon2::password_hash::{PasswordHasher, PasswordVerifier};
use serde::{Deserialize, Serialize};

use fieldgap_input::{Fault, toml_file};

use super::role::Role;

/// Longest name of a user, characters.
pub(crate) const LONGEST_NAME: usize = 60;

/// Shortest password, characters, where it is all that is asked for (NIST SP 800-63B-4, section 3.1.1.2).
pub const SHORTEST_PASSWORD: usize = 15;

/// Longest password, bytes: what is longer only keeps the processor busy.
const LONGEST_PASSWORD: usize = 1024;

/// What an attempt under an unknown name is compared with, so that it takes as long as under a known one.
static NOBODY: LazyLock<Option<String>> = LazyLock::new(|| hash("nobody has this password").ok());

/// Why the file of users was not changed.
#[derive(Debug, thiserror::Error)]
pub enum UserError {
    /// The file cannot be read, or is wrong.
    #[error(transparent)]
    File(#[from] Fault),
    /// The file cannot be written.
    #[error("the users cannot be written to {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It is no name.
    #[error("{0:?} is no name of a user: use 1 to {LONGEST_NAME} visible characters")]
    Name(String),
    /// There is such a user.
    #[error("there is a user {0} already: remove the user first to change role or password")]
    Known(String),
    /// There is no such user.
    #[error("there is no user {0}")]
    Unknown(String),
    /// It has the wrong length.
    #[error(
        "a password has at least {SHORTEST_PASSWORD} characters, and at most {LONGEST_PASSWORD} bytes: take several words"
    )]
    Password,
    /// No random numbers, or too little memory.
    #[error("the password cannot be hashed: {0}")]
    Hash(String),
}

/// A user.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct User {
    /// The name to log in with.
    pub name: UserName,
    /// What the user may do.
    pub role: Role,
    /// The hash of the password, in the PHC string format.
    password: Hash,
}

/// A name of 1 to 60 visible characters, without white space around it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String")]
pub struct UserName(String);

/// An Argon2id hash that can be compared with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String")]
struct Hash(String);

/// All users of a file.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Users {
    #[serde(default, rename = "user")]
    users: Vec<User>,
}

impl UserName {
    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for UserName {
    type Error = UserError;

    fn try_from(text: String) -> Result<Self, UserError> {
        let name = text.trim();
        let good = !name.is_empty()
            && name.chars().count() <= LONGEST_NAME
            && !name.chars().any(fieldgap_input::is_hidden);
        if good { Ok(Self(name.to_owned())) } else { Err(UserError::Name(text)) }
    }
}

impl TryFrom<String> for Hash {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match PasswordHash::new(&text) {
            Ok(hash) if hash.algorithm.as_str() == "argon2id" => Ok(Self(text)),
            _ => Err("this is no Argon2id hash; `fieldgap serve user add` makes one".to_owned()),
        }
    }
}

impl Users {
    /// Reads the users of a file; there are none if the file does not exist.
    ///
    /// # Errors
    /// The file cannot be read, or is wrong.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        if path.exists() { toml_file(path) } else { Ok(Self::default()) }
    }

    /// All users, in the order of the file.
    pub fn all(&self) -> &[User] {
        &self.users
    }

    /// Adds a user.
    ///
    /// # Errors
    /// There is such a user, or the password has the wrong length.
    pub fn add(&mut self, name: UserName, role: Role, password: &str) -> Result<(), UserError> {
        if self.users.iter().any(|user| user.name == name) {
            return Err(UserError::Known(name.0));
        }
        if password.chars().count() < SHORTEST_PASSWORD || password.len() > LONGEST_PASSWORD {
            return Err(UserError::Password);
        }
        self.users.push(User { name, role, password: Hash(hash(password)?) });
        Ok(())
    }

    /// Removes a user.
    ///
    /// # Errors
    /// There is no such user.
    pub fn remove(&mut self, name: &str) -> Result<(), UserError> {
        let before = self.users.len();
        self.users.retain(|user| user.name.as_str() != name);
        if self.users.len() == before { Err(UserError::Unknown(name.to_owned())) } else { Ok(()) }
    }

    /// Writes the file, which only its owner can read.
    ///
    /// # Errors
    /// The file cannot be written; the old one then still exists.
    pub fn write(&self, path: &Path) -> Result<(), UserError> {
        let failed = |source| UserError::Write { path: path.to_owned(), source };
        let text = toml::to_string(self).map_err(|error| failed(io::Error::other(error)))?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        fs::create_dir_all(folder).map_err(failed)?;
        // A temporary file is readable by its owner only, and keeps that when it gets its name.
        let new = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
        fs::write(new.path(), text)
            .and_then(|()| new.as_file().sync_all())
            .and_then(|()| new.persist(path).map_err(|error| error.error))
            .map(drop)
            .map_err(failed)
    }

    /// The user with this name and password. It takes as long for a name that is not known.
    pub fn with_password(&self, name: &str, password: &str) -> Option<&User> {
        let user = self.users.iter().find(|user| user.name.as_str() == name);
        let hash = user.map(|user| &user.password.0).or(NOBODY.as_ref())?;
        let hash = PasswordHash::new(hash).ok()?;
        let fits = password.len() <= LONGEST_PASSWORD
            && Argon2::default().verify_password(password.as_bytes(), &hash).is_ok();
        user.filter(|_| fits)
    }

    /// Whether a user is in the file as it was when a session began: with the same role and password.
    pub fn still_has(&self, user: &User) -> bool {
        self.users.contains(user)
    }
}

/// Hashes a password by Argon2id with 19 MiB and two passes (RFC 9106; the least that OWASP's password storage cheat sheet asks for).
fn hash(password: &str) -> Result<String, UserError> {
    let hash = Argon2::default().hash_password(password.as_bytes());
    Ok(hash.map_err(|error| UserError::Hash(error.to_string()))?.to_string())
}

/// The file of the users, read again when it has changed.
#[derive(Debug)]
pub(crate) struct UserFile {
    path: PathBuf,
    changed: Option<SystemTime>,
    users: Users,
}

impl UserFile {
    /// Of users that were read from a file.
    pub fn new(path: PathBuf, users: Users) -> Self {
        Self { changed: modified(&path), path, users }
    }

    /// The users.
    pub fn users(&self) -> &Users {
        &self.users
    }

    /// Reads the file again if it has changed; whether it has. A file that has become wrong lets nobody log in.
    pub fn refresh(&mut self) -> Result<bool, Fault> {
        let changed = modified(&self.path);
        if changed == self.changed {
            return Ok(false);
        }
        self.changed = changed;
        self.users = Users::default();
        self.users = Users::read(&self.path)?;
        Ok(true)
    }
}

fn modified(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|about| about.modified()).ok()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    const PASSWORD: &str = "nine white horses";

    fn name(text: &str) -> UserName {
        text.to_owned().try_into().expect("a name")
    }

    #[test]
    fn a_user_is_known_by_name_and_password_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("settings/users.toml");
        let mut users = Users::read(&path).expect("none");
        users.add(name("Ada"), Role::Operator, PASSWORD).expect("added");
        users.write(&path).expect("written");
        assert_eq!(fs::metadata(&path).expect("there").permissions().mode() & 0o777, 0o600);
        let text = fs::read_to_string(&path).expect("read");
        assert!(
            text.contains("$argon2id$v=19$m=19456,t=2,p=1$") && !text.contains(PASSWORD),
            "{text}"
        );

        let mut users = Users::read(&path).expect("read");
        let ada = users.with_password("Ada", PASSWORD).expect("it is hers").clone();
        assert_eq!((ada.name.as_str(), ada.role), ("Ada", Role::Operator));
        for (name, password) in
            [("Ada", "nine white horsez"), ("ada", PASSWORD), ("Ada", ""), ("", "")]
        {
            assert!(users.with_password(name, password).is_none(), "{name} {password}");
        }
        assert!(users.with_password("Bob", "nobody has this password").is_none());
        assert!(matches!(
            users.add(name(" Ada "), Role::Admin, PASSWORD),
            Err(UserError::Known(_))
        ));
        assert!(matches!(
            users.add(name("Bob"), Role::Viewer, "fourteen chars"),
            Err(UserError::Password)
        ));
        assert!(users.still_has(&ada));
        users.remove("Ada").expect("removed");
        users.add(name("Ada"), Role::Viewer, PASSWORD).expect("added");
        assert!(!users.still_has(&ada), "her role was changed");
        assert!(matches!(users.remove("Bob"), Err(UserError::Unknown(_))));
    }

    #[test]
    fn a_file_with_another_hash_is_refused_at_its_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("users.toml");
        for hash in ["secret", "$2b$12$KIXQDXyYCJd0dhFGSLuu1uXqLNdlXRqrnrDBVCnLGiTR1k1qCUWAe"] {
            fs::write(
                &path,
                format!("[[user]]\nname = \"Ada\"\nrole = \"admin\"\npassword = \"{hash}\"\n"),
            )
            .expect("written");
            let fault = Users::read(&path).expect_err("it is no hash").to_string();
            assert!(fault.contains("users.toml:4:12: this is no Argon2id hash"), "{fault}");
        }
        fs::write(&path, "[[user]]\nname = \"\"\nrole = \"admin\"\npassword = \"\"\n")
            .expect("written");
        assert!(Users::read(&path).expect_err("no name").to_string().contains("users.toml:2:8"));
    }
}
