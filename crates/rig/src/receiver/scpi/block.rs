//! Blocks of bytes as IEEE 488.2 (1992, 8.7.9 and 8.7.10) has instruments send them.
//!
//! `#`, a digit that says how many digits follow, those digits as the number of bytes, the bytes; or `#0`, bytes, and a
//! line end where the message ends.

/// More bytes than this in one block are taken for damage.
const MOST_BYTES: usize = 64 << 20;

/// Words before a block, as some instruments repeat the command there, are no longer than this, bytes.
const LONGEST_HEADER: usize = 64;

/// What a message holds so far.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Block<'a> {
    /// More has to come.
    Partial,
    /// The bytes of a block of stated length; and what came after it.
    Definite {
        /// The block's bytes.
        data: &'a [u8],
        /// What came after it.
        rest: &'a [u8],
    },
    /// The bytes of a block that ends with its message. It ends here if nothing more comes.
    Indefinite {
        /// The bytes without the line end.
        data: &'a [u8],
    },
    /// This is no block.
    Damaged,
}

/// Looks for a block at the start of a message.
pub(super) fn read_block(message: &[u8]) -> Block<'_> {
    let Some(start) = message.iter().position(|&byte| byte == b'#') else {
        return if message.len() > LONGEST_HEADER { Block::Damaged } else { Block::Partial };
    };
    if start > LONGEST_HEADER {
        return Block::Damaged;
    }
    let Some((&count, after)) = message[start + 1..].split_first() else { return Block::Partial };
    match count {
        b'0' => match after.strip_suffix(b"\n") {
            Some(data) => Block::Indefinite { data },
            None if after.len() > MOST_BYTES => Block::Damaged,
            None => Block::Partial,
        },
        b'1'..=b'9' => {
            let count = usize::from(count - b'0');
            let digits = &after[..count.min(after.len())];
            if !digits.iter().all(u8::is_ascii_digit) {
                return Block::Damaged;
            }
            if digits.len() < count {
                return Block::Partial;
            }
            let length = digits.iter().fold(0, |sum, digit| 10 * sum + usize::from(digit - b'0'));
            match after[count..].split_at_checked(length) {
                _ if length > MOST_BYTES => Block::Damaged,
                Some((data, rest)) => Block::Definite { data, rest },
                None => Block::Partial,
            }
        }
        _ => Block::Damaged,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn blocks_of_stated_length_are_read_with_line_ends_among_their_bytes() {
        let data: &[u8] = b"a\n#\0b";
        assert_eq!(read_block(b"#15a\n#\0b\n"), Block::Definite { data, rest: b"\n" });
        assert_eq!(read_block(b"#9000000005a\n#\0b"), Block::Definite { data, rest: b"" });
        assert_eq!(
            read_block(b"C1:WF DAT2,#15a\n#\0b\n\n"),
            Block::Definite { data, rest: b"\n\n" }
        );
        assert_eq!(read_block(b"#10"), Block::Definite { data: b"", rest: b"" });
    }

    #[test]
    fn a_block_without_length_ends_with_its_message() {
        assert_eq!(read_block(b"#0ab\nc"), Block::Partial);
        assert_eq!(read_block(b"#0ab\nc\n"), Block::Indefinite { data: b"ab\nc" });
    }

    #[test]
    fn what_is_no_block_is_told_from_what_is_none_yet() {
        for partial in ["", "C1:WF ", "#", "#4", "#400", "#13ab", "#0abc"] {
            assert_eq!(read_block(partial.as_bytes()), Block::Partial, "{partial}");
        }
        for damaged in ["#x", "#2x0", "#9999999999", "#(1)"] {
            assert_eq!(read_block(damaged.as_bytes()), Block::Damaged, "{damaged}");
        }
        assert_eq!(read_block(&[b'7'; 65]), Block::Damaged);
    }

    proptest! {
        #[test]
        fn every_beginning_of_a_block_is_partial_and_the_whole_is_its_bytes(
            data in prop::collection::vec(any::<u8>(), 0..300), cut in 0.0..1.0f64,
        ) {
            let digits = data.len().to_string();
            let message = [format!("#{}{digits}", digits.len()).as_bytes(), &data].concat();
            let cut = (cut * message.len() as f64) as usize;
            prop_assert_eq!(read_block(&message[..cut]), Block::Partial);
            prop_assert_eq!(read_block(&message), Block::Definite { data: &data, rest: b"" });
        }

        #[test]
        fn no_bytes_make_it_panic(message in prop::collection::vec(any::<u8>(), 0..300)) {
            read_block(&message);
            read_block(&[b"#", &message[..]].concat());
        }
    }
}
