//! Modules use only those above them in the list in lib.rs, so that there are no circles.

use std::path::Path;

/// The list in lib.rs, from the lowest.
fn rooms() -> Vec<Vec<&'static str>> {
    let lines = include_str!("lib.rs").lines().filter_map(|line| line.strip_prefix("//! - "));
    lines.filter_map(|line| line.split('`').nth(1)).map(|room| room.split("::").collect()).collect()
}

/// The room that holds this path from the crate's root: the longest of those that begin it.
fn room_of(rooms: &[Vec<&str>], path: &[&str]) -> Option<usize> {
    (0..rooms.len()).filter(|&i| path.starts_with(&rooms[i])).max_by_key(|&i| rooms[i].len())
}

/// All paths of the tree of names that `text` begins with, as in `a::{b, c::d}`, each after `prefix`; what follows the tree is returned.
fn tree<'a>(text: &'a str, prefix: &[&'a str], out: &mut Vec<Vec<&'a str>>) -> &'a str {
    let text = text.trim_start();
    if let Some(mut rest) = text.strip_prefix('{') {
        loop {
            rest = tree(rest, prefix, out);
            match rest.trim_start().strip_prefix(',') {
                Some(next) => rest = next,
                None => return rest.trim_start().strip_prefix('}').unwrap_or(rest),
            }
        }
    }
    let (name, rest) = text.split_at(text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len()));
    let path = [prefix, &[name]].concat();
    match rest.strip_prefix("::") {
        Some(rest) => tree(rest, &path, out),
        None => {
            out.push(path);
            // Of `a as b`, the name given.
            rest.trim_start()
                .strip_prefix("as ")
                .map_or(rest, |given| given.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_'))
        }
    }
}

/// What the module at `own` names of other rooms that it may not, in its code `text`.
fn misuses(rooms: &[Vec<&str>], own: &[&str], text: &str) -> Vec<String> {
    let code: String = text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n");
    let mut paths = Vec::new();
    for (at, _) in code.match_indices("crate::").chain(code.match_indices("super::")) {
        // Of `super::super::name` the first is where it starts.
        if !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':' || c == '$') {
            tree(&code[at..], &[], &mut paths);
        }
    }
    let own_room = room_of(rooms, own);
    let misuse = |path: Vec<&str>| {
        let ups = path.iter().take_while(|name| **name == "super").count();
        let from_root = match path[0] {
            "crate" => path[1..].to_vec(),
            _ => [&own[..own.len().saturating_sub(ups)], &path[ups..]].concat(),
        };
        let used = room_of(rooms, &from_root)?;
        (Some(used) > own_room).then(|| format!("{} uses {}", own.join("::"), from_root.join("::")))
    };
    paths.into_iter().filter_map(misuse).collect()
}

/// Calls `see` with the path from the crate's root and the text of every module under `folder`.
fn walk(folder: &Path, at: &[&str], see: &mut dyn FnMut(&[&str], &str)) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let inner = [at, &[name]].concat();
        if path.is_dir() {
            walk(&path, &inner, see);
        } else if path.extension().is_some_and(|e| e == "rs") {
            see(if name == "mod" { at } else { &inner }, &std::fs::read_to_string(&path).unwrap());
        }
    }
}

#[test]
fn modules_use_only_those_above_them_in_the_list_of_rooms() {
    let rooms = rooms();
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &[], &mut |own, text| {
        if !matches!(own, ["lib" | "main" | "rooms"]) {
            assert!(room_of(&rooms, own).is_some(), "{own:?} is in no room of the list in lib.rs");
            found.extend(misuses(&rooms, own, text));
        }
    });
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn every_file_is_a_module() {
    // One that is not is never compiled: its tests pass whatever they say.
    let mut texts = std::collections::BTreeMap::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &[], &mut |own, text| {
        let own = if own == ["lib"] { &[] } else { own };
        texts.insert(own.join("::"), text.to_string());
    });
    let declared = |own: &str| {
        let (above, name) = own.rsplit_once("::").unwrap_or(("", own));
        texts[above].lines().any(|line| line.trim_end().ends_with(&format!("mod {name};")))
    };
    let lost: Vec<&String> = texts.keys().filter(|own| !own.is_empty() && *own != "main" && !declared(own)).collect();
    assert!(lost.is_empty(), "no module names these: {lost:?}");
}

#[test]
fn what_is_not_above_is_found_however_it_is_named() {
    let rooms = rooms();
    let of = |own: &[&str], text: &str| misuses(&rooms, own, text).len();
    assert_eq!(of(&["color", "cie"], "use crate::scene::Bins;"), 1);
    assert_eq!(of(&["color", "cie"], "use crate::{error, scene::{Scene, Light}, spectrum::Ior};"), 2);
    assert_eq!(of(&["color", "cie"], "let a = f(crate::render::render);"), 1);
    assert_eq!(of(&["gpu", "kernel"], "use super::{Gpu as G, scene::GpuScene};"), 1);
    assert_eq!(of(&["gpu", "kernel"], "use crate::gpu::{Gpu, scene};"), 1);
    assert_eq!(of(&["gpu", "scene", "lights"], "use super::super::layout; use crate::gpu::Gpu;"), 0);
    assert_eq!(of(&["memory"], "use super::cli;"), 1);
    assert_eq!(of(&["scene", "types"], "use crate::color; // crate::render\n/// [`crate::reference`]"), 0);
}
