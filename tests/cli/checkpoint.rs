//! Checkpoints: a render that was stopped or killed goes on, and shares become one picture.

use crate::random::Random;
use crate::support::{Folder, fails, text};
use crate::sweep;
use abbe::film::Film;
use abbe::output::{SpectralImage, write_checkpoint};
use abbe::render::Rendering;
use abbe::scene::{Bins, FilmSettings};
use serde_json::Value;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

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
    let (mut random, mut resumed) = (Random(22), 0);
    for _ in 0..sweep::count(10).min(100) {
        let moment = Duration::from_secs_f64(0.3 * random.next());
        let arguments = format!("{RENDER} --spp 6000 -o k.exr --checkpoint 0.02s");
        let mut child = folder.command(&arguments.split(' ').collect::<Vec<_>>()).spawn().unwrap();
        std::thread::sleep(moment);
        child.kill().unwrap();
        child.wait().unwrap();
        if folder.names().contains(&"k.checkpoint".to_string()) {
            resumed += 1;
            run(&folder, "render --resume k.exr --quiet");
        }
        // Where there is no checkpoint, the render was done or nothing is written.
        if folder.names().contains(&"k.exr".to_string()) {
            assert_eq!(whole, values(&folder, "k.exr"), "after {moment:?}");
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
#[ignore = "long: in tools/soak"]
fn a_checkpoint_costs_little_more_than_its_bytes_on_the_disk() {
    // As the build is on: a folder of temporary files may be memory.
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let bins = Bins { count: 20, min_nm: 380.0, max_nm: 780.0 };
    let settings = FilmSettings::new(1920, 1080, bins);
    let mut rendering = Rendering::new(Film::new(&settings));
    let (checkpoint, plain) = (folder.join("cost.checkpoint"), folder.join("cost.plain"));
    let seconds = |write: &mut dyn FnMut()| {
        let begun = Instant::now();
        write();
        begun.elapsed().as_secs_f64()
    };
    write_checkpoint(&checkpoint, &Value::Null, &mut rendering).unwrap();
    let bytes = vec![1u8; std::fs::metadata(&checkpoint).unwrap().len() as usize];
    // In turns, so that either takes the pages that the other has left, and the least of each: others use the disk, too.
    let mut least = [f64::INFINITY; 2];
    for _ in 0..15 {
        let written = seconds(&mut || write_checkpoint(&checkpoint, &Value::Null, &mut rendering).unwrap());
        let copied = seconds(&mut || {
            let mut file = std::fs::File::create_new(&plain).unwrap();
            file.write_all(&bytes).unwrap();
            file.sync_all().unwrap();
        });
        std::fs::remove_file(&plain).unwrap();
        println!("checkpoint {written:.2} s, plain write of {:.0} MB {copied:.2} s", bytes.len() as f64 * 1e-6);
        least = [least[0].min(written), least[1].min(copied)];
    }
    std::fs::remove_file(&checkpoint).unwrap();
    assert!(least[0] <= 1.5 * least[1], "{least:?}");
}

#[test]
fn shares_become_the_picture_of_one_render_in_any_order() {
    let folder = Folder::new("shares");
    run(&folder, &format!("{RENDER} --spp 64 -o whole.exr"));
    for i in 1..=3 {
        run(&folder, &format!("{RENDER} --spp 64 --share {i}/3 -o s{i}.checkpoint"));
    }
    // A share is a checkpoint, and no picture.
    let files = ["ball.json", "s1.checkpoint", "s2.checkpoint", "s3.checkpoint", "whole.exr", "whole.png"];
    assert_eq!(folder.names(), files);
    run(&folder, "merge s1.checkpoint s2.checkpoint s3.checkpoint -o a.exr");
    run(&folder, "merge s3.checkpoint s1.checkpoint s2.checkpoint -o b.exr");
    assert_eq!(values(&folder, "a.exr"), values(&folder, "b.exr"));
    // The same batches, but for rounding; errors were asked for.
    let (merged, whole) = (values(&folder, "a.exr"), values(&folder, "whole.exr"));
    assert_eq!(merged.1.iter().map(|c| &c.0).collect::<Vec<_>>(), whole.1.iter().map(|c| &c.0).collect::<Vec<_>>());
    let pairs = merged.0.iter().zip(&whole.0).chain(merged.1.iter().zip(&whole.1).flat_map(|(a, b)| a.1.iter().zip(&b.1)));
    for (a, b) in pairs {
        assert!((a - b).abs() <= 1e-4 * b.abs().max(1e-3), "{a} {b}");
    }
    let image = SpectralImage::read(folder.0.join("a.exr")).unwrap();
    assert_eq!((image.attribute("abbe.samples"), image.attribute("abbe.batches")), (Some("64"), Some("28")));

    let few = run(&folder, "merge s1.checkpoint s3.checkpoint -o few.exr");
    assert!(text(&few.stderr).contains("missing: 2/3"), "{}", text(&few.stderr));
    fails(&folder, &["merge", "s1.checkpoint", "s1.checkpoint", "-o", "c.exr"], &["s1.checkpoint", "the same share"]);
    run(&folder, &format!("{RENDER} --spp 64 --share 2/3 --seed 5 -o other.exr"));
    fails(&folder, &["merge", "s1.checkpoint", "other.checkpoint", "-o", "c.exr"], &["other.checkpoint", "seed", "5", "0"]);
    fails(&folder, &["merge", "s1.checkpoint", "ball.json", "-o", "c.exr"], &["ball.json", "no checkpoint"]);
    fails(&folder, &["merge", "a.exr", "s1.checkpoint", "-o", "c.exr"], &["a.exr", "no checkpoint", "s1.checkpoint"]);
    let depth = ["render", "ball.json", "--share", "1/2", "--aov", "depth", "-o", "d.checkpoint"];
    fails(&folder, &depth, &["a share has no depth"]);
}

#[test]
fn a_share_without_batches_is_one_all_the_same() {
    let folder = Folder::new("empty-share");
    for i in 1..=3 {
        run(&folder, &format!("{RENDER} --spp 2 --share {i}/3 -o s{i}.checkpoint"));
    }
    run(&folder, &format!("{RENDER} --spp 2 -o whole.exr"));
    let merged = run(&folder, "merge s3.checkpoint s1.checkpoint s2.checkpoint -o merged.exr");
    assert!(merged.stderr.is_empty(), "{}", text(&merged.stderr));
    assert_eq!(values(&folder, "merged.exr").0, values(&folder, "whole.exr").0);
    fails(&folder, &["merge", "s3.checkpoint", "-o", "none.exr"], &["s3.checkpoint", "no samples"]);
}

#[test]
fn one_command_begins_a_share_and_goes_on_with_it() {
    let folder = Folder::new("share-again");
    let share = |name: &str| format!("{RENDER} --spp 8000 --share 1/2 --checkpoint 0.02s -o {name}.checkpoint --resume");
    run(&folder, &share("whole"));
    let image = |name: &str| SpectralImage::read(folder.0.join(format!("{name}.checkpoint"))).unwrap();
    let mut child = folder.command(&share("killed").split(' ').collect::<Vec<_>>()).spawn().unwrap();
    while !folder.0.join("killed.checkpoint").exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    let was_killed = !child.wait().unwrap().success();
    let done = image("killed").attribute("abbe.samples").unwrap().parse::<u32>().unwrap();
    assert!(was_killed && done < 4000, "the share was done before it was killed");
    let merged = run(&folder, "merge killed.checkpoint -o so_far.exr");
    let said = text(&merged.stderr);
    assert!(said.contains("missing: 2/2") && said.contains("not done: 1/2"), "{said}");

    run(&folder, &share("killed"));
    let (again, whole) = (image("killed"), image("whole"));
    assert_eq!((&again.data, &again.others), (&whole.data, &whole.others));
    // And once more, when there is nothing left to do.
    run(&folder, &share("killed"));
    assert_eq!(image("killed"), again);
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
    // It is read as the EXR of the render.
    let [image, written] = ["ball.checkpoint", "ball.exr"].map(|name| SpectralImage::read(folder.0.join(name)).unwrap());
    assert_eq!(image, written);
    for name in ["ball.checkpoint", "ball.exr"] {
        run(&folder, &format!("develop {name} --tone agx -o {name}.png"));
    }
    let picture = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert_eq!(picture("ball.checkpoint.png"), picture("ball.exr.png"));
    let probe = |name: &str| text(&run(&folder, &format!("probe {name} 4,3")).stdout);
    assert_eq!(probe("ball.checkpoint").replace("ball.checkpoint", "ball.exr"), probe("ball.exr"));
    run(&folder, "merge ball.checkpoint -o again.exr");
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
