//! The virtual air sensor. It sends a line `T=21.30 RH=45.0 P=101.325` for each line it receives, and at an interval if one is
//! set.
//!
//! Its values are independent of the truth file, which determines the field.

use serde::Deserialize;

use super::firmware::{Firmware, Wake};
use fieldgap_input::{Finite, NonNegative, Positive, Time};

/// `[virtual.environment]`: the sensor's values.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirSettings {
    /// Temperature at power-up, °C.
    temperature_c: Finite,
    /// Relative humidity, percent.
    humidity_percent: NonNegative,
    /// Pressure, kPa.
    #[serde(default = "standard_pressure")]
    pressure_kpa: Positive,
    /// Rate of warming, °C per hour.
    #[serde(default)]
    warms_c_per_h: Finite,
    /// Interval of unrequested lines, s; absent: it answers requests alone.
    every_s: Option<Time>,
}

fn standard_pressure() -> Positive {
    Positive::new(101.325).expect("a literal above zero")
}

/// The firmware's state.
pub struct AirFirmware {
    settings: AirSettings,
    /// Requested lines that are not sent yet.
    asked: usize,
    next_s: f64,
}

impl AirFirmware {
    /// Firmware with these values.
    pub fn new(settings: AirSettings) -> Self {
        Self { settings, asked: 0, next_s: 0.0 }
    }

    fn send(&self, now_s: f64, out: &mut Vec<u8>) {
        let AirSettings { temperature_c, humidity_percent, pressure_kpa, warms_c_per_h, .. } =
            self.settings;
        let warm_c = temperature_c.get() + warms_c_per_h.get() * now_s / 3600.0;
        let line = format!(
            "T={warm_c:.2} RH={:.1} P={:.3}\r\n",
            humidity_percent.get(),
            pressure_kpa.get()
        );
        out.extend_from_slice(line.as_bytes());
    }
}

impl Firmware for AirFirmware {
    fn power_up(&mut self, now_s: f64, _out: &mut Vec<u8>) {
        self.asked = 0;
        self.next_s = now_s;
    }

    fn receive(&mut self, byte: u8, _now_s: f64) {
        self.asked += usize::from(byte == b'\n');
    }

    fn step(&mut self, now_s: f64, out: &mut Vec<u8>) {
        for _ in 0..std::mem::take(&mut self.asked) {
            self.send(now_s, out);
        }
        if let Some(every_s) = self.settings.every_s
            && now_s >= self.next_s
        {
            self.send(now_s, out);
            // Lines that a jump of time skips are not sent later.
            self.next_s = now_s + every_s.get();
        }
    }

    fn wake(&self) -> Option<Wake> {
        self.settings.every_s.map(|_| Wake { at_s: self.next_s, answer_needs_it: false })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::literal;

    fn firmware(every_s: Option<f64>) -> AirFirmware {
        let number = |value| Finite::new(value).expect("finite");
        let mut firmware = AirFirmware::new(AirSettings {
            temperature_c: number(21.3),
            humidity_percent: NonNegative::new(45.0).expect("not below zero"),
            pressure_kpa: standard_pressure(),
            warms_c_per_h: number(2.0),
            every_s: every_s.map(literal),
        });
        firmware.power_up(0.0, &mut Vec::new());
        firmware
    }

    fn sent(firmware: &mut AirFirmware, now_s: f64) -> String {
        let mut out = Vec::new();
        firmware.step(now_s, &mut out);
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn it_answers_each_line_and_gets_warmer() {
        let mut firmware = firmware(None);
        assert_eq!(sent(&mut firmware, 1.0), "");
        b"R\nR\n".iter().for_each(|&byte| firmware.receive(byte, 1800.0));
        assert_eq!(sent(&mut firmware, 1800.0), "T=22.30 RH=45.0 P=101.325\r\n".repeat(2));
    }

    #[test]
    fn it_sends_lines_at_its_interval() {
        let mut firmware = firmware(Some(2.0));
        let lines: Vec<usize> =
            [0.0, 1.0, 2.0, 9.0, 10.9].map(|t| sent(&mut firmware, t).lines().count()).to_vec();
        assert_eq!(lines, [1, 0, 1, 1, 0]);
        assert_eq!(firmware.wake().map(|wake| wake.at_s), Some(11.0));
    }
}
