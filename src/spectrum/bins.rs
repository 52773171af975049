//! Wavelength bins.

/// `count` equal wavelength bins over `[min_nm, max_nm]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bins {
    /// Lower end, nm.
    pub min_nm: f64,
    /// Upper end, nm.
    pub max_nm: f64,
    /// Number of bins, 1 to 400.
    pub count: u32,
}

impl Bins {
    /// Width of one bin, nm.
    pub fn width_nm(&self) -> f64 {
        (self.max_nm - self.min_nm) / f64::from(self.count)
    }

    /// Lower edge of bin `i` (`i = count` gives the upper end of the range), nm.
    pub fn edge_nm(&self, i: u32) -> f64 {
        self.min_nm + (self.max_nm - self.min_nm) * f64::from(i) / f64::from(self.count)
    }

    /// Centre of bin `i`, nm.
    pub fn centre_nm(&self, i: u32) -> f64 {
        self.min_nm + (self.max_nm - self.min_nm) * (f64::from(i) + 0.5) / f64::from(self.count)
    }

    /// `nm`, or the end of the range that is nearest to it.
    pub fn nearest_nm(&self, nm: f64) -> f64 {
        nm.clamp(self.min_nm, self.max_nm)
    }

    /// The bin that holds `nm`, clamped to the range.
    pub fn index_of(&self, nm: f64) -> u32 {
        let x = (nm - self.min_nm) / (self.max_nm - self.min_nm) * f64::from(self.count);
        (x.max(0.0) as u32).min(self.count - 1)
    }
}
