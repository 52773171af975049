//! `abbe render --frames`: a sequence, frame after frame into numbered files, all on one device. A frame is the still of its keys, bit by bit; it is passed
//! over where its files are there already, and gone on with where a checkpoint is.

use super::load::Overrides;
use super::render::{self, Args, is_exr};
use super::{Done, Outcome, interrupt, values};
use crate::develop::picture::Exposure;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::output::{read_attributes, scene_hash, write_text};
use crate::scene::{LAST_FRAME, Scene};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Which frames, and how they differ from stills.
#[derive(clap::Args, Clone, Default)]
pub struct SequenceArgs {
    /// Render these frames of a scene that moves, the last one too: 0..120, 0..120:5 for every fifth, or one, as 17. Files are numbered (OUT.0017.exr, or as -o frame_%04d.exr says); those that are done are passed over
    #[arg(long, value_name = "FRAMES", value_parser = Frames::parse, conflicts_with_all = ["resume", "share"])]
    pub frames: Option<Frames>,
    /// Frames per second, for what a glTF file moves by seconds [default: the scene's frames_per_second, else 24]
    #[arg(long, value_name = "RATE", value_parser = values::rate, requires = "frames")]
    fps: Option<f64>,
    /// Give each frame a seed of its own, --seed and its number together, so that noise flickers instead of standing still
    #[arg(long, requires = "frames")]
    seed_per_frame: bool,
}

/// Numbers of frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frames {
    first: u32,
    last: u32,
    step: u32,
}

impl Frames {
    fn parse(text: &str) -> std::result::Result<Self, String> {
        let (range, step) = text.split_once(':').unwrap_or((text, "1"));
        let (first, last) = range.split_once("..").unwrap_or((range, range));
        let number = |text: &str| text.trim().parse::<u32>().ok().filter(|n| *n <= LAST_FRAME);
        let frames = number(first).zip(number(last)).zip(number(step));
        let frames = frames.map(|((first, last), step)| Frames { first, last, step });
        frames
            .filter(|f| f.first <= f.last && f.step > 0)
            .ok_or_else(|| "write a frame, as 17, or the first and the last, as 0..120 or 0..120:5".to_string())
    }

    fn numbers(self) -> impl Iterator<Item = u32> {
        (self.first..=self.last).step_by(self.step as usize)
    }
}

/// The name of the frames' files: `%04d` in it, or one with as many digits, is the number.
struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// From the output that is asked for, which need not say where the number goes: before `.exr`.
    fn of(output: &Path) -> Result<Self> {
        let text = output.to_str().ok_or_else(|| Error::file(output, "this name is not text", "choose another with -o"))?;
        let places: Vec<(usize, usize, usize)> = text.match_indices('%').filter_map(|(at, _)| number_at(text, at)).collect();
        match places[..] {
            [] => {
                let stem = if is_exr(output) { text.len() - ".exr".len() } else { text.len() };
                Ok(Pattern { before: format!("{}.", &text[..stem]), digits: 4, after: text[stem..].to_string() })
            }
            [(at, end, digits)] => Ok(Pattern { before: text[..at].to_string(), digits, after: text[end..].to_string() }),
            _ => Err(Error::usage(format!("-o {text} has more than one place for a number"), "write one, as in frame_%04d.exr")),
        }
    }

    /// The file of a frame.
    fn file(&self, frame: u32) -> PathBuf {
        PathBuf::from(format!("{}{frame:0digits$}{}", self.before, self.after, digits = self.digits))
    }

    /// The file beside them that has their exposure.
    fn exposure_file(&self) -> PathBuf {
        let stem = &self.after[..self.after.len() - if is_exr(&self.file(0)) { ".exr".len() } else { 0 }];
        let whole = format!("{}{stem}", self.before);
        let name = whole.rsplit(std::path::is_separator).next().unwrap_or_default();
        let name = name.trim_matches(['.', '_', '-']);
        let name = if name.is_empty() { "exposure.json".to_string() } else { format!("{name}.exposure.json") };
        self.file(0).with_file_name(name)
    }
}

/// Begin, end and number of digits of a `%d` or `%04d` at `at`.
fn number_at(text: &str, at: usize) -> Option<(usize, usize, usize)> {
    let rest = &text[at + 1..];
    let length = rest.find(|c: char| !c.is_ascii_digit())?;
    let digits = if length == 0 { 1 } else { rest[..length].strip_prefix('0')?.parse().ok()? };
    (rest[length..].starts_with('d') && (1..=9).contains(&digits)).then_some((at, at + 2 + length, digits))
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let Some(frames) = args.sequence.frames else { return render::render(args, None) };
    let scene = args.path.as_deref().unwrap_or(Path::new(""));
    let pattern = Pattern::of(&render::output(args, scene)?)?;
    let overrides = args.of_frame(0, PathBuf::new()).overrides;
    let exposure_file = pattern.exposure_file();
    let mut sequence = Sequence { scene: scene.to_path_buf(), overrides, exposure_file, ..Sequence::default() };
    let mut done = Done::Completely;
    for frame in frames.numbers() {
        if interrupt::requested() {
            return Ok(Done::Interrupted);
        }
        match render::render(&args.of_frame(frame, pattern.file(frame)), Some(&mut sequence))? {
            Done::Interrupted => return Ok(Done::Interrupted),
            Done::Completely => {}
            other => done = other,
        }
    }
    Ok(done)
}

impl Args {
    /// The still that a frame is, which goes on from a checkpoint if there is one.
    fn of_frame(&self, frame: u32, output: PathBuf) -> Args {
        let mut args = self.clone();
        args.overrides = Overrides { frame: Some(frame), frames_per_second: self.sequence.fps, ..args.overrides };
        if self.sequence.seed_per_frame {
            args.seed = args.seed.wrapping_add(frame.into());
        }
        args.output = Some(output);
        args.checkpoint.resume = Some(None);
        args
    }
}

/// What frames hand on to those after them.
#[derive(Default)]
pub struct Sequence {
    /// The device, with the kernels that are compiled.
    pub gpu: Option<Arc<Gpu>>,
    /// A frame was rendered, so that the plan has been told.
    pub has_begun: bool,
    scene: PathBuf,
    overrides: Overrides,
    exposure_file: PathBuf,
    exposure: Option<f64>,
}

impl Sequence {
    /// Whether `files`, of which the first is the spectral EXR, are those of the frame that `scene` and `options` make, and done; with those `denoised`,
    /// unless it has the one batch that cannot be.
    ///
    /// # Errors
    /// [`Error::File`] where there is another picture: the first difference is named.
    pub fn has_finished(
        &mut self,
        files: &[&Path],
        denoised: &[&Path],
        scene: &Scene,
        options: &Value,
        asked: Exposure,
    ) -> Result<bool> {
        let exr = files[0];
        if !exr.exists() {
            return Ok(false);
        }
        let remedy = "choose another name with -o, or remove it";
        let attributes = read_attributes(exr)?;
        let said = |name: &str| attributes.iter().find(|(n, _)| n == name).map_or("none", |(_, value)| value);
        let Ok(theirs) = serde_json::from_str::<Value>(said("abbe.options")) else {
            return Err(Error::file(exr, "this is no frame that Abbe has rendered", remedy));
        };
        let ours = [
            ("version", "abbe.version", env!("CARGO_PKG_VERSION").to_string()),
            ("content of the scene's files", "abbe.sceneHash", scene_hash(scene)),
        ];
        let of_scene = ours.iter().map(|(what, name, ours)| (*what, json!(said(name)), json!(ours)));
        let of_options = options.as_object().into_iter().flatten();
        let of_options = of_options.map(|(name, ours)| (name.as_str(), theirs[name].clone(), ours.clone()));
        if let Some((what, theirs, ours)) = of_scene.chain(of_options).find(|(_, theirs, ours)| theirs != ours) {
            return Err(Error::file(exr, format!("this frame is of another {what}: {theirs} instead of {ours}"), remedy));
        }
        let denoised = if said("abbe.batches") == "1" { &[] } else { denoised };
        let is_finished = said("abbe.interrupted") == "no" && files.iter().chain(denoised).all(|file| file.exists());
        if let (true, Some(stops)) = (is_finished, said("EV").parse().ok()) {
            self.exposure(scene, options, asked)?;
            self.keep_exposure(scene, options, asked, stops)?;
        }
        Ok(is_finished)
    }

    /// The exposure of all frames where one is `asked` for that is found from a picture: that of the first frame, once it is known.
    ///
    /// # Errors
    /// [`Error::File`] where the file that has it is of another scene.
    pub fn exposure(&mut self, scene: &Scene, options: &Value, asked: Exposure) -> Result<Option<f64>> {
        let file = &self.exposure_file;
        if !matches!(asked, Exposure::Auto { .. }) || self.exposure.is_some() || !file.exists() {
            return Ok(self.exposure.filter(|_| matches!(asked, Exposure::Auto { .. })));
        }
        let fail = |problem: String| Error::file(file, problem, "choose another name with -o, or remove it");
        let text = std::fs::read_to_string(file).map_err(|e| fail(format!("cannot read: {e}")))?;
        let said: Value = serde_json::from_str(&text).map_err(|e| fail(format!("not valid JSON: {e}")))?;
        let stops = said["stops"].as_f64().ok_or_else(|| fail("it says no exposure".into()))?;
        let hash = if said["frame"] == options["frame"] {
            scene_hash(scene)
        } else {
            // Frames may name other files.
            let frame = said["frame"].as_u64().and_then(|frame| u32::try_from(frame).ok());
            scene_hash(&Overrides { frame, ..self.overrides.clone() }.load(&self.scene)?)
        };
        for (what, theirs, ours) in [
            ("content of the scene's files", &said["sceneHash"], json!(hash)),
            ("--exposure", &said["asked"], json!(asked.to_string())),
        ] {
            if *theirs != ours {
                return Err(fail(format!("this exposure is of another {what}: {theirs} instead of {ours}")));
            }
        }
        self.exposure = Some(stops);
        Ok(self.exposure)
    }

    /// Keeps the exposure of a frame that is done for those to come, if it is the first and was found from the picture.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be written.
    pub fn keep_exposure(&mut self, scene: &Scene, options: &Value, asked: Exposure, stops: f64) -> Result<()> {
        if !matches!(asked, Exposure::Auto { .. }) || self.exposure.is_some() {
            return Ok(());
        }
        self.exposure = Some(stops);
        let kept = json!({"stops": stops, "asked": asked.to_string(), "frame": options["frame"], "sceneHash": scene_hash(scene)});
        write_text(&self.exposure_file, &format!("{kept}\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_ranges_with_both_ends() {
        let numbers = |text: &str| Frames::parse(text).map(|frames| frames.numbers().collect::<Vec<_>>());
        assert_eq!(numbers("17"), Ok(vec![17]));
        assert_eq!(numbers("3..6"), Ok(vec![3, 4, 5, 6]));
        assert_eq!(numbers("0..10:4"), Ok(vec![0, 4, 8]));
        for text in ["", "..", "1..", "-1", "5..3", "0..3:0", "0-3", "1.5", "0..3:", "99999999999"] {
            assert!(numbers(text).is_err(), "{text}");
        }
    }

    #[test]
    fn files_have_the_number_where_it_is_asked_for_or_before_the_ending() {
        for (output, file, exposure) in [
            ("out.exr", "out.0017.exr", "out.exposure.json"),
            ("a/out.EXR", "a/out.0017.EXR", "a/out.exposure.json"),
            ("a/f_%03d.exr", "a/f_017.exr", "a/f.exposure.json"),
            ("%d.exr", "17.exr", "exposure.json"),
            ("100%.%05d.x.exr", "100%.00017.x.exr", "100%..x.exposure.json"),
        ] {
            let pattern = Pattern::of(Path::new(output)).unwrap();
            assert_eq!(pattern.file(17), Path::new(file), "{output}");
            assert_eq!(pattern.exposure_file(), Path::new(exposure), "{output}");
        }
        assert_eq!(Pattern::of(Path::new("out.exr")).unwrap().file(123_456), Path::new("out.123456.exr"));
        assert!(Pattern::of(Path::new("%02d/%02d.exr")).is_err());
    }
}
