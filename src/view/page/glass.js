// The catalogue of glasses: searched by name, or clicked at in the Abbe diagram.

import { $, figure, h, s, ticks } from "./dom.js";

let all = null, found = [], chosen = null, use = null, now = null;
// The corner of the diagram that most glasses are in; others are in the list alone.
const VD = [110, 10], ND = [1.3, 2.2];
const x = (vd) => 40 + ((VD[0] - vd) / (VD[0] - VD[1])) * 410;
const y = (nd) => 345 - ((nd - ND[0]) / (ND[1] - ND[0])) * 335;
const isDrawn = ([, nd, vd]) => nd >= ND[0] && nd <= ND[1] && vd <= VD[0] && vd >= VD[1];

export async function choose(name, act) {
  all ??= await (await fetch("/data/glasses.json")).json();
  [use, now, chosen] = [act, all.find(([n]) => n.toLowerCase() === String(name).toLowerCase()) ?? null, null];
  $("glass-search").value = "";
  $("glass-title").textContent = name ? `Glass in place of ${name}` : "Glass";
  $("glass-dialog").showModal();
  search();
  pick(now);
  $("glass-search").focus();
}

// What people call glasses, as the diagram has been divided since Schott, and the usual one of each kind.
const isCrown = ([, nd, vd]) => vd >= (nd < 1.6 ? 55 : 50);
const KINDS = { crown: [isCrown, "N-BK7"], flint: [(glass) => !isCrown(glass), "F2"] };

function search() {
  const words = $("glass-search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const fits = (glass, word) => glass[0].toLowerCase().includes(word) || KINDS[word]?.[0](glass);
  const begins = ([name]) => name.toLowerCase().startsWith(words[0]) || name === KINDS[words[0]]?.[1];
  const fitting = all.filter((glass) => words.every((word) => fits(glass, word)));
  found = words.length ? [...fitting.filter(begins), ...fitting.filter((glass) => !begins(glass))] : fitting;
  $("glass-count").textContent = `${found.length} of ${all.length}`;
  $("glass-list").replaceChildren(...found.slice(0, 400).map(([name, nd, vd], i) => h("li", { role: "option", id: `glass-${i}`, "data-name": name, "aria-selected": chosen?.[0] === name }, h("span", {}, name), h("span", {}, `${nd.toFixed(4)}  ${vd.toFixed(1)}`))));
  diagram();
  // What is typed is meant: Enter takes the first.
  if (words.length && !found.includes(chosen)) pick(found[0] ?? null);
}

function diagram() {
  const isSearch = found.length < all.length;
  const grid = [
    ...ticks(VD[1], VD[0], 9).map((v) => s("g", {}, s("line", { class: "gridline", x1: x(v), x2: x(v), y1: 10, y2: 345 }), s("text", { x: x(v), y: 358, "text-anchor": "middle" }, String(v)))),
    ...ticks(ND[0], ND[1], 8).map((n) => s("g", {}, s("line", { class: "gridline", x1: 40, x2: 450, y1: y(n), y2: y(n) }), s("text", { x: 35, y: y(n) + 3, "text-anchor": "end" }, n.toFixed(1)))),
    s("text", { x: 450, y: 374, "text-anchor": "end" }, "Abbe number V_d"), s("text", { x: 44, y: 20 }, "n_d"),
  ];
  const dots = (list, cls) => s("path", { class: cls, d: list.filter(isDrawn).map(([, nd, vd]) => `M${(x(vd) - 1.6).toFixed(1)} ${y(nd).toFixed(1)}a1.6 1.6 0 1 0 3.2 0a1.6 1.6 0 1 0-3.2 0`).join("") });
  $("abbe-diagram").replaceChildren(...grid, dots(all, "dot"), isSearch ? dots(found, "dot found") : "", s("g", { id: "abbe-marks" }));
  mark();
}

function mark() {
  const ring = (glass, cls) => glass && isDrawn(glass) && s("circle", { class: cls, cx: x(glass[2]), cy: y(glass[1]), r: 6 });
  $("abbe-marks").replaceChildren(...[ring(now, "now"), ring(chosen, "chosen")].filter(Boolean));
}

async function pick(glass) {
  chosen = glass;
  mark();
  document.querySelectorAll("#glass-list li").forEach((item) => item.setAttribute("aria-selected", item.dataset.name === glass?.[0]));
  const selected = document.querySelector('#glass-list [aria-selected="true"]');
  selected?.scrollIntoView({ block: "nearest" });
  if (selected) $("glass-list").setAttribute("aria-activedescendant", selected.id);
  $("glass-use").disabled = !glass || glass === now;
  $("glass-about").textContent = glass ? `${glass[0]}: n_d ${glass[1].toFixed(5)}, V_d ${glass[2].toFixed(2)}` : "Click at a point, or choose from the list.";
  if (!glass) return;
  const more = await (await fetch(`/data/glass.json?name=${encodeURIComponent(glass[0])}`)).json();
  if (chosen !== glass) return;
  const [lo, hi] = more.range;
  $("glass-about").textContent += `. Known from ${figure(lo, 4)} to ${figure(hi, 4)} nm.`;
}

function accept() {
  if (!chosen || chosen === now) return;
  $("glass-dialog").close();
  use(chosen[0]);
}

export function begin() {
  $("glass-search").addEventListener("input", search);
  $("glass-list").addEventListener("click", (event) => {
    const name = event.target.closest("li")?.dataset.name;
    if (name) pick(all.find(([n]) => n === name));
  });
  $("glass-list").addEventListener("dblclick", accept);
  const keys = (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step) {
      event.preventDefault();
      const list = found.slice(0, 400);
      const place = list.findIndex(([name]) => name === chosen?.[0]);
      pick(list[Math.min(list.length - 1, Math.max(0, place + step))] ?? null);
    } else if (event.key === "Enter") {
      event.preventDefault();
      accept();
    }
  };
  $("glass-search").addEventListener("keydown", keys);
  $("glass-list").addEventListener("keydown", keys);
  $("glass-use").addEventListener("click", accept);
  $("abbe-diagram").addEventListener("click", (event) => {
    const box = $("abbe-diagram").getBoundingClientRect();
    const scale = 460 / box.width;
    const [cx, cy] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    const near = found.filter(isDrawn).map((glass) => [Math.hypot(x(glass[2]) - cx, y(glass[1]) - cy), glass]).reduce((a, b) => (b[0] < a[0] ? b : a), [Infinity, null]);
    if (near[0] < 25) pick(near[1]);
  });
}
