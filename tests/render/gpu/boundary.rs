//! Host and shaders see the same records.

use super::support::*;
use crate::adapter;
use abbe::gpu::layout;
use wgpu::naga::{ScalarKind, TypeInner, front::wgsl};

/// One member of a record as naga sees it: name, offset, number of words, floating point or not.
type Member = (String, usize, usize, bool);

/// Size and members of a record as naga lays it out.
fn record(name: &str) -> (usize, Vec<Member>) {
    let module = wgsl::parse_str(layout::WGSL_RECORDS).unwrap();
    let (_, found) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).expect("the record is declared");
    let TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
    let members = members.iter().map(|m| {
        let (words, scalar) = match module.types[m.ty].inner {
            TypeInner::Scalar(scalar) => (1, scalar),
            TypeInner::Vector { size, scalar } => (size as usize, scalar),
            _ => panic!("{name} has a member that is neither number nor vector"),
        };
        (m.name.clone().unwrap(), m.offset as usize, words, scalar.kind == ScalarKind::Float)
    });
    (*span as usize, members.collect())
}

#[test]
fn records_have_the_layout_that_naga_gives_them() {
    let layouts = layout::record_layouts();
    assert!(layouts.len() >= 4);
    for (name, size, offsets) in layouts {
        let (span, members) = record(name);
        assert_eq!(span, size, "{name}");
        let members: Vec<(&str, usize)> = members.iter().map(|m| (m.0.as_str(), m.1)).collect();
        assert_eq!(members, offsets, "{name}");
    }
}

#[test]
fn loaders_read_every_field_from_its_place() {
    let gpu = adapter::gpu();
    const RECORDS: usize = 3;
    for (name, size, _) in layout::record_layouts() {
        let words = size / 4;
        // Floats between 1 and 2, so that none is denormal or NaN, all different.
        let table: Vec<u32> = (0..RECORDS * words).map(|i| 0x3f80_0000 + i as u32).collect();
        let mut source = prelude()
            + &with_tables(&format!("@group(0) @binding(0) var t: Table<{name}>;"))
            + "@group(0) @binding(1) var<storage, read_write> out: array<u32>;\n"
            + "@compute @workgroup_size(1)\nfn main(@builtin(workgroup_id) group: vec3u) {\n";
        source += &format!("    let r = load_{name}(group.x);\n    let base = group.x * {words}u;\n");
        for (field, offset, count, float) in record(name).1 {
            for i in 0..count {
                let component = if count == 1 { "" } else { [".x", ".y", ".z", ".w"][i] };
                let value = if float { format!("bitcast<u32>(r.{field}{component})") } else { format!("r.{field}{component}") };
                source += &format!("    out[base + {}u] = {value};\n", offset / 4 + i);
            }
        }
        source += "}\n";
        let t = gpu.table("records", &table).unwrap();
        assert_eq!(run_kernel(&gpu, source, &[("t", &t)], table.len(), RECORDS as u32), table, "{name}");
    }
}

#[test]
fn tables_of_many_rows_are_read_in_order() {
    let gpu = adapter::gpu();
    let texels = layout::TABLE_WIDTH as usize * 2 + 64;
    let table: Vec<u32> = (0..4 * texels as u32).collect();
    let source = prelude()
        + &with_tables("@group(0) @binding(0) var t: Table<vec4u>;")
        + "@group(0) @binding(1) var<storage, read_write> out: array<vec4u>;\n"
        + "@compute @workgroup_size(64)\nfn main(@builtin(global_invocation_id) id: vec3u) {\n"
        + "    out[id.x] = load_t(id.x);\n}\n";
    let t = gpu.table("numbers", &table).unwrap();
    assert_eq!(run_kernel(&gpu, source, &[("t", &t)], table.len(), texels as u32 / 64), table);
}
