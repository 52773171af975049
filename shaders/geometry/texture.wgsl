// Pictures on surfaces (the model: src/scene/texture/mod.rs). One table holds their records, the texture coordinates of all primitives, and texels of
// upsampled colours; what is interpolated are spectra. A look-up writes all wavelengths at once, so that materials and lights read it like any spectrum.
#include "common/spectra.wgsl"
#include "geometry/primitives.wgsl"
#include "geometry/surface.wgsl"
#if TANGENTS
#include "geometry/tangent.wgsl"
#endif
#if CAMERA_PATHS || LIGHT_PATHS
#include "bsdf/bsdf.wgsl"
#endif
@group(0) @binding(20) var textures: Table<vec4u, Texture>;

#if MORE_UVS
const UV_SETS = 2u;
#else
const UV_SETS = 1u;
#endif
#if TINTS
const COORDINATES = 2u * UV_SETS + 3u;
#else
const COORDINATES = 2u * UV_SETS;
#endif

// Texel of the table at which texture coordinates of a primitive begin, set by set, and after them the colours of its vertices.
fn coordinates_of(primitive: Primitive) -> u32 {
    return params.first_uv + COORDINATES * primitive.place;
}

// How much of its second and third corner is in the point `p` of a triangle.
fn shares_at(primitive: Primitive, p: vec3f) -> vec2f {
    let p0 = primitive.r0.xyz;
    let e1 = primitive.r1.xyz - p0;
    let e2 = primitive.r2.xyz - p0;
    let n = cross(e1, e2);
    let scale = 1.0 / max(dot(n, n), 1e-37);
    return vec2f(dot(cross(p - p0, e2), n), dot(cross(e1, p - p0), n)) * scale;
}

// Where in a primitive's coordinates those begin that a picture lies on.
fn set_of(t: Texture) -> u32 {
#if MORE_UVS
    return 2u * ((t.sampling >> 11u) & 1u);
#else
    return 0u;
#endif
}

const WRAP_MIRROR = 1u;
const WRAP_CLAMP = 2u;

// `x` brought to where its two texels lie beside or in the picture.
fn wrap_coordinate(x: f32, mode: u32) -> f32 {
    let period = select(1.0, 2.0, mode == WRAP_MIRROR);
    return select(x - period * floor(x / period), clamp(x, 0.0, 1.0), mode == WRAP_CLAMP);
}

// `x` but for whole periods, and as it is where there are none.
fn wrap_whole(x: f32, mode: u32) -> f32 {
    return select(x - 2.0 * floor(0.5 * x), x, mode == WRAP_CLAMP);
}

fn wrap_texel(i: i32, size: i32, mode: u32) -> u32 {
    let j = (i + 2 * size) % (2 * size);
    var wrapped = j % size;
    wrapped = select(wrapped, min(j, 2 * size - 1 - j), mode == WRAP_MIRROR);
    wrapped = select(wrapped, i, mode == WRAP_CLAMP);
    return u32(clamp(wrapped, 0, size - 1));
}

struct Filtered {
    c00: vec4f,
    c10: vec4f,
    c01: vec4f,
    c11: vec4f,
    weights: vec4f,
#if TINTS
    v0: vec4f, // colours of the triangle's vertices
    v1: vec4f,
    v2: vec4f,
    shares: vec2f,
    is_tinted: bool,
#endif
    x_row: u32,
    factor_row: u32,
    cutoff: f32,
    has_cutoff: bool,
#if SPECTRAL_TEXELS
    first: vec4u, // of the bins of the four texels
    is_spectral: bool,
#endif
}

#if SIGMOID_TEXELS
// c0, c1, c2 and the factor of a sigmoid in eight bytes (pack_sigmoid in src/scene/texture/texels.rs).
fn unpack_sigmoid(w: vec2u) -> vec4f {
    let y = (14.0 / 32767.0) * (vec3f(f32(w.x & 0xffffu), f32(w.x >> 16u), f32(w.y & 0xffffu)) - 32768.0);
    let t = 0.5 * (exp(y) - exp(-y));
    let factor = select(exp2((f32(w.y >> 16u) - 32768.0) / 480.0), 0.0, w.y >> 16u == 0u);
    return vec4f(2.0 * t.x - 4.0 * t.y + 2.0 * t.z, 4.0 * t.y - 3.0 * t.x - t.z, t.x, factor);
}
#endif

// Texel `i` of a picture as c0, c1, c2 of a sigmoid and a factor; of a picture of vectors, x, y and z.
fn load_texel(t: Texture, i: u32) -> vec4f {
    let log_size = (t.sampling >> 9u) & 3u;
    let at = i << log_size;
    let q = load_textures(t.first_texel + (at >> 4u));
    let pair = select(q.xy, q.zw, (at & 8u) != 0u);
    let word = select(pair.x, pair.y, (at & 4u) != 0u);
    let bits = 8u << log_size;
    let number = (word >> (8u * (at & 3u))) & (0xffffffffu >> (32u - min(bits, 32u)));
    switch (t.sampling >> 6u) & 7u {
        case TEXELS_COLORS: {
            return bitcast<vec4f>(load_textures(t.first_color + number));
        }
#if NORMAL_MAPS
        case TEXELS_VECTORS: {
            let bytes = unpack4x8unorm(word).xyz;
            let words = vec3f(unpack2x16unorm(pair.x), unpack2x16unorm(pair.y).x);
            return vec4f((2.0 * select(bytes, words, log_size == 3u) - 1.0) * vec3f(t.u.w, t.u.w, 1.0), 0.0);
        }
#endif
#if SIGMOID_TEXELS
        case TEXELS_SIGMOIDS: {
            return unpack_sigmoid(pair);
        }
#endif
        default: {
            // The sigmoid of 0 is a half.
            return vec4f(0.0, 0.0, 0.0, 2.0 * t.u.w * f32(number) / select(255.0, 65535.0, log_size == 1u));
        }
    }
}

// The texels around the point `p` of a triangle, and their weights.
fn filter_texels(index: u32, primitive: u32, p: vec3f) -> Filtered {
    let t = load_Texture(index);
    let triangle = primitive_at(primitive);
    let shares = shares_at(triangle, p);
    let first_uv = coordinates_of(triangle) + set_of(t);
    let ab = bitcast<vec4f>(load_textures(first_uv));
    let c_whole = bitcast<vec4f>(load_textures(first_uv + 1u));
    let uv = vec3f((1.0 - shares.x - shares.y) * ab.xy + shares.x * ab.zw + shares.y * c_whole.xy, 1.0);
    // What was taken off the coordinates of all points of a triangle: whole numbers.
    let whole = c_whole.zw;
    let modes = vec2u(t.sampling & 3u, (t.sampling >> 2u) & 3u);
    let nearest = (t.sampling & 16u) != 0u;
    let size = vec2i(i32(t.width), i32(t.height));
    let far = vec2f(wrap_whole(dot(t.u.xy, whole), modes.x), wrap_whole(dot(t.v.xy, whole), modes.y));
    let x = vec2f(wrap_coordinate(dot(t.u.xyz, uv) + far.x, modes.x), wrap_coordinate(dot(t.v.xyz, uv) + far.y, modes.y));
    let at = x * vec2f(size) - select(0.5, 0.0, nearest);
    let first = vec2i(floor(at));
    let s = select(at - floor(at), vec2f(0.0), nearest);
    let columns = vec2u(wrap_texel(first.x, size.x, modes.x), wrap_texel(first.x + 1, size.x, modes.x));
    let rows = t.width * vec2u(wrap_texel(first.y, size.y, modes.y), wrap_texel(first.y + 1, size.y, modes.y));
    let places = vec4u(rows.xx + columns, rows.yy + columns);
    var f: Filtered;
#if TINTS
    f.is_tinted = ((t.sampling >> 12u) & 1u) != 0u;
    if (f.is_tinted) {
        let colors = coordinates_of(triangle) + 2u * UV_SETS;
        f.v0 = bitcast<vec4f>(load_textures(colors));
        f.v1 = bitcast<vec4f>(load_textures(colors + 1u));
        f.v2 = bitcast<vec4f>(load_textures(colors + 2u));
        f.shares = shares;
    }
#endif
    f.weights = vec4f((1.0 - s.x) * (1.0 - s.y), s.x * (1.0 - s.y), (1.0 - s.x) * s.y, s.x * s.y);
    f.x_row = t.x_row;
    f.factor_row = t.factor_row;
    f.cutoff = t.cutoff;
    f.has_cutoff = (t.sampling & 32u) != 0u;
#if SPECTRAL_TEXELS
    f.is_spectral = ((t.sampling >> 6u) & 7u) == TEXELS_SPECTRA;
    if (f.is_spectral) {
        f.first = t.first_texel + t.first_color * places;
        return f;
    }
#endif
    f.c00 = load_texel(t, places.x);
    f.c10 = load_texel(t, places.y);
    f.c01 = load_texel(t, places.z);
    f.c11 = load_texel(t, places.w);
    return f;
}

// A texel's spectrum at the upsampling coordinates `x`.
fn texel_spectrum(c: vec4f, x: vec4f) -> vec4f {
    let t = (c.x * x + c.y) * x + c.z;
    return c.w * (0.5 + 0.5 * t * inverseSqrt(1.0 + t * t));
}

#if SPECTRAL_TEXELS
// The filtered value of a bin.
fn filtered_bin(f: Filtered, bin: f32) -> f32 {
    let n = u32(bin);
    let at = f.first + n / 4u;
    let values = vec4f(component(bitcast<vec4f>(load_textures(at.x)), n % 4u), component(bitcast<vec4f>(load_textures(at.y)), n % 4u),
        component(bitcast<vec4f>(load_textures(at.z)), n % 4u), component(bitcast<vec4f>(load_textures(at.w)), n % 4u));
    return dot(f.weights, values);
}
#endif

fn filtered_spectrum(f: Filtered, k: u32) -> vec4f {
    let x = spectrum(f.x_row, k);
#if SPECTRAL_TEXELS
    if (f.is_spectral) {
        let bins = vec4f(filtered_bin(f, x.x), filtered_bin(f, x.y), filtered_bin(f, x.z), filtered_bin(f, x.w));
        return bins * spectrum(f.factor_row, k);
    }
#endif
    var sum = f.weights.x * texel_spectrum(f.c00, x) + f.weights.y * texel_spectrum(f.c10, x)
        + f.weights.z * texel_spectrum(f.c01, x) + f.weights.w * texel_spectrum(f.c11, x);
    sum = select(sum, select(vec4f(0.0), vec4f(1.0), sum >= vec4f(f.cutoff)), f.has_cutoff);
#if TINTS
    if (f.is_tinted) {
        sum *= (1.0 - f.shares.x - f.shares.y) * texel_spectrum(f.v0, x) + f.shares.x * texel_spectrum(f.v1, x) + f.shares.y * texel_spectrum(f.v2, x);
    }
#endif
    return sum * spectrum(f.factor_row, k);
}

#if NORMAL_MAPS
// The shading normal of `s`, on the outer side, turned by a picture of normals (the model: Mesh::mapped_normal in src/scene/mod.rs).
fn mapped_normal(index: u32, s: Surface) -> vec3f {
    let f = filter_texels(index, s.primitive, s.p);
    let n = f.weights.x * f.c00.xyz + f.weights.y * f.c10.xyz + f.weights.z * f.c01.xyz + f.weights.w * f.c11.xyz;
    let primitive = primitive_at(s.primitive);
    let p0 = primitive.r0.xyz;
    let e1 = primitive.r1.xyz - p0;
    let e2 = primitive.r2.xyz - p0;
    let at = coordinates_of(primitive) + set_of(load_Texture(index));
    let ab = bitcast<vec4f>(load_textures(at));
    let d1 = ab.zw - ab.xy;
    let d2 = bitcast<vec4f>(load_textures(at + 1u)).xy - ab.xy;
    let side = select(1.0, -1.0, d1.x * d2.y - d1.y * d2.x < 0.0);
    let along_u = side * (d2.y * e1 - d1.y * e2);
    let along_v = side * (d1.x * e2 - d2.x * e1);
#if TANGENTS
    let own = tangent_at(s);
    let has_own = dot(own.xyz, own.xyz) > 0.0;
    let along = select(along_u, own.xyz, has_own);
#else
    let along = along_u;
#endif
    let across = along - dot(s.ns, along) * s.ns;
    let tangent = across * inverseSqrt(max(dot(across, across), 1e-37));
    let bitangent = cross(s.ns, tangent);
#if TANGENTS
    let turns = select(dot(bitangent, along_v) > 0.0, own.w < 0.0, has_own);
#else
    let turns = dot(bitangent, along_v) > 0.0;
#endif
    let up = select(bitangent, -bitangent, turns);
    let turned = n.x * tangent + n.y * up + n.z * s.ns;
    let size = dot(turned, turned);
    return select(s.ns, turned * inverseSqrt(max(size, 1e-37)), dot(across, across) > 0.0 && dot(turned, s.n) > 0.0);
}
#endif

#if CAMERA_PATHS || LIGHT_PATHS
// Looks up what the picture of a material shows at the point `p` of a primitive.
fn look_up_color(b: ptr<function, Bsdf>, primitive: u32, p: vec3f) {
    if ((*b).m.texture != NONE) {
        let f = filter_texels((*b).m.texture, primitive, p);
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            (*b).color[k] = filtered_spectrum(f, k);
        }
    }
}
#endif
