//! What a render says at its end, as lines or as JSON.

use crate::cli::device::Device;
use crate::cli::print::{duration, percent, si};
use crate::film::Film;
use crate::render::{Ended, Summary};
use crate::scene::Scene;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What is said at the end.
pub(super) struct Report<'a> {
    pub(super) scene: &'a Scene,
    pub(super) film: &'a Film,
    pub(super) warnings: &'a [String],
    pub(super) summary: &'a Summary,
    pub(super) device: &'a Device,
    pub(super) setup: Duration,
    pub(super) exr: Option<&'a Path>,
    pub(super) png: Option<&'a Path>,
    pub(super) denoised: &'a [PathBuf],
    pub(super) frame: Option<u32>,
    /// The plan was told with a frame before.
    pub(super) is_brief: bool,
    pub(super) share: Option<PathBuf>,
}

impl Report<'_> {
    /// Total flux of an irradiance sensor: W and lm.
    fn flux(&self) -> Option<(f64, f64)> {
        let flux = self.film.total_flux(self.scene.sensor.area()?);
        let (bins, xyz) = flux.split_at(self.film.bins());
        Some((bins.iter().sum::<f64>() * self.scene.film.bins.width_nm(), xyz[1]))
    }

    /// As lines.
    pub(super) fn text(&self) -> String {
        let (p, device) = (&self.summary.progress, self.device);
        let mut lines = Vec::new();
        if !self.is_brief {
            lines.push(device.integrator.describe().trim_end().to_string());
        }
        let frame = self.frame.map_or(String::new(), |frame| format!(", frame {frame}"));
        let ended = match self.summary.ended {
            Ended::Interrupted => ", interrupted",
            Ended::Samples | Ended::Time | Ended::Error => "",
        };
        let (setup, elapsed) = (duration(self.setup.as_secs_f64()), duration(p.elapsed.as_secs_f64()));
        let samples = match (p.spp, self.film.most_samples_per_pixel()) {
            (1, 1) => "1 sample".to_string(),
            (least, most) if most > least => format!("{least} to {most} samples"),
            (spp, _) => format!("{spp} samples"),
        };
        lines.push(format!("{}{frame}: {samples} per pixel in {elapsed}{ended}; set-up {setup}", self.scene.name));
        lines.push(format!("on {}: {}rays, {}rays/s", device.name, si(p.stats.rays as f64), si(p.rays_per_second)));
        lines.push(match self.summary.batches {
            0 => "no batch of this share is among these samples".to_string(),
            1 => "estimated relative error: not known from one batch".to_string(),
            n => format!("estimated relative error {} from {n} batches", percent(p.relative_error)),
        });
        lines.push(format!(
            "dropped samples: {} not finite, {} negative, {} too large, {} in too many overlapping volumes, {} ended by the driver; paths cut at depth {}: {} of {}",
            p.stats.dropped_not_finite,
            p.stats.dropped_negative,
            p.stats.dropped_saturated,
            p.stats.dropped_crowded,
            p.stats.unfinished,
            self.scene.max_depth,
            p.stats.truncated,
            p.stats.paths + p.stats.light_paths
        ));
        if let Some((watts, lumens)) = self.flux() {
            lines.push(format!("total flux {watts:.6e} W, {lumens:.6e} lm"));
        }
        let files =
            [self.exr, self.png, self.share.as_deref()].into_iter().flatten().chain(self.denoised.iter().map(PathBuf::as_path));
        lines.push(format!("wrote {}", files.map(|path| path.display().to_string()).collect::<Vec<_>>().join(" and ")));
        lines.join("\n")
    }

    /// As one object.
    pub(super) fn json(&self) -> Value {
        let p = &self.summary.progress;
        let ended = match self.summary.ended {
            Ended::Samples => "samples",
            Ended::Time => "time",
            Ended::Error => "error",
            Ended::Interrupted => "interrupted",
        };
        json!({
            "scene": self.scene.name,
            "frame": self.frame,
            "device": self.device.name,
            "exr": self.exr.map(Path::to_string_lossy),
            "png": self.png.map(Path::to_string_lossy),
            "denoised": self.denoised.iter().map(|path| path.to_string_lossy()).collect::<Vec<_>>(),
            "share": self.share.as_deref().map(Path::to_string_lossy),
            "width": self.scene.film.width,
            "height": self.scene.film.height,
            "crop": self.scene.film.crop.map(|part| [part.x, part.y, part.width, part.height]),
            "bins": self.scene.film.bins.count,
            "samples_per_pixel": p.spp,
            "batches": self.summary.batches,
            "ended": ended,
            "setup_seconds": self.setup.as_secs_f64(),
            "seconds": p.elapsed.as_secs_f64(),
            "paths": p.stats.paths,
            "light_paths": p.stats.light_paths,
            "rays": p.stats.rays,
            "rays_per_second": p.rays_per_second,
            "relative_error": p.relative_error.is_finite().then_some(p.relative_error),
            "dropped": {"not_finite": p.stats.dropped_not_finite, "negative": p.stats.dropped_negative, "saturated": p.stats.dropped_saturated, "crowded": p.stats.dropped_crowded, "unfinished": p.stats.unfinished},
            "truncated": p.stats.truncated,
            "total_flux": self.flux().map(|(watts, lumens)| json!({"watts": watts, "lumens": lumens})),
            "plan": self.device.integrator.describe().lines().collect::<Vec<_>>(),
            "notes": self.scene.notes,
            "warnings": self.warnings,
        })
    }
}
