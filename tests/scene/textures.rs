//! Pictures on surfaces: how scenes, meshes and glTF files name them, and where their texels end up.

use crate::scene_with;
use abbe::color::upsample::color_of_reflectance;
use abbe::scene::texture::{ImageTexture, Wrap};
use abbe::scene::{Geometry, LoadOptions, Material, Mesh, Passage, Scene, Texture, load};
use glam::{DVec2, DVec3, DVec4, dvec2};
use serde_json::{Value, json};
use std::path::PathBuf;

/// A folder of its own for a test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("abbe-textures-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.0.join(name), bytes).unwrap();
    }

    fn scene(&self, text: &str) -> abbe::Result<Scene> {
        abbe::scene::load_str(text, "t.json".as_ref(), &self.0, &LoadOptions::default())
    }

    fn gltf(&self, document: &Value) -> abbe::Result<Scene> {
        self.write("t.gltf", document.to_string().as_bytes());
        load(&self.0.join("t.gltf"), &LoadOptions::default())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// An 8-bit PNG of RGBA.
fn png(width: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, pixels.len() as u32 / width);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(pixels.as_flattened()).unwrap();
    out
}

/// Red and green above blue and white, all opaque but the blue.
fn four() -> Vec<u8> {
    png(2, &[[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 0], [255, 255, 255, 128]])
}

fn colour(texture: &Texture, uv: DVec2) -> [f64; 3] {
    color_of_reflectance(|nm| texture.eval(nm, uv))
}

fn near(a: [f64; 3], b: [f64; 3]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 3e-3), "{a:?} instead of {b:?}");
}

fn reflectance(scene: &Scene) -> &Texture {
    let mut material = &scene.materials[scene.shapes[0].material];
    if let Material::Coated { base, .. } = material {
        material = &scene.materials[*base];
    }
    let Material::Diffuse { reflectance } = material else { panic!("not diffuse") };
    reflectance
}

fn image(texture: &Texture) -> &ImageTexture {
    texture.image().expect("a picture")
}

const QUAD: &str = r#"[{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"}]"#;

#[test]
fn a_picture_stands_upright_on_a_quad_and_its_colours_come_through() {
    let folder = Folder::new("quad");
    folder.write("four.png", &four());
    let text = scene_with("materials", r#"{"m": {"diffuse": {"reflectance": {"texture": "four.png", "filter": "nearest"}}}}"#);
    let scene =
        folder.scene(&text.replace(r#"[{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]"#, QUAD)).unwrap();
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
    // The corner at the origin is at the lower left, where blue is.
    let at = |x: f64, y: f64| {
        let triangle = usize::from(y > x);
        let weights = if triangle == 0 { [x - y, y] } else { [x, y - x] };
        mesh.uv(triangle, 0, weights)
    };
    let paint = reflectance(&scene);
    for (x, y, rgb) in
        [(0.1, 0.2, [0.0, 0.0, 1.0]), (0.9, 0.2, [1.0; 3]), (0.2, 0.9, [1.0, 0.0, 0.0]), (0.9, 0.8, [0.0, 1.0, 0.0])]
    {
        near(colour(paint, at(x, y)), rgb);
    }
}

#[test]
fn spectra_not_coefficients_are_interpolated() {
    let folder = Folder::new("mean");
    folder.write("four.png", &four());
    let text = scene_with("materials", r#"{"m": {"diffuse": {"reflectance": {"texture": "four.png", "wrap": "clamp"}}}}"#);
    let scene =
        folder.scene(&text.replace(r#"[{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]"#, QUAD)).unwrap();
    near(colour(reflectance(&scene), dvec2(0.5, 0.0)), [0.5, 0.5, 0.0]);
    near(colour(reflectance(&scene), dvec2(0.5, 0.5)), [0.5, 0.5, 0.5]);
    near(colour(reflectance(&scene), dvec2(7.0, -7.0)), [0.0, 1.0, 0.0]);
}

#[test]
fn obj_and_ply_bring_texture_coordinates_counted_from_below() {
    let folder = Folder::new("meshes");
    folder.write("four.png", &four());
    folder.write("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 0.75\nf 1/1 2/2 3/3\n");
    folder.write(
        "a.ply",
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float s\nproperty float t\n\
          element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 0.75\n3 0 1 2\n",
    );
    for file in ["a.obj", "a.ply"] {
        let text = scene_with("materials", r#"{"m": {"diffuse": {"reflectance": {"texture": "four.png"}}}}"#);
        let mesh = format!(r#"{{"mesh": {{"file": "{file}"}}, "material": "m"}}"#);
        let scene =
            folder.scene(&text.replace(r#"{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}"#, &mesh)).unwrap();
        let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
        assert_eq!(mesh.uvs, [dvec2(0.0, 1.0), dvec2(1.0, 1.0), dvec2(0.0, 0.25)], "{file}");
    }
}

#[test]
fn pictures_that_cannot_be_put_anywhere_are_errors() {
    let folder = Folder::new("errors");
    folder.write("four.png", &four());
    let fails = |materials: &str, says: &str| {
        let line = folder.scene(&scene_with("materials", materials)).unwrap_err().to_string();
        assert!(line.contains(says), "{line}");
    };
    fails(r#"{"m": {"diffuse": {"reflectance": {"texture": "four.png"}}}}"#, "without texture coordinates; use a quad");
    fails(r#"{"m": {"diffuse": {"reflectance": {"texture": "none.png"}}}}"#, "cannot read");
    fails(r#"{"m": {"diffuse": {"reflectance": {"texture": "four.png", "tiles": [0, 1]}}}}"#, "0.001 to 1000");
    fails(r#"{"m": {"diffuse": {"reflectance": {"texture": "four.png", "wrap": "round"}}}}"#, "use one of repeat, mirror, clamp");
    fails(r#"{"m": {"conductor": {"eta": {"texture": "four.png"}, "k": 1}}}"#, "unknown key \"texture\"");
    // A picture that claims to be large in a small file.
    let mut bomb = Vec::new();
    let mut encoder = png::Encoder::new(&mut bomb, 8192, 8192);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    encoder.write_header().unwrap().write_image_data(&vec![0; 8192 * 1024]).unwrap();
    folder.write("four.png", &bomb);
    fails(r#"{"m": {"diffuse": {"reflectance": {"texture": "four.png"}}}}"#, "8192 x 8192 pixels are too many for a file of");
}

/// A textured square whose material is `material`.
fn document(material: Value) -> Value {
    let floats = [0.0f32, 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., /* uv */ 0., 1., 1., 1., 1., 0., 0., 0.];
    let mut bytes: Vec<u8> = floats.iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend([0u8, 1, 2, 0, 2, 3]);
    json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [material],
        "textures": [{"source": 0}, {"source": 0, "sampler": 0}, {"extensions": {"KHR_texture_basisu": {"source": 0}}}],
        "samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}],
        "images": [{"uri": format!("data:image/png;base64,{}", crate::gltf::base64(&four()))}],
        "buffers": [{"byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{}", crate::gltf::base64(&bytes))}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32}, {"buffer": 0, "byteOffset": 80, "byteLength": 6}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR"}],
    })
}

#[test]
fn gltf_base_colours_have_samplers_transforms_and_factors() {
    let folder = Folder::new("base");
    let info = json!({"index": 1, "extensions": {"KHR_texture_transform": {"offset": [0.25, 0.5], "scale": [0.5, 1], "rotation": std::f64::consts::FRAC_PI_2}}});
    let pbr = json!({"metallicFactor": 0, "baseColorTexture": info, "baseColorFactor": [0.5, 1, 1, 1]});
    let scene = folder.gltf(&document(json!({"pbrMetallicRoughness": pbr}))).unwrap();
    let texture = reflectance(&scene);
    let picture = image(texture);
    assert_eq!((picture.wrap, picture.nearest), ([Wrap::Clamp, Wrap::Mirror], true));
    // A quarter turn counter-clockwise with v downwards takes (u, v) to (v, -u), after scaling and before moving.
    let expected = [[0.0, 1.0, 0.25], [-0.5, 0.0, 0.5]];
    let off = picture.to_image.as_flattened().iter().zip(expected.as_flattened()).map(|(a, b): (&f64, &f64)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) < 1e-12, "{:?}", picture.to_image);
    near(colour(texture, dvec2(1.0, 0.0)), [0.5, 0.0, 0.0]);
}

#[test]
fn the_specifications_example_of_a_turned_texture_shows_the_quadrant_that_it_names() {
    // KHR_texture_transform: "utilizes only the lower left quadrant of the source image, rotated clockwise 90 degrees".
    let folder = Folder::new("turned");
    let moved = json!({"offset": [0, 1], "scale": [0.5, 0.5], "rotation": std::f64::consts::FRAC_PI_2});
    let info = json!({"index": 1, "extensions": {"KHR_texture_transform": moved}});
    let scene = folder.gltf(&document(json!({"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": info}}))).unwrap();
    let [u, v] = image(reflectance(&scene)).to_image;
    let at = |[a, b, c]: [f64; 3], x: f64, y: f64| a * x + b * y + c;
    for (x, y) in [(0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9)] {
        let (u, v) = (at(u, x, y), at(v, x, y));
        assert!((0.0..0.5).contains(&u) && (0.5..1.0).contains(&v), "({x}, {y}) shows ({u}, {v})");
    }
}

#[test]
fn gltf_alpha_masks_and_blends() {
    let folder = Folder::new("alpha");
    for (mode, expected) in [("MASK", [1.0, 1.0, 0.0, 1.0]), ("BLEND", [1.0, 1.0, 0.0, 128.0 / 255.0])] {
        let material =
            json!({"alphaMode": mode, "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": 1}}});
        let scene = folder.gltf(&document(material)).unwrap();
        let Material::Mix { a, b, weight } = &scene.materials[scene.shapes[0].material] else { panic!("not a mixture") };
        assert!(matches!(scene.materials[*a], Material::Coated { .. }));
        assert!(matches!(scene.materials[*b], Material::Boundary { interior: None }));
        let centres = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
        let found = centres.map(|(u, v)| weight.eval(500.0, dvec2(u, v)));
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{mode}: {found:?}");
    }
}

/// Half of a surface cannot have an inside: light would be made or lost.
#[test]
fn gltf_solid_glass_of_an_alpha_below_one_is_a_thin_pane() {
    let folder = Folder::new("alpha-glass");
    let glass = |alpha: f64| {
        let material = json!({
            "alphaMode": "BLEND", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.3, "baseColorFactor": [1, 1, 1, alpha]},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.75}, "KHR_materials_volume": {"thicknessFactor": 1}}});
        folder.gltf(&document(material)).unwrap()
    };
    let (solid, thin) = (glass(1.0), glass(0.5));
    assert!(solid.interior_of(solid.shapes[0].material).is_some() && !solid.notes.iter().any(|note| note.contains("thin pane")));
    let Material::Mix { a, b, .. } = &thin.materials[thin.shapes[0].material] else { panic!("not a mixture") };
    assert!(thin.made_of(*a).iter().any(|&m| thin.materials[m].pane().is_some_and(|ior| ior.nd() == 1.5)));
    assert!(matches!(thin.materials[*b], Material::Boundary { interior: None }));
    assert_eq!((thin.interior_of(thin.shapes[0].material), thin.passage(thin.shapes[0].material)), (None, Ok(Passage::Straight)));
    assert!(thin.notes.iter().any(|note| note.contains("alpha below 1") && note.contains("OPAQUE")), "{:?}", thin.notes);
}

#[test]
fn gltf_metal_transmission_and_emission_have_pictures() {
    let folder = Folder::new("rest");
    let material = json!({
        "pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 1}, "roughnessFactor": 0.5},
        "emissiveFactor": [1, 0.5, 1], "emissiveTexture": {"index": 1},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 100},
                       "KHR_materials_transmission": {"transmissionFactor": 1, "transmissionTexture": {"index": 1}},
                       "KHR_materials_volume": {"thicknessFactor": 1}}});
    let scene = folder.gltf(&document(material)).unwrap();
    let Material::Mix { a: metal, b: rest, weight: metallic } = &scene.materials[scene.shapes[0].material] else {
        panic!("no mixture")
    };
    let Material::Graded { materials, levels, roughness } = &scene.materials[*metal] else { panic!("of one roughness") };
    assert_eq!(*levels, 0..9);
    let widths = materials.iter().map(|&level| match &scene.materials[level] {
        Material::ColoredConductor { alpha, .. } => *alpha,
        other => panic!("{other:?} is not metal"),
    });
    let expected = (0..9).map(|level| (f64::from(level) / 16.0).powi(2));
    assert!(widths.eq(expected), "from 0 to 0.5 in steps of 1/16");
    assert_eq!([dvec2(0.25, 0.25), dvec2(0.75, 0.25)].map(|uv| roughness.eval(500.0, uv)), [0.0, 0.5]);
    let Material::Mix { a: glass, b: paint, weight: clear } = &scene.materials[*rest] else { panic!("no mixture below") };
    let Material::Graded { materials, .. } = &scene.materials[*glass] else { panic!("of one roughness") };
    assert!(matches!(scene.materials[materials[0]], Material::Dielectric { .. }));
    assert!(matches!(scene.materials[*paint], Material::Graded { .. }));
    // Blue says how metallic, red how clear.
    let [red, blue] = [dvec2(0.25, 0.25), dvec2(0.25, 0.75)];
    assert_eq!((metallic.eval(500.0, red), metallic.eval(500.0, blue)), (0.0, 1.0));
    assert_eq!((clear.eval(500.0, red), clear.eval(500.0, blue)), (1.0, 0.0));
    let radiance = &scene.shapes[0].emission.as_ref().unwrap().radiance;
    let cmf = abbe::spectrum::library::observer(abbe::spectrum::library::Observer::Cie1931);
    let luminance =
        |uv| (360..=830).map(|nm| 683.002 * cmf.eval(f64::from(nm))[1] * radiance.eval(f64::from(nm), uv)).sum::<f64>();
    // 100 cd m^-2 times the luminance of the linear sRGB colours (IEC 61966-2-1).
    for (uv, share) in [(red, 0.2126), (dvec2(0.75, 0.25), 0.5 * 0.7152), (blue, 0.0722)] {
        assert!((luminance(uv) - 100.0 * share).abs() < 0.3, "{} instead of {}", luminance(uv), 100.0 * share);
    }
}

/// The mixture that a material of these extensions is, and its parts.
fn gltf_coats(folder: &Folder, metallic: f64, extensions: Value) -> (Scene, [usize; 2], f64) {
    let pbr = json!({"metallicFactor": metallic, "roughnessFactor": 0.5});
    let scene = folder.gltf(&document(json!({"pbrMetallicRoughness": pbr, "extensions": extensions}))).unwrap();
    let Material::Mix { a, b, weight } = &scene.materials[scene.shapes[0].material] else { panic!("no mixture") };
    let (parts, share) = ([*a, *b], weight.average(500.0));
    (scene, parts, share)
}

#[test]
fn gltf_gloss_is_a_coat_and_a_clear_coat_lies_on_paint_and_metal() {
    let folder = Folder::new("coats");
    let specular = json!({"KHR_materials_specular": {"specularFactor": 0.25, "specularColorFactor": [0.5, 0.5, 0.5]}, "KHR_materials_ior": {"ior": 1.8}});
    let (scene, [glossy, paint], share) = gltf_coats(&folder, 0.0, specular);
    let Material::Coated { base, ior, alpha, .. } = &scene.materials[glossy] else { panic!("no coat") };
    let is_white =
        |m: usize| matches!(&scene.materials[m], Material::Diffuse { reflectance } if reflectance.average(500.0) == 1.0);
    assert!(is_white(*base) && is_white(paint));
    assert_eq!((*alpha, share), (0.25, 0.25));
    // Half of what an index of 1.8 reflects at normal incidence, (2 / 7)^2.
    let (n, f0) = (ior.eval(500.0), 0.5 * (0.8f64 / 2.8).powi(2));
    assert!((((n - 1.0) / (n + 1.0)).powi(2) - f0).abs() < 1e-9, "{n}");
    assert!(scene.notes.iter().all(|n| !n.contains("ignored")), "{:?}", scene.notes);
    let lacquer = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.1}});
    for metallic in [0.0, 1.0] {
        let (scene, [lacquered, bare], share) = gltf_coats(&folder, metallic, lacquer.clone());
        let Material::Coated { base, ior, alpha, .. } = &scene.materials[lacquered] else { panic!("no coat") };
        assert!(share == 0.75 && ior.eval(500.0) == 1.5 && (alpha - 0.01).abs() < 1e-9, "{share} {alpha}");
        match &scene.materials[*base] {
            Material::Diffuse { .. } => assert!(matches!(scene.materials[bare], Material::Coated { base: b, .. } if b == *base)),
            Material::ColoredConductor { .. } => assert_eq!((bare, metallic), (*base, 1.0)),
            other => panic!("{other:?} under a coat"),
        }
        assert!(scene.notes.iter().all(|n| !n.contains("ignored")), "{:?}", scene.notes);
    }
}

#[test]
fn gltf_iridescence_is_a_film_on_metal_and_glass() {
    let folder = Folder::new("films");
    let film = json!({"iridescenceFactor": 0.5, "iridescenceIor": 1.8, "iridescenceThicknessMaximum": 300});
    let glass = json!({"transmissionFactor": 1});
    for (metallic, roughness) in [(1.0, 0.5), (0.0, 0.0)] {
        let pbr = json!({"metallicFactor": metallic, "roughnessFactor": roughness});
        let extensions = json!({"KHR_materials_iridescence": film, "KHR_materials_transmission": glass, "KHR_materials_volume": {"thicknessFactor": 1}});
        let scene = folder.gltf(&document(json!({"pbrMetallicRoughness": pbr, "extensions": extensions}))).unwrap();
        let Material::Mix { a, b, weight } = &scene.materials[scene.shapes[0].material] else { panic!("no mixture") };
        assert_eq!(weight.average(500.0), 0.5);
        assert_eq!(scene.thin_films[a], abbe::scene::ThinFilm { ior: abbe::spectrum::Ior::constant(1.8), thickness_nm: 300.0 });
        assert!(!scene.thin_films.contains_key(b));
        match &scene.materials[*a] {
            Material::Conductor { alpha, .. } => assert_eq!((metallic, *alpha), (1.0, 0.25)),
            Material::Dielectric { alpha, .. } => assert_eq!((metallic, *alpha), (0.0, 0.0)),
            other => panic!("a film on {other:?}"),
        }
    }
    let pbr = json!({"metallicFactor": 0});
    let paint = json!({"pbrMetallicRoughness": pbr, "extensions": {"KHR_materials_iridescence": film}});
    let scene = folder.gltf(&document(paint)).unwrap();
    assert!(
        scene.thin_films.is_empty() && scene.notes.iter().any(|n| n.contains("iridescence of what is neither")),
        "{:?}",
        scene.notes
    );
}

#[test]
fn films_lie_on_smooth_glass_and_known_metal() {
    let folder = Folder::new("scene-films");
    let scene = |material: &str| folder.scene(&scene_with("materials", &format!(r#"{{"m": {material}}}"#)));
    let soap = scene(r#"{"thin_dielectric": {"ior": 1.33, "thickness": 400}}"#).unwrap();
    assert_eq!((soap.thin_films[&0].thickness_nm, soap.thin_films[&0].ior.eval(500.0)), (400.0, 1.33));
    let oxide = scene(r#"{"conductor": {"metal": "Ti", "alpha": 0.2, "thin_film": {"thickness": 120, "ior": 2.5}}}"#).unwrap();
    assert_eq!(oxide.thin_films[&0].thickness_nm, 120.0);
    for (bad, says) in [
        (r#"{"dielectric": {"ior": 1.5, "alpha": 0.1, "thin_film": {"thickness": 120, "ior": 1.3}}}"#, "a film on rough glass"),
        (r#"{"conductor": {"reflectance": 0.5, "thin_film": {"thickness": 120, "ior": 1.3}}}"#, "depends on the metal's index"),
        (
            r#"{"dielectric": {"ior": 1.5, "thin_film": {"thickness": 1e5, "ior": 1.3}}}"#,
            "$.materials.m.dielectric.thin_film.thickness",
        ),
        (r#"{"dielectric": {"ior": 1.5, "thin_film": {"ior": 1.3}}}"#, "thickness"),
    ] {
        let line = scene(bad).unwrap_err().to_string();
        assert!(line.contains(says), "{line}");
    }
}

#[test]
fn glass_of_scenes_is_tinted_absorbs_and_blurs() {
    let folder = Folder::new("scene-tints");
    folder.write("t.png", &png(2, &[[0, 128, 0, 255], [255, 191, 255, 255]]));
    let scene = |material: &str| folder.scene(&scene_with("materials", &format!(r#"{{"m": {material}}}"#)));
    let pane = scene(r#"{"thin_dielectric": {"ior": 1.5, "roughness": 0.5, "tint": [[400, 0.2], [700, 0.8]]}}"#).unwrap();
    let Material::ThinDielectric { alpha: 0.25, tint: Some(tint), .. } = &pane.materials[0] else { panic!("no tinted pane") };
    assert!((tint.average(550.0) - 0.5).abs() < 1e-12);
    // Half is left after 1 cm, so a quarter after 2.
    let dark = r#"{"color": 0.5, "distance": 0.01}"#;
    let pane = scene(&format!(r#"{{"thin_dielectric": {{"ior": 1.5, "absorption": {dark}, "thickness": 0.02}}}}"#)).unwrap();
    let Material::ThinDielectric { depth, .. } = &pane.materials[0] else { panic!("no pane") };
    assert!((depth.eval(550.0) - 4f64.ln()).abs() < 1e-12 && pane.thin_films.is_empty());
    let solid = scene(&format!(r#"{{"dielectric": {{"ior": 1.5, "absorption": {dark}, "tint": 0.7}}}}"#)).unwrap();
    assert!((solid.interiors[1].sigma_a.eval(550.0) - 100.0 * 2f64.ln()).abs() < 1e-9);
    assert!(solid.materials[0].tint().is_some_and(|tint| tint.average(550.0) == 0.7));
    for (bad, says) in [
        (r#"{"thin_dielectric": {"ior": 1.5, "absorption": 3}}"#, "add \"thickness\""),
        (r#"{"thin_dielectric": {"ior": 1.5, "absorption": {"color": 0.5}, "thickness": 1}}"#, "distance"),
        (r#"{"thin_dielectric": {"ior": 1.5, "absorption": {"color": 1.5, "distance": 1}, "thickness": 1}}"#, "0 and 1"),
        (r#"{"thin_dielectric": {"ior": 1.5, "anisotropy": {"strength": 0.5}}}"#, "no grain"),
        (
            r#"{"thin_dielectric": {"ior": 1.5, "absorption": 3, "thickness": 1, "thin_film": {"thickness": 100, "ior": 2}}}"#,
            "a film on what absorbs",
        ),
        (r#"{"dielectric": {"ior": 1.5, "tint": 2}}"#, "0 and 1"),
    ] {
        let line = scene(bad).unwrap_err().to_string();
        assert!(line.contains(says), "{line}");
    }
    let text = scene_with("materials", r#"{"m": {"thin_dielectric": {"ior": 1.5, "tint": {"texture": "t.png"}}}}"#);
    let stained = folder.scene(&text.replace(r#"[{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]"#, QUAD));
    assert!(stained.unwrap().materials[0].image().is_some());
}

#[test]
fn scenes_put_pictures_of_roughness_on_glass_metal_and_coats() {
    let folder = Folder::new("rough");
    folder.write("r.png", &png(2, &[[0, 128, 0, 255], [255, 191, 255, 255]]));
    let scene = |materials: &str| {
        let text = scene_with("materials", materials);
        folder.scene(&text.replace(r#"[{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]"#, QUAD))
    };
    for (kind, more) in
        [("dielectric", r#""ior": 1.5"#), ("conductor", r#""metal": "Al""#), ("coated", r#""of": "p", "ior": 1.5"#)]
    {
        let rough = format!(r#""p": {{"diffuse": {{"reflectance": 0.5}}}}, "m": {{"{kind}": {{{more}, "roughness": ROUGH}}}}"#);
        let scene = |roughness: &str| scene(&format!("{{{}}}", rough.replace("ROUGH", roughness)));
        let good = scene(r#"{"texture": "r.png", "filter": "nearest"}"#).unwrap();
        let Material::Graded { levels, roughness, .. } = &good.materials[good.shapes[0].material] else { panic!("{kind}") };
        assert_eq!(*levels, 8..13, "green is within a half and three quarters");
        assert!((roughness.eval(500.0, dvec2(0.75, 0.5)) - 191.0 / 255.0).abs() < 1e-6);
        let one = scene("0.2").unwrap();
        let alpha = match &one.materials[one.shapes[0].material] {
            Material::Dielectric { alpha, .. } | Material::Conductor { alpha, .. } | Material::Coated { alpha, .. } => *alpha,
            other => panic!("{other:?}"),
        };
        assert!((alpha - 0.04).abs() < 1e-12);
        let line = scene(r#"0.2, "alpha": 0.1"#).unwrap_err().to_string();
        assert!(line.contains("keep one of the two"), "{line}");
    }
    let line = scene(r#"{"m": {"coated": {"of": "g", "ior": 1.5}}, "g": {"dielectric": {"ior": 1.5}}}"#).unwrap_err().to_string();
    assert!(line.contains("a coat lies on paint or metal"), "{line}");
}

#[test]
fn gltf_textures_that_cannot_be_read_are_noted_or_errors() {
    let folder = Folder::new("lost");
    let with = |info: Value| document(json!({"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": info}}));
    let scene = folder.gltf(&with(json!({"index": 2}))).unwrap();
    assert!(scene.notes.iter().any(|n| n.contains("export pictures as PNG or JPEG")), "{:?}", scene.notes);
    assert!(reflectance(&scene).image().is_none());
    let scene = folder.gltf(&with(json!({"index": 0, "texCoord": 1}))).unwrap();
    assert!(scene.notes.iter().any(|n| n.contains("without texture coordinates shows one texel")), "{:?}", scene.notes);
    let fails = |document: &Value, says: &str| {
        let line = folder.gltf(document).unwrap_err().to_string();
        assert!(line.contains(says), "{line}");
    };
    fails(&with(json!({"index": 9})), "no element 9 in textures");
    let mut outside = with(json!({"index": 0}));
    outside["images"][0]["uri"] = json!("../x.png");
    fails(&outside, "--allow-outside");
    outside["images"][0] = json!({"bufferView": 0});
    fails(&outside, "readable .png");
}

#[test]
fn gltf_materials_are_overridden_by_name() {
    let folder = Folder::new("override");
    let glass = json!({"name": "Glass", "pbrMetallicRoughness": {"metallicFactor": 0}});
    folder.gltf(&document(glass)).unwrap();
    let scene = |overrides: &str| {
        folder.scene(&scene_with("shapes", &format!(r#"[{{"gltf": {{"file": "t.gltf", "override": {overrides}}}}}]"#)))
    };
    let flint = scene(r#"{"Glass": {"dielectric": {"ior": {"glass": "N-SF66", "extrapolate": true}}}}"#).unwrap();
    let Material::Dielectric { interior, .. } = flint.materials[flint.shapes[0].material] else { panic!("not glass") };
    assert!((flint.interiors[interior].ior.nd() - 1.92286).abs() < 1e-4, "{}", flint.interiors[interior].ior.nd());
    let lit =
        scene(r#"{"Glass": {"use": "m", "emission": {"radiance": {"spectrum": {"illuminant": "A"}, "luminance_cd_m2": 50}}}}"#)
            .unwrap();
    assert_eq!(lit.shapes[0].material, 0);
    let Texture::Uniform(radiance) = &lit.shapes[0].emission.as_ref().unwrap().radiance else { panic!("a picture") };
    let luminance = abbe::color::cie::xyz_of(radiance, abbe::spectrum::library::Observer::Cie1931)[1];
    assert!((luminance - 50.0).abs() < 1e-6, "{luminance}");
    let line = scene(r#"{"Gloss": {"use": "m"}}"#).unwrap_err().to_string();
    assert!(line.contains("no material \"Gloss\"; did you mean \"Glass\"?"), "{line}");
}

#[test]
fn gltf_maps_of_normals_lean_to_the_right_and_up_the_picture() {
    let folder = Folder::new("normals");
    // Straight out but for the upper left quarter, which leans to the right and as far upwards.
    let flat = [128, 128, 255, 255];
    let picture = png(2, &[[218, 218, 128, 255], flat, flat, flat]);
    let mut document = document(json!({"normalTexture": {"index": 1, "scale": 0.5}}));
    document["images"][0]["uri"] = json!(format!("data:image/png;base64,{}", crate::gltf::base64(&picture)));
    let scene = folder.gltf(&document).unwrap();
    let Material::NormalMapped { base, normals } = &scene.materials[scene.shapes[0].material] else { panic!("no normals") };
    assert!(matches!(scene.materials[*base], Material::ColoredConductor { .. }));
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
    // The square lies in x and y, its picture upright; it looks along z.
    let at = |u: f64, v: f64| mesh.mapped_normal(0, DVec3::ZERO, dvec2(u, v), DVec3::Z, DVec3::Z, normals);
    assert!((at(0.75, 0.25) - DVec3::Z).length() < 0.01, "{}", at(0.75, 0.25));
    // Before scaling (0.71, 0.71, 0.004), so that it all but lies down.
    assert!(at(0.25, 0.25).abs_diff_eq(DVec3::new(0.5, 0.5, 0.0).normalize(), 0.01), "{}", at(0.25, 0.25));
    let behind = mesh.mapped_normal(0, DVec3::ZERO, dvec2(0.75, 0.25), DVec3::NEG_Z, DVec3::Z, normals);
    assert_eq!(behind, DVec3::Z, "a normal that would look inwards is not turned");
    // The mesh's own tangents rule, and a negative sign turns the picture over.
    for (tangent, expected) in [([0.0, 1.0, 0.0, 1.0], [-0.5, 0.5, 0.0]), ([1.0, 0.0, 0.0, -1.0], [0.5, -0.5, 0.0])] {
        let combed = Mesh { tangents: vec![DVec4::from_array(tangent); mesh.positions.len()], ..Mesh::clone(mesh) };
        let turned = combed.mapped_normal(0, combed.positions[0], dvec2(0.25, 0.25), DVec3::Z, DVec3::Z, normals);
        assert!(turned.abs_diff_eq(DVec3::from_array(expected).normalize(), 0.01), "{turned}");
    }
}

#[test]
fn scenes_put_maps_of_normals_on_their_own_materials() {
    let folder = Folder::new("own-normals");
    folder.write("n.png", &png(1, &[[255, 128, 255, 255]]));
    let scene = |materials: &str| {
        let text = scene_with("materials", materials);
        folder.scene(&text.replace(r#"[{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]"#, QUAD))
    };
    let good = scene(
        r#"{"m": {"normal_map": {"of": "p", "texture": "n.png", "strength": 0.5}}, "p": {"diffuse": {"reflectance": 0.5}}}"#,
    );
    let good = good.unwrap();
    let Material::NormalMapped { base: 1, normals } = &good.materials[0] else { panic!("no normals of p") };
    let [x, y, z] = normals.vector(dvec2(0.3, 0.3));
    assert!((x - 0.5).abs() < 1e-6 && y.abs() < 0.01 && (z - 1.0).abs() < 1e-6, "{x} {y} {z}");
    let line = scene(r#"{"m": {"normal_map": {"of": "m", "texture": "n.png"}}}"#).unwrap_err().to_string();
    assert!(line.contains("contain each other"), "{line}");
}

#[test]
fn pictures_of_light_are_within_single_precision_with_their_factors() {
    let folder = Folder::new("range");
    let exr = |name: &str, v: f32| {
        image::Rgb32FImage::from_pixel(2, 1, image::Rgb([v, 0.5 * v, v])).save(folder.0.join(name)).unwrap();
    };
    exr("dark.exr", 1e-30);
    exr("one.exr", 1.0);
    exr("bright.exr", 1e30);
    let sky = |file: &str, scale: f64| scene_with("lights", &json!([{"image": {"file": file, "scale": scale}}]).to_string());
    let lamp = |file: &str, scale: f64| {
        let quad = json!({"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]});
        scene_with("shapes", &json!([{"quad": quad, "emission": {"radiance": {"texture": file, "scale": scale}}}]).to_string())
    };
    for text in [sky as fn(&str, f64) -> String, lamp] {
        for (file, scale) in [("one.exr", 1.0), ("one.exr", 0.0), ("dark.exr", 1e25), ("bright.exr", 1e-25), ("one.exr", 1e-15)] {
            folder.scene(&text(file, scale)).unwrap_or_else(|e| panic!("{file} times {scale}: {e}"));
        }
        for (file, scale, says) in [
            ("one.exr", 1e-30, "too dark"),
            ("one.exr", 1e-60, "too dark"),
            ("dark.exr", 1.0, "too dark"),
            ("one.exr", 1e30, "too bright"),
            ("bright.exr", 1.0, "too bright"),
            ("bright.exr", 1e30, "too bright"),
        ] {
            let line = folder.scene(&text(file, scale)).expect_err(file).to_string();
            assert!(line.contains(says) && line.contains("single precision"), "{file} times {scale}: {line}");
        }
    }
}

/// A triangle of this material, and a light.
fn triangle(folder: &Folder, material: Value, light: Value) -> abbe::Result<Scene> {
    let positions: Vec<u8> = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|v| v.to_le_bytes()).collect();
    folder.write("t.bin", &positions);
    folder.gltf(&json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [material],
        "buffers": [{"uri": "t.bin", "byteLength": 36}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "extensions": {"KHR_lights_punctual": {"lights": [light]}},
    }))
}

#[test]
fn gltf_light_is_within_single_precision() {
    let folder = Folder::new("gltf-range");
    let scene = |strength: f64, intensity: f64| {
        let emitter = json!({"emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}});
        triangle(&folder, emitter, json!({"type": "point", "intensity": intensity}))
    };
    scene(10.0, 100.0).unwrap();
    scene(0.0, 0.0).unwrap();
    for (strength, intensity, place) in [(1e-25, 100.0, "materials[0]"), (10.0, 1e-25, "KHR_lights_punctual")] {
        let line = scene(strength, intensity).expect_err(place).to_string();
        assert!(line.contains("too dark for single precision") && line.contains(place), "{line}");
    }
}

#[test]
fn a_gltf_film_that_is_not_given_in_nm_is_noted() {
    let folder = Folder::new("gltf-film");
    let notes = |thickness: f64| {
        let film = json!({"iridescenceFactor": 1, "iridescenceThicknessMaximum": thickness});
        let material = json!({"extensions": {"KHR_materials_iridescence": film}});
        let scene = triangle(&folder, material, json!({"type": "point"})).unwrap();
        scene.notes.into_iter().filter(|note| note.contains("a film of")).collect::<Vec<_>>()
    };
    assert!(notes(400.0).is_empty());
    let said = notes(4e-4);
    assert!(said.len() == 1 && said[0].contains("0.0004 nm") && said[0].contains("thickness is in nm"), "{said:?}");
}
