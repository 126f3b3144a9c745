//! Samples as lines.

use super::protocol::{Event, Sample};

/// Turns the bytes of text samples into events, however they are cut; skips what is no sample.
#[derive(Debug, Default)]
pub(super) struct TextDecoder {
    pending: Vec<u8>,
}

/// The longest sample line: three numbers of at most 20, 20 and 30 digits. More is noise.
const LONGEST_LINE: usize = 96;

impl TextDecoder {
    /// Takes bytes as they came.
    pub fn push(&mut self, bytes: &[u8]) {
        self.pending.extend_from_slice(bytes);
    }

    /// The next event, or `None` until more bytes have come.
    pub fn next_event(&mut self) -> Option<Event> {
        while let Some(end) = self.pending.iter().position(|&byte| byte == b'\n') {
            let line: Vec<u8> = self.pending.drain(..=end).collect();
            if let Some(event) = std::str::from_utf8(&line).ok().and_then(parse_event) {
                return Some(event);
            }
        }
        if self.pending.len() > LONGEST_LINE {
            // The end of this noise may come later; then it is skipped as a line that is none.
            self.pending.truncate(LONGEST_LINE);
        }
        None
    }
}

fn parse_event(line: &str) -> Option<Event> {
    let mut words = line.split_ascii_whitespace();
    let first = words.next()?;
    let event = if first == "end" {
        Event::End { next_seq: words.next()?.parse().ok()?, t_us: words.next()?.parse().ok()? }
    } else {
        let (seq, t_us) = (first.parse().ok()?, words.next()?.parse().ok()?);
        let value = words.next()?.parse().ok()?;
        let mut rest = words.clone();
        let clipped = rest.next() == Some("!");
        if clipped {
            words = rest;
        }
        Event::Sample(Sample { seq, t_us, value, quadrature: None, clipped })
    };
    words.next().is_none().then_some(event)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn decode(bytes: &[u8]) -> Vec<Event> {
        let mut decoder = TextDecoder::default();
        decoder.push(bytes);
        std::iter::from_fn(|| decoder.next_event()).collect()
    }

    fn sample(seq: u32, t_us: u64, value: f64, clipped: bool) -> Event {
        Event::Sample(Sample { seq, t_us, value, quadrature: None, clipped })
    }

    #[test]
    fn samples_and_the_end_mark_are_read() {
        let events = decode(b"7 1000 0.25\n8 2000 5.000 !\r\nend 9 3000\n");
        let expected = [
            sample(7, 1000, 0.25, false),
            sample(8, 2000, 5.0, true),
            Event::End { next_seq: 9, t_us: 3000 },
        ];
        assert_eq!(events, expected);
    }

    #[test]
    fn a_damaged_line_is_skipped_and_the_next_one_read() {
        let events = decode(b"7 10x0 0.25\n\xff\xfe\n8 2000 0.5 ?\n8 2000\nend 9\n9 3000 0.75\n");
        assert_eq!(events, [sample(9, 3000, 0.75, false)]);
    }

    #[test]
    fn noise_without_line_ends_does_not_fill_the_memory() {
        let mut decoder = TextDecoder::default();
        for _ in 0..100 {
            decoder.push(&[b'7'; 1000]);
            assert_eq!(decoder.next_event(), None);
        }
        assert!(decoder.pending.len() <= LONGEST_LINE);
        decoder.push(b"\n9 3000 0.75\n");
        assert_eq!(decoder.next_event(), Some(sample(9, 3000, 0.75, false)));
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_decoder_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            decode(&bytes);
        }

        #[test]
        fn the_cuts_between_reads_do_not_matter(cut in 0usize..40) {
            let text = b"7 1000 0.25\n8 2000 5.000 !\nend 9 3000\n";
            let mut decoder = TextDecoder::default();
            let mut events = Vec::new();
            for part in [&text[..cut.min(text.len())], &text[cut.min(text.len())..]] {
                decoder.push(part);
                events.extend(std::iter::from_fn(|| decoder.next_event()));
            }
            prop_assert_eq!(events, decode(text));
        }
    }
}
