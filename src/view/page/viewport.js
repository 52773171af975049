// The pictures on the stage: frames as they come, and what mouse and keys do on them.

import { $, paced, s } from "./dom.js";
import { send } from "./link.js";
import * as cam from "./camera.js";

export const state = {
  movable: false, isRectangle: false, isMoving: false,
  /// The camera as a scene file has it, and the degrees that it sees from bottom to top.
  camera: null, vfov: null,
  /// The probe, as shares of width and height: a place or a rectangle; pinned or under the mouse.
  place: null, pinned: null,
};
const acts = {};
let film = { width: 4, height: 3 };

export function begin(given) {
  Object.assign(acts, given);
  document.querySelectorAll(".frame").forEach((frame) => listen(frame, frame.querySelector("canvas")));
  new ResizeObserver(layOut).observe($("stage"));
}

export function frames() {
  return [...document.querySelectorAll(".frame")];
}

export function setFilm(next) {
  film = next;
  layOut();
}

export function showSources(list) {
  frames().forEach((frame, i) => { frame.hidden = !list.includes(i); });
  layOut();
}

/// As large as there is room for, pixels square.
function layOut() {
  const seen = frames().filter((frame) => !frame.hidden);
  const room = $("frames").getBoundingClientRect();
  const width = (room.width - 12 * (seen.length - 1)) / seen.length;
  const scale = Math.min(width / film.width, room.height / film.height);
  for (const frame of seen) {
    frame.style.width = `${Math.floor(film.width * scale)}px`;
    frame.style.height = `${Math.floor(film.height * scale)}px`;
    frame.dataset.large = scale > 2.5;
  }
  drawOverlay();
}

export function paint(source, head, bitmap) {
  const canvas = $(`picture-${source}`);
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
  canvas.getContext("2d").drawImage(bitmap, 0, 0);
  bitmap.close();
  // Pixels of a film are shown as they are, those of a preview blend.
  canvas.classList.toggle("sharp", !head.preview && canvas.parentElement.dataset.large === "true");
  canvas.dataset.preview = head.preview;
  canvas.parentElement.dataset.denoised = Boolean(head.denoised);
  canvas.dataset.frames = Number(canvas.dataset.frames ?? 0) + 1;
}

export function drawOverlay() {
  const place = state.pinned ?? state.place;
  for (const frame of frames()) {
    const overlay = frame.querySelector(".overlay");
    const [w, hgt] = [frame.clientWidth, frame.clientHeight];
    if (!place || !w) {
      overlay.replaceChildren();
      continue;
    }
    const [x0, y0, x1, y1] = [place[0] * w, place[1] * hgt, place[2] * w, place[3] * hgt];
    const shape = (cls) => x0 === x1 && y0 === y1
      ? s("path", { class: cls, d: `M${x0 - 9} ${y0}h6m6 0h6M${x0} ${y0 - 9}v6m0 6v6` + (state.pinned ? `M${x0 - 4} ${y0}a4 4 0 1 0 8 0a4 4 0 1 0-8 0` : "") })
      : s("rect", { class: cls, x: Math.min(x0, x1), y: Math.min(y0, y1), width: Math.abs(x1 - x0), height: Math.abs(y1 - y0) });
    overlay.replaceChildren(shape("dark"), shape("light"));
  }
}

export function setPlace(place, isPinned) {
  if (isPinned) state.pinned = place;
  else state.place = place;
  drawOverlay();
  acts.probe(state.pinned ?? state.place);
}

export function unpin() {
  state.pinned = null;
  drawOverlay();
  acts.probe(state.place);
}

export function setRectangle(is) {
  state.isRectangle = is;
  $("region").setAttribute("aria-pressed", is);
}

// The camera: what is told on the way is shown at once, what is told last is rendered.
const tell = paced(33, (camera, isFinal) => send({ type: "camera", camera, final: isFinal }));
let rest = null;

export function move(camera, isFinal) {
  state.camera = camera;
  state.isMoving = !isFinal;
  tell(camera, isFinal);
  acts.moved(camera);
}

function moveAndRest(camera) {
  move(camera, false);
  clearTimeout(rest);
  rest = setTimeout(() => move(state.camera, true), 220);
}

function listen(frame, canvas) {
  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    const inside = (v) => Math.min(1, Math.max(0, v));
    return [inside((event.clientX - box.left) / box.width), inside((event.clientY - box.top) / box.height)];
  };
  let drag = null;
  canvas.addEventListener("pointerdown", (event) => {
    if (drag) return;
    canvas.setPointerCapture(event.pointerId);
    const [x, y] = at(event);
    const kind = state.isRectangle || !state.movable ? "rectangle" : event.shiftKey || event.button !== 0 ? "pan" : "orbit";
    drag = { kind, x, y, from: [event.clientX, event.clientY], camera: state.camera, moved: false };
  });
  canvas.addEventListener("pointermove", (event) => {
    const [x, y] = at(event);
    if (!drag) {
      if (!state.pinned) setPlace([x, y, x, y], false);
      return;
    }
    const [dx, dy] = [event.clientX - drag.from[0], event.clientY - drag.from[1]];
    if (!drag.moved && Math.hypot(dx, dy) < 4) return;
    drag.moved = true;
    canvas.classList.add("moving");
    if (drag.kind === "rectangle") setPlace([drag.x, drag.y, x, y], true);
    else if (drag.kind === "pan") move(cam.pan(drag.camera, dx / canvas.clientHeight, dy / canvas.clientHeight, state.vfov), false);
    else move(cam.orbit(drag.camera, (dx / canvas.clientHeight) * 3.2, (dy / canvas.clientHeight) * 3.2), false);
  });
  const end = (event) => {
    if (!drag) return;
    canvas.classList.remove("moving");
    const { kind, moved } = drag;
    drag = null;
    if (!moved && event.type === "pointerup" && event.button === 0) {
      const [x, y] = at(event);
      setPlace([x, y, x, y], true);
      acts.select(x, y);
    } else if (moved && kind !== "rectangle") move(state.camera, true);
    else if (moved) setRectangle(false);
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => { if (!drag && !state.pinned) setPlace(null, false); });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", (event) => { const [x, y] = at(event); acts.focus(x, y); });
  canvas.addEventListener("wheel", (event) => {
    if (!state.movable) return;
    event.preventDefault();
    moveAndRest(cam.zoom(state.camera, Math.exp(Math.max(-1, Math.min(1, event.deltaY / 240)) * 0.35)));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (arrow && (event.altKey || !state.movable)) {
      const [px, py] = state.pinned ?? state.place ?? [0.5, 0.5];
      const step = event.shiftKey ? 10 : 1;
      const next = [Math.min(1, Math.max(0, px + (step * arrow[0]) / film.width)), Math.min(1, Math.max(0, py + (step * arrow[1]) / film.height))];
      setPlace([...next, ...next], true);
    } else if (arrow) {
      const [dx, dy] = arrow.map((v) => v * 0.06);
      moveAndRest(event.shiftKey ? cam.pan(state.camera, -dx, -dy, state.vfov) : cam.orbit(state.camera, dx, dy));
    } else if (state.movable && (event.key === "+" || event.key === "=" || event.key === "-")) {
      moveAndRest(cam.zoom(state.camera, event.key === "-" ? 1.12 : 1 / 1.12));
    } else if (event.key === "Enter" && (state.pinned ?? state.place)) {
      const place = state.pinned ?? state.place;
      setPlace(place, true);
      acts.select(place[0], place[1]);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  });
}
