//! What a render was asked for: written into its files, so that another process can go on with it, and read from them.

use super::{Aov, Args, StopArgs, is_exr};
use crate::cli::load::Overrides;
use crate::cli::{checkpoint, device};
use crate::error::{Error, Result};
use crate::render::Share;
use crate::scene::{Setting, Tile};
use clap::ValueEnum;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

impl Args {
    /// What another process needs to know to go on with this render.
    pub(super) fn request(&self, scene: &Path, exposure: Option<f64>) -> Value {
        let mut request = self.options();
        request["scene"] = std::path::absolute(scene).unwrap_or_else(|_| scene.to_path_buf()).to_string_lossy().into();
        request["device"] = json!(self.device);
        request["share"] = json!(self.checkpoint.share.map(|share| [share.number, share.of]));
        request["exposure"] = json!(exposure);
        request
    }

    /// What was asked for, wherever it is rendered.
    pub(super) fn options(&self) -> Value {
        let Overrides { size, crop, channels, max_depth, settings, frame, frames_per_second, allow_outside, solid_glass, studio } =
            &self.overrides;
        json!({
            "size": size.map(|(w, h)| [w, h]),
            "crop": crop.map(|part| [part.x, part.y, part.width, part.height]),
            "channels": channels,
            "max_depth": max_depth,
            "set": settings.iter().map(Setting::text).collect::<Vec<_>>(),
            "frame": frame,
            "frames_per_second": frames_per_second,
            "allow_outside": allow_outside,
            "solid_glass": solid_glass,
            "studio": studio,
            "seed": self.seed,
            "techniques": self.techniques.json(),
            "aov": self.aov.iter().filter_map(|aov| Some(aov.to_possible_value()?.get_name().to_string())).collect::<Vec<_>>(),
            "denoise": self.denoise,
            "picture": self.picture.json(),
            "spp": self.stop.spp,
            "seconds": self.stop.time.map(|t| t.as_secs_f64()),
            "error": self.stop.error,
        })
    }

    /// The same, and where no scene is named what the render to go on with was asked for.
    pub(super) fn completed(&self) -> Result<Args> {
        let mut args = self.clone();
        args.overrides.crop = self.crop.crop;
        let Some(resume) = &self.checkpoint.resume else { return Ok(args) };
        match resume {
            // `--resume scene.json` names the scene.
            Some(path) if args.path.is_none() && !is_exr(path) && checkpoint::beside(path) != *path => {
                args.path = Some(path.clone())
            }
            Some(path) => args.output = Some(path.with_extension("exr")),
            None => {}
        }
        if args.path.is_some() {
            return Ok(args);
        }
        let Some(exr) = &args.output else {
            return Err(Error::usage("--resume alone names no render", "name the scene, or the output as in --resume out.exr"));
        };
        let request = checkpoint::request_of(exr)?;
        let number = |name: &str| request[name].as_u64().and_then(|n| u32::try_from(n).ok());
        let flag = |name: &str| request[name].as_bool().unwrap_or(false);
        let numbers = |name: &str| -> Option<Vec<u32>> {
            request[name].as_array()?.iter().map(|n| u32::try_from(n.as_u64()?).ok()).collect()
        };
        let pair = |name: &str| numbers(name)?.try_into().ok().map(|[a, b]: [u32; 2]| (a, b));
        let texts = |name: &str| request[name].as_array().into_iter().flatten().filter_map(Value::as_str);
        args.path = request["scene"].as_str().map(PathBuf::from);
        args.overrides = Overrides {
            size: pair("size"),
            crop: numbers("crop").and_then(|all| all.try_into().ok()).map(|[x, y, width, height]: [u32; 4]| Tile {
                x,
                y,
                width,
                height,
            }),
            channels: number("channels"),
            max_depth: number("max_depth"),
            settings: texts("set").filter_map(|text| Setting::parse(text).ok()).collect(),
            frame: number("frame"),
            frames_per_second: request["frames_per_second"].as_f64(),
            allow_outside: flag("allow_outside"),
            solid_glass: flag("solid_glass"),
            studio: flag("studio"),
        };
        args.checkpoint.share = pair("share").and_then(|(number, of)| Share::new(number, of));
        args.denoise |= flag("denoise");
        args.picture = self.picture.or_json(&request["picture"]);
        args.exposure = request["exposure"].as_f64();
        args.seed = request["seed"].as_u64().unwrap_or(0);
        args.techniques = device::TechniqueArgs::of_json(&request["techniques"]);
        args.device = args.device.or_else(|| request["device"].as_str().map(str::to_string));
        if args.aov.is_empty() {
            args.aov = texts("aov").filter_map(|name| Aov::from_str(name, false).ok()).collect();
        }
        if let StopArgs { spp: None, time: None, error: None } = args.stop {
            let time = request["seconds"].as_f64().and_then(|s| Duration::try_from_secs_f64(s).ok());
            args.stop = StopArgs { spp: number("spp"), time, error: request["error"].as_f64() };
        }
        Ok(args)
    }
}
