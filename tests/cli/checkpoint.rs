//! Checkpoints: a render that was stopped or killed goes on, and shares become one picture.

use crate::support::{Folder, fails, text};
use abbe::output::SpectralImage;
use std::process::{Command, Output};
use std::time::Duration;

fn run(folder: &Folder, arguments: &str) -> Output {
    let output = folder.run(&arguments.split_whitespace().collect::<Vec<_>>());
    assert!(output.status.success(), "{arguments}: {}", text(&output.stderr));
    output
}

/// The values of a file, without its header.
fn values(folder: &Folder, name: &str) -> (Vec<f32>, Vec<(String, Vec<f32>)>) {
    let image = SpectralImage::read(folder.0.join(name)).unwrap();
    (image.data, image.others)
}

const RENDER: &str = "render ball.json --device reference --aov error --quiet";

#[test]
fn samples_are_added_to_a_finished_render_as_if_they_had_been_asked_for_at_once() {
    let folder = Folder::new("add-samples");
    run(&folder, &format!("{RENDER} --spp 144 -o whole.exr"));
    run(&folder, &format!("{RENDER} --spp 80 -o part.exr --keep-checkpoint"));
    assert_ne!(values(&folder, "whole.exr"), values(&folder, "part.exr"));
    // All that was asked for is known; only what is to be added is said.
    run(&folder, "render --resume part.exr --spp 144 --quiet");
    assert_eq!(values(&folder, "whole.exr"), values(&folder, "part.exr"));
    assert_eq!(folder.names(), ["ball.json", "part.exr", "part.png", "whole.exr", "whole.png"], "a checkpoint is left");
}

#[test]
fn a_render_that_a_signal_ends_leaves_a_checkpoint() {
    let folder = Folder::new("signal-resume");
    run(&folder, &format!("{RENDER} --spp 4000 -o whole.exr"));
    let mut child = folder
        .command(&"render ball.json --device reference --aov error --spp 4000".split(' ').collect::<Vec<_>>())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(150));
    // If it is done by now, this finds nobody, and there is no checkpoint either.
    let _ = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    let status = child.wait().unwrap();
    if status.code() == Some(143) && folder.names().contains(&"ball.checkpoint".to_string()) {
        run(&folder, "render --resume ball.exr --quiet");
    }
    if folder.names().contains(&"ball.exr".to_string()) {
        assert_eq!(values(&folder, "whole.exr"), values(&folder, "ball.exr"));
    }
    assert!(!folder.names().iter().any(|name| name.contains("checkpoint")), "{:?}", folder.names());
}

#[test]
fn a_render_that_is_killed_at_any_moment_leaves_whole_files_and_goes_on() {
    let folder = Folder::new("killed");
    run(&folder, &format!("{RENDER} --spp 6000 -o whole.exr"));
    let whole = values(&folder, "whole.exr");
    let mut resumed = 0;
    for moment in [20, 60, 120, 200, 300] {
        let arguments = "render ball.json --device reference --aov error --spp 6000 --quiet -o k.exr --checkpoint 0.02s";
        let mut child = folder.command(&arguments.split(' ').collect::<Vec<_>>()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(moment));
        child.kill().unwrap();
        child.wait().unwrap();
        if folder.names().contains(&"k.checkpoint".to_string()) {
            resumed += 1;
            run(&folder, "render --resume k.exr --quiet");
            assert_eq!(whole, values(&folder, "k.exr"), "after {moment} ms");
        }
        folder
            .names()
            .iter()
            .filter(|n| n.starts_with('k') || n.starts_with(".k"))
            .for_each(|n| std::fs::remove_file(folder.0.join(n)).unwrap());
    }
    assert!(resumed > 0, "none of the renders was killed after its first checkpoint");
}

#[test]
fn shares_become_the_picture_of_one_render_in_any_order() {
    let folder = Folder::new("shares");
    run(&folder, &format!("{RENDER} --spp 64 -o whole.exr"));
    for i in 1..=3 {
        run(&folder, &format!("{RENDER} --spp 64 --share {i}/3 -o s{i}.exr"));
    }
    run(&folder, "merge s1.checkpoint s2.checkpoint s3.checkpoint --errors -o a.exr");
    run(&folder, "merge s3.checkpoint s1.checkpoint s2.checkpoint --errors -o b.exr");
    assert_eq!(values(&folder, "a.exr"), values(&folder, "b.exr"));
    // The same batches, but for rounding.
    let (merged, whole) = (values(&folder, "a.exr"), values(&folder, "whole.exr"));
    assert_eq!(merged.1.iter().map(|c| &c.0).collect::<Vec<_>>(), whole.1.iter().map(|c| &c.0).collect::<Vec<_>>());
    let pairs = merged.0.iter().zip(&whole.0).chain(merged.1.iter().zip(&whole.1).flat_map(|(a, b)| a.1.iter().zip(&b.1)));
    for (a, b) in pairs {
        assert!((a - b).abs() <= 1e-4 * b.abs().max(1e-3), "{a} {b}");
    }
    let image = SpectralImage::read(folder.0.join("a.exr")).unwrap();
    assert_eq!((image.attribute("abbe.samples"), image.attribute("abbe.batches")), (Some("64"), Some("28")));

    let few = run(&folder, "merge s1.checkpoint s3.checkpoint -o few.exr");
    assert!(text(&few.stderr).contains("2/3"), "{}", text(&few.stderr));
    fails(&folder, &["merge", "s1.checkpoint", "s1.checkpoint", "-o", "c.exr"], &["s1.checkpoint", "the same share"]);
    run(&folder, &format!("{RENDER} --spp 64 --share 2/3 --seed 5 -o other.exr"));
    fails(&folder, &["merge", "s1.checkpoint", "other.checkpoint", "-o", "c.exr"], &["other.checkpoint", "seed", "5", "0"]);
    fails(&folder, &["merge", "s1.checkpoint", "ball.json", "-o", "c.exr"], &["ball.json", "no checkpoint"]);
}

#[test]
fn a_checkpoint_of_another_render_is_refused_by_what_differs() {
    let folder = Folder::new("refused");
    run(&folder, &format!("{RENDER} --spp 4 --keep-checkpoint"));
    for (changed, says) in [
        ("--seed 3", "seed"),
        ("--size 9x6", "size"),
        ("--channels 5", "wavelength bins"),
        ("--max-depth 3", "greatest depth"),
        ("--without merging", "techniques"),
        ("--share 1/2", "share"),
    ] {
        let arguments = format!("render ball.json --device reference --resume {changed}");
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let output = folder.run(&arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{changed}: {stderr}");
        assert!(stderr.contains(says) && stderr.contains("ball.checkpoint"), "{changed}: {stderr}");
    }
    let scene = std::fs::read_to_string(folder.0.join("ball.json")).unwrap();
    std::fs::write(folder.0.join("ball.json"), scene.replace("0.75", "0.5")).unwrap();
    fails(&folder, &["render", "--resume", "ball.exr"], &["ball.checkpoint", "content of the scene's files"]);
    fails(&folder, &["render", "--resume", "none.exr"], &["none.checkpoint", "there is no checkpoint"]);
    let bytes = std::fs::read(folder.0.join("ball.checkpoint")).unwrap();
    std::fs::write(folder.0.join("ball.json"), scene).unwrap();
    // The header, too, is under the checksum.
    let at = bytes.windows(10).position(|w| w == b"irradiance").unwrap();
    let mut other = bytes.clone();
    other[at] = b'I';
    std::fs::write(folder.0.join("ball.checkpoint"), &other).unwrap();
    let stderr = text(&folder.run(&["render", "--resume", "ball.exr"]).stderr);
    assert!(stderr.contains("ball.checkpoint") && stderr.contains("checksum"), "{stderr}");
    std::fs::write(folder.0.join("ball.checkpoint"), &bytes[..bytes.len() / 2]).unwrap();
    fails(&folder, &["render", "--resume", "ball.exr"], &["ball.checkpoint", "cut short"]);
}

#[test]
fn a_checkpoint_can_be_looked_at() {
    let folder = Folder::new("look");
    run(&folder, &format!("{RENDER} --spp 20 --keep-checkpoint"));
    let info = text(&run(&folder, "info ball.checkpoint").stdout);
    for part in ["checkpoint", "8x6", "seed", "samples per pixel", "20", "ball.json"] {
        assert!(info.contains(part), "no '{part}' in {info}");
    }
    fails(&folder, &["develop", "ball.checkpoint", "-o", "d.png"], &["ball.checkpoint", "this is a checkpoint", "abbe merge"]);
    run(&folder, "merge ball.checkpoint --errors -o again.exr");
    assert_eq!(values(&folder, "ball.exr"), values(&folder, "again.exr"));
}

#[test]
fn what_killed_processes_have_left_is_swept_when_it_is_old() {
    let folder = Folder::new("sweep");
    let names = [".ball.exr.1234.0.tmp", ".ball.exr.77.0.tmp", ".ball.exr.notes.tmp", ".other.exr.5.0.tmp"];
    for (i, name) in names.iter().enumerate() {
        let file = std::fs::File::create(folder.0.join(name)).unwrap();
        // The second is as young as that of a process at work.
        let age = if i == 1 { 10 } else { 2 * 3600 };
        file.set_modified(std::time::SystemTime::now() - Duration::from_secs(age)).unwrap();
    }
    run(&folder, &format!("{RENDER} --spp 1"));
    let left: Vec<String> = folder.names().into_iter().filter(|n| n.ends_with(".tmp")).collect();
    assert_eq!(left, [names[1], names[2], names[3]]);
}
