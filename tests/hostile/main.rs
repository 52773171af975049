//! Files from strangers: no input makes Abbe panic, hang, or ask for more memory than its size explains. Files that ship are changed, cut, doubled and
//! filled with nasty numbers, more of them in a sweep. Known attacks and inputs of past
//! failures lie in tests/data/hostile.

mod lenses;
mod memory;
mod mutation;
#[path = "../support/sweep.rs"]
mod sweep;

use abbe::output::SpectralImage;
use abbe::scene::{LoadOptions, load, load_str};
use mutation::{Random, mutate, mutate_json};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Memory that any input may take, and how many bytes more for each byte of the file. Pictures may be compressed: 1032 pixels to a byte at most, and
/// a Mi of them anyway, of up to 160 bytes each while they are read.
const BASE: usize = 192 << 20;
const PER_BYTE: usize = 4096;
const PER_BYTE_OF_PICTURE: usize = 1032 * 160;
/// An input that takes more processor time than this is a hang: other programs may stand in the way for longer.
const LONGEST: Duration = Duration::from_secs(60);

/// How an input is read.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Scene,
    Mesh,
    Gltf,
    Environment,
    Texture,
    Spectrum,
    Glass,
    Profile,
    Exr,
}

/// Files to start from, and how they are read.
const CORPUS: &[(&str, Kind)] = &[
    ("tests/data/scenes/everything.json", Kind::Scene),
    ("scenes/starter.json", Kind::Scene),
    ("scenes/newton.json", Kind::Scene),
    ("scenes/fog.json", Kind::Scene),
    ("scenes/compare/newton/prism.ply", Kind::Mesh),
    ("tests/data/scenes/dropped.ply", Kind::Mesh),
    ("tests/data/scenes/square.obj", Kind::Mesh),
    ("tests/data/scenes/tetrahedron.stl", Kind::Mesh),
    ("tests/data/scenes/tetrahedron_text.stl", Kind::Mesh),
    ("tests/data/scenes/glass.gltf", Kind::Mesh),
    ("tests/data/scenes/glass.gltf", Kind::Gltf),
    ("tests/data/scenes/blender.glb", Kind::Gltf),
    ("tests/data/scenes/bumpy.gltf", Kind::Gltf),
    ("tests/data/scenes/draco.glb", Kind::Gltf),
    ("tests/data/scenes/meshopt.glb", Kind::Gltf),
    ("tests/data/scenes/sky.png", Kind::Environment),
    ("tests/data/scenes/sky.png", Kind::Texture),
    ("tests/data/scenes/pictures/profile.png", Kind::Texture),
    ("tests/data/scenes/pictures/profile.webp", Kind::Texture),
    ("tests/data/scenes/pictures/layers.exr", Kind::Environment),
    ("tests/data/scenes/pictures/reflectance.exr", Kind::Texture),
    ("tests/data/scenes/ramp.csv", Kind::Spectrum),
    ("tests/data/measured/lamp.spdx", Kind::Spectrum),
    ("tests/data/measured/lamp.sp", Kind::Spectrum),
    ("tests/data/measured/ocean.txt", Kind::Spectrum),
    ("tests/data/measured/f2.yml", Kind::Glass),
    ("tests/data/measured/nk.yml", Kind::Glass),
    ("tests/data/measured/rii.csv", Kind::Glass),
    ("tests/data/measured/formulas.agf", Kind::Glass),
    ("tests/data/scenes/lamp.ies", Kind::Profile),
    ("tests/data/scenes/lamp.ldt", Kind::Profile),
    ("tests/data/fichet_emissive_20.exr", Kind::Exr),
    ("tests/data/fichet_reflective_20.exr", Kind::Exr),
];

/// glTF files whose JSON is changed value by value: the reader's crate takes on trust what is not checked before it.
const DOCUMENTS: &[&str] = &[
    "tests/data/scenes/everything.gltf",
    "tests/data/scenes/glass.gltf",
    "tests/data/scenes/blender.glb",
    "tests/data/scenes/bumpy.gltf",
    "tests/data/scenes/draco.glb",
    "tests/data/scenes/meshopt.glb",
    "tests/data/scenes/everything.gltf",
];

/// Processor time of this process, user's and system's (proc(5), in hundredths of a second), or where that is not told the time.
fn spent() -> Duration {
    static START: OnceLock<Instant> = OnceLock::new();
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace().skip(11).take(2);
    let hundredths: Vec<u64> = fields.filter_map(|f| f.parse().ok()).collect();
    match hundredths[..] {
        [user, system] => Duration::from_millis(10 * (user + system)),
        _ => START.get_or_init(Instant::now).elapsed(),
    }
}

fn project(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// Reads `bytes` as a file of this kind and name in `folder`; whether it was accepted. Errors are of one line.
fn read(kind: Kind, bytes: &[u8], folder: &Path, name: &str) -> bool {
    let options = LoadOptions::default();
    let within = |rest: &str| {
        let head = r#""film": {"width": 8, "height": 8}, "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}}"#;
        load_str(&format!("{{{head}, {rest}}}"), Path::new("hostile.json"), folder, &options).map(|_| ())
    };
    if kind != Kind::Scene {
        std::fs::write(folder.join(name), bytes).expect("a place for the input");
    }
    let read = match kind {
        Kind::Scene => {
            load_str(&String::from_utf8_lossy(bytes), Path::new("hostile.json"), &project("tests/data/scenes"), &options)
                .map(|_| ())
        }
        Kind::Mesh => within(&format!(
            r#""materials": {{"m": {{"diffuse": {{"reflectance": 0.5}}}}}}, "shapes": [{{"mesh": {{"file": "{name}", "smooth": true}}, "material": "m"}}]"#
        )),
        Kind::Gltf => load(&folder.join(name), &options).map(|_| ()),
        Kind::Environment => within(&format!(r#""lights": [{{"image": {{"file": "{name}"}}}}]"#)),
        Kind::Texture => within(&format!(
            r#""materials": {{"m": {{"diffuse": {{"reflectance": {{"texture": "{name}"}}}}}}}},
               "shapes": [{{"quad": {{"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}}, "material": "m"}}]"#
        )),
        Kind::Spectrum => within(&format!(r#""lights": [{{"constant": {{"radiance": {{"file": "{name}"}}}}}}]"#)),
        Kind::Glass => {
            let which = if name.ends_with(".agf") { r#", "name": "F2""# } else { "" };
            within(&format!(
                r#""materials": {{"m": {{"dielectric": {{"ior": {{"file": "{name}", "extrapolate": true{which}}}, "absorption": "catalogue"}}}}}}"#
            ))
        }
        Kind::Profile => {
            within(&format!(r#""lights": [{{"spot": {{"position": [0, 0, 0], "direction": [0, -1, 0], "profile": "{name}"}}}}]"#))
        }
        Kind::Exr => SpectralImage::read(folder.join(name)).map(|_| ()),
    };
    if let Err(e) = &read {
        assert!(!e.to_string().contains('\n'), "more than one line: {e}");
    }
    read.is_ok()
}

/// Reads an input under watch. One that fails stays in the temporary folder, and the message says where.
fn watched(kind: Kind, bytes: &[u8], folder: &Path, name: &str, what: &str) -> bool {
    let (start, before) = (spent(), memory::watch());
    let outcome = std::panic::catch_unwind(|| read(kind, bytes, folder, name));
    let (took, used) = (spent().saturating_sub(start), memory::peak().saturating_sub(before));
    let per_byte = if matches!(kind, Kind::Environment | Kind::Texture | Kind::Gltf) { PER_BYTE_OF_PICTURE } else { PER_BYTE };
    let allowed = BASE + per_byte * bytes.len();
    if outcome.is_ok() && took < LONGEST && used <= allowed {
        return outcome.unwrap_or(false);
    }
    let kept = std::env::temp_dir().join(format!("abbe-hostile-{what}-{name}"));
    std::fs::write(&kept, bytes).expect("a place for the culprit");
    panic!(
        "{kind:?} {what}: panicked: {}, took {took:.1?}, used {used} of {allowed} bytes; kept as {}",
        outcome.is_err(),
        kept.display()
    );
}

#[test]
fn no_input_panics_hangs_or_asks_for_memory_that_its_size_does_not_explain() {
    let total: usize = sweep::count(6000);
    let folder = std::env::temp_dir().join(format!("abbe-hostile-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    // What is built once is no input's doing.
    read(Kind::Texture, &std::fs::read(project("tests/data/scenes/sky.png")).expect("a picture"), &folder, "sky.png");
    let accepted = AtomicUsize::new(0);
    let mut random = Random(u64::from(std::env::var("ABBE_SWEEP_SEED").ok().and_then(|n| n.parse::<u32>().ok()).unwrap_or(1)));
    let mut slowest = Duration::ZERO;
    for (i, (file, kind)) in CORPUS.iter().cycle().enumerate().take(total) {
        let mut bytes = std::fs::read(project(file)).expect("a file that ships");
        let name = Path::new(file).file_name().expect("a name").to_string_lossy().into_owned();
        mutate(&mut bytes, &mut random);
        if i > 0 && i % 100_000 == 0 {
            println!("{i} inputs so far");
        }
        let start = spent();
        if watched(*kind, &bytes, &folder, &name, &format!("input-{i}")) {
            accepted.fetch_add(1, Ordering::Relaxed);
        }
        slowest = slowest.max(spent().saturating_sub(start));
    }
    std::fs::remove_dir_all(&folder).expect("the folder");
    let accepted = accepted.into_inner();
    println!(
        "{total} inputs of {} files: {accepted} accepted, slowest {slowest:.1?}, at most {} MiB at a time",
        CORPUS.len(),
        memory::greatest() >> 20
    );
    // The mutations are gentle enough that both outcomes are exercised.
    assert!(accepted > total / 50 && accepted < total - total / 50, "{accepted} of {total} accepted");
}

/// A .glb or .gltf file with changed JSON.
fn with_changed_json(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let end = bytes.starts_with(b"glTF").then(|| 20 + u32::from_le_bytes(bytes[12..16].try_into().expect("a chunk")) as usize);
    let text = end.map_or(bytes, |end| &bytes[20..end]);
    let mut document = serde_json::from_slice(text).expect("JSON");
    mutate_json(&mut document, random);
    let mut text = document.to_string().into_bytes();
    let Some(end) = end else { return text };
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = (bytes.len() - end + 20 + text.len()) as u32;
    [
        b"glTF".as_slice(),
        &2u32.to_le_bytes(),
        &length.to_le_bytes(),
        &(text.len() as u32).to_le_bytes(),
        b"JSON",
        &text,
        &bytes[end..],
    ]
    .concat()
}

#[test]
fn no_value_in_the_json_of_a_gltf_file_makes_its_reader_panic() {
    let total: usize = sweep::count(5000);
    let folder = std::env::temp_dir().join(format!("abbe-hostile-gltf-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut random = Random(2);
    let mut accepted = 0;
    for (i, file) in DOCUMENTS.iter().cycle().enumerate().take(total) {
        let bytes = with_changed_json(&std::fs::read(project(file)).expect("a file that ships"), &mut random);
        let name = Path::new(file).file_name().expect("a name").to_string_lossy().into_owned();
        let kind = if i % 8 == 7 { Kind::Mesh } else { Kind::Gltf };
        accepted += usize::from(watched(kind, &bytes, &folder, &name, &format!("json-{i}")));
    }
    std::fs::remove_dir_all(&folder).expect("the folder");
    println!("{total} documents: {accepted} accepted");
    assert!(accepted > total / 50 && accepted < total - total / 50, "{accepted} of {total} accepted");
}

#[test]
fn known_attacks_and_inputs_of_past_failures_are_errors_of_one_line() {
    let folder = std::env::temp_dir().join(format!("abbe-hostile-past-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut seen = 0;
    for entry in std::fs::read_dir(project("tests/data/hostile")).expect("the corpus") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let kind = match name.rsplit('.').next() {
            Some("json") => Kind::Scene,
            Some("ply" | "obj" | "stl") => Kind::Mesh,
            Some("glb" | "gltf") => Kind::Gltf,
            Some("png" | "jpg" | "hdr") => Kind::Texture,
            Some("csv") => Kind::Spectrum,
            Some("ies" | "ldt") => Kind::Profile,
            Some("exr") => Kind::Exr,
            _ => continue,
        };
        let bytes = std::fs::read(&path).expect("an input");
        assert!(!watched(kind, &bytes, &folder, &name, "past"), "{name} was accepted");
        seen += 1;
    }
    std::fs::remove_dir_all(&folder).expect("the folder");
    assert!(seen >= 3, "{seen} inputs");
}

/// Many pictures of one part of a file are one.
#[test]
fn pictures_of_the_same_data_are_decoded_once() {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 4096, 4096);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().expect("a header").write_image_data(&vec![77; 1 << 24]).expect("pixels");
    let folder = std::env::temp_dir().join(format!("abbe-hostile-shared-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let floats = [0.0f32, 0., 0., 1., 0., 0., 0., 1., 0., /* uv */ 0., 0., 1., 0., 0., 1.];
    let mut data: Vec<u8> = floats.iter().flat_map(|v| v.to_le_bytes()).collect();
    data.extend(&file);
    std::fs::write(folder.join("t.bin"), &data).expect("a file");
    let count = 60;
    let list = |item: &dyn Fn(usize) -> String| (0..count).map(item).collect::<Vec<_>>().join(",");
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{}]}}],
            "materials": [{}], "textures": [{}], "images": [{}], "buffers": [{{"byteLength": {}, "uri": "t.bin"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 24}},
                            {{"buffer": 0, "byteOffset": 60, "byteLength": {}}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}, {{"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}}]}}"#,
        list(&|i| format!(r#"{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1}}, "material": {i}}}"#)),
        list(&|i| format!(
            r#"{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": {i}}}, "metallicFactor": 0, "baseColorFactor": [0.5, 0.5, {}, 1]}}}}"#,
            i as f64 / 60.0
        )),
        list(&|i| format!(r#"{{"source": {i}}}"#)),
        list(&|_| r#"{"bufferView": 2, "mimeType": "image/png"}"#.into()),
        data.len(),
        file.len(),
    );
    std::fs::write(folder.join("t.gltf"), text).expect("a file");
    let before = memory::watch();
    load(&folder.join("t.gltf"), &LoadOptions::default()).expect("a scene");
    let used = memory::peak().saturating_sub(before);
    std::fs::remove_dir_all(&folder).expect("the folder");
    // A byte a texel as decoded and as stored, the number of its colour in between.
    assert!(used < 160 << 20, "{} MiB for a picture of 16", used >> 20);
}
