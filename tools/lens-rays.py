"""Rays through lenses by the Python package rayoptics, for tests/data/lens_rays.json.gz.

    pip install rayoptics && python3 tools/lens-rays.py | gzip -9n > tests/data/lens_rays.json.gz

Every surface refracts between given numbers, so that no two programs can differ in a glass. Lengths are mm.
"""
import json
import math
import sys

WAVELENGTHS = [436.0, 486.1, 546.1, 587.6, 656.3]
RAYS = 67  # of a field at a wavelength: 3 x 5 x 67 = 1005
MODEL = {"N-BK7": (1.5168, 64.17), "SF5": (1.67271, 32.25), "N-SK16": (1.62041, 60.32), "F2": (1.62005, 36.43)}


def index(glass, nm):
    """KHR_materials_dispersion's formula."""
    if glass is None:
        return 1.0
    nd, vd = (glass["nd"], glass["abbe"]) if isinstance(glass, dict) else MODEL[glass]
    return nd + (nd - 1) / vd * (523655 / nm**2 - 1.5168)


def surfaces(name):
    out = []
    for s in json.load(open(f"scenes/lenses/{name}.json"))["surfaces"]:
        g = s.get("glass")
        out.append({"radius": s.get("radius"), "conic": s.get("conic", 0), "aspheric": s.get("aspheric", []),
                    "thickness": s.get("thickness", 0), "glass": g, "diameter": s["diameter"], "stop": s.get("stop", False)})
    return out


ASPHERE = [
    {"radius": 40.0, "conic": -0.6, "aspheric": [0, -1e-6, 2e-9, -1e-12], "thickness": 9, "glass": "N-SK16", "diameter": 30, "stop": False},
    {"radius": -90.0, "conic": 1.5, "aspheric": [0, 3e-6, -1e-9], "thickness": 0, "glass": None, "diameter": 30, "stop": False},
]


def starts(first_z, radius, angle):
    """Points in the plane of the first vertex, and directions: a Vogel spiral over the aperture."""
    for i in range(RAYS):
        r, phi = radius * math.sqrt((i + 0.5) / RAYS), i * 2 * math.pi * 0.618033988749895
        yield [r * math.cos(phi), r * math.sin(phi), 0.0], [0.0, math.sin(angle), math.cos(angle)]


def by_rayoptics(lens, nm, rays):
    from rayoptics.elem.profiles import EvenPolynomial
    from rayoptics.elem.surface import Surface
    from rayoptics.raytr import raytrace
    import numpy as np

    def profile(s):
        c = 0.0 if s["radius"] is None else 1 / s["radius"]
        return EvenPolynomial(c=c, cc=s["conic"], coefs=s["aspheric"] or [0.0])

    # Segments of a path: interface, gap, transform to the next, index behind, direction.
    def segments():
        before = Surface(profile=EvenPolynomial(c=0.0, coefs=[0.0]))
        yield before, None, (np.identity(3), np.array([0.0, 0.0, 0.0])), 1.0, 1.0
        for s in lens:
            yield Surface(profile=profile(s)), None, (np.identity(3), np.array([0.0, 0.0, s["thickness"]])), index(s["glass"], nm), 1.0
        yield Surface(profile=EvenPolynomial(c=0.0, coefs=[0.0])), None, None, 1.0, 1.0

    out = []
    z = sum(s["thickness"] for s in lens[:-1])
    for o, d in rays:
        try:
            path = iter(list(segments()))
            ray, _, _ = raytrace.trace_raw(path, np.array(o), np.array(d), nm, eps=1e-15)
        except Exception:
            out.append(None)
            continue
        p, d = ray[len(lens)][0], ray[len(lens)][1]
        out.append([float(p[0]), float(p[1]), float(p[2]) + z, float(d[0]), float(d[1]), float(d[2])])
    return out


def main():
    lenses = {name: (surfaces(name), fields) for name, fields in
              [("singlet", [0, 1, 2]), ("achromat", [0, 1, 2]), ("triplet", [0, 8, 16]), ("gauss", [0, 8, 16])]}
    lenses["asphere"] = (ASPHERE, [0, 3, 6])
    out = {}
    for name, (lens, fields) in lenses.items():
        rows, lost = [], 0
        for angle in fields:
            for nm in WAVELENGTHS:
                rays = list(starts(0, 0.3 * lens[0]["diameter"], math.radians(angle)))
                for (o, d), end in zip(rays, by_rayoptics(lens, nm, rays)):
                    if end is None:
                        lost += 1
                        continue
                    rows.append([nm] + [round(v, 12) for v in o[:2] + d[1:] + end])
        surface = lambda s: {k: v for k, v in s.items()} | {"indices": [index(s["glass"], nm) for nm in WAVELENGTHS]}
        out[name] = {"surfaces": [surface(s) for s in lens], "rays": rows}
        print(name, len(rows), "rays,", lost, "lost", file=sys.stderr)
    print(json.dumps({"wavelengths": WAVELENGTHS, "lenses": out}, separators=(",", ":")))


if __name__ == "__main__":
    main()
