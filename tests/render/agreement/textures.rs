//! Scenes with pictures on surfaces: every way of wrapping and filtering, masks, blends, and lamps.

use crate::scenes::*;
use abbe::color::upsample;
use abbe::scene::texture::{Image, ImageTexture, Packed, Spectra, Texels, Wrap, pack_sigmoid};
use abbe::scene::{CoatNormals, Estimator, Geometry, Interior, Light, Material, Mesh, Scene, Texture};
use abbe::spectrum::Spectrum;
use glam::{DVec2, DVec3, dvec2, dvec3};
use std::sync::Arc;

/// Saturated colours side by side: interpolated coefficients would show.
const COLOURS: [[f64; 3]; 6] =
    [[0.9, 0.05, 0.02], [0.05, 0.8, 0.1], [0.02, 0.1, 0.9], [0.9, 0.85, 0.05], [0.5, 0.5, 0.5], [1.0, 1.0, 1.0]];

fn spectra_of(colours: &[[f64; 3]], texel: fn([f64; 3]) -> ([f64; 3], f64)) -> Vec<[f32; 4]> {
    let texel = |&rgb: &[f64; 3]| {
        let ([a, b, c], scale) = texel(rgb);
        [a, b, c, scale].map(|v| v as f32)
    };
    colours.iter().map(texel).collect()
}

fn image_of(count: usize, width: u32, texels: Texels) -> Arc<Image> {
    Arc::new(Image { width, height: count as u32 / width, texels })
}

/// Places of one, two or four bytes in a table of colours that is turned around.
fn image(colours: &[[f64; 3]], width: u32, size: usize, texel: fn([f64; 3]) -> ([f64; 3], f64)) -> Arc<Image> {
    let mut table = spectra_of(colours, texel);
    table.reverse();
    let places = (0..table.len() as u64).rev().flat_map(|i| i.to_le_bytes()[..size].to_vec());
    let stored = Arc::new(Packed::new(size, places.collect()));
    image_of(colours.len(), width, Texels::Colors { stored, table: table.into() })
}

/// Colours in eight bytes each.
fn packed(colours: &[[f64; 3]], width: u32, texel: fn([f64; 3]) -> ([f64; 3], f64)) -> Arc<Image> {
    let words = spectra_of(colours, texel).into_iter().flat_map(pack_sigmoid).flat_map(u32::to_le_bytes);
    image_of(colours.len(), width, Texels::Sigmoids { stored: Arc::new(Packed::new(8, words.collect())) })
}

/// Numbers of one or two bytes.
pub fn numbers(values: &[f64], width: u32, size: usize, scale: f64) -> Arc<Image> {
    let most = (1u64 << (8 * size)) as f64 - 1.0;
    let bytes = values.iter().flat_map(|v| ((v * most).round() as u64).to_le_bytes()[..size].to_vec());
    image_of(values.len(), width, Texels::Numbers { stored: Arc::new(Packed::new(size, bytes.collect())), scale })
}

/// Spectra that differ from bin to bin, from 450 to 700 nm; the ends go on.
fn bins(count: usize, width: u32) -> Arc<Image> {
    let edges = vec![450.0, 480.0, 550.0, 610.0, 650.0, 700.0];
    let values = (0..5 * count).map(|i| (i * 7 % 11) as f32 / 12.0).collect();
    image_of(count, width, Texels::Spectra { stored: Arc::new(Spectra::new(edges, values)), hold: true })
}

pub fn texture(image: Arc<Image>, wrap: [Wrap; 2], to_image: [[f64; 3]; 2]) -> ImageTexture {
    ImageTexture { image, wrap, nearest: false, to_image, factor: Spectrum::Constant(1.0), cutoff: None, set: 0, tinted: false }
}

pub fn on(texture: ImageTexture) -> Texture {
    Texture::Image(Arc::new(texture))
}

/// A parallelogram whose corner has the texture coordinates (0, 1), in the second set turned, with a colour at each corner.
pub fn quad(corner: DVec3, u: DVec3, v: DVec3) -> Geometry {
    let uvs = [dvec2(0.0, 1.0), dvec2(1.0, 1.0), dvec2(1.0, 0.0), dvec2(0.0, 0.0)].to_vec();
    let more_uvs = uvs.iter().map(|uv| dvec2(0.7 * uv.x + 0.5 * uv.y, uv.y - 0.4 * uv.x)).collect();
    let positions = vec![corner, corner + u, corner + u + v, corner + v];
    let colors = COLOURS[..4].iter().map(|&rgb| {
        let ([c0, c1, c2], factor) = upsample::reflectance_texel(rgb);
        [c0, c1, c2, factor].map(|v| v as f32)
    });
    let colors = colors.collect();
    Geometry::Mesh(Arc::new(Mesh { positions, uvs, more_uvs, colors, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }))
}

/// A coarse ball, its texture coordinates from -1 to 2, as a screen for wrapping.
pub fn ball(center: DVec3, radius: f64) -> Geometry {
    let Geometry::Mesh(mesh) = smooth_ball(center, radius) else { unreachable!("a mesh") };
    let uvs = mesh.positions.iter().map(|p| DVec2::splat(0.5) + 1.5 * (*p - center).truncate() / radius).collect();
    Geometry::Mesh(Arc::new(Mesh { uvs, ..Mesh::clone(&mesh) }))
}

/// Colours repeated over the plane.
pub fn tiles() -> Texture {
    let colours = image(&COLOURS, 3, 1, upsample::reflectance_texel);
    on(texture(colours, [Wrap::Repeat, Wrap::Mirror], [[2.1, 0.7, 0.2], [-0.6, 1.9, -0.4]]))
}

/// A floor, a wall and a ball with pictures, stored in three ways, before them a perforated and a half transparent sheet, and glass.
pub fn surfaces() -> Scene {
    let mut s = room(4, 16);
    s.max_depth = 16;
    s.shapes.clear();
    let reflects = |t| Material::Diffuse { reflectance: on(t) };
    // Turned, stretched and moved.
    let tiles = texture(
        image(&COLOURS, 3, 2, upsample::reflectance_texel),
        [Wrap::Repeat, Wrap::Mirror],
        [[2.1, 0.7, 0.2], [-0.6, 1.9, -0.4]],
    );
    let floor = material(&mut s, reflects(ImageTexture { tinted: true, ..tiles }));
    shape(&mut s, floor, quad(dvec3(-2.0, 0.0, 2.0), DVec3::X * 4.0, DVec3::Z * -3.0));
    let blocks = texture(
        packed(&COLOURS, 3, upsample::reflectance_texel),
        [Wrap::Mirror, Wrap::Repeat],
        [[1.5, 0.0, -0.25], [0.0, 1.5, 0.1]],
    );
    let wall = material(&mut s, reflects(ImageTexture { nearest: true, factor: ramp(0.9, 0.5), set: 1, ..blocks }));
    shape(&mut s, wall, quad(dvec3(-2.0, 0.0, -1.0), DVec3::X * 4.0, DVec3::Y * 3.0));
    let clamped = texture(bins(6, 3), [Wrap::Clamp; 2], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let clamped = material(&mut s, reflects(clamped));
    shape(&mut s, clamped, ball(dvec3(-0.45, 0.4, 0.3), 0.35));

    let shares = numbers(&[0.1, 0.9, 0.3, 0.7], 2, 2, 1.0);
    let nothing = material(&mut s, Material::Boundary { interior: None });
    let holes = texture(shares.clone(), [Wrap::Repeat; 2], [[3.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
    let mask = on(ImageTexture { cutoff: Some(0.5), ..holes });
    let perforated = material(&mut s, Material::Mix { a: floor, b: nothing, weight: mask });
    shape(&mut s, perforated, quad(dvec3(-0.9, 0.5, 0.8), dvec3(0.8, 0.0, 0.1), dvec3(0.0, 0.7, 0.1)));
    let sheer = on(texture(shares, [Wrap::Clamp; 2], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
    let sheer = material(&mut s, Material::Mix { a: wall, b: nothing, weight: sheer });
    shape(&mut s, sheer, quad(dvec3(0.1, 0.8, 0.8), dvec3(0.8, 0.0, -0.1), dvec3(0.0, 0.5, 0.0)));

    let flint = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    shape(&mut s, flint, sphere(dvec3(0.5, 0.4, 0.3), 0.38));
    lamp(&mut s, disc(dvec3(0.0, 2.2, 0.2), -DVec3::Y, 1.5), ramp(1.0, 2.0));
    s.lights.push(Light::Constant { radiance: ramp(0.3, 0.2) });
    s
}

/// The room under a lamp with a picture in bright and dark colours, which glass focuses.
pub fn lamps() -> Scene {
    let mut s = room(4, 16);
    s.max_depth = 16;
    s.shapes.truncate(2);
    let colours = [[9.0, 1.0, 0.5], [0.0, 0.0, 0.0], [0.5, 2.0, 8.0], [1.0, 6.0, 1.0]];
    let colours = image(&colours, 2, 4, upsample::emission_texel);
    let picture = texture(colours, [Wrap::Clamp; 2], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    lamp(&mut s, quad(dvec3(-1.4, 2.2, -1.0), DVec3::X * 2.8, DVec3::Z * 2.4), ramp(1.0, 2.0));
    if let Some(emission) = &mut s.shapes[2].emission {
        emission.radiance = on(ImageTexture { factor: ramp(0.5, 1.0), ..picture });
    }
    let flint = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    shape(&mut s, flint, sphere(dvec3(0.0, 0.65, 0.2), 0.55));
    s
}

/// A floor of metal, a lacquered wall and a glass ball whose roughness varies, floor and wall with pictures of their colours, around a lamp.
pub fn roughness() -> Scene {
    let mut s = room(4, 16);
    s.max_depth = 16;
    s.shapes.clear();
    let colours = image(&COLOURS, 3, 1, upsample::reflectance_texel);
    let levels = 2..9;
    let values = numbers(&[0.3, 1.0, 0.32, 0.6, 0.9, 0.4], 3, 1, 0.5);
    let graded = |s: &mut Scene, make: &dyn Fn(f64) -> Material| {
        let first = s.materials.len();
        s.materials.extend(levels.clone().map(|level| make((level as f64 / abbe::scene::roughness::STEPS as f64).powi(2))));
        let roughness = on(texture(values.clone(), [Wrap::Mirror; 2], [[0.8, 0.3, 0.0], [-0.2, 0.9, 0.1]]));
        let materials = (first..s.materials.len()).collect();
        material(s, Material::Graded { materials, levels: levels.clone(), roughness })
    };
    let picture = on(texture(colours, [Wrap::Repeat; 2], [[0.7, 0.0, 0.0], [0.0, 0.7, 0.2]]));
    let metal = graded(&mut s, &|alpha| Material::ColoredConductor { reflectance: picture.clone(), alpha });
    shape(&mut s, metal, quad(dvec3(-2.0, 0.0, 2.0), DVec3::X * 4.0, DVec3::Z * -3.0));
    s.interiors.push(Interior { ior: flint(), ..solid("flint", 1.0, 1) });
    let glass = graded(&mut s, &|alpha| Material::Dielectric { interior: 1, alpha, tint: None, antireflective: false });
    shape(&mut s, glass, ball(dvec3(0.4, 0.4, 0.3), 0.35));
    let paint = material(&mut s, Material::Diffuse { reflectance: picture.clone() });
    let coat =
        graded(&mut s, &|alpha| Material::Coated { base: paint, ior: flint(), alpha, seen: false, normals: CoatNormals::OfBase });
    shape(&mut s, coat, quad(dvec3(-2.0, 0.0, -1.0), DVec3::X * 4.0, DVec3::Y * 3.0));
    // Its mirror images are as wide as what they are seen in is rough.
    lamp(&mut s, sphere(dvec3(-0.4, 0.8, 0.0), 0.25), ramp(2.0, 4.0));
    s
}

/// A map of normals, of so many bytes a component, some so steep that the surface is seen and lit from behind them.
fn slopes(size: usize) -> Arc<Image> {
    let slopes = [[0.3, 0.2], [-1.6, 0.1], [0.0, -0.3], [0.2, -2.0], [-0.1, 0.35], [1.2, 0.9]];
    // -1 to 1 times two.
    let most = (1u64 << (8 * size)) as f64 - 1.0;
    let code = |v: f64| ((0.5 * v + 0.5) * most).round() as u64;
    let texel =
        |[x, y]: [f64; 2]| [0.5 * x, 0.5 * y, 1.0, -1.0].into_iter().flat_map(move |v| code(v).to_le_bytes()[..size].to_vec());
    let stored = Arc::new(Packed::new(4 * size, slopes.into_iter().flat_map(texel).collect()));
    image_of(slopes.len(), 3, Texels::Vectors { stored, scale: 2.0 })
}

fn repeated(map: &Arc<Image>, repeats: f64) -> Arc<ImageTexture> {
    Arc::new(texture(map.clone(), [Wrap::Repeat, Wrap::Mirror], [[repeats, 0.3, 0.0], [-0.2, repeats, 0.1]]))
}

/// Coats of these widths on these materials that point elsewhere than what is under them.
pub fn coats_that_point_elsewhere(s: &mut Scene, coats: [(usize, f64); 3]) -> [usize; 3] {
    let map = slopes(1);
    let mut i = 0.0;
    coats.map(|(base, alpha)| {
        i += 1.0;
        let normals = if alpha == 0.0 { CoatNormals::OfShape } else { CoatNormals::Mapped(repeated(&map, 0.7 * i)) };
        let base = material(s, Material::Coated { base, ior: flint(), alpha, seen: false, normals });
        material(s, Material::NormalMapped { base, normals: repeated(&map, i) })
    })
}

/// Coats that point elsewhere than the paint and metals under them, on a floor and balls, also lit through a ball of glass.
pub fn normals_of_coats(reference: Estimator) -> Scene {
    let mut s = room(4, 16);
    (s.reference, s.max_depth) = (reference, 16);
    s.shapes.clear();
    let metal = |alpha| Material::Conductor { eta: ramp(0.3, 1.2), k: ramp(2.0, 4.0), alpha };
    let (mirror, rough) = (material(&mut s, metal(0.0)), material(&mut s, metal(0.3)));
    let smooth = if let Estimator::Forward = reference { 0.3 } else { 0.0 };
    let [paint, mirror, rough] = coats_that_point_elsewhere(&mut s, [(0, 0.4), (mirror, 0.2), (rough, smooth)]);
    shape(&mut s, paint, quad(dvec3(-2.0, 0.0, 2.0), DVec3::X * 4.0, DVec3::Z * -4.0));
    shape(&mut s, rough, ball(dvec3(-0.4, 0.3, 0.0), 0.3));
    let flint = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    shape(&mut s, flint, sphere(dvec3(0.0, 1.3, 0.2), 0.35));
    match reference {
        Estimator::Forward => s.lights.push(Light::Point { position: dvec3(0.3, 2.2, 0.4), intensity: ramp(1.0, 2.0) }),
        Estimator::Backward => {
            shape(&mut s, mirror, ball(dvec3(0.4, 0.3, 0.0), 0.3));
            lamp(&mut s, disc(dvec3(0.0, 2.2, 0.2), -DVec3::Y, 1.5), ramp(1.0, 2.0));
            s.lights.push(Light::Constant { radiance: ramp(0.3, 0.2) });
        }
    }
    s.sensor = pinhole(dvec3(0.0, 0.6, 2.2), dvec3(0.0, 0.0, 0.2), 0.25);
    s
}

/// A wall, a metal ball and a glass ball, all with maps of normals.
pub fn normals() -> Scene {
    let mut s = room(4, 16);
    s.max_depth = 16;
    s.shapes.truncate(1);
    let (coarse, fine) = (slopes(1), slopes(2));
    let turned = |base: usize, repeats: f64| Material::NormalMapped {
        base,
        normals: repeated(if repeats > 2.0 { &coarse } else { &fine }, repeats),
    };
    let wall = material(&mut s, turned(0, 3.0));
    shape(&mut s, wall, quad(dvec3(-2.0, 0.0, -1.0), DVec3::X * 4.0, DVec3::Y * 3.0));
    let metal = material(&mut s, Material::Conductor { eta: ramp(0.3, 1.2), k: ramp(2.0, 4.0), alpha: 0.3 });
    let metal = material(&mut s, turned(metal, 1.0));
    shape(&mut s, metal, ball(dvec3(-0.5, 0.45, 0.3), 0.4));
    let flint = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    let flint = material(&mut s, turned(flint, 0.5));
    shape(&mut s, flint, ball(dvec3(0.5, 0.45, 0.3), 0.4));
    lamp(&mut s, disc(dvec3(0.0, 2.2, 0.2), -DVec3::Y, 1.5), ramp(1.0, 2.0));
    s.lights.push(Light::Constant { radiance: ramp(0.3, 0.2) });
    s
}
