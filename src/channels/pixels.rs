//! The pixels of one layer of an EXR: blocks are unpacked by all threads, each straight into the rows of the image, so that no second copy is held.

use exr::block::UncompressedBlock;
use exr::block::reader::Reader;
use exr::error::Result;
use exr::meta::attribute::SampleType;
use exr::prelude::{Vec2, f16};
use rayon::prelude::*;
use std::io::{Read, Seek};
use std::sync::{Mutex, PoisonError};

/// Pixels of a layer.
pub(crate) struct Pixels {
    /// Values `[pixel][selected channel]`, rows from the top.
    pub interleaved: Vec<f32>,
    /// Every other channel by itself, in the order asked for.
    pub planes: Vec<Vec<f32>>,
}

/// A row of the image, which whoever unpacks a line of it fills.
struct Row<'a> {
    interleaved: &'a mut [f32],
    planes: Vec<&'a mut [f32]>,
}

/// Hands every line of layer `layer` at full resolution to `visit`: channel, column of the first value, row, and the values. Lines come in any order and
/// from several threads, each part of a row of a channel once.
///
/// # Errors
/// Those of the file: damaged, cut short, or of a compression that is not supported.
pub(crate) fn read_lines<R: Read + Seek + Send>(
    reader: Reader<R>,
    layer: usize,
    visit: impl Fn(usize, usize, usize, &[f32]) + Sync,
) -> Result<()> {
    let meta = reader.meta_data().clone();
    let header = &meta.headers[layer];
    let chunks = reader.filter_chunks(false, |_, _, block| block.layer == layer && block.level == Vec2(0, 0))?;
    chunks.par_bridge().try_for_each_init(Vec::new, |values: &mut Vec<f32>, chunk| {
        let block = UncompressedBlock::decompress_chunk(chunk?, &meta, false)?;
        for line in block.lines(&header.channels) {
            let (Vec2(x, y), channel) = (line.location.position, line.location.channel);
            unpack(line.value, header.channels.list[channel].sample_type, values);
            visit(channel, x, y, values);
        }
        Ok(())
    })
}

/// Reads layer `layer`: the channels `selected`, each with a factor, side by side for every pixel, and the channels `others` one by one.
///
/// # Errors
/// As [`read_lines`].
pub(crate) fn read_pixels<R: Read + Seek + Send>(
    reader: Reader<R>,
    layer: usize,
    selected: &[(usize, f64)],
    others: &[usize],
) -> Result<Pixels> {
    let size = reader.headers()[layer].layer_size;
    let (width, height) = (size.width(), size.height());
    let mut interleaved = vec![0.0; width * height * selected.len()];
    let mut planes = vec![vec![0.0; width * height]; others.len()];
    let mut plane_rows: Vec<_> = planes.iter_mut().map(|plane| plane.chunks_exact_mut(width)).collect();
    let rows = interleaved.chunks_exact_mut(width * selected.len());
    let rows: Vec<Mutex<Row>> = rows
        .map(|interleaved| Mutex::new(Row { interleaved, planes: plane_rows.iter_mut().filter_map(Iterator::next).collect() }))
        .collect();
    read_lines(reader, layer, |channel, x, y, values| {
        // Tiles beside each other share rows.
        let mut row = rows[y].lock().unwrap_or_else(PoisonError::into_inner);
        for (at, &(_, scale)) in selected.iter().enumerate().filter(|(_, (c, _))| *c == channel) {
            let places = row.interleaved[x * selected.len() + at..].iter_mut().step_by(selected.len());
            if scale == 1.0 {
                places.zip(values).for_each(|(place, &v)| *place = v);
            } else {
                places.zip(values).for_each(|(place, &v)| *place = (f64::from(v) * scale) as f32);
            }
        }
        if let Some(at) = others.iter().position(|c| *c == channel) {
            row.planes[at][x..x + values.len()].copy_from_slice(values);
        }
    })?;
    drop(rows);
    Ok(Pixels { interleaved, planes })
}

/// Samples of a line, whatever their type.
fn unpack(bytes: &[u8], kind: SampleType, values: &mut Vec<f32>) {
    values.clear();
    match kind {
        SampleType::F32 => values.extend(bytes.as_chunks().0.iter().map(|b| f32::from_ne_bytes(*b))),
        SampleType::F16 => values.extend(bytes.as_chunks().0.iter().map(|b| f16::from_ne_bytes(*b).to_f32())),
        SampleType::U32 => values.extend(bytes.as_chunks().0.iter().map(|b| u32::from_ne_bytes(*b) as f32)),
    }
}
