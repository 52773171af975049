//! Pictures decoded once, whoever names them, within what memory there is for them.

use super::cmyk::srgb_of_inks;
use super::exr;
use super::picture::{Picture, Samples};
use super::space::ColorSpace;
use crate::channels::Bands;
use crate::error::Result;
use crate::scene::json::Node;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Cursor;
use std::sync::{Arc, Mutex, PoisonError};

/// Pixels at most on a side.
const LARGEST_SIDE: u32 = 16384;
/// Pixels at most.
const MOST_PIXELS: u64 = 1 << 26;
/// Pixels at most for each byte of the file, beyond the first Mi pixels: what deflate can do at best, so that a small file cannot ask for much memory.
const PIXELS_PER_BYTE: u64 = 1032;
/// Bytes that all pictures of a scene may take: every adapter holds 1 GiB of a table, where colours and texture coordinates want room too.
const MOST_BYTES: u64 = 768 << 20;

/// The pictures that were decoded already, by their content; shared with the copies.
#[derive(Debug, Clone, Default)]
pub(in crate::scene) struct Pictures(Arc<Mutex<Decoded>>);

#[derive(Debug)]
struct Decoded {
    known: HashMap<(u64, usize), Arc<Picture>>,
    /// Bytes that there is room for.
    room: u64,
}

impl Default for Decoded {
    fn default() -> Self {
        Decoded { known: HashMap::new(), room: MOST_BYTES }
    }
}

impl Pictures {
    /// Decodes a picture, or finds it again; `name` stands for it in messages, and `bands` say what the channels of a spectral EXR are that do not say
    /// so themselves. Each may take half of the room that those before it have left, and is made smaller until it does.
    pub(in crate::scene) fn decode(&self, bytes: &[u8], name: &str, node: &Node, bands: Option<&Bands>) -> Result<Arc<Picture>> {
        let mut hasher = DefaultHasher::new();
        (bytes, bands.map(|b| format!("{b:?}"))).hash(&mut hasher);
        let key = (hasher.finish(), bytes.len());
        let mut decoded = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(picture) = decoded.known.get(&key) {
            return Ok(picture.clone());
        }
        let mut picture = decode(bytes, name, node, bands)?;
        let (width, height) = (picture.width, picture.height);
        while picture.bytes() > decoded.room / 2 && picture.width.max(picture.height) > 1 {
            picture = picture.halved();
        }
        if picture.width != width || picture.height != height {
            let text = format!(
                "{name} is made smaller, from {width} x {height} pixels to {} x {}: all pictures together have {} MiB",
                picture.width,
                picture.height,
                MOST_BYTES >> 20
            );
            picture.notes.push(text);
        }
        decoded.room = decoded.room.saturating_sub(picture.bytes());
        let picture = Arc::new(picture);
        decoded.known.insert(key, picture.clone());
        Ok(picture)
    }
}

/// Decodes a picture. The size is checked before there is room made for it.
fn decode(bytes: &[u8], name: &str, node: &Node, bands: Option<&Bands>) -> Result<Picture> {
    let unreadable = |e: String| node.fail(format!("{name}: {e}"), "use a readable .png, .jpg, .webp, .hdr or .exr picture");
    let reader = || ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| unreadable(e.to_string()));
    let format = reader()?.format();
    if bytes.starts_with(b"\xabKTX 2") {
        return Err(unreadable("this is a KTX2 picture, which is not read".into()));
    }
    let (width, height) = match format {
        Some(ImageFormat::OpenExr) => exr::dimensions(bytes).map_err(unreadable)?,
        _ => reader()?.into_dimensions().map(|(w, h)| (w as usize, h as usize)).map_err(|e| unreadable(e.to_string()))?,
    };
    if width == 0 || height == 0 {
        return Err(unreadable("the picture is empty".into()));
    }
    let most = MOST_PIXELS.min((1 << 20) + PIXELS_PER_BYTE * bytes.len() as u64);
    if width.max(height) > LARGEST_SIDE as usize || width as u64 * height as u64 > most {
        return Err(node.fail(
            format!("{name}: {width} x {height} pixels are too many for a file of {} bytes", bytes.len()),
            format!("use a picture of at most {LARGEST_SIDE} pixels on a side and {} Mi in all", MOST_PIXELS >> 20),
        ));
    }
    let picture = match format {
        Some(ImageFormat::OpenExr) => {
            let exr::Found { width, height, channels, samples, space, notes } = exr::decode(bytes, bands).map_err(unreadable)?;
            Picture::new(width, height, channels, samples, space, notes)
        }
        format => {
            let mut limits = Limits::default();
            limits.max_image_width = Some(LARGEST_SIDE);
            limits.max_image_height = Some(LARGEST_SIDE);
            limits.max_alloc = Some(16 * most);
            let mut reader = reader()?;
            reader.limits(limits);
            let mut decoder = reader.into_decoder().map_err(|e| unreadable(e.to_string()))?;
            let icc = decoder.icc_profile().unwrap_or_default();
            let decoded = DynamicImage::from_decoder(decoder).map_err(|e| unreadable(e.to_string()))?;
            of_image(decoded, format, bytes, icc)
        }
    };
    picture.check(name, node)?;
    Ok(picture)
}

fn of_image(decoded: DynamicImage, format: Option<ImageFormat>, bytes: &[u8], icc: Option<Vec<u8>>) -> Picture {
    let (width, height) = (decoded.width(), decoded.height());
    let inks = icc.as_ref().filter(|_| format == Some(ImageFormat::Jpeg)).and_then(|icc| srgb_of_inks(bytes, icc));
    if let Some(colors) = inks.filter(|colors| colors.len() == 3 * width as usize * height as usize) {
        return Picture::new(width, height, 3, Samples::Bytes(colors), None, Vec::new());
    }
    let (channels, samples) = match decoded {
        DynamicImage::ImageLuma8(i) => (1, Samples::Bytes(i.into_raw())),
        DynamicImage::ImageLumaA8(i) => (2, Samples::Bytes(i.into_raw())),
        DynamicImage::ImageRgb8(i) => (3, Samples::Bytes(i.into_raw())),
        DynamicImage::ImageRgba8(i) => (4, Samples::Bytes(i.into_raw())),
        DynamicImage::ImageLuma16(i) => (1, Samples::Words(i.into_raw())),
        DynamicImage::ImageLumaA16(i) => (2, Samples::Words(i.into_raw())),
        DynamicImage::ImageRgb16(i) => (3, Samples::Words(i.into_raw())),
        DynamicImage::ImageRgba16(i) => (4, Samples::Words(i.into_raw())),
        DynamicImage::ImageRgb32F(i) => (3, Samples::Floats(i.into_raw())),
        other => (4, Samples::Floats(other.into_rgba32f().into_raw())),
    };
    let space = match (format, icc) {
        (Some(ImageFormat::Png), _) => ColorSpace::of_png(bytes),
        (Some(ImageFormat::Hdr), _) => Ok(ColorSpace::of_hdr(bytes)),
        (_, Some(icc)) => ColorSpace::of_icc(&icc, if channels < 3 { 1 } else { 3 }),
        _ => Ok(None),
    };
    let (space, notes) = match space {
        Ok(space) => (space, Vec::new()),
        Err(note) => (None, vec![note.to_string()]),
    };
    Picture::new(width, height, channels, samples, space, notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn pictures_are_made_smaller_until_all_have_room() {
        let mut file = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut file);
        // Columns of 0 and 200 in turn.
        let pixels: Vec<u8> = (0..64 * 64).flat_map(|i| [if i % 2 == 0 { 0 } else { 200 }, 100, 50]).collect();
        image::ImageEncoder::write_image(encoder, &pixels, 64, 64, image::ExtendedColorType::Rgb8).expect("a picture");
        let value = serde_json::Value::Null;
        let node = Node::root(&value, Path::new("t.json"));
        let pictures = Pictures::default();
        pictures.0.lock().expect("alone").room = 20_000;
        let first = pictures.decode(&file, "one", &node, None).expect("a picture");
        assert_eq!((first.width, first.height), (32, 32));
        assert!(first.notes[0].contains("from 64 x 64 pixels to 32 x 32"), "{:?}", first.notes);
        assert_eq!(first.rgb(77).map(|v| (v * 255.0).round()), [100.0, 100.0, 50.0]);
        let again = pictures.decode(&file, "one", &node, None).expect("a picture");
        assert!(Arc::ptr_eq(&first, &again));
        // The others find less room, and still some.
        for n in 0..40u8 {
            let other = [file.as_slice(), &[n]].concat();
            assert!(pictures.decode(&other, "another", &node, None).expect("a picture").width <= 32);
        }
        assert!(pictures.0.lock().expect("alone").room < 100);
    }
}
