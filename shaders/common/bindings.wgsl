// What the passes read; a binding is there only if the scene needs it. Tables are storage textures of vec4<u32>: a software driver fetches a whole
// texel at once, but a storage buffer word by word and lane by lane, and of a sampled texture it works out mip level and stride for every texel
// (measured on lavapipe: rays/s).
@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var bvh: Table<vec4u>;
#if CAMERA_PATHS || LIGHT_PATHS || INTERIORS
@group(0) @binding(3) var materials: Table<Material>;

#endif
#if INTERIORS
@group(0) @binding(8) var interiors: Table<Interior>;

#endif
#if SMOOTH_NORMALS
@group(0) @binding(9) var normals: Table<vec4f>;
#endif
#if CAMERA_PATHS || LIGHT_PATHS
@group(0) @binding(6) var<storage, read_write> counters: array<atomic<u32>>;
#if LIGHTS_PRESENT
@group(0) @binding(7) var lights: Table<Light>;

#endif
#if ROUGH
@group(0) @binding(10) var<storage, read> tables: array<f32>;
#endif
#if ENV_IMAGE
@group(0) @binding(11) var environment: Table<vec4f>;
#endif
#if TEXTURES
@group(0) @binding(20) var textures: Table<vec4u, Texture>;
#endif
#if LIGHT_PATHS
#if MANY_BINS
@group(0) @binding(12) var<storage, read> lane_bins: array<u32>;
#endif
#endif
#endif

#include "geometry/primitives.wgsl"
