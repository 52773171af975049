// Materials as the host lists them (Material in src/gpu/layout.rs).
@group(0) @binding(3) var materials: Table<Material>;
