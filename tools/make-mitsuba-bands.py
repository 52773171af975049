#!/usr/bin/env python3
"""Renders tests/data/mitsuba_bands.exr with Mitsuba 3: tools/make-mitsuba-bands.py

A sky whose radiance rises from 1 at 380 nm to 2 at 780 nm (W m^-2 sr^-1 nm^-1) behind a ball of reflectance 1/2, on a `specfilm` of the
bands in tests/data/mitsuba_bands.txt. Needs `pip install mitsuba`; the file that ships was made with 3.9.1.
"""

import pathlib

import mitsuba

mitsuba.set_variant("scalar_spectral")
data = pathlib.Path(__file__).resolve().parent.parent / "tests" / "data"

film = {"type": "specfilm", "width": 6, "height": 4, "component_format": "float32", "rfilter": {"type": "box"}}
for line in (data / "mitsuba_bands.txt").read_text().splitlines():
    if not line.startswith("#"):
        name, low, high, response = line.split()
        film[name] = {
            "type": "regular",
            "wavelength_min": float(low),
            "wavelength_max": float(high),
            "values": f"{response}, {response}",
        }
scene = mitsuba.load_dict(
    {
        "type": "scene",
        "integrator": {"type": "path"},
        "sensor": {
            "type": "perspective",
            "fov": 40,
            "to_world": mitsuba.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
            "film": film,
            "sampler": {"type": "independent", "sample_count": 1 << 16},
        },
        "ball": {"type": "sphere", "radius": 0.8, "bsdf": {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 0.5}}},
        "sky": {"type": "constant", "radiance": {"type": "spectrum", "value": [(380, 1.0), (780, 2.0)]}},
    }
)
mitsuba.render(scene)
scene.sensors()[0].film().write(str(data / "mitsuba_bands.exr"))
