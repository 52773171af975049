"""Renders a scene of Abbe's with Mitsuba 3, for `abbe bench --peer mitsuba`, which starts it and says when to go on.

First line of standard input: the scene as JSON (src/cli/bench/peer.rs writes it), spectra as tables from `min_nm` in steps of 1 nm. When it is loaded and
a pass has been rendered for nothing (kernels are compiled by then), a line of JSON says who renders. Each further line is a number of processor seconds:
passes are rendered until they have taken that long, the mean radiance of every pixel and bin goes to the file `image` as 32-bit floats, bins innermost,
and a line of JSON says what it took.

Mitsuba's dielectric takes no spectrum, so a pass is one render per bin, each at one wavelength. Where in its bin moves from pass to pass, the same for all
bins, so that the mean tends to that of the bin. By LLVM, several paths at a time, where the library is found (libllvm of Debian, or DRJIT_LIBLLVM_PATH).
"""

import json
import os
import resource
import sys
import time

import drjit
import mitsuba
import numpy

# Samples of a pixel in a render. With 4 of 128x128 pixels, starting it took four fifths of the time; from 16 on less than a tenth.
SPP = 32


def choose_variant():
    try:
        mitsuba.set_variant("llvm_ad_mono")
        drjit.eval(mitsuba.Float([1, 2]) + 1)
    except Exception:
        # There is no scalar mono; grey RGB does for one wavelength.
        mitsuba.set_variant("scalar_rgb")
    return mitsuba.variant()


def uniform(value=0.5):
    return {"type": "uniform", "value": value}


def two_sided(bsdf):
    return {"type": "twosided", "bsdf": bsdf}


def describe(scene):
    """The scene as Mitsuba's dictionary, and what to set for a wavelength: (first, last part of a parameter's name, table)."""
    camera, (width, height) = scene["camera"], scene["size"]
    film = {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "luminance", "component_format": "float32"}
    described = {
        "type": "scene",
        "integrator": {"type": scene["integrator"], "max_depth": scene["max_depth"] + 1},
        "sensor": {
            "type": "perspective",
            "fov": camera["vfov_deg"],
            "fov_axis": "y",
            "to_world": mitsuba.ScalarTransform4f().look_at(camera["eye"], camera["target"], camera["up"]),
            "film": {**film, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent"},
        },
    }
    fog, tables = scene["fog"], []
    if fog:
        medium = {"type": "homogeneous", "sigma_t": fog["sigma_t"], "albedo": fog["albedo"]}
        described["fog"] = {**medium, "phase": {"type": "hg", "g": fog["g"]}}
    for i, given in enumerate(scene["shapes"]):
        shape, name = {}, f"shape_{i}"
        if "sphere" in given:
            shape = {"type": "sphere", "center": given["sphere"][:3], "radius": given["sphere"][3]}
        else:
            shape = {"type": "ply", "filename": given["ply"], "face_normals": not given["smooth"]}
        kind = given["kind"]
        if kind == "diffuse":
            shape["bsdf"] = two_sided({"type": "diffuse", "reflectance": uniform()})
            tables.append((name, "reflectance.value", given["reflectance"]))
        elif kind == "conductor":
            shape["bsdf"] = two_sided({"type": "conductor", "eta": uniform(), "k": uniform()})
            tables += [(name, ".eta.value", given["eta"]), (name, ".k.value", given["k"])]
        elif kind == "dielectric":
            shape["bsdf"] = {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}
            tables.append((name, "bsdf.eta", given["ior"]))
            if fog:
                shape["exterior"] = {"type": "ref", "id": "fog"}
        else:
            shape["bsdf"], shape["interior"] = {"type": "null"}, {"type": "ref", "id": "fog"}
        if given["radiance"]:
            shape["emitter"] = {"type": "area", "radiance": uniform()}
            tables.append((name, "radiance.value", given["radiance"]))
        described[name] = shape
    return described, tables


class Renderer:
    def __init__(self, scene):
        described, tables = describe(scene)
        # Unoptimised, so that no shapes are merged and every one keeps its parameters.
        self.scene = mitsuba.load_dict(described, optimize=False)
        self.parameters = mitsuba.traverse(self.scene)
        self.settings = []
        for name, end, table in tables:
            keys = [key for key in self.parameters.keys() if key.startswith(f"{name}.") and key.endswith(end)]
            assert len(keys) == 1, f"{name} has {keys} for {end}"
            self.settings.append((keys[0], table))
        width, height = scene["size"]
        self.min_nm, self.max_nm, self.bins = scene["min_nm"], scene["max_nm"], scene["bins"]
        self.sum = numpy.zeros((height, width, self.bins))
        self.passes = 0

    def render(self, index, into):
        grid = numpy.arange(len(self.settings[0][1])) + self.min_nm
        # The golden ratio spreads the places evenly at any number of passes.
        place = (0.5 + 0.6180339887498949 * index) % 1
        for b in range(self.bins):
            nm = self.min_nm + (self.max_nm - self.min_nm) * (b + place) / self.bins
            for key, table in self.settings:
                self.parameters[key] = float(numpy.interp(nm, grid, table))
            self.parameters.update()
            image = mitsuba.render(self.scene, seed=index * self.bins + b, spp=SPP)
            into[:, :, b] += numpy.array(image)[:, :, 0]


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


# Mitsuba's own messages leave by standard output too: they go to the errors.
ANSWERS = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)


def say(**line):
    print(json.dumps(line), file=ANSWERS, flush=True)


def main():
    variant, start = choose_variant(), time.time()
    scene = json.loads(sys.stdin.readline())
    renderer = Renderer(scene)
    # Beyond all passes that will follow, so that no random number is shared.
    renderer.render(1 << 20, numpy.zeros_like(renderer.sum))
    say(name=f"Mitsuba {mitsuba.__version__}, {variant}", setup=time.time() - start)
    cpu = wall = 0.0
    for line in sys.stdin:
        while cpu < float(line):
            since = cpu_seconds(), time.time()
            renderer.render(renderer.passes, renderer.sum)
            renderer.passes += 1
            cpu, wall = cpu + cpu_seconds() - since[0], wall + time.time() - since[1]
        (renderer.sum / max(renderer.passes, 1)).astype("<f4").tofile(scene["image"])
        say(spp=renderer.passes * SPP, cpu=cpu, wall=wall)


main()
