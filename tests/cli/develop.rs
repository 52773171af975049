//! `abbe develop`: pictures from Abbe's own files, from other programs' layouts, and from reflectances; and how the pictures are marked.

use abbe::color::cie;
use abbe::output::SpectralImage;
use abbe::spectrum::library::{self, Observer};
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, WritableImage, f16};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A lit sphere.
const SCENE: &str = r#"{
  "film": {"width": 8, "height": 6, "bins": 20},
  "camera": {"perspective": {"eye": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40}},
  "materials": {"green": {"diffuse": {"reflectance": {"srgb": [0.2, 0.7, 0.3]}}}},
  "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "green"}],
  "lights": [{"constant": {"radiance": 1}}]
}"#;

/// A folder of its own for a test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("abbe-develop-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join("ball.json"), SCENE).unwrap();
        Folder(path)
    }

    fn command(&self, line: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_abbe")).args(line.split(' ')).current_dir(&self.0).output().unwrap()
    }

    /// Runs what must succeed, and returns what it says on standard error.
    fn run(&self, line: &str) -> String {
        let output = self.command(line);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{line}: {stderr}");
        stderr
    }

    /// Runs what must fail in one line that contains `says`.
    fn fails(&self, line: &str, says: &str) {
        let output = self.command(line);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{line}: {stderr}");
        assert!(stderr.lines().count() == 1 && stderr.contains(says), "{line}: no '{says}' in {stderr}");
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn render(&self, more: &str) -> String {
        self.run(&format!("render ball.json --device reference --spp 4{more}"))
    }

    /// Writes an EXR of one pixel with these channels.
    fn write(&self, name: &str, channels: &[(String, f64)], half: bool) {
        let samples = |v: f64| {
            if half { FlatSamples::F16(vec![f16::from_f64(v)]) } else { FlatSamples::F32(vec![v as f32]) }
        };
        let list = channels.iter().map(|(name, v)| AnyChannel::new(name.as_str(), samples(*v))).collect();
        Image::from_channels((1, 1), AnyChannels::sort(list)).write().to_file(self.path(name)).unwrap();
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A PNG's head and its components.
fn png(path: &Path) -> (png::Info<'static>, Vec<u16>) {
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    let values = match reader.info().bit_depth {
        png::BitDepth::Sixteen => bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect(),
        _ => bytes.iter().map(|&b| u16::from(b)).collect(),
    };
    (reader.info().clone(), values)
}

/// Linear R, G, B of the first pixel of an EXR picture.
fn rgb(path: &Path) -> [f64; 3] {
    let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
    let channels = image.layer_data.channel_data.list;
    ["R", "G", "B"].map(|name| {
        let channel = channels.iter().find(|c| c.name == *name).unwrap();
        f64::from(channel.sample_data.value_by_flat_index(0).to_f32())
    })
}

fn assert_near(a: [f64; 3], b: [f64; 3], tolerance: f64, what: &str) {
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= tolerance), "{what}: {a:?} is not {b:?} to {tolerance}");
}

#[test]
fn the_picture_of_a_render_can_be_made_again_from_its_file() {
    let folder = Folder::new("again");
    folder.render("");
    folder.run("develop ball.exr -o again.png");
    let read = |name| std::fs::read(folder.path(name)).unwrap();
    assert_eq!(read("ball.png"), read("again.png"));
    folder.run("develop ball.exr -o other.png --exposure 1");
    assert_ne!(read("ball.png"), read("other.png"));
    // From the bins alone, without the film's XYZ, it is nearly the same; both are sampled, at the same wavelengths.
    let image = SpectralImage::read(folder.path("ball.exr")).unwrap();
    let bins: Vec<(String, f64)> =
        (0..20).map(|b| (abbe::output::exr::channel_name(image.wavelengths_nm[b]), f64::from(image.pixel(27)[b]))).collect();
    folder.write("bins.exr", &bins, false);
    folder.run("develop bins.exr -o bins_rgb.exr --exposure 0");
    let unit = cie::xyz_of_unit(Observer::Cie1931)[1];
    let film = ["XYZ.X", "XYZ.Y", "XYZ.Z"].map(|name| f64::from(image.other(name).unwrap()[27]) / unit);
    assert_near(rgb(&folder.path("bins_rgb.exr")), abbe::color::convert::linear_srgb_of_xyz(film), 1e-2, "from the bins");
}

#[test]
fn the_adapter_makes_the_same_picture() {
    let folder = Folder::new("device");
    folder.render("");
    let picture = |device: &str| {
        folder.run(&format!("develop ball.exr -o {device}.png --bits 16 --tone agx --space p3 --device {device}"));
        png(&folder.path(&format!("{device}.png"))).1
    };
    let adapters = abbe::gpu::list_adapters();
    let (exact, ours) = (picture("reference"), picture(adapters[0].name.split(' ').next().unwrap()));
    assert!(exact.iter().any(|v| *v > 1000));
    assert!(exact.iter().zip(&ours).all(|(a, b)| a.abs_diff(*b) <= 1), "{exact:?} {ours:?}");
    folder.fails("develop ball.exr -o a.png --device tubes", "choose one of");
}

#[test]
fn pictures_are_marked_with_their_space() {
    let folder = Folder::new("marks");
    folder.render("");
    let picture = |options: &str, name: &str| {
        folder.run(&format!("develop ball.exr -o {name} {options}"));
        folder.path(name)
    };
    let (info, srgb) = png(&picture("--bits 8", "a.png"));
    assert_eq!((info.width, info.height, info.color_type, info.bit_depth), (8, 6, png::ColorType::Rgb, png::BitDepth::Eight));
    assert!(info.srgb.is_some() && info.icc_profile.is_none());

    for (space, code_points) in [("p3", [12u8, 13, 0, 1]), ("rec2020", [9, 14, 0, 1])] {
        let path = picture(&format!("--space {space} --bits 16"), "b.png");
        let (info, values) = png(&path);
        assert_eq!(info.bit_depth, png::BitDepth::Sixteen);
        let file = std::fs::read(&path).unwrap();
        let at = file.windows(4).position(|w| w == b"cICP").expect("a cICP chunk");
        assert_eq!(file[at + 4..at + 8], code_points);
        // The profile's primaries add up to its white, D50.
        let profile = info.icc_profile.expect("a profile").into_owned();
        let u32_at = |at: usize| u32::from_be_bytes(profile[at..at + 4].try_into().unwrap());
        assert_eq!(u32_at(0) as usize, profile.len());
        let tag = |name: &[u8]| {
            let entry = (0..u32_at(128) as usize).map(|i| 132 + 12 * i).find(|&at| &profile[at..at + 4] == name).unwrap();
            u32_at(entry + 4) as usize
        };
        let xyz = |name: &[u8]| [8, 12, 16].map(|at| f64::from(u32_at(tag(name) + at) as i32) / 65536.0);
        let [r, g, b] = [b"rXYZ", b"gXYZ", b"bXYZ"].map(|name| xyz(name));
        assert_near([0, 1, 2].map(|i| r[i] + g[i] + b[i]), [0.9642, 1.0, 0.8249], 1e-4, "white");
        // A green that sRGB holds needs less green and more red in a wider space.
        let middle = |v: &[u16], most: f64| [81, 82, 83].map(|i| f64::from(v[i]) / most);
        let (narrow, wide) = (middle(&srgb, 255.0), middle(&values, 65535.0));
        assert!(wide[1] - wide[0] < narrow[1] - narrow[0] - 0.02, "{space}: {narrow:?} {wide:?}");
    }

    let jpeg = std::fs::read(picture("--space p3 --quality 90", "c.jpg")).unwrap();
    assert!(jpeg.starts_with(&[0xff, 0xd8]) && jpeg.windows(12).any(|w| w == b"ICC_PROFILE\0"));
    let decoded = image::open(folder.path("c.jpg")).unwrap();
    assert_eq!((decoded.width(), decoded.height()), (8, 6));

    let meta = exr::meta::MetaData::read_from_file(picture("--space acescg", "d.exr"), true).unwrap();
    let c = meta.headers[0].shared_attributes.chromaticities.expect("chromaticities");
    assert_eq!((c.red.0, c.white.1), (0.713, 0.33767));
}

#[test]
fn pbrts_files_are_read() {
    // src/pbrt/film.cpp, SpectralFilm: 16 buckets over 360 to 830 nm, half, centres to a thousandth.
    let folder = Folder::new("pbrt");
    let light = library::illuminant("D65").unwrap();
    let edge = |i: u32| 360.0 + 470.0 / 16.0 * f64::from(i);
    let mut channels: Vec<(String, f64)> = (0..16)
        .map(|i| {
            let name = format!("S0.{:.3}nm", 0.5 * (edge(i) + edge(i + 1))).replace('.', ",").replacen(',', ".", 1);
            (name, light.mean(edge(i), edge(i + 1)) / 100.0)
        })
        .collect();
    channels.extend(["R", "G", "B"].map(|name| (name.to_string(), 0.5)));
    folder.write("pbrt.exr", &channels, true);
    let image = SpectralImage::read(folder.path("pbrt.exr")).unwrap();
    assert!((image.edges_nm()[0] - 360.0).abs() < 2e-3 && (image.edges_nm()[16] - 830.0).abs() < 2e-3);
    assert_eq!(folder.run("develop pbrt.exr -o a.exr --exposure 0"), "", "no note: the visible range is whole");
    let y = cie::xyz_of(&light, Observer::Cie1931)[1] / cie::xyz_of_unit(Observer::Cie1931)[1] / 100.0;
    assert_near(rgb(&folder.path("a.exr")), [y; 3], 5e-3 * y, "D65 is white");
}

#[test]
fn band_files_are_read_with_a_table_or_a_range() {
    // As Mitsuba 3's specfilm with flat responses of 1 over 20 nm: integrals, named by the user, and names that do not sort as numbers.
    let folder = Folder::new("bands");
    let light = library::illuminant("A").unwrap();
    let edge = |i: u32| 380.0 + 20.0 * f64::from(i);
    let mean = |i| light.mean(edge(i), edge(i + 1)) / 100.0;
    let layout: Vec<(String, f64)> = (0..20).map(|i| (abbe::output::exr::channel_name(edge(i) + 10.0), mean(i))).collect();
    let numbered: Vec<(String, f64)> = (0..20).map(|i| (format!("band{}", i + 1), 20.0 * mean(i))).collect();
    let named: Vec<(String, f64)> =
        (0..20).map(|i| (format!("S0.{}", char::from(b'z' - i as u8)), 2.0 * 20.0 * mean(i))).collect();
    let table: String = (0..20).map(|i| format!("S0.{} {} {} 2\n", char::from(b'z' - i as u8), edge(i), edge(i + 1))).collect();
    std::fs::write(folder.path("table.txt"), table).unwrap();
    for (name, channels) in [("layout", &layout), ("numbered", &numbered), ("named", &named)] {
        folder.write(&format!("{name}.exr"), channels, false);
    }
    folder.run("develop layout.exr -o expected.exr --exposure 0");
    let expected = rgb(&folder.path("expected.exr"));
    assert!(expected[0] > 2.0 * expected[2] && expected[2] > 0.0, "{expected:?}");
    for line in ["numbered.exr --bands 380-780", "named.exr --bands table.txt"] {
        folder.run(&format!("develop {line} -o b.exr --exposure 0"));
        assert_near(rgb(&folder.path("b.exr")), expected, 1e-6, line);
    }
    folder.fails("develop numbered.exr -o c.png", "--bands");
    folder.fails("develop numbered.exr -o c.png --bands table.txt", "none of the bands");
    folder.fails("develop numbered.exr -o c.png --bands missing.txt", "missing.txt");
    folder.fails("develop numbered.exr -o c.png --bands 780-380", "400-700");
}

#[test]
fn a_file_of_mitsuba_is_read_by_every_command_with_its_table_of_bands() {
    let folder = Folder::new("mitsuba");
    for name in ["mitsuba_bands.exr", "mitsuba_bands.txt"] {
        std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name), folder.path(name)).unwrap();
    }
    let json = |line: &str| -> serde_json::Value {
        let output = folder.command(&format!("{line} --json --bands mitsuba_bands.txt"));
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let info = json("info mitsuba_bands.exr");
    assert_eq!((&info["size"], &info["bins"]), (&"6x4".into(), &"5 over 380.00 to 780.00 nm".into()));
    assert!(info["generatedBy"].as_str().unwrap().starts_with("Mitsuba version 3"));
    // The sky rises from 1 at 380 nm to 2 at 780 nm; the ball reflects half of it.
    let probe = json("probe mitsuba_bands.exr 0,0 3,2");
    for (place, share) in [(0, 1.0), (1, 0.5)] {
        for (nm, mean) in [410.0, 465.0, 530.0, 595.0, 700.0].iter().zip(probe[place]["mean"].as_array().unwrap()) {
            let exact = share * (1.0 + (nm - 380.0) / 400.0);
            assert!((mean.as_f64().unwrap() / exact - 1.0).abs() < 0.02, "{place}, {nm} nm: {mean} is not {exact}");
        }
    }
    folder.run("develop mitsuba_bands.exr -o a.exr --exposure 0 --bands mitsuba_bands.txt");
    let sky = abbe::spectrum::Spectrum::Table { nm: vec![380.0, 780.0], values: vec![1.0, 2.0], extend: false };
    let xyz = cie::xyz_of(&sky, Observer::Cie1931).map(|v| v / cie::xyz_of_unit(Observer::Cie1931)[1]);
    assert_near(rgb(&folder.path("a.exr")), abbe::color::convert::linear_srgb_of_xyz(xyz), 0.02, "the sky");
    let compared = json("compare mitsuba_bands.exr mitsuba_bands.exr");
    assert_eq!(compared["flip"]["max"].as_f64(), Some(0.0), "{compared}");
    folder.fails("info mitsuba_bands.exr", "--bands");
    folder.fails("probe mitsuba_bands.exr 0,0", "--bands");
}

#[test]
fn reflectances_are_shown_under_the_light_that_is_named() {
    let folder = Folder::new("reflective");
    let patch = library::reflectance("ColorChecker/red").unwrap();
    let channels: Vec<(String, f64)> =
        (0..36).map(|i| 380.0 + 10.0 * f64::from(i)).map(|nm| (format!("T.{nm}nm"), patch.mean(nm - 5.0, nm + 5.0))).collect();
    folder.write("red.exr", &channels, false);
    for (lamp, observer) in [("D65", Observer::Cie1931), ("FL11", Observer::Cie1931), ("A", Observer::Cie1964)] {
        let year = if observer == Observer::Cie1931 { "1931" } else { "1964" };
        folder.run(&format!("develop red.exr -o a.exr --illuminant {lamp} --white 0.3127,0.3290 --observer {year}"));
        let light = library::illuminant(lamp).unwrap();
        let white = cie::xyz_of(&light, observer)[1];
        let lit = abbe::spectrum::Spectrum::Product(Box::new((light, patch.clone())));
        let xyz = cie::xyz_of(&lit, observer).map(|v| v / white);
        assert_near(rgb(&folder.path("a.exr")), abbe::color::convert::linear_srgb_of_xyz(xyz), 1e-3, lamp);
    }
    // Its illuminant looks white unless another light is to: grey stays grey under a yellow lamp.
    let grey: Vec<(String, f64)> = channels.iter().map(|(name, _)| (name.clone(), 0.4)).collect();
    folder.write("grey.exr", &grey, false);
    folder.run("develop grey.exr -o a.exr --illuminant A");
    assert_near(rgb(&folder.path("a.exr")), [0.4; 3], 1e-6, "grey");
    // What others wrote.
    let theirs = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    for name in ["fichet_reflective_20.exr", "fichet_emissive_20.exr"] {
        std::fs::copy(theirs.join(name), folder.path(name)).unwrap();
        folder.run(&format!("develop {name} -o {name}.png"));
        let (info, values) = png(&folder.path(&format!("{name}.png")));
        assert!((info.width, info.height) == (5, 3) && values.iter().max() > Some(&100), "{name}");
    }
}

#[test]
fn any_number_of_bins_over_any_range_is_rendered_and_developed_or_refused() {
    let folder = Folder::new("bins");
    for bins in [1, 2, 3, 5, 31, 64, 399, 400] {
        folder.render(&format!(" --channels {bins}"));
        assert_eq!(folder.run("develop ball.exr -o a.png --observer 1964"), "", "{bins} bins");
        let (_, values) = png(&folder.path("a.png"));
        // The sphere is green, as far as one can tell from so many bins.
        let [r, g, b] = [81, 82, 83].map(|i| values[i]);
        assert!(bins < 5 || (g > r && g > b), "{bins} bins: {r} {g} {b}");
    }
    for (range, note) in [("300, 2500", ""), ("450, 600", "only 450 to 600"), ("300, 380", "nothing"), ("780, 2500", "nothing")] {
        let scene = SCENE.replace("\"bins\": 20", &format!("\"bins\": 40, \"range_nm\": [{range}]"));
        std::fs::write(folder.path("ball.json"), scene).unwrap();
        let _ = std::fs::remove_file(folder.path("ball.png"));
        let says = folder.render("");
        assert!(says.contains(note) && says.contains("note") != note.is_empty(), "{range}: {says}");
        assert_eq!(folder.path("ball.png").exists(), note != "nothing", "{range}");
        assert_eq!(SpectralImage::read(folder.path("ball.exr")).unwrap().bins(), 40);
        if note == "nothing" {
            folder.fails("develop ball.exr -o a.png", "380 to 780 nm");
        } else {
            assert!(folder.run("develop ball.exr -o a.png").contains(note), "{range}");
        }
    }
}

#[test]
fn wrong_requests_say_what_would_be_right() {
    let folder = Folder::new("wrong");
    folder.render("");
    for (line, says) in [
        ("develop ball.exr", "--output"),
        ("develop missing.exr -o a.png", "missing.exr"),
        ("develop ball.json -o a.png", "ball.json"),
        ("develop ball.exr -o a.gif", ".png"),
        ("develop ball.exr -o ./ball.exr", "another name"),
        ("develop ball.exr -o nowhere/a.png", "nowhere"),
        ("develop ball.exr -o a.png --space acescg", ".exr"),
        ("develop ball.exr -o a.png --space adobe", "rec2020"),
        ("develop ball.exr -o a.png --tone filmic", "agx"),
        ("develop ball.exr -o a.png --white D66", "D65"),
        ("develop ball.exr -o a.png --white 0.9,0.9", "0.3127"),
        ("develop ball.exr -o a.png --exposure bright", "auto:95"),
        ("develop ball.exr -o a.png --bits 10", "16"),
    ] {
        folder.fails(line, says);
        assert!(!folder.path("a.png").exists() && !folder.path("a.gif").exists(), "{line}");
    }
    assert_eq!(SpectralImage::read(folder.path("ball.exr")).unwrap().bins(), 20, "the render was replaced");
    folder.write("nan.exr", &[("S0.550nm".to_string(), f64::NAN), ("S0.600nm".to_string(), 1.0)], false);
    let says = folder.run("develop nan.exr -o a.png");
    assert!(says.contains("shown black: 1"), "{says}");
    let says = folder.run("develop ball.exr -o a.png --illuminant A");
    assert!(says.contains("note") && says.contains("reflectances"), "{says}");
    let help = folder.command("develop --help");
    let help = String::from_utf8_lossy(&help.stdout);
    for option in ["--gamut", "--illuminant", "Examples:", "CHANNEL LOW_NM HIGH_NM"] {
        assert!(help.contains(option), "{option}");
    }
}

/// 1200 x 1000 pixels are read back from an adapter in several parts.
#[test]
fn pictures_of_any_size_are_developed_on_every_device_and_in_every_format() {
    let folder = Folder::new("large");
    const SIZE: (usize, usize) = (1200, 1000);
    // Brighter from row to row, so that a part in the wrong place is seen.
    let row = |i: usize| (0.2 + 0.6 * (i / SIZE.0) as f32 / SIZE.1 as f32) / 20.0;
    let names = ["S0.450,000000nm", "S0.550,000000nm", "S0.650,000000nm"];
    let samples = FlatSamples::F32((0..SIZE.0 * SIZE.1).map(row).collect());
    let list = names.iter().map(|name| AnyChannel::new(*name, samples.clone())).collect();
    Image::from_channels(SIZE, AnyChannels::sort(list)).write().to_file(folder.path("large.exr")).unwrap();
    let develop = |device: &str, to: &str| {
        folder.run(&format!("develop large.exr -o {device}.{to} --exposure 0 --no-dither --device {device}"));
        folder.path(&format!("{device}.{to}"))
    };
    // The adapter has whatever name; all are of one kind or another.
    let gpu = abbe::gpu::list_adapters()[0].kind.clone();
    let [ours, exact] = [&gpu, "reference"].map(|device| png(&develop(device, "png")).1);
    assert_eq!(ours.len(), 3 * SIZE.0 * SIZE.1);
    assert!(ours.iter().zip(&exact).all(|(a, b)| a.abs_diff(*b) <= 1));
    assert!(exact[0] + 20 < exact[exact.len() - 1], "{} {}", exact[0], exact[exact.len() - 1]);
    let pixels = |path: &Path| {
        let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
        image.layer_data.channel_data.list[0].sample_data.values_as_f32().collect::<Vec<f32>>()
    };
    let [ours, exact] = [&gpu, "reference"].map(|device| pixels(&develop(device, "exr")));
    assert!(ours.len() == SIZE.0 * SIZE.1 && ours.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-4));
    for device in [&gpu, "reference"] {
        assert!(std::fs::metadata(develop(device, "jpg")).unwrap().len() > 10_000);
    }
}

#[test]
fn extreme_exposures_write_numbers_or_say_why_not() {
    let folder = Folder::new("extreme");
    let bins = |v: f64| (0..20).map(|i| (format!("S0.{},0nm", 390 + 20 * i), v)).collect::<Vec<_>>();
    folder.write("bright.exr", &bins(1e25), false);
    folder.write("dark.exr", &bins(1e-38), false);
    folder.fails(
        "develop bright.exr -o a.exr --exposure 100",
        "at +100 stops the brightest pixel is beyond single precision; choose a smaller --exposure",
    );
    assert!(!folder.path("a.exr").exists());
    for (file, more) in [
        ("bright", "--exposure 40"),
        ("bright", "--exposure -100"),
        ("bright", "--exposure auto"),
        ("dark", "--exposure auto"),
        ("dark", "--exposure 100"),
    ] {
        folder.run(&format!("develop {file}.exr -o a.exr {more}"));
        let values = rgb(&folder.path("a.exr"));
        assert!(values.iter().all(|v| v.is_finite() && *v > 0.0), "{file} {more}: {values:?}");
    }
    for tone in ["none", "reinhard", "aces", "agx"] {
        folder.run(&format!("develop bright.exr -o a.png --exposure 100 --tone {tone}"));
        // Equal energy is a little reddish beside D65.
        let (_, values) = png(&folder.path("a.png"));
        assert!(values.iter().all(|v| *v > 200) && values.iter().any(|v| *v > 250), "{tone}: {values:?}");
        folder.run(&format!("develop bright.exr -o a.jpg --exposure 100 --tone {tone}"));
    }
}

#[test]
fn a_render_makes_the_picture_that_develop_would_make_of_its_spectra() {
    let folder = Folder::new("render-picture");
    let png = |name: &str| std::fs::read(folder.path(name)).unwrap();
    folder.render(" -o plain.exr");
    for (i, (asked, developed)) in [
        ("--exposure auto+1 --tone agx --space p3", "--tone agx --space p3"),
        ("--exposure -0.5 --gamut clip", "--gamut clip"),
        ("--exposure auto:50", "--exposure auto:50"),
    ]
    .into_iter()
    .enumerate()
    {
        folder.render(&format!(" {asked} --keep-checkpoint -o {i}.exr"));
        // The exposure is that of the file.
        folder.run(&format!("develop {i}.exr -o {i}_developed.png {developed}"));
        assert_eq!(png(&format!("{i}.png")), png(&format!("{i}_developed.png")), "{asked}");
        folder.run(&format!("develop plain.exr -o {i}_plain.png {asked}"));
        assert_eq!(png(&format!("{i}.png")), png(&format!("{i}_plain.png")), "{asked}");
        assert_ne!(png(&format!("{i}.png")), png("plain.png"), "{asked}");
        // Who goes on with it need not say it again.
        folder.run(&format!("render --resume {i}.exr --spp 5"));
        folder.run(&format!("develop {i}.exr -o {i}_more.png {developed}"));
        assert_eq!(png(&format!("{i}.png")), png(&format!("{i}_more.png")), "{asked}, gone on with");
    }
    folder.fails("render ball.json --space acescg", "abbe develop");
}
