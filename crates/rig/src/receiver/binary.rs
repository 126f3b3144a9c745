//! Samples as frames with a checksum.

use super::protocol::{Event, Sample};

const MARK: [u8; 2] = [0xa5, 0x5a];
const FRAME: usize = 24;
const CHECKED: std::ops::Range<usize> = 2..20;
const KIND_SAMPLE: u8 = 1;
const KIND_END: u8 = 2;
const FLAG_CLIPPED: u8 = 1;

/// Turns bytes into events, however they are cut. After damage it looks for the next frame that is whole.
#[derive(Debug, Default)]
pub(super) struct FrameDecoder {
    pending: Vec<u8>,
}

impl FrameDecoder {
    /// Takes bytes as they came.
    pub fn push(&mut self, bytes: &[u8]) {
        self.pending.extend_from_slice(bytes);
    }

    /// The next event, or `None` until more bytes have come.
    pub fn next_event(&mut self) -> Option<Event> {
        loop {
            self.skip_to_mark();
            let frame: &[u8; FRAME] = self.pending.first_chunk()?;
            if let Some(event) = decode(frame) {
                self.pending.drain(..FRAME);
                return Some(event);
            }
            // Not a frame, or a damaged one: a whole one may begin inside of it.
            self.pending.drain(..1);
        }
    }

    fn skip_to_mark(&mut self) {
        let at_mark = self.pending.windows(2).position(|window| window == MARK);
        // The last byte may be the first half of a mark.
        let half = usize::from(self.pending.last() == Some(&MARK[0]));
        let noise = at_mark.unwrap_or(self.pending.len() - half);
        self.pending.drain(..noise);
    }
}

fn decode(frame: &[u8; FRAME]) -> Option<Event> {
    let crc = u32::from_le_bytes(field(frame, 20));
    if crc != crc32fast::hash(&frame[CHECKED]) {
        return None;
    }
    let (seq, t_us) = (u32::from_le_bytes(field(frame, 4)), u64::from_le_bytes(field(frame, 8)));
    match frame[2] {
        KIND_SAMPLE => Some(Event::Sample(Sample {
            seq,
            t_us,
            value: f64::from(f32::from_le_bytes(field(frame, 16))),
            clipped: frame[3] & FLAG_CLIPPED != 0,
        })),
        KIND_END => Some(Event::End { next_seq: seq, t_us }),
        _ => None,
    }
}

fn field<const N: usize>(frame: &[u8; FRAME], at: usize) -> [u8; N] {
    std::array::from_fn(|index| frame[at + index])
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A frame laid out by hand from the protocol's table.
    pub(crate) fn frame(kind: u8, flags: u8, seq: u32, t_us: u64, value: f32) -> Vec<u8> {
        let mut frame = vec![0xa5, 0x5a, kind, flags];
        frame.extend(seq.to_le_bytes());
        frame.extend(t_us.to_le_bytes());
        frame.extend(value.to_le_bytes());
        let crc = crc32fast::hash(&frame[2..]);
        frame.extend(crc.to_le_bytes());
        frame
    }

    fn decode_all(bytes: &[u8]) -> Vec<Event> {
        let mut decoder = FrameDecoder::default();
        decoder.push(bytes);
        std::iter::from_fn(|| decoder.next_event()).collect()
    }

    fn sample(seq: u32) -> Event {
        Event::Sample(Sample { seq, t_us: 1000, value: 0.25, clipped: false })
    }

    #[test]
    fn samples_and_the_end_mark_are_read() {
        let bytes = [frame(1, 1, 7, 1000, 0.25), frame(2, 0, 8, 2000, 0.0)].concat();
        let clipped = Sample { seq: 7, t_us: 1000, value: 0.25, clipped: true };
        assert_eq!(
            decode_all(&bytes),
            [Event::Sample(clipped), Event::End { next_seq: 8, t_us: 2000 }]
        );
    }

    #[test]
    fn a_frame_is_24_bytes_with_the_published_crc() {
        // CRC-32 of the ASCII digits 1 to 9 is CBF43926 (the check value of every CRC catalogue).
        assert_eq!(crc32fast::hash(b"123456789"), 0xcbf4_3926);
        assert_eq!(frame(1, 0, 0, 0, 0.0).len(), FRAME);
    }

    #[test]
    fn a_damaged_byte_costs_its_frame_and_no_other() {
        for damaged in 0..FRAME {
            let mut bytes = [frame(1, 0, 1, 1000, 0.25), frame(1, 0, 2, 1000, 0.25)].concat();
            bytes.extend(frame(1, 0, 3, 1000, 0.25));
            bytes[FRAME + damaged] ^= 0x10;
            assert_eq!(decode_all(&bytes), [sample(1), sample(3)], "byte {damaged}");
        }
    }

    #[test]
    fn a_lost_byte_costs_its_frame_and_no_other() {
        for lost in 0..FRAME {
            let mut bytes = [frame(1, 0, 1, 1000, 0.25), frame(1, 0, 2, 1000, 0.25)].concat();
            bytes.extend(frame(1, 0, 3, 1000, 0.25));
            bytes.remove(FRAME + lost);
            assert_eq!(decode_all(&bytes), [sample(1), sample(3)], "byte {lost}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_decoder_panic_or_keep_memory(
            bytes in proptest::collection::vec(prop_oneof![any::<u8>(), Just(0xa5), Just(0x5a)], 0..600)
        ) {
            let mut decoder = FrameDecoder::default();
            decoder.push(&bytes);
            while decoder.next_event().is_some() {}
            prop_assert!(decoder.pending.len() < FRAME);
        }

        #[test]
        fn after_noise_the_next_frame_is_found(
            noise in proptest::collection::vec(prop_oneof![any::<u8>(), Just(0xa5), Just(0x5a)], 0..60),
            seq in any::<u32>(),
            cut in 0usize..84,
        ) {
            let bytes = [noise, frame(1, 0, seq, 1000, 0.25)].concat();
            let cut = cut.min(bytes.len());
            let mut decoder = FrameDecoder::default();
            let mut events = Vec::new();
            for part in [&bytes[..cut], &bytes[cut..]] {
                decoder.push(part);
                events.extend(std::iter::from_fn(|| decoder.next_event()));
            }
            // Noise may look like the beginning of a frame, which then waits for more bytes.
            decoder.push(&[0; FRAME]);
            events.extend(std::iter::from_fn(|| decoder.next_event()));
            prop_assert_eq!(events, [sample(seq)]);
        }
    }
}
