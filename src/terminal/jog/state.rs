//! The state of a jogged robot, and the effect of keys.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use fieldgap_input::visible_line;
use fieldgap_rig::travel::Axis;
use fieldgap_rig::{Envelope, Frame, PathFault, Reading, ReceiverIdentity, RobotPosition};

/// Available step sizes, mm.
pub const STEPS_MM: [f64; 8] = [0.01, 0.05, 0.1, 0.5, 1.0, 5.0, 10.0, 50.0];

/// The step at the start: 1 mm.
const FIRST_STEP: usize = 4;

/// Shortest move, m: nearer to the end of an axis, none is made.
const AT_THE_END_M: f64 = 1e-6;

/// What the robot is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doing {
    /// It stands still at an unknown position, because it has not homed.
    NotHomed,
    /// It is homing.
    Homing,
    /// It stands still at a known position.
    Standing(RobotPosition),
    /// It is moving.
    Moving {
        /// Start.
        from: RobotPosition,
        /// Target.
        to: RobotPosition,
    },
}

/// What a key asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Act {
    /// Move straight to a position. The path is within travel and outside keep-out boxes.
    Move(RobotPosition),
    /// Home.
    Home,
    /// Stop all motion; the position is then unknown.
    Stop,
    /// Start or end the emission.
    Emit(bool),
    /// Quit.
    Quit,
}

/// The view of a jogged robot.
#[derive(Debug, Clone)]
pub struct Jog {
    pub(super) title: String,
    pub(super) envelope: Envelope,
    pub(super) frame: Frame,
    pub(super) doing: Doing,
    step: usize,
    pub(super) said: String,
    pub(super) receiver: Option<ReceiverIdentity>,
    pub(super) level: Option<Reading>,
    pub(super) highest: f64,
    /// Whether the array emits; `None` without a focus.
    pub(super) emitting: Option<bool>,
}

impl Jog {
    /// For a robot that was just opened. `title` names the rig, `receiver` gives the level, and `has_focus` tells whether the
    /// array can emit.
    pub fn new(
        title: impl Into<String>,
        envelope: Envelope,
        frame: Frame,
        receiver: Option<ReceiverIdentity>,
        has_focus: bool,
    ) -> Self {
        Self {
            title: visible_line(&title.into()).into_owned(),
            envelope,
            frame,
            doing: Doing::NotHomed,
            step: FIRST_STEP,
            said: "not homed: h homes the robot (the firmware chooses the path)".to_owned(),
            receiver,
            level: None,
            highest: 0.0,
            emitting: has_focus.then_some(false),
        }
    }

    /// The step, mm.
    pub fn step_mm(&self) -> f64 {
        STEPS_MM[self.step]
    }

    /// What the robot is doing.
    pub fn doing(&self) -> Doing {
        self.doing
    }

    /// Handles a key. The caller carries out the returned action and then calls [`Jog::arrived`] or [`Jog::lost`].
    pub fn key(&mut self, key: KeyEvent) -> Option<Act> {
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('c') if control => Some(Act::Quit),
            _ if control => None,
            KeyCode::Char('q') | KeyCode::Esc => Some(Act::Quit),
            KeyCode::Char(' ' | 's') => Some(Act::Stop),
            KeyCode::Char('+' | '=') => self.take_step(self.step + 1),
            KeyCode::Char('-') => self.take_step(self.step.wrapping_sub(1)),
            KeyCode::Char('h') => self.home(),
            KeyCode::Char('f') => self.emit(),
            KeyCode::Left => self.step_along(Axis::X, -1.0),
            KeyCode::Right => self.step_along(Axis::X, 1.0),
            KeyCode::Down => self.step_along(Axis::Y, -1.0),
            KeyCode::Up => self.step_along(Axis::Y, 1.0),
            KeyCode::PageDown => self.step_along(Axis::Z, -1.0),
            KeyCode::PageUp => self.step_along(Axis::Z, 1.0),
            _ => None,
        }
    }

    /// The robot stands still at a position.
    pub fn arrived(&mut self, at: RobotPosition) {
        self.doing = Doing::Standing(at);
        self.said.clear();
    }

    /// The robot was stopped or failed; its position is unknown.
    pub fn lost(&mut self, why: impl Into<String>) {
        self.doing = Doing::NotHomed;
        self.said = format!("{}; h homes the robot", visible_line(&why.into()));
    }

    /// The array was switched on or off.
    pub fn emits(&mut self, emitting: bool) {
        self.emitting = Some(emitting);
    }

    /// Takes a reading, or a fault of the receiver.
    pub fn heard(&mut self, reading: Result<Reading, String>) {
        match reading {
            Ok(reading) => {
                self.highest = self.highest.max(reading.mean);
                self.level = Some(reading);
            }
            Err(fault) => {
                self.level = None;
                self.said = visible_line(&fault).into_owned();
            }
        }
    }

    fn take_step(&mut self, step: usize) -> Option<Act> {
        if step < STEPS_MM.len() {
            self.step = step;
        }
        None
    }

    fn home(&mut self) -> Option<Act> {
        match self.doing {
            Doing::NotHomed | Doing::Standing(_) => {
                self.doing = Doing::Homing;
                self.said = "homing; space stops it".to_owned();
                Some(Act::Home)
            }
            Doing::Homing | Doing::Moving { .. } => None,
        }
    }

    fn emit(&mut self) -> Option<Act> {
        if self.emitting.is_none() {
            self.said = "no focus: start with --focus-mm to let the array emit".to_owned();
        }
        self.emitting.map(|emitting| Act::Emit(!emitting))
    }

    fn step_along(&mut self, axis: Axis, side: f64) -> Option<Act> {
        let from = match self.doing {
            Doing::Standing(from) => from,
            Doing::NotHomed => {
                self.said = "not homed: h homes the robot first".to_owned();
                return None;
            }
            // A key that is held down: the next step starts when this one has ended.
            Doing::Homing | Doing::Moving { .. } => return None,
        };
        match self.target(from, axis, side) {
            Ok(to) => {
                self.doing = Doing::Moving { from, to };
                self.said.clear();
                Some(Act::Move(to))
            }
            Err(refusal) => {
                self.said = refusal;
                None
            }
        }
    }

    /// Target of a step along an axis, limited to the travel.
    fn target(&self, from: RobotPosition, axis: Axis, side: f64) -> Result<RobotPosition, String> {
        let number = axis as usize;
        let mut axes_m = from.axes_m();
        let here_m = axes_m[number];
        let (least_m, largest_m) =
            (self.envelope.travel.least_m[number], self.envelope.travel.largest_m[number]);
        axes_m[number] = (here_m + side * self.step_mm() * 1e-3).clamp(least_m, largest_m);
        let way_m = (axes_m[number] - here_m) * side;
        if way_m < AT_THE_END_M {
            let end_m = if side > 0.0 { largest_m } else { least_m };
            return Err(format!(
                "{axis} ends at {:.2} mm (travel_mm of the rig file)",
                end_m * 1e3
            ));
        }
        let to = RobotPosition::from_axes_m(axes_m);
        match self.envelope.check_path(from, to) {
            Ok(()) => Ok(to),
            Err(PathFault::KeepOut { name, .. }) => {
                Err(format!("the keep-out box `{name}` is in the way"))
            }
            Err(fault) => Err(fault.to_string()),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;
    use fieldgap_acoustics::Vec3;
    use fieldgap_rig::travel::{AxisBox, KeepOut};

    pub(in super::super) fn jog() -> Jog {
        let envelope = Envelope {
            travel: AxisBox { least_m: [0.0; 3], largest_m: [0.3, 0.3, 0.25] },
            keep_out: vec![KeepOut {
                name: "array".into(),
                space: AxisBox { least_m: [0.1, 0.1, 0.0], largest_m: [0.2, 0.2, 0.05] },
            }],
        };
        let frame = Frame { origin_m: Vec3::new(0.15, 0.15, 0.02) };
        let receiver = ReceiverIdentity {
            rate_hz: 1000.0,
            full_scale: 5.0,
            unit: "V".into(),
            own_clock: true,
            phase: false,
        };
        Jog::new("rigs/virtual.toml", envelope, frame, Some(receiver), true)
    }

    fn press(code: KeyCode) -> KeyEvent {
        KeyEvent::new(code, KeyModifiers::NONE)
    }

    fn at(jog: &mut Jog, mm: [f64; 3]) {
        jog.arrived(RobotPosition::from_axes_mm(mm));
    }

    fn moved(act: Option<Act>) -> Option<[f64; 3]> {
        match act {
            Some(Act::Move(to)) => Some(to.axes_mm().map(|mm| (mm * 1e6).round() / 1e6)),
            _ => None,
        }
    }

    #[test]
    fn nothing_moves_before_homing() {
        let mut jog = jog();
        assert_eq!(jog.key(press(KeyCode::Left)), None);
        assert!(jog.said.contains("h homes"), "{}", jog.said);
        assert_eq!(jog.key(press(KeyCode::Char('h'))), Some(Act::Home));
        assert_eq!(jog.key(press(KeyCode::Left)), None);
        assert_eq!(jog.key(press(KeyCode::Char('h'))), None, "once is enough");
        jog.lost("stopped");
        assert_eq!(jog.doing(), Doing::NotHomed);
    }

    #[test]
    fn each_arrow_moves_its_axis() {
        for (code, expected) in [
            (KeyCode::Left, [49.0, 50.0, 100.0]),
            (KeyCode::Right, [51.0, 50.0, 100.0]),
            (KeyCode::Down, [50.0, 49.0, 100.0]),
            (KeyCode::Up, [50.0, 51.0, 100.0]),
            (KeyCode::PageDown, [50.0, 50.0, 99.0]),
            (KeyCode::PageUp, [50.0, 50.0, 101.0]),
        ] {
            let mut jog = jog();
            at(&mut jog, [50.0, 50.0, 100.0]);
            assert_eq!(moved(jog.key(press(code))), Some(expected), "{code:?}");
            assert_eq!(jog.key(press(code)), None, "one step at a time");
        }
    }

    #[test]
    fn the_step_size_stays_between_its_limits() {
        let mut jog = jog();
        assert_eq!(jog.step_mm(), 1.0);
        for _ in 0..20 {
            jog.key(press(KeyCode::Char('+')));
        }
        assert_eq!(jog.step_mm(), 50.0);
        for _ in 0..20 {
            jog.key(press(KeyCode::Char('-')));
        }
        assert_eq!(jog.step_mm(), 0.01);
    }

    #[test]
    fn the_last_step_ends_at_the_limit_of_travel() {
        let mut jog = jog();
        at(&mut jog, [299.6, 10.0, 100.0]);
        assert_eq!(moved(jog.key(press(KeyCode::Right))), Some([300.0, 10.0, 100.0]));
        at(&mut jog, [300.0, 10.0, 100.0]);
        assert_eq!(jog.key(press(KeyCode::Right)), None);
        assert_eq!(jog.said, "x ends at 300.00 mm (travel_mm of the rig file)");
    }

    #[test]
    fn a_keep_out_box_is_named() {
        let mut jog = jog();
        at(&mut jog, [150.0, 150.0, 50.5]);
        assert_eq!(jog.key(press(KeyCode::PageDown)), None);
        assert_eq!(jog.said, "the keep-out box `array` is in the way");
    }

    #[test]
    fn stop_and_quit_work_at_any_time() {
        let mut jog = jog();
        at(&mut jog, [50.0, 50.0, 100.0]);
        jog.key(press(KeyCode::Left));
        assert_eq!(jog.key(press(KeyCode::Char(' '))), Some(Act::Stop));
        assert_eq!(jog.key(press(KeyCode::Char('q'))), Some(Act::Quit));
        let interrupt = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(jog.key(interrupt), Some(Act::Quit));
    }

    #[test]
    fn the_focus_is_switched_if_there_is_one() {
        let mut jog = jog();
        assert_eq!(jog.key(press(KeyCode::Char('f'))), Some(Act::Emit(true)));
        jog.emits(true);
        assert_eq!(jog.key(press(KeyCode::Char('f'))), Some(Act::Emit(false)));
        jog.emitting = None;
        assert_eq!(jog.key(press(KeyCode::Char('f'))), None);
    }

    proptest! {
        #[test]
        fn no_keys_move_out_of_travel_or_into_a_box(keys in prop::collection::vec(0usize..8, 0..200)) {
            let mut jog = jog();
            at(&mut jog, [90.0, 90.0, 60.0]);
            let codes = [
                KeyCode::Left, KeyCode::Right, KeyCode::Up, KeyCode::Down, KeyCode::PageUp,
                KeyCode::PageDown, KeyCode::Char('+'), KeyCode::Char('-'),
            ];
            for key in keys {
                let Doing::Standing(from) = jog.doing() else { unreachable!() };
                if let Some(Act::Move(to)) = jog.key(press(codes[key])) {
                    prop_assert!(jog.envelope.check_path(from, to).is_ok());
                    jog.arrived(to);
                }
            }
        }
    }
}
