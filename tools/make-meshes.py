#!/usr/bin/env python3
"""Writes the meshes of scenes/pool.json and scenes/gem.json, and prints how the gem lies. Python's standard library is all it needs.

Use:   tools/make-meshes.py     (from the project's root; files are rewritten in place)
"""
import math
import random
import struct

SCENES = "scenes"


def write_ply(name, comment, vertices, faces):
    """Vertices are tuples of 3 (position) or 6 (and normal) numbers, faces lists of fewer than 256 indices below 65536."""
    names = "x y z nx ny nz".split()[: len(vertices[0])]
    head = f"ply\nformat binary_little_endian 1.0\ncomment {comment}\nelement vertex {len(vertices)}\n"
    head += "".join(f"property float {n}\n" for n in names)
    head += f"element face {len(faces)}\nproperty list uchar ushort vertex_indices\nend_header\n"
    with open(f"{SCENES}/{name}", "wb") as f:
        f.write(head.encode())
        for vertex in vertices:
            f.write(struct.pack(f"<{len(vertex)}f", *vertex))
        for face in faces:
            f.write(struct.pack(f"<B{len(face)}H", len(face), *face))


# Water: a sum of sinusoids.

POOL = (4.0, 3.0, 1.25)  # m: along x, along z, depth; centred on the origin, with the mean water level at y = 0
CELLS = 200
WAVES = 40
LENGTHS = (0.18, 0.9)  # m
CURVATURE = 2.0  # 1/m, root mean square of the surface's; what focuses at depth d has 4 / d, as water's n / (n - 1) is 4


def waves():
    """(wave vector in x and z, amplitude, phase): wavelengths evenly spread in logarithm, all of one share in the curvature."""
    rng = random.Random(1)
    found = []
    for i in range(WAVES):
        k = 2 * math.pi / (LENGTHS[0] * (LENGTHS[1] / LENGTHS[0]) ** ((i + 0.5) / WAVES))
        # Straight from `random()`, the only distribution that Python promises to keep.
        direction, phase = 2 * math.pi * rng.random(), 2 * math.pi * rng.random()
        found.append((k * math.cos(direction), k * math.sin(direction), CURVATURE * math.sqrt(2 / WAVES) / k**2, phase))
    return found


def water():
    components = waves()
    vertices = []
    for row in range(CELLS + 1):
        for column in range(CELLS + 1):
            x, z = (column / CELLS - 0.5) * POOL[0], (row / CELLS - 0.5) * POOL[1]
            height = slope_x = slope_z = 0.0
            for kx, kz, amplitude, phase in components:
                height += amplitude * math.cos(kx * x + kz * z + phase)
                slope = -amplitude * math.sin(kx * x + kz * z + phase)
                slope_x, slope_z = slope_x + kx * slope, slope_z + kz * slope
            length = math.sqrt(1 + slope_x**2 + slope_z**2)
            vertices.append((x, height, z, -slope_x / length, 1 / length, -slope_z / length))
    corner = [row * (CELLS + 1) + column for row in range(CELLS) for column in range(CELLS)]
    return vertices, [[c, c + CELLS + 1, c + CELLS + 2, c + 1] for c in corner]


# Tiles: the joints between them, just before the floor and the walls.

TILE, JOINT, PROUD = 0.25, 0.012, 0.0005  # m
RIM = 0.15  # m, from the mean water level to the top of the walls


def joints():
    length, width, depth = POOL
    vertices, faces = [], []

    def sheet(corner, u, v, size_u, size_v):
        def strip(start, end):
            first = len(vertices)
            for a, b in ((start[0], start[1]), (end[0], start[1]), (end[0], end[1]), (start[0], end[1])):
                vertices.append(tuple(corner[i] + a * u[i] + b * v[i] for i in range(3)))
            faces.append([first, first + 1, first + 2, first + 3])

        for i in range(1, math.ceil(size_u / TILE)):
            strip((i * TILE - JOINT / 2, 0.0), (i * TILE + JOINT / 2, size_v))
        for i in range(1, math.ceil(size_v / TILE)):
            strip((0.0, i * TILE - JOINT / 2), (size_u, i * TILE + JOINT / 2))

    x, z, p = length / 2, width / 2, PROUD
    height = depth + RIM
    sheet((-x, -depth + p, z), (1, 0, 0), (0, 0, -1), length, width)
    sheet((-x, -depth, -z + p), (1, 0, 0), (0, 1, 0), length, height)
    sheet((x, -depth, z - p), (-1, 0, 0), (0, 1, 0), length, height)
    sheet((-x + p, -depth, z), (0, 0, -1), (0, 1, 0), width, height)
    sheet((x - p, -depth, -z), (0, 0, 1), (0, 1, 0), width, height)
    return vertices, faces


# Diamond: a round brilliant in Tolkowsky's proportions (M. Tolkowsky, Diamond Design, 1919), 1 across, its axis along y, its girdle about
# y = 0. Facets are the half-spaces n . p <= d whose intersection the stone is.

CROWN_DEG, PAVILION_DEG, TABLE = 34.5, 40.75, 0.57
GIRDLE = 0.032  # thickness where the main facets meet it; as thin as 0.015 where the halves do
STAR, LOWER_HALF = 0.5, 0.77  # lengths of the star and lower girdle facets, as shares of their way in the plan
GIRDLE_SIDES = 64


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(dot(a, a))
    return tuple(x / length for x in a)


def around(azimuth_deg, radius, y):
    azimuth = math.radians(azimuth_deg)
    return (radius * math.cos(azimuth), y, radius * math.sin(azimuth))


def through(a, b, c):
    """The plane of three points, away from the stone's middle."""
    normal = unit(cross(minus(b, a), minus(c, a)))
    distance = dot(normal, a)
    return (normal, distance) if distance > 0 else (minus((0, 0, 0), normal), -distance)


def brilliant():
    """57 facets and the girdle's."""
    radius, half = 0.5, GIRDLE / 2
    crown, pavilion = math.tan(math.radians(CROWN_DEG)), math.tan(math.radians(PAVILION_DEG))
    table = TABLE * radius  # to a corner of the table
    top = half + (radius - table) * crown
    edge = math.cos(math.radians(22.5))  # where two neighbouring main facets meet, seen from above, both are nearer by this

    def main_edge(azimuth_deg, r, side, slope):
        return around(azimuth_deg, r, side * (half + (radius - r * edge) * slope))

    planes = [((0.0, 1.0, 0.0), top)]
    star = table * edge + STAR * (radius - table * edge)
    for i in range(8):
        main, between = 45 * i, 45 * i + 22.5
        for side, slope in ((1, crown), (-1, pavilion)):
            normal = unit((slope * math.cos(math.radians(main)), side, slope * math.sin(math.radians(main))))
            planes.append((normal, dot(normal, around(main, radius, side * half))))
        planes.append(through(around(main, table, top), around(main + 45, table, top), main_edge(between, star, 1, crown)))
        for at in (main, main + 45):
            planes.append(
                through(main_edge(between, star, 1, crown), around(at, radius, half), around(between, radius, half))
            )
            planes.append(
                through(
                    main_edge(between, (1 - LOWER_HALF) * radius, -1, pavilion),
                    around(at, radius, -half),
                    around(between, radius, -half),
                )
            )
    for i in range(GIRDLE_SIDES):
        normal = around((i + 0.5) * 360 / GIRDLE_SIDES, 1.0, 0.0)
        planes.append((normal, radius * math.cos(math.pi / GIRDLE_SIDES)))
    return planes


def polyhedron(planes):
    """Vertices and faces (anticlockwise seen from outside) of the intersection of half-spaces, which must be bounded."""
    vertices, faces, near = [], [], 1e-9

    def index(p):
        for i, q in enumerate(vertices):
            if max(abs(a - b) for a, b in zip(p, q)) < near:
                return i
        vertices.append(p)
        return len(vertices) - 1

    for normal, distance in planes:
        u = unit(cross(normal, min(((1, 0, 0), (0, 1, 0), (0, 0, 1)), key=lambda a: abs(dot(a, normal)))))
        v = cross(normal, u)
        polygon = [
            tuple(distance * n + 10 * (a * x + b * y) for n, x, y in zip(normal, u, v))
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        for other, limit in planes:
            if (other, limit) == (normal, distance):
                continue
            kept = []
            for p, q in zip(polygon, polygon[1:] + polygon[:1]):
                beyond_p, beyond_q = dot(other, p) - limit, dot(other, q) - limit
                if beyond_p <= near:
                    kept.append(p)
                if (beyond_p < -near and beyond_q > near) or (beyond_p > near and beyond_q < -near):
                    t = beyond_p / (beyond_p - beyond_q)
                    kept.append(tuple(a + t * (b - a) for a, b in zip(p, q)))
            polygon = kept
        corners = [index(p) for p in polygon]
        faces.append([a for a, b in zip(corners, corners[1:] + corners[:1]) if a != b])
    return vertices, faces


def check_closed(vertices, faces):
    """Every edge belongs to two faces, once in each direction; Euler's formula holds; normals point outwards."""
    edges = [edge for face in faces for edge in zip(face, face[1:] + face[:1])]
    assert len(edges) == len(set(edges)), "an edge runs twice the same way"
    assert all((b, a) in set(edges) for a, b in edges), "an edge has one face only"
    assert all(len(face) >= 3 for face in faces), "a face has no area"
    assert len(vertices) - len(edges) // 2 + len(faces) == 2, "not a ball"


def centre_of_mass(vertices, faces):
    volume, moment = 0.0, (0.0, 0.0, 0.0)
    for face in faces:
        a = vertices[face[0]]
        for b, c in zip((vertices[i] for i in face[1:]), (vertices[i] for i in face[2:])):
            part = dot(a, cross(b, c)) / 6
            volume += part
            moment = tuple(m + part * (x + y + z) / 4 for m, x, y, z in zip(moment, a, b, c))
    assert volume > 0, "normals point inwards"
    return tuple(m / volume for m in moment)


def lies_on(corners, normal, vertices, faces):
    """Does the stone stay as it is on this face? Then its centre of mass is above the face."""
    middle = centre_of_mass(vertices, faces)
    sides = [(vertices[a], vertices[b]) for a, b in zip(corners, corners[1:] + corners[:1])]
    return all(dot(cross(minus(b, a), minus(middle, a)), normal) > 0 for a, b in sides)


def main():
    write_ply("pool_water.ply", "by tools/make-meshes.py", *water())
    write_ply("pool_joints.ply", "by tools/make-meshes.py", *joints())

    planes = brilliant()
    vertices, faces = polyhedron(planes)
    check_closed(vertices, faces)
    write_ply("diamond.ply", "by tools/make-meshes.py", vertices, faces)
    tilt = math.radians(PAVILION_DEG)
    down = (math.sin(tilt), -math.cos(tilt), 0)
    (normal, distance), corners = max(zip(planes, faces), key=lambda facet: dot(facet[0][0], down))
    assert lies_on(corners, normal, vertices, faces), "the stone would roll over"
    print(f"diamond: {len(vertices)} vertices, {len(faces)} facets, girdle included")
    print(f"it lies on its pavilion, on a main facet, when turned by {-PAVILION_DEG} degrees about z and lifted by {distance:.6f}")


if __name__ == "__main__":
    main()
