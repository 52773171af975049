// The spectrum under the probe: curve, error, colours below it, numbers, and its place in the CIE diagram.

import { $, download, encode, figure, h, hex, s, superscript, ticks } from "./dom.js";

const SIZE = [320, 190], LEFT = 40, RIGHT = 8, TOP = 18, BOTTOM = 24;
let colors = null, shown = [null, null];

export function begin(found) {
  colors = found;
  const gradient = s("linearGradient", { id: "visible", gradientUnits: "userSpaceOnUse", y1: 0, y2: 0 });
  $("plot").append(s("defs", {}, gradient), s("g", { id: "plot-content" }));
  chart();
  draw();
}

/// Shows what the server has found for a source, or nothing.
export function show(source, found) {
  shown[source] = found;
  draw();
}

export function clear() {
  shown = [null, null];
  draw();
}

function scale(value, lo, hi, from, to) {
  return from + ((value - lo) / (hi - lo)) * (to - from);
}

function draw() {
  const content = $("plot-content");
  if (!content || !colors) return;
  const found = shown.filter((f) => f && !f.nothing);
  const edges = found[0]?.edges ?? [380, 780];
  const [lo, hi] = [edges[0], edges[edges.length - 1]];
  const highest = Math.max(...found.flatMap((f) => f.values.map((v, i) => v + (f.errors?.[i] ?? 0))), 0);
  const lowest = Math.min(...found.flatMap((f) => f.values), 0);
  const top = highest > lowest ? highest * 1.06 : 1;
  const x = (nm) => scale(nm, lo, hi, LEFT, SIZE[0] - RIGHT);
  const y = (v) => scale(v, lowest, top, SIZE[1] - BOTTOM, TOP);
  const parts = [];
  for (const nm of ticks(lo, hi, 6)) parts.push(s("line", { class: "gridline", x1: x(nm), x2: x(nm), y1: TOP, y2: SIZE[1] - BOTTOM }), s("text", { x: x(nm), y: SIZE[1] - 10, "text-anchor": "middle" }, String(nm)));
  const power = highest > 0 ? 3 * Math.floor(Math.log10(highest) / 3) : 0;
  const usual = power >= -3 && power < 3 ? 0 : power;
  for (const v of ticks(lowest, top, 4)) parts.push(s("line", { class: "gridline", x1: LEFT, x2: SIZE[0] - RIGHT, y1: y(v), y2: y(v) }), s("text", { x: LEFT - 5, y: y(v) + 3, "text-anchor": "end" }, figure(v / 10 ** usual, 3)));
  found.forEach((f, i) => {
    const nth = shown.indexOf(f) === 1 ? " second" : "";
    const step = (value) => f.values.map((v, b) => `${x(f.edges[b]).toFixed(1)},${y(value(v, b)).toFixed(1)} ${x(f.edges[b + 1]).toFixed(1)},${y(value(v, b)).toFixed(1)}`);
    const line = step((v) => v);
    if (i === 0) parts.push(s("polygon", { fill: "url(#visible)", opacity: 0.85, points: `${x(f.edges[0])},${y(0)} ${line.join(" ")} ${x(f.edges[f.edges.length - 1])},${y(0)}` }));
    if (f.errors) {
      const above = step((v, b) => v + f.errors[b]);
      const below = step((v, b) => Math.max(lowest, v - f.errors[b])).map((pair) => pair.split(" ").reverse().join(" ")).reverse();
      parts.push(s("polygon", { class: "band" + nth, points: [...above, ...below].join(" ") }));
    }
    parts.push(s("polyline", { class: "curve" + nth, points: line.join(" ") }));
  });
  parts.push(s("polyline", { class: "axis", points: `${LEFT},${TOP} ${LEFT},${SIZE[1] - BOTTOM} ${SIZE[0] - RIGHT},${SIZE[1] - BOTTOM}` }));
  const unit = found[0] ? unitText(found[0].unit) : "";
  const factor = usual ? `10${superscript(usual)} ` : "";
  parts.push(s("text", { x: LEFT, y: 11 }, found[0] ? `${factor}${unit}` : ""), s("text", { x: SIZE[0] - RIGHT, y: SIZE[1] - 1, "text-anchor": "end" }, "nm"));
  const gradient = $("visible");
  gradient.setAttribute("x1", x(lo));
  gradient.setAttribute("x2", x(hi));
  gradient.replaceChildren(...colors.visible.filter(([nm]) => nm >= lo && nm <= hi).map(([nm, color]) => s("stop", { offset: (nm - lo) / (hi - lo), "stop-color": color })));
  content.replaceChildren(...parts);
  numbers(found);
  marks();
  $("csv").disabled = found.length === 0;
}

export const unitText = (unit) => unit.replace(/\^(-?\d+)/g, (_, n) => superscript(n));

function numbers(found) {
  const list = $("numbers");
  const f = found[0];
  if (!f) {
    list.replaceChildren();
    return;
  }
  const row = (name, ...value) => [h("dt", {}, name), h("dd", {}, ...value)];
  const most = Math.max(...f.rgb);
  const isOutside = f.rgb.some((v) => v < -1e-3 * Math.max(most, 1e-30));
  const shownAs = f.rgb.map((v) => (most > 0 ? encode(Math.max(0, v / most)) : 0));
  const swatch = s("svg", { class: "swatch", viewBox: "0 0 1 1", "aria-hidden": "true" }, s("rect", { width: 1, height: 1, fill: hex(shownAs) }));
  list.replaceChildren(
    ...row("X", figure(f.xyz[0])), ...row("Y", `${figure(f.xyz[1])} ${unitText(f.photometric_unit)}`), ...row("Z", figure(f.xyz[2])),
    ...row("x y", f.xy ? `${f.xy[0].toFixed(4)} ${f.xy[1].toFixed(4)}` : "–"),
    ...row("sRGB", swatch, isOutside ? "outside" : hex(shownAs)),
    ...(f.dominant ? row(f.dominant.complementary ? "λ compl." : "λ dom.", `${f.dominant.nm.toFixed(1)} nm`) : []),
    ...(f.dominant ? row("purity", f.dominant.purity.toFixed(3)) : []),
    ...(f.temperature ? row("CCT", `${Math.round(f.temperature.kelvin)} K`) : []),
  );
}

// The diagram: x to 0.8, y to 0.9.
const at = ([x, y]) => [6 + (x / 0.8) * 116, 136 - (y / 0.9) * 130];

function chart() {
  const outline = colors.locus.map(([, x, y]) => at([x, y]).map((v) => v.toFixed(1)).join(",")).join(" ");
  const fills = colors.locus.slice(0, -1).map(([nm, x, y], i) => {
    const [, x2, y2] = colors.locus[i + 1];
    const color = colors.visible.find(([other]) => other >= nm)?.[1] ?? "#000";
    return s("polyline", { points: [[x, y], [x2, y2]].map((p) => at(p).join(",")).join(" "), stroke: color, "stroke-width": 4, fill: "none", "stroke-linecap": "round" });
  });
  $("cie").replaceChildren(
    s("polygon", { points: outline, fill: "none", class: "axis" }), ...fills,
    s("polygon", { class: "gamut", points: colors.srgb.map((p) => at(p).join(",")).join(" ") }),
    s("circle", { cx: at(colors.white)[0], cy: at(colors.white)[1], r: 1.5, class: "gamut" }),
    s("text", { x: at(colors.srgb[1])[0] + 4, y: at(colors.srgb[1])[1] + 2 }, "sRGB"),
    s("g", { id: "cie-marks" }),
  );
}

function marks() {
  const dots = shown.map((f, i) => (f?.xy ? s("circle", { class: i === 1 ? "here second" : "here", cx: at(f.xy)[0], cy: at(f.xy)[1], r: 3.4 }) : null)).filter(Boolean);
  $("cie-marks")?.replaceChildren(...dots);
}

export function csv(name) {
  const f = shown.find((found) => found && !found.nothing);
  if (!f) return;
  const both = shown.filter((found) => found && !found.nothing && found.nm.length === f.nm.length);
  const heads = both.flatMap((found, i) => [`${found.quantity}${both.length > 1 ? " " + "AB"[i] : ""} / ${found.unit}`, ...(found.errors ? ["standard error"] : [])]);
  const lines = f.nm.map((nm, b) => [nm, ...both.flatMap((found) => [found.values[b], ...(found.errors ? [found.errors[b]] : [])])].join(","));
  const place = `# ${name}, pixel ${f.pixel.join(" ")}, mean of ${f.pixels.join(" x ")} pixels`;
  const xyz = `# XYZ ${f.xyz.join(" ")} ${f.photometric_unit}`;
  download(`${name}-spectrum.csv`, [place, xyz, ["nm", ...heads].join(","), ...lines, ""].join("\n"), "text/csv");
}
