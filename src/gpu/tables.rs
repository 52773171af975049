//! Tables: what kernels read and write by texels of 16 bytes, records or single ones.
//!
//! They are storage textures, which the caches of GPUs and lavapipe's sampler serve best. On adapters that bind few of these they are buffers: all that the
//! host writes in one, since there are few bindings for buffers, too.

use super::layout::{FIELDS, record_layouts};

/// Who writes a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Writer {
    /// The host, before the dispatch: `Table`.
    Host,
    /// This kernel: `WritableTable`.
    Kernel,
    /// Another kernel before it: `WrittenTable`.
    Other,
}

/// Tables that may be packed into one buffer have bindings below this.
pub const PACKED_TABLES: u32 = 32;
/// That buffer, and where in it the table of each binding begins.
pub const WGSL_PACKED_TABLES: &str = "@group(0) @binding(60) var<storage, read> packed_tables: array<vec4u>;
@group(0) @binding(61) var<uniform> first_texels: array<vec4u, 8>;
";
/// What the name of the constant that holds a packed table's binding begins with.
pub const PACKED: &str = "PACKED_";

/// How WGSL declares a table, and reads a texel of it or writes one.
struct Access {
    declaration: String,
    name: String,
    in_buffers: bool,
    first: String,
}

impl Access {
    fn new(name: &str, binding: u32, writer: Writer, in_buffers: bool) -> Self {
        let (name, none) = (name.to_string(), String::new());
        let at = format!("@group(0) @binding({binding}) var");
        let access = |kernel: &'static str| if writer == Writer::Kernel { kernel } else { "read" };
        if !in_buffers {
            let declaration = format!("{at} {name}: texture_storage_2d<rgba32uint, {}>;\n", access("write"));
            return Access { declaration, name, in_buffers, first: none };
        }
        if writer != Writer::Host {
            let declaration = format!("{at}<storage, {}> {name}: array<vec4u>;\n", access("read_write"));
            return Access { declaration, name, in_buffers, first: none };
        }
        let first = format!("first_texels[{}].{} + ", binding / 4, ["x", "y", "z", "w"][binding as usize % 4]);
        Access {
            declaration: format!("const {PACKED}{name} = {binding}u;\n"),
            name: "packed_tables".to_string(),
            in_buffers,
            first,
        }
    }

    fn load(&self, i: &str) -> String {
        let Access { name, first, .. } = self;
        if self.in_buffers { format!("{name}[{first}{i}]") } else { format!("textureLoad({name}, texel({i}))") }
    }

    fn store(&self, i: &str, value: &str) -> String {
        let name = &self.name;
        if self.in_buffers { format!("{name}[{i}] = {value}") } else { format!("textureStore({name}, texel({i}), {value})") }
    }
}

/// WGSL of a table `name`, which `kinds` are in (records, or `vec4f` or `vec4u` for single texels): its declaration and accessors. They name the table
/// itself: naga's Metal writer knows no storage textures as parameters of functions. A texel `i` is read by `load_NAME(i)`, record `i` of a table of such by
/// `load_RECORD(i)`, one whose first texel is `i` by `load_RECORD_at(i)`; `store_...` writes likewise.
///
/// # Errors
/// Names what is neither, and a binding that is none.
pub fn wgsl_table(name: &str, binding: u32, kinds: &str, writer: Writer, in_buffers: bool) -> Result<String, String> {
    if in_buffers && binding >= PACKED_TABLES {
        return Err(format!("the table {name} has a binding beyond {PACKED_TABLES}"));
    }
    let table = Access::new(name, binding, writer, in_buffers);
    let mut out = table.declaration.clone();
    for kind in kinds.split(',').map(str::trim) {
        let (load, store) = (table.load("i"), |v: &str| table.store("i", v));
        out += &match (kind, writer == Writer::Kernel) {
            ("vec4u", false) => format!("fn load_{name}(i: u32) -> vec4u {{\n    return {load};\n}}\n"),
            ("vec4f", false) => format!("fn load_{name}(i: u32) -> vec4f {{\n    return bitcast<vec4f>({load});\n}}\n"),
            ("vec4u", true) => format!("fn store_{name}(i: u32, v: vec4u) {{\n    {};\n}}\n", store("v")),
            ("vec4f", true) => format!("fn store_{name}(i: u32, v: vec4f) {{\n    {};\n}}\n", store("bitcast<vec4u>(v)")),
            (record, is_writable) => wgsl_accessors(name, &table, record, is_writable)?,
        };
    }
    Ok(out)
}

/// WGSL that reads or writes records of one kind in a table.
fn wgsl_accessors(name: &str, table: &Access, record: &str, writable: bool) -> Result<String, String> {
    let unknown = || format!("the table {name} has neither texels nor a record of the kind {record}");
    let layouts = record_layouts();
    let (fields, (_, size, offsets)) =
        FIELDS.iter().zip(&layouts).find(|((name, _), _)| *name == record).map(|((_, f), l)| (f, l)).ok_or_else(unknown)?;
    let texels = size / 16;
    let mut parts: Vec<Vec<(&str, &str)>> = vec![Vec::new(); texels];
    fields.iter().zip(offsets).for_each(|((field, kind), (_, offset))| parts[offset / 16].push((field, kind)));
    let mut out = String::new();
    if writable {
        out += &format!("fn store_{record}_at(i: u32, r: {record}) {{\n");
        for (n, part) in parts.iter().enumerate() {
            let words: Vec<String> = part
                .iter()
                .map(|(field, kind)| match *kind {
                    "vec4u" | "u32" => format!("r.{field}"),
                    "vec4f" => format!("bitcast<vec4u>(r.{field})"),
                    _ => format!("bitcast<u32>(r.{field})"),
                })
                .collect();
            out += &format!("    {};\n", table.store(&format!("i + {n}u"), &format!("vec4u({})", words.join(", "))));
        }
        return Ok(out + "}\n");
    }
    out += &format!("fn load_{record}_at(i: u32) -> {record} {{\n    var r: {record};\n");
    for (n, part) in parts.iter().enumerate() {
        out += &format!("    let t{n} = {};\n", table.load(&format!("i + {n}u")));
        for ((field, kind), component) in part.iter().zip(["x", "y", "z", "w"]) {
            out += &match *kind {
                "u32" => format!("    r.{field} = t{n}.{component};\n"),
                "f32" => format!("    r.{field} = bitcast<f32>(t{n}.{component});\n"),
                "vec4f" => format!("    r.{field} = bitcast<vec4f>(t{n});\n"),
                _ => format!("    r.{field} = t{n};\n"),
            };
        }
    }
    out +=
        &format!("    return r;\n}}\nfn load_{record}(i: u32) -> {record} {{\n    return load_{record}_at({texels}u * i);\n}}\n");
    Ok(out)
}
