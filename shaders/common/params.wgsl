// What a dispatch is told (src/gpu/layout.rs).
@group(0) @binding(0) var<uniform> params: Params;
