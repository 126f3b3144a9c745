//! The commands that differ between makers of oscilloscopes: how one record is taken, and how its bytes are scaled.

use serde::Deserialize;

/// Whose command set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Preset {
    /// Rigol's DS1000Z, MSO1000Z, DS2000 and their relatives.
    #[default]
    Rigol,
    /// Siglent's SDS1000, SDS2000 with the commands of their first programming guide (`C1:WF? DAT2`).
    Siglent,
    /// Keysight's InfiniiVision, and others that have `:DIGitize`.
    Keysight,
}

/// `[receiver.scpi.commands]`: each key that is given goes before the preset's. `{channel}` stands for the channel's number; where there is a sync,
/// the commands that read a record are said again with its channel, and `{channels}` stands for both (`CHAN1,CHAN2`).
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Commands {
    /// Said once, when the instrument is opened.
    setup: Option<Vec<String>>,
    /// Says that one record be taken.
    arm: Option<Vec<String>>,
    /// Asks whether it has been taken.
    state: Option<String>,
    /// The answers to that which mean yes.
    taken: Option<Vec<String>>,
    /// Said again as long as it has not, since nothing triggers in silence; empty: nothing is.
    force: Option<String>,
    /// Says which channel's record is read: once, or before each of two.
    select: Option<String>,
    /// Asks for the record's samples.
    data: Option<String>,
    /// Queries the ten numbers that scale the samples.
    preamble: Option<String>,
    /// Asks for the oldest error.
    error: Option<String>,
}

/// The commands for one channel of one instrument.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dialect {
    pub(super) setup: Vec<String>,
    pub(super) arm: Vec<String>,
    pub(super) state: String,
    pub(super) taken: Vec<String>,
    pub(super) force: String,
    /// Said before the record is read; empty where that is not needed.
    pub(super) select: String,
    pub(super) data: String,
    pub(super) scale: ScaleQueries,
    pub(super) error: String,
    pub(super) code: Code,
}

/// How the meaning of samples is asked for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum ScaleQueries {
    /// Ten numbers at once; in the ninth, the origin is in steps or in volts.
    Preamble { query: String, origin: Origin },
    /// Volts a division, offset and samples a second, one by one.
    Settings { volts: String, offset: String, rate: String },
}

/// What the ninth number of a preamble counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    /// Steps of the converter, taken off before scaling.
    Steps,
    /// Volts, added after scaling.
    Volts,
}

/// How a sample is coded in its byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Code {
    /// 0 to 255.
    Unsigned,
    /// 2 to 254. Keysight's guides reserve 0 for a sample that was not taken, 1 for one clipped low, 255 for one clipped high.
    UnsignedWithMarks,
    /// -128 to 127.
    Signed,
}

/// What a record's samples mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Time between two samples, s.
    pub(super) interval_s: f64,
    /// Volts of one step of the converter.
    step_v: f64,
    /// The step at which it reads `origin_v`.
    zero: f64,
    origin_v: f64,
}

/// Steps in one division of Siglent's screens.
const SIGLENT_STEPS_A_DIVISION: f64 = 25.0;

impl Dialect {
    /// The commands of a preset for a channel, where `all` channels are recorded; `own` replaces some of them.
    pub(super) fn new(preset: Preset, channel: u8, all: &[u8], own: &Commands) -> Self {
        let mut dialect = Self::of(preset);
        let Commands { setup, arm, state, taken, force, select, data, preamble, error } =
            own.clone();
        dialect.select = select.unwrap_or(dialect.select);
        if all.len() == 1 {
            dialect.setup.insert(0, std::mem::take(&mut dialect.select));
            dialect.setup.retain(|command| !command.is_empty());
        }
        dialect.setup = setup.unwrap_or(dialect.setup);
        dialect.arm = arm.unwrap_or(dialect.arm);
        dialect.state = state.unwrap_or(dialect.state);
        dialect.taken = taken.unwrap_or(dialect.taken);
        dialect.force = force.unwrap_or(dialect.force);
        dialect.data = data.unwrap_or(dialect.data);
        dialect.error = error.unwrap_or(dialect.error);
        if let Some(query) = preamble {
            let origin = match dialect.scale {
                ScaleQueries::Preamble { origin, .. } => origin,
                ScaleQueries::Settings { .. } => Origin::Volts,
            };
            dialect.scale = ScaleQueries::Preamble { query, origin };
        }
        dialect.of_channel(channel, all)
    }

    fn of(preset: Preset) -> Self {
        let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
        match preset {
            Preset::Rigol => Self {
                setup: words(&[":WAV:MODE NORM", ":WAV:FORM BYTE"]),
                arm: words(&[":SING"]),
                state: ":TRIG:STAT?".to_owned(),
                taken: words(&["STOP"]),
                force: ":TFOR".to_owned(),
                select: ":WAV:SOUR CHAN{channel}".to_owned(),
                data: ":WAV:DATA?".to_owned(),
                scale: ScaleQueries::Preamble {
                    query: ":WAV:PRE?".to_owned(),
                    origin: Origin::Steps,
                },
                error: ":SYST:ERR?".to_owned(),
                code: Code::Unsigned,
            },
            Preset::Siglent => Self {
                setup: words(&["CHDR OFF", "WFSU SP,1,NP,0,FP,0"]),
                arm: words(&["TRMD SINGLE", "ARM"]),
                state: "SAST?".to_owned(),
                taken: words(&["Stop"]),
                force: "FRTR".to_owned(),
                select: String::new(),
                data: "C{channel}:WF? DAT2".to_owned(),
                scale: ScaleQueries::Settings {
                    volts: "C{channel}:VDIV?".to_owned(),
                    offset: "C{channel}:OFST?".to_owned(),
                    rate: "SARA?".to_owned(),
                },
                error: "CMR?".to_owned(),
                code: Code::Signed,
            },
            Preset::Keysight => Self {
                setup: words(&[":TRIG:SWE AUTO", ":WAV:FORM BYTE", ":WAV:UNS 1"]),
                arm: words(&[":DIG {channels}"]),
                state: "*OPC?".to_owned(),
                taken: words(&["1", "+1"]),
                force: String::new(),
                select: ":WAV:SOUR CHAN{channel}".to_owned(),
                data: ":WAV:DATA?".to_owned(),
                scale: ScaleQueries::Preamble {
                    query: ":WAV:PRE?".to_owned(),
                    origin: Origin::Volts,
                },
                error: ":SYST:ERR?".to_owned(),
                code: Code::UnsignedWithMarks,
            },
        }
    }

    fn of_channel(mut self, channel: u8, all: &[u8]) -> Self {
        let channels: Vec<String> = all.iter().map(|channel| format!("CHAN{channel}")).collect();
        let put = |word: &mut String| {
            let named = word.replace("{channels}", &channels.join(","));
            *word = named.replace("{channel}", &channel.to_string());
        };
        self.setup.iter_mut().chain(&mut self.arm).for_each(put);
        [&mut self.state, &mut self.force, &mut self.select, &mut self.data, &mut self.error]
            .into_iter()
            .for_each(put);
        match &mut self.scale {
            ScaleQueries::Preamble { query, .. } => put(query),
            ScaleQueries::Settings { volts, offset, rate } => {
                [volts, offset, rate].into_iter().for_each(put);
            }
        }
        self
    }
}

impl Scale {
    /// Reads a preamble's ten numbers; `None` if they make no scale.
    pub(super) fn of_preamble(answer: &str, origin: Origin) -> Option<Self> {
        let numbers = answer
            .split(',')
            .map(|word| word.trim().parse::<f64>().ok().filter(|number| number.is_finite()))
            .collect::<Option<Vec<f64>>>()?;
        let [_, _, _, _, interval_s, _, _, step_v, y_origin, y_reference] = numbers[..] else {
            return None;
        };
        let (zero, origin_v) = match origin {
            Origin::Steps => (y_reference + y_origin, 0.0),
            Origin::Volts => (y_reference, y_origin),
        };
        (interval_s > 0.0 && step_v > 0.0).then_some(Self { interval_s, step_v, zero, origin_v })
    }

    /// Reads the answers to three questions; `None` if they make no scale.
    pub(super) fn of_settings(volts: &str, offset: &str, rate: &str) -> Option<Self> {
        let (volts, offset, rate) = (number(volts)?, number(offset)?, number(rate)?);
        (volts > 0.0 && rate > 0.0).then(|| Self {
            interval_s: 1.0 / rate,
            step_v: volts / SIGLENT_STEPS_A_DIVISION,
            zero: 0.0,
            origin_v: -offset,
        })
    }

    /// The volts of a sample, and whether it lies at the end of the converter's range; `None` for a sample that was not taken.
    pub(super) fn volts(&self, byte: u8, code: Code) -> Option<(f64, bool)> {
        let clipped = match code {
            Code::Unsigned => byte == 0 || byte == u8::MAX,
            Code::UnsignedWithMarks if byte == 0 => return None,
            Code::UnsignedWithMarks => byte == 1 || byte == u8::MAX,
            Code::Signed => byte.cast_signed() == i8::MIN || byte.cast_signed() == i8::MAX,
        };
        Some((self.at(code.steps(byte)), clipped))
    }

    /// Volts of one step of the converter.
    pub(super) fn step_v(&self) -> f64 {
        self.step_v
    }

    /// The amplitude that can be shown whole, V.
    pub(super) fn full_scale_v(&self, code: Code) -> f64 {
        let (least, most) = match code {
            Code::Unsigned => (0.0, 255.0),
            Code::UnsignedWithMarks => (1.0, 255.0),
            Code::Signed => (-128.0, 127.0),
        };
        self.at(least).abs().min(self.at(most).abs())
    }

    fn at(&self, steps: f64) -> f64 {
        (steps - self.zero) * self.step_v + self.origin_v
    }
}

impl Code {
    fn steps(self, byte: u8) -> f64 {
        match self {
            Self::Unsigned | Self::UnsignedWithMarks => f64::from(byte),
            Self::Signed => f64::from(byte.cast_signed()),
        }
    }
}

/// A number with a unit and perhaps a prefix behind it, and perhaps the command before it: `C1:VDIV 5.00E-01V`, `1.00GSa/s`.
fn number(answer: &str) -> Option<f64> {
    let word = answer.split_ascii_whitespace().last()?;
    let is_of_number = |at: usize, character: char| {
        character.is_ascii_digit()
            || matches!(character, '+' | '-' | '.')
            || (matches!(character, 'e' | 'E')
                && word[at + 1..]
                    .starts_with(|next: char| next.is_ascii_digit() || next == '-' || next == '+'))
    };
    let end = word.char_indices().find(|&(at, character)| !is_of_number(at, character));
    let (digits, unit) = word.split_at(end.map_or(word.len(), |(at, _)| at));
    let prefix = match unit.chars().next() {
        Some('n') => 1e-9,
        Some('u') => 1e-6,
        Some('m') => 1e-3,
        Some('k' | 'K') => 1e3,
        Some('M') => 1e6,
        Some('G') => 1e9,
        _ => 1.0,
    };
    digits.parse::<f64>().ok().map(|number| number * prefix).filter(|number| number.is_finite())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The volts of a sample that was taken, and whether it is clipped.
    fn taken(scale: &Scale, byte: u8, code: Code) -> (f64, bool) {
        scale.volts(byte, code).expect("a sample")
    }

    #[test]
    fn a_preamble_in_steps_means_what_its_maker_says() {
        // Of a programming guide's example: step 0.008 V, origin 50, reference 127.
        let scale =
            Scale::of_preamble("0,2,600,2,1.000000e-06,-0.000006,0,0.008000,50,127", Origin::Steps)
                .expect("a preamble");
        assert_eq!(scale.interval_s, 1e-6);
        assert_eq!(scale.volts(177, Code::Unsigned), Some((0.0, false)));
        assert!((taken(&scale, 178, Code::Unsigned).0 - 0.008).abs() < 1e-12);
        assert!(taken(&scale, 255, Code::Unsigned).1 && taken(&scale, 0, Code::Unsigned).1);
        assert!((scale.full_scale_v(Code::Unsigned) - 78.0 * 0.008).abs() < 1e-12);
        // Of the guide of the mixed-signal models.
        let answer = "0,2,6000000,1,1.000000e-09,-3.000000e-03,0,4.132813e-01,0,122";
        let scale = Scale::of_preamble(answer, Origin::Steps).expect("a preamble");
        assert_eq!((scale.interval_s, scale.step_v()), (1e-9, 0.4132813));
        assert_eq!(scale.volts(122, Code::Unsigned), Some((0.0, false)));
    }

    #[test]
    fn a_preamble_in_volts_means_what_its_maker_says() {
        let scale = Scale::of_preamble(
            "+0,+0,+1000,+1,+5.0E-07,-2.5E-04,+0,+1.0E-02,+5.0E-01,+128",
            Origin::Volts,
        )
        .expect("a preamble");
        let code = Code::UnsignedWithMarks;
        assert!((taken(&scale, 128, code).0 - 0.5).abs() < 1e-12);
        assert!((taken(&scale, 138, code).0 - 0.6).abs() < 1e-12);
        // The guide's special values: a hole, clipped low, clipped high.
        assert_eq!(scale.volts(0, code), None);
        assert!(taken(&scale, 1, code).1 && taken(&scale, 255, code).1);
        assert!(!taken(&scale, 2, code).1 && !taken(&scale, 254, code).1);
    }

    #[test]
    fn settings_one_by_one_mean_what_their_maker_says() {
        let scale = Scale::of_settings("C1:VDIV 5.00E-01V", "C1:OFST -1.00E+00V", "SARA 1.00GSa/s")
            .expect("numbers");
        assert!((scale.interval_s - 1e-9).abs() < 1e-24);
        // 25 steps a division of half a volt; the offset is taken off.
        let code = Code::Signed;
        assert!((taken(&scale, 25, code).0 - 1.5).abs() < 1e-12);
        assert!((taken(&scale, 231, code).0 - 0.5).abs() < 1e-12, "231 is -25");
        assert!(taken(&scale, 0x80, code).1 && taken(&scale, 0x7f, code).1);
        // The example of the programming guide: the first sample, 2, is 0.54 V.
        let scale =
            Scale::of_settings("C1:VDIV 5.00E-01V", "C1:OFST -5.00E-01V", "SARA 500.0kSa/s")
                .expect("numbers");
        assert!((taken(&scale, 2, code).0 - 0.54).abs() < 1e-12);
        assert!((scale.interval_s - 2e-6).abs() < 1e-18);
    }

    #[test]
    fn what_makes_no_scale_is_refused() {
        for answer in [
            "",
            "1,2,3",
            "0,2,600,2,0.000000,-0.000006,0,0.008,50,127",
            "0,2,600,2,1e-6,0,0,0,50,127",
            "0,2,600,2,nan,0,0,0.1,50,127",
            "0,2,600,2,1e-6,0,0,x,50,127",
        ] {
            assert_eq!(Scale::of_preamble(answer, Origin::Steps), None, "{answer}");
        }
        assert_eq!(Scale::of_settings("0V", "0V", "1GSa/s"), None);
        assert_eq!(Scale::of_settings("", "0V", "1GSa/s"), None);
    }

    #[test]
    fn own_commands_go_before_the_presets() {
        let own = Commands { force: Some("*TRG".to_owned()), ..Commands::default() };
        let dialect = Dialect::new(Preset::Rigol, 3, &[3], &own);
        assert_eq!((dialect.force.as_str(), dialect.data.as_str()), ("*TRG", ":WAV:DATA?"));
        assert_eq!((dialect.setup[0].as_str(), dialect.select.as_str()), (":WAV:SOUR CHAN3", ""));
        let first = Dialect::new(Preset::Rigol, 1, &[1, 2], &Commands::default());
        assert_eq!((first.setup.len(), first.select.as_str()), (2, ":WAV:SOUR CHAN1"));
        let siglent = Dialect::new(Preset::Siglent, 2, &[1, 2], &Commands::default());
        assert_eq!(siglent.data, "C2:WF? DAT2");
        let keysight = Dialect::new(Preset::Keysight, 1, &[1, 4], &Commands::default());
        assert_eq!(keysight.arm, [":DIG CHAN1,CHAN4"]);
    }

    proptest! {
        #[test]
        fn no_answer_makes_the_readers_panic(answer in "\\PC{0,60}") {
            let _ = Scale::of_preamble(&answer, Origin::Steps);
            let _ = Scale::of_settings(&answer, &answer, &answer);
        }
    }
}
