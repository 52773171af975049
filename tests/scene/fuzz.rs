//! No input makes the loader panic or hang: shipped files with bytes changed, cut, doubled or swapped for nasty ones.

use crate::{folder, shipped};
use abbe::scene::{LoadOptions, load_str};
use std::path::Path;

/// A small deterministic generator (SplitMix64; Steele et al. 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
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
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        match random.below(6) {
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
            _ => {
                // Over a number or word, where there is one here.
                let word = |b: &u8| b.is_ascii_alphanumeric() || b".-+\"".contains(b);
                let to = at + bytes[at.min(bytes.len())..].iter().take_while(|b| word(b)).count();
                bytes.splice(at..to, NASTY[random.below(NASTY.len())].bytes());
            }
        }
    }
}

#[test]
fn mutated_scenes_never_panic() {
    let mut random = Random(1);
    let options = LoadOptions::default();
    let texts: Vec<Vec<u8>> = shipped().iter().filter(|p| !p.ends_with("pool.json")).map(|p| std::fs::read(p).unwrap()).collect();
    let everything = std::fs::read(folder("tests/data/scenes/everything.json")).unwrap();
    let mut accepted = 0;
    for round in 0..3000 {
        let mut bytes = if round % 2 == 0 { everything.clone() } else { texts[random.below(texts.len())].clone() };
        mutate(&mut bytes, &mut random);
        let text = String::from_utf8_lossy(&bytes);
        match load_str(&text, Path::new("fuzz.json"), &folder("tests/data/scenes"), &options) {
            Ok(_) => accepted += 1,
            Err(e) => assert!(!e.to_string().contains('\n'), "more than one line: {e}"),
        }
    }
    // The mutations are gentle enough that both outcomes are exercised.
    assert!((30..2900).contains(&accepted), "{accepted} accepted");
}

#[test]
fn mutated_meshes_pictures_and_spectra_never_panic() {
    let here = std::env::temp_dir().join(format!("abbe-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    let mut random = Random(2);
    let mut accepted = 0;
    let mut rounds = 0;
    for (file, count) in [
        ("scenes/compare/newton/prism.ply", 600),
        ("tests/data/scenes/dropped.ply", 600),
        ("tests/data/scenes/square.obj", 600),
        ("tests/data/scenes/glass.gltf", 900),
        ("tests/data/scenes/sky.png", 600),
        ("tests/data/scenes/ramp.csv", 600),
        ("scenes/bunny.glb", 150),
    ] {
        let original = std::fs::read(folder(file)).unwrap();
        let name = Path::new(file).file_name().unwrap().to_string_lossy().into_owned();
        for round in 0..count {
            let mut bytes = original.clone();
            if name == "bunny.glb" {
                // The interesting part is its head.
                let tail = bytes.split_off(1200);
                mutate(&mut bytes, &mut random);
                bytes.extend(tail);
            } else {
                mutate(&mut bytes, &mut random);
            }
            std::fs::write(here.join(&name), &bytes).unwrap();
            let as_scene = (name.ends_with("gltf") || name.ends_with("glb")) && round % 2 == 0;
            let loaded = if as_scene {
                abbe::scene::load(&here.join(&name), &LoadOptions::default())
            } else {
                let text = match name.as_str() {
                    "sky.png" => crate::scene_with("lights", r#"[{"image": {"file": "sky.png"}}]"#),
                    "ramp.csv" => crate::scene_with("lights", r#"[{"constant": {"radiance": {"file": "ramp.csv"}}}]"#),
                    _ => crate::scene_with(
                        "shapes",
                        &format!(r#"[{{"mesh": {{"file": "{name}", "smooth": true}}, "material": "m"}}]"#),
                    ),
                };
                load_str(&text, Path::new("fuzz.json"), &here, &LoadOptions::default())
            };
            rounds += 1;
            match loaded {
                Ok(_) => accepted += 1,
                Err(e) => assert!(!e.to_string().contains('\n'), "more than one line: {e}"),
            }
        }
    }
    std::fs::remove_dir_all(&here).unwrap();
    assert!(accepted > rounds / 50 && accepted < rounds, "{accepted} of {rounds} accepted");
}
