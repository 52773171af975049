#!/usr/bin/env python3
"""Writes the EXRs of tests/data/scenes/pictures by OpenEXR's own library, and a JPEG: tools/make-pictures.py

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

# A JPEG of four inks with a small profile of its own; `pip install pillow`, by 13.0.0 (LittleCMS 2.19). Prints what LittleCMS makes of it.
import io
import itertools
import struct

from PIL import Image, ImageCms


def lab_of(inks):
    """Of the light of three bands each ink leaves a part; as CIELAB in 16 bits."""
    left = [1.0, 1.0, 1.0]
    for ink, leaves in zip(inks, ((0.1, 0.5, 0.8), (0.8, 0.1, 0.4), (0.95, 0.85, 0.08), (0.05, 0.05, 0.05))):
        left = [light * (1 - ink + ink * least) for light, least in zip(left, leaves)]
    f = [light ** (1 / 3) for light in left]
    lab = 652.8 * (116 * f[1] - 16), 256 * (128 + 150 * (f[0] - f[1])), 256 * (128 + 120 * (f[1] - f[2]))
    return [min(max(round(v), 0), 65280) for v in lab]


def profile_of_inks():
    even = struct.pack(">2H", 0, 65535)
    table = [v for inks in itertools.product([i / 6 for i in range(7)], repeat=4) for v in lab_of(inks)]
    matrix = struct.pack(">9i", *[65536 * (i % 4 == 0) for i in range(9)])
    lut = b"mft2\0\0\0\0" + bytes([4, 3, 7, 0]) + matrix + struct.pack(">2H", 2, 2) + 4 * even + struct.pack(f">{len(table)}H", *table) + 3 * even
    white = b"XYZ \0\0\0\0" + struct.pack(">3i", *[round(65536 * v) for v in (0.9642, 1.0, 0.8249)])
    text = b"desc\0\0\0\0" + struct.pack(">I", 10) + b"Four inks\0" + bytes(79)
    words = b"text\0\0\0\0CC0\0"
    tags = [(b"desc", text), (b"cprt", words), (b"wtpt", white), (b"A2B0", lut)]
    at, entries, data = 128 + 4 + 12 * len(tags), b"", b""
    for name, tag in tags:
        tag += bytes(-len(tag) % 4)
        entries += name + struct.pack(">II", at + len(data), len(tag))
        data += tag
    head = struct.pack(">I4sI4s4s4s", at + len(data), b"none", 0x02400000, b"prtr", b"CMYK", b"Lab ") + bytes(12) + b"acsp" + bytes(28)
    head += struct.pack(">3i", *[round(65536 * v) for v in (0.9642, 1.0, 0.8249)])
    return head + bytes(128 - len(head)) + struct.pack(">I", len(tags)) + entries + data


# Inks of the profile's nodes. What is left white, in the file, is 85, 128, 128 and 170, 170, 170: by another mark in it the first is the second's colour.
inks = Image.new("CMYK", (24, 8), (170, 127, 127, 85))
inks.paste((85, 85, 85, 85), (8, 0, 16, 8))
inks.paste((0, 255, 85, 0), (16, 0, 24, 8))
icc = profile_of_inks()
inks.save(HERE / "inks.jpg", quality=100, subsampling=0, icc_profile=icc)
shown = ImageCms.profileToProfile(Image.open(HERE / "inks.jpg"), io.BytesIO(icc), ImageCms.createProfile("sRGB"), outputMode="RGB")
print([shown.getpixel((x, 3)) for x in (3, 12, 20)])
