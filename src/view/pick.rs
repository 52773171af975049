//! What lies under a pixel.

use crate::geometry::world::World;
use crate::scene::{Scene, Sensor};
use glam::DVec3;

/// The geometry of a scene, ready to be clicked at.
pub struct Picker {
    world: World,
    /// Width over height of the picture.
    aspect: f64,
}

/// A surface that was met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// Index of its shape.
    pub shape: usize,
    /// Where, m.
    pub at: DVec3,
    /// Along the ray, m.
    pub distance: f64,
}

impl Picker {
    /// Takes the time that a hierarchy over the scene does.
    pub fn new(scene: &Scene) -> Self {
        let aspect = f64::from(scene.film.width) / f64::from(scene.film.height);
        let world = World::new(scene.flattened().shapes.iter().map(|s| &s.geometry));
        Picker { world, aspect }
    }

    /// The first surface along the ray through the middle of the lens and a place of the picture, from 0 to 1 across and down. What is no surface counts,
    /// too: it bounds fog. `None` beside everything, and for what is no camera.
    pub fn pick(&self, sensor: &Sensor, place: [f64; 2]) -> Option<Met> {
        let ray = sensor.ray(self.aspect, place)?;
        self.world.intersect(&ray).first().map(|hit| Met { shape: hit.shape, at: hit.p, distance: hit.t })
    }
}
