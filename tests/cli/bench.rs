//! `abbe bench`: rows, references and the picture.

use super::support::{Folder, fails, text};
use serde_json::Value;

fn rows(lines: &str) -> Vec<Value> {
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).filter(|row: &Value| row["not_run"].is_null()).collect()
}

/// The last row of each method.
fn ends(lines: &str) -> Vec<Value> {
    let mut ends: Vec<Value> = Vec::new();
    for row in rows(lines) {
        match ends.last_mut() {
            Some(end) if end["method"] == row["method"] => *end = row,
            _ => ends.push(row),
        }
    }
    ends
}

#[test]
fn bench_compares_with_a_reference() {
    let folder = Folder::new("bench");
    let render = folder.run(&["render", "ball.json", "--device", "reference", "--spp", "64", "--seed", "5"]);
    assert!(render.status.success());
    let bench = |more: &[&str]| {
        let output = folder.run(&[&["bench", "ball.json", "--device", "reference", "--spp", "64", "--json"], more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        ends(&text(&output.stdout)).remove(0)
    };
    assert!(bench(&[])["relative_mse"].is_null());
    // Against itself nothing but the rounding to f32 is left; against another seed, noise.
    let same = bench(&["--reference", "ball.exr", "--seed", "5"])["relative_mse"].as_f64().unwrap();
    let other = bench(&["--reference", "ball.exr", "--seed", "6"])["relative_mse"].as_f64().unwrap();
    assert!(same < 1e-12, "{same}");
    assert!(other > 1e-9 && other < 0.1, "{other}");
    // A reference's own error is taken off; a folder holds references by the names of the scenes.
    let references = folder.0.join("references/ball");
    std::fs::create_dir_all(&references).unwrap();
    std::fs::copy(folder.0.join("ball.exr"), references.join("reference.exr")).unwrap();
    std::fs::copy(folder.0.join("ball.exr"), references.join("reference_error.exr")).unwrap();
    let net = bench(&["--reference", "references", "--seed", "5"]);
    assert!(net["relative_mse"].as_f64().unwrap() < -0.01, "{net}");
    assert!(net["relative_mse_bins"].as_f64().unwrap() < -0.1, "{net}");
    assert!(net["camera_rays_per_second"].is_null(), "the reference has no camera pass");
    fails(
        &folder,
        &["bench", "ball.json", "--device", "reference", "--channels", "5", "--reference", "ball.exr", "--json"],
        &["does not match"],
    );
}

#[test]
fn every_doubling_of_the_samples_of_every_method_is_a_row() {
    let folder = Folder::new("bench-rows");
    let bench = ["bench", "ball.json", "--device", "reference", "--spp", "48", "--methods", "all,backward"];
    let made = folder.run(&[&bench[..4], &["--spp", "512", "--make-references", "references"]].concat());
    assert!(made.status.success(), "{}", text(&made.stderr));
    assert!(folder.0.join("references/ball/reference.exr").exists());

    let output = folder.run(&[&bench[..], &["--reference", "references", "--json", "-o", "out.json"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let rows = rows(&text(&output.stdout));
    let samples: Vec<u64> = rows.iter().map(|row| row["samples_per_pixel"].as_u64().unwrap()).collect();
    assert_eq!(samples, [1, 2, 4, 8, 16, 32, 48, 1, 2, 4, 8, 16, 32, 48]);
    for row in &rows {
        for key in ["scene", "method", "plan", "device", "machine", "date"] {
            assert!(row[key].as_str().is_some_and(|text| !text.is_empty()), "{key}: {row}");
        }
        for key in ["seconds", "rays", "samples", "relative_mse", "relative_mse_bins"] {
            assert!(row[key].is_number(), "{key}: {row}");
        }
        assert_eq!(row["samples"].as_u64().unwrap(), 48 * row["samples_per_pixel"].as_u64().unwrap());
    }
    // One batch says nothing of its error.
    let known: Vec<bool> = rows[..7].iter().map(|row| row["relative_error"].is_number()).collect();
    assert_eq!(known, [false, true, true, true, true, true, true]);
    let file = std::fs::read_to_string(folder.0.join("out.json")).unwrap();
    let file: Vec<Value> = serde_json::from_str(&file).unwrap();
    let printed = text(&output.stdout);
    let printed: Vec<Value> = printed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(file, printed);
    let svg = std::fs::read_to_string(folder.0.join("out.svg")).unwrap();
    assert!(svg.contains(">ball</text>") && svg.contains(">all") && svg.contains(">backward"), "{svg}");
}

#[test]
fn a_place_that_cannot_be_written_to_is_found_before_the_work() {
    let folder = Folder::new("bench-place");
    fails(&folder, &["bench", "ball.json", "--device", "reference", "-o", "nowhere/out.json"], &["nowhere"]);
    fails(&folder, &["bench", "ball.json", "-o", "out.txt"], &[".json"]);
    fails(&folder, &["bench", "ball.json", "--methods", "sideways"], &["sideways", "backward"]);
}

#[cfg(unix)]
#[test]
fn another_renderer_takes_turns_or_is_said_not_to_run() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new("bench-peer");
    let common = ["bench", "cornell_box", "--size", "8x8", "--device", "reference", "--json"];
    assert!(folder.run(&[&common[..], &["--spp", "2048", "--make-references", "references"]].concat()).status.success());
    // In the place of Python with Mitsuba, what speaks as tools/mitsuba_peer.py does, and renders black.
    let stand_in = |script: &str| {
        let python = folder.0.join("python3");
        std::fs::write(&python, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).unwrap();
        let mut command =
            folder.command(&[&common[..], &["--spp", "12", "--reference", "references", "--peer", "mitsuba"]].concat());
        let output = command.env("PATH", format!("{}:/usr/bin:/bin", folder.0.display())).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout).lines().map(|line| serde_json::from_str(line).unwrap()).collect::<Vec<Value>>()
    };
    let rows = stand_in(
        r#"read -r scene
        image=$(printf '%s' "$scene" | sed 's/.*"image":"\([^"]*\)".*/\1/')
        echo '{"name": "Stand-in", "setup": 0.5}'
        spp=0
        while read -r seconds; do
            spp=$((spp + 32))
            head -c 5120 /dev/zero > "$image"
            echo "{\"spp\": $spp, \"cpu\": $seconds, \"wall\": $seconds}"
        done"#,
    );
    let methods: Vec<&str> = rows.iter().filter_map(|row| row["method"].as_str()).collect();
    assert_eq!(methods, ["all", "mitsuba-path", "mitsuba-ptracer"].repeat(methods.len() / 3), "in turns");
    assert!(methods.len() >= 9);
    for turn in rows.chunks_exact(3) {
        assert_eq!(turn[1]["cpu_seconds"], turn[0]["cpu_seconds"], "as much time");
        assert!(turn[1]["device"] == "Stand-in" && turn[1]["rays_per_second"].is_null() && turn[1]["setup_seconds"] == 0.5);
        // Nothing but black: all of the light is missing.
        let black = turn[1]["relative_mse"].as_f64().unwrap();
        assert!(black > 0.5 && black < 1.0 && turn[0]["relative_mse"] != turn[1]["relative_mse"], "{turn:?}");
    }
    let rows = stand_in("printf 'LLVM ERROR: Cannot select\n and a page\n of detail\n' >&2; exit 1");
    assert!(rows.iter().any(|row| row["not_run"] == "LLVM ERROR: Cannot select"), "{rows:?}");
    let rows = stand_in("echo 'ModuleNotFoundError: No module named mitsuba' >&2; exit 1");
    let missing: Vec<&Value> = rows.iter().filter(|row| row["method"] == "mitsuba-path").collect();
    assert_eq!((missing.len(), missing[0]["not_run"].as_str()), (1, Some("ModuleNotFoundError: No module named mitsuba")));
}
