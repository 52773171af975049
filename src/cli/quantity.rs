//! What the pixels of a spectral EXR are, in words.

use crate::output::{self, SpectralImage};

/// Name and units.
pub struct Quantity {
    pub name: &'static str,
    pub unit: &'static str,
    /// Of its XYZ.
    pub photometric_unit: &'static str,
}

impl Quantity {
    pub fn of(image: &SpectralImage) -> Self {
        if image.quantity == output::Quantity::Reflective {
            let photometric_unit = "cd m^-2, lit by the equal-energy spectrum of 1 W m^-2 sr^-1 nm^-1";
            Quantity { name: "reflectance", unit: "1", photometric_unit }
        } else if image.attribute("abbe.quantity").is_some_and(|q| q.starts_with("irradiance")) {
            Quantity { name: "irradiance", unit: "W m^-2 nm^-1", photometric_unit: "lx" }
        } else {
            Quantity { name: "radiance", unit: "W m^-2 sr^-1 nm^-1", photometric_unit: "cd m^-2" }
        }
    }
}
