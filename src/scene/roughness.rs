//! Roughness, of one width or as a picture says. Light meets one of a few widths, of which it has tables: between the two next to what the picture says
//! chance decides in proportion, so that a surface is a mixture of them.

use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use crate::scene::{Material, Texture};
use std::ops::Range;

/// Steps of roughness from 0 to 1.
pub const STEPS: usize = 16;
/// GGX widths below this are smooth.
pub(super) const SMOOTH: f64 = 1e-3;

/// GGX width of a roughness, its square (Burley 2012); 0, smooth, below 0.001.
pub(super) fn width(roughness: f64) -> f64 {
    let width = roughness * roughness;
    if width < SMOOTH { 0.0 } else { width }
}

/// The level below `roughness` among the `levels` that there are, and the share of the next.
pub fn level_at(roughness: f64, levels: &Range<usize>) -> (usize, f64) {
    let x = (roughness * STEPS as f64).clamp(levels.start as f64, (levels.end - 1) as f64);
    let level = (x as usize).min(levels.end - 2);
    (level, x - level as f64)
}

/// A surface's roughness.
pub(super) enum Roughness {
    /// GGX width.
    Width(f64),
    /// Roughness in [0, 1] all over it, and the least and greatest of it.
    Picture(Texture, [f64; 2]),
}

impl Roughness {
    /// The roughness of a picture of numbers.
    pub(super) fn pictured(texture: Texture) -> Self {
        let Texture::Image(picture) = &texture else { return Roughness::Width(width(texture.average(550.0))) };
        let range = picture.image.range().map(|v| v * picture.factor.eval(550.0));
        if range[0] == range[1] { Roughness::Width(width(range[0])) } else { Roughness::Picture(texture, range) }
    }
}

impl Loader {
    /// `alpha` (a GGX width) or `roughness` (its root, a number or a picture) of a material; smooth without either.
    pub(super) fn roughness(&mut self, node: &Node) -> Result<Roughness> {
        let Some(rough) = node.get("roughness") else { return Ok(Roughness::Width(alpha(node)?)) };
        if let Some(surplus) = node.get("alpha") {
            return Err(surplus.fail("\"roughness\" already says how rough it is", "keep one of the two: alpha is its square"));
        }
        match self.number_texture(&rough)? {
            Some(picture) => Ok(Roughness::pictured(picture)),
            None => Ok(Roughness::Width(width(rough.within(0.0, 1.0)?))),
        }
    }

    /// The material that `make` makes of a GGX width, of this roughness.
    pub(super) fn rough(&mut self, roughness: &Roughness, make: impl Fn(f64) -> Material) -> Material {
        match roughness {
            Roughness::Width(alpha) => make(*alpha),
            Roughness::Picture(picture, [least, greatest]) => {
                let start = ((least * STEPS as f64) as usize).min(STEPS - 1);
                let end = ((greatest * STEPS as f64).ceil() as usize).clamp(start + 1, STEPS) + 1;
                let first = self.scene.materials.len();
                self.scene.materials.extend((start..end).map(|level| make(width(level as f64 / STEPS as f64))));
                let materials = (first..self.scene.materials.len()).collect();
                Material::Graded { materials, levels: start..end, roughness: picture.clone() }
            }
        }
    }
}

/// GGX width: 0 (smooth) or in [0.001, 1].
fn alpha(node: &Node) -> Result<f64> {
    let Some(node) = node.get("alpha") else { return Ok(0.0) };
    let alpha = node.number()?;
    if alpha == 0.0 || (SMOOTH..=1.0).contains(&alpha) {
        return Ok(alpha);
    }
    Err(node.fail(format!("a roughness of {alpha}"), "use 0 for a smooth surface, or 0.001 to 1"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roughness_lies_between_two_levels_that_there_are() {
        assert_eq!(level_at(0.5, &(0..17)), (8, 0.0));
        assert_eq!(level_at(0.53125, &(8..10)), (8, 0.5));
        assert_eq!(level_at(1.0, &(0..17)), (15, 1.0));
        assert_eq!(level_at(0.2, &(8..10)), (8, 0.0));
    }
}
