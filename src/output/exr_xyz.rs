//! The colours of a spectral image.

use super::{Quantity, SpectralImage};
use crate::color::bins::{emission_weights, reflection_weights, xyz_image};
use crate::color::cie::{is_visible, lacks_for_colour, xyz_of, xyz_of_unit};
use crate::develop::picture::Exposure;
use crate::spectrum::Spectrum;
use crate::spectrum::library::Observer;

/// XYZ of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Colours {
    /// XYZ of every pixel, cd m^-2; of a reflectance, what it reflects of a light as bright as the equal-energy spectrum of 1 W m^-2 sr^-1 nm^-1.
    pub xyz: Vec<[f32; 3]>,
    /// What a user should know about them.
    pub note: Option<String>,
}

impl SpectralImage {
    /// The exposure that goes with it, in stops: that of Abbe's own picture, or for a reflectance 0.
    pub fn own_exposure(&self) -> Option<f64> {
        if self.quantity == Quantity::Reflective {
            return Some(0.0);
        }
        self.attribute("abbe.version")?;
        self.attribute("EV")?.parse().ok().filter(|v: &f64| v.abs() <= Exposure::MOST_STOPS)
    }

    /// XYZ of every pixel as `observer` sees it: where the file holds those of Abbe's film for this observer, these; else from the bins, through
    /// the smoothest spectrum that has their means. A reflectance is lit by `light`.
    ///
    /// # Errors
    /// Says that the file has no visible wavelength.
    pub fn xyz(&self, observer: Observer, light: &Spectrum) -> Result<Colours, String> {
        let edges = self.edges_nm();
        let (lo, hi) = (edges[0], edges[edges.len() - 1]);
        let lack = lacks_for_colour(lo, hi);
        if let (false, Some(lack)) = (is_visible(lo, hi), &lack) {
            return Err(lack.clone());
        }
        let film = ["XYZ.X", "XYZ.Y", "XYZ.Z"].map(|name| self.other(name));
        let xyz = match (self.quantity, film) {
            (Quantity::Emissive, [Some(x), Some(y), Some(z)]) if observer == Observer::Cie1931 => {
                x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]).collect()
            }
            (Quantity::Emissive, _) => xyz_image(&self.data, &emission_weights(edges, observer)),
            (Quantity::Reflective, _) => {
                let light = light.clone().scaled(xyz_of_unit(observer)[1] / xyz_of(light, observer)[1]);
                xyz_image(&self.data, &reflection_weights(edges, observer, &light))
            }
        };
        let beyond = match self.quantity {
            Quantity::Emissive => "light outside counts as 0",
            Quantity::Reflective => "outside, the end values are held",
        };
        Ok(Colours { xyz, note: lack.map(|lack| format!("{lack}; {beyond}")) })
    }
}
