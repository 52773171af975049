//! What rays meet first, in double precision.

use super::Stage;
use super::interiors::{Crossing, cross};
use super::rng::Rng;
use super::sensor::sample_view;
use crate::film::aov::{Albedo, AovBuffers, Sums};
use crate::geometry::world::{Hit, Ray};
use crate::scene::Material;
use crate::scene::inside::MAX_STRAIGHT;
use crate::spectrum::LINE_D_NM;
use rayon::prelude::*;

impl Stage {
    /// `samples` rays of every pixel; `albedos` are those of the scene's materials.
    pub(super) fn aovs(&self, albedos: &[Albedo], index: u32, samples: u32) -> AovBuffers {
        let pixel = |pixel: usize| -> Sums {
            let mut sums = [0.0; 8];
            for sample in 0..samples {
                let mut rng = Rng::new(self.seed, index, pixel as u64 * u64::from(samples) + u64::from(sample));
                let view = sample_view(&self.scene.sensor, &self.scene.film, pixel, LINE_D_NM, &mut rng);
                let Some(ray) = view.map(|view| view.ray) else { continue };
                let origin = ray.origin;
                let Some((hit, albedo)) = self.aov(ray, albedos, &mut rng) else { continue };
                let [n, [r, g, b]] = [hit.ns.to_array(), albedo.rgb];
                let met = [n[0], n[1], n[2], hit.p.distance(origin), r, g, b, 1.0];
                sums.iter_mut().zip(met).for_each(|(sum, v)| *sum += v);
            }
            sums.map(|v| v as f32)
        };
        AovBuffers::new(samples, self.kept_pixels().into_par_iter().map(pixel).collect())
    }

    /// The surface that a ray meets first, its normals on the side of the ray, and its albedo.
    fn aov(&self, mut ray: Ray, albedos: &[Albedo], rng: &mut Rng) -> Option<(Hit, Albedo)> {
        let mut inside = self.interiors_at(ray.origin);
        for _ in 0..=MAX_STRAIGHT {
            let hits = self.world.intersect(&ray);
            let met: Vec<(&Hit, usize)> =
                hits.iter().map(|h| (h, self.scene.bounding_part(self.scene.shapes[h.shape].material))).collect();
            let albedo = |hit: &Hit| albedos[self.scene.shapes[hit.shape].material];
            let seen = |hit: &Hit| Hit { ns: if ray.dir.dot(hit.ng) > 0.0 { -hit.ns } else { hit.ns }, ..*hit };
            // Of surfaces that coincide the boundaries of volumes come last. What is there of a mixture that is no glass is seen whatever the volumes.
            let is_mixed = |hit: &Hit| {
                let parts = self.scene.made_of(self.scene.shapes[hit.shape].material);
                parts.into_iter().any(|m| matches!(self.scene.materials[m], Material::Mix { .. }))
            };
            let others =
                met.iter().filter(|(hit, material)| self.scene.materials[*material].interior().is_none() || is_mixed(hit));
            if let Some((hit, _)) = others.into_iter().find(|(hit, _)| rng.next() < albedo(hit).presence) {
                return Some((seen(hit), albedo(hit)));
            }
            let (beyond, crossing) = cross(&self.scene, &inside, ray.dir, &met);
            if let Crossing::Interface { hit, .. } = crossing {
                return Some((seen(hit), albedo(hit)));
            }
            inside = beyond;
            ray = Ray { origin: hits.first()?.p, dir: ray.dir, t_min: 0.0, on: hits.iter().map(|h| h.prim).collect() };
        }
        None
    }
}
