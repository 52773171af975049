//! Changes to files that tend to bring out what readers take for granted.

use serde_json::{Value, json};

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

/// Changes one to four values of a JSON document: to nasty ones, to others of it, by one; or leaves them out, or doubles them.
pub fn mutate_json(document: &mut Value, random: &mut Random) {
    for _ in 0..1 + random.below(4) {
        let mut places = Vec::new();
        list(document, String::new(), &mut places);
        let place = &places[random.below(places.len())];
        let other = document.pointer(&places[random.below(places.len())]).cloned().expect("a place of the list");
        let (parent, key) = place.rsplit_once('/').unwrap_or_default();
        let Some(value) = document.pointer_mut(place) else { continue };
        let number = value.as_i64();
        match (random.below(6), value) {
            (0 | 1, value) => *value = nasty(random),
            (2, value) => *value = other,
            (3, Value::Array(items)) => items.extend(items.last().cloned()),
            (4, value) if number.is_some() => *value = json!(number.unwrap_or(0).saturating_add([-1, 1, 255][random.below(3)])),
            _ => match document.pointer_mut(parent) {
                Some(Value::Object(map)) => drop(map.remove(key)),
                Some(Value::Array(items)) => drop(items.pop()),
                _ => {}
            },
        }
    }
}

fn nasty(random: &mut Random) -> Value {
    let all = json!([
        -1,
        0,
        1,
        2,
        3,
        4,
        5,
        6,
        7,
        12,
        255,
        5120,
        5125,
        5126,
        65535,
        4_294_967_295u64,
        4_294_967_296u64,
        u64::MAX,
        -2_147_483_648i64,
        1e308,
        -1e308,
        1e-308,
        0.5,
        1.0000001,
        true,
        "",
        "..",
        "VEC2",
        "MAT4",
        "POSITION",
        "data:,",
        "http://a",
        [],
        {},
        [[]],
        [0, 0, 0],
        [1e30, 0, 0, 1],
        null
    ]);
    all[random.below(all.as_array().map_or(1, Vec::len))].clone()
}

/// JSON pointers of all values in a document but the root.
fn list(value: &Value, path: String, places: &mut Vec<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(k, v)| list(v, format!("{path}/{k}"), places)),
        Value::Array(items) => items.iter().enumerate().for_each(|(i, v)| list(v, format!("{path}/{i}"), places)),
        _ => {}
    }
    if !path.is_empty() {
        places.push(path);
    }
}
