//! Signals end a render early, and what is done is written.

use crate::support::{Folder, text};
use abbe::output::SpectralImage;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// A render of a minute, as `render` and more arguments.
const RENDER: [&str; 6] = ["render", "ball.json", "--device", "reference", "--time", "1m"];

/// A process and what it has written to standard error.
struct Running {
    child: Child,
    stderr: BufReader<std::process::ChildStderr>,
}

impl Running {
    fn start(mut command: Command) -> Self {
        let mut child = command.spawn().unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        Self { child, stderr }
    }

    /// Waits for a line on standard error that contains `part`.
    fn wait_for(&mut self, part: &str) {
        let mut lines = (&mut self.stderr).lines().map(|line| line.unwrap());
        assert!(lines.any(|line| line.contains(part)), "it ended without '{part}'");
    }

    fn signal(&self, name: &str) {
        assert!(Command::new("kill").args([&format!("-{name}"), &self.child.id().to_string()]).status().unwrap().success());
    }

    /// How it ended, what it wrote to standard output and what else to standard error.
    fn end(mut self) -> (ExitStatus, String, String) {
        let (mut stdout, mut stderr) = (Vec::new(), Vec::new());
        self.stderr.read_to_end(&mut stderr).unwrap();
        self.child.stdout.take().unwrap().read_to_end(&mut stdout).unwrap();
        (self.child.wait().unwrap(), text(&stdout), text(&stderr))
    }
}

#[test]
fn any_of_three_signals_has_what_is_done_written() {
    for (name, code) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        let folder = Folder::new(&format!("signal-{name}"));
        let mut render = Running::start(folder.command(&RENDER));
        render.wait_for(" spp, ");
        render.signal(name);
        let (status, stdout, stderr) = render.end();
        assert_eq!(status.code(), Some(code), "{name}: {stderr}");
        assert_eq!(folder.names(), ["ball.checkpoint", "ball.exr", "ball.json", "ball.png"]);
        let image = SpectralImage::read(folder.0.join("ball.exr")).unwrap();
        assert!(image.attribute("abbe.samples").unwrap().parse::<u64>().unwrap() > 0);
        assert!(stdout.contains("interrupted") && stdout.contains("wrote ball.exr and ball.png"), "{stdout}");
    }
}

#[test]
fn hangup_that_was_ignored_at_the_start_stays_ignored() {
    let folder = Folder::new("nohup");
    let mut command = Command::new("sh");
    command.args(["-c", "trap '' HUP; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_abbe")]).args(&RENDER[..5]).arg("2s");
    command.current_dir(&folder.0).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut render = Running::start(command);
    render.wait_for(" spp, ");
    render.signal("HUP");
    let (status, stdout, stderr) = render.end();
    assert_eq!(status.code(), Some(0), "{stderr}");
    assert!(!stdout.contains("interrupted") && folder.names().contains(&"ball.exr".to_string()), "{stdout}");
}

#[test]
fn a_signal_does_not_wait_for_the_batch_and_without_one_done_nothing_is_written() {
    let folder = Folder::new("first-batch");
    // A picture of which one sample takes minutes.
    let mut render = Running::start(folder.command(&[&RENDER[..4], &["--size", "1500x1500"]].concat()));
    render.wait_for("reference: paths from");
    // So that it is at work.
    std::thread::sleep(Duration::from_millis(300));
    let start = Instant::now();
    render.signal("TERM");
    let (status, _, stderr) = render.end();
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
    assert_eq!(status.code(), Some(143), "{stderr}");
    assert!(stderr.contains("nothing is written"), "{stderr}");
    assert_eq!(folder.names(), ["ball.json"]);
}

#[test]
fn the_picture_is_there_while_it_is_rendered_unless_that_is_off() {
    for (preview, is_there) in [("0.1s", true), ("off", false)] {
        let folder = Folder::new(&format!("preview-{preview}"));
        let mut render = Running::start(folder.command(&[&RENDER[..], &["--preview", preview]].concat()));
        render.wait_for(" spp, ");
        // The first one is written right after the first batch is told of.
        let begun = Instant::now();
        let patience = Duration::from_secs(if is_there { 20 } else { 1 });
        while begun.elapsed() < patience && !folder.0.join("ball.png").exists() {
            std::thread::sleep(Duration::from_millis(20));
        }
        assert_eq!(folder.names().contains(&"ball.png".to_string()), is_there, "{preview}");
        render.signal("TERM");
        assert_eq!(render.end().0.code(), Some(143));
        assert!(folder.names().contains(&"ball.png".to_string()));
    }
}

#[test]
fn a_film_that_cannot_be_written_is_kept_elsewhere() {
    let folder = Folder::new("elsewhere");
    let (output, temporary) = (folder.0.join("output"), folder.0.join("temporary"));
    [&output, &temporary].into_iter().for_each(|path| std::fs::create_dir(path).unwrap());
    let mut command = folder.command(&[&RENDER[..4], &["--time", "2s", "--preview", "off", "-o", "output/a.exr"]].concat());
    let mut render = Running::start({
        command.env("TMPDIR", &temporary);
        command
    });
    render.wait_for(" spp, ");
    std::fs::remove_dir_all(&output).unwrap();
    let (status, _, stderr) = render.end();
    assert_eq!(status.code(), Some(2), "{stderr}");
    let kept = std::fs::read_dir(&temporary).unwrap().next().expect("a file").unwrap().path();
    assert!(stderr.contains("a.exr: cannot write here") && stderr.contains(&*kept.to_string_lossy()), "{stderr}");
    let image = SpectralImage::read(&kept).unwrap();
    assert!(image.attribute("abbe.samples").unwrap().parse::<u64>().unwrap() > 0);
}

#[test]
fn a_signal_that_comes_twice_at_once_is_one() {
    let folder = Folder::new("twice");
    let mut render = Running::start(folder.command(&RENDER));
    render.wait_for(" spp, ");
    // As `timeout` does: to the process, and to its group.
    ["TERM", "TERM", "INT"].iter().for_each(|name| render.signal(name));
    let (status, _, stderr) = render.end();
    assert!(matches!(status.code(), Some(130 | 143)), "{status}: {stderr}");
    assert_eq!(folder.names(), ["ball.checkpoint", "ball.exr", "ball.json", "ball.png"]);
}

#[test]
fn without_a_terminal_the_plan_and_the_first_batch_are_told_at_once() {
    let folder = Folder::new("log");
    let output = folder.run(&["render", "ball.json", "--device", "reference", "--spp", "4", "--json"]);
    let stderr = text(&output.stderr);
    let mut lines = stderr.lines();
    assert!(lines.next().unwrap().contains("paths from"), "{stderr}");
    let files = lines.next().unwrap();
    assert!(files.contains("files: up to ") && files.contains(" a checkpoint of "), "{stderr}");
    let state = lines.next().unwrap();
    assert!(["1 spp, ", "rays/s, error ", " left"].iter().all(|part| state.contains(part)), "{stderr}");
    let quiet = folder.run(&["render", "ball.json", "--device", "reference", "--spp", "4", "--quiet"]);
    assert!(quiet.stderr.is_empty());
}
