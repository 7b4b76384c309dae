/* The floor: its grid, shadows, and what is marked on it. */

const MESHES = [0.1, 0.25, 0.5, 1]; // metres between lines; the smallest is for small dogs
const FADES = 8; // shades of its lines
const FLOOR_INK = 0.55; // how much of the colour the nearest have
const BEYOND = 2; // metres that the edges of a field of heights go on

/* Lines of the floor around a place as points [x, y, z], NaN between lines: chords of a circle in steps. */
function meshAround(ground, x0, z0, reach, mesh) {
  const found = [];
  for (let along = -reach; along <= reach + 1e-6; along += mesh) {
    const half = Math.sqrt(Math.max(reach * reach - along * along, 0));
    const steps = Math.max(Math.ceil((2 * half) / mesh), 1);
    for (const turned of [false, true]) {
      found.push(NaN);
      for (let i = 0; i <= steps; i++) {
        const across = -half + (2 * half * i) / steps;
        const x = x0 + (turned ? across : along), z = z0 + (turned ? along : across);
        found.push(x, floorAt(ground, x, z), z);
      }
    }
  }
  return Float32Array.from(found);
}

/* The same lines, kept for as long as a figure stays between them. */
function keptMesh(ground, x0, z0, reach, mesh) {
  const key = [x0, z0, reach, mesh].join();
  const kept = ground.kept || (ground.kept = new Map());
  if (!kept.has(key)) {
    if (kept.size > 40) kept.clear();
    kept.set(key, meshAround(ground, x0, z0, reach, mesh));
  }
  return kept.get(key);
}

/* Where a field of heights bends along one axis, and half metres between: the sides of its tiles, metres. */
function knots({ heights, rows, columns, origin, spacing }, axis) {
  const count = axis ? rows : columns, others = axis ? columns : rows;
  const at = (k, other) => (axis ? heights[other * rows + k] : heights[k * rows + other]);
  const found = [0, count - 1];
  for (let k = 1; k < count - 1; k++) {
    for (let other = 0; other < others; other++) {
      if (Math.abs(at(k - 1, other) - 2 * at(k, other) + at(k + 1, other)) < 2.5e-3) continue; // rounded
      found.push(k);
      break;
    }
  }
  const own = found.map((k) => origin[axis] + spacing * k);
  const first = Math.min(...own) - BEYOND, last = Math.max(...own) + BEYOND;
  for (let half = Math.ceil(2 * first); half <= 2 * last; half++) own.push(half / 2);
  return own.sort((a, b) => a - b).filter((value, i, all) => !i || value - all[i - 1] > 1e-4);
}

/* The tiles of a field of heights: corners [x, y, z] four times, and how steep each is, 0 to 1. */
function tilesOf(ground) {
  const xs = knots(ground, 0), zs = knots(ground, 1), found = [];
  for (let i = 1; i < xs.length; i++) {
    for (let k = 1; k < zs.length; k++) {
      const corners = [[xs[i - 1], zs[k - 1]], [xs[i], zs[k - 1]], [xs[i], zs[k]], [xs[i - 1], zs[k]]]
        .map(([x, z]) => [x, floorAt(ground, x, z), z]);
      const slope = (a, b) => Math.abs(a[1] - b[1]) / Math.hypot(a[0] - b[0], a[2] - b[2]);
      found.push({ corners, steep: Math.min(Math.max(slope(corners[0], corners[1]), slope(corners[0], corners[3])), 1) });
    }
  }
  return found;
}

/* Stairs and whatever else is not flat, as tiles, the far ones first. */
function drawField(context, view, ground, reach, theme) {
  if (!ground.tiles) ground.tiles = tilesOf(ground);
  const seen = [];
  for (const { corners, steep } of ground.tiles) {
    const [[x, , z]] = corners;
    if (Math.hypot(x - view.target[0], z - view.target[2]) > reach) continue;
    const places = corners.map((corner) => {
      const out = [0, 0, 0, 0];
      view.project(...corner, out, 0);
      return out;
    });
    const [a, b, , d] = places;
    if ((b[0] - a[0]) * (d[1] - a[1]) < (d[0] - a[0]) * (b[1] - a[1])) continue; // it looks away
    seen.push({ places, steep, away: places.reduce((sum, place) => sum + place[2], 0) });
  }
  seen.sort((one, other) => other.away - one.away);
  context.lineWidth = 1;
  context.strokeStyle = theme.grid;
  for (const { places, steep } of seen) {
    context.beginPath();
    for (const [x, y] of places) context.lineTo(x, y);
    context.closePath();
    context.fillStyle = mixed(theme.stage, theme.grid, 0.15 + 0.5 * steep);
    context.fill();
    context.globalAlpha = FLOOR_INK;
    context.stroke();
    context.globalAlpha = 1;
  }
}

/* Lines that fade out away from the middle of a panel: each step of them is of one shade, as hairlines of one
   colour are drawn several times faster than lines with a gradient along them. */
function drawFloor(context, view, ground, size, theme, ratio) {
  const { box, target } = view;
  const mesh = MESHES.find((each) => each > 0.2 * size) || MESHES[3];
  const widest = Math.min(2 * size, box.w / view.scale);
  const reach = Math.max(Math.ceil(widest / mesh), 3) * mesh;
  if (ground.heights) return drawField(context, view, ground, reach, theme);
  const lines = keptMesh(
    ground, Math.round(target[0] / mesh) * mesh, Math.round(target[2] / mesh) * mesh, reach, mesh);
  const shades = Array.from({ length: FADES + 1 }, () => new Path2D());
  const here = [0, 0, 0, 0], before = [0, 0, 0, 0];
  for (let i = 0, starts = false; i < lines.length;) {
    if (Number.isNaN(lines[i])) {
      starts = true;
      i++;
      continue;
    }
    view.project(lines[i], lines[i + 1], lines[i + 2], here, 0);
    if (!starts) {
      const far = Math.hypot((lines[i] + lines[i - 3]) / 2 - target[0], (lines[i + 2] + lines[i - 1]) / 2 - target[2]);
      const path = shades[Math.ceil(FADES * Math.min(Math.max((1 - far / reach) / 0.65, 0), 1))];
      path.moveTo(before[0], before[1]);
      path.lineTo(here[0], here[1]);
    }
    [before[0], before[1]] = here;
    starts = false;
    i += 3;
  }
  context.strokeStyle = theme.grid;
  context.lineWidth = 1 / ratio;
  for (let shade = 1; shade <= FADES; shade++) {
    context.globalAlpha = FLOOR_INK * (shade / FADES);
    context.stroke(shades[shade]);
  }
  context.globalAlpha = 1;
}

/* The shadow of a figure under a high sun, one shape so that limbs do not darken each other. */
function drawShadow(context, view, figure, ground, theme) {
  const { parents, radii, height } = figure.body;
  const { now } = figure;
  const out = [0, 0, 0, 0];
  const cast = (joint) => {
    const x = now[3 * joint], y = now[3 * joint + 1], z = now[3 * joint + 2];
    const up = Math.max(y - floorAt(ground, x, z), 0);
    const sx = x + 0.22 * up, sz = z - 0.3 * up;
    view.project(sx, floorAt(ground, sx, sz), sz, out, 0);
  };
  context.beginPath();
  for (let joint = 0; joint < parents.length; joint++) {
    if (parents[joint] < 0 || radii[2 * joint] < 12 * height) continue; // fingers cast none
    cast(parents[joint]);
    context.moveTo(out[0], out[1]);
    cast(joint);
    context.lineTo(out[0], out[1]);
  }
  context.strokeStyle = theme.shadow;
  context.lineWidth = Math.max(0.055 * height * view.scale, 1);
  context.lineCap = context.lineJoin = "round";
  context.stroke();
}

/* A circle that lies on the floor. */
function disc(context, view, x, y, z, radius) {
  const out = [0, 0, 0, 0];
  view.project(x, y, z, out, 0);
  const r = Math.max(radius * out[3], 1.5);
  const flat = Math.max(Math.abs(view.sp), 0.16);
  context.moveTo(out[0] + r, out[1]);
  context.ellipse(out[0], out[1], r, r * flat, 0, 0, 2 * Math.PI);
  return out;
}

/* Feet that stand (full), and feet that should and do not (rings). */
function drawContacts(context, view, figure, frame, ground, theme) {
  if (!figure.planted) return;
  const { contacts, planted, asked, now, body } = figure;
  const count = contacts.length;
  const radius = 0.034 * body.height;
  for (const full of [true, false]) {
    context.beginPath();
    for (let k = 0; k < count; k++) {
      const stands = planted[frame * count + k], should = asked ? asked[frame * count + k] : stands;
      if (full ? !stands : stands || !should) continue;
      const at = 3 * contacts[k];
      disc(context, view, now[at], floorAt(ground, now[at], now[at + 2]), now[at + 2], radius);
    }
    context.fillStyle = theme.contact;
    context.strokeStyle = full ? theme.contactEdge : theme.contact;
    context.lineWidth = full ? 1 : 2;
    if (full) context.fill();
    context.stroke();
  }
}

/* Ways of feet that glide while they should stand, and places where joints are below the floor. */
function drawFaults(context, view, figure, frame, back, ground, theme) {
  const { slides, sunk } = figure;
  const out = [0, 0, 0, 0];
  context.lineCap = "round";
  context.beginPath();
  for (const each of slides) {
    if (each.frame > frame || each.frame < frame - back) continue;
    view.project(each.x0, floorAt(ground, each.x0, each.z0), each.z0, out, 0);
    context.moveTo(out[0], out[1]);
    view.project(each.x1, floorAt(ground, each.x1, each.z1), each.z1, out, 0);
    context.lineTo(out[0], out[1]);
  }
  context.strokeStyle = theme.slide;
  context.lineWidth = Math.max(0.02 * figure.body.height * view.scale, 2);
  context.stroke();
  context.beginPath();
  for (let past = Math.max(frame - back, 0); past <= frame; past++) {
    for (const { joint, depth } of sunk[past]) {
      if (past < frame && past % 4) continue; // old marks are kept thinly
      const at = 3 * (past * figure.body.parents.length + joint);
      const x = figure.positions[at], z = figure.positions[at + 2];
      const y = floorAt(ground, x, z);
      const radius = (past < frame ? 0.3 : 1) * (0.02 * figure.body.height + depth);
      const [px, py, , k] = disc(context, view, x, y, z, radius);
      if (past < frame) continue;
      const r = Math.max(radius * k, 1.5);
      context.moveTo(px - r, py);
      context.lineTo(px + r, py);
      context.moveTo(px, py - r * Math.max(view.sp, 0.16));
      context.lineTo(px, py + r * Math.max(view.sp, 0.16));
    }
  }
  context.strokeStyle = theme.sunk;
  context.lineWidth = 1.6;
  context.stroke();
}
