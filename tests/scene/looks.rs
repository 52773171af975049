//! Looks of glTF: what becomes of its materials.

use crate::gltf::{base64, document, load_document};
use abbe::scene::{CoatNormals, Material, Scene};
use abbe::spectrum::Spectrum;
use serde_json::{Value, json};

/// A picture of one row, as a data URI.
fn picture(texels: &[[u8; 4]]) -> String {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, texels.len() as u32, 1);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(texels.as_flattened()).unwrap();
    format!("data:image/png;base64,{}", base64(&file))
}

/// The square with this material, of which texture 0 shows these texels; the scene and the index of its material.
fn of_material(name: &str, material: Value, texels: &[[u8; 4]]) -> (Scene, usize) {
    let mut file = document();
    file["materials"][0] = material;
    file["textures"] = json!([{"source": 0, "sampler": 0}]);
    file["samplers"] = json!([{"magFilter": 9728}]);
    file["images"] = json!([{"uri": picture(texels)}]);
    let scene = load_document(name, &file).unwrap_or_else(|e| panic!("{e}"));
    let material = scene.shapes[0].material;
    (scene, material)
}

const WHITE: [u8; 4] = [255; 4];

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 2e-3, "{a} instead of {b}");
}

#[test]
fn colours_of_vertices_tint_what_is_not_lit() {
    let mut file = document();
    file["materials"][0] = json!({"extensions": {"KHR_materials_unlit": {}}});
    // The positions, in [0, 1], as colours.
    file["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(0);
    let scene = load_document("unlit-vertices", &file).unwrap_or_else(|e| panic!("{e}"));
    let radiance = &scene.shapes[0].emission.as_ref().expect("it shines").radiance;
    assert!(radiance.image().is_some_and(|picture| picture.tinted));
    let abbe::scene::Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("no mesh") };
    // Black where the first vertex is, and red at the second.
    let at = |shares| radiance.eval(650.0, mesh.coordinates(0, shares));
    assert!(at([0.0, 0.0]) < 1e-3 * at([1.0, 0.0]), "{} {}", at([0.0, 0.0]), at([1.0, 0.0]));
    assert!(scene.notes.iter().all(|note| !note.contains("COLOR_0")), "{:?}", scene.notes);
}

/// What is reflected at normal incidence, and the rest's share of paint, as the extension defines them.
#[test]
fn specular_and_glossiness_reflect_what_they_say_at_normal_incidence() {
    for (f0, diffuse) in [([1.0, 0.77, 0.34], 0.3), ([0.56; 3], 0.5), ([0.2, 0.1, 0.04], 0.5), ([0.04; 3], 0.5), ([0.02; 3], 0.5)]
    {
        let extension = json!({"specularFactor": f0, "diffuseFactor": [diffuse, diffuse, diffuse, 1], "glossinessFactor": 0.5});
        let material = json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": extension}});
        let (scene, m) = of_material("older", material, &[WHITE]);
        let (mirror, glossy, share) = match &scene.materials[m] {
            Material::Mix { a, b, weight } => (Some(*a), *b, weight.average(550.0)),
            Material::ColoredConductor { .. } => (Some(m), m, 1.0),
            _ => (None, m, 0.0),
        };
        let color = |nm: f64| match mirror.map(|m| &scene.materials[m]) {
            Some(Material::ColoredConductor { reflectance, alpha }) => {
                near(*alpha, 0.25);
                reflectance.average(nm)
            }
            Some(other) => panic!("{other:?}"),
            None => 0.0,
        };
        let by_gloss = match &scene.materials[glossy] {
            Material::Coated { base, ior, seen: true, .. } => {
                let Material::Diffuse { reflectance } = &scene.materials[*base] else { panic!("no paint") };
                near(reflectance.average(550.0), diffuse);
                ((ior.eval(550.0) - 1.0) / (ior.eval(550.0) + 1.0)).powi(2)
            }
            _ => 0.0,
        };
        let seen = abbe::color::upsample::color_of_reflectance(|nm| share * color(nm) + (1.0 - share) * by_gloss);
        assert!(seen.iter().zip(f0).all(|(a, b)| (a - b).abs() < 0.01), "{seen:?}, not {f0:?}");
        // Paint keeps 1 - f0 of its colour, but for what gloss takes.
        near((1.0 - share) * (1.0 - 0.04f64.min(f0[0])), 1.0 - f0[0]);
    }
}

#[test]
fn pictures_of_specular_colour_and_glossiness_are_read_texel_by_texel() {
    let extension = json!({"specularGlossinessTexture": {"index": 0}, "diffuseFactor": [0.5, 0.5, 0.5, 1]});
    let material = json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": extension}});
    // Gold, and paint, whose .04 is 56 in sRGB.
    let (scene, m) = of_material("older-picture", material, &[[255, 226, 157, 255], [56, 56, 56, 0]]);
    let Material::Mix { a, weight, .. } = &scene.materials[m] else { panic!("{:?}", scene.materials[m]) };
    let at = |texture: &abbe::scene::Texture, texel: usize, nm| texture.image().expect("a picture").image.eval(texel, nm);
    near(at(weight, 0, 550.0), 1.0);
    assert!(at(weight, 1, 550.0) < 0.005);
    let Material::Graded { materials, roughness, .. } = &scene.materials[*a] else { panic!("not graded") };
    assert_eq!([0, 1].map(|texel| at(roughness, texel, 550.0)), [0.0, 1.0]);
    let Material::ColoredConductor { reflectance, .. } = &scene.materials[materials[0]] else { panic!("no metal") };
    let gold = abbe::color::upsample::color_of_reflectance(|nm| at(reflectance, 0, nm));
    assert!(gold.iter().zip([1.0, 0.76, 0.337]).all(|(a, b)| (a - b).abs() < 0.01), "{gold:?}");
}

/// Thickness goes with green from the minimum to the maximum: in the middle it is in the middle.
#[test]
fn a_picture_says_how_thick_a_film_is() {
    let extension = json!({"iridescenceFactor": 1, "iridescenceIor": 1.4, "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 500,
        "iridescenceThicknessTexture": {"index": 0}});
    let material = json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "roughnessFactor": 0.5},
        "extensions": {"KHR_materials_iridescence": extension}});
    let (scene, m) = of_material("thickness", material, &[[0, 0, 0, 255], [0, 128, 0, 255], [0, 255, 0, 255]]);
    let Material::Graded { materials, levels, roughness } = &scene.materials[m] else { panic!("{:?}", scene.materials[m]) };
    for (texel, thickness) in [200.0, 200.0 + 300.0 * 128.0 / 255.0, 500.0].into_iter().enumerate() {
        let picture = roughness.image().expect("a picture");
        let (level, share) = abbe::scene::roughness::level_at(picture.image.eval(texel, 550.0), levels);
        let of = |level: usize| scene.thin_films[&materials[level]].thickness_nm;
        assert!((of(level) * (1.0 - share) + of(level + 1) * share - thickness).abs() < 0.1, "{level} {share}");
        assert!(of(level + 1) - of(level) <= 10.0 + 1e-9);
    }
    assert!(scene.notes.iter().all(|note| !note.contains("ignored")), "{:?}", scene.notes);
}

/// Red and green are the direction, blue the strength (KHR_materials_anisotropy).
#[test]
fn a_picture_says_where_a_grain_points_and_how_strong_it_is() {
    let extension = json!({"anisotropyStrength": 0.8, "anisotropyRotation": 0.1, "anisotropyTexture": {"index": 0}});
    let material =
        json!({"pbrMetallicRoughness": {"roughnessFactor": 0.5}, "extensions": {"KHR_materials_anisotropy": extension}});
    let texels = [[255, 128, 255, 255], [128, 255, 128, 255], [0, 128, 0, 255], [218, 218, 255, 255]];
    let (scene, m) = of_material("grain", material, &texels);
    let level = |m: usize, texel: usize| match &scene.materials[m] {
        Material::Graded { materials, levels, roughness } => {
            let value = roughness.image().expect("a picture").image.eval(texel, 550.0);
            let (level, share) = abbe::scene::roughness::level_at(value, levels);
            materials[level + usize::from(share > 0.5)]
        }
        other => panic!("{other:?}"),
    };
    let half = std::f64::consts::PI;
    for (texel, direction, strength) in [(0, 0.0, 0.8), (1, half / 2.0, 0.4), (2, 0.0, 0.0), (3, half / 4.0, 0.8)] {
        let brushed = level(level(m, texel), texel);
        match scene.grains.get(&brushed) {
            Some(grain) => {
                let off = (grain.rotation - 0.1 - direction) / half;
                assert!((off - off.round()).abs() < 0.02, "{texel}: {grain:?}");
                near(grain.strength, strength);
            }
            None => near(strength, 0.0),
        }
    }
}

/// A pane reflects as much as KHR_materials_specular says, and lets the rest through as a pane does.
#[test]
fn panes_reflect_what_their_specular_factor_leaves() {
    let material = json!({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0, "baseColorFactor": [0.5, 0.5, 0.5, 1]},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_specular": {"specularFactor": 0.25}}});
    let (scene, m) = of_material("pane", material, &[WHITE]);
    let Material::Mix { a, b, weight } = &scene.materials[m] else { panic!("{:?}", scene.materials[m]) };
    near(weight.average(550.0), 0.25);
    for (m, n) in [(*a, 1.5), (*b, 1.0)] {
        let Material::ThinDielectric { ior, tint: Some(tint), .. } = &scene.materials[m] else { panic!("no pane") };
        near(ior.eval(550.0), n);
        near(tint.average(550.0), 0.5);
    }
}

/// Between a few metals, in proportion at each wavelength: where a texel is as one of them, it is that.
#[test]
fn films_lie_on_metals_of_a_pictured_colour() {
    let extension = json!({"iridescenceFactor": 1, "iridescenceIor": 1.4, "iridescenceThicknessMaximum": 300});
    let material = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "roughnessFactor": 0.5},
        "extensions": {"KHR_materials_iridescence": extension}});
    // Reflectances of .04, .4 and 1, in sRGB.
    let (scene, mut m) = of_material("film-picture", material, &[[56, 56, 56, 255], [170, 170, 170, 255], WHITE]);
    let mut metals = Vec::new();
    while let Material::Mix { a, b, weight } = &scene.materials[m] {
        metals.push((*a, [0, 1, 2].map(|texel| weight.image().expect("a picture").image.eval(texel, 550.0))));
        m = *b;
    }
    let reflected = |m: usize| match &scene.materials[m] {
        Material::Conductor { eta, .. } => ((eta.eval(550.0) - 1.0) / (eta.eval(550.0) + 1.0)).powi(2),
        other => panic!("{other:?}"),
    };
    assert_eq!(metals.len(), 2);
    for (metal, reflects, weights) in
        [(metals[0].0, 0.98, [0.0, 0.0, 1.0]), (metals[1].0, 0.4, [0.0, 1.0, 1.0]), (m, 0.04, [0.0; 3])]
    {
        near(reflected(metal), reflects);
        assert!(scene.thin_films.contains_key(&metal));
        let found = metals.iter().find(|(other, _)| *other == metal).map_or([0.0; 3], |(_, found)| *found);
        assert!(found.iter().zip(weights).all(|(a, b)| (a - b).abs() < 0.01), "{found:?}");
    }
}

/// Solid glass likewise: at normal incidence, from outside and from within, what its index and KHR_materials_specular say.
#[test]
fn solid_glass_reflects_what_its_specular_factor_and_colour_say() {
    for (factor, color, most) in [(0.25, [1.0; 3], 0.01), (1.0, [0.5; 3], 0.02), (0.5, [10.0; 3], 0.2), (1.0, [100.0; 3], 1.0)] {
        let extensions = json!({"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1},
            "KHR_materials_specular": {"specularFactor": factor, "specularColorFactor": color}});
        let material = json!({"pbrMetallicRoughness": {"roughnessFactor": 0, "metallicFactor": 0}, "extensions": extensions});
        let (scene, m) = of_material("solid-specular", material, &[WHITE]);
        near(reflected(&scene, m), most);
        assert!(scene.passage(m).is_ok() && scene.interior_of(m).is_some());
        assert!(scene.notes.iter().all(|note| !note.contains("ignored")), "{:?}", scene.notes);
    }
}

/// What smooth glass or a mirror reflects at normal incidence and 550 nm.
fn reflected(scene: &Scene, m: usize) -> f64 {
    match &scene.materials[m] {
        Material::Mix { a, b, weight } => {
            let w = weight.average(550.0);
            w * reflected(scene, *a) + (1.0 - w) * reflected(scene, *b)
        }
        Material::Dielectric { antireflective: true, .. } => 0.0,
        Material::Dielectric { interior, .. } => abbe::bsdf::fresnel::dielectric(1.0, scene.interiors[*interior].ior.eval(550.0)),
        Material::ColoredConductor { reflectance, alpha } if *alpha == 0.0 => reflectance.average(550.0),
        other => panic!("{other:?}"),
    }
}

/// A clear coat has the normals of the shape where the file gives it none, and those of what is under it where both have one picture.
#[test]
fn clear_coats_have_the_normals_that_the_file_gives_them() {
    let (map, other) = (json!({"index": 0}), json!({"index": 0, "scale": 0.5}));
    for (base, coat, expected) in [
        (Some(&map), None, "of the shape"),
        (Some(&map), Some(&map), "of the base"),
        (Some(&map), Some(&other), "mapped"),
        (None, Some(&map), "mapped"),
        (None, None, "of the base"),
    ] {
        let mut material = json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1}}});
        if let Some(base) = base {
            material["normalTexture"] = base.clone();
        }
        if let Some(coat) = coat {
            material["extensions"]["KHR_materials_clearcoat"]["clearcoatNormalTexture"] = coat.clone();
        }
        let (scene, m) = of_material("coat-normals", material, &[[200, 100, 220, 255]]);
        let under = match &scene.materials[m] {
            Material::NormalMapped { base, .. } => *base,
            _ => m,
        };
        let Material::Coated { normals, .. } = &scene.materials[under] else { panic!("no coat") };
        let found = match normals {
            CoatNormals::OfBase => "of the base",
            CoatNormals::OfShape => "of the shape",
            CoatNormals::Mapped(_) => "mapped",
        };
        assert_eq!(found, expected, "{base:?}, {coat:?}");
        assert!(scene.notes.iter().all(|note| !note.contains("ignored")), "{:?}", scene.notes);
    }
}

/// Pictures of roughness, films and grains at once: levels of levels, of which there are no end.
#[test]
fn pictures_in_many_materials_make_no_more_materials_than_there_is_room_for() {
    let texels = [[0, 0, 0, 255], [255, 255, 255, 255]];
    let mut file = document();
    let films = json!({"iridescenceFactor": 1, "iridescenceThicknessMinimum": 100, "iridescenceThicknessMaximum": 700, "iridescenceThicknessTexture": {"index": 0}});
    file["materials"] = (0..8)
        .map(|i| {
            json!({"pbrMetallicRoughness": {"baseColorFactor": [0.1 * f64::from(i), 0.5, 0.5, 1], "baseColorTexture": {"index": 0},
                "metallicRoughnessTexture": {"index": 0}},
                "extensions": {"KHR_materials_iridescence": films,
                    "KHR_materials_anisotropy": {"anisotropyStrength": 1, "anisotropyTexture": {"index": 0}}}})
        })
        .collect();
    let mesh = file["meshes"][0].clone();
    file["meshes"][0]["primitives"] = (0..8)
        .map(|i| {
            let mut primitive = mesh["primitives"][0].clone();
            primitive["material"] = json!(i);
            primitive
        })
        .collect();
    file["textures"] = json!([{"source": 0}]);
    file["images"] = json!([{"uri": picture(&texels)}]);
    let scene = load_document("many-levels", &file).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.shapes.len(), 8);
    assert!((1 << 15..1 << 16).contains(&scene.materials.len()), "{}", scene.materials.len());
    assert_eq!(scene.notes.iter().filter(|note| note.contains("of the rest of them the mean counts")).count(), 1);
}

/// Of a surface that varies the albedo is that of the levels around its mean, not of its first.
#[test]
fn the_albedo_of_what_varies_is_that_of_its_mean() {
    let (mut scene, _) = of_material("albedo", json!({}), &[WHITE]);
    let paint = |v: f64| Material::Diffuse { reflectance: Spectrum::Constant(v).into() };
    let first = scene.materials.len();
    scene.materials.extend([paint(0.2), paint(0.4), paint(0.8)]);
    let materials = vec![first, first + 2, first + 1];
    scene.materials.push(Material::Graded { materials, levels: 4..7, roughness: Spectrum::Constant(5.25 / 16.0).into() });
    near(scene.albedo(first + 3, 550.0)[0], 0.75 * 0.8 + 0.25 * 0.4);
}
