//! The controls of the rig: one person or program has them at a time.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::sessions::Who;

/// How long the holder is warned before an admin takes the controls.
pub const WARNING: Duration = Duration::from_secs(10);

/// Somebody, as the others see them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Person {
    /// Number of the session or token.
    pub id: u64,
    /// Name.
    pub name: String,
}

impl From<&Who> for Person {
    fn from(who: &Who) -> Self {
        Self { id: who.id, name: who.name.clone() }
    }
}

/// Why the controls were not given.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LeaseRefusal {
    /// Somebody else has them.
    #[error("{0} has the controls")]
    Held(String),
    /// They can be handed over by their holder only.
    #[error("you do not have the controls")]
    NotYours,
}

/// Who has the controls, who asks for them, and who takes them.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Lease {
    holder: Option<Person>,
    asked: Vec<Person>,
    /// Who takes them after the warning.
    taking: Option<Person>,
    #[serde(skip)]
    taken_at: Option<Instant>,
}

impl Lease {
    /// Whether this session has the controls.
    pub fn is_held_by(&self, id: u64) -> bool {
        self.holder.as_ref().is_some_and(|holder| holder.id == id)
    }

    /// The session that has the controls.
    pub fn holder_id(&self) -> Option<u64> {
        self.holder.as_ref().map(|holder| holder.id)
    }

    /// Takes the controls, if nobody else has them.
    ///
    /// # Errors
    /// [`LeaseRefusal::Held`]. The request is kept, for the holder to see.
    pub fn take(&mut self, who: &Who) -> Result<(), LeaseRefusal> {
        match &self.holder {
            Some(holder) if holder.id != who.id => {
                let refusal = LeaseRefusal::Held(holder.name.clone());
                if self.asked.iter().all(|person| person.id != who.id) {
                    self.asked.push(who.into());
                }
                Err(refusal)
            }
            _ => {
                self.pass_to(who.into());
                Ok(())
            }
        }
    }

    /// Hands the controls to another session.
    ///
    /// # Errors
    /// [`LeaseRefusal::NotYours`].
    pub fn give(&mut self, who: &Who, to: &Who) -> Result<(), LeaseRefusal> {
        if !self.is_held_by(who.id) {
            return Err(LeaseRefusal::NotYours);
        }
        self.pass_to(to.into());
        Ok(())
    }

    /// Announces that an admin takes the controls. They pass at [`Lease::settle`] after the warning.
    pub fn seize(&mut self, who: &Who, now: Instant) {
        if !self.is_held_by(who.id) {
            self.taking = Some(who.into());
            self.taken_at = Some(now + WARNING);
        }
    }

    /// Whether an admin has announced to take them.
    pub fn is_being_taken(&self) -> bool {
        self.taking.is_some()
    }

    /// Passes the controls to the admin whose warning is over; whether they passed.
    pub fn settle(&mut self, now: Instant) -> bool {
        if self.taken_at.is_some_and(|at| at <= now)
            && let Some(person) = self.taking.clone()
        {
            self.pass_to(person);
            return true;
        }
        false
    }

    /// Frees what a session had or asked for; whether it had the controls.
    pub fn release(&mut self, id: u64) -> bool {
        self.asked.retain(|person| person.id != id);
        if self.taking.as_ref().is_some_and(|person| person.id == id) {
            (self.taking, self.taken_at) = (None, None);
        }
        let held = self.is_held_by(id);
        if held {
            self.holder = None;
        }
        held
    }

    fn pass_to(&mut self, person: Person) {
        self.asked.retain(|asked| asked.id != person.id);
        (self.taking, self.taken_at) = (None, None);
        self.holder = Some(person);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::access::role::Role;

    fn who(id: u64) -> Who {
        let (name, view_key) = (format!("person {id}"), String::new());
        Who { id, name, role: Role::Admin, csrf: None, view_key }
    }

    #[test]
    fn the_controls_are_asked_for_and_handed_over() {
        let mut lease = Lease::default();
        lease.take(&who(1)).expect("they are free");
        assert_eq!(lease.take(&who(2)), Err(LeaseRefusal::Held("person 1".to_owned())));
        assert_eq!(lease.asked, [Person::from(&who(2))]);
        assert_eq!(lease.give(&who(2), &who(2)), Err(LeaseRefusal::NotYours));
        lease.give(&who(1), &who(2)).expect("they are hers");
        assert!(lease.is_held_by(2) && lease.asked.is_empty());
        assert!(!lease.release(1));
        assert!(lease.release(2) && lease.holder.is_none());
    }

    #[test]
    fn an_admin_takes_them_after_the_warning() {
        let (mut lease, now) = (Lease::default(), Instant::now());
        lease.take(&who(1)).expect("they are free");
        lease.seize(&who(3), now);
        assert!(!lease.settle(now + WARNING / 2) && lease.is_held_by(1));
        assert!(lease.settle(now + WARNING) && lease.is_held_by(3));
        assert!(!lease.settle(now + WARNING * 2));
        lease.seize(&who(1), now);
        lease.release(1);
        assert!(!lease.settle(now + WARNING), "who has left takes nothing");
    }

    proptest! {
        /// Whatever people do, nobody loses the controls to a person who only takes or releases.
        #[test]
        fn only_the_holder_or_an_admin_changes_the_holder(acts in prop::collection::vec((0..4u8, 1..4u64), 0..60)) {
            let (mut lease, now) = (Lease::default(), Instant::now());
            for (act, id) in acts {
                let before = lease.holder_id();
                match act {
                    0 => drop(lease.take(&who(id))),
                    1 => drop(lease.release(id)),
                    2 => drop(lease.give(&who(id), &who(id % 3 + 1))),
                    _ => drop(lease.settle(now)),
                }
                let after = lease.holder_id();
                prop_assert!(before == after || before.is_none() || before == Some(id));
            }
        }
    }
}
