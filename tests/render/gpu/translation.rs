//! Every kernel of every shipped scene is translated for the drivers of other systems: what naga cannot write for them would fail there alone.

use super::plan::kernels;
use super::support::*;
use naga::back::{hlsl, msl, spv};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use std::collections::BTreeSet;

/// A kernel as naga has it.
fn module(name: &str, source: &str) -> (naga::Module, ModuleInfo) {
    let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
    (module, info.unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source))))
}

/// Text for Direct3D's shader model 6.0.
fn to_hlsl(module: &naga::Module, info: &ModuleInfo) -> Result<String, hlsl::Error> {
    let mut text = String::new();
    let options = hlsl::Options { shader_model: hlsl::ShaderModel::V6_0, ..Default::default() };
    hlsl::Writer::new(&mut text, &options, &hlsl::PipelineOptions::default()).write(module, info, None)?;
    Ok(text)
}

/// Text for Metal 2.4.
fn to_msl(module: &naga::Module, info: &ModuleInfo) -> Result<String, msl::Error> {
    let options = msl::Options { lang_version: (2, 4), ..Default::default() };
    msl::write_string(module, info, &options, &msl::PipelineOptions::default()).map(|(text, _)| text)
}

/// Words of SPIR-V.
fn to_spirv(module: &naga::Module, info: &ModuleInfo) -> Result<Vec<u32>, spv::Error> {
    spv::write_vec(module, info, &spv::Options::default(), None)
}

#[test]
fn kernels_of_shipped_scenes_are_valid_for_vulkan_direct3d_and_metal() {
    let mut seen = BTreeSet::new();
    for (path, scene) in shipped_scenes() {
        for (root, source) in kernels(&scene) {
            if seen.insert(source.clone()) {
                let name = format!("{root} of {}", path.display());
                let (module, info) = module(&name, &source);
                assert!(!to_spirv(&module, &info).unwrap_or_else(|e| panic!("{name}, SPIR-V: {e}")).is_empty());
                assert!(to_hlsl(&module, &info).unwrap_or_else(|e| panic!("{name}, HLSL: {e}")).contains("main"));
                assert!(to_msl(&module, &info).unwrap_or_else(|e| panic!("{name}, MSL: {e}")).contains("kernel"));
            }
        }
    }
    assert!(seen.len() > 30, "{} different kernels", seen.len());
}
