//! Changes to files that tend to bring out what readers take for granted.

/// A small deterministic generator (SplitMix64; Steele et al. 2014).
pub struct Random(pub u64);

impl Random {
    /// A number from 0 to `n` - 1.
    pub fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) % n.max(1) as u64) as usize
    }
}

const NASTY: &[&str] = &[
    "-1",
    "0",
    "1e308",
    "-1e308",
    "1e-308",
    "4294967295",
    "4294967296",
    "-2147483648",
    "99999999999999999999",
    "null",
    "true",
    "\"\"",
    "[]",
    "{}",
    "[[]]",
    "nan",
    "inf",
    "\"..\"",
    "\"/dev/zero\"",
    "\u{7f}",
    "\\u0000",
    "NaN",
    "[0,0,0]",
    "\n",
    " ",
];

/// Changes one to four places.
pub fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        match random.below(7) {
            0 if !bytes.is_empty() => bytes[at] = random.below(256) as u8,
            1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            2 => bytes.truncate(at.max(1)),
            3 => {
                let to = (at + random.below(12)).min(bytes.len());
                bytes.drain(at..to);
            }
            4 => {
                let to = (at + random.below(40)).min(bytes.len());
                let copy = bytes[at..to].to_vec();
                bytes.splice(at..at, copy);
            }
            5 => {
                // A large number in little-endian bytes.
                let number = [0xffff_ffffu32, 0x7fff_ffff, 0x8000_0000, 1 << 24, 0][random.below(5)];
                let to = (at + 4).min(bytes.len());
                bytes.splice(at..to, number.to_le_bytes());
            }
            _ => {
                // Over a number or word, where there is one here.
                let word = |b: &u8| b.is_ascii_alphanumeric() || b".-+\"".contains(b);
                let to = at + bytes[at.min(bytes.len())..].iter().take_while(|b| word(b)).count();
                bytes.splice(at..to, NASTY[random.below(NASTY.len())].bytes());
            }
        }
    }
}
