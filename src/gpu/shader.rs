//! Assembles a kernel's WGSL from `shaders/`: `#include "path"` (each file once), `#if A || B`, `#if !A`, `#elif`, `#else`, `#endif` over
//! features that the plan switches. An unknown name is an error, so that a typo cannot switch a feature off. Tables are declared as
//! `@group(0) @binding(N) var NAME: Table<KIND>;` (or `WritableTable`, `WrittenTable`), see `tables.rs`.

use super::tables::{self, Writer};
use include_dir::{Dir, include_dir};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};

static SHADERS: Dir = include_dir!("$CARGO_MANIFEST_DIR/shaders");

/// The feature of kernels whose tables are buffers; the adapter asks for it, no file of `shaders/` does.
pub const TABLES_IN_BUFFERS: &str = "TABLES_IN_BUFFERS";

/// Text of the kernel whose root file is `root`, with `features` decided and `prelude` in front.
pub fn assemble(root: &str, prelude: &str, features: &BTreeMap<&str, bool>) -> Result<String, String> {
    let mut out = String::from(prelude);
    if features.get(TABLES_IN_BUFFERS) == Some(&true) {
        out += tables::WGSL_PACKED_TABLES;
    }
    include(root, features, &mut HashSet::new(), &mut out)?;
    Ok(out)
}

/// State of one `#if` ... `#endif`.
struct Branch {
    /// The text here is wanted.
    active: bool,
    /// One of the alternatives was wanted already.
    taken: bool,
    /// The surrounding text is wanted.
    outer: bool,
}

fn include(path: &str, features: &BTreeMap<&str, bool>, seen: &mut HashSet<String>, out: &mut String) -> Result<(), String> {
    if !seen.insert(path.to_string()) {
        return Ok(());
    }
    let text =
        SHADERS.get_file(path).and_then(|f| f.contents_utf8()).ok_or_else(|| format!("shader file {path} does not exist"))?;
    let mut branches: Vec<Branch> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let at = |problem: &str| format!("shaders/{path}:{}: {problem}", number + 1);
        let active = branches.last().is_none_or(|b| b.active);
        let directive = line.trim_start();
        if let Some(condition) = directive.strip_prefix("#if ") {
            let wanted = evaluate(condition, features).map_err(|e| at(&e))?;
            branches.push(Branch { active: active && wanted, taken: wanted, outer: active });
        } else if let Some(condition) = directive.strip_prefix("#elif ") {
            let wanted = evaluate(condition, features).map_err(|e| at(&e))?;
            let b = branches.last_mut().ok_or_else(|| at("#elif without #if"))?;
            b.active = b.outer && !b.taken && wanted;
            b.taken |= wanted;
        } else if directive == "#else" {
            let b = branches.last_mut().ok_or_else(|| at("#else without #if"))?;
            b.active = b.outer && !b.taken;
            b.taken = true;
        } else if directive == "#endif" {
            branches.pop().ok_or_else(|| at("#endif without #if"))?;
        } else if let Some(name) = directive.strip_prefix("#include ") {
            if active {
                include(name.trim().trim_matches('"'), features, seen, out).map_err(|e| format!("{e} (included from {path})"))?;
            }
        } else if directive.starts_with('#') {
            return Err(at("unknown directive"));
        } else if active {
            let in_buffers = features.get(TABLES_IN_BUFFERS) == Some(&true);
            out.push_str(&declaration(line, in_buffers).map_err(|e| at(&e))?);
            out.push('\n');
        }
    }
    if branches.is_empty() { Ok(()) } else { Err(format!("shaders/{path}: #if without #endif")) }
}

/// A line of WGSL, of a table its declaration and accessors.
///
/// # Errors
/// Names what is no record, and a binding that is none.
pub fn declaration(line: &str, in_buffers: bool) -> Result<Cow<'_, str>, String> {
    let parts = line.split_once(" var ").and_then(|(binding, rest)| Some((binding, rest.split_once(": ")?)));
    let Some((binding, (name, kind))) = parts else { return Ok(line.into()) };
    let writers = [("Table<", Writer::Host), ("WritableTable<", Writer::Kernel), ("WrittenTable<", Writer::Other)];
    let table = writers.iter().find_map(|(what, writer)| Some((kind.strip_prefix(what)?.split_once(">;")?.0, *writer)));
    let Some((kinds, writer)) = table else { return Ok(line.into()) };
    let number = binding.rsplit_once('(').and_then(|(_, number)| number.trim_end_matches(')').parse().ok());
    let number = number.ok_or_else(|| format!("the table {name} has no binding"))?;
    Ok(tables::wgsl_table(name, number, kinds, writer, in_buffers)?.into())
}

fn evaluate(condition: &str, features: &BTreeMap<&str, bool>) -> Result<bool, String> {
    let mut any = false;
    for term in condition.split("||") {
        let term = term.trim();
        let (name, negated) = term.strip_prefix('!').map_or((term, false), |n| (n, true));
        let value = features.get(name).ok_or_else(|| format!("unknown feature {name}"))?;
        any |= value != &negated;
    }
    Ok(any)
}

/// Features that files of `shaders/` ask for, whether anything includes them or not, each with a place where.
pub fn features_asked_for() -> BTreeMap<&'static str, String> {
    fn files<'a>(dir: &'a Dir<'a>) -> Vec<&'a include_dir::File<'a>> {
        dir.dirs().flat_map(files).chain(dir.files()).collect()
    }
    let mut asked = BTreeMap::new();
    for file in files(&SHADERS) {
        for (number, line) in file.contents_utf8().unwrap_or_default().lines().enumerate() {
            let line = line.trim_start();
            let condition = line.strip_prefix("#if ").or_else(|| line.strip_prefix("#elif "));
            for term in condition.into_iter().flat_map(|c| c.split("||")) {
                let place = || format!("shaders/{}:{}", file.path().display(), number + 1);
                asked.entry(term.trim().trim_start_matches('!')).or_insert_with(place);
            }
        }
    }
    asked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_feature_is_an_error_and_alternatives_exclude_each_other() {
        let features = BTreeMap::from([("A", true), ("B", false)]);
        assert_eq!(evaluate("B || A", &features), Ok(true));
        assert_eq!(evaluate("!A", &features), Ok(false));
        assert!(evaluate("C", &features).is_err());
        assert!(assemble("no_such_file.wgsl", "", &features).is_err());
    }
}
