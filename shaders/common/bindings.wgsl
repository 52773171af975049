// Buffers that both passes read; a binding is there only if the scene needs it.
@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> bvh: array<vec4u>;
@group(0) @binding(2) var<storage, read> primitives: array<vec4f>;
@group(0) @binding(3) var<storage, read> materials: array<Material>;
@group(0) @binding(4) var<storage, read> spectra: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> counters: array<atomic<u32>>;
#if LIGHTS_PRESENT
@group(0) @binding(7) var<storage, read> lights: array<Light>;
#endif
#if INTERIORS
@group(0) @binding(8) var<storage, read> interiors: array<Interior>;
#endif
#if SMOOTH_NORMALS
@group(0) @binding(9) var<storage, read> normals: array<vec4f>;
#endif
#if ROUGH
@group(0) @binding(10) var<storage, read> tables: array<f32>;
#endif
#if ENV_IMAGE
@group(0) @binding(11) var<storage, read> environment: array<vec4f>;
#endif
#if MANY_BINS
@group(0) @binding(12) var<storage, read> lane_bins: array<u32>;
#endif
