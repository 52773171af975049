//! What surfaces and fog do to light, in double precision: Fresnel, GGX with energy compensation, and the Henyey-Greenstein phase function.
//!
//! [`crate::reference`] computes with these functions; the GPU mirrors them in WGSL and takes the [`energy`] tables as they are.
//!
//! Local frames have `+z` along the surface normal, on the side of `wo`. `wo` is the direction a particle came from and `wi` the one it goes
//! on to, both pointing away from the surface. Densities called `eval_*` are those of scattered particles (flux) per unit solid angle of
//! `wi`, the cosine of `wi` included; the radiance that a camera path carries through a refraction takes a further `(n_i / n_t)^2`.

pub mod coat;
pub mod conductor;
pub mod dielectric;
pub mod energy;
pub mod facet;
pub mod fresnel;
pub mod ggx;
pub mod pane;
pub mod phase;
pub mod sheen;
pub mod thin_film;

use glam::{DVec3, dvec3};
use std::f64::consts::PI;

/// A direction about `+z` with density `cos / pi`, from two uniform numbers in [0, 1).
pub fn sample_cosine(u: [f64; 2]) -> DVec3 {
    let (r, phi) = (u[0].sqrt(), 2.0 * PI * u[1]);
    dvec3(r * phi.cos(), r * phi.sin(), (1.0 - u[0]).sqrt())
}
