//! Base 64, as VTU files have it.

/// The first `most` bytes that `text` stands for, fewer if it ends before; nothing if a character is none of base 64. White space is
/// skipped. What is padded may be followed by more: VTK pads the header of compressed data by itself.
pub fn decode(text: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(most.min(text.len()));
    let (mut bits, mut count) = (0u32, 0);
    for &character in text.iter().filter(|character| !character.is_ascii_whitespace()) {
        if bytes.len() >= most {
            break;
        }
        let value = match character {
            b'A'..=b'Z' => character - b'A',
            b'a'..=b'z' => character - b'a' + 26,
            b'0'..=b'9' => character - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' => {
                // What follows begins at a whole byte.
                (bits, count) = (0, 0);
                continue;
            }
            _ => return None,
        };
        (bits, count) = (bits << 6 | u32::from(value), count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    bytes.truncate(most);
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn padding_may_be_in_the_middle() {
        assert_eq!(decode(b"cGFscGF0ZQ==", 100).unwrap(), b"palpate");
        assert_eq!(decode(b" cGFs\ncGF0ZQ==/+8=", 100).unwrap(), b"palpate\xff\xef");
        assert_eq!(decode(b"cGFscGF0ZQ==", 4).unwrap(), b"palp");
        assert_eq!(decode(b"cGFs*", 100), None);
    }
}
