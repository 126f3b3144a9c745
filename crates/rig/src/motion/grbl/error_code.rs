//! What a refused line means.

/// The command is for a machine at rest, or for one that is not locked.
pub(super) const NOT_IDLE: u32 = 8;
/// Locked: in alarm, or not homed since it was switched on.
pub(super) const LOCKED: u32 = 9;
/// Homing is switched off.
pub(super) const HOMING_OFF: u32 = 5;

/// The meaning of `error:n` (doc/markdown/interface.md of GRBL's sources; 79 is grblHAL's).
pub(super) fn meaning(code: u32) -> &'static str {
    match code {
        1 => "a word without its letter",
        2 => "a number that cannot be read",
        3 => "no such `$` command",
        4 => "a negative value",
        5 => "homing is not enabled ($22)",
        7 => "its settings could not be read and were reset",
        8 => "only when idle",
        9 => "locked: in alarm, or not homed",
        10 => "soft limits need homing to be enabled",
        11 => "the line is too long",
        15 => "the jog leaves its travel",
        20 => "no such command",
        22 => "no feed is set",
        23 => "a code that must be an integer is not",
        24 | 25 => "conflicting words",
        26..=38 => "words that do not form a valid move",
        79 => "only a reset helps: a critical alarm",
        _ => "see the firmware's list of errors",
    }
}

/// Whether the same line, sent again, may be taken: damage on its way can make any of the parser's errors, and none
/// that concerns the machine's state. A damaged code can be that of a setting, which refuses no move.
pub(super) fn may_be_damage(code: u32) -> bool {
    !matches!(code, 7 | NOT_IDLE | LOCKED | 12..=19 | 45..=47 | 79)
}
