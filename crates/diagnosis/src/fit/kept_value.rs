//! A value that several threads ask for and one computes.

use std::sync::OnceLock;

/// The value of a cell; if it has none, what is computed here.
///
/// It is computed outside of the cell's lock, perhaps by more than one thread. The computation may itself be shared among threads, and a thread
/// that waits for the others is then given another task, which may ask for the same value: within the lock it would wait for itself.
pub(crate) fn kept<T>(cell: &OnceLock<T>, compute: impl FnOnce() -> T) -> &T {
    cell.get().unwrap_or_else(|| {
        let value = compute();
        cell.get_or_init(|| value)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a thread of its own, which within the lock would wait for itself.
    #[test]
    fn who_computes_a_value_may_ask_for_it() {
        let (said, heard) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let cell = OnceLock::new();
            let inner = |cell: &OnceLock<i32>| *kept(cell, || 7) + 1;
            let outer = *kept(&cell, || inner(&cell));
            let again = *kept(&cell, || panic!("it is known"));
            said.send([outer, again]).expect("the test listens");
        });
        let found = heard.recv_timeout(std::time::Duration::from_secs(30));
        assert_eq!(found.expect("it does not wait for itself"), [7, 7]);
    }
}
