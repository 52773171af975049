//! The spectral EXR and the picture: what is written, what is read back, and what happens to damaged or interrupted files.

use abbe::develop::picture::Development;
use abbe::film::Film;
use abbe::output::exr::{Aovs, channel_name};
use abbe::output::picture::Precision;
use abbe::output::{Provenance, Quantity, SpectralImage, check_writable, replace_file, write_exr, write_picture};
use abbe::scene::{Bins, FilmSettings};
use abbe::stats::BatchStats;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A folder of its own for a test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("abbe-exr-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn film(width: u32, height: u32, count: u32) -> Film {
    let bins = Bins { min_nm: 380.0, max_nm: 780.0, count };
    let settings = FilmSettings::new(width, height, bins);
    let mut film = Film::new(&settings);
    let values = film.pixels() * film.channels();
    for batch in 0..2 {
        let sums: Vec<f64> = (0..values).map(|i| ((i * 37 + batch * 11) % 101) as f64 * 0.25).collect();
        film.add_batch_f64(&sums, 2);
    }
    film
}

fn provenance() -> Provenance {
    Provenance {
        scene: "spheres \u{2014} two".to_string(),
        scene_hash: "fnv1a64:0".to_string(),
        max_depth: 64,
        device: "a device".to_string(),
        seed: u64::MAX,
        techniques: "all".to_string(),
        merging: false,
        film_sr: None,
        seconds: 1.5,
        stats: BatchStats {
            paths: 1,
            rays: 1 << 40,
            dropped_not_finite: 3,
            dropped_negative: 4,
            dropped_saturated: 6,
            unfinished: 7,
            truncated: 5,
            ..BatchStats::default()
        },
        exposure: Some(-2.0),
        irradiance: false,
        frame: Some(17),
        options: serde_json::json!({}),
        interrupted: false,
    }
}

fn sample() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fichet_emissive_20.exr")
}

#[test]
fn what_is_written_is_read_back() {
    let folder = Folder::new("round-trip");
    let path = folder.0.join("a.exr");
    // More rows than the 16 of a ZIP block, and not a multiple of them.
    for (width, height, bins) in [(7, 37, 20), (1, 1, 1), (33, 16, 80)] {
        let film = film(width, height, bins);
        write_exr(&path, &film, &provenance(), Aovs { errors: true, ..Aovs::default() }).unwrap();
        let image = SpectralImage::read(&path).unwrap();
        assert_eq!((image.width, image.height, image.bins()), (width as usize, height as usize, bins as usize));
        for pixel in 0..film.pixels() {
            for b in 0..film.bins() {
                assert_eq!(image.pixel(pixel)[b], film.bin(pixel, b) as f32);
                let error = format!("error.{}", &channel_name(film.settings().bins.centre_nm(b as u32))[3..]);
                assert_eq!(image.other(&error).unwrap()[pixel], film.errors(b).standard_error(pixel) as f32);
            }
            for (name, c) in [("XYZ.X", 0), ("XYZ.Y", 1), ("XYZ.Z", 2)] {
                assert_eq!(image.other(name).unwrap()[pixel], film.xyz(pixel)[c] as f32);
            }
            assert_eq!(image.other("error.Y").unwrap()[pixel], film.errors(film.bins() + 1).standard_error(pixel) as f32);
        }
        for (b, nm) in image.wavelengths_nm.iter().enumerate() {
            assert!((nm - film.settings().bins.centre_nm(b as u32)).abs() < 1e-6);
        }
    }
    assert_eq!(folder.names(), ["a.exr"]);
}

#[test]
fn the_layout_is_that_of_fichets_sample() {
    let folder = Folder::new("layout");
    let path = folder.0.join("a.exr");
    write_exr(&path, &film(5, 3, 20), &provenance(), Aovs::default()).unwrap();
    let layout = |path: &Path| {
        let meta = exr::meta::MetaData::read_from_file(path, true).unwrap();
        let header = &meta.headers[0];
        let channels: Vec<_> = header.channels.list.iter().map(|c| (c.name.to_string(), c.sample_type)).collect();
        let text = |name: &str| header.own_attributes.other.get(&exr::prelude::Text::from(name)).cloned();
        let attributes =
            ["spectralLayoutVersion", "emissiveUnits", "EV"].map(|name| text(name).map(|v| (v.kind_name().to_vec(), v)));
        (channels, attributes, header.compression)
    };
    let (mut ours, theirs) = (layout(&path), layout(&sample()));
    assert_eq!(ours.2, theirs.2);
    ours.0.retain(|(name, _)| !name.starts_with("XYZ."));
    assert_eq!(ours.0, theirs.0);
    assert!(ours.0.iter().any(|(name, _)| name == "S0.390,000000nm"));
    // The same attributes of the same types; EV has our value.
    let kinds = |a: &[Option<(Vec<u8>, exr::meta::attribute::AttributeValue)>; 3]| a.clone().map(|a| a.map(|a| a.0));
    assert_eq!(kinds(&ours.1), kinds(&theirs.1));
    assert_eq!(ours.1[..2], theirs.1[..2]);
}

#[test]
fn the_header_says_where_the_picture_comes_from() {
    let folder = Folder::new("header");
    let path = folder.0.join("a.exr");
    write_exr(&path, &film(2, 2, 4), &provenance(), Aovs::default()).unwrap();
    let image = SpectralImage::read(&path).unwrap();
    for (name, value) in [
        ("spectralLayoutVersion", "1.0"),
        ("emissiveUnits", "W.m^-2.sr^-1"),
        ("EV", "-2"),
        ("abbe.version", env!("CARGO_PKG_VERSION")),
        ("abbe.sceneHash", "fnv1a64:0"),
        ("abbe.maxDepth", "64"),
        ("abbe.device", "a device"),
        ("abbe.quantity", "radiance W.m^-2.sr^-1.nm^-1"),
        ("abbe.range", "380 780 nm"),
        ("abbe.seed", "18446744073709551615"),
        ("abbe.samples", "4"),
        ("abbe.batches", "2"),
        ("abbe.seconds", "1.5"),
        ("abbe.rays", "1099511627776"),
        ("abbe.droppedNotFinite", "3"),
        ("abbe.droppedNegative", "4"),
        ("abbe.droppedSaturated", "6"),
        ("abbe.droppedUnfinished", "7"),
        ("abbe.truncated", "5"),
    ] {
        assert_eq!(image.attribute(name), Some(value), "{name}");
    }
    assert!(image.attribute("abbe.scene").is_some_and(|s| s.starts_with("spheres ") && s.ends_with(" two")));
    assert!(image.other("error.Y").is_none());
}

#[test]
fn the_preview_is_linear_srgb_at_the_stated_exposure() {
    let folder = Folder::new("preview");
    let path = folder.0.join("a.exr");
    let mut film = film(1, 1, 1);
    // Equal-energy light of 1 W m^-2 sr^-1 nm^-1 has luminance 1 before the exposure of -2 stops.
    let white = abbe::color::cie::xyz_of_unit(abbe::spectrum::library::Observer::Cie1931);
    film = Film::new(film.settings());
    film.add_batch_f64(&[1.0, white[0], white[1], white[2]], 1);
    write_exr(&path, &film, &provenance(), Aovs::default()).unwrap();
    let image = SpectralImage::read(&path).unwrap();
    let rgb = ["R", "G", "B"].map(|c| f64::from(image.other(c).unwrap()[0]));
    // Rec. 709 luminance of the stored RGB; the equal-energy point is pinkish beside D65.
    let y = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    assert!((y - 0.25).abs() < 1e-4, "{rgb:?}");
    assert!((rgb[0] / 0.25 - 1.2048).abs() < 1e-3 && (rgb[1] / 0.25 - 0.9483).abs() < 1e-3, "{rgb:?}");
}

#[test]
fn fichets_sample_is_read() {
    let image = SpectralImage::read(sample()).unwrap();
    assert_eq!((image.width, image.height, image.bins()), (5, 3, 20));
    let centres: Vec<f64> = (0..20).map(|b| 390.0 + 20.0 * f64::from(b)).collect();
    assert_eq!(image.wavelengths_nm, centres);
    // Means of the first and last channel, as OpenEXR's own library reads them.
    for (b, mean) in [(0, 0.470_770_96), (19, 0.400_005_6)] {
        let ours = (0..15).map(|p| f64::from(image.pixel(p)[b])).sum::<f64>() / 15.0;
        assert!((ours - mean).abs() < 1e-6, "channel {b}: {ours}");
    }
    assert_eq!(image.attribute("emissiveUnits"), Some("W.m^-2.sr^-1"));
}

#[test]
fn half_floats_and_odd_bins_are_read() {
    use exr::prelude::*;
    let folder = Folder::new("half");
    let path = folder.0.join("a.exr");
    let half = |v: f32| vec![f16::from_f32(v), f16::from_f32(2.0 * v)];
    let channels = vec![
        AnyChannel::new("S0.0,6um", FlatSamples::F16(half(3.0))),
        AnyChannel::new("S0.450,5nm", FlatSamples::F32(vec![1.0, 2.0])),
        AnyChannel::new("S0.500nm", FlatSamples::F16(half(2.0))),
        AnyChannel::new("S1.500nm", FlatSamples::F16(half(9.0))),
    ];
    let image = Image::from_channels((2, 1), AnyChannels::sort(channels.into_iter().collect()));
    image.write().to_file(&path).unwrap();
    let image = SpectralImage::read(&path).unwrap();
    assert_eq!(image.wavelengths_nm, [450.5, 500.0, 600.0]);
    assert_eq!(image.data, [1.0, 2.0, 3.0, 2.0, 4.0, 6.0]);
    assert_eq!(image.others.len(), 1);
}

#[test]
fn what_pbrt_writes_is_read() {
    // What the file is, and where its values come from: tools/make-pbrt-exr.py.
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/pbrt_spectral_16.exr");
    let image = SpectralImage::read(path).unwrap();
    assert_eq!((image.quantity, image.width, image.height, image.bins()), (Quantity::Emissive, 5, 3, 16));
    assert!((image.edges_nm()[0] - 360.0).abs() < 2e-3 && (image.edges_nm()[16] - 830.0).abs() < 2e-3);
    for (i, (x, y)) in (0..3).flat_map(|y| (0..5).map(move |x| (x, y))).enumerate() {
        for (b, value) in image.pixel(i).iter().enumerate() {
            let nm = 360.0 + 470.0 / 16.0 * (b as f64 + 0.5);
            let exact = f64::from(x + 1) / 4.0 * (-((nm - 450.0 - 60.0 * f64::from(y)) / 80.0).powi(2)).exp();
            // Half floats have 11 digits, and below 2^-14 steps of 2^-24.
            let step = (exact / 2048.0).max(f64::exp2(-25.0));
            assert!((f64::from(*value) - exact).abs() <= step, "pixel {x}, {y} at {nm} nm: {value} is not {exact}");
        }
    }
    assert_eq!(image.other("B"), Some([0.125; 15].as_slice()));
    assert_eq!((image.attribute("renderTimeSeconds"), image.attribute("samplesPerPixel")), (Some("1.5"), Some("16")));
}

#[test]
fn tiles_and_layers_are_read() {
    use exr::prelude::*;
    let folder = Folder::new("tiles");
    let path = folder.0.join("a.exr");
    let (width, height) = (37, 21);
    let value = |channel: usize, i: usize| (1000 * channel + i) as f32;
    let channel = |name, n| AnyChannel::new(name, FlatSamples::F32((0..width * height).map(|i| value(n, i)).collect()));
    let layer = |name, channels: [AnyChannel<FlatSamples>; 3], blocks, compression| {
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        Layer::new((width, height), LayerAttributes::named(name), encoding, AnyChannels::sort(channels.into_iter().collect()))
    };
    let spectrum = || [channel("S0.450nm", 1), channel("S0.500nm", 2), channel("Z", 3)];
    for compression in [Compression::Uncompressed, Compression::ZIP16, Compression::PIZ] {
        // Tiles that share rows, the last of each row and column cut short; behind a layer without a spectrum.
        let flat = layer("picture", ["R", "G", "B"].map(|name| channel(name, 9)), Blocks::ScanLines, Compression::ZIP16);
        let tiled = layer("spectrum", spectrum(), Blocks::Tiles(Vec2(16, 8)), compression);
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((width, height)));
        let image = Image { attributes, layer_data: Layers::from([flat, tiled]) };
        image.write().to_file(&path).unwrap();
        let image = SpectralImage::read(&path).unwrap();
        assert_eq!((image.width, image.height, image.bins(), image.others.len()), (width, height, 2, 1));
        for i in 0..width * height {
            assert_eq!(image.pixel(i), [value(1, i), value(2, i)], "{compression:?}, pixel {i}");
            assert_eq!(image.other("Z").unwrap()[i], value(3, i));
        }
    }
}

#[test]
fn a_reflectance_image_is_read_as_one() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fichet_reflective_20.exr");
    let image = SpectralImage::read(path).unwrap();
    assert_eq!((image.quantity, image.width, image.height, image.bins()), (Quantity::Reflective, 5, 3, 20));
    assert_eq!((image.edges_nm()[0], image.edges_nm()[20]), (380.0, 780.0));
    assert_eq!(SpectralImage::read(sample()).unwrap().quantity, Quantity::Emissive);
}

#[test]
fn what_is_no_spectral_image_is_refused_with_a_remedy() {
    let folder = Folder::new("rgb");
    let path = folder.0.join("a.exr");
    write_picture(&path, &[[1.0; 3]; 6], 3, &Development::default(), Precision::default(), None).unwrap();
    let error = SpectralImage::read(&path).unwrap_err().to_string();
    assert!(error.contains("no spectral channels") && error.contains("S0.390,000000nm") && error.contains("--bands"), "{error}");
    assert!(SpectralImage::read("no such file.exr").is_err());
}

#[test]
fn damaged_files_are_errors_or_pictures_but_never_panics() {
    let folder = Folder::new("damaged");
    let path = folder.0.join("a.exr");
    write_exr(&path, &film(5, 19, 3), &provenance(), Aovs::default()).unwrap();
    let ours = std::fs::read(&path).unwrap();
    let theirs = std::fs::read(sample()).unwrap();
    let mut refused = 0;
    for whole in [&ours, &theirs] {
        for length in 0..whole.len() {
            assert!(SpectralImage::from_bytes(&whole[..length]).is_err(), "cut to {length} bytes");
        }
        // Every byte of the header and of the first blocks, turned into values that hurt; then pairs of bytes all over.
        for at in 0..whole.len().min(1500) {
            for value in [0x00, 0x7f, 0x80, 0xff, whole[at] ^ 0x01] {
                let mut bytes = whole.clone();
                bytes[at] = value;
                refused += usize::from(SpectralImage::from_bytes(&bytes).is_err());
            }
        }
        let mut state = 1u64;
        let mut random = |n: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % n
        };
        for _ in 0..2000 {
            let mut bytes = whole.clone();
            for _ in 0..2 {
                let at = random(bytes.len());
                bytes[at] = random(256) as u8;
            }
            refused += usize::from(SpectralImage::from_bytes(&bytes).is_err());
        }
    }
    assert!(refused > 1000, "only {refused} of the damaged files were noticed");
}

#[test]
fn a_header_that_promises_too_much_is_refused_before_memory_is() {
    // dataWindow and displayWindow of the sample end at (4, 2); let them end at (2^24, 2^24).
    let mut bytes = std::fs::read(sample()).unwrap();
    let find = |bytes: &[u8], what: &[u8]| bytes.windows(what.len()).position(|w| w == what).unwrap();
    for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = find(&bytes, name) + name.len() + 4 + 8;
        bytes[at..at + 8].copy_from_slice(&[0, 0, 0, 1, 0, 0, 0, 1]);
    }
    let error = SpectralImage::from_bytes(&bytes).unwrap_err();
    assert!(error.contains("promises"), "{error}");
}

#[test]
fn an_interrupted_write_leaves_the_old_file() {
    let folder = Folder::new("interrupted");
    let path = folder.0.join("a.exr");
    std::fs::write(&path, "old").unwrap();
    let failed = replace_file(&path, |file| {
        file.write_all(&[0; 100_000])?;
        assert_eq!(folder.names().len(), 2, "the new file grows beside the old one");
        Err(std::io::Error::other("no more"))
    });
    assert!(failed.is_err_and(|e| e.to_string().contains("no more")));
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(folder.names(), ["a.exr"]);

    // The same when the process would die: nothing but the temporary file has been touched.
    let _ = replace_file(&path, |file| {
        file.write_all(b"new")?;
        abbe::output::remove_temporaries();
        assert_eq!(folder.names(), ["a.exr"]);
        Ok::<(), std::io::Error>(())
    });
    assert_eq!(std::fs::read(&path).unwrap(), b"old");

    replace_file(&path, |file| file.write_all(b"new")).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"new");
    assert_eq!(folder.names(), ["a.exr"]);
}

#[test]
fn what_cannot_be_written_is_known_beforehand() {
    let folder = Folder::new("writable");
    check_writable(&folder.0.join("a.exr"), None::<&Path>).unwrap();
    assert!(folder.names().is_empty());
    for path in [folder.0.join("missing/a.exr"), folder.0.clone()] {
        let error = check_writable(&path, None::<&Path>).unwrap_err().to_string();
        assert!(error.contains("cannot write here") && error.contains("-o"), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn links_stay_links() {
    let folder = Folder::new("links");
    std::fs::create_dir(folder.0.join("far")).unwrap();
    std::os::unix::fs::symlink("far/b.exr", folder.0.join("a.exr")).unwrap();
    std::fs::write(folder.0.join("far/b.exr"), "old").unwrap();
    replace_file(&folder.0.join("a.exr"), |file| file.write_all(b"new")).unwrap();
    assert_eq!(std::fs::read(folder.0.join("far/b.exr")).unwrap(), b"new");
    assert!(folder.0.join("a.exr").symlink_metadata().unwrap().is_symlink());
    // A device is no place to put a file, and must survive the attempt.
    assert!(check_writable(Path::new("/dev/null"), None::<&Path>).is_err());
}

#[test]
fn light_and_exposure_beyond_single_precision_stay_finite_in_the_file() {
    let mut film = film(1, 1, 2);
    film.add_batch_f64(&[1e30; 5], 1);
    let path = std::env::temp_dir().join(format!("abbe-bright-{}.exr", std::process::id()));
    let provenance = Provenance { exposure: Some(100.0), ..provenance() };
    write_exr(&path, &film, &provenance, Aovs { errors: true, ..Default::default() }).unwrap();
    let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    for channel in image.layer_data.channel_data.list {
        assert!(channel.sample_data.values_as_f32().all(f32::is_finite), "{}", channel.name);
    }
}
