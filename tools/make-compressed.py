#!/usr/bin/env python3
"""Writes tests/data/meshopt.json and tests/data/scenes/draco.glb, meshopt.glb: tools/make-compressed.py

`pip install meshopt DracoPy numpy`; the files that ship are by 0.1.0 (meshoptimizer's own encoder and decoder) and 2.2.0 (Google's Draco). In each .glb
a compressed mesh comes before what those libraries decode it to.
"""

import base64
import json
import pathlib
import struct

import DracoPy
import meshopt
import numpy as np

HERE = pathlib.Path(__file__).parent.parent / "tests/data"
random = np.random.default_rng(5)


def text(data):
    return base64.b64encode(bytes(data)).decode()


def grid(n):
    """A sheet with waves: positions, normals, texture coordinates, triangles, colours."""
    x, y = np.meshgrid(*[np.linspace(0, 1, n)] * 2, indexing="ij")
    z = 0.2 * np.sin(5 * x) * np.cos(4 * y)
    flat = lambda *parts: np.stack(parts, -1).reshape(n * n, -1)
    normals = flat(-np.cos(5 * x) * np.cos(4 * y), 0.8 * np.sin(5 * x) * np.sin(4 * y), np.ones_like(x))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    a = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    triangles = np.stack([a, a + n, a + 1, a + 1, a + n, a + n + 1], -1).reshape(-1, 3)
    colors = flat(x, y, 0.5 + z, np.ones_like(x))
    return flat(x, y, z).astype("f4"), normals.astype("f4"), flat(x, 1 - y).astype("f4"), triangles.astype("u4"), colors.astype("f4")


p, n, uv, f, c = grid(10)
with_sign = np.c_[n, np.ones(len(n))].astype("f4")
cases = []


def case(name, data, **rest):
    cases.append({"name": name, **rest, "data": text(data)})


def attributes(name, rows, version, level, filter=None):
    rows = np.ascontiguousarray(rows)
    stride = rows.nbytes // len(rows)
    data = meshopt.encode_vertex_buffer_level(rows, level, version)
    decoded = np.asarray(meshopt.decode_vertex_buffer(data, len(rows), stride, filter)).tobytes()
    case(name, data, mode="ATTRIBUTES", filter=filter or "NONE", count=len(rows), stride=stride, decoded=text(decoded))
    return data, decoded


noise = random.integers(0, 256, (80, 8), dtype=np.uint8)
noise[20:70] = noise[20]
quaternions = random.normal(size=(20, 4)).astype("f4")
quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
for version, level in [(0, 2), (1, 0), (1, 3)]:
    what = lambda name: f"{name}, version {version}, level {level}"
    attributes(what("positions"), p, version, level)
    attributes(what("several blocks"), np.tile(p, (3, 1)), version, level)
    attributes(what("noise and constants"), noise, version, level)
    attributes(what("texture coordinates"), (uv * 65535).astype("u2"), version, level)
    attributes(what("octahedral of 8 bits"), meshopt.encode_filter_oct(with_sign, 4, 8), version, level, "OCTAHEDRAL")
    attributes(what("octahedral of 12 bits"), meshopt.encode_filter_oct(-with_sign, 8, 12), version, level, "OCTAHEDRAL")
    attributes(what("exponential"), meshopt.encode_filter_exp(p, 15), version, level, "EXPONENTIAL")
    attributes(what("quaternions"), meshopt.encode_filter_quat(quaternions, 8, 12), version, level, "QUATERNION")
    attributes(what("colours of 8 bits"), meshopt.encode_filter_color(c, 4, 8), version, level, "COLOR")
    attributes(what("colours of 12 bits"), meshopt.encode_filter_color(c, 8, 12), version, level, "COLOR")
for shift in [0, 9]:
    words = random.integers(0, 16, (60, 1), dtype=np.uint32) << np.uint32(shift)
    assert meshopt.encode_vertex_buffer_level(words, 3, 1)[-1] & 15 == 2, "is to be by XOR"
    attributes(f"words by XOR, shifted by {shift}", words, 1, 3)
sequence = np.concatenate([np.arange(0, 50), np.arange(1000, 900, -1), random.integers(0, 60000, 30)]).astype("u4")
for stride in [2, 4]:
    for name, triangles in [("triangles", f), ("triangles in disorder", f[random.permutation(len(f))])]:
        data = meshopt.encode_index_buffer(triangles.ravel())
        decoded = np.asarray(meshopt.decode_index_buffer(data, triangles.size, stride)).astype(f"<u{stride}")
        case(name, data, mode="TRIANGLES", filter="NONE", count=triangles.size, stride=stride, decoded=text(decoded.tobytes()))
    data = meshopt.encode_index_sequence(sequence)
    decoded = np.asarray(meshopt.decode_index_sequence(data, len(sequence), stride)).astype(f"<u{stride}")
    case("indices", data, mode="INDICES", filter="NONE", count=len(sequence), stride=stride, decoded=text(decoded.tobytes()))
source = "meshoptimizer's own encoder and decoder, by tools/make-compressed.py"
(HERE / "meshopt.json").write_text(json.dumps({"source": source, "cases": cases}, indent=1) + "\n")


class File:
    """A .glb while it is being written."""

    def __init__(self):
        self.data, self.views, self.accessors, self.meshes, self.fallback = b"", [], [], [], 0

    def place(self, data):
        self.data += bytes(-len(self.data) % 4) + bytes(data)
        return {"buffer": 0, "byteOffset": len(self.data) - len(data), "byteLength": len(data)}

    def view(self, data, **more):
        self.views.append({**self.place(data), **more})
        return len(self.views) - 1

    def compressed(self, extension, data, count, stride, mode, filter="NONE"):
        view = {"buffer": 1, "byteOffset": self.fallback, "byteLength": count * stride}
        view["extensions"] = {extension: {**self.place(data), "byteStride": stride, "mode": mode, "count": count, "filter": filter}}
        if mode == "ATTRIBUTES":
            view["byteStride"] = stride
        self.fallback += count * stride + -count * stride % 4
        self.views.append(view)
        return len(self.views) - 1

    def accessor(self, view, component, count, kind, **more):
        at = {} if view is None else {"bufferView": view}
        self.accessors.append({**at, "componentType": component, "count": count, "type": kind, **more})
        return len(self.accessors) - 1

    def mesh(self, attributes, indices, **more):
        self.meshes.append({"primitives": [{"attributes": attributes, "indices": indices, **more}]})

    def write(self, name, extensions, required):
        count = len(self.meshes)
        buffers = [{"byteLength": len(self.data)}]
        if self.fallback:
            buffers.append({"byteLength": self.fallback, "extensions": {extensions[0]: {"fallback": True}}})
        document = {
            "asset": {"version": "2.0", "generator": "tools/make-compressed.py of Abbe"},
            "extensionsUsed": extensions, "extensionsRequired": required,
            "scene": 0, "scenes": [{"nodes": list(range(count))}], "nodes": [{"mesh": i} for i in range(count)],
            "meshes": self.meshes, "accessors": self.accessors, "bufferViews": self.views, "buffers": buffers,
        }
        chunks = [(b"JSON", json.dumps(document, separators=(",", ":")).encode(), b" "), (b"BIN\0", self.data, b"\0")]
        body = b""
        for kind, data, filler in chunks:
            data += filler * (-len(data) % 4)
            body += struct.pack("<I", len(data)) + kind + data
        (HERE / "scenes" / name).write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body)


colors = (c * 255).astype("u1")
draco = File()
KINDS = {0: "POSITION", 1: "NORMAL", 2: "COLOR_0", 3: "TEXCOORD_0"}
TYPES = {"POSITION": (5126, "VEC3"), "NORMAL": (5126, "VEC3"), "TEXCOORD_0": (5126, "VEC2"), "COLOR_0": (5121, "VEC4")}
for level in [1, 7, 10]:
    as_double = {"tex_coord": uv.astype("f8"), "normals": n.astype("f8")}
    data = DracoPy.encode(p, f, quantization_bits=11, compression_level=level, colors=colors, **as_double)
    decoded = DracoPy.decode(data)
    ids = {KINDS[a["attribute_type"]]: a["unique_id"] for a in decoded.attributes}
    parts = {"POSITION": decoded.points, "NORMAL": decoded.normals, "TEXCOORD_0": decoded.tex_coord, "COLOR_0": decoded.colors}
    normalized = lambda name: {"normalized": True} if name == "COLOR_0" else {}
    count, corners = len(decoded.points), np.asarray(decoded.faces)
    empty = {name: draco.accessor(None, *[TYPES[name][0], count, TYPES[name][1]], **normalized(name)) for name in ids}
    extension = {"KHR_draco_mesh_compression": {"bufferView": draco.view(data), "attributes": ids}}
    draco.mesh(empty, draco.accessor(None, 5125, corners.size, "SCALAR"), extensions=extension)
    plain = {}
    for name, values in parts.items():
        component, kind = TYPES[name]
        values = np.asarray(values).astype("u1" if component == 5121 else "<f4")
        plain[name] = draco.accessor(draco.view(values.tobytes()), component, count, kind, **normalized(name))
    draco.mesh(plain, draco.accessor(draco.view(corners.astype("<u4").tobytes()), 5125, corners.size, "SCALAR"))
draco.write("draco.glb", ["KHR_draco_mesh_compression"], ["KHR_draco_mesh_compression"])

packed = File()
EXT, KHR = "EXT_meshopt_compression", "KHR_meshopt_compression"
for extension, version in [(EXT, 0), (KHR, 1)]:
    count = len(p)
    rows = {
        "POSITION": (meshopt.encode_filter_exp(p, 15), "EXPONENTIAL", (5126, "VEC3"), {}),
        "NORMAL": (meshopt.encode_filter_oct(with_sign, 8, 12), "OCTAHEDRAL", (5122, "VEC3"), {"normalized": True}),
        "TEXCOORD_0": ((uv * 65535).astype("u2"), "NONE", (5123, "VEC2"), {"normalized": True}),
        "COLOR_0": (colors, "NONE", (5121, "VEC4"), {"normalized": True}),
    }
    if version == 1:
        rows["COLOR_0"] = (meshopt.encode_filter_color(c, 4, 8), "COLOR", *rows["COLOR_0"][2:])
    small, plain = {}, {}
    for name, (values, filter, (component, kind), more) in rows.items():
        values = np.ascontiguousarray(values)
        stride = values.nbytes // count
        data = meshopt.encode_vertex_buffer_level(values, 2, version)
        decoded = np.asarray(meshopt.decode_vertex_buffer(data, count, stride, None if filter == "NONE" else filter)).tobytes()
        small[name] = packed.accessor(packed.compressed(extension, data, count, stride, "ATTRIBUTES", filter), component, count, kind, **more)
        plain[name] = packed.accessor(packed.view(decoded, byteStride=stride), component, count, kind, **more)
    if version == 0:
        data, mode = meshopt.encode_index_buffer(f.ravel()), "TRIANGLES"
        corners = np.asarray(meshopt.decode_index_buffer(data, f.size, 2))
    else:
        data, mode, corners = meshopt.encode_index_sequence(f.ravel()), "INDICES", f
    packed.mesh(small, packed.accessor(packed.compressed(extension, data, f.size, 2, mode), 5123, f.size, "SCALAR"))
    packed.mesh(plain, packed.accessor(packed.view(corners.astype("<u2").tobytes()), 5123, f.size, "SCALAR"))
packed.write("meshopt.glb", [EXT, KHR, "KHR_mesh_quantization"], [EXT, KHR, "KHR_mesh_quantization"])
