// Which light to sample: those that have a place by a tree over them (Conty Estevez & Kulla 2018; src/gpu/light_tree.rs), the others by their share.
@group(0) @binding(22) var light_tree: Table;

fn light_node(i: u32) -> LightNode {
    return load_LightNode(light_tree, i);
}

// How much the lights of a node matter at `p`, an upper bound but for the shadows (their eq. 3, with no regard to the surface at `p`): zero only where all
// of them face away.
fn light_importance(node: LightNode, p: vec3f) -> f32 {
    let v = node.sphere.xyz - p;
    let r = node.sphere.w;
    let d2 = dot(v, v);
    let nearest = node.share / max(d2, max(r * r, 1e-30));
    if (d2 <= r * r) {
        return nearest;
    }
    // Angles: `w` between axis and way, `o` of the cone, `b` of the sphere. What remains of w when o and b are taken off it.
    let way = -dot(node.cone.xyz, v) * inverseSqrt(d2);
    let cos_w = clamp(select(way, abs(way), (node.light >> 31u) != 0u), -1.0, 1.0);
    let sin_w = sqrt(1.0 - cos_w * cos_w);
    let sin_b = r * inverseSqrt(d2);
    let cos_b = sqrt(max(0.0, 1.0 - sin_b * sin_b));
    let cos_o = node.cone.w;
    let sin_o = node.sin_angle;
    var cos_x = cos_w * cos_o + sin_w * sin_o;
    var sin_x = sin_w * cos_o - cos_w * sin_o;
    if (cos_w >= cos_o) {
        cos_x = 1.0;
        sin_x = 0.0;
    }
    let cos_rest = select(cos_x * cos_b + sin_x * sin_b, 1.0, cos_x >= cos_b);
    return nearest * max(cos_rest, 0.0);
}

const FRESH_LEVEL = 8u;

struct LightChoice {
    index: u32, // or NONE, where no light can shine
    probability: f32,
}

// A light for the point `p`.
fn choose_light_for(p: vec3f, u_choice: f32) -> LightChoice {
    // Every level of the tree uses up a digit or more: halfway down a number has none left.
    let fresh = next_1d();
    var u = u_choice;
    if (TREE_SHARE < 1.0 && u >= TREE_SHARE) {
        var left = u - TREE_SHARE;
        var chosen = TREE_LIGHTS;
        for (var i = TREE_LIGHTS; i + 1u < LIGHTS; i++) {
            let share = light_at(i).probability;
            if (chosen == i && left >= share) {
                left -= share;
                chosen = i + 1u;
            }
        }
        return LightChoice(chosen, light_at(chosen).probability);
    }
    u /= TREE_SHARE;
    var probability = TREE_SHARE;
    var node = light_node(0u);
    var level = 0u;
    while (node.child != NONE && probability > 0.0) {
        u = select(u, fresh, level == FRESH_LEVEL);
        level += 1u;
        let first = light_node(node.child);
        let second = light_node(node.child + 1u);
        let a = light_importance(first, p);
        let b = light_importance(second, p);
        let share = a / max(a + b, 1e-38);
        let is_second = u >= share;
        u = clamp(select(u / share, (u - share) / (1.0 - share), is_second), 0.0, 0x1.fffffep-1);
        probability *= select(share, select(0.0, 1.0 - share, b > 0.0), is_second);
        node = first;
        if (is_second) {
            node = second;
        }
    }
    return LightChoice(select(NONE, node.light & 0x7fffffffu, probability > 0.0), probability);
}

// Probability that a camera path at `p` chooses light `index`.
fn probability_of_choice(light: Light, index: u32, p: vec3f) -> f32 {
    if (index >= TREE_LIGHTS) {
        return light.probability;
    }
    let trails = fetch(light_tree, FIRST_TRAIL + index / 4u);
    let of_index = vec4u(index % 4u) == vec4u(0u, 1u, 2u, 3u);
    let own = select(vec4u(0u), trails, of_index);
    var trail = own.x | own.y | own.z | own.w;
    var probability = TREE_SHARE;
    var child = light_node(0u).child;
    while (child != NONE && probability > 0.0) {
        let first = light_node(child);
        let second = light_node(child + 1u);
        let a = light_importance(first, p);
        let b = light_importance(second, p);
        let share = a / max(a + b, 1e-38);
        let is_second = (trail & 1u) != 0u;
        probability *= select(share, select(0.0, 1.0 - share, b > 0.0), is_second);
        child = select(first.child, second.child, is_second);
        trail >>= 1u;
    }
    return probability;
}
