//! The host/shader boundary. Each record is declared once, here; the WGSL side is generated from it (shared.rs), and a test holds naga's idea of offsets and
//! sizes against Rust's.

use super::shared::{shared_constants, shared_records, wgsl_type};
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec4};

shared_constants! {
    /// "Nothing", for indices.
    NO_INDEX = 0xffffffff;
    /// Kinds of primitives, in the three top bits of a primitive's first word.
    PRIMITIVE_TRIANGLE = 0;
    /// Sphere.
    PRIMITIVE_SPHERE = 1;
    /// Disc.
    PRIMITIVE_DISC = 2;
    /// Lateral surface of a cylinder.
    PRIMITIVE_CYLINDER = 3;
    /// A mesh in one of its places: the least and greatest corner of its box, its index.
    PRIMITIVE_INSTANCE = 4;
    /// A face of a lens: base, axis, (radius, first of its own rows, form).
    PRIMITIVE_LENS_FACE = 5;
    /// Forms of these. One row: heights of both ends.
    LENS_EDGE = 0;
    /// One row: height, radius of the hole, 0, 1 or -1 for normals along the axis or against it.
    LENS_ANNULUS = 1;
    /// Height of the edge and of the vertex, curvature, likewise; conic constant, number of coefficients, least and greatest height over the vertex; four
    /// coefficients a row, times the radius to the power that makes lengths of them.
    LENS_SURFACE = 2;
    /// Numbers of primitives that belong to one instance come in groups of so many.
    GRANULE = 1024;
    /// Kinds of materials. `c` of dielectrics, panes and conductors: rows of the index of a film on them and, from bit 16 on, of its thickness in
    /// wavelengths, or 0. `a`: reflectance row.
    MATERIAL_KIND_DIFFUSE = 0;
    /// Needs its interior; `a`, here and of a rough one: 1 with a coating that reflects nothing, else 0; `b`, `texture`, here and of all glass: what tints what gets through, `b` being NO_INDEX for clear glass.
    MATERIAL_KIND_SMOOTH_DIELECTRIC = 1;
    /// Needs its interior, `alpha` and `table`.
    MATERIAL_KIND_ROUGH_DIELECTRIC = 2;
    /// `a`: row of the index, which is that of the film on it where the pane itself is one; `c`, here and of the next two: film, or below 2^16 the row of
    /// the optical depth.
    MATERIAL_KIND_THIN_DIELECTRIC = 3;
    /// `a`, `b`: rows of eta and k; or `a`, `texture`: the reflectance at normal incidence, and `b`: NO_INDEX.
    MATERIAL_KIND_SMOOTH_CONDUCTOR = 4;
    /// Likewise, and `alpha`, `table`.
    MATERIAL_KIND_ROUGH_CONDUCTOR = 5;
    /// `a`: row of the first one's share; `b`, `c`: the two materials.
    MATERIAL_KIND_MIX = 6;
    /// No surface.
    MATERIAL_KIND_BOUNDARY = 7;
    /// `b`: the material; `texture`: normals.
    MATERIAL_KIND_NORMAL_MAPPED = 8;
    /// `a`: row of the coat's index; `b`: the material under it; `c`: 1 if its colour is the one that is seen, and twice what its normals
    /// are: 0 those of what is under it, 1 those of the shape, or 2 and the number of their picture; `alpha`, `table`.
    MATERIAL_KIND_COATED = 9;
    /// `a`, `texture`: roughness; `c`: the first level and, from bit 16 on, the last; `table`: the materials of the levels.
    MATERIAL_KIND_GRADED = 10;
    /// As a rough conductor, with a grain; after its energy table come the width along x and cosine and sine of the grain's rotation.
    MATERIAL_KIND_BRUSHED_CONDUCTOR = 11;
    /// `a`: row of its colour; `b`: the material under it; `table`.
    MATERIAL_KIND_SHEEN = 12;
    /// No surface but a medium, whose phase function `alpha` is the asymmetry of; `a`: row of its scattering coefficient.
    MATERIAL_KIND_MEDIUM = 13;
    /// As a thin dielectric, and `alpha`, `table` as of a rough conductor.
    MATERIAL_KIND_ROUGH_THIN_DIELECTRIC = 14;
    /// Likewise, and as of a brushed conductor.
    MATERIAL_KIND_BRUSHED_THIN_DIELECTRIC = 15;
    /// `a`, `texture`: transmittance.
    MATERIAL_KIND_DIFFUSE_TRANSMISSION = 16;
    /// Kinds of lights. `p0`, `p1`, `p2`: vertices; `p0.w`: the picture that it shows, or NO_INDEX; `p1.w`, here and of the next three: how far off its
    /// surface light starts, m, or 0 where no other surface lies in it.
    LIGHT_KIND_TRIANGLE = 0;
    /// `p0`: centre; `p2.x`: radius.
    LIGHT_KIND_SPHERE = 1;
    /// `p0`: centre; `p1`: normal; `p2.x`: radius.
    LIGHT_KIND_DISC = 2;
    /// `p0`: base; `p1`: axis; `p2`: radius, length.
    LIGHT_KIND_CYLINDER = 3;
    /// `p0`: position; `p1`: any axis; `p2.w`, here and of spots, profiles and beams: by how much of itself the way to a light that lies in a surface is
    /// short, else 0.
    LIGHT_KIND_POINT = 4;
    /// `p0`: position; `p1`: axis; `p2`: cosines of inner and outer angle, and 1 if intensity falls as a square between them, 0 if smoothly.
    LIGHT_KIND_SPOT = 5;
    /// `p0`: origin; `p1`: direction; `p2.x`: radius.
    LIGHT_KIND_BEAM = 6;
    /// `p1`: direction of travel; `p2.x`: one minus the cosine of its angular radius.
    LIGHT_KIND_SUN = 7;
    /// Row only.
    LIGHT_KIND_CONSTANT = 8;
    /// `p0`, `p1`, `p2`: rows of the rotation into the picture, `w`: width, height, row of the upsampling coordinate, or of the bins of spectra.
    LIGHT_KIND_IMAGE = 9;
    /// `p0`: position, `w`: first texel of its profile; `p1`: axis, `w`: flux over greatest intensity, sr; `p2`: direction of azimuth 0.
    LIGHT_KIND_PROFILE = 10;
    /// What the texels of a picture are: whole numbers, of which the greatest is 1.
    TEXELS_NUMBERS = 0;
    /// Places in a list of colours.
    TEXELS_COLORS = 1;
    /// Vectors of whole numbers, which stand for -1 to 1.
    TEXELS_VECTORS = 2;
    /// Sigmoids in eight bytes (pack_sigmoid in src/scene/texture/texels.rs).
    TEXELS_SIGMOIDS = 3;
    /// Spectra in bins.
    TEXELS_SPECTRA = 4;
    /// Surfaces in a row that a ray may pass straight through before it is given up.
    MAX_CROSSINGS = 10000;
    /// Rays traced.
    COUNTER_RAYS = 0;
    /// Samples dropped as not finite.
    COUNTER_NOT_FINITE = 1;
    /// Samples dropped as negative.
    COUNTER_NEGATIVE = 2;
    /// Paths cut at the greatest depth.
    COUNTER_TRUNCATED = 3;
    /// Samples and splats too large for the film, and fixed-point sums that reached their end.
    COUNTER_SATURATED = 4;
    /// Paths that the driver ended: Mesa's lavapipe leaves all loops of a shader after 65,535 turns.
    COUNTER_UNFINISHED = 5;
    /// Paths and shadow rays that ended where more volumes overlap than they can keep in mind.
    COUNTER_CROWDED = 6;
    /// BVH nodes tested, where that is counted.
    COUNTER_NODES = 7;
    /// Primitives tested, likewise.
    COUNTER_PRIMITIVES = 8;
    /// Most rays of an invocation.
    COUNTER_MOST_RAYS = 9;
    /// Paths ended, by their scattering events: the first of [`COUNTED_DEPTHS`], where that is counted.
    COUNTER_ENDED = 10;
    /// The last of these counts all longer ones, too.
    COUNTED_DEPTHS = 16;
    /// The first rows of `spectra`: the film's weights for its bins, X, Y and Z, ...
    ROW_BIN = 0;
    /// ... X, ...
    ROW_X = 1;
    /// ... Y ...
    ROW_Y = 2;
    /// ... and Z, ...
    ROW_Z = 3;
    /// The same four of each wavelength in one texel: as many rows.
    ROW_FILM = 4;
    /// Quanta of X, Y, Z are this much larger than those of bins, as their values are.
    XYZ_RATIO = 13660;
}

/// Number of counters.
pub const COUNTERS: usize = (COUNTER_ENDED + COUNTED_DEPTHS) as usize;

shared_records! {
    /// Uniforms of a dispatch of the camera pass.
    struct Params {
        /// Tile's left column in the image.
        tile_x: u32,
        /// Tile's top row.
        tile_y: u32,
        /// Tile's size.
        tile_width: u32,
        /// Tile's size.
        tile_height: u32,
        /// Image size.
        image_width: u32,
        /// Image size.
        image_height: u32,
        /// First workgroup of this dispatch.
        first_group: u32,
        /// Steps in which its workgroups are gone through (common/groups.wgsl).
        group_step: u32,
        /// Number of a pixel's first sample in its sequence of random numbers: each pass has one.
        first_sample: u32,
        /// Passes of this dispatch.
        samples: u32,
        /// Sequence of random numbers for camera paths.
        sequence: u32,
        /// Likewise for light paths, where passes have numbers of their own.
        light_sequence: u32,
        /// Number of the first pass in the sequence for light paths.
        first_light_pass: u32,
        /// Seed, keys the random numbers.
        seed: u32,
        /// Greatest number of scattering events.
        max_depth: u32,
        /// Texels of one pass in `spectra`: its head, and its rows.
        spectra_stride: u32,
        /// Radius of a tent, standard deviation of a Gaussian; pixels.
        filter_radius: f32,
        /// Light paths per pass.
        light_paths: u32,
        /// Quanta per unit of a splat.
        inverse_quantum: f32,
        /// How far a pixel's filter reaches from its centre, pixels.
        filter_reach: f32,
        /// Longer than any way through the scene, m.
        scene_diameter: f32,
        /// Camera paths longer than this are merged with the radius of this length, m.
        merge_reach: f32,
        /// Probability that a light path reports, over its share in the integral of squared use.
        guiding_sample_rate: f32,
        /// Room for reports.
        guiding_sample_room: u32,
        /// Units of 64 light paths that a workgroup takes one after the other.
        light_units: u32,
        /// Texel of the table of work items at which their groups begin.
        first_work_group: u32,
        /// Cells that visible points of a pass are kept in, a power of two.
        heads: u32,
        /// Visible points that there is room for.
        points: u32,
        /// Lights, the distant ones (sun, constant, image) last.
        lights: u32,
        /// Number of the first distant one.
        first_distant_light: u32,
        /// Number of the light that shows a picture.
        environment_light: u32,
        /// Texel of the table of textures at which coordinates of primitives begin.
        first_uv: u32,
        /// Number of the first primitive that is part of an instance.
        first_instanced: u32,
        /// Texel of the table of instances at which the instances of numbers begin.
        first_owner: u32,
        /// Probability that a light with a place is chosen, which the grid of lights does (light/grid.wgsl).
        near_share: f32,
        /// Cells of the grid along an axis.
        light_grid_side: u32,
        /// Entries of a cell's table.
        light_entries: u32,
        /// Lights that share an entry.
        lights_of_entry: u32,
        /// Texel of the grid's table at which, where lights share entries, the lights in their order begin.
        first_light_in_order: u32,
        /// Spheres around the lamps of the greatest radiance: as many records behind those of the lights, of which `p0` is centre and radius.
        highlights: u32,
        /// Least corner of the ramp over the scene, by which the grid's cells lie ...
        scene_ramp_low: Vec4,
        /// ... its slope, m^-1, ...
        scene_ramp_per_metre: Vec4,
        /// ... and likewise of the ramp over the lights and what is close by.
        near_ramp_low: Vec4,
        /// m^-1.
        near_ramp_per_metre: Vec4,
        /// Eye, corner or centre, relative to the scene's origin; `w`: by how much of itself the way to a sensor that lies in a surface is short, else 0.
        origin: Vec4,
        /// Right, or edge u.
        axis_x: Vec4,
        /// Up, or edge v.
        axis_y: Vec4,
        /// Backward, or normal.
        axis_z: Vec4,
        /// Half extents of the picture at distance 1 (or of the orthographic rectangle), lens radius, focus distance; radius of a sphere sensor. Lens: half
        /// extents of the film, radius and plane of the disc that light enters by, m.
        half_extent: Vec4,
        /// Volumes that rays start in, if all start in the same, as slots of medium/interiors.wgsl ...
        inside: UVec4,
        /// ... and those beyond four.
        inside_more: UVec4,
        /// Plane sensor: q . dual_u runs from 0 to 1 along its edge u; w is its area. Lens: planes of the entrance pupil, the film, the bounds of the exit
        /// pupil and the start of rays, m.
        dual_u: Vec4,
        /// Likewise along its edge v. Lens: bounds per metre of radius on the film; irradiance on the film over
        /// radiance, sr; least cosine of light that reaches the film.
        dual_v: Vec4,
    }

    /// What stands before the rows of a pass in `spectra`.
    struct PassHead {
        /// Wavelength samples that camera paths choose their hero among, from the first of those beyond the film's range on.
        heroes: UVec4,
        /// 1 / (4 probability) of each.
        hero_weights: Vec4,
        /// Radius of merging, m, for a camera path of no length ...
        merge_radius: f32,
        /// ... and what is added to it per metre of the path.
        merge_radius_per_metre: f32,
        /// Wavelengths may share a way if their own would end within this part of the radius.
        blur: f32,
        /// Angle that light spreads by where it scatters, as far as wavelengths that share a way are concerned, radians.
        spread: f32,
    }

    /// Some samples of a block of 8 x 8 pixels, in passes in a row.
    struct WorkItem {
        /// Samples of a pixel in all items before.
        place: u32,
        /// How often the block had these passes before: each time has a sequence of random numbers of its own.
        copy: u32,
        /// How many samples.
        count: u32,
        /// Pass of the first one, within the table of spectra.
        pass_index: u32,
        /// What a sample of the block counts, as there are more passes than samples of it or fewer.
        weight: f32,
        /// Number of the block, row by row in the tile.
        block: u32,
        /// Unused.
        pad_0: u32,
        /// Unused.
        pad_1: u32,
    }

    /// Work items that an invocation has a pixel of.
    struct WorkGroup {
        /// First item.
        first: u32,
        /// End of the items.
        end: u32,
        /// Samples of a pixel in all groups before.
        place: u32,
        /// And in this one.
        samples: u32,
    }

    /// Where a visible point is (in fog a part of its kernel), and the next one of its cell.
    struct PointLink {
        /// Position.
        x: f32,
        /// Position.
        y: f32,
        /// Position.
        z: f32,
        /// Number of the next link plus one, or 0.
        next: u32,
    }

    /// What light paths need to know of a visible point; its throughput for each wavelength sample follows.
    struct VisiblePoint {
        /// Shading normal, in fog the direction of the ray; `w`: radius of merging, m.
        normal: Vec4,
        /// Number of the pixel.
        pixel: u32,
        /// Bits 0-7: pass; 8-12 and 13-17: first and last wavelength sample of its path; 18-30: depth of the path; 31: in fog.
        about: u32,
        /// In fog the asymmetry of its phase function (as a float); on a surface the coat there plus one.
        medium_or_coat: u32,
        /// Density of its connection to the sensor.
        connection: f32,
    }

    /// Of a visible point under sheen.
    struct PointSheen {
        /// The sheen, or NO_INDEX.
        sheen: u32,
        /// What it let in.
        entered: f32,
        /// Unused.
        pad_0: u32,
        /// Unused.
        pad_1: u32,
    }

    /// Of a visible point in fog: the segment that it lies on.
    struct PointSegment {
        /// From where the segment begins to the point, m.
        before: f32,
        /// And from there to its end.
        behind: f32,
        /// Unused.
        pad_0: u32,
        /// Unused.
        pad_1: u32,
    }

    /// The head of a lamp's profile. Edges of rings follow, one more than rings, edges of sectors likewise, and cells ring by ring.
    struct Profile {
        /// Intervals of the polar angle.
        rings: u32,
        /// Intervals of the azimuth.
        sectors: u32,
        /// Unused.
        pad_0: u32,
        /// Unused.
        pad_1: u32,
    }

    /// An edge between rings of a profile.
    struct ProfileRing {
        /// Polar angle, rad.
        theta: f32,
        /// 1 - cos(theta).
        one_minus_cos: f32,
        /// Share of the flux before it.
        share: f32,
        /// Unused.
        pad_0: u32,
    }

    /// An edge between sectors of a profile.
    struct ProfileSector {
        /// Azimuth, rad.
        phi: f32,
        /// Unused.
        pad_0: u32,
        /// Unused.
        pad_1: u32,
        /// Unused.
        pad_2: u32,
    }

    /// A cell of a profile; within it directions are sampled evenly.
    struct ProfileCell {
        /// Relative intensities of its corners, the polar angle running faster.
        corners: Vec4,
        /// Share of its ring's flux before it.
        share_from: f32,
        /// And up to its end.
        share_to: f32,
        /// Pdf of its directions, sr^-1.
        pdf: f32,
        /// Unused.
        pad_0: u32,
    }

    /// A material.
    struct Material {
        /// MATERIAL_KIND_*.
        kind: u32,
        /// Rank of the volume behind it, or NO_INDEX.
        interior: u32,
        /// See the kind.
        a: u32,
        /// See the kind.
        b: u32,
        /// See the kind.
        c: u32,
        /// First entry of the energy table.
        table: u32,
        /// GGX width.
        alpha: f32,
        /// The picture that stands for the reflectance or share in row `a` (of glass the tint in `b`; or of normals), or NO_INDEX.
        texture: u32,
    }

    /// A picture on surfaces.
    struct Texture {
        /// Texel of the table at which its own begin.
        first_texel: u32,
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bits 0-1, 2-3: wrapping across and down (0 repeat, 1 mirror, 2 clamp); bit 4: nearest texel only; bit 5: there is a cutoff; bits 6-8: TEXELS_*;
        /// bits 9-10: logarithm of the bytes of a texel; bit 11: the set of texture coordinates; bit 12: it is tinted by colours of vertices.
        sampling: u32,
        /// Row of what texels are multiplied by.
        factor_row: u32,
        /// Row of the upsampling coordinate, or of the bins of spectra.
        x_row: u32,
        /// Filtered values from here on count as 1, others as 0.
        cutoff: f32,
        /// Texel of the table at which its colours begin; of spectra, how many a pixel takes.
        first_color: u32,
        /// The picture's horizontal coordinate over the surface's (u, v, 1); `w`: factor of numbers, and of x and y of vectors.
        u: Vec4,
        /// Its vertical coordinate.
        v: Vec4,
    }

    /// A volume; the place of its record is its rank.
    struct Interior {
        /// Row of the index of refraction.
        eta_row: u32,
        /// Row of the absorption coefficient, or NO_INDEX where it is 0.
        sigma_a_row: u32,
        /// Row of the scattering coefficient, or NO_INDEX where it is 0.
        sigma_s_row: u32,
        /// 1 if the index varies over the film's range.
        dispersive: u32,
        /// Henyey-Greenstein asymmetry.
        g: f32,
        /// Index at the d line, or at the end of the film's range that is nearest to it.
        eta_d: f32,
        /// Unused.
        pad_0: u32,
        /// Unused.
        pad_1: u32,
    }

    /// A mesh in one of its places.
    struct Instance {
        /// Row of the transform from the mesh's space to the world's.
        to_world_x: Vec4,
        /// Row of it.
        to_world_y: Vec4,
        /// Row of it.
        to_world_z: Vec4,
        /// Row of the transform back.
        to_mesh_x: Vec4,
        /// Row of it.
        to_mesh_y: Vec4,
        /// Row of it.
        to_mesh_z: Vec4,
        /// First node of the mesh's hierarchy.
        root: u32,
        /// Number of a primitive less its place in the table (wraps around).
        first_number: u32,
        /// Index of the material.
        material: u32,
        /// Unused.
        pad_0: u32,
    }

    /// A surface of a camera's lens (lens/prescription.rs).
    struct LensSurface {
        /// Curvature, m^-1.
        curvature: f32,
        /// Conic constant.
        conic: f32,
        /// Vertex, m.
        z: f32,
        /// Semi-diameter, m.
        semi_diameter: f32,
        /// Row of the index before it ...
        front_row: u32,
        /// ... and behind it.
        row: u32,
        /// Row of the absorption coefficient before it ...
        front_absorption: u32,
        /// ... and behind it.
        absorption: u32,
        /// Aspheric coefficients of r^2 to r^8, m^-1 to m^-7 ...
        low: Vec4,
        /// ... and of r^10 to r^16, m^-9 to m^-15.
        high: Vec4,
    }

    /// A light, or one primitive of an emitting shape.
    struct Light {
        /// LIGHT_KIND_*.
        kind: u32,
        /// Row of radiance, intensity or irradiance.
        row: u32,
        /// The emitting primitive, or NO_INDEX.
        primitive: u32,
        /// 1 if it emits on both sides; of a picture of the surroundings, how many texels of the table what is in one of its own takes.
        two_sided: u32,
        /// See the kind.
        p0: Vec4,
        /// See the kind.
        p1: Vec4,
        /// See the kind.
        p2: Vec4,
        /// Probability of being chosen.
        probability: f32,
        /// Alias method: keep this light below it.
        alias_threshold: f32,
        /// Alias method: take this light above it.
        alias_index: u32,
        /// Area of the primitive, m^2.
        area: f32,
        /// Volumes that it lies in, if it meets the boundary of none, as slots of medium/interiors.wgsl ...
        inside: UVec4,
        /// ... and those beyond four.
        inside_more: UVec4,
    }
}

/// Texels to a row of a table.
pub const TABLE_WIDTH: u32 = 8192;

/// Texels of a record `T` in a table.
pub const fn texels<T>() -> u32 {
    size_of::<T>() as u32 / 16
}

/// WGSL that stands before every kernel: shared numbers, records and their sizes, and where a texel of a table is.
pub fn wgsl_prelude() -> String {
    let sizes = record_layouts().into_iter().map(|(name, size, _)| format!("const TEXELS_OF_{name} = {}u;\n", size / 16));
    let texel = format!("fn texel(i: u32) -> vec2u {{\n    return vec2u(i % {TABLE_WIDTH}u, i / {TABLE_WIDTH}u);\n}}\n");
    [WGSL_CONSTANTS, WGSL_RECORDS, &sizes.collect::<String>(), &texel].concat()
}
