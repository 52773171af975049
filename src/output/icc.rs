//! ICC profiles of the spaces that pictures are written in (ICC.1:2022, version 4: primaries and a parametric curve).

use crate::color::adapt::{self, Method};
use crate::color::cie::xyz_of_xy;
use crate::color::convert::multiply;
use crate::color::space::Space;

/// The profile connection space's white, D50, as the standard rounds it (section 7.2.16).
const D50: [f64; 3] = [0.9642, 1.0, 0.8249];
/// Bytes of the header.
const HEADER: usize = 128;

/// A profile for RGB pictures of `space`.
pub fn profile(space: Space) -> Vec<u8> {
    let to_d50 = adapt::matrix(xyz_of_xy(space.white()), D50, Method::Bradford);
    let primaries = multiply(&to_d50, &space.to_xyz());
    let column = |c: usize| xyz(primaries.map(|row| row[c]));
    let curve = parametric(space);
    let tags: [(&[u8; 4], Vec<u8>); 10] = [
        (b"desc", text(name(space))),
        (b"cprt", text("CC0")),
        (b"wtpt", xyz(D50)),
        (b"chad", [&b"sf32\0\0\0\0"[..], &to_d50.iter().flatten().flat_map(|&v| fixed(v)).collect::<Vec<u8>>()].concat()),
        (b"rXYZ", column(0)),
        (b"gXYZ", column(1)),
        (b"bXYZ", column(2)),
        (b"rTRC", curve.clone()),
        (b"gTRC", curve.clone()),
        (b"bTRC", curve),
    ];
    let mut table = (tags.len() as u32).to_be_bytes().to_vec();
    let mut data = Vec::new();
    for (signature, content) in &tags {
        let offset = HEADER + 4 + 12 * tags.len() + data.len();
        table.extend(*signature);
        table.extend((offset as u32).to_be_bytes());
        table.extend((content.len() as u32).to_be_bytes());
        data.extend(content);
        data.resize(data.len().next_multiple_of(4), 0);
    }
    let size = HEADER + table.len() + data.len();
    [header(size), table, data].concat()
}

/// What the space is called.
fn name(space: Space) -> &'static str {
    match space {
        Space::Srgb => "sRGB",
        Space::DisplayP3 => "Display P3",
        Space::Rec2020 => "Rec. 2020",
        Space::AcesCg => "ACEScg",
    }
}

fn header(size: usize) -> Vec<u8> {
    let mut bytes = vec![0; HEADER];
    let mut put = |at: usize, what: &[u8]| bytes[at..at + what.len()].copy_from_slice(what);
    put(0, &(size as u32).to_be_bytes());
    put(8, &[4, 0x40]);
    put(12, b"mntrRGB XYZ ");
    // A date is asked for; that of the design keeps the same picture the same file.
    put(24, &[2026u16, 1, 1, 0, 0, 0].map(u16::to_be_bytes).concat());
    put(36, b"acsp");
    // Rendering intent: media-relative colorimetric.
    put(64, &1u32.to_be_bytes());
    put(68, &D50.map(fixed).concat());
    bytes
}

/// s15Fixed16Number.
fn fixed(v: f64) -> [u8; 4] {
    ((v * 65536.0).round() as i32).to_be_bytes()
}

fn xyz(v: [f64; 3]) -> Vec<u8> {
    [&b"XYZ \0\0\0\0"[..], &v.map(fixed).concat()].concat()
}

/// parametricCurveType, function 3: (a x + b)^g from d on, c x below.
fn parametric(space: Space) -> Vec<u8> {
    let t = space.transfer();
    let [g, a, b, c, d] = [t.gamma, 1.0 / t.alpha, (t.alpha - 1.0) / t.alpha, 1.0 / t.slope, t.from];
    [&b"para\0\0\0\0\0\x03\0\0"[..], &[g, a, b, c, d].map(fixed).concat()].concat()
}

/// multiLocalizedUnicodeType with one record, in English.
fn text(s: &str) -> Vec<u8> {
    let utf16: Vec<u8> = s.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let numbers = [1u32, 12].map(u32::to_be_bytes).concat();
    let record = [utf16.len() as u32, 28].map(u32::to_be_bytes).concat();
    [&b"mluc\0\0\0\0"[..], &numbers, b"enUS", &record, &utf16].concat()
}
