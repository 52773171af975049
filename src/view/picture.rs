//! What is looked at: a film as far as it is, or a spectral file. What pages ask of either is answered here.

use crate::color::bins::{emission_weights, reflection_weights, xyz_image};
use crate::color::cie::{xyz_of, xyz_of_unit};
use crate::color::upsample::white;
use crate::film::aov::AovBuffers;
use crate::film::{Earlier, Film};
use crate::output::exr::error_channel_name;
use crate::output::{Provenance, Quantity, SpectralImage};
use crate::spectrum::library::Observer;
use std::sync::{Arc, OnceLock};

/// Where the pixels come from.
#[derive(Debug, Clone)]
pub enum Content {
    /// A render.
    Film(Box<Film>),
    /// A file.
    File(Box<SpectralImage>),
}

/// A picture at one time.
#[derive(Debug, Clone)]
pub struct Picture {
    /// What it is called.
    pub name: String,
    /// What is in it.
    pub content: Content,
    /// A quick look at what is on its way.
    pub is_preview: bool,
    /// Number of the render that it is of, or is to be followed by.
    pub render: u64,
    /// What is seen first, where it is known.
    pub aovs: Option<Arc<AovBuffers>>,
    /// What the film was with fewer samples, for the denoiser.
    pub earlier: Option<Arc<Earlier>>,
    /// X, Y, Z without noise, once somebody has wanted them.
    pub denoised: OnceLock<Vec<[f32; 3]>>,
    /// How a film was made.
    pub provenance: Provenance,
}

/// A rectangle of pixels, inside its picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First column and row.
    pub at: [usize; 2],
    /// Columns and rows, one at least.
    pub size: [usize; 2],
}

/// The mean spectrum of a region.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectral {
    /// Means of the bins, in the picture's unit.
    pub values: Vec<f64>,
    /// Their standard errors, where they are known; pixels are taken as independent.
    pub errors: Option<Vec<f64>>,
    /// CIE 1931 XYZ.
    pub xyz: [f64; 3],
}

impl Picture {
    /// Of a file.
    pub fn of_file(name: String, image: SpectralImage) -> Self {
        Picture::new(name, Content::File(Box::new(image)))
    }

    /// Of which no more is known.
    pub fn new(name: String, content: Content) -> Self {
        let (denoised, provenance) = (OnceLock::new(), Provenance::default());
        Picture { name, content, is_preview: false, render: 0, aovs: None, earlier: None, denoised, provenance }
    }

    /// The exposure that goes with it, in stops: that of its scene, or of its file.
    pub fn exposure(&self) -> Option<f64> {
        match &self.content {
            Content::Film(_) => self.provenance.exposure,
            Content::File(image) => image.own_exposure(),
        }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [usize; 2] {
        match &self.content {
            Content::Film(film) => [film.settings().width as usize, film.settings().height as usize],
            Content::File(image) => [image.width, image.height],
        }
    }

    /// Where the bins join, nm.
    pub fn edges_nm(&self) -> Vec<f64> {
        match &self.content {
            Content::Film(film) => {
                let bins = film.settings().bins;
                (0..=bins.count).map(|i| bins.edge_nm(i)).collect()
            }
            Content::File(image) => image.edges_nm().to_vec(),
        }
    }

    /// Centres of the bins, nm.
    pub fn centres_nm(&self) -> Vec<f64> {
        match &self.content {
            Content::Film(_) => self.edges_nm().windows(2).map(|w| 0.5 * (w[0] + w[1])).collect(),
            Content::File(image) => image.wavelengths_nm.clone(),
        }
    }

    /// Name and unit of what the bins hold, and the unit of its luminance.
    pub fn quantity(&self) -> [&'static str; 3] {
        let is_irradiance = match &self.content {
            Content::Film(_) => self.provenance.irradiance,
            Content::File(image) if image.quantity == Quantity::Reflective => return ["reflectance", "1", "cd m^-2"],
            Content::File(image) => image.attribute("abbe.quantity").is_some_and(|q| q.starts_with("irradiance")),
        };
        if is_irradiance { ["irradiance", "W m^-2 nm^-1", "lx"] } else { ["radiance", "W m^-2 sr^-1 nm^-1", "cd m^-2"] }
    }

    /// Values of bin `b`, pixel by pixel.
    pub fn bin(&self, b: usize) -> Vec<f32> {
        match &self.content {
            Content::Film(film) => (0..film.pixels()).map(|p| film.bin(p, b) as f32).collect(),
            Content::File(image) => image.data.iter().skip(b).step_by(image.bins()).copied().collect(),
        }
    }

    /// XYZ of every pixel, as `develop` has it.
    ///
    /// # Errors
    /// Says that there is no visible wavelength.
    pub fn xyz(&self, observer: Observer) -> Result<Vec<[f32; 3]>, String> {
        match &self.content {
            Content::Film(film) if observer == Observer::Cie1931 => Ok(film.xyz_image()),
            Content::Film(film) => {
                let bins = |pixel: usize| film.pixel(pixel)[..film.bins()].iter().map(|&v| v as f32);
                let data: Vec<f32> = (0..film.pixels()).flat_map(bins).collect();
                Ok(xyz_image(&data, &emission_weights(&self.edges_nm(), observer)))
            }
            Content::File(image) => image.xyz(observer, &white()).map(|colours| colours.xyz),
        }
    }

    /// The mean over a region.
    pub fn spectrum(&self, region: Region) -> Spectral {
        let width = self.size()[0];
        let row = |y: usize| (0..region.size[0]).map(move |x| y * width + region.at[0] + x);
        let pixels: Vec<usize> = (region.at[1]..region.at[1] + region.size[1]).flat_map(row).collect();
        let n = pixels.len() as f64;
        let mean = |value: &dyn Fn(usize) -> f64| pixels.iter().map(|&p| value(p)).sum::<f64>() / n;
        // Of the mean of pixels with these errors.
        let error = |of: &dyn Fn(usize) -> f64| (mean(&|p| of(p).powi(2)) / n).sqrt();
        match &self.content {
            Content::Film(film) => {
                let bins = 0..film.bins();
                let errors = (film.batches() > 1).then(|| bins.clone().map(|b| error(&|p| film.standard_error(p, b))).collect());
                let xyz = std::array::from_fn(|i| mean(&|p| film.xyz(p)[i]));
                Spectral { values: bins.map(|b| mean(&|p| film.bin(p, b))).collect(), errors, xyz }
            }
            Content::File(image) => {
                let values: Vec<f64> = (0..image.bins()).map(|b| mean(&|p| f64::from(image.pixel(p)[b]))).collect();
                let planes: Option<Vec<&[f32]>> =
                    image.wavelengths_nm.iter().map(|nm| image.other(&error_channel_name(*nm))).collect();
                let errors = planes.map(|planes| planes.iter().map(|plane| error(&|p| f64::from(plane[p]))).collect());
                let own = ["XYZ.X", "XYZ.Y", "XYZ.Z"].map(|name| image.other(name));
                let xyz = match own {
                    [Some(_), Some(_), Some(_)] if image.quantity == Quantity::Emissive => {
                        own.map(|plane| mean(&|p| plane.map_or(0.0, |plane| f64::from(plane[p]))))
                    }
                    _ => {
                        let weights = self.weights(image.quantity);
                        std::array::from_fn(|i| values.iter().zip(&weights).map(|(v, w)| v * w[i]).sum())
                    }
                };
                Spectral { values, errors, xyz }
            }
        }
    }

    fn weights(&self, quantity: Quantity) -> Vec<[f64; 3]> {
        let (edges, observer) = (self.edges_nm(), Observer::Cie1931);
        match quantity {
            Quantity::Emissive => emission_weights(&edges, observer),
            Quantity::Reflective => {
                let light = white();
                let light = light.clone().scaled(xyz_of_unit(observer)[1] / xyz_of(&light, observer)[1]);
                reflection_weights(&edges, observer, &light)
            }
        }
    }

    /// Standard error of luminance over luminance, of every pixel, where it is known.
    pub fn relative_errors(&self) -> Option<Vec<f32>> {
        match &self.content {
            Content::Film(film) if film.batches() > 1 => {
                let errors = film.errors(film.bins() + 1);
                let relative = |pixel: usize| {
                    let (value, variance) = errors.expected(pixel);
                    (variance.sqrt() / value.max(f64::MIN_POSITIVE)) as f32
                };
                Some((0..film.pixels()).map(relative).collect())
            }
            Content::Film(_) => None,
            Content::File(image) => {
                let (errors, values) = (image.other("error.Y")?, image.other("XYZ.Y")?);
                Some(errors.iter().zip(values).map(|(e, v)| e / v.max(f32::MIN_POSITIVE)).collect())
            }
        }
    }

    /// Samples of every pixel, of a film.
    pub fn samples(&self) -> Option<Vec<f32>> {
        let Content::Film(film) = &self.content else { return None };
        Some((0..film.pixels()).map(|pixel| film.samples(pixel) as f32).collect())
    }

    /// Distance of what is seen first, m, where it is known; 0 for nothing.
    pub fn depth(&self) -> Option<Vec<f32>> {
        let pixels = self.size()[0] * self.size()[1];
        match (&self.aovs, &self.content) {
            (Some(aovs), _) => Some((0..pixels).map(|p| aovs.depth(p)).collect()),
            (None, Content::File(image)) => image.other("depth.Z").map(<[f32]>::to_vec),
            (None, Content::Film(_)) => None,
        }
    }

    /// Normals (`normal`) or albedos of what is seen first, where they are known.
    pub fn vectors(&self, normal: bool) -> Option<Vec<[f32; 3]>> {
        let pixels = self.size()[0] * self.size()[1];
        match (&self.aovs, &self.content) {
            (Some(aovs), _) => Some((0..pixels).map(|p| if normal { aovs.normal(p) } else { aovs.albedo(p) }).collect()),
            (None, Content::File(image)) => {
                let names = if normal { ["normal.X", "normal.Y", "normal.Z"] } else { ["albedo.R", "albedo.G", "albedo.B"] };
                let [x, y, z] = names.map(|name| image.other(name));
                let (x, y, z) = (x?, y?, z?);
                Some((0..pixels).map(|p| [x[p], y[p], z[p]]).collect())
            }
            (None, Content::Film(_)) => None,
        }
    }
}
