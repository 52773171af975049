//! glTF files: as scenes by themselves and as parts of scenes.

use crate::{folder, load_text, scene_with};
use abbe::scene::{Geometry, Light, LoadOptions, Material, Scene, Sensor, Texture, load};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Base64 without padding.
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let four = |c: &[u8]| {
        let word = c.iter().enumerate().fold(0u32, |w, (i, b)| w | u32::from(*b) << (16 - 8 * i));
        (0..=c.len()).map(move |i| DIGITS[(word >> (18 - 6 * i) & 63) as usize] as char).collect::<String>()
    };
    bytes.chunks(3).map(four).collect()
}

/// Two triangles: positions as floats and indices as bytes, in a data URI.
pub fn document() -> Value {
    let mut bytes: Vec<u8> = [0.0f32, 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.].iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend([0u8, 1, 2, 0, 2, 3]);
    let base64 = base64(&bytes);
    json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 2, 3]}],
        "nodes": [
            {"translation": [0, 0, -1], "children": [1]},
            {"mesh": 0, "scale": [2, 2, -2]},
            {"camera": 0, "translation": [0, 0, 5]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [-0.5f64.sqrt(), 0, 0, 0.5f64.sqrt()]}],
        "meshes": [{"name": "square", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{
            "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
            "emissiveFactor": [1, 1, 1],
            "extensions": {
                "KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_ior": {"ior": 1.5168},
                "KHR_materials_dispersion": {"dispersion": 20.0 / 64.17},
                "KHR_materials_volume": {"thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 0.5], "attenuationDistance": 2},
                "KHR_materials_emissive_strength": {"emissiveStrength": 100}}}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 10, "color": [1, 1, 1]}]}},
        "buffers": [{"byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{base64}")}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 6}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"}],
    })
}

pub fn load_document(name: &str, document: &Value) -> abbe::Result<Scene> {
    let path: PathBuf = std::env::temp_dir().join(format!("abbe-{name}-{}.gltf", std::process::id()));
    std::fs::write(&path, document.to_string()).unwrap();
    let scene = load(&path, &LoadOptions::default());
    std::fs::remove_file(&path).unwrap();
    scene
}

#[test]
fn a_gltf_file_is_a_scene_by_itself() {
    let scene = load_document("itself", &document()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.notes, Vec::<String>::new());
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
    assert_eq!(mesh.positions[2], DVec3::new(2.0, 2.0, -1.0));
    assert_eq!(mesh.triangles, [[0, 2, 1], [0, 3, 2]], "mirrored, so turned");
    let Material::Dielectric { interior, alpha, .. } = scene.materials[scene.shapes[0].material] else { panic!("not glass") };
    assert_eq!(alpha, 0.0);
    let glass = &scene.interiors[interior];
    assert!(
        (glass.ior.nd() - 1.5168).abs() < 1e-6 && (glass.ior.vd() - 64.17).abs() < 0.2,
        "{} {}",
        glass.ior.nd(),
        glass.ior.vd()
    );
    assert!((glass.sigma_a.eval(550.0) - 2f64.ln() / 2.0).abs() < 1e-9);
    let Texture::Uniform(emission) = &scene.shapes[0].emission.as_ref().unwrap().radiance else { panic!("a picture") };
    let luminance = abbe::color::cie::xyz_of(emission, abbe::spectrum::library::Observer::Cie1931)[1];
    assert!((luminance - 100.0).abs() < 0.1, "{luminance}");
    let Sensor::Perspective { eye, tan_half_vfov, .. } = scene.sensor else { panic!("wrong sensor") };
    assert_eq!(eye, DVec3::new(0.0, 0.0, 5.0));
    assert!((tan_half_vfov - 0.5f64.tan()).abs() < 1e-12);
    let Light::Sun { direction, .. } = scene.lights[0] else { panic!("not a sun") };
    assert!((direction - DVec3::NEG_Y).length() < 1e-12, "{direction}");
}

#[test]
fn without_camera_and_light_it_is_framed_in_daylight_and_says_so() {
    let mut bare = document();
    bare["scenes"][0]["nodes"] = json!([0]);
    bare["materials"][0] = json!({"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.2, 0.2, 0.2, 1]}});
    let scene = load_document("bare", &bare).unwrap_or_else(|e| panic!("{e}"));
    assert!(matches!(scene.lights[..], [Light::Constant { .. }]));
    let Sensor::Perspective { eye, frame, tan_half_vfov, .. } = scene.sensor else { panic!("wrong sensor") };
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
    for p in &mesh.positions {
        let v = frame.transpose() * (*p - eye);
        assert!(v.z < 0.0 && v.x.abs().max(v.y.abs()) < -v.z * tan_half_vfov, "{p} is not seen");
    }
    for fragment in ["no camera", "no light"] {
        assert!(scene.notes.iter().any(|n| n.contains(fragment)), "{fragment}: {:?}", scene.notes);
    }
    let Material::Coated { base, ior, alpha, seen, .. } = &scene.materials[scene.shapes[0].material] else {
        panic!("not glossy")
    };
    assert_eq!((ior.eval(550.0), *alpha, *seen), (1.5, 1.0, true));
    let Material::Diffuse { reflectance } = &scene.materials[*base] else { panic!("not diffuse") };
    // glTF's colours are those that are seen.
    assert!((reflectance.average(500.0) - 0.2).abs() < 1e-4);
}

/// The square with this base colour, roughness and extensions; returns the scene and the index of its material.
fn of_material(name: &str, base: [f64; 3], roughness: f64, extensions: Value) -> (Scene, usize) {
    let mut file = document();
    let [r, g, b] = base;
    file["materials"][0] = json!({
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": roughness, "baseColorFactor": [r, g, b, 1]},
        "extensions": extensions,
    });
    let scene = load_document(name, &file).unwrap_or_else(|e| panic!("{e}"));
    let material = scene.shapes[0].material;
    (scene, material)
}

fn assert_colour(spectrum: impl Fn(f64) -> f64, rgb: [f64; 3]) {
    let colour = abbe::color::upsample::color_of_reflectance(spectrum);
    assert!(colour.iter().zip(rgb).all(|(a, b)| (a - b).abs() < 3e-3), "{colour:?}, not {rgb:?}");
}

#[test]
fn gltf_glass_is_tinted_by_its_base_colour_and_thin_glass_blurred_by_its_roughness() {
    let transmission = json!({"KHR_materials_transmission": {"transmissionFactor": 1}});
    let (thin, m) = of_material("tint-thin", [0.2, 0.6, 0.9], 0.5, transmission.clone());
    let Material::ThinDielectric { alpha, tint: Some(tint), .. } = &thin.materials[m] else { panic!("no tinted pane") };
    assert_eq!(*alpha, 0.25);
    assert_colour(|nm| tint.average(nm), [0.2, 0.6, 0.9]);
    let mut volume = transmission.clone();
    volume["KHR_materials_volume"] = json!({"thicknessFactor": 1});
    let (solid, m) = of_material("tint-solid", [0.2, 0.6, 0.9], 0.5, volume);
    let Material::Dielectric { alpha: 0.25, tint: Some(tint), .. } = &solid.materials[m] else { panic!("no tinted solid") };
    assert_colour(|nm| tint.average(nm), [0.2, 0.6, 0.9]);
    let (clear, m) = of_material("tint-none", [1.0; 3], 0.0, transmission);
    assert!(matches!(clear.materials[m], Material::ThinDielectric { alpha: 0.0, tint: None, .. }));
}

#[test]
fn gltf_gloss_has_its_colour_and_any_index() {
    let base = [0.1; 3];
    let f0 = |n: f64| ((n - 1.0) / (n + 1.0)).powi(2);
    let (coloured, m) =
        of_material("gloss-colour", base, 0.0, json!({"KHR_materials_specular": {"specularColorFactor": [5, 2, 1]}}));
    // The spectrum of that colour goes beyond a quarter in the deep red.
    let Material::Mix { b, weight, .. } = &coloured.materials[m] else { panic!("no mixture") };
    let Material::Coated { ior, .. } = &coloured.materials[*b] else { panic!("no gloss") };
    let share = |nm: f64| weight.average(nm);
    assert_colour(|nm| share(nm) + (1.0 - share(nm)) * f0(ior.eval(nm)), [0.2, 0.08, 0.04]);
    // A coat reflects a quarter at most; a mirror reflects the rest.
    let (dense, m) = of_material("gloss-dense", base, 0.0, json!({"KHR_materials_ior": {"ior": 5}}));
    let Material::Mix { a, b, weight } = &dense.materials[m] else { panic!("no mixture") };
    assert!((weight.average(550.0) - (f0(5.0) - 0.25) / 0.75).abs() < 1e-9);
    assert!(matches!(dense.materials[*a], Material::ColoredConductor { .. }));
    assert!(matches!(&dense.materials[*b], Material::Coated { ior, .. } if (ior.eval(550.0) - 3.0).abs() < 1e-9));
    let (infinite, m) = of_material("gloss-infinite", base, 0.0, json!({"KHR_materials_ior": {"ior": 0}}));
    let Material::ColoredConductor { reflectance, .. } = &infinite.materials[m] else { panic!("no mirror") };
    assert_eq!(reflectance.average(550.0), 1.0);
    let (none, m) = of_material("gloss-none", base, 0.0, json!({"KHR_materials_ior": {"ior": 1}}));
    assert!(matches!(none.materials[m], Material::Diffuse { .. }));
}

#[test]
fn gltf_diffuse_transmission_is_a_share_of_its_paint() {
    let extension = json!({"diffuseTransmissionFactor": 0.25, "diffuseTransmissionColorFactor": [0.9, 0.5, 0.1]});
    let (scene, m) = of_material("through", [0.5; 3], 0.3, json!({"KHR_materials_diffuse_transmission": extension}));
    let Material::Coated { base, .. } = scene.materials[m] else { panic!("no gloss") };
    let Material::Mix { a, b, weight } = &scene.materials[base] else { panic!("no mixture") };
    assert_eq!(weight.average(550.0), 0.25);
    let Material::DiffuseTransmission { transmittance } = &scene.materials[*a] else { panic!("nothing gets through") };
    assert_colour(|nm| transmittance.average(nm), [0.9, 0.5, 0.1]);
    assert!(matches!(scene.materials[*b], Material::Diffuse { .. }));
    assert!(!scene.notes.iter().any(|note| note.contains("transmission")), "{:?}", scene.notes);
}

#[test]
fn damaged_gltf_files_are_errors_with_their_place() {
    let broken: &[(&str, Value, &str, &str)] = &[
        ("/asset/version", json!("1.0"), "$.asset.version", "glTF 2"),
        ("/buffers/0/uri", json!("data:;base64,!!!"), "$.buffers[0].uri", "base64"),
        ("/buffers/0/uri", json!("../../etc/passwd"), "$.buffers[0].uri", "--allow-outside"),
        ("/buffers/0/byteLength", json!(1000), "$.buffers[0]", "instead of 1000"),
        ("/bufferViews/0/byteLength", json!(4_000_000_000u32), "$.bufferViews[0]", "beyond its buffer"),
        ("/accessors/0/count", json!(5), "$.accessors[0]", "beyond its buffer"),
        ("/accessors/0/count", json!(4_294_967_295u32), "$.accessors[0]", "beyond its buffer"),
        ("/accessors/0/type", json!("VEC2"), "$.accessors[0].type", "VEC3 is needed"),
        ("/accessors/0/componentType", json!(1), "$.accessors[0].componentType", "unknown component"),
        ("/accessors/1/bufferView", json!(9), "$.accessors[1].bufferView", "no element 9"),
        ("/nodes/1/mesh", json!(-1), "$.nodes[1].mesh", "whole number"),
        ("/nodes/1/mesh", json!(3), "$.nodes[1].mesh", "no element 3"),
        ("/nodes/0/children/0", json!(0), "$.nodes[0].children[0]", "reached twice"),
        ("/nodes/1/rotation", json!(["x", 0, 0, 1]), "$.nodes[1].rotation[0]", "invalid type"),
        ("/nodes/3/extensions", json!(3), "$.nodes[3].extensions", "expected an object"),
        ("/bufferViews/0/byteStride", json!(8), "$.bufferViews[0]", "12 bytes every 8"),
        ("/accessors/0/count", json!(0), "$.accessors[0].count", "from 1"),
        ("/meshes/0/primitives/0/mode", json!(7), "$.meshes[0].primitives[0].mode", "from 0 to 6"),
        ("/meshes/0/primitives/0/indices", json!(0), "$.accessors[0].type", "SCALAR is needed"),
        ("/asset/minVersion", json!("2.1"), "$.asset.minVersion", "newer reader"),
        ("/buffers/0/uri", json!("https://host/a.bin"), "$.buffers[0].uri", "scheme \"https\""),
        ("/cameras/0/perspective/yfov", json!(4), "$.cameras[0].perspective.yfov", "3.13"),
    ];
    for (pointer, value, path, fragment) in broken {
        let mut document = document();
        let (place, key) = pointer.rsplit_once('/').unwrap();
        match document.pointer_mut(place).unwrap() {
            Value::Object(map) => drop(map.insert(key.into(), value.clone())),
            other => other[key.parse::<usize>().unwrap()] = value.clone(),
        }
        let line = load_document("broken", &document).expect_err(pointer).to_string();
        assert!(line.contains(&format!("{path}: ")) && line.contains(fragment), "{pointer}: {line}");
    }
    for (extension, fragment) in [
        ("KHR_texture_basisu", "pictures in KTX2, which cannot be read; export its pictures as PNG or JPEG"),
        ("EXT_texture_avif", "export its pictures as PNG or JPEG"),
        ("VENDOR_unheard_of", "export it without"),
    ] {
        let mut required = document();
        required["extensionsRequired"] = json!([extension]);
        let line = load_document("required", &required).unwrap_err().to_string();
        assert!(line.contains("$.extensionsRequired[0]: ") && line.contains(extension) && line.contains(fragment), "{line}");
    }
}

#[test]
fn a_glb_is_bare_geometry_or_a_part_with_its_own_materials() {
    let bunny = |shape: &str| {
        let text = scene_with("shapes", shape);
        abbe::scene::load_str(&text, "t.json".as_ref(), &folder("scenes"), &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{e}"))
    };
    for shape in [r#"[{"mesh": {"file": "bunny.glb"}, "material": "m"}]"#, r#"[{"gltf": {"file": "bunny.glb"}}]"#] {
        let scene = bunny(shape);
        let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (1839, 3674));
    }
    assert_eq!(bunny(r#"[{"gltf": {"file": "bunny.glb"}}]"#).materials.len(), 2);
    assert!(load_text(&scene_with("camera", "null")).is_err());
}

#[test]
fn what_was_set_in_blender_comes_through() {
    // tools/make-blender-scene.py says what was set.
    let scene = load(&folder("tests/data/scenes/blender.glb"), &LoadOptions::default()).unwrap();
    let shape = |n: usize| &scene.shapes[n];
    let Material::Dielectric { interior, alpha, .. } = scene.materials[shape(0).material] else { panic!("not solid glass") };
    let glass = &scene.interiors[interior];
    assert_eq!((alpha, glass.name.as_str()), (0.0, "Glass"));
    assert!((glass.ior.nd() - 1.6).abs() < 1e-6 && (glass.ior.vd() - 40.0).abs() < 0.2, "{} {}", glass.ior.nd(), glass.ior.vd());
    // A density of 2 lets the colour through over half a metre.
    let through = abbe::color::upsample::color_of_reflectance(|nm| (-0.5 * glass.sigma_a.eval(nm)).exp());
    assert!(through.iter().zip([0.5, 0.9, 0.7]).all(|(a, b)| (a - b).abs() < 3e-3), "{through:?}");
    let Material::Coated { base, .. } = scene.materials[shape(1).material] else { panic!("not glossy") };
    let Material::Diffuse { reflectance } = &scene.materials[base] else { panic!("not diffuse") };
    let picture = reflectance.image().expect("a picture");
    assert_eq!((picture.image.width, picture.image.height, picture.to_image), (4, 4, [[3.0, 0.0, 0.0], [0.0, 3.0, -2.0]]));
    let lamp = shape(2).emission.as_ref().expect("a lamp");
    let Texture::Uniform(radiance) = &lamp.radiance else { panic!("a picture") };
    let luminance = abbe::color::cie::xyz_of(radiance, abbe::spectrum::library::Observer::Cie1931)[1];
    assert!((luminance - 20.0 * (0.2126 + 0.8 * 0.7152 + 0.5 * 0.0722)).abs() < 0.05, "{luminance}");
    assert!(
        matches!(scene.materials[shape(3).material], Material::ColoredConductor { alpha, .. } if (alpha - 0.04).abs() < 1e-6)
    );
    assert!(matches!(scene.lights[..], [Light::Spot { .. }, Light::Sun { .. }]));
    // Blender's Z is up; here it is Y. The camera stood 4 m in front, 1.5 m high, for pictures of 16:9.
    let Sensor::Perspective { eye, .. } = scene.sensor else { panic!("not a camera") };
    assert!((eye - DVec3::new(0.0, 1.5, 4.0)).length() < 1e-6, "{eye}");
    assert_eq!((scene.film.width, scene.film.height), (910, 512));
}

#[test]
fn custom_properties_name_a_glass() {
    let mut named = document();
    named["materials"][0]["extras"] = json!({"glass": "N-BK7"});
    let scene = load_document("named", &named).unwrap();
    let Material::Dielectric { interior, .. } = scene.materials[scene.shapes[0].material] else { panic!("not glass") };
    assert!((scene.interiors[interior].ior.eval(486.13) - 1.522376).abs() < 1e-5);
    named["materials"][0]["extras"] = json!({"glass": "N-BK8"});
    let line = load_document("misnamed", &named).unwrap_err().to_string();
    assert!(line.contains("$.materials[0].extras.glass") && line.contains("did you mean"), "{line}");
}

#[test]
fn what_is_ignored_is_said_once_in_words() {
    let mut lossy = document();
    lossy["extensionsUsed"] = json!(["KHR_materials_variants", "KHR_materials_ior"]);
    lossy["materials"][0]["occlusionTexture"] = json!({"index": 0});
    lossy["extensions"]["KHR_lights_punctual"]["lights"][0]["range"] = json!(5);
    let notes = load_document("lossy", &lossy).unwrap().notes;
    assert_eq!(notes.len(), 3, "{notes:?}");
    for fragment in ["first look counts: ignored (\"KHR_materials_variants\")", "occlusion", "ranges of lights"] {
        assert_eq!(notes.iter().filter(|n| n.contains(fragment)).count(), 1, "{fragment}: {notes:?}");
    }
}

#[test]
fn what_merely_glows_does_so_in_daylight_and_what_is_stronger_is_a_lamp() {
    let emissive = |strength: f64| {
        let mut glow = document();
        glow["scenes"][0]["nodes"] = json!([0, 2]);
        glow["materials"][0] = json!({"emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}});
        load_document(&format!("glow-{strength}"), &glow).unwrap()
    };
    let glow = emissive(1.0);
    let [Light::Constant { radiance: sky }] = &glow.lights[..] else { panic!("{:?}", glow.lights) };
    let Texture::Uniform(own) = &glow.shapes[0].emission.as_ref().unwrap().radiance else { panic!("a picture") };
    // White of emissive factor 1 is as bright as the sky, as in viewers.
    assert!((sky.eval(550.0) / own.eval(550.0) - 1.0).abs() < 1e-9);
    assert!(glow.notes.iter().any(|n| n.contains("emissive strength above 1")), "{:?}", glow.notes);
    assert!(emissive(2.0).lights.is_empty());
}

#[test]
fn sparse_accessors_replace_what_they_name() {
    let mut sparse = document();
    let moved: Vec<u8> = [7.0f32, 8., 9.].iter().flat_map(|v| v.to_le_bytes()).chain([2]).collect();
    sparse["buffers"]
        .as_array_mut()
        .unwrap()
        .push(json!({"byteLength": moved.len(), "uri": format!("data:;base64,{}", base64(&moved))}));
    let views = sparse["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 1, "byteLength": 12}));
    views.push(json!({"buffer": 1, "byteOffset": 12, "byteLength": 1}));
    // 224, the third byte of 7.
    views.push(json!({"buffer": 1, "byteOffset": 2, "byteLength": 1}));
    sparse["accessors"][0]["sparse"] =
        json!({"count": 1, "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 2}});
    let scene = load_document("sparse", &sparse).unwrap();
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
    assert_eq!((mesh.positions[2], mesh.positions[1]), (DVec3::new(14.0, 16.0, -19.0), DVec3::new(2.0, 0.0, -1.0)));
    for (pointer, value, says) in [
        ("/indices/bufferView", json!(4), "there is no element 224"),
        ("/count", json!(1000), "beyond its buffer"),
        ("/values/bufferView", json!(9), "no element 9"),
    ] {
        let mut broken = sparse.clone();
        *broken.pointer_mut(&format!("/accessors/0/sparse{pointer}")).unwrap() = value;
        let line = load_document("broken-sparse", &broken).unwrap_err().to_string();
        assert!(line.contains("$.accessors[0].sparse") && line.contains(says), "{line}");
    }
}

/// The scene with `document` in it, of whose lights it says this.
fn relit(document: &Value, lights: Value) -> abbe::Result<Scene> {
    let here = std::env::temp_dir().join(format!("abbe-relit-{:?}-{}", std::thread::current().id(), std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    std::fs::write(here.join("t.gltf"), document.to_string()).unwrap();
    std::fs::write(here.join("red.spd"), "600 0\n610 1\n620 0\n").unwrap();
    std::fs::copy(folder("tests/data/scenes/lamp.ies"), here.join("lamp.ies")).unwrap();
    let text = json!({"shapes": [{"gltf": {"file": "t.gltf", "lights": lights}}]});
    let scene = abbe::scene::load_str(&text.to_string(), "t.json".as_ref(), &here, &LoadOptions::default());
    std::fs::remove_dir_all(&here).unwrap();
    scene
}

#[test]
fn lights_of_a_gltf_file_take_measured_spectra_and_profiles_by_name() {
    let luminous = |s: &abbe::spectrum::Spectrum| abbe::color::cie::xyz_of(s, abbe::spectrum::library::Observer::Cie1931)[1];
    let mut file = document();
    file["nodes"][3]["name"] = json!("Key");
    file["extensions"]["KHR_lights_punctual"]["lights"] =
        json!([{"name": "Area.001", "type": "spot", "intensity": 12, "color": [1, 1, 1]}]);
    let red = json!({"spectrum": {"file": "red.spd"}});
    for name in ["Key", "Area.001"] {
        let scene = relit(&file, json!({name: {"intensity": red}})).unwrap_or_else(|e| panic!("{e}"));
        let Light::Spot { intensity, direction, .. } = &scene.lights[0] else { panic!("{:?}", scene.lights) };
        assert!((luminous(intensity) - 12.0).abs() < 0.01 && intensity.eval(550.0) == 0.0, "the candela of the file");
        assert!((*direction - DVec3::NEG_Y).length() < 1e-12);
    }
    let measured = relit(&file, json!({"Key": {"profile": "lamp.ies", "intensity": red}})).unwrap();
    let own = crate::load_text(&crate::scene_with(
        "lights",
        r#"[{"spot": {"position": [0, 0, 0], "direction": [0, -1, 0], "profile": "lamp.ies"}}]"#,
    ));
    let own = own.unwrap();
    let [Light::Profile { intensity, profile, axes, .. }, Light::Profile { intensity: white, profile: same, .. }] =
        [&measured.lights[0], &own.lights[0]]
    else {
        panic!("{:?}", measured.lights)
    };
    assert!(*profile == *same && (luminous(intensity) / luminous(white) - 1.0).abs() < 1e-3 && intensity.eval(550.0) == 0.0);
    assert!((axes.z_axis - DVec3::NEG_Y).length() < 1e-12);
    let bright = json!({"spectrum": {"file": "red.spd"}, "luminous_intensity_cd": 3});
    let scene = relit(&file, json!({"Key": {"intensity": bright}})).unwrap();
    let Light::Spot { intensity, .. } = &scene.lights[0] else { panic!("{:?}", scene.lights) };
    assert!((luminous(intensity) - 3.0).abs() < 0.01);
    let sun = relit(&document(), json!({})).unwrap();
    assert!(matches!(sun.lights[..], [Light::Sun { .. }]));
    for (file, lights, says) in [
        (&file, json!({"Kee": {"intensity": red}}), "no light \"Kee\"; did you mean \"Key\"?"),
        (&file, json!({"Key": {"irradiance": red}}), "kind \"spot\""),
        (&file, json!({"Key": {"intensty": red}}), "did you mean \"intensity\"?"),
    ] {
        let line = relit(file, lights).unwrap_err().to_string();
        assert!(line.contains("$.shapes[0].gltf.lights") && line.contains(says), "{line}");
    }
}
