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

    #[test]
    fn who_computes_a_value_may_ask_for_it() {
        let cell = OnceLock::new();
        let outer = kept(&cell, || {
            assert_eq!(*kept(&cell, || 7), 7);
            8
        });
        assert_eq!(*outer, 7);
        assert_eq!(*kept(&cell, || panic!("it is known")), 7);
    }
}
