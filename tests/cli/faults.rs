//! A device that fails, at any call and in any way, costs no render: the process ends in order, and what was done before is written.

use crate::support::{Folder, text};
use abbe::output::SpectralImage;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/prism.json");
const LAYER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/faults/vulkan_faults.c");
/// Of a pixel: so few that each makes a batch.
const SAMPLES: u32 = 16;

/// Builds the layer in `folder`, with the manifest that the Vulkan loader looks for.
fn build_layer(folder: &Path) {
    let library = folder.join("libfaults.so");
    let built = Command::new("cc").args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library).arg(LAYER).output();
    let built = built.unwrap_or_else(|e| panic!("not run: the layer needs a C compiler, cc: {e}"));
    assert!(built.status.success(), "not run: {}", text(&built.stderr));
    let manifest = serde_json::json!({"file_format_version": "1.1.2", "layer": {
        "name": "VK_LAYER_ABBE_faults", "type": "GLOBAL", "library_path": library, "api_version": "1.3.0", "implementation_version": "1",
        "description": "Lets calls fail", "enable_environment": {"ABBE_FAULTS_ON": "1"}, "disable_environment": {"ABBE_FAULTS_OFF": "1"}}});
    let layers = folder.join("vulkan/implicit_layer.d");
    std::fs::create_dir_all(&layers).unwrap();
    std::fs::write(layers.join("faults.json"), manifest.to_string()).unwrap();
}

/// Renders to `out.exr` under the layer, with one more variable for it.
fn render(folder: &Folder, spp: u32, (variable, value): (&str, &str)) -> Output {
    let _ = std::fs::remove_file(folder.0.join("out.exr"));
    let spp = spp.to_string();
    let mut command = folder.command(&["render", SCENE, "--size", "16x16", "--spp", &spp, "-o", "out.exr"]);
    command.env("XDG_DATA_HOME", &folder.0).env("ABBE_FAULTS_ON", "1").env(variable, value).output().unwrap()
}

#[test]
fn no_fault_of_a_device_costs_what_was_rendered() {
    let faults: usize = std::env::var("ABBE_DEVICE_FAULTS").map_or(14, |n| n.parse().expect("a number of faults"));
    let folder = Folder::new("faults");
    build_layer(&folder.0);
    let clean = render(&folder, SAMPLES, ("ABBE_FAULT_COUNTS", "counts"));
    assert!(clean.status.success(), "{}", text(&clean.stderr));
    let counts = std::fs::read_to_string(folder.0.join("counts")).expect("not run: the Vulkan loader does not take the layer");
    let counts = counts.lines().map(|line| line.split_once(' ').unwrap()).map(|(call, n)| (call, n.parse::<usize>().unwrap()));
    let calls: Vec<(&str, usize)> = counts.filter(|(_, count)| *count > 0).collect();
    assert!(calls.len() >= 5, "{calls:?}");

    let mut spectra = BTreeMap::new();
    let (mut struck, mut failed, mut saved, mut went_on) = (0, 0, 0, 0);
    for i in 0..faults {
        let (call, count) = calls[i % calls.len()];
        // Out of host memory, out of device memory, device lost; once or for good.
        let turn = i / calls.len();
        let (result, sticky) = ([-4, -2, -1][turn % 3], turn % 4 / 2);
        // All over the calls of the render, by the golden section.
        let after = ((i as f64 * 0.618).fract() * count as f64) as usize;
        let fault = format!("{call}:{after}:{result}:{sticky}");
        let output = render(&folder, SAMPLES, ("ABBE_FAULT", &fault));
        let stderr = text(&output.stderr);
        // Besides what wgpu logs.
        let errors = stderr.lines().filter(|line| line.starts_with("error: ") && !line.starts_with("error: wgpu")).count();
        assert!(!stderr.contains("panicked"), "{fault}: {stderr}");
        match output.status.code() {
            Some(0) => assert_eq!(errors, 0, "{fault}: {stderr}"),
            // A device that cannot be opened, and one that fails at work.
            Some(2 | 3) => {
                let last = stderr.lines().last().unwrap();
                assert!(errors == 1 && last.starts_with("error: ") && last.contains("; "), "{fault}: {stderr}");
            }
            other => panic!("{fault}: exit code {other:?}: {stderr}"),
        }
        struck += usize::from(stderr.contains("[fault: "));
        failed += usize::from(output.status.code() == Some(3));
        let path = folder.0.join("out.exr");
        assert_eq!(path.exists(), stderr.contains(" spp, "), "{fault}: what was done is lost, or is no render: {stderr}");
        if path.exists() {
            let image = SpectralImage::read(&path).unwrap();
            let samples: u32 = image.attribute("abbe.samples").unwrap().parse().unwrap();
            assert!(output.status.code() == Some(3) || samples == SAMPLES, "{fault}: {stderr}");
            saved += usize::from(samples < SAMPLES);
            // Not a number of what the device failed at is in there.
            let expected = spectra.entry(samples).or_insert_with(|| {
                render(&folder, samples, ("ABBE_FAULT_COUNTS", "counts"));
                SpectralImage::read(folder.0.join("out.exr")).unwrap()
            });
            if stderr.contains("smaller tiles") {
                // Its light paths were traced for other tiles.
                went_on += usize::from(samples == SAMPLES);
                assert_alike(&image, expected, &fault);
            } else {
                assert!(
                    image.data == expected.data,
                    "{fault}: {samples} samples per pixel are not those of a device that is well"
                );
            }
        }
    }
    assert!(
        struck >= faults * 2 / 3 && failed >= faults / 4 && saved >= faults / 8 && went_on >= faults / 8,
        "{struck} struck, {failed} failed, {saved} saved, {went_on} went on"
    );
    println!(
        "faults: {faults}, of which {struck} struck and {failed} ended the render, {saved} of them with something done; {went_on} went on with smaller tiles"
    );
}

/// Means of the bins over the two pictures differ by no more than their errors say.
fn assert_alike(a: &SpectralImage, b: &SpectralImage, fault: &str) {
    let means = |image: &SpectralImage| -> Vec<f64> {
        let bins = image.data.len() / 256;
        (0..bins).map(|bin| image.data.iter().skip(bin).step_by(bins).map(|&v| f64::from(v)).sum::<f64>() / 256.0).collect()
    };
    let errors = |image: &SpectralImage| -> Vec<f64> {
        let text = image.attribute("abbe.meanErrors").expect("errors of the means");
        text.split_whitespace().map(|error| error.parse().unwrap()).collect()
    };
    let pairs = means(a).into_iter().zip(means(b)).zip(errors(a).into_iter().zip(errors(b)));
    for (bin, ((a, b), (error_a, error_b))) in pairs.enumerate() {
        let error = error_a.hypot(error_b);
        assert!((a - b).abs() <= 5.0 * error, "{fault}: bin {bin}: {a} is not {b} within {error}");
    }
}

#[test]
fn a_signal_ends_a_batch_between_dispatches() {
    let folder = Folder::new("between-dispatches");
    // Batches of four million samples.
    let command = ["render", SCENE, "--size", "640x480", "--spp", "1024", "-o", "out.exr"];
    let mut child = folder.command(&command).spawn().unwrap();
    let mut stderr = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("plan: ") {
        line.clear();
        assert!(std::io::BufRead::read_line(&mut stderr, &mut line).unwrap() > 0, "it ended without a plan");
    }
    std::thread::sleep(std::time::Duration::from_millis(500));
    let start = std::time::Instant::now();
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    std::io::Read::read_to_string(&mut stderr, &mut line).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(143), "{line}");
    // The batch would take far longer, also on a machine that is busy with other tests.
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
    assert!(line.contains("nothing is written") && folder.names() == ["ball.json"], "{line}");
}
