//! The interface of a device's firmware: bytes in, bytes out, at given instants of virtual time.
//!
//! Firmware does no input or output and owns no clock. A test can thus present any sequence of bytes and times, and the same
//! sequence always gives the same answers.

/// When firmware next has something to do if no byte comes in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wake {
    /// Virtual seconds since power-up.
    pub at_s: f64,
    /// Whether an answer that the host waits for needs this time to pass. In lockstep only this makes it
    /// pass; otherwise the firmware acts when another device has brought the time there.
    pub answer_needs_it: bool,
}

/// The firmware of one device.
///
/// Times are virtual seconds since the rig was powered up and never decrease from call to call.
pub trait Firmware: Send + Sync {
    /// The device is switched on, or reset: its state is lost, and its greeting goes to `out`.
    fn power_up(&mut self, now_s: f64, out: &mut Vec<u8>);

    /// One byte has arrived. Nothing is answered before the next [`Firmware::step`].
    fn receive(&mut self, byte: u8, now_s: f64);

    /// Does all that is due at `now_s`; answers go to `out`.
    fn step(&mut self, now_s: f64, out: &mut Vec<u8>);

    /// When to step again if no byte comes in.
    fn wake(&self) -> Option<Wake>;
}

impl Firmware for Box<dyn Firmware> {
    fn power_up(&mut self, now_s: f64, out: &mut Vec<u8>) {
        (**self).power_up(now_s, out);
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        (**self).receive(byte, now_s);
    }

    fn step(&mut self, now_s: f64, out: &mut Vec<u8>) {
        (**self).step(now_s, out);
    }

    fn wake(&self) -> Option<Wake> {
        (**self).wake()
    }
}
