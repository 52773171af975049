// Cameras as scene files have them: turned, moved, and brought nearer. All of it about the target.

const sub = (a, b) => a.map((v, i) => v - b[i]);
const add = (a, b, f = 1) => a.map((v, i) => v + f * b[i]);
const dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(...a);
const unit = (a) => a.map((v) => v / norm(a));
const rounded = (a) => a.map((v) => Number(v.toPrecision(9)));

function turned(v, axis, angle) {
  const [c, si] = [Math.cos(angle), Math.sin(angle)];
  return add(add(v.map((x) => x * c), cross(axis, v), si), axis, dot(axis, v) * (1 - c));
}

/// The kind of a camera and what is in it.
export function inner(camera) {
  const kind = Object.keys(camera).find((key) => !key.startsWith("//"));
  return [kind, camera[kind]];
}

function changed(camera, change) {
  const [kind, old] = inner(camera);
  return { [kind]: { ...old, ...change } };
}

function frame(old) {
  const up = unit(old.up ?? [0, 1, 0]);
  const away = sub(old.eye, old.target);
  const right = unit(cross(up, away));
  return { up, away, right, above: unit(cross(away, right)) };
}

export function orbit(camera, dx, dy) {
  const [, old] = inner(camera);
  const { up, away, right } = frame(old);
  const height = Math.asin(Math.max(-1, Math.min(1, dot(unit(away), up))));
  // Never over the pole.
  const limit = Math.PI / 2 - 0.02;
  const pitch = Math.max(-limit, Math.min(limit, height + dy)) - height;
  const swung = turned(turned(away, right, -pitch), up, -dx);
  return changed(camera, { eye: rounded(add(old.target, swung)) });
}

/// By shares of the picture's height, seen under so many degrees.
export function pan(camera, dx, dy, vfov) {
  const [, old] = inner(camera);
  const { away, right, above } = frame(old);
  const size = old.height ?? 2 * norm(away) * Math.tan((vfov * Math.PI) / 360);
  const way = add(right.map((v) => -dx * size * v), above, dy * size);
  return changed(camera, { eye: rounded(add(old.eye, way)), target: rounded(add(old.target, way)) });
}

export function zoom(camera, factor) {
  const [, old] = inner(camera);
  if (old.height) return changed(camera, { height: Number((old.height * factor).toPrecision(9)) });
  return changed(camera, { eye: rounded(add(old.target, sub(old.eye, old.target), factor)) });
}

/// Looks at a point from where it stands; a lens is focused there.
export function focus(camera, point) {
  const next = changed(camera, { target: rounded(point) });
  delete inner(next)[1].focus_distance;
  return next;
}
