//! Which firmware a line comes from, where it shows that.

/// The firmwares that can be told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Firmware {
    /// Marlin.
    Marlin,
    /// GRBL 1.1, or grblHAL.
    Grbl,
    /// Klipper's host software.
    Klipper,
}

impl Firmware {
    /// The firmware that sends this line, and no other of them does; `None` for a line that several send or none.
    pub(super) fn of_line(line: &str) -> Option<Self> {
        let begins = |words: &[&str]| words.iter().any(|word| line.starts_with(word));
        let is_code = |prefix: &str| {
            line.strip_prefix(prefix).is_some_and(|code| code.parse::<u32>().is_ok())
        };
        // `ok` and Klipper's name stand on one line.
        if begins(&["!!", "// Klipper state: ", "// Unknown command:\""])
            || line.contains("FIRMWARE_NAME:Klipper")
        {
            return Some(Self::Klipper);
        }
        let is_greeting = begins(&["Grbl ", "GrblHAL "]) && line.contains(" ['$'");
        if is_greeting
            || begins(&["[VER:", "FIRMWARE_NAME:grbl"])
            || is_code("error:")
            || is_code("ALARM:")
        {
            return Some(Self::Grbl);
        }
        let is_marlin = begins(&["echo:", "Marlin ", "FIRMWARE_NAME:", "Error:Printer halted"]);
        (line == "start" || is_marlin).then_some(Self::Marlin)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn each_firmware_is_known_by_lines_of_its_own() {
        for (line, firmware) in [
            ("start", Some(Firmware::Marlin)),
            ("Marlin 2.1.2.1", Some(Firmware::Marlin)),
            ("echo:Unknown command: \"$I\"", Some(Firmware::Marlin)),
            ("FIRMWARE_NAME:Marlin 2.1.2.1 (x) SOURCE_CODE_URL:y", Some(Firmware::Marlin)),
            ("Error:Printer halted. kill() called!", Some(Firmware::Marlin)),
            ("Grbl 1.1h ['$' for help]", Some(Firmware::Grbl)),
            ("GrblHAL 1.1f ['$' or '$HELP' for help]", Some(Firmware::Grbl)),
            ("FIRMWARE_NAME:grblHAL x", Some(Firmware::Grbl)),
            ("[VER:1.1h.20190830:]", Some(Firmware::Grbl)),
            ("error:20", Some(Firmware::Grbl)),
            ("ALARM:2", Some(Firmware::Grbl)),
            ("ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12", Some(Firmware::Klipper)),
            ("// Klipper state: Ready", Some(Firmware::Klipper)),
            ("// Unknown command:\"M410\"", Some(Firmware::Klipper)),
            ("!! Must home axis first", Some(Firmware::Klipper)),
            ("ok", None),
            ("error:x", None),
            ("Error:checksum mismatch, Last Line: 4", None),
            ("//action:pause", None),
            ("X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:0 Y:0 Z:0", None),
        ] {
            assert_eq!(Firmware::of_line(line), firmware, "{line}");
        }
    }

    proptest! {
        #[test]
        fn no_line_makes_it_panic(line in "\\PC{0,40}") {
            let _ = Firmware::of_line(&line);
        }
    }
}
