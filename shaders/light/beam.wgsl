// Parallel light of finite width.
#include "light/light.wgsl"

fn sample_li_beam(light: Light, p: vec3f) -> LightSample {
    var s = no_light();
    s.row = light.row;
    let v = p - light.p0.xyz;
    let along = dot(v, light.p1.xyz);
    let across = v - along * light.p1.xyz;
    if (along > 0.0 && dot(across, across) <= light.p2.x * light.p2.x) {
        s.wi = -light.p1.xyz;
        s.distance = along * (1.0 - light.p2.w);
        s.density = light.probability;
        s.weight = 1.0 / s.density;
    }
    return s;
}

fn pdf_le_beam(light: Light) -> f32 {
    return light.probability / (PI * light.p2.x * light.p2.x);
}

#if LIGHT_PATHS
fn sample_le_beam(light: Light, u: vec2f) -> LightRay {
    var l = light_ray(light);
    let c = light.p2.x * sample_disc(u);
    let f = frame_around(l.n);
    l.ray.o += c.x * f[0] + c.y * f[1];
    return l;
}
#endif
