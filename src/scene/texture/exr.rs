//! Pictures in EXR files: spectra, RGB or grey, by themselves or in a layer, where the display window shows them.

use super::picture::{Samples, Spectra};
use super::space::ColorSpace;
use crate::channels::{Bands, Selection, check_size, read_pixels};
use exr::meta::header::Header;
use exr::prelude::Vec2;
use std::io::Cursor;
use std::sync::Arc;

/// What was found in a file.
pub(super) struct Found {
    pub width: u32,
    pub height: u32,
    pub channels: usize,
    pub samples: Samples,
    pub space: Option<ColorSpace>,
    pub notes: Vec<String>,
}

/// What of a layer is read: channels by their number, as many for a pixel as there are.
struct Choice {
    part: usize,
    channels: Vec<(usize, f64)>,
    /// The bins, nm, if they are spectral.
    edges_nm: Option<Vec<f64>>,
    note: Option<String>,
}

/// The size that a file is shown at.
pub(super) fn dimensions(bytes: &[u8]) -> Result<(usize, usize), String> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    let size = reader.headers().first().ok_or("no picture in it")?.shared_attributes.display_window.size;
    Ok((size.width(), size.height()))
}

/// Reads a file whose size is thought to be right; the error says what is wrong with it.
pub(super) fn decode(bytes: &[u8], bands: Option<&Bands>) -> Result<Found, String> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    check_size(reader.headers(), bytes.len() as u64)?;
    let Choice { part, channels, edges_nm, note } = choose(reader.headers(), bands)?;
    let header = reader.headers()[part].clone();
    let pixels = read_pixels(reader, part, &channels, &[]).map_err(|e| e.to_string())?.interleaved;
    let (values, width, height) = shown(&header, pixels, channels.len());
    let space = header.shared_attributes.chromaticities.filter(|_| edges_nm.is_none() && channels.len() >= 3).and_then(|c| {
        let at = |v: Vec2<f32>| [f64::from(v.0), f64::from(v.1)];
        ColorSpace::of_chromaticities([at(c.red), at(c.green), at(c.blue)], at(c.white))
    });
    let channels = channels.len();
    let samples = match edges_nm {
        Some(edges_nm) => Samples::Spectra(Arc::new(Spectra::new(edges_nm, values))),
        None => Samples::Floats(values),
    };
    Ok(Found { width, height, channels, samples, space, notes: note.into_iter().collect() })
}

/// Spectra before colours, and these before layers that have names.
fn choose(headers: &[Header], bands: Option<&Bands>) -> Result<Choice, String> {
    let names_of = |header: &Header| header.channels.list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>();
    let flat: Vec<(usize, Vec<String>)> =
        headers.iter().enumerate().filter(|(_, header)| !header.deep).map(|(part, header)| (part, names_of(header))).collect();
    for (part, names) in &flat {
        if let Some(selection) = bands.and_then(|b| b.select(names)).or_else(|| Selection::of_layout(names)) {
            let Selection { channels, edges_nm, .. } = selection?;
            return Ok(Choice { part: *part, channels, edges_nm: Some(edges_nm), note: None });
        }
    }
    let mut layers: Vec<(usize, String, Vec<usize>)> = Vec::new();
    for (part, names) in &flat {
        let part_name = headers[*part].own_attributes.layer_name.as_ref().map(|n| n.to_string()).unwrap_or_default();
        let mut prefixes: Vec<&str> = Vec::new();
        for name in names {
            let prefix = name.rfind('.').map_or("", |dot| &name[..=dot]);
            if !prefixes.contains(&prefix) {
                prefixes.push(prefix);
            }
        }
        for prefix in prefixes {
            let find = |last: &str| {
                names.iter().position(|n| n.strip_prefix(prefix).is_some_and(|rest| rest.eq_ignore_ascii_case(last)))
            };
            let colour = match (["R", "G", "B"].map(find), find("Y"), find("X")) {
                ([Some(r), Some(g), Some(b)], ..) => vec![r, g, b],
                // X, Y, Z are a vector, as of normals.
                (_, Some(y), None) if find("RY").is_none() => vec![y],
                _ => continue,
            };
            let of_part = if prefix.is_empty() { part_name.as_str() } else { prefix.trim_end_matches('.') };
            let unnamed = prefix.is_empty() && flat.len() == 1;
            let name = if unnamed { String::new() } else { of_part.to_string() };
            layers.push((*part, name, colour.into_iter().chain(find("A")).collect()));
        }
    }
    // What stands without a name is the picture itself; Blender calls it Combined.
    let rank = |name: &str| match name {
        "" => 0,
        _ if name.ends_with("Combined") || name.eq_ignore_ascii_case("rgba") || name.eq_ignore_ascii_case("beauty") => 1,
        _ => 2,
    };
    let best = (0..layers.len()).min_by_key(|&i| rank(&layers[i].1)).ok_or_else(|| {
        let names: Vec<&String> = flat.iter().flat_map(|(_, names)| names).take(8).collect();
        format!("no channels of colour (R, G and B, or Y) or of spectra (S0.<wavelength>nm), but {names:?}")
    })?;
    let others = layers.len() - 1;
    let (part, name, channels) = layers.swap_remove(best);
    let note = (others > 0 && !name.is_empty()).then(|| format!("of {} layers the picture is {name:?}", others + 1));
    Ok(Choice { part, channels: channels.into_iter().map(|c| (c, 1.0)).collect(), edges_nm: None, note })
}

/// The part of the pixels that the display window shows; beside them it is black.
fn shown(header: &Header, pixels: Vec<f32>, channels: usize) -> (Vec<f32>, u32, u32) {
    let window = header.shared_attributes.display_window;
    let (width, height) = (window.size.width(), window.size.height());
    let (own_width, own_height) = (header.layer_size.width(), header.layer_size.height());
    let corner = |own: i32, whole: i32| i64::from(own) - i64::from(whole);
    let position = header.own_attributes.layer_position;
    let (left, top) = (corner(position.0, window.position.0), corner(position.1, window.position.1));
    if (left, top, width, height) == (0, 0, own_width, own_height) {
        return (pixels, width as u32, height as u32);
    }
    let mut values = vec![0.0; width * height * channels];
    let columns = left.max(0)..(left + own_width as i64).min(width as i64);
    for row in top.max(0)..(top + own_height as i64).min(height as i64) {
        if columns.is_empty() {
            break;
        }
        let count = (columns.end - columns.start) as usize * channels;
        let from = ((row - top) as usize * own_width + (columns.start - left) as usize) * channels;
        let to = (row as usize * width + columns.start as usize) * channels;
        values[to..to + count].copy_from_slice(&pixels[from..from + count]);
    }
    (values, width as u32, height as u32)
}
