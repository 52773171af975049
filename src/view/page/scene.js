// Materials and lamps of the scene, to be changed. Everything shown follows from the document; a change is asked for, and comes back with the next one.

import { $, encode, figure, h, hex, paced } from "./dom.js";
import { send } from "./link.js";
import * as glass from "./glass.js";

let colors = null, selected = null, last = "";

export function begin(found) {
  colors = found;
}

/// Changes that follow each other come at the pace they can be shown; the last one is one step of undo with them.
const edits = paced(60, (path, value, isFinal) => send({ type: "edit", path, value, final: isFinal, goes_on: true }));
let fresh = true;
function edit(path, value, isFinal) {
  if (fresh) send({ type: "edit", path, value, final: isFinal });
  else edits(path, value, isFinal);
  fresh = isFinal;
}

export function setDocument(document_) {
  // While something is dragged it must not be built anew under the hand.
  const text = JSON.stringify([document_.materials, document_.lamps]);
  if (text === last || document.activeElement?.matches('#panel input[type="range"], #panel input[type="color"]')) {
    if (text !== last) values(document_);
    return;
  }
  last = text;
  const focused = document.activeElement?.id;
  $("materials").replaceChildren(...(document_.materials.length ? document_.materials.map(material) : [h("p", { class: "hint" }, "The scene file names none.")]));
  $("lamps").replaceChildren(...(document_.lamps.length ? document_.lamps.map(lamp) : [h("p", { class: "hint" }, "The scene file names none.")]));
  if (focused) $(focused)?.focus();
  mark();
}

function values(document_) {
  for (const { path, value } of [...document_.materials, ...document_.lamps]) {
    const item = document.querySelector(`[data-path="${CSS.escape(path.join("/"))}"]`);
    if (item) item.dataset.value = JSON.stringify(value);
  }
}

export function select(path) {
  selected = path?.join("/") ?? null;
  mark();
}

/// Brings what is selected into view.
export function reveal() {
  const item = document.querySelector(".item.selected");
  item?.closest("details").setAttribute("open", "");
  item?.scrollIntoView({ block: "start", behavior: "smooth" });
  item?.querySelector("button, input, select")?.focus({ preventScroll: true });
}

function mark() {
  document.querySelectorAll(".item").forEach((item) => item.classList.toggle("selected", item.dataset.path === selected));
}

const kindOf = (value) => Object.keys(value ?? {}).find((key) => !key.startsWith("//") && value[key] !== null);

let ids = 0;
function field(text, element, out) {
  element.id ||= `control-${++ids}`;
  return h("div", { class: "field" }, h("label", { for: element.id }, text), element, out);
}

/// A slider; `act` is told values and whether it was the last.
function slider(text, id, value, attributes, show, act) {
  const out = h("output", {}, show(value));
  const input = h("input", { type: "range", id, value, ...attributes });
  input.value = value;
  const tell = (isFinal) => { const v = Number(input.value); out.textContent = show(v); act(v, isFinal); };
  input.addEventListener("input", () => tell(false));
  input.addEventListener("change", () => tell(true));
  return field(text, input, out);
}

function colorInput(text, id, rgb, act) {
  const input = h("input", { type: "color", id, value: hex(rgb) });
  const tell = (isFinal) => act([1, 3, 5].map((i) => parseInt(input.value.slice(i, i + 2), 16) / 255), isFinal);
  input.addEventListener("input", () => tell(false));
  input.addEventListener("change", () => tell(true));
  return field(text, input);
}

/// The colour that a reflectance is written as, or nearly has.
function colorOf(value) {
  if (typeof value === "number") return Array(3).fill(encode(Math.min(1, value)));
  if (value?.srgb) return value.srgb;
  if (value?.linear_rgb) return value.linear_rgb.map((v) => encode(Math.min(1, v)));
  return null;
}

function describe(value) {
  if (value === undefined || value === null) return "none";
  if (typeof value === "number") return figure(value);
  if (typeof value === "string") return value;
  if (Array.isArray(value)) return `measured, ${value.length} points`;
  if (value.texture) return `picture ${value.texture}`;
  const kind = kindOf(value);
  return `${kind} ${typeof value[kind] === "object" ? "" : value[kind]}`;
}

/// What may take the place of a material of a glTF file.
const REPLACEMENTS = [["", "As in the file"], ["dielectric", "Glass"], ["diffuse", "Matte"], ["conductor", "Metal"]];
const FRESH = { dielectric: { ior: "N-BK7" }, diffuse: { reflectance: 0.6 }, conductor: { metal: "Au" } };

function material(entry) {
  const { name, path, value, used_by, included, rgb: seen } = entry;
  const kind = kindOf(value), inner = value?.[kind] ?? {}, id = `material-${name}`;
  const at = (...keys) => [...path, kind, ...keys];
  const parts = [];
  if (included) {
    const own = kind && !FRESH[kind] ? [[kind, kind.replace("_", " ")]] : [];
    const choose = h("select", { id: `${id}-kind` }, ...[...REPLACEMENTS, ...own].map(([v, text]) => h("option", { value: v, selected: v === (kind ?? "") }, text)));
    choose.addEventListener("change", () => edit(path, choose.value ? { [choose.value]: FRESH[choose.value] } : null, true));
    parts.push(field("Material", choose));
  }
  if (["dielectric", "thin_dielectric", "coated"].includes(kind) && !inner.volume) {
    const ior = inner.ior, glassName = typeof ior === "string" ? ior : ior?.glass;
    const choose = h("button", { type: "button", class: "glass", id: `${id}-glass`, onclick: () => glass.choose(glassName, (chosen) => edit(at("ior"), chosen, true)) }, h("span", {}, glassName ?? (typeof ior === "number" ? `n ${ior}` : "index of its own")), h("span", { "aria-hidden": "true" }, "Catalogue…"));
    parts.push(field("Glass", choose));
    if (typeof ior === "number") parts.push(slider("Index", `${id}-n`, ior, { min: 1, max: 3, step: 0.005 }, (v) => v.toFixed(3), (v, isFinal) => edit(at("ior"), v, isFinal)));
  }
  const color = { diffuse: "reflectance", conductor: "reflectance", diffuse_transmission: "transmittance", sheen: "color" }[kind];
  if (color && (inner[color] !== undefined || kind === "diffuse")) {
    const rgb = colorOf(inner[color]);
    parts.push(colorInput("Colour", `${id}-color`, rgb ?? seen ?? [0.5, 0.5, 0.5], (srgb, isFinal) => edit(at(color), { srgb: srgb.map((v) => Number(v.toFixed(4))) }, isFinal)));
    if (!rgb) parts.push(h("p", { class: "hint" }, `Now ${describe(inner[color])}; a colour takes its place.`));
  }
  if (kind === "conductor" && inner.metal) {
    const choose = h("select", { id: `${id}-metal` }, ...colors.metals.filter((m) => m.length < 24).map((metal) => h("option", { value: metal, selected: metal === inner.metal }, metal)));
    choose.addEventListener("change", () => edit(at("metal"), choose.value, true));
    parts.push(field("Metal", choose));
  }
  if (["dielectric", "thin_dielectric", "conductor", "coated"].includes(kind)) {
    const rough = inner.roughness ?? Math.sqrt(inner.alpha ?? 0);
    if (typeof rough === "number") {
      const change = (v, isFinal) => {
        const { alpha: _, roughness: __, ...rest } = inner;
        edit([...path, kind], v > 0 ? { ...rest, roughness: v } : rest, isFinal);
      };
      // Below 0.032 a surface is smooth.
      parts.push(slider("Roughness", `${id}-rough`, rough, { min: 0, max: 1, step: 0.01 }, (v) => v.toFixed(2), (v, isFinal) => change(v > 0 && v < 0.04 ? 0.04 : v, isFinal)));
    }
  }
  if (!parts.length) parts.push(h("p", { class: "hint" }, kind === "mix" ? `A mix of ${describe(inner.a)} and ${describe(inner.b)}.` : "Changed in the scene's file."));
  const users = used_by.length ? `on ${used_by.slice(0, 3).join(", ")}${used_by.length > 3 ? ` and ${used_by.length - 3} more` : ""}` : "unused";
  return h("section", { class: "item", "data-path": path.join("/"), "aria-label": `Material ${name}` }, h("header", {}, h("h3", {}, name), h("span", {}, kind?.replace("_", " ") ?? "")), included ? null : h("p", { class: "hint" }, users), ...parts);
}

const UNITS = { luminance_cd_m2: "cd/m²", illuminance_lx: "lx", luminous_flux_lm: "lm", luminous_intensity_cd: "cd", irradiance_W_m2: "W/m²", power_W: "W" };
const BLACKBODY = "blackbody";

function lamp(entry) {
  const { name, path, value, kind } = entry, id = `lamp-${path.join("-")}`, parts = [];
  const unit = Object.keys(UNITS).find((key) => typeof value?.[key] === "number");
  const spectrum = unit ? value.spectrum : value;
  const spectrumPath = unit ? [...path, "spectrum"] : path;
  const isPower = path.at(-1) === "power_W";
  const [amountPath, amount] = unit ? [[...path, unit], value[unit]] : typeof value === "number" ? [path, value] : isObject(value) ? [[...path, "scale"], value.scale ?? 1] : [null, null];
  if (amountPath) {
    // In steps of a hundredth of a decade, over six of them.
    const now = Math.log10(Math.max(amount, 1e-9));
    parts.push(slider("Amount", `${id}-amount`, now, { min: Math.floor(now) - 3, max: Math.floor(now) + 3, step: 0.01 }, (v) => `${figure(10 ** v, 3)} ${unit ? UNITS[unit] : isPower ? "W" : ""}`, (v, isFinal) => edit(amountPath, Number((10 ** v).toPrecision(4)), isFinal)));
  }
  if (!isPower && !value?.texture) {
    const kelvin = spectrum?.blackbody, illuminant = spectrum?.illuminant;
    const own = kelvin || illuminant ? [] : [["", describe(spectrum)]];
    const options = [...own, [BLACKBODY, "Blackbody"], ...colors.illuminants.map((n) => [n, `Illuminant ${n}`]), ["line:589", "Sodium, 589 nm"], ["line:546.1", "Mercury green, 546 nm"], ["line:632.8", "HeNe, 633 nm"]];
    const choose = h("select", { id: `${id}-spectrum` }, ...options.map(([v, text]) => h("option", { value: v, selected: v === (kelvin ? BLACKBODY : illuminant ?? "") }, text)));
    const scale = isObject(spectrum) && spectrum.scale !== undefined ? { scale: spectrum.scale } : {};
    choose.addEventListener("change", () => {
      const v = choose.value;
      if (v) edit(spectrumPath, v === BLACKBODY ? { blackbody: 6500, ...scale } : v.startsWith("line:") ? { line: { nm: Number(v.slice(5)), width: 1 }, ...scale } : { illuminant: v, ...scale }, true);
    });
    parts.push(field("Spectrum", choose));
    if (kelvin) parts.push(slider("Temperature", `${id}-kelvin`, kelvin, { min: 1500, max: 12000, step: 50 }, (v) => `${v} K`, (v, isFinal) => edit([...spectrumPath, "blackbody"], v, isFinal)));
  }
  return h("section", { class: "item", "data-path": path.join("/"), "aria-label": `Lamp ${name}` }, h("header", {}, h("h3", {}, name), h("span", {}, kind)), ...parts);
}

const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

