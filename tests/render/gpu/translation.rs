//! Every kernel of every shipped scene is translated for the drivers of other systems: what naga cannot write for them would fail there alone.

use super::plan::kernels;
use super::support::*;
use naga::back::{hlsl, msl, spv};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use std::collections::BTreeSet;
use std::io::Write;
use std::process::{Command, Stdio};

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

/// Every different kernel of the scenes that ship, by name.
fn shipped_kernels() -> Vec<(String, naga::Module, ModuleInfo)> {
    let mut seen = BTreeSet::new();
    let mut all = Vec::new();
    for (path, scene) in shipped_scenes() {
        for (root, source) in kernels(&scene) {
            if seen.insert(source.clone()) {
                let name = format!("{root} of {}", path.display());
                let (module, info) = module(&name, &source);
                all.push((name, module, info));
            }
        }
    }
    assert!(all.len() > 30, "{} different kernels", all.len());
    all
}

#[test]
fn kernels_of_shipped_scenes_are_valid_for_vulkan_direct3d_and_metal() {
    for (name, module, info) in shipped_kernels() {
        assert!(!to_spirv(&module, &info).unwrap_or_else(|e| panic!("{name}, SPIR-V: {e}")).is_empty());
        assert!(to_hlsl(&module, &info).unwrap_or_else(|e| panic!("{name}, HLSL: {e}")).contains("main"));
        assert!(to_msl(&module, &info).unwrap_or_else(|e| panic!("{name}, MSL: {e}")).contains("kernel"));
    }
}

/// What Khronos' own validator says of these words; nothing if they are valid.
fn spirv_val(words: &[u32]) -> Result<(), String> {
    let mut command = Command::new("spirv-val");
    command.args(["--target-env", "vulkan1.1", "-"]).stdin(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|e| format!("spirv-val of spirv-tools: {e}"))?;
    child.stdin.take().unwrap().write_all(bytemuck::cast_slice(words)).map_err(|e| e.to_string())?;
    let output = child.wait_with_output().map_err(|e| e.to_string())?;
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

#[test]
#[ignore = "long: in tools/soak"]
fn spirv_of_shipped_scenes_passes_the_validator_of_khronos() {
    for (name, module, info) in shipped_kernels() {
        let mut words = to_spirv(&module, &info).unwrap_or_else(|e| panic!("{name}, SPIR-V: {e}"));
        spirv_val(&words).unwrap_or_else(|e| panic!("{name}: {e}"));
        // The comparison has a case on which it must fail: without its last instruction the last function has no end.
        words.pop();
        assert!(spirv_val(&words).is_err(), "{name}: anything passes");
    }
}
