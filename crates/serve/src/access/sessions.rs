//! Who may use the server: one-time links, the sessions that they open, and tokens for programs.
//!
//! Sessions and tokens end with the server. Only digests of their secrets are kept.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::role::Role;
use super::secret::{Digest, secret};
use super::users::{User, Users};

/// How long a one-time link may be used.
const LINK_LASTS: Duration = Duration::from_secs(15 * 60);

/// How long a session lasts without a request: a day at the bench.
const SESSION_LASTS: Duration = Duration::from_secs(12 * 3600);

/// Most sessions at once; a further log-in is refused.
const MOST_SESSIONS: usize = 1000;

/// The person or program of a request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Who {
    /// Number of the session or token.
    pub id: u64,
    /// The name under which it acts.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// What a page sends along with every request that changes something; `None` for tokens, which no page sends unasked.
    #[serde(skip)]
    pub csrf: Option<String>,
    /// The part of an address that shows the files of records without a cookie.
    #[serde(skip)]
    pub view_key: String,
}

/// A new session: its secret, for the cookie, and who it is.
#[derive(Debug)]
pub struct Opened {
    /// The secret.
    pub secret: String,
    /// Who it is.
    pub who: Who,
}

#[derive(Debug)]
struct Link {
    role: Role,
    name: String,
    until: Instant,
}

#[derive(Debug)]
struct Entry {
    who: Who,
    until: Instant,
    lasts: Option<Duration>,
    /// The user of the file who opened it by password.
    user: Option<User>,
}

#[derive(Debug, Default)]
struct Known {
    links: HashMap<Digest, Link>,
    entries: HashMap<Digest, Entry>,
    next_id: u64,
}

/// All links, sessions and tokens.
#[derive(Debug, Default)]
pub struct Sessions(Mutex<Known>);

impl Sessions {
    fn known(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes a link that opens one session, within 15 minutes; its secret.
    pub fn invite(&self, name: &str, role: Role, now: Instant) -> String {
        let secret = secret();
        let link = Link { role, name: name.to_owned(), until: now + LINK_LASTS };
        let mut known = self.known();
        known.links.retain(|_, link| link.until > now);
        known.links.insert(Digest::of(&secret), link);
        secret
    }

    /// Opens a session by the secret of a link, which is used up; `None` if no link has it, or if there are too many sessions.
    pub fn open(&self, link: &str, now: Instant) -> Option<Opened> {
        let mut known = self.known();
        known.make_room(now)?;
        let link = known.links.remove(&Digest::of(link)).filter(|link| link.until > now)?;
        Some(known.add_session(link.name, link.role, None, now))
    }

    /// Opens a session of a user who gave the password; `None` if there are too many sessions.
    pub fn open_for(&self, user: &User, now: Instant) -> Option<Opened> {
        let mut known = self.known();
        known.make_room(now)?;
        Some(known.add_session(user.name.as_str().to_owned(), user.role, Some(user.clone()), now))
    }

    /// The sessions of users who are not in the file any more, or with another role or password.
    pub fn of_others_than(&self, users: &Users) -> Vec<u64> {
        let known = self.known();
        let gone = known
            .entries
            .values()
            .filter(|entry| entry.user.as_ref().is_some_and(|user| !users.still_has(user)));
        gone.map(|entry| entry.who.id).collect()
    }

    /// Makes a token for a program, which ends after `lasts`.
    pub fn token(&self, name: &str, role: Role, lasts: Duration, now: Instant) -> Opened {
        self.known().add(name.to_owned(), role, None, (now + lasts, None), None)
    }

    /// Who has this secret. The use of a session prolongs it; a token ends when it was made to end.
    pub fn who(&self, secret: &str, now: Instant) -> Option<Who> {
        let mut known = self.known();
        let entry = known.entries.get_mut(&Digest::of(secret))?;
        if entry.until <= now {
            return None;
        }
        if let Some(lasts) = entry.lasts {
            entry.until = now + lasts;
        }
        Some(entry.who.clone())
    }

    /// Who has this view key.
    pub fn viewer(&self, view_key: &str, now: Instant) -> Option<Who> {
        let wanted = Digest::of(view_key);
        let known = self.known();
        let mut valid = known.entries.values().filter(|entry| entry.until > now);
        valid.find(|entry| Digest::of(&entry.who.view_key) == wanted).map(|entry| entry.who.clone())
    }

    /// Ends the session or token with this number.
    pub fn end(&self, id: u64) {
        self.known().entries.retain(|_, entry| entry.who.id != id);
    }

    /// Everybody who has a session or token now.
    pub fn all(&self, now: Instant) -> Vec<Who> {
        let known = self.known();
        let valid = known.entries.values().filter(|entry| entry.until > now);
        let mut all: Vec<Who> = valid.map(|entry| entry.who.clone()).collect();
        all.sort_by_key(|who| who.id);
        all
    }
}

impl Known {
    fn make_room(&mut self, now: Instant) -> Option<()> {
        self.entries.retain(|_, entry| entry.until > now);
        (self.entries.len() < MOST_SESSIONS).then_some(())
    }

    fn add_session(
        &mut self,
        name: String,
        role: Role,
        user: Option<User>,
        now: Instant,
    ) -> Opened {
        let lasts = (now + SESSION_LASTS, Some(SESSION_LASTS));
        self.add(name, role, Some(secret()), lasts, user)
    }

    fn add(
        &mut self,
        name: String,
        role: Role,
        csrf: Option<String>,
        (until, lasts): (Instant, Option<Duration>),
        user: Option<User>,
    ) -> Opened {
        self.next_id += 1;
        let who = Who { id: self.next_id, name, role, csrf, view_key: secret() };
        let secret = secret();
        self.entries.insert(Digest::of(&secret), Entry { who: who.clone(), until, lasts, user });
        Opened { secret, who }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_opens_one_session() {
        let (sessions, now) = (Sessions::default(), Instant::now());
        let link = sessions.invite("Ada", Role::Operator, now);
        let opened = sessions.open(&link, now).expect("it is new");
        assert!(sessions.open(&link, now).is_none());
        let who = sessions.who(&opened.secret, now).expect("it is open");
        assert_eq!((who.name.as_str(), who.role), ("Ada", Role::Operator));
        assert_eq!(sessions.viewer(&who.view_key, now), Some(who.clone()));
        assert_eq!(sessions.who(&who.view_key, now), None, "a view key is no session");
        sessions.end(who.id);
        assert_eq!(sessions.who(&opened.secret, now), None);
        assert_eq!(sessions.viewer(&who.view_key, now), None);
    }

    #[test]
    fn links_sessions_and_tokens_end() {
        let (sessions, now) = (Sessions::default(), Instant::now());
        let link = sessions.invite("late", Role::Viewer, now);
        assert!(sessions.open(&link, now + LINK_LASTS).is_none());
        let link = sessions.invite("idle", Role::Viewer, now);
        let opened = sessions.open(&link, now).expect("in time");
        let used = now + SESSION_LASTS / 2;
        assert!(sessions.who(&opened.secret, used).is_some());
        assert!(sessions.who(&opened.secret, used + SESSION_LASTS * 2 / 3).is_some());
        assert!(sessions.who(&opened.secret, used + SESSION_LASTS * 2).is_none());
        let token = sessions.token("script", Role::Viewer, Duration::from_secs(60), now);
        assert!(sessions.who(&token.secret, now + Duration::from_secs(59)).is_some());
        assert!(sessions.who(&token.secret, now + Duration::from_secs(60)).is_none());
    }
}
