#!/usr/bin/env python3
"""Renders scenes/pictures/NAME.jpg and prints the table of scenes/README.md: tools/make-gallery.py ABBE [NAME ...]

ABBE is the command. `pip install pillow`. The pictures are the denoised ones that `abbe render --denoise` writes.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image

SCENES = pathlib.Path(__file__).parent.parent / "scenes"
# Size, and seconds of rendering.
PICTURES = {
    "prism": ("640x480", 120),
    "prism_dark": ("800x450", 120),
    "rainbow": ("640x480", 120),
    "coffee": ("640x480", 120),
    "pool": ("640x480", 180),
    "gem": ("640x480", 120),
    "newton": ("640x480", 120),
    "bunny_light": ("640x480", 120),
    "fog": ("640x480", 180),
    "barrel": ("640x480", 180),
    "cornell_spheres": ("640x480", 90),
    "cornell_spheres_dispersed": ("640x480", 90),
    "nephroid": ("640x480", 60),
    "starter": ("640x480", 90),
    "lens": ("1280x720", 600),
}


def said(abbe, file):
    """What the render wrote about itself."""
    return json.loads(subprocess.run([abbe, "info", "--json", file], check=True, capture_output=True, text=True).stdout)


def main():
    abbe, *names = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        for name in names or PICTURES:
            size, seconds = PICTURES[name]
            options = ["--size", size, "--time", f"{seconds}s", "--denoise"]
            exr = f"{folder}/{name}.exr"
            subprocess.run([abbe, "render", SCENES / f"{name}.json", *options, "--quiet", "-o", exr], check=True)
            picture = Image.open(f"{folder}/{name}.denoised.png").convert("RGB")
            picture.save(SCENES / f"pictures/{name}.jpg", quality=90, optimize=True)
            about = said(abbe, exr)
            row = [f"`{name}`", f"`{' '.join(options)}`", f"{float(about['abbe.seconds']):.0f}", about["abbe.samples"]]
            print(f"| {' | '.join(row)} |", flush=True)


main()
