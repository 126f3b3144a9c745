//! The firmware's build, `$I`.

/// The parts of `[OPT:…]` that matter here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct BuildInfo {
    /// Bytes of its receive buffer.
    pub(super) receive_buffer: Option<usize>,
    /// Built so that homing makes the switches' end zero, and not the far end.
    pub(super) origin_at_switches: bool,
}

impl BuildInfo {
    /// Reads the answer to `$I`.
    pub(super) fn from_lines(lines: &[String]) -> Self {
        let options = lines
            .iter()
            .find_map(|line| line.strip_prefix("[OPT:")?.strip_suffix(']'))
            .unwrap_or_default();
        let mut fields = options.split(',');
        let letters = fields.next().unwrap_or_default();
        Self {
            receive_buffer: fields.nth(1).and_then(|bytes| bytes.parse().ok()),
            // grblHAL has a setting for it instead, and uses the letter for something else.
            origin_at_switches: letters.contains('Z'),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(lines: &[&str]) -> BuildInfo {
        BuildInfo::from_lines(&lines.iter().map(|&line| line.to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn the_buffer_is_the_third_field_in_both_dialects() {
        let grbl = info(&["[VER:1.1h.20190830:]", "[OPT:V,15,128]"]);
        assert_eq!(grbl, BuildInfo { receive_buffer: Some(128), origin_at_switches: false });
        let hal = info(&["[VER:1.1f.20260817:]", "[OPT:VNML+,100,1024,3,0]", "[AXS:3:XYZ]"]);
        assert_eq!(hal.receive_buffer, Some(1024));
    }

    #[test]
    fn a_build_without_options_gives_none() {
        assert_eq!(info(&[]), BuildInfo::default());
        assert_eq!(info(&["[OPT:VZ]"]).receive_buffer, None);
        assert!(info(&["[OPT:VZ,15,128]"]).origin_at_switches);
    }
}
