"""Makes tests/data/scenes/blender.glb with Blender's own glTF exporter (made with bpy 5.0.1 from PyPI; Blender 5.0 writes no
KHR_materials_dispersion, so the dispersion is a custom property of the material).

    python3 -m venv venv && venv/bin/pip install bpy && venv/bin/python tools/make-blender-scene.py tests/data/scenes/blender.glb
"""
import math
import sys
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)


def material(name, **inputs):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    bsdf = m.node_tree.nodes["Principled BSDF"]
    for key, value in inputs.items():
        bsdf.inputs[key.replace("_", " ")].default_value = value
    return m, bsdf


def finish(obj, m):
    obj.data.materials.append(m)
    return obj


# Glass: transmission, index, a volume that absorbs, and what only the exporter's own node group can say: a thickness.
glass, bsdf = material("Glass", Transmission_Weight=1.0, Roughness=0.0, IOR=1.6)
volume = glass.node_tree.nodes.new("ShaderNodeVolumeAbsorption")
out = glass.node_tree.nodes["Material Output"]
volume.inputs["Color"].default_value = (0.5, 0.9, 0.7, 1)
volume.inputs["Density"].default_value = 2.0
glass.node_tree.links.new(volume.outputs[0], out.inputs["Volume"])
group = bpy.data.node_groups.new("glTF Material Output", "ShaderNodeTree")
for name in ["Occlusion", "Thickness"]:
    s = group.interface.new_socket(name=name, in_out="INPUT", socket_type="NodeSocketFloat")
    s.default_value = 0.0
node = glass.node_tree.nodes.new("ShaderNodeGroup")
node.node_tree = group
node.inputs["Thickness"].default_value = 0.4
glass["dispersion"] = 0.5
bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.4, location=(0, 0, 0.45))
bpy.ops.object.shade_smooth()
finish(bpy.context.object, glass)

# A floor with a picture, tiled by a mapping node.
floor, bsdf = material("Floor", Roughness=1.0, Metallic=0.0)
image = bpy.data.images.new("checker", 4, 4)
pixels = []
for y in range(4):
    for x in range(4):
        pixels += [0.8, 0.2, 0.1, 1.0] if (x + y) % 2 == 0 else [0.1, 0.2, 0.8, 1.0]
image.pixels = pixels
image.pack()
tex = floor.node_tree.nodes.new("ShaderNodeTexImage")
tex.image = image
mapping = floor.node_tree.nodes.new("ShaderNodeMapping")
mapping.inputs["Scale"].default_value = (3, 3, 1)
uv = floor.node_tree.nodes.new("ShaderNodeTexCoord")
floor.node_tree.links.new(uv.outputs["UV"], mapping.inputs["Vector"])
floor.node_tree.links.new(mapping.outputs["Vector"], tex.inputs["Vector"])
floor.node_tree.links.new(tex.outputs["Color"], bsdf.inputs["Base Color"])
bpy.ops.mesh.primitive_plane_add(size=4, location=(0, 0, 0))
finish(bpy.context.object, floor)

# A lamp, a metal box, Blender's own lights and a camera.
lamp, bsdf = material("Lamp", Base_Color=(0, 0, 0, 1), Emission_Color=(1, 0.8, 0.5, 1), Emission_Strength=20.0)
bpy.ops.mesh.primitive_plane_add(size=0.5, location=(0.5, 0, 2), rotation=(math.pi, 0, 0))
finish(bpy.context.object, lamp)
metal, bsdf = material("Metal", Metallic=1.0, Roughness=0.2, Base_Color=(0.9, 0.6, 0.2, 1))
bpy.ops.mesh.primitive_cube_add(size=0.4, location=(-0.8, 0.3, 0.2))
finish(bpy.context.object, metal)
bpy.ops.object.light_add(type="SPOT", location=(-1, -1, 2))
bpy.context.object.data.energy = 100
bpy.context.object.data.spot_size = math.radians(40)
bpy.ops.object.light_add(type="SUN", rotation=(0.5, 0.2, 0))
bpy.context.object.data.energy = 1
bpy.ops.object.camera_add(location=(0, -4, 1.5), rotation=(math.radians(75), 0, 0))
bpy.context.scene.camera = bpy.context.object
bpy.ops.export_scene.gltf(filepath=sys.argv[-1], export_format="GLB", export_cameras=True, export_lights=True, export_extras=True)
