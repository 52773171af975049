//! Pictures as their files have them, made into texels of numbers, vectors or spectra.

use super::space::ColorSpace;
use crate::color::upsample;
use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::json::spectra::Place;
use crate::scene::texture::texels::{Image, Packed, Texels, pack_sigmoid};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

pub(in crate::scene) use super::texels::Spectra;

/// What becomes of a colour in linear sRGB.
pub(in crate::scene) type Shade<'a> = &'a (dyn Fn([f64; 3]) -> [f64; 3] + Sync);

/// A colour times these factors.
pub(in crate::scene) fn times(factors: [f64; 3]) -> impl Fn([f64; 3]) -> [f64; 3] + Sync {
    move |rgb| std::array::from_fn(|i| rgb[i] * factors[i])
}

/// What the numbers of a picture's colours are taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::scene) enum Encoding {
    /// What the file says, or else sRGB for whole numbers, and linear sRGB for others.
    Own,
    /// The latter, whatever the file says.
    Srgb,
    /// Linear, whatever the file says.
    Linear,
}

/// A picture's numbers, pixel by pixel, rows from the top.
pub(in crate::scene) enum Samples {
    /// 0 to 255 for 0 to 1.
    Bytes(Vec<u8>),
    /// 0 to 65535 for 0 to 1.
    Words(Vec<u16>),
    /// As they are.
    Floats(Vec<f32>),
    /// No colours but spectra.
    Spectra(Arc<Spectra>),
}

/// A picture as its file has it: straight alpha, rows from the top.
pub(in crate::scene) struct Picture {
    pub width: u32,
    pub height: u32,
    /// Numbers of a pixel: grey, grey and alpha, RGB, or RGB and alpha.
    channels: usize,
    samples: Samples,
    space: Option<ColorSpace>,
    /// What is to be said of it.
    pub notes: Vec<String>,
    planes: Mutex<HashMap<usize, Arc<Packed>>>,
    vectors: OnceLock<Arc<Packed>>,
    colors: OnceLock<(Arc<Packed>, Vec<[f64; 3]>)>,
}

impl std::fmt::Debug for Picture {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Picture {} x {} x {}", self.width, self.height, self.channels)
    }
}

impl Picture {
    pub(super) fn new(
        width: u32,
        height: u32,
        channels: usize,
        samples: Samples,
        space: Option<ColorSpace>,
        notes: Vec<String>,
    ) -> Self {
        let (planes, vectors, colors) = Default::default();
        Picture { width, height, channels, samples, space, notes, planes, vectors, colors }
    }

    /// Refuses what is not finite.
    pub(super) fn check(&self, name: &str, node: &Node) -> Result<()> {
        let (values, stride) = match &self.samples {
            Samples::Floats(values) => (values.as_slice(), self.channels),
            Samples::Spectra(spectra) => (spectra.values(), spectra.channels()),
            _ => return Ok(()),
        };
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(i) => {
                let (x, y) = (i / stride % self.width as usize, i / stride / self.width as usize);
                Err(node.fail(format!("{name}: the texel at {x}, {y} is not finite"), "repair the picture"))
            }
        }
    }

    fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Bytes that it is likely to take as texels.
    pub(super) fn bytes(&self) -> u64 {
        let of_pixel = match &self.samples {
            Samples::Bytes(_) if self.channels < 3 => self.channels,
            Samples::Bytes(_) => 4,
            Samples::Words(_) if self.channels < 3 => 2 * self.channels,
            Samples::Words(_) | Samples::Floats(_) => 8,
            Samples::Spectra(spectra) => 16 * spectra.stride(),
        };
        self.pixels() as u64 * of_pixel as u64
    }

    /// The same with half as many columns and rows, the mean of two by two pixels each.
    pub(super) fn halved(self) -> Picture {
        let size = [self.width, self.height].map(|n| n as usize);
        let half = size.map(|n| n.div_ceil(2));
        fn mean<T: Copy + Send + Sync>(
            values: &[T],
            n: usize,
            size: [usize; 2],
            half: [usize; 2],
            of: fn([T; 4]) -> T,
        ) -> Vec<T> {
            let at = |x: usize, y: usize, c: usize| values[(y.min(size[1] - 1) * size[0] + x.min(size[0] - 1)) * n + c];
            let texel = |i: usize| {
                let (x, y, c) = (i / n % half[0], i / n / half[0], i % n);
                of([(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| at(2 * x + dx, 2 * y + dy, c)))
            };
            (0..half[0] * half[1] * n).into_par_iter().map(texel).collect()
        }
        let (n, floats) = (self.channels, |v: [f32; 4]| v.iter().sum::<f32>() / 4.0);
        let samples = match &self.samples {
            Samples::Bytes(v) => {
                Samples::Bytes(mean(v, n, size, half, |v| ((v.map(u32::from).iter().sum::<u32>() + 2) / 4) as u8))
            }
            Samples::Words(v) => {
                Samples::Words(mean(v, n, size, half, |v| ((v.map(u32::from).iter().sum::<u32>() + 2) / 4) as u16))
            }
            Samples::Floats(v) => Samples::Floats(mean(v, n, size, half, floats)),
            Samples::Spectra(s) => {
                let values = mean(s.values(), s.channels(), size, half, floats);
                Samples::Spectra(Arc::new(Spectra::new(s.edges_nm().to_vec(), values)))
            }
        };
        Picture::new(half[0] as u32, half[1] as u32, n, samples, self.space, self.notes)
    }

    /// The spectra, if it has no colours.
    pub(in crate::scene) fn spectra(&self) -> Option<&Arc<Spectra>> {
        if let Samples::Spectra(spectra) = &self.samples { Some(spectra) } else { None }
    }

    /// A number of a pixel as the file has it, whole numbers as shares: 0 red to 3 alpha.
    pub(in crate::scene) fn number(&self, pixel: usize, channel: usize) -> f64 {
        let has_alpha = self.channels.is_multiple_of(2);
        let at = match channel {
            3 if has_alpha => self.channels - 1,
            3 => return 1.0,
            _ if self.channels < 3 => 0,
            channel => channel,
        };
        let at = pixel * self.channels + at;
        match &self.samples {
            Samples::Bytes(v) => f64::from(v[at]) / 255.0,
            Samples::Words(v) => f64::from(v[at]) / 65535.0,
            Samples::Floats(v) => f64::from(v[at]),
            // Nobody asks for numbers of spectra.
            Samples::Spectra(_) => 0.0,
        }
    }

    pub(super) fn rgb(&self, pixel: usize) -> [f64; 3] {
        [0, 1, 2].map(|channel| self.number(pixel, channel))
    }

    /// The colour of a pixel that may cover it in part. Of files only EXRs have colours that are less for that; light is what they say.
    fn straight(&self, pixel: usize) -> [f64; 3] {
        let alpha = self.number(pixel, 3);
        let is_less = matches!(self.samples, Samples::Floats(_)) && alpha > 0.0 && alpha < 1.0;
        if is_less { self.rgb(pixel).map(|v| v / alpha) } else { self.rgb(pixel) }
    }

    /// Linear sRGB of a pixel.
    pub(in crate::scene) fn linear_at(&self, pixel: usize, encoding: Encoding) -> [f64; 3] {
        self.linear(self.rgb(pixel), encoding)
    }

    /// Linear sRGB of a colour as the file has it.
    fn linear(&self, rgb: [f64; 3], encoding: Encoding) -> [f64; 3] {
        match (&self.space, &self.samples, encoding) {
            (_, _, Encoding::Linear) | (None, Samples::Floats(_), _) | (_, Samples::Floats(_), Encoding::Srgb) => rgb,
            (Some(space), _, Encoding::Own) => space.linear_srgb(rgb),
            _ => rgb.map(upsample::srgb_decode),
        }
    }

    /// The picture of a channel (0 red to 3 alpha), each number within 0 to 1 times `scale`, the same at every wavelength.
    pub(in crate::scene) fn numbers(&self, channel: usize, scale: f64) -> Image {
        let mut planes = self.planes.lock().unwrap_or_else(PoisonError::into_inner);
        // Grey has one plane for all three.
        let plane = if self.channels < 3 && channel < 3 { 0 } else { channel };
        let stored = planes.entry(plane).or_insert_with(|| {
            let numbers = (0..self.pixels()).into_par_iter().map(|i| self.number(i, channel));
            Arc::new(match &self.samples {
                Samples::Bytes(_) => Packed::new(1, numbers.map(|v| (v * 255.0).round() as u8).collect()),
                _ => Packed::new(
                    2,
                    numbers.flat_map_iter(|v| ((v.clamp(0.0, 1.0) * 65535.0).round() as u16).to_le_bytes()).collect(),
                ),
            })
        });
        Image { width: self.width, height: self.height, texels: Texels::Numbers { stored: stored.clone(), scale } }
    }

    /// The picture of the normals in tangent space that its colours stand for, x and y times `strength`.
    pub(in crate::scene) fn normals(&self, strength: f64) -> Image {
        let stored = self.vectors.get_or_init(|| {
            let pixels = (0..self.pixels()).into_par_iter();
            let word = |v: f64| (v.clamp(0.0, 1.0) * 65535.0).round() as u16;
            Arc::new(match &self.samples {
                Samples::Bytes(_) => Packed::new(
                    4,
                    pixels.flat_map_iter(|i| [0, 1, 2, 3].map(|c| (self.vector_number(i, c) * 255.0).round() as u8)).collect(),
                ),
                _ => Packed::new(
                    8,
                    pixels
                        .flat_map_iter(|i| {
                            [0, 1, 2, 3].into_iter().flat_map(move |c| word(self.vector_number(i, c)).to_le_bytes())
                        })
                        .collect(),
                ),
            })
        });
        Image { width: self.width, height: self.height, texels: Texels::Vectors { stored: stored.clone(), scale: strength } }
    }

    /// As [`Picture::number`], 0 for a fourth.
    fn vector_number(&self, pixel: usize, channel: usize) -> f64 {
        if channel < 3 { self.number(pixel, channel) } else { 0.0 }
    }

    /// The picture of its colours as `shade` changes them, as spectra. `None` where one is too bright for single precision, or as a share below 0 or beyond 1.
    pub(in crate::scene) fn colors(&self, place: Place, encoding: Encoding, shade: Shade) -> Option<Image> {
        let texels = match &self.samples {
            Samples::Bytes(_) => {
                let (stored, colors) = self.colors.get_or_init(|| self.index_colors());
                let table: Option<Vec<_>> = colors.par_iter().map(|&rgb| self.texel(rgb, place, encoding, shade)).collect();
                Texels::Colors { stored: stored.clone(), table: table?.into() }
            }
            _ => {
                let texels: Option<Vec<_>> = self.texels(place, encoding, shade).map(|t| t.map(pack_sigmoid)).collect();
                Texels::Sigmoids { stored: Arc::new(Packed::new(8, bytemuck::cast_slice(&texels?).to_vec())) }
            }
        };
        Some(Image { width: self.width, height: self.height, texels })
    }

    /// The picture of what `number`, from 0 to 1, says of each pixel, times `scale`.
    pub(in crate::scene) fn shares(&self, scale: f64, number: impl Fn(usize) -> f64 + Sync) -> Image {
        let byte = |i: usize| (number(i).clamp(0.0, 1.0) * 255.0).round() as u8;
        let stored = Arc::new(Packed::new(1, (0..self.pixels()).into_par_iter().map(byte).collect()));
        Image { width: self.width, height: self.height, texels: Texels::Numbers { stored, scale } }
    }

    /// Sigmoid coefficients and factor of every pixel, in full precision; as of [`Picture::colors`].
    pub(in crate::scene) fn coefficients(&self, factors: [f64; 3], place: Place, encoding: Encoding) -> Option<Vec<[f32; 4]>> {
        let shade: Shade = &times(factors);
        if let Samples::Bytes(_) = &self.samples {
            let Texels::Colors { stored, table } = self.colors(place, encoding, shade)?.texels else { return None };
            return Some((0..self.pixels()).map(|i| table[stored.index(i)]).collect());
        }
        self.texels(place, encoding, shade).collect()
    }

    fn texels(&self, place: Place, encoding: Encoding, shade: Shade) -> impl ParallelIterator<Item = Option<[f32; 4]>> {
        let rgb = move |i| if place == Place::Light { self.rgb(i) } else { self.straight(i) };
        (0..self.pixels()).into_par_iter().map(move |i| self.texel(rgb(i), place, encoding, shade))
    }

    fn texel(&self, rgb: [f64; 3], place: Place, encoding: Encoding, shade: Shade) -> Option<[f32; 4]> {
        if place != Place::Light && rgb.iter().any(|v| !(0.0..=1.0).contains(v)) {
            return None;
        }
        let linear = shade(self.linear(rgb, encoding));
        let (c, scale) =
            if place == Place::Light { upsample::emission_texel(linear) } else { upsample::reflectance_texel(linear) };
        let texel = [c[0] as f32, c[1] as f32, c[2] as f32, scale as f32];
        texel.iter().all(|v| v.is_finite()).then_some(texel)
    }

    /// Every pixel as the number of its colour, and the colours, each once, as the file has them.
    fn index_colors(&self) -> (Arc<Packed>, Vec<[f64; 3]>) {
        let Samples::Bytes(values) = &self.samples else { return (Arc::new(Packed::new(1, Vec::new())), Vec::new()) };
        let shares = |rgb: [u8; 3]| rgb.map(|v| f64::from(v) / 255.0);
        if self.channels < 3 {
            let greys = values.iter().step_by(self.channels).copied().collect();
            return (Arc::new(Packed::new(1, greys)), (0..=255).map(|v| shares([v; 3])).collect());
        }
        let mut colors: Vec<[u8; 3]> = Vec::new();
        // A place for every colour that there is, 0 for those not met yet: only the pages that are used take memory.
        let mut known = vec![0u32; 1 << 24];
        let number = |pixel: &[u8]| {
            let rgb = [pixel[0], pixel[1], pixel[2]];
            let place = &mut known[usize::from(rgb[0]) << 16 | usize::from(rgb[1]) << 8 | usize::from(rgb[2])];
            if *place == 0 {
                colors.push(rgb);
                *place = colors.len() as u32;
            }
            *place - 1
        };
        let numbers: Vec<u32> = values.chunks_exact(self.channels).map(number).collect();
        let stored = match colors.len() {
            0..=0x100 => Packed::new(1, numbers.iter().map(|n| *n as u8).collect()),
            0x101..=0x10000 => Packed::new(2, numbers.iter().flat_map(|n| (*n as u16).to_le_bytes()).collect()),
            _ => Packed::new(4, numbers.iter().flat_map(|n| n.to_le_bytes()).collect()),
        };
        (Arc::new(stored), colors.into_iter().map(shares).collect())
    }
}
