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
# Size and samples per pixel: one to two minutes on two cores without a GPU, three for the pool, longer for the lens and the hero.
PICTURES = {
    "prism": ("640x480", 76),
    "gem": ("640x480", 32),
    "pool": ("640x480", 24),
    "fog": ("640x480", 12),
    "starter": ("640x480", 32),
    "cornell_spheres": ("640x480", 32),
    "cornell_spheres_dispersed": ("640x480", 32),
    "newton": ("640x480", 48),
    "barrel": ("640x480", 12),
    "bunny_light": ("640x480", 32),
    "nephroid": ("640x480", 64),
    "rainbow": ("640x480", 48),
    "coffee": ("640x480", 44),
    "prism_dark": ("800x450", 48),
    "lens": ("1280x720", 96),
    "hero": ("1280x960", 72),
}
# Pictures that do not have the name of their scene.
SCENE_OF = {"hero": "prism"}


def said(abbe, file):
    """What the render wrote about itself."""
    return json.loads(subprocess.run([abbe, "info", "--json", file], check=True, capture_output=True, text=True).stdout)


def main():
    abbe, *names = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        for name in names or PICTURES:
            size, spp = PICTURES[name]
            options = ["--size", size, "--spp", str(spp), "--denoise"]
            exr = f"{folder}/{name}.exr"
            subprocess.run([abbe, "render", SCENES / f"{SCENE_OF.get(name, name)}.json", *options, "--quiet", "-o", exr], check=True)
            picture = Image.open(f"{folder}/{name}.denoised.png").convert("RGB")
            picture.save(SCENES / f"pictures/{name}.jpg", quality=90, optimize=True)
            about = said(abbe, exr)
            row = [f"`{name}`", f"`{' '.join(options)}`", f"{float(about['abbe.seconds']):.0f}", about["abbe.samples"]]
            print(f"| {' | '.join(row)} |", flush=True)


main()
