#!/usr/bin/env python3
"""Writes tests/data/pbrt_spectral_16.exr: tools/make-pbrt-exr.py

Not a render by pbrt-v4, of which no spectral file was at hand, but what its source says that it writes (github.com/mmp/pbrt-v4, read in November
2026): `Image::WriteEXR` in src/pbrt/util/image.cpp as of commit 9e32a442, and `SpectralFilm::GetImage` in a later src/pbrt/film.cpp whose commit is not
known. With the defaults of its film: 16 buckets over 360 to 830 nm, named by their centres with three decimals and a decimal comma, half floats, ZIP,
sRGB without chromaticities. Written with OpenEXR's own library (`pip install OpenEXR numpy`; the file that ships is by 3.5.3).

A crop of 5 x 3 pixels at (2, 1) of 12 x 8, as pbrt's "cropwindow" leaves it: the data window is not at the origin. The radiance of pixel (x, y) of the
crop at the centre `nm` of a bucket is (x + 1) / 4 exp(-((nm - 450 - 60 y) / 80)^2).
"""

import pathlib

import numpy
import OpenEXR

WIDTH, HEIGHT, BUCKETS, LOW, HIGH = 5, 3, 16, 360.0, 830.0

x, y = numpy.meshgrid(numpy.arange(WIDTH), numpy.arange(HEIGHT))
channels = {c: numpy.full((HEIGHT, WIDTH), level, numpy.float16) for c, level in (("R", 0.5), ("G", 0.25), ("B", 0.125))}
for i in range(BUCKETS):
    nm = LOW + (HIGH - LOW) * (i + 0.5) / BUCKETS
    name = f"S0.{nm:.3f}nm".replace(".", ",").replace(",", ".", 1)
    channels[name] = ((x + 1) / 4 * numpy.exp(-(((nm - 450 - 60 * y) / 80) ** 2))).astype(numpy.float16)

header = {
    "type": OpenEXR.scanlineimage,
    "compression": OpenEXR.ZIP_COMPRESSION,
    "displayWindow": (numpy.array([0, 0], numpy.int32), numpy.array([11, 7], numpy.int32)),
    "dataWindow": (numpy.array([2, 1], numpy.int32), numpy.array([6, 3], numpy.int32)),
    "renderTimeSeconds": 1.5,
    "samplesPerPixel": 16,
    "worldToCamera": numpy.eye(4, dtype=numpy.float32),
    "worldToNDC": numpy.eye(4, dtype=numpy.float32),
    "spectralLayoutVersion": "1.0",
    "emissiveUnits": "W.m^-2.sr^-1",
}
path = pathlib.Path(__file__).resolve().parent.parent / "tests" / "data" / "pbrt_spectral_16.exr"
OpenEXR.File(header, channels).write(str(path))
