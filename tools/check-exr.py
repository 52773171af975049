#!/usr/bin/env python3
"""Checks that other people's readers understand a spectral EXR of Abbe's: tools/check-exr.py FILE.exr

Needs `pip install OpenEXR OpenImageIO colour-science`. The project's own tests do without it.
"""

import sys

import colour
import numpy
import OpenEXR
import OpenImageIO


def main(path):
    file = OpenEXR.File(path, separate_channels=True)
    header, channels = file.header(), file.channels()
    assert header["spectralLayoutVersion"] == "1.0", header["spectralLayoutVersion"]
    assert header["emissiveUnits"] == "W.m^-2.sr^-1", header["emissiveUnits"]
    assert isinstance(header["EV"], float), header["EV"]
    for name in ("R", "G", "B", "XYZ.X", "XYZ.Y", "XYZ.Z"):
        assert name in channels, f"no channel {name}"
    spectral = sorted(name for name in channels if name.startswith("S0."))
    assert spectral, "no spectral channels"
    for name, channel in channels.items():
        assert channel.pixels.dtype == numpy.float32, f"{name} is {channel.pixels.dtype}"
        # Before the second batch no error is known.
        assert numpy.isfinite(channel.pixels).all() or name.startswith("error."), f"{name} is not finite"
    for aov, axes in {"depth": "Z", "normal": "XYZ", "albedo": "RGB"}.items():
        there = {name for name in channels if name.startswith(f"{aov}.")}
        assert there in (set(), {f"{aov}.{axis}" for axis in axes}), there
        assert bool(there) == (f"abbe.{aov}" in header), f"abbe.{aov}"
        behind = {name for name in channels if name.startswith(f"behind.{aov}.")}
        assert behind in (set(), {f"behind.{aov}.{axis}" for axis in axes}), behind
        assert bool(behind) == ("abbe.behind" in header), "abbe.behind"
    for name in spectral:
        assert (channels[name].pixels >= 0).all(), f"{name} is negative"

    components, specification = colour.read_spectral_image_Fichet2021(path, additional_data=True)
    assert specification.is_emissive and not specification.is_polarised and not specification.is_bispectral
    assert list(components) == ["S0"], list(components)
    wavelengths, values = components["S0"]
    assert len(wavelengths) == len(spectral) == values.shape[-1]
    assert (numpy.diff(wavelengths) > 0).all()
    for i, name in enumerate(sorted(spectral, key=lambda n: float(n[3:-2].replace(",", ".")))):
        assert (values[..., i] == channels[name].pixels).all(), f"{name}: the two readers disagree"

    buffer = OpenImageIO.ImageBuf(path)
    names, pixels = buffer.spec().channelnames, buffer.get_pixels(OpenImageIO.FLOAT)
    assert set(names) == set(channels), set(names) ^ set(channels)
    for i, name in enumerate(names):
        assert (pixels[..., i] == channels[name].pixels).all(), f"{name}: OpenImageIO disagrees"

    # XYZ from bins against the film's own; bins of 20 nm are coarse, so this is a check of units and order, not of precision.
    if wavelengths[0] <= 400 and wavelengths[-1] >= 700 and "irradiance" not in header.get("abbe.quantity", ""):
        step = wavelengths[1] - wavelengths[0]
        cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
        table = numpy.stack([cmfs[float(w)] for w in wavelengths])
        ours = numpy.array([channels[f"XYZ.{c}"].pixels.mean(dtype=float) for c in "XYZ"])
        theirs = 683.002 * step * values.reshape(-1, len(wavelengths)).mean(axis=0, dtype=float) @ table
        print(f"mean XYZ: stored {ours}, from bins {theirs}")
        assert numpy.allclose(ours, theirs, rtol=0.1, atol=1e-3 * max(ours.max(), 1e-30))
    print(f"{path}: {len(spectral)} spectral channels, read alike by OpenEXR, OpenImageIO and colour-science")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
