//! Pictures' files: what their numbers stand for, which of their channels count, and how little room they take.

use crate::{load_text, scene_with};
use abbe::color::convert::linear_srgb_of_xyz;
use abbe::color::space::Space;
use abbe::color::upsample::{color_of_reflectance, srgb_decode};
use abbe::color::{cie, convert};
use abbe::output::{Bands, SpectralImage};
use abbe::scene::texture::{Image, Texels, bytes};
use abbe::scene::{EnvironmentMap, Light, LoadOptions, Material, Scene, Texture, load, load_str};
use abbe::spectrum::Spectrum;
use abbe::spectrum::library::Observer;
use glam::dvec2;
use moxcms::ColorProfile;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn environment(file: &str, more: &str) -> abbe::Result<(Scene, Arc<EnvironmentMap>)> {
    let scene = load_text(&scene_with("lights", &format!(r#"[{{"image": {{"file": "{file}"{more}}}}}]"#)))?;
    let Light::Image(map) = &scene.lights[0] else { panic!("no picture") };
    let map = map.clone();
    Ok((scene, map))
}

/// Linear sRGB of a texel of the surroundings; (1, 1, 1) is what white of luminance 1 has.
fn seen(map: &EnvironmentMap, texel: usize) -> [f64; 3] {
    let nm: Vec<f64> = (360..=830).map(f64::from).collect();
    let values = nm.iter().map(|&x| map.eval(texel, x) * map.illuminant.eval(x)).collect();
    let xyz = cie::xyz_of(&Spectrum::Table { nm, values, extend: false }, Observer::Cie1931);
    linear_srgb_of_xyz(xyz.map(|v| v / cie::xyz_of_unit(Observer::Cie1931)[1]))
}

fn near(got: [f64; 3], want: [f64; 3], what: &str) {
    assert!(got.iter().zip(want).all(|(a, b)| (a - b).abs() < 2e-3), "{what}: {got:?} instead of {want:?}");
}

const SIZE: &str = r#"[{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"}]"#;

/// The reflectance that a picture is in a scene, whose files lie in `folder`.
fn painted(folder: &Path, texture: &str) -> abbe::Result<(Scene, Texture)> {
    let text = scene_with("materials", &format!(r#"{{"m": {{"diffuse": {{"reflectance": {texture}}}}}}}"#));
    let text = text.replace(r#"[{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]"#, SIZE);
    let scene = load_str(&text, "t.json".as_ref(), folder, &LoadOptions::default())?;
    let Material::Diffuse { reflectance } = &scene.materials[scene.shapes[0].material] else { panic!("not diffuse") };
    let reflectance = reflectance.clone();
    Ok((scene, reflectance))
}

fn shipped() -> PathBuf {
    crate::folder("tests/data/scenes")
}

fn texels(texture: &Texture) -> &Image {
    &texture.image().expect("a picture").image
}

#[test]
fn primaries_of_an_exr_count_also_outside_the_gamut() {
    // Made with colour-science 0.4.7, Bradford: ACEScg, and XYZ with equal-energy white.
    for (file, rgb) in [("acescg.exr", [-0.0404, 0.6574, 0.0331]), ("xyz.exr", [0.1814, 0.4916, 0.1634])] {
        let (_, map) = environment(&format!("pictures/{file}"), "").expect(file);
        near(seen(&map, 17), rgb, file);
        let (_, texture) = painted(&shipped(), &format!(r#"{{"texture": "pictures/{file}"}}"#)).expect(file);
        near(color_of_reflectance(|nm| texture.eval(nm, dvec2(0.3, 0.4))), rgb, file);
    }
}

#[test]
fn primaries_of_a_radiance_picture_count() {
    let here = std::env::temp_dir().join(format!("abbe-radiance-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    // Eight by one pixels of 0.2, 0.6, 0.1 without run lengths.
    let pixel = [0.2f64, 0.6, 0.1].map(|v| (v * 256.0) as u8);
    let pixels = [pixel[0], pixel[1], pixel[2], 128].repeat(7);
    let exact = pixel.map(|v| (f64::from(v) + 0.5) / 256.0);
    for (line, matrix) in [
        ("", Space::Srgb.to(Space::Srgb)),
        ("PRIMARIES=.713 .293 .165 .830 .128 .044 .32168 .33767\n", Space::AcesCg.to(Space::Srgb)),
    ] {
        let head = format!("#?RADIANCE\n{line}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 7\n");
        std::fs::write(here.join("a.hdr"), [head.as_bytes(), &pixels].concat()).unwrap();
        let (_, texture) = painted(&here, r#"{"texture": "a.hdr"}"#).expect("a picture");
        let got = color_of_reflectance(|nm| texture.eval(nm, dvec2(0.5, 0.5)));
        let want = convert::apply(&matrix, exact);
        assert!(got.iter().zip(want).all(|(a, b)| (a - b).abs() < 4e-3), "{line:?}: {got:?} instead of {want:?}");
    }
    std::fs::remove_dir_all(&here).unwrap();
}

#[test]
fn grey_alone_and_layers_are_read() {
    let (scene, map) = environment("pictures/grey.exr", "").expect("grey");
    near(seen(&map, 5), [0.5; 3], "grey");
    assert_eq!(scene.notes, Vec::<String>::new());
    let (scene, map) = environment("pictures/layers.exr", "").expect("layers");
    near(seen(&map, 5), [0.2, 0.6, 0.1], "layers");
    assert!(scene.notes[0].contains("of 2 layers the picture is \"View Layer.Combined\""), "{:?}", scene.notes);
}

#[test]
fn an_exr_is_shown_by_its_display_window() {
    let (_, map) = environment("pictures/inner.exr", "").expect("inner");
    assert_eq!((map.width, map.height), (16, 8));
    for (x, y, v) in [(4, 2, 0.0), (11, 5, 31.0 / 32.0), (5, 3, 9.0 / 32.0), (3, 3, 0.0), (12, 3, 0.0), (8, 1, 0.0), (8, 6, 0.0)]
    {
        near(seen(&map, 16 * y + x), [v; 3], "a part of what is shown");
    }
    let (_, map) = environment("pictures/outer.exr", "").expect("outer");
    assert_eq!((map.width, map.height), (16, 8));
    for (x, y) in [(0, 0), (15, 0), (7, 7)] {
        near(seen(&map, 16 * y + x), [(20.0 * (y as f64 + 2.0) + x as f64 + 2.0) / 240.0; 3], "more than what is shown");
    }
}

#[test]
fn spectra_in_an_exr_stay_what_they_are() {
    let value = |nm: f64| 0.1 + 0.8 * (((nm - 375.0) / 50.0).floor() % 2.0);
    let inside = [380.0, 399.0, 424.0, 426.0, 470.0, 512.0, 689.0, 724.0];
    let (scene, map) = environment("pictures/light.exr", r#", "scale": 3"#).expect("light");
    for nm in inside {
        let got = map.eval(40, nm) * map.illuminant.eval(nm);
        assert!((got - 3.0 * value(nm)).abs() < 1e-6, "{got} at {nm} nm");
    }
    assert_eq!((map.eval(40, 374.0), map.eval(40, 726.0)), (0.0, 0.0));
    assert!(scene.notes[0].contains("bins from 375 to 725 nm") && scene.notes[0].contains("dark"), "{:?}", scene.notes);
    let (scene, texture) = painted(&shipped(), r#"{"texture": "pictures/reflectance.exr", "scale": 0.5}"#).expect("reflectance");
    for nm in inside.into_iter().chain([780.0]) {
        let got = texture.eval(nm, dvec2(0.5, 0.5));
        assert!((got - 0.5 * value(nm.min(724.0))).abs() < 1e-6, "{got} at {nm} nm");
    }
    assert!(scene.notes[0].contains("end values"), "{:?}", scene.notes);
    let lamp = r#"[{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "emission": {"radiance": {"texture": "pictures/light.exr"}}}]"#;
    let scene = load_text(&scene_with("shapes", lamp)).expect("a lamp");
    let radiance = &scene.shapes[0].emission.as_ref().expect("light").radiance;
    assert!(inside.iter().all(|&nm| (radiance.eval(nm, dvec2(0.2, 0.9)) - value(nm)).abs() < 1e-6));
}

#[test]
fn bands_of_a_spectral_exr_are_said_beside_its_name() {
    let folder = crate::folder("tests/data");
    let image = SpectralImage::read_with(
        &folder.join("mitsuba_bands.exr"),
        Some(&Bands::read(&folder.join("mitsuba_bands.txt")).expect("bands")),
    );
    let image = image.expect("a picture by Mitsuba");
    let text = |more: &str| scene_with("lights", &format!(r#"[{{"image": {{"file": "mitsuba_bands.exr"{more}}}}}]"#));
    let read = |more: &str| load_str(&text(more), "t.json".as_ref(), &folder, &LoadOptions::default());
    let scene = read(r#", "bands": "mitsuba_bands.txt""#).expect("bands");
    let Light::Image(map) = &scene.lights[0] else { panic!("no picture") };
    for (pixel, bin) in [(0, 0), (9, 2), (23, image.bins() - 1)] {
        assert_eq!(map.eval(pixel, image.wavelengths_nm[bin]), f64::from(image.pixel(pixel)[bin]));
    }
    assert!(read("").expect_err("no colours").to_string().contains("no channels of colour"));
    assert!(read(r#", "bands": [0.4, 0.7]"#).is_err() && read(r#", "bands": [700, 400]"#).is_err());
}

/// A PNG of one colour, with what `also` sets.
fn png(color: png::ColorType, pixel: &[u8], also: impl FnOnce(&mut png::Info)) -> Vec<u8> {
    let mut info = png::Info::with_size(4, 4);
    (info.color_type, info.bit_depth) = (color, png::BitDepth::Eight);
    also(&mut info);
    let mut out = Vec::new();
    png::Encoder::with_info(&mut out, info).unwrap().write_header().unwrap().write_image_data(&pixel.repeat(16)).unwrap();
    out
}

#[test]
fn profiles_and_chunks_of_a_png_say_what_its_colours_are() {
    let here = std::env::temp_dir().join(format!("abbe-pictures-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    let color = |bytes: &[u8], more: &str| {
        std::fs::write(here.join("a.png"), bytes).unwrap();
        let (_, texture) = painted(&here, &format!(r#"{{"texture": "a.png"{more}}}"#)).expect("a picture");
        color_of_reflectance(|nm| texture.eval(nm, dvec2(0.5, 0.5)))
    };
    let pixel = [200, 90, 30];
    let rgb = |also: fn(&mut png::Info)| png(png::ColorType::Rgb, &pixel, also);
    let share = pixel.map(|v| f64::from(v) / 255.0);
    let srgb = share.map(srgb_decode);
    // By IEC 61966-2-1 and SMPTE EG 432-1: their primaries alone are different.
    let p3 = convert::apply(&Space::DisplayP3.to(Space::Srgb), srgb);
    let power = |g: f64| share.map(|v| v.powf(g));
    near(color(&rgb(|_| ()), ""), srgb, "nothing");
    near(color(&rgb(|i| i.source_gamma = Some(png::ScaledFloat::new(1.0))), ""), share, "gAMA 1");
    near(color(&rgb(|i| i.source_gamma = Some(png::ScaledFloat::new(0.5))), ""), power(2.0), "gAMA 1/2");
    near(color(&rgb(|i| i.source_gamma = Some(png::ScaledFloat::new(0.45455))), ""), srgb, "gAMA 1/2.2");
    let of_p3 = |i: &mut png::Info| {
        i.source_gamma = Some(png::ScaledFloat::new(0.45455));
        i.source_chromaticities =
            Some(png::SourceChromaticities::new((0.3127, 0.329), (0.68, 0.32), (0.265, 0.69), (0.15, 0.06)));
    };
    near(color(&rgb(of_p3), ""), p3, "cHRM");
    let icc = |profile: ColorProfile| Some(profile.encode().unwrap().into());
    let with_icc = |profile| png(png::ColorType::Rgb, &pixel, |i| i.icc_profile = icc(profile));
    near(color(&with_icc(ColorProfile::new_display_p3()), ""), p3, "iCCP of P3");
    near(color(&with_icc(ColorProfile::new_display_p3()), r#", "linear": true"#), share, "iCCP of P3, taken as it is");
    near(color(&with_icc(ColorProfile::new_srgb()), ""), srgb, "iCCP of sRGB");
    let grey = png(png::ColorType::Grayscale, &[90], |i| i.icc_profile = icc(ColorProfile::new_gray_with_gamma(1.8)));
    near(color(&grey, ""), [(90.0f64 / 255.0).powf(1.8); 3], "iCCP of grey");
    // A profile that is not one for such pictures leaves them as they are.
    near(
        color(&png(png::ColorType::Grayscale, &[90], |i| i.icc_profile = icc(ColorProfile::new_srgb())), ""),
        [srgb_decode(90.0 / 255.0); 3],
        "of RGB",
    );
    std::fs::remove_dir_all(&here).unwrap();
}

/// CIELAB of the profile's nodes (tools/make-pictures.py) by way of D50, Bradford's matrix and sRGB; LittleCMS 2.19 has it within 1.7 in 255, as it is encoded.
#[test]
fn the_profile_of_a_jpeg_of_four_inks_says_what_they_look_like() {
    let here = std::env::temp_dir().join(format!("abbe-inks-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    let mut file = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/scenes/pictures/inks.jpg")).unwrap();
    let shown = |file: &[u8]| {
        std::fs::write(here.join("a.jpg"), file).unwrap();
        let (scene, texture) = painted(&here, r#"{"texture": "a.jpg"}"#).expect("a picture");
        assert!(scene.notes.iter().all(|note| !note.contains("profile")), "{:?}", scene.notes);
        [4.0, 12.0, 20.0].map(|x| {
            color_of_reflectance(|nm| texture.eval(nm, dvec2(x / 24.0, 0.5)))
                .map(|v| 255.0 * abbe::color::convert::srgb_encode(v))
        })
    };
    let same = |a: [f64; 3], b: [f64; 3]| assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1.6), "{a:?} instead of {b:?}");
    let of_inks = shown(&file);
    for (shown, known) in of_inks.into_iter().zip([[134.7, 131.6, 130.9], [176.6, 162.1, 162.2], [171.7, 0.0, 126.9]]) {
        same(shown, known);
    }
    // What Adobe calls transform 2 has three of the inks as luma and differences of colour.
    let mark = file.windows(5).position(|w| w == b"Adobe").expect("its mark");
    file[mark + 11] = 2;
    same(shown(&file)[0], of_inks[1]);
    std::fs::remove_dir_all(&here).unwrap();
}

/// A glTF square with these materials, each on a primitive of its own, and the picture `png`.
fn document(materials: Vec<Value>, png: &[u8]) -> Value {
    let floats = [0.0f32, 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., /* uv */ 0., 1., 1., 1., 1., 0., 0., 0.];
    let mut data: Vec<u8> = floats.iter().flat_map(|v| v.to_le_bytes()).collect();
    data.extend([0u8, 1, 2, 0, 2, 3, 0, 0]);
    let length = data.len();
    data.extend(png);
    let primitive = |i: usize| json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": i});
    let uri = format!("data:application/octet-stream;base64,{}", crate::gltf::base64(&data));
    json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": (0..materials.len()).map(primitive).collect::<Vec<_>>()}],
        "materials": materials, "textures": [{"source": 0}, {"source": 1}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}, {"bufferView": 3, "mimeType": "image/png"}],
        "buffers": [{"byteLength": data.len(), "uri": uri}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
                        {"buffer": 0, "byteOffset": 80, "byteLength": 6}, {"buffer": 0, "byteOffset": length, "byteLength": png.len()}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                      {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                      {"bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR"}]})
}

#[test]
fn a_picture_is_stored_once_whatever_factors_and_channels_refer_to_it() {
    let here = std::env::temp_dir().join(format!("abbe-stored-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    // 64 x 64 pixels of 4096 colours.
    let pixels: Vec<u8> = (0..4096u32).flat_map(|i| [(i % 64 * 4) as u8, (i / 64 * 4) as u8, 77]).collect();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 64, 64);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    let scene = |materials: Vec<Value>| {
        std::fs::write(here.join("t.gltf"), document(materials, &file).to_string()).unwrap();
        load(&here.join("t.gltf"), &LoadOptions::default()).unwrap()
    };
    let colored = |i: u32| json!({"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": i % 2}, "baseColorFactor": [0.1 * f64::from(i), 0.5, 1, 1]}});
    // Places among 4096 colours of 16 bytes take two bytes; texture coordinates 32 of a triangle.
    for count in [1, 6] {
        let room = bytes(&scene((1..=count).map(colored).collect()));
        assert_eq!(room, u64::from(2 * 4096 + count * 4096 * 16 + 2 * count * 32), "{count} factors");
    }
    let rough = |i: u32| json!({"pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 0}, "roughnessFactor": 0.1 * f64::from(i)}});
    // Two channels of one byte.
    assert_eq!(bytes(&scene((1..=6).map(rough).collect())), 2 * 4096 + 12 * 32);
    let bumpy = |i: u32| json!({"normalTexture": {"index": 0, "scale": 0.1 * f64::from(i)}});
    assert_eq!(bytes(&scene((1..=6).map(bumpy).collect())), 4 * 4096 + 12 * 32);
    std::fs::remove_dir_all(&here).unwrap();
}

#[test]
fn deep_colours_take_eight_bytes_a_texel() {
    let (_, texture) = painted(&shipped(), r#"{"texture": "pictures/acescg.exr"}"#).expect("a picture");
    let Texels::Sigmoids { stored } = &texels(&texture).texels else { panic!("not packed") };
    assert_eq!(stored.bytes().len(), 8 * texels(&texture).count());
}

#[test]
fn far_texture_coordinates_and_offsets_are_fine_where_pictures_repeat() {
    let at = |u: f64| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt {u} 0\nvt {} 0\nvt {u} 1\nf 1/1 2/2 3/3\n", u + 1.0);
    let here = std::env::temp_dir().join(format!("abbe-far-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    std::fs::copy(shipped().join("sky.png"), here.join("sky.png")).unwrap();
    let read = |u: f64| {
        std::fs::write(here.join("a.obj"), at(u)).unwrap();
        let text = scene_with("materials", r#"{"m": {"diffuse": {"reflectance": {"texture": "sky.png"}}}}"#);
        let text = text.replace(
            r#"{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}"#,
            r#"{"mesh": {"file": "a.obj"}, "material": "m"}"#,
        );
        load_str(&text, "t.json".as_ref(), &here, &LoadOptions::default())
    };
    assert!(read(20000.0).is_ok() && read(-1e5).is_ok());
    assert!(read(1e7).unwrap_err().to_string().contains("beyond 1e6"));
    std::fs::remove_dir_all(&here).unwrap();
}
