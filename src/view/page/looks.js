// How the picture is seen: this page's own, and nobody else's.

import { $, figure, h } from "./dom.js";
import { send } from "./link.js";
import { unitText } from "./spectrum.js";

export const look = { view: "colors", nm: 550, auto: true, stops: 0, tone: "none", gamut: "map", white: null, observer: "1931", denoise: false };
/// Views of one picture, by the keys from 1 on.
export let views = [];
/// Those of two, and those that a file has not.
const COMPARE = ["difference", "delta-e"], RENDERED = ["samples"];
/// What names are to people; others are shown as they are.
const TEXTS = {
  colors: "Colours", bin: "One wavelength", luminance: "Luminance", error: "Relative error", depth: "Depth", normal: "Normals", albedo: "Albedo", samples: "Samples", difference: "Difference", "delta-e": "ΔE 2000",
  none: "None", reinhard: "Reinhard", aces: "ACES", agx: "AgX", map: "Keep hue and lightness", clip: "Clip", 1931: "CIE 1931, 2°", 1964: "CIE 1964, 10°",
};
let sources = { source: 0, both: false }, isOwnExposure = true, isScene = false;

/// As the server reads it: the exposure as `develop` does; that of the scene or file until it is changed here.
export function told() {
  const { auto, stops, ...rest } = look;
  return { ...rest, exposure: isOwnExposure ? null : auto ? `auto${stops < 0 ? "" : "+"}${stops}` : String(stops) };
}

export function tell() {
  send({ type: "look", look: told(), ...sources });
}

export function setSources(next) {
  sources = next;
  tell();
}

export function set(change) {
  if ("auto" in change || "stops" in change) isOwnExposure = false;
  Object.assign(look, change);
  refresh();
  tell();
}

const out = (id) => $(`${id}-out`);
const option = ([value, text]) => h("option", { value }, text);
const named = (names) => names.map((name) => [name, TEXTS[name] ?? name]);

export function begin(choices) {
  views = choices.views.filter((view) => !COMPARE.includes(view));
  const select = (id, text, options, act) => {
    const element = h("select", { id }, ...options.map(option));
    element.addEventListener("change", () => act(element.value));
    return h("div", { class: "field" }, h("label", { for: id }, text), element);
  };
  const range = (id, text, attributes, act) => {
    const element = h("input", { id, type: "range", ...attributes });
    element.addEventListener("input", () => act(Number(element.value)));
    return h("div", { class: "field" }, h("label", { for: id }, text), element, h("output", { id: `${id}-out`, for: id }));
  };
  const auto = h("input", { id: "auto", type: "checkbox", checked: true });
  auto.addEventListener("change", () => {
    const fixed = Number($("exposure-now").dataset.stops ?? 0);
    set(auto.checked ? { auto: true, stops: 0 } : { auto: false, stops: Math.round(fixed * 10) / 10 });
  });
  const denoise = h("input", { id: "denoise", type: "checkbox" });
  denoise.addEventListener("change", () => set({ denoise: denoise.checked }));
  const kelvins = [2700, 3200, 4000, 5000, 5500, 6500, 7500, 9300].map((k) => [String(k), `${k} K`]);
  $("view-controls").append(
    select("view", "Show", named(views), (view) => set({ view })),
    h("div", { class: "field" }, h("label", { for: "denoise" }, "Denoise"), denoise, h("output", { id: "denoise-out", for: "denoise" })),
    range("nm", "Wavelength", { min: 380, max: 780, step: 1 }, (nm) => set({ nm })),
    range("stops", "Exposure", { min: -12, max: 12, step: 0.1 }, (stops) => set({ stops })),
    h("div", { class: "field", id: "auto-row" }, h("label", { for: "auto" }, "Automatic"), auto, h("output", { id: "exposure-now" })),
    select("tone", "Tone curve", named(choices.tones), (tone) => set({ tone })),
    select("white", "White", [["", "D65"], ["A", "A"], ["D50", "D50"], ["D75", "D75"], ["E", "E"], ["FL2", "FL2"], ["FL11", "FL11"], ...kelvins], (value) => set({ white: value === "" ? null : /^\d+$/.test(value) ? Number(value) : value })),
    select("gamut", "Gamut", named(choices.gamuts), (gamut) => set({ gamut })),
    select("observer", "Observer", named(choices.observers), (observer) => set({ observer })),
  );
  refresh();
}

export function setDocument(document_) {
  const usual = document_.kind === "files" ? views.filter((view) => !RENDERED.includes(view)) : views;
  const options = [...usual, ...(document_.files?.length > 1 ? COMPARE : [])];
  if ($("view").options.length !== options.length) $("view").replaceChildren(...named(options).map(option));
  isScene = document_.kind === "scene";
  if (isOwnExposure) Object.assign(look, { auto: document_.exposure === null, stops: document_.exposure ?? 0 });
  refresh();
}

export function setBins(edges) {
  [$("nm").min, $("nm").max] = [edges[0], edges[edges.length - 1]];
}

function refresh() {
  // By itself around that of the picture, or around none.
  const [least, most] = look.auto ? [-12, 12] : [Math.min(-16, Math.floor(look.stops)), Math.max(16, Math.ceil(look.stops))];
  [$("stops").min, $("stops").max] = [least, most];
  for (const key of ["view", "nm", "stops", "tone", "gamut", "observer"]) $(key).value = look[key];
  const isDeveloped = ["colors", "bin", "delta-e"].includes(look.view);
  $("nm").closest(".field").hidden = look.view !== "bin";
  for (const id of ["stops", "auto-row"]) ($(id).closest(".field") ?? $(id)).hidden = !isDeveloped;
  for (const id of ["tone", "white", "gamut"]) $(id).closest(".field").hidden = look.view !== "colors";
  $("observer").closest(".field").hidden = ["depth", "normal", "albedo", "samples", "error", "bin"].includes(look.view);
  $("denoise").closest(".field").hidden = !isScene || look.view !== "colors" || look.observer !== "1931";
  $("auto").checked = look.auto;
  $("denoise").checked = look.denoise;
  out("nm").textContent = `${look.nm} nm`;
  out("stops").textContent = `${look.auto && look.stops >= 0 ? "+" : ""}${look.stops.toFixed(1)} EV`;
}

/// What came with a frame.
export function setFrame(head) {
  if (head.exposure !== undefined) {
    $("exposure-now").dataset.stops = head.exposure;
    $("exposure-now").textContent = `${head.exposure >= 0 ? "+" : ""}${head.exposure.toFixed(2)} EV`;
  }
  out("denoise").textContent = head.denoised ? "denoised" : look.denoise ? "not yet" : "";
  const legend = $("legend");
  legend.hidden = !head.scale;
  if (!head.scale) return;
  const { lo, hi, unit, colors } = head.scale;
  $("legend-lo").textContent = figure(lo, 3);
  $("legend-hi").textContent = figure(hi, 3);
  $("legend-unit").textContent = unitText(unit);
  $("legend-bar").replaceChildren(...colors.map((color, i) => {
    const rect = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    for (const [key, value] of Object.entries({ x: (i * 180) / colors.length, width: 180 / colors.length + 0.5, height: 10, fill: color })) rect.setAttribute(key, value);
    return rect;
  }));
}
