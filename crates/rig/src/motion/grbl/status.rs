//! Status reports, `<Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>`.

/// What the machine is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    /// Nothing, at this instant. Also shows during a dwell and between moves.
    Idle,
    /// A move.
    Run,
    /// A jog; shows for a while after it was cancelled.
    Jog,
    /// Homing.
    Home,
    /// Motion is held, or being held.
    Hold,
    /// Locked.
    Alarm,
    /// The safety door is open.
    Door,
    /// Lines are checked and not executed.
    Check,
    /// Asleep until a reset.
    Sleep,
    /// Waits for a tool to be changed.
    Tool,
}

impl State {
    fn parse(text: &str) -> Option<Self> {
        Some(match text.split(':').next()? {
            "Idle" => Self::Idle,
            "Run" => Self::Run,
            "Jog" => Self::Jog,
            "Home" => Self::Home,
            "Hold" => Self::Hold,
            "Alarm" => Self::Alarm,
            "Door" => Self::Door,
            "Check" => Self::Check,
            "Sleep" => Self::Sleep,
            "Tool" => Self::Tool,
            _ => return None,
        })
    }
}

/// Where the machine is, in the unit that it reports in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// In the machine's own coordinates.
    Machine([f64; 3]),
    /// In those of the work: the machine's less the work offset.
    Work([f64; 3]),
}

/// One report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Status {
    /// What it is doing.
    pub(super) state: State,
    /// Where it is.
    pub(super) place: Place,
    /// The work offset, which comes with some reports only.
    pub(super) work_offset: Option<[f64; 3]>,
    /// Feed override in percent, which comes with some reports only.
    pub(super) feed_override: Option<u32>,
}

impl Status {
    /// Reads a report; `None` for anything that is not one whole report.
    pub(super) fn parse(line: &str) -> Option<Self> {
        let mut fields = line.strip_prefix('<')?.strip_suffix('>')?.split('|');
        let state = State::parse(fields.next()?)?;
        let (mut place, mut work_offset, mut feed_override) = (None, None, None);
        for field in fields {
            // grblHAL has fields without a value.
            let (name, value) = field.split_once(':').unwrap_or((field, ""));
            match name {
                "MPos" => place = Some(Place::Machine(coordinates(value)?)),
                "WPos" => place = Some(Place::Work(coordinates(value)?)),
                "WCO" => work_offset = Some(coordinates(value)?),
                "Ov" => feed_override = Some(value.split(',').next()?.parse().ok()?),
                _ => {}
            }
        }
        Some(Self { state, place: place?, work_offset, feed_override })
    }
}

/// The first three of `1.000,2.000,3.000`; machines with more axes report more.
fn coordinates(text: &str) -> Option<[f64; 3]> {
    let mut numbers =
        text.split(',').map(|number| number.parse().ok().filter(|n: &f64| n.is_finite()));
    Some([numbers.next()??, numbers.next()??, numbers.next()??])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn reports_of_both_dialects_are_read() {
        let line =
            "<Run|MPos:-194.420,-1.000,0.500|Bf:99,1023|FS:6000,0|WCO:1.000,2.000,3.000|Pn:XZ>";
        let status = Status::parse(line).expect("whole");
        assert_eq!(status.state, State::Run);
        assert_eq!(status.place, Place::Machine([-194.42, -1.0, 0.5]));
        assert_eq!(status.work_offset, Some([1.0, 2.0, 3.0]));
        let line = "<Hold:0|WPos:1.000,2.000,3.000,9.000|FS:0,0|Ov:90,100,100|A:|TLR:0>";
        let status = Status::parse(line).expect("whole");
        assert_eq!((status.state, status.feed_override), (State::Hold, Some(90)));
        assert_eq!(status.place, Place::Work([1.0, 2.0, 3.0]));
    }

    #[test]
    fn what_is_cut_or_damaged_is_none() {
        for line in [
            "<Idle|MPos:1.000,2.000,3.000",
            "Idle|MPos:1.000,2.000,3.000>",
            "<Idle|MPos:1.000,2.000>",
            "<Idle|MPos:1.000,2.0#0,3.000>",
            "<Idle|MPos:1.000,NaN,3.000>",
            "<Idl|MPos:1.000,2.000,3.000>",
            "<Idle|FS:0,0>",
            "<>",
        ] {
            assert_eq!(Status::parse(line), None, "{line}");
        }
    }

    proptest! {
        #[test]
        fn no_line_made_of_known_pieces_makes_the_parser_panic(
            pieces in prop::collection::vec(
                prop::sample::select(vec!["<", ">", "Idle", "|", "MPos:", "WCO:", "1.5", ",", ":", "-", "λ", "Ov:"]),
                0..14,
            )
        ) {
            let _ = Status::parse(&pieces.concat());
        }
    }
}
