// What both passes are made of.
#include "common/spectra.wgsl"
#include "common/path.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
#if INTERIORS
#include "medium/interiors.wgsl"
#endif
#if MEDIA
#include "medium/homogeneous.wgsl"
#endif
#if FRESNEL
#include "bsdf/fresnel.wgsl"
#endif
#if ROUGH
#include "bsdf/rough.wgsl"
#endif
#include "light/mis.wgsl"
#if LIGHTS_PRESENT
#include "light/lights.wgsl"
#endif
