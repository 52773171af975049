//! glTF files that are valid, or nearly: they are read, and what is left out is said.

use crate::folder;
use crate::gltf::{base64, document, load_document};
use abbe::scene::{Falloff, Geometry, Light, LoadOptions, Material, Mesh, Scene, Sensor, load};
use glam::{DVec3, dvec3};
use serde_json::{Value, json};

fn mesh(scene: &Scene, shape: usize) -> &Mesh {
    let Geometry::Mesh(mesh) = &scene.shapes[shape].geometry else { panic!("not a mesh") };
    mesh
}

fn changed(changes: &[(&str, &str, Value)]) -> Value {
    let mut document = document();
    for (place, key, value) in changes {
        document
            .pointer_mut(place)
            .unwrap_or_else(|| panic!("{place}"))
            .as_object_mut()
            .unwrap()
            .insert((*key).into(), value.clone());
    }
    document
}

fn read(name: &str, document: &Value) -> Scene {
    load_document(name, document).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A second node with a second mesh of these positions beside the square.
fn beside(positions: &[[f32; 3]], indices: &[u8]) -> Value {
    let mut document = document();
    let bytes: Vec<u8> = positions.iter().flatten().flat_map(|v| v.to_le_bytes()).chain(indices.iter().copied()).collect();
    let length = 12 * positions.len();
    let mut push = |list: &str, value: Value| document[list].as_array_mut().unwrap().push(value);
    push("buffers", json!({"byteLength": bytes.len(), "uri": format!("data:;base64,{}", base64(&bytes))}));
    push("bufferViews", json!({"buffer": 1, "byteLength": length}));
    push("bufferViews", json!({"buffer": 1, "byteOffset": length, "byteLength": indices.len()}));
    push("accessors", json!({"bufferView": 2, "componentType": 5126, "count": positions.len(), "type": "VEC3"}));
    push("accessors", json!({"bufferView": 3, "componentType": 5121, "count": indices.len(), "type": "SCALAR"}));
    push("meshes", json!({"primitives": [{"attributes": {"POSITION": 2}, "indices": 3}]}));
    push("nodes", json!({"mesh": 1}));
    document["scenes"][0]["nodes"] = json!([0, 2, 3, 4]);
    document
}

#[test]
fn what_has_no_size_is_left_out_and_said() {
    let flat = |scale: Value| {
        let mut document = beside(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[0, 1, 2]);
        document["nodes"][4]["scale"] = scale;
        document
    };
    let line = beside(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], &[0, 1, 2]);
    for (name, document, says) in [
        ("zero", flat(json!([0, 0, 0])), "scaled to nothing"),
        ("flat", flat(json!([1, 1, 0])), "scaled to nothing, or flat"),
        ("line", line, "1 triangles of no area"),
    ] {
        let scene = read(name, &document);
        assert_eq!(scene.shapes.len(), 1, "{name}");
        assert!(scene.notes.iter().any(|n| n.contains(says)), "{name}: {:?}", scene.notes);
    }
}

#[test]
fn vertices_that_no_triangle_uses_may_be_anywhere() {
    for far in [1e20, f32::NAN, f32::INFINITY] {
        let scene = read("far", &beside(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [far; 3]], &[0, 1, 2]));
        assert_eq!((scene.shapes.len(), mesh(&scene, 1).triangles.len()), (2, 1));
        let used = load_document("used", &beside(&[[0.0; 3], [1.0, 0.0, 0.0], [far; 3]], &[0, 1, 2])).unwrap_err().to_string();
        assert!(used.contains("$.meshes[1].primitives[0]: vertex 2"), "{used}");
    }
}

#[test]
fn an_accessor_without_a_view_is_zeros() {
    let mut zeros = document();
    zeros["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let line = load_document("zeros", &zeros).unwrap_err().to_string();
    assert!(line.contains("no triangles in its scene"), "{line}");
    zeros["accessors"][0]["count"] = json!(2_000_000);
    let line = load_document("many-zeros", &zeros).unwrap_err().to_string();
    assert!(line.contains("$.accessors[0]: an accessor of 2000000 zeros"), "{line}");
}

#[test]
fn nodes_nest_as_deep_as_they_like() {
    let mut deep = document();
    let first = deep["nodes"].as_array().unwrap().len();
    for i in 0..5000 {
        deep["nodes"].as_array_mut().unwrap().push(json!({"translation": [0.5, 0, 0], "children": [first + i + 1]}));
    }
    deep["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0}));
    deep["scenes"][0]["nodes"] = json!([first, 2, 3]);
    assert_eq!(mesh(&read("deep", &deep), 0).positions[0], dvec3(2500.0, 0.0, 0.0));
}

#[test]
fn extensions_that_change_nothing_of_a_still_may_be_required() {
    for name in [
        "KHR_animation_pointer",
        "KHR_materials_variants",
        "KHR_xmp_json_ld",
        "MSFT_lod",
        "KHR_node_visibility",
        "KHR_mesh_quantization",
    ] {
        let required = changed(&[("", "extensionsRequired", json!([name])), ("", "extensionsUsed", json!([name]))]);
        assert_eq!(read(name, &required).shapes.len(), 1);
    }
    // What cannot be read is told before the buffers that it fills are looked for.
    let packed = changed(&[
        ("", "extensionsRequired", json!(["KHR_texture_basisu"])),
        ("", "buffers", json!([{"byteLength": 54}, {"byteLength": 54}])),
    ]);
    let line = load_document("packed", &packed).unwrap_err().to_string();
    assert!(line.contains("$.extensionsRequired[0]: ") && line.contains("KTX2"), "{line}");
}

#[test]
fn numbers_a_rounding_beyond_their_range_are_the_nearest_and_others_are_said() {
    let of = |name: &str, material: Value| {
        let scene = read(name, &changed(&[("", "materials", json!([material]))]));
        let said = scene.notes.join("\n");
        (format!("{:?}", scene.materials), format!("{:?}", scene.shapes[0].emission), said)
    };
    let (exact, _, silent) = of("exact", json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 0, 1], "metallicFactor": 0}}));
    let rounded = json!({"pbrMetallicRoughness": {"baseColorFactor": [1.0000001, 1.0000002384, -1e-9, 1.0000001], "metallicFactor": -1e-9}});
    assert_eq!(of("rounded", rounded), (exact.clone(), "None".into(), silent));
    let (clamped, _, said) =
        of("clamped", json!({"pbrMetallicRoughness": {"baseColorFactor": [2, 1, 0, 1], "metallicFactor": 0}}));
    assert!(clamped == exact && said.contains("baseColorFactor: 2 is beyond 0 to 1"), "{said}");
    let (_, bright, said) = of("bright", json!({"emissiveFactor": [2, 2, 2]}));
    let (_, strong, _) = of(
        "strong",
        json!({"emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2}}}),
    );
    assert!(bright == strong && said.contains("emissiveFactor: a factor above 1"), "{said}");
}

#[test]
fn an_index_of_zero_reflects_everything() {
    let black = |ior: f64| {
        let material = json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0, "roughnessFactor": 0},
            "extensions": {"KHR_materials_ior": {"ior": ior}}});
        let scene = read(&format!("ior-{ior}"), &changed(&[("", "materials", json!([material]))]));
        let material = scene.shapes[0].material;
        (scene.materials[material].clone(), scene)
    };
    for ior in [0.0, 1e6] {
        let (Material::ColoredConductor { reflectance, alpha: 0.0 }, _) = black(ior) else { panic!("not a mirror") };
        assert_eq!(reflectance.average(550.0), 1.0);
    }
    // As much as an index of 100 reflects at normal incidence: by a coat of 3 and a mirror.
    let (Material::Mix { a, b, weight }, scene) = black(100.0) else { panic!("no mixture") };
    let Material::Coated { ior, .. } = &scene.materials[b] else { panic!("no coat") };
    assert!(matches!(scene.materials[a], Material::ColoredConductor { .. }));
    let (mirror, coat) = (weight.average(550.0), ((ior.eval(550.0) - 1.0) / (ior.eval(550.0) + 1.0)).powi(2));
    assert!((mirror + (1.0 - mirror) * coat - (99.0f64 / 101.0).powi(2)).abs() < 1e-3, "{mirror} {coat}");
    let (material, scene) = black(0.5);
    assert!(
        matches!(material, Material::Diffuse { .. }) && scene.notes.iter().any(|n| n.contains("an index of 0.5 counts as 1"))
    );
}

#[test]
fn a_primitive_without_a_material_is_what_an_empty_material_is() {
    let mut bare = document();
    bare["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    let empty = changed(&[("", "materials", json!([{}]))]);
    let of = |name: &str, document: &Value| {
        let scene = read(name, document);
        format!("{:?}", scene.materials[scene.shapes[0].material])
    };
    assert_eq!(of("bare", &bare), of("empty", &empty));
}

#[test]
fn spots_fall_as_a_square_and_may_have_a_hard_edge() {
    let spot = |inner: f64, outer: f64| {
        let lights = json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {"innerConeAngle": inner, "outerConeAngle": outer}}]}});
        let Light::Spot { cos_inner, cos_outer, falloff, .. } =
            read("spot", &changed(&[("", "extensions", lights)])).lights[0].clone()
        else {
            panic!("not a spot")
        };
        assert_eq!(falloff, Falloff::Squared);
        (cos_inner, cos_outer)
    };
    assert_eq!(spot(0.0, 0.8), (1.0, 0.8f64.cos()));
    for (inner, outer) in [(0.5, 0.5), (0.6, 0.5)] {
        let (cos_inner, cos_outer) = spot(inner, outer);
        assert!(cos_inner as f32 > cos_outer as f32 && cos_inner - cos_outer < 2e-6);
    }
    assert_eq!([0.5, 0.25].map(|x| Falloff::Squared.at(x)), [0.25, 0.0625]);
}

#[test]
fn an_orthographic_camera_gives_the_shape_of_the_picture() {
    for (xmag, ymag) in [(2.0, 1.0), (-2.0, -1.0)] {
        let cameras = json!([{"type": "orthographic", "orthographic": {"xmag": xmag, "ymag": ymag, "znear": 0.1, "zfar": 10}}]);
        let scene = read("orthographic", &changed(&[("", "cameras", cameras)]));
        assert!(matches!(scene.sensor, Sensor::Orthographic { height: 2.0, .. }));
        assert_eq!((scene.film.width, scene.film.height), (1024, 512));
    }
}

/// Every part of glTF in one file; what it shows is worked out by hand.
#[test]
fn meshes_stand_in_the_pose_and_the_places_that_the_file_gives_them() {
    let scene = load(&folder("tests/data/scenes/everything.gltf"), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let shapes = |name: &str| -> Vec<usize> { (0..scene.shapes.len()).filter(|i| scene.shapes[*i].name == name).collect() };
    let corners =
        |shape: usize| -> Vec<DVec3> { mesh(&scene, shape).positions.iter().map(|p| (p * 1e6).round() / 1e6).collect() };
    // The one that is not hidden.
    assert_eq!(shapes("painted").len(), 1);
    // A target of weight 1 lifts the second and the fourth corner by 1, where the node turns x to y and doubles it.
    assert_eq!(corners(shapes("morphed")[0])[1], dvec3(2.0, 1.0, 1.0));
    assert_eq!(corners(shapes("morphed")[0])[0], dvec3(2.0, 0.0, 0.0));
    // Half of a joint at (0, -1, 0) and half of one at (0, -2, 1), wherever the node of the mesh is.
    assert_eq!(corners(shapes("skinned")[0])[2], dvec3(1.0, -0.5, 0.5));
    // Two copies of a quantised square, three metres up, the second half as large and a quarter turned.
    let [first, second] = shapes("copied")[..] else { panic!("{:?}", shapes("copied")) };
    assert_eq!((corners(first)[2], corners(second)[2]), (dvec3(1.0, 4.0, 0.0), dvec3(1.5, 3.5, 0.0)));
    for says in ["hidden", "points and lines", "animations"] {
        assert_eq!(scene.notes.iter().filter(|n| n.contains(says)).count(), 1, "{says}: {:?}", scene.notes);
    }
}

#[test]
fn pictures_lie_on_two_sets_of_coordinates_and_colours_of_vertices_tint() {
    let scene = load(&folder("tests/data/scenes/everything.gltf"), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let shape = scene.shapes.iter().find(|s| s.name == "painted").expect("a shape");
    let Geometry::Mesh(mesh) = &shape.geometry else { panic!("not a mesh") };
    // The second set was written in whole numbers, and upside down.
    assert!(mesh.uvs.iter().zip(&mesh.more_uvs).all(|(a, b)| (a.x - b.x).abs() < 1e-6 && (a.y - 1.0 + b.y).abs() < 1e-6));
    let lamp = shape.emission.as_ref().and_then(|e| e.radiance.image()).expect("a picture");
    assert!(lamp.set == 1 && !lamp.tinted);
    let painted = scene.made_of(shape.material).into_iter().find_map(|m| match &scene.materials[m] {
        Material::Diffuse { reflectance } => reflectance.image().cloned(),
        _ => None,
    });
    let painted = painted.expect("a picture");
    assert!(painted.set == 0 && painted.tinted);
    // Between red, green and blue, spectra are what is interpolated.
    let texture = abbe::scene::Texture::Image(painted);
    let alone = |vertex: usize| texture.eval(650.0, mesh.coordinates(0, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][vertex]));
    let mut middle = mesh.coordinates(0, [1.0 / 3.0; 2]);
    let tint = |at: abbe::geometry::Coordinates| {
        texture.eval(650.0, at) / {
            let mut white = at;
            white.colors = [[0.0, 0.0, 0.0, 2.0]; 3];
            texture.eval(650.0, white)
        }
    };
    middle.uv = mesh.coordinates(0, [0.0; 2]).uv;
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|corner| tint(mesh.coordinates(0, corner)));
    assert!(alone(0) > 0.0 && (tint(middle) - corners.iter().sum::<f64>() / 3.0).abs() < 1e-9, "{corners:?}");
    assert!(corners[0] > 0.9 && corners[1] < 0.2 && corners[2] < 0.2, "red alone is bright at 650 nm: {corners:?}");
}

#[test]
fn closed_glass_without_a_thickness_is_warned_of_and_may_be_taken_as_solid() {
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|c| c as f32);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let indices: Vec<u8> = faces.iter().flat_map(|f: &[u8; 4]| [f[0], f[1], f[2], f[0], f[2], f[3]]).collect();
    let mut cube = beside(&[0, 1, 2, 3, 4, 5, 6, 7].map(corner), &indices);
    cube["materials"][0]["extensions"].as_object_mut().unwrap().remove("KHR_materials_volume");
    cube["meshes"][1]["primitives"][0]["material"] = json!(0);
    let path = std::env::temp_dir().join(format!("abbe-cube-{}.gltf", std::process::id()));
    std::fs::write(&path, cube.to_string()).unwrap();
    let [thin, solid] = [false, true].map(|solid_glass| load(&path, &LoadOptions { solid_glass, ..Default::default() }).unwrap());
    std::fs::remove_file(&path).unwrap();
    let is_pane =
        |scene: &Scene, shape: usize| matches!(scene.materials[scene.shapes[shape].material], Material::ThinDielectric { .. });
    assert!(is_pane(&thin, 0) && is_pane(&thin, 1) && is_pane(&solid, 0) && !is_pane(&solid, 1), "the square stays a pane");
    assert!(
        thin.warnings.iter().any(|w| w.contains("$.meshes[1].primitives[0]") && w.contains("--solid-glass")),
        "{:?}",
        thin.warnings
    );
    assert!(!solid.warnings.iter().any(|w| w.contains("--solid-glass")));
    let Material::Dielectric { interior, .. } = solid.materials[solid.shapes[1].material] else { panic!("not solid") };
    assert!((solid.interiors[interior].ior.nd() - 1.5168).abs() < 1e-6);
}

#[test]
fn an_override_ends_what_is_said_of_the_old_material() {
    let here = std::env::temp_dir().join(format!("abbe-silenced-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    let old = json!([{"name": "m", "pbrMetallicRoughness": {"metallicFactor": -3}, "occlusionTexture": {"index": 0},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}]);
    std::fs::write(here.join("t.gltf"), changed(&[("", "materials", old)]).to_string()).unwrap();
    let notes = |said: Value| {
        let text = json!({"shapes": [{"gltf": {"file": "t.gltf", "override": said}}]}).to_string();
        abbe::scene::load_str(&text, "t.json".as_ref(), &here, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).notes
    };
    assert_eq!(notes(json!({})).len(), 3);
    assert_eq!(notes(json!({"m": {"diffuse": {"reflectance": 0.5}}})), Vec::<String>::new());
    std::fs::remove_dir_all(&here).unwrap();
}

#[test]
fn a_studio_is_as_bright_as_daylight() {
    let path = folder("tests/data/khronos/Mesh_PrimitiveMode_04.gltf");
    let light = |studio: bool| load(&path, &LoadOptions { studio, ..Default::default() }).unwrap().lights.remove(0);
    let (Light::Image(map), Light::Constant { radiance }) = (light(true), light(false)) else { panic!("other lights") };
    let mean = map.mean() * map.illuminant.eval(550.0);
    assert!((mean / radiance.eval(550.0) - 1.0).abs() < 1e-3, "{mean}");
    assert!(map.weights().iter().fold(0.0, |a: f64, b| a.max(*b)) > 0.0);
}
