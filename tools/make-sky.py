"""The sky model's numbers for spectra/sky/hosek-wilkie.txt.gz, and what Mitsuba makes of them for tests/data/sky.json, both from PyPI's mitsuba (3.9.1).

    pip install mitsuba && python3 tools/make-sky.py

The numbers are Hosek and Wilkie's (BSD 3-clause, whose text goes into the file's head), as Mitsuba's package carries them.
"""
import gzip
import json
import math
import os
import struct

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_spectral")
FOLDER = os.path.join(os.path.dirname(mi.__file__), "data", "sunsky")
NM = list(range(320, 721, 40))


def tensors(path):
    data, out = open(path, "rb").read(), {}
    (count,), at = struct.unpack_from("<I", data, 14), 18
    for _ in range(count):
        (length,) = struct.unpack_from("<H", data, at)
        name, at = data[at + 2 : at + 2 + length].decode(), at + 2 + length
        dims, kind, start = struct.unpack_from("<HBQ", data, at)
        shape = struct.unpack_from(f"<{dims}Q", data, at + 11)
        at += 11 + 8 * dims
        out[name] = np.frombuffer(data, {10: "<f4", 11: "<f8"}[kind], int(np.prod(shape)), start)
    return out


def numbers():
    found = tensors(os.path.join(FOLDER, "sunsky_datasets.bin"))
    licence = open(os.path.join(FOLDER, "LICENSE")).read().split("\n\n", 2)[2].splitlines()
    head = ["The clear sky and the Sun over it, spectral",
            "source: L. Hosek, A. Wilkie. An Analytic Model for Full Spectral Sky-Dome Radiance. ACM Trans. Graph. 31(4), 2012; Adding a Solar Radiance Function to the Hosek Skylight Model. IEEE CG&A 33(3), 2013; as in PyPI mitsuba 3.9.1",
            "units: W m^-2 sr^-1 nm^-1",
            "range: 320 to 720 nm by 40, turbidities 1 to 10, albedos 0 and 1",
            "licence: BSD 3-clause:"] + licence
    lines = [("# " + line).rstrip() for line in head]
    for name, key in [("parameters", "sky_params_spec"), ("radiance", "sky_rad_spec"), ("sun", "sun_rad_spec"), ("darkening", "sun_ld_spec")]:
        lines.append(name + " " + " ".join(f"{v:.9g}" for v in found[key]))
    os.makedirs("spectra/sky", exist_ok=True)
    with open("spectra/sky/hosek-wilkie.txt.gz", "wb") as file:
        file.write(gzip.compress("\n".join(lines).encode(), 9, mtime=0))


def radiance(emitter, direction, nm):
    si = mi.SurfaceInteraction3f()
    si.wi = -mi.Vector3f(direction)
    out = []
    for i in range(0, len(nm), 4):
        four = (nm[i : i + 4] + [550] * 4)[:4]
        si.wavelengths = four
        out += list(emitter.eval(si))[: len(nm[i : i + 4])]
    return out


def judge():
    skies, nm = [], [400.0, 450.0, 500.0, 555.0, 600.0, 650.0, 700.0]
    for turbidity, elevation, albedo in [(3, 30, 0.3), (2.5, 10, 0.0), (7.2, 65, 0.8), (1, 2, 0.5)]:
        e = math.radians(elevation)
        # Mitsuba's sky is about +z.
        sun = [math.cos(e), 0.0, math.sin(e)]
        load = lambda **more: mi.load_dict({"type": "sunsky", "turbidity": float(turbidity), "albedo": float(albedo), "sun_direction": sun, **more})
        sky, disc = load(sun_scale=0.0), load(sky_scale=0.0, complex_sun=True)
        rows = []
        for theta in [2, 30, 60, 85]:
            for phi in [10, 100, 200]:
                t, p = math.radians(theta), math.radians(phi)
                d = [math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)]
                rows.append({"direction": d, "radiance": [float(v) for v in radiance(sky, d, nm)]})
        # Irradiance of the disc on a plane that faces it.
        x, y, z = np.array([-sun[2], 0, sun[0]]), np.array([0.0, 1.0, 0.0]), np.array(sun)
        half, total, solid, n = math.radians(0.5358 / 2), np.zeros(len(nm)), 0.0, 48
        for i in range(n):
            for j in range(n):
                cos = 1 - (1 - math.cos(half)) * (i + 0.5) / n * 0.99999
                sin, phi = math.sqrt(1 - cos * cos), 2 * math.pi * (j + 0.5) / n
                d = sin * math.cos(phi) * x + sin * math.sin(phi) * y + cos * z
                total += np.array(radiance(disc, [float(v) for v in d], nm)) * cos / n**2
        total *= 2 * math.pi * (1 - math.cos(half))
        skies.append({"turbidity": turbidity, "elevation_deg": elevation, "albedo": albedo, "sky": rows, "sun_irradiance": [float(v) for v in total]})
    meta = "Mitsuba 3.9.1 (BSD), plugin sunsky; directions with +z up and the Sun over +x; W m^-2 sr^-1 nm^-1 and W m^-2 nm^-1; tools/make-sky.py"
    json.dump({"source": meta, "nm": nm, "skies": skies}, open("tests/data/sky.json", "w"), separators=(",", ":"))


numbers()
judge()
