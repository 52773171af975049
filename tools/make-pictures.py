#!/usr/bin/env python3
"""Writes the EXRs of tests/data/scenes/pictures by OpenEXR's own library: tools/make-pictures.py

`pip install OpenEXR numpy`; the files that ship are by 3.5.3. All have 16 x 8 pixels as they are shown.
"""

import pathlib

import numpy
import OpenEXR

HERE = pathlib.Path(__file__).parent.parent / "tests/data/scenes/pictures"
WINDOW = (numpy.array([0, 0], numpy.int32), numpy.array([15, 7], numpy.int32))


def write(name, channels, header=None):
    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **(header or {})}
    pixels = {key: value if isinstance(value, numpy.ndarray) else numpy.full((8, 16), value, numpy.float32) for key, value in channels.items()}
    OpenEXR.File(head, pixels).write(str(HERE / name))


rgb = {"R": 0.2, "G": 0.6, "B": 0.1}
write("acescg.exr", rgb, {"chromaticities": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)})
write("xyz.exr", {"R": 0.3, "G": 0.4, "B": 0.2}, {"chromaticities": (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)})
write("grey.exr", {"Y": 0.5, "A": 1.0})
combined = {"View Layer.Combined." + key: value for key, value in (rgb | {"A": 1.0}).items()}
other = {"View Layer.DiffCol." + key: 0.9 for key in "RGB"}
write("layers.exr", combined | other | {"View Layer.Depth.Z": 5.0, "View Layer.Normal.X": 0.0, "View Layer.Normal.Y": 1.0, "View Layer.Normal.Z": 0.0})
# The data window is a part of what is shown, then reaches beyond it.
ramp = numpy.arange(32, dtype=numpy.float32).reshape(4, 8) / 32
inner = (numpy.array([4, 2], numpy.int32), numpy.array([11, 5], numpy.int32))
write("inner.exr", {key: ramp for key in "RGB"}, {"dataWindow": inner, "displayWindow": WINDOW})
ramp = numpy.arange(240, dtype=numpy.float32).reshape(12, 20) / 240
outer = (numpy.array([-2, -2], numpy.int32), numpy.array([17, 9], numpy.int32))
write("outer.exr", {key: ramp.astype(numpy.float16) for key in "RGB"}, {"dataWindow": outer, "displayWindow": WINDOW})
# Spectra that no three numbers have, beside an RGB that is none of theirs.
for name, quantity in (("light.exr", "S0"), ("reflectance.exr", "T")):
    spectra = {f"{quantity}.{400 + 50 * i},000000nm": 0.1 + 0.8 * (i % 2) for i in range(7)}
    write(name, spectra | {"R": 0.1, "G": 0.1, "B": 0.1}, {"spectralLayoutVersion": "1.0"})
