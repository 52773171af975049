//! A test for each thing that a scene can contain; the scenes are those of [`super::feature_scenes`].

use super::compare::{gpu_agrees_after_binning, gpu_agrees_with_reference};
use super::feature_scenes::*;
use super::textures;
use crate::adapter;
use crate::scenes::*;
use abbe::render::Integrator;
use abbe::scene::*;
use glam::{DVec3, dvec3};

macro_rules! agree {
    ($($(#[$soak:meta])? $name:ident, $spp:expr, $coarseness:expr, $scene:expr;)*) => {
        $(#[test]
        $(#[$soak])?
        fn $name() {
            gpu_agrees_with_reference(stringify!($name), &$scene, $spp, $coarseness);
        })*

        /// Every scene here, by name.
        pub fn all() -> Vec<(&'static str, fn() -> Scene)> {
            vec![$((stringify!($name), || $scene)),*]
        }
    };
}

// Name, samples per pixel in each batch, coarseness of the errors that count, scene.
agree! {
    #[ignore = "long: in tools/soak"] smooth_glass, 80, 1.0, bins(4);
    #[ignore = "long: in tools/soak"] rough_glass_little, 24, 1.0, rough_glass(0.1);
    rough_glass_much, 32, 1.0, rough_glass(0.3);
    #[ignore = "long: in tools/soak"] floor_seen_through_glass, 256, 3.0, floor_under_glass();
    mixture_seen_through_glass, 24, 7.0, mixture_under_glass();
    #[ignore = "long: in tools/soak"] smooth_metal, 16, 1.0, metal(0.0);
    rough_metal, 16, 1.0, metal(0.3);
    #[ignore = "long: in tools/soak"] metal_of_a_colour_alone, 16, 1.0, metal_of_a_colour(0.3);
    metals_in_water, 72, 1.0, metal_in_water();
    #[ignore = "long: in tools/soak"] thin_panes, 16, 1.0, pane();
    panes_and_balls_that_tint_and_blur, 40, 1.0, tinted_panes();
    diffuse_transmission, 24, 1.0, translucent_sheets();
    #[ignore = "long: in tools/soak"] mixtures, 24, 1.0, mixture();
    thin_films, 40, 1.0, films();
    #[ignore = "long: in tools/soak"] a_film_on_plain_glass, 16, 1.0, film_on_plain_glass();
    brushed_metals, 24, 1.0, brushed();
    sheens_over_all_kinds, 24, 1.0, sheens();
    #[ignore = "long: in tools/soak"] cloth_seen_through_glass, 184, 4.0, cloth_under_glass();
    #[ignore = "long: in tools/soak"] coated_smoothly, 16, 1.0, coated_paint(0.0);
    #[ignore = "long: in tools/soak"] coated_roughly, 16, 1.0, coated_paint(0.2);
    metals_under_coats, 24, 1.0, coated_metals();
    light_on_a_coat, 40, 1.0, caustic_on_coat();
    #[ignore = "long: in tools/soak"] light_off_a_coat, 240, 2.3, caustic_off_coat();
    #[ignore = "long: in tools/soak"] composites_touching_glass, 336, 1.0, composites_on_glass();
    #[ignore = "long: in tools/soak"] dirty_glass_touching_glass, 96, 1.0, dirty_glass_on_glass();
    #[ignore = "long: in tools/soak"] nested_glasses, 80, 1.0, nested();
    #[ignore = "long: in tools/soak"] matched_glasses, 104, 1.0, matched();
    #[ignore = "long: in tools/soak"] absorbing_glass, 16, 1.0, absorbing();
    #[ignore = "long: in tools/soak"] hazes, 96, 1.0, haze();
    fog_all_around, 80, 1.0, fog_everywhere();
    #[ignore = "long: in tools/soak"] point_light, 208, 1.0, point();
    #[ignore = "long: in tools/soak"] spot_light, 32, 1.0, spot();
    #[ignore = "long: in tools/soak"] parallel_beam, 96, 1.0, beam();
    lamps_by_profiles, 24, 1.5, measured_lamps();
    sun_of_no_size, 24, 1.0, parallel_sun();
    skies, 56, 1.0, sky();
    #[ignore = "long: in tools/soak"] a_sky_of_spectra, 88, 1.0, measured_sky();
    lamps_of_all_shapes, 24, 1.0, lamps();
    #[ignore = "long: in tools/soak"] thin_lens_and_tent, 88, 1.0, lens();
    through_the_surfaces_of_a_lens, 128, 1.0, lens_of_surfaces();
    orthographic_and_gaussian, 128, 1.0, orthographic_view();
    #[ignore = "long: in tools/soak"] irradiance_on_a_plane, 96, 1.0, irradiance_plane();
    irradiance_on_a_sphere, 16, 1.0, irradiance_sphere();
    #[ignore = "long: in tools/soak"] camera_under_water, 80, 2.6, under_water();
    #[ignore = "long: in tools/soak"] smooth_normals_diffuse, 16, 1.0, smooth_normals(|_| 0);
    smooth_normals_of_glass, 96, 1.0, smooth_normals(|s| glass(s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0));
    #[ignore = "long: in tools/soak"] smooth_normals_of_rough_metal, 16, 1.0, smooth_normals(|s| {
        material(s, Material::Conductor { eta: flat(0.5), k: flat(3.0), alpha: 0.3 })
    });
    pictures_on_surfaces, 56, 1.0, textures::surfaces();
    a_picture_on_a_lamp, 96, 1.0, textures::lamps();
    maps_of_normals, 56, 1.0, textures::normals();
    normals_of_coats, 80, 1.0, textures::normals_of_coats(Estimator::Backward);
    #[ignore = "long: in tools/soak"] light_on_coats_that_point_elsewhere, 128, 3.0, textures::normals_of_coats(Estimator::Forward);
    roughness_that_varies, 20, 2.6, textures::roughness();
    one_bin, 64, 1.0, bins(1);
}

#[test]
fn thirty_three_bins_together_are_as_one() {
    gpu_agrees_after_binning("one_bin", &bins(33), 32);
}

#[test]
#[ignore = "long: in tools/soak"]
fn eighty_bins_taken_by_twenty_are_as_four() {
    gpu_agrees_after_binning("smooth_glass", &bins(80), 56);
}

/// Everything moved away from the middle, which a small ball on the other side keeps where it is: single precision is so much coarser there.
fn far_off(mut scene: Scene, by: DVec3) -> Scene {
    for shape in &mut scene.shapes {
        match &mut shape.geometry {
            Geometry::Sphere { center, .. } | Geometry::Disc { center, .. } => *center += by,
            other => panic!("{other:?} stays where it is"),
        }
    }
    let Sensor::Perspective { eye, .. } = &mut scene.sensor else { panic!("a sensor that stays where it is") };
    *eye += by;
    shape(&mut scene, 0, sphere(-by, 0.01));
    scene
}

/// Where spheres cross each other rays meet two surfaces within rounding. One that missed either would believe to be in that volume when it enters it anew:
/// of the four here, that is noticed.
#[test]
fn rays_keep_count_of_volumes_where_their_surfaces_cross() {
    let scene = far_off(nested(), DVec3::splat(30.0));
    let mut integrator = adapter::integrator(&scene, 5).expect("an adapter");
    let stats =
        integrator.render_batch(abbe::render::Batch::even(0, 640), &mut abbe::film::Film::new(&scene.film)).expect("a batch");
    assert!(stats.rays > 500_000, "{stats:?}");
    assert_eq!(stats.dropped(), 0, "{stats:?}");
}

/// A ball whose surface lies in that of another one is met again where the ray leaves both.
#[test]
fn a_ball_that_fills_another_is_all_there_is() {
    let scene = ball(4, |s| {
        let shell = glass(s, solid("shell", 1.33, 1), 0.0);
        shape(s, shell, sphere(dvec3(0.0, 0.65, 0.2), 0.55));
        glass(s, Interior { ior: flint(), ..solid("flint", 1.0, 2) }, 0.0)
    });
    gpu_agrees_with_reference("smooth_glass", &scene, 80, 1.0);
}
