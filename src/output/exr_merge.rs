//! One spectral EXR of several, renders of the same picture that differ in their seeds.
//!
//! Means weigh by samples: with `n_j` samples of `N` in file `j`, a value is `sum n_j x_j / N` and its standard error
//! `sqrt(sum (n_j e_j)^2) / N`, that of the mean over the image (`abbe.meanErrors`) likewise. Depth, normal and albedo, which one render has as well as
//! several, are those of the least seed. Counts and times add up. `abbe.seed` lists the seeds, `abbe.samplesOfSeeds` the samples of each, and `abbe.merged`
//! says what bias is left where light paths are merged or wavelengths share ways: every seed begins with the widest radius.
//!
//! Sums are made in the order of the seeds, so that the order of the files changes no bit. Files are read one after the other, block by block: memory is 8
//! bytes for each pixel and channel, however many there are.

use super::exr::{Planes, preview, preview_gain, text, write_planes};
use super::exr_read::{About, open_exr, range_nm};
use super::picture::picture_exposure;
use crate::develop::picture::Exposure;
use crate::error::{Error, Result};
use crate::integrator::{fold_seed, mean_squared_radius};
use exr::meta::attribute::AttributeValue;
use exr::prelude::Vec2;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// What was merged.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// Pixels across.
    pub width: usize,
    /// XYZ of every pixel, cd m^-2.
    pub xyz: Vec<[f32; 3]>,
    /// First and last wavelength, nm.
    pub range_nm: (f64, f64),
    /// Exposure of its picture in stops.
    pub exposure: f64,
    /// Samples per pixel.
    pub samples: u64,
    /// Batches.
    pub batches: u64,
    /// What a user should know about it.
    pub notes: Vec<String>,
}

/// A file whose header has been read.
struct Part<'a> {
    path: &'a Path,
    about: About,
    /// Seeds, each with its samples per pixel.
    seeds: Vec<(u64, u64)>,
    samples: u64,
}

/// What becomes of a channel.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    /// The mean.
    Mean,
    /// The error of the mean.
    Error,
    /// That of the first file.
    First,
    /// `R`, `G` or `B`, made anew from XYZ.
    Preview(usize),
}

/// First parts of the names of what is seen.
const SEEN: [&str; 4] = ["depth", "normal", "albedo", "behind"];

impl Role {
    fn of(channel: &str) -> Role {
        match (["R", "G", "B"].iter().position(|name| *name == channel), channel.split('.').next()) {
            (Some(component), _) => Role::Preview(component),
            (_, Some("S0" | "XYZ")) => Role::Mean,
            // Weighted sums of independent ones are as good as each.
            (_, Some("half")) if !SEEN.contains(&channel.split('.').nth(1).unwrap_or_default()) => Role::Mean,
            (_, Some("error")) => Role::Error,
            _ => Role::First,
        }
    }
}

/// Attributes in which files must agree, and what they are called.
const SAME: [(&str, &str); 9] = [
    ("abbe.version", "version"),
    ("abbe.scene", "scene"),
    ("abbe.sceneHash", "content of the scene's files"),
    ("abbe.frame", "frame"),
    ("abbe.quantity", "quantity"),
    ("abbe.range", "range of wavelengths"),
    ("abbe.maxDepth", "greatest depth"),
    ("abbe.techniques", "set of techniques"),
    ("spectralLayoutVersion", "layout"),
];
/// Attributes that add up.
const COUNTS: [&str; 9] = [
    "abbe.samples",
    "abbe.batches",
    "abbe.rays",
    "abbe.droppedNotFinite",
    "abbe.droppedNegative",
    "abbe.droppedSaturated",
    "abbe.droppedCrowded",
    "abbe.droppedUnfinished",
    "abbe.truncated",
];

/// Merges the spectral EXRs `paths` into `output`.
///
/// # Errors
/// [`Error::File`] for files that cannot be read, that Abbe has not written, that are of different pictures or share random numbers: what differs is named.
pub fn merge_exrs(paths: &[PathBuf], output: &Path) -> Result<Merged> {
    let mut parts = paths.iter().map(|path| Part::open(path)).collect::<Result<Vec<_>>>()?;
    parts[1..].iter().try_for_each(|part| part.is_like(&parts[0]))?;
    parts.sort_by(|a, b| a.seeds.cmp(&b.seeds));
    check_seeds(&parts)?;

    let first = &parts[0].about;
    let has_errors = |part: &Part| part.about.names.iter().any(|name| Role::of(name) == Role::Error);
    let mut notes = Vec::new();
    let errors = parts.iter().all(has_errors);
    if let (false, true, Some(without)) = (errors, parts.iter().any(has_errors), parts.iter().find(|part| !has_errors(part))) {
        notes.push(format!("{} has no errors, and so they are left out", without.path.display()));
    }
    let channels: Vec<(String, Role)> = first.names.iter().map(|name| (name.clone(), Role::of(name))).collect();
    let channels: Vec<_> = channels.into_iter().filter(|(_, role)| errors || *role != Role::Error).collect();
    let size = Vec2(first.window.size[0], first.window.size[1]);
    let total: u64 = parts.iter().map(|part| part.samples).sum();

    let mut attributes = Attributes::of(&parts, total);
    let Some(range_nm) = range_nm(&first.attributes) else {
        return Err(Error::file(parts[0].path, "it does not say its range of wavelengths", FOREIGN));
    };
    let exposures: Vec<_> = parts.iter().map(|part| part.about.attribute("EV").map(str::to_string)).collect();
    let same_exposure = exposures.windows(2).all(|pair| pair[0] == pair[1]);
    let given = exposures[0].as_ref().filter(|_| same_exposure).and_then(|ev| ev.parse().ok());
    notes.extend(attributes.bias.clone());

    let sums = sums(&parts, &channels, size, total)?;
    let at = |channel: usize, pixel: usize| sums[channel][pixel];
    let index = |name: &str| channels.iter().position(|(n, _)| n == name);
    let Some([x, y, z]) = index("XYZ.X").zip(index("XYZ.Y")).zip(index("XYZ.Z")).map(|((x, y), z)| [x, y, z]) else {
        return Err(Error::file(&paths[0], "it has no XYZ channels", FOREIGN));
    };
    let xyz: Vec<[f32; 3]> = (0..size.area()).map(|pixel| [x, y, z].map(|c| at(c, pixel) as f32)).collect();
    let exposure = picture_exposure(&xyz, range_nm, given.map_or_else(Exposure::default, Exposure::Stops));
    attributes.list.push(("EV".to_string(), AttributeValue::F32(exposure as f32)));
    let gain = preview_gain(exposure);
    let value = |channel: usize, pixel: usize| match channels[channel].1 {
        Role::Mean | Role::First => at(channel, pixel) as f32,
        Role::Error => at(channel, pixel).sqrt() as f32,
        Role::Preview(component) => preview([x, y, z].map(|c| at(c, pixel)), gain)[component],
    };
    let names = channels.iter().map(|(name, _)| name.clone()).collect();
    let list = attributes.list.iter().map(|(name, value)| (name.as_str(), value.clone())).collect();
    write_planes(output, &Planes { window: first.window, names, value: &value }, list)?;
    Ok(Merged { width: size.width(), xyz, range_nm, exposure, samples: total, batches: attributes.batches, notes })
}

const FOREIGN: &str = "give spectral EXRs that abbe render wrote; others can be averaged by OpenImageIO, as in oiiotool a.exr b.exr --add --mulc 0.5 -o c.exr, \
                       where you know that they have as many samples and other random numbers";

impl<'a> Part<'a> {
    fn open(path: &'a Path) -> Result<Self> {
        let about = open_exr(path, None)?.about;
        let numbers = |name: &str| -> Option<Vec<u64>> { about.attribute(name)?.split(' ').map(|n| n.parse().ok()).collect() };
        let samples = numbers("abbe.samples").and_then(|all| <[u64; 1]>::try_from(all).ok());
        let (Some(seeds), Some([samples])) = (numbers("abbe.seed"), samples.filter(|[n]| (1..1 << 40).contains(n))) else {
            return Err(Error::file(path, "it does not say its seed and its samples", FOREIGN));
        };
        let each =
            numbers("abbe.samplesOfSeeds").filter(|each| each.len() == seeds.len()).unwrap_or_else(|| vec![samples; seeds.len()]);
        let mut seeds: Vec<(u64, u64)> = seeds.into_iter().zip(each).collect();
        seeds.sort_unstable();
        Ok(Part { path, about, seeds, samples })
    }

    /// Refuses one that is of another picture than `first`, by what differs.
    fn is_like(&self, first: &Part) -> Result<()> {
        let size = |part: &Part| part.about.window.to_string();
        let bins = |part: &Part| part.about.selection.wavelengths_nm.len().to_string();
        let said = |part: &Part, name: &str| part.about.attribute(name).unwrap_or("none").to_string();
        let shapes = [("size", size(self), size(first)), ("number of bins", bins(self), bins(first))];
        let attributes = SAME.iter().map(|(name, what)| (*what, said(self, name), said(first, name)));
        match shapes.into_iter().chain(attributes).find(|(_, ours, theirs)| ours != theirs) {
            Some((what, ours, theirs)) => {
                let problem = format!("this is of another {what} than {}: {ours} instead of {theirs}", first.path.display());
                Err(Error::file(self.path, problem, "give renders of one picture that differ in --seed alone"))
            }
            None => Ok(()),
        }
    }

    fn number(&self, name: &str) -> f64 {
        self.about.attribute(name).and_then(|n| n.parse().ok()).unwrap_or(0.0)
    }
}

/// Refuses files with the same random numbers.
fn check_seeds(parts: &[Part]) -> Result<()> {
    let mut all: Vec<(u32, u64, &Part)> =
        parts.iter().flat_map(|part| part.seeds.iter().map(move |(seed, _)| (fold_seed(*seed), *seed, part))).collect();
    all.sort_by_key(|(key, seed, _)| (*key, *seed));
    match all.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(&[(_, a, before), (_, b, part)]) => {
            let other = before.path.display();
            let problem = if a == b {
                format!("this is of seed {b}, as {other} is: the same random numbers")
            } else {
                format!("its seed {b} gives the same random numbers as seed {a} of {other}")
            };
            let remedy = "render one with another --seed; of shares of one render, merge the checkpoints";
            Err(Error::file(part.path, problem, remedy))
        }
        _ => Ok(()),
    }
}

/// Sums `[channel][pixel]` over the files, of which one is open at a time: means, squares of errors, and the first file's values.
fn sums(parts: &[Part], channels: &[(String, Role)], size: Vec2<usize>, total: u64) -> Result<Vec<Vec<f64>>> {
    let mut sums = vec![vec![0.0f64; size.area()]; channels.len()];
    for (i, part) in parts.iter().enumerate() {
        let path = part.path;
        let file = open_exr(path, None)?;
        if file.about != part.about {
            return Err(Error::file(path, "it has changed while it was read", "merge files that are done"));
        }
        let weight = part.samples as f64 / total as f64;
        // A channel of the file may be at another place, or left out.
        let places: Vec<Option<usize>> =
            part.about.names.iter().map(|name| channels.iter().position(|(n, _)| n == name)).collect();
        let rows: Vec<Vec<Mutex<&mut [f64]>>> =
            sums.iter_mut().map(|plane| plane.chunks_exact_mut(size.width()).map(Mutex::new).collect()).collect();
        let read = file.lines(|channel, x, y, values| {
            let Some(place) = places[channel] else { return };
            let mut row = rows[place][y].lock().unwrap_or_else(PoisonError::into_inner);
            let sums = row[x..].iter_mut().zip(values);
            match channels[place].1 {
                Role::Mean => sums.for_each(|(sum, v)| *sum += weight * f64::from(*v)),
                Role::Error => sums.for_each(|(sum, v)| *sum += (weight * f64::from(*v)).powi(2)),
                Role::First if i == 0 => sums.for_each(|(sum, v)| *sum = f64::from(*v)),
                Role::First | Role::Preview(_) => {}
            }
        });
        read.map_err(|problem| Error::file(path, format!("not a readable EXR: {problem}"), "give a whole file, not cut short"))?;
    }
    Ok(sums)
}

/// What the header says.
struct Attributes {
    list: Vec<(String, AttributeValue)>,
    batches: u64,
    /// How merging light paths restarts with every seed.
    bias: Option<String>,
}

impl Attributes {
    fn of(parts: &[Part], total: u64) -> Self {
        let string = |name: &str, value: String| (name.to_string(), AttributeValue::Text(text(&value)));
        let sum = |name: &str| parts.iter().map(|part| part.number(name)).sum::<f64>();
        let first = &parts[0].about;
        let mut list = Vec::new();
        // As they are in the first file, but for what is made anew.
        let own = [
            "EV",
            "software",
            "abbe.seed",
            "abbe.samplesOfSeeds",
            "abbe.merged",
            "abbe.merging",
            "abbe.options",
            "abbe.interrupted",
            "abbe.device",
            "abbe.seconds",
            "abbe.meanErrors",
            "abbe.meanGroups",
        ];
        let kept = first.attributes.iter().filter(|(name, _)| !own.contains(&name.as_str()) && !COUNTS.contains(&name.as_str()));
        list.extend(kept.map(|(name, value)| string(name, value.clone())));
        list.extend(COUNTS.iter().map(|name| string(name, format!("{}", sum(name) as u64))));
        list.push(("abbe.seconds".to_string(), AttributeValue::F64(sum("abbe.seconds"))));

        let mut seeds: Vec<(u64, u64)> = parts.iter().flat_map(|part| part.seeds.iter().copied()).collect();
        seeds.sort_unstable();
        let words = |all: &mut dyn Iterator<Item = u64>| all.map(|n| n.to_string()).collect::<Vec<_>>().join(" ");
        list.push(string("abbe.seed", words(&mut seeds.iter().map(|(seed, _)| *seed))));
        list.push(string("abbe.samplesOfSeeds", words(&mut seeds.iter().map(|(_, samples)| *samples))));
        let mut devices: Vec<&str> =
            parts.iter().flat_map(|p| p.about.attribute("abbe.device")).flat_map(|d| d.split("; ")).collect();
        devices.sort_unstable();
        devices.dedup();
        list.push(string("abbe.device", devices.join("; ")));

        let (errors, groups) = mean_errors(parts, total);
        list.push(string("abbe.meanErrors", errors.iter().map(|e| format!("{:e}", *e as f32)).collect::<Vec<_>>().join(" ")));
        list.push(string("abbe.meanGroups", groups.to_string()));
        let merges = parts.iter().any(|part| part.about.attribute("abbe.merging") == Some("yes"));
        list.push(string("abbe.merging", if merges { "yes" } else { "no" }.to_string()));
        let bias = bias(&seeds).filter(|_| merges);
        list.extend(bias.iter().map(|bias| string("abbe.merged", bias.clone())));
        Attributes { list, batches: sum("abbe.batches") as u64, bias }
    }
}

/// Standard errors of the bins' means over the image, and of how many groups they are (Welch & Satterthwaite, the bin with the fewest).
fn mean_errors(parts: &[Part], total: u64) -> (Vec<f64>, u64) {
    let bins = parts[0].about.selection.wavelengths_nm.len();
    let (mut variances, mut spreads) = (vec![0.0; bins], vec![0.0; bins]);
    for part in parts {
        let text = part.about.attribute("abbe.meanErrors").unwrap_or_default();
        let errors: Vec<f64> = text.split(' ').map(|e| e.parse().unwrap_or(f64::INFINITY)).collect();
        let dof = (part.number("abbe.meanGroups") - 1.0).max(1.0);
        for (b, (variance, spread)) in variances.iter_mut().zip(&mut spreads).enumerate() {
            let own = (part.samples as f64 / total as f64 * errors.get(b).copied().unwrap_or(f64::INFINITY)).powi(2);
            *variance += own;
            *spread += own * own / dof;
        }
    }
    let dofs = variances.iter().zip(&spreads).filter(|(_, spread)| **spread > 0.0).map(|(v, spread)| v * v / spread);
    let dof = dofs.fold(f64::INFINITY, f64::min);
    // What is black everywhere has no errors, of as many groups as there are.
    let all = || parts.iter().map(|part| (part.number("abbe.meanGroups") - 1.0).max(1.0)).sum::<f64>();
    let dof = if dof.is_finite() { dof } else { all() };
    (variances.into_iter().map(f64::sqrt).collect(), dof as u64 + 1)
}

/// What it means that every seed begins with the widest radius, in words; nothing for a single one.
fn bias(seeds: &[(u64, u64)]) -> Option<String> {
    if seeds.len() < 2 {
        return None;
    }
    let total: u64 = seeds.iter().map(|(_, samples)| samples).sum();
    let mean = seeds.iter().map(|(_, n)| *n as f64 / total as f64 * mean_squared_radius(*n)).sum::<f64>();
    let ratio = mean / mean_squared_radius(total);
    Some(format!(
        "every one of {} seeds begins with the widest radius of merging: caustics seen through glass or in mirrors, and what glass does to colours, have {ratio:.2} times the bias (blur) of one \
         render of {total} samples per pixel",
        seeds.len()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bias_of_equal_seeds_grows_as_the_cube_root_of_their_number() {
        let of = |seeds: &[(u64, u64)]| bias(seeds).expect("several seeds");
        // The squared radius falls as pass^(-1/3), and so does its mean over many passes.
        assert!(of(&[(1, 1 << 20); 8]).contains(" 2.00 times the bias"), "{}", of(&[(1, 1 << 20); 8]));
        assert!(of(&[(1, 1 << 20), (2, 1)]).contains(" 1.00 times the bias"));
        assert_eq!(bias(&[(3, 64)]), None);
    }
}
