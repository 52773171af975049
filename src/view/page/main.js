// The page: the document and what follows from it on one side, what the user asks for on the other.

import { $, figure, h, prefixed, seconds, toast } from "./dom.js";
import { connect, on, send } from "./link.js";
import * as viewport from "./viewport.js";
import * as spectrum from "./spectrum.js";
import * as looks from "./looks.js";
import * as scene from "./scene.js";
import * as glass from "./glass.js";
import * as cam from "./camera.js";

let doc = null, status = {}, mode = "0", flicker = null, purpose = null, isUnseen = false;
const probe = { place: null, outstanding: [false, false], again: [false, false], id: 0 };
const view = viewport.state;

// Light or dark: as the system has it, until told otherwise.
const dark = matchMedia("(prefers-color-scheme: dark)");
let theme = localStorage.getItem("theme");
const paintTheme = () => { document.documentElement.dataset.theme = theme ?? (dark.matches ? "dark" : "light"); };
dark.addEventListener("change", paintTheme);
paintTheme();
$("theme").addEventListener("click", () => {
  theme = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("theme", theme);
  paintTheme();
});

// The probe: one question on its way for each picture.
const sources = () => (mode === "both" || mode === "flicker" ? [0, 1] : [Number(mode)]);
function ask() {
  for (const source of sources()) {
    if (!probe.place) continue;
    if (probe.outstanding[source]) {
      probe.again[source] = true;
      continue;
    }
    probe.outstanding[source] = true;
    send({ type: "spectrum", id: ++probe.id, source, region: probe.place });
  }
}

function setProbe(place) {
  probe.place = place;
  $("unpin").disabled = !view.pinned;
  if (!view.pinned) $("reveal").hidden = true;
  if (place) ask();
  else {
    spectrum.clear();
    $("probe-place").textContent = "Move over the picture; a click pins.";
  }
}

on("spectrum", (found) => {
  probe.outstanding[found.source] = false;
  if (probe.place && !found.nothing) {
    spectrum.show(found.source, found);
    looks.setBins(found.edges);
    const [w, hgt] = found.pixels;
    const where = w * hgt > 1 ? `${w} × ${hgt} pixels from ${found.pixel.join(", ")}` : `pixel ${found.pixel.join(", ")}`;
    $("probe-place").textContent = `${view.pinned ? "Pinned: " : ""}${where}${found.preview ? ", preview" : ""}`;
  }
  if (probe.again[found.source]) {
    probe.again[found.source] = false;
    ask();
  }
});

on("document", ({ document: next }) => {
  const isFirst = !doc?.kind;
  doc = next;
  if (!doc.kind) return;
  document.title = `${doc.name} – Abbe view`;
  $("name").textContent = doc.name;
  $("changed").hidden = !doc.changed;
  document.querySelectorAll(".scene-only").forEach((element) => { element.hidden = doc.kind !== "scene"; });
  viewport.setFilm(doc.film);
  view.movable = doc.movable;
  document.querySelectorAll("canvas").forEach((canvas) => canvas.classList.toggle("movable", doc.movable));
  view.vfov = doc.vfov_deg;
  if (doc.camera && !view.isMoving) view.camera = doc.camera;
  $("undo").disabled = !doc.can_undo;
  $("redo").disabled = !doc.can_redo;
  if (doc.kind === "scene") {
    scene.setDocument(doc);
    if (isFirst || !$("save-dialog").open) $("save-name").value = doc.save_as;
  }
  showCamera(doc.camera);
  looks.setDocument(doc);
  $("sources").hidden = !(doc.files?.length > 1);
  if (doc.files) viewport.frames().forEach((frame, i) => { frame.dataset.label = doc.files.length > 1 ? `${"AB"[i]}  ${doc.files[i] ?? ""}` : ""; });
  $("notes").replaceChildren(...doc.notes.map((note) => h("li", {}, note)));
  $("notes-section").hidden = !doc.notes.length;
  if (doc.message) toast(doc.message);
});

/// As people write it: points in a line.
const written = (camera) => JSON.stringify(camera, null, 1).replace(/\[[^[\]{}]*\]/g, (list) => list.replace(/\s+/g, " ").replace("[ ", "[").replace(" ]", "]"));

function showCamera(camera) {
  if (!camera) return;
  const copy = h("button", { type: "button", onclick: async () => { await navigator.clipboard.writeText(JSON.stringify({ camera: view.camera })); toast("The camera is copied, as a scene file has it."); } }, "Copy as JSON");
  const reset = h("button", { type: "button", onclick: resetCamera }, "Reset");
  $("camera").replaceChildren(h("pre", { class: "json", id: "camera-json", tabindex: 0 }, written(camera)), h("div", { class: "row" }, copy, reset));
}

function resetCamera() {
  view.isMoving = false;
  send({ type: "camera", camera: null, final: true });
}

const PHASES = { loading: "Loading", preparing: "Preparing", compiling: "Compiling kernels", moving: "Moving", rendering: "Rendering", paused: "Paused", done: "Done", failed: "Failed", file: "File" };
on("status", ({ status: next }) => {
  status = next;
  const phase = status.paused && status.phase === "rendering" ? "paused" : status.phase;
  $("phase").textContent = PHASES[phase] ?? phase;
  $("phase").className = `phase ${["preparing", "compiling", "moving", "rendering", "loading"].includes(phase) ? "busy" : ""}`;
  $("pause").textContent = status.paused ? "Go on" : "Pause";
  $("pause").disabled = ["done", "failed"].includes(status.phase);
  $("pause").setAttribute("aria-pressed", Boolean(status.paused));
  $("progress").hidden = status.phase === "file";
  $("progress").value = phase === "done" ? 1 : status.fraction ?? 0;
  const parts = [];
  if (status.spp) parts.push(`${status.spp} ${status.spp === 1 ? "sample" : "samples"} per pixel`);
  if (status.error) parts.push(`error ${figure(100 * status.error, 3)} %${status.target ? ` (to be ${figure(100 * status.target, 2)} %)` : ""}`);
  if (status.rays_per_second) parts.push(`${prefixed(status.rays_per_second)}rays/s`);
  if (status.seconds) parts.push(seconds(status.seconds));
  if (phase === "rendering" && status.remaining) parts.push(`about ${seconds(status.remaining)} left`);
  $("figures").textContent = parts.join("  ·  ");
  $("device").textContent = status.device ?? "";
  if (status.phase === "failed" && status.message) toast(status.message);
  document.body.dataset.phase = phase;
  document.body.dataset.spp = status.spp ?? 0;
  document.body.dataset.compilations = status.compilations ?? 0;
});

on("frame", (head, picture) => {
  viewport.paint(head.source, head, picture);
  $("empty").hidden = true;
  if (isUnseen) $("toast").hidden = true;
  isUnseen = false;
  if (head.source === sources()[0]) looks.setFrame(head);
  if (probe.place) ask();
});
on("unseen", ({ text }) => { toast(text); isUnseen = true; });
on("open", () => { looks.tell(); $("empty").textContent = "Loading the scene…"; });
on("closed", () => { $("phase").textContent = "Not connected"; $("phase").className = "phase"; document.body.dataset.phase = "closed"; });

on("picked", (found) => {
  if (purpose === "focus" && found.at && view.movable) viewport.move(cam.focus(view.camera, found.at), true);
  if (purpose === "select") {
    scene.select(found.lamp ?? found.material);
    $("reveal").hidden = !(found.lamp || found.material);
    $("reveal").textContent = found.lamp ? `${found.shape} ›` : `${found.material?.at(-1)} ›`;
  }
  purpose = null;
});

function pick(what, x, y) {
  if (doc?.kind !== "scene") return;
  purpose = what;
  send({ type: "pick", x, y });
}

// Which pictures are seen.
function setMode(next) {
  mode = next;
  clearInterval(flicker);
  document.querySelectorAll("#sources button").forEach((button) => button.setAttribute("aria-pressed", button.dataset.source === mode));
  looks.setSources({ source: mode === "1" ? 1 : 0, both: mode === "both" || mode === "flicker" });
  viewport.showSources(mode === "both" ? [0, 1] : [mode === "1" ? 1 : 0]);
  spectrum.clear();
  ask();
  if (mode === "flicker") {
    let shown = 0;
    flicker = setInterval(() => { shown = 1 - shown; viewport.showSources([shown]); }, 450);
  }
}
$("sources").addEventListener("click", (event) => { const source = event.target.dataset.source; if (source) setMode(source); });

// Buttons and keys.
$("undo").addEventListener("click", () => send({ type: "undo" }));
$("redo").addEventListener("click", () => send({ type: "redo" }));
$("pause").addEventListener("click", () => send({ type: "pause", paused: !status.paused }));
$("help").addEventListener("click", () => $("help-dialog").showModal());
$("region").addEventListener("click", () => viewport.setRectangle(!view.isRectangle));
$("unpin").addEventListener("click", viewport.unpin);
$("reveal").addEventListener("click", scene.reveal);
$("csv").addEventListener("click", () => spectrum.csv(doc.name));
$("save").addEventListener("click", () => {
  const source = mode === "1" ? 1 : 0;
  $("save-png").href = `/picture.png?source=${source}&look=${encodeURIComponent(JSON.stringify(looks.told()))}`;
  $("save-png").download = `${doc.name}.png`;
  $("save-exr").download = `${doc.name}.exr`;
  $("save-name").value = doc.save_as ?? "";
  $("save-result").textContent = "";
  $("save-dialog").showModal();
});
$("save-scene").addEventListener("click", () => send({ type: "save", name: $("save-name").value }));
$("save-name").addEventListener("keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); $("save-scene").click(); } });
on("saved", ({ saved, error }) => { $("save-result").textContent = error ?? `Saved as ${saved}.`; });

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]") || event.target.matches("input, select, textarea")) return;
  const key = event.key.toLowerCase();
  const wanted = looks.views[Number(key) - 1];
  if (wanted) looks.set({ view: wanted });
  else if (key === "?") $("help").click();
  else if (key === "d" && doc?.kind === "scene") looks.set({ denoise: !looks.look.denoise });
  else if (key === "p" && doc?.kind === "scene") $("pause").click();
  else if (key === "z") $("undo").click();
  else if (key === "y") $("redo").click();
  else if (key === "s") $("save").click();
  else if (key === "r" && view.movable) resetCamera();
  else if (key === "m") $("region").click();
  else if (key === "f" && (view.pinned ?? view.place)) pick("focus", ...(view.pinned ?? view.place));
  else if (key === "x" && !$("sources").hidden) setMode(mode === "flicker" ? "0" : "flicker");
  else if (key === "[" || key === "]") looks.set({ stops: Math.round(10 * (looks.look.stops + (key === "]" ? 0.5 : -0.5))) / 10 });
  else if (key === "escape") viewport.unpin();
  else return;
  event.preventDefault();
});

viewport.begin({
  probe: setProbe,
  select: (x, y) => pick("select", x, y),
  focus: (x, y) => pick("focus", x, y),
  moved: (camera) => { const place = $("camera-json"); if (place && $("camera-section").open) place.textContent = written(camera); },
});
const choices = await (await fetch("/data/choices.json")).json();
looks.begin(choices.look);
spectrum.begin(choices);
glass.begin();
scene.begin(choices);
connect();
