//! What the rays of every pixel meet first: depth, normal and albedo, which denoisers and compositors ask for. Fog hides nothing, and what is no
//! surface (boundaries, volumes inside others that rule over them) is passed through.
//!
//! Likewise what they meet first behind smooth glass and in mirrors, which the denoiser asks for. One way stands for all: a ray goes through glass by its
//! index at the d line (or as near to that as the film's range comes) and straight through panes, is reflected where glass reflects totally and by mirrors of metal, also coated ones. So what is seen there
//! has no noise of its own, and where more is reflected than let through, at grazing angles, it is something else. Rough surfaces, paint under a coat (which
//! reflects little), mixtures and glass whose normals are a picture are where a ray ends, and so is the depth of paths.

use crate::color::convert::xyz_of_linear_srgb;
use crate::color::upsample::color_of_reflectance;
use crate::scene::Scene;

/// Sums over samples of one pixel: normal (world space, of length 1, on the side that is seen), distance along the ray in m, albedo, and the number
/// of samples that met a surface.
pub type Sums = [f32; 8];

/// First hits of all pixels, row by row from the upper left.
#[derive(Debug, Clone, PartialEq)]
pub struct AovBuffers {
    samples: u32,
    sums: Vec<Sums>,
    behind: Option<Box<AovBuffers>>,
    halves: Option<Box<[AovBuffers; 2]>>,
}

impl AovBuffers {
    /// From the sums over `samples` samples of every pixel.
    pub fn new(samples: u32, sums: Vec<Sums>) -> Self {
        Self { samples, sums, behind: None, halves: None }
    }

    /// The same, with what is met `behind` smooth glass and in mirrors, if there are any.
    pub fn with_behind(self, behind: Option<AovBuffers>) -> Self {
        Self { behind: behind.map(Box::new), ..self }
    }

    /// From two halves of the samples, whose differences say what is noise.
    pub fn of_halves(mut a: AovBuffers, mut b: AovBuffers) -> Self {
        let behind = a.behind.take().zip(b.behind.take()).map(|(a, b)| Box::new(Self::of_halves(*a, *b)));
        let sums = a.sums.iter().zip(&b.sums).map(|(a, b)| std::array::from_fn(|i| a[i] + b[i])).collect();
        Self { samples: a.samples + b.samples, sums, behind, halves: Some(Box::new([a, b])) }
    }

    /// What the same rays meet first that is neither smooth glass nor a mirror, depth being the length of their way; none where the scene has neither.
    pub fn behind(&self) -> Option<&AovBuffers> {
        self.behind.as_deref()
    }

    /// Half the difference of what `value` has of the halves; 0 where there are none.
    pub fn half_difference(&self, value: impl Fn(&AovBuffers) -> f32) -> f32 {
        self.halves.as_deref().map_or(0.0, |[a, b]| 0.5 * (value(a) - value(b)))
    }

    /// Samples of a pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// What the means are made of.
    pub fn sums(&self) -> &[Sums] {
        &self.sums
    }

    /// Mean distance over the samples of a pixel that met a surface, m; 0 where none did.
    pub fn depth(&self, pixel: usize) -> f32 {
        let [.., depth, _, _, _, met] = self.sums[pixel];
        if met > 0.0 { depth / met } else { 0.0 }
    }

    /// Mean normal of a pixel, shorter than 1 where normals differ; nothing counts as 0.
    pub fn normal(&self, pixel: usize) -> [f32; 3] {
        std::array::from_fn(|i| self.sums[pixel][i] / self.samples as f32)
    }

    /// Mean albedo of a pixel; nothing counts as 0.
    pub fn albedo(&self, pixel: usize) -> [f32; 3] {
        std::array::from_fn(|i| self.sums[pixel][4 + i] / self.samples as f32)
    }
}

/// What a material looks like without light and shade; pictures on it count with their mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Albedo {
    /// Colour of its reflectance, as [`color_of_reflectance`] has it: white is 1 for glass too, metals have their reflectance at normal incidence.
    pub rgb: [f64; 3],
    /// Share of rays that it stops: 0 for boundaries, which nobody sees, between 0 and 1 for mixtures with them.
    pub presence: f64,
}

/// Albedos of all materials of a scene.
pub fn albedos(scene: &Scene) -> Vec<Albedo> {
    let of = |material: usize| {
        let reflected = color_of_reflectance(|nm| scene.albedo(material, nm)[0]);
        // Its luminance counts where it depends on wavelength.
        let [_, presence, _] = xyz_of_linear_srgb(color_of_reflectance(|nm| scene.albedo(material, nm)[1]));
        let rgb = if presence > 0.0 { reflected.map(|v| v / presence) } else { [0.0; 3] };
        Albedo { rgb, presence }
    };
    (0..scene.materials.len()).map(of).collect()
}
