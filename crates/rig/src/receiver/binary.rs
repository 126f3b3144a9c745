//! Samples as frames with a checksum.

use super::protocol::{Event, Sample};

const MARK: [u8; 2] = [0xa5, 0x5a];
const FRAME: usize = 24;
/// A frame with both parts of a sample.
const IQ_FRAME: usize = 28;
const KIND_SAMPLE: u8 = 1;
const KIND_END: u8 = 2;
const KIND_IQ: u8 = 3;
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
            let length = if *self.pending.get(2)? == KIND_IQ { IQ_FRAME } else { FRAME };
            let frame = self.pending.get(..length)?;
            if let Some(event) = decode(frame) {
                self.pending.drain(..length);
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

fn decode(frame: &[u8]) -> Option<Event> {
    let checked = frame.len() - 4;
    if u32::from_le_bytes(field(frame, checked)) != crc32fast::hash(&frame[2..checked]) {
        return None;
    }
    let number = |at: usize| f64::from(f32::from_le_bytes(field(frame, at)));
    let (seq, t_us) = (u32::from_le_bytes(field(frame, 4)), u64::from_le_bytes(field(frame, 8)));
    match frame[2] {
        kind @ (KIND_SAMPLE | KIND_IQ) => Some(Event::Sample(Sample {
            seq,
            t_us,
            value: number(16),
            quadrature: (kind == KIND_IQ).then(|| number(20)),
            clipped: frame[3] & FLAG_CLIPPED != 0,
        })),
        KIND_END => Some(Event::End { next_seq: seq, t_us }),
        _ => None,
    }
}

fn field<const N: usize>(frame: &[u8], at: usize) -> [u8; N] {
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

    /// The same with both parts of a sample.
    fn iq_frame(seq: u32, parts: [f32; 2]) -> Vec<u8> {
        let mut frame = vec![0xa5, 0x5a, 3, 0];
        frame.extend(seq.to_le_bytes());
        frame.extend(1000u64.to_le_bytes());
        parts.iter().for_each(|part| frame.extend(part.to_le_bytes()));
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
        Event::Sample(Sample { seq, t_us: 1000, value: 0.25, quadrature: None, clipped: false })
    }

    fn iq_sample(seq: u32) -> Event {
        let (value, quadrature) = (0.25, Some(-0.5));
        Event::Sample(Sample { seq, t_us: 1000, value, quadrature, clipped: false })
    }

    #[test]
    fn samples_and_the_end_mark_are_read() {
        let bytes = [frame(1, 1, 7, 1000, 0.25), frame(2, 0, 8, 2000, 0.0)].concat();
        let clipped = Sample { seq: 7, t_us: 1000, value: 0.25, quadrature: None, clipped: true };
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
    fn a_damaged_or_lost_byte_of_an_iq_frame_costs_its_frame_and_no_other() {
        let frames = || [1, 2, 3].map(|seq| iq_frame(seq, [0.25, -0.5])).concat();
        assert_eq!(decode_all(&frames()), [1, 2, 3].map(iq_sample));
        // The end mark is behind it, so that the bytes that a damaged kind waits for come.
        let end = frame(2, 0, 4, 2000, 0.0);
        for at in 0..IQ_FRAME {
            for lost in [false, true] {
                let mut bytes = [frames(), end.clone()].concat();
                match lost {
                    true => drop(bytes.remove(IQ_FRAME + at)),
                    false => bytes[IQ_FRAME + at] ^= 0x10,
                }
                let wanted = [iq_sample(1), iq_sample(3), Event::End { next_seq: 4, t_us: 2000 }];
                assert_eq!(decode_all(&bytes), wanted, "byte {at}, lost: {lost}");
            }
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
            prop_assert!(decoder.pending.len() < IQ_FRAME);
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
            decoder.push(&[0; IQ_FRAME]);
            events.extend(std::iter::from_fn(|| decoder.next_event()));
            prop_assert_eq!(events, [sample(seq)]);
        }
    }
}
