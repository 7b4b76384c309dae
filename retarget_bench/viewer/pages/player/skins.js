/* Skins: triangles that follow the joints by linear blend skinning, smooth in the light. */

const FOLLOWED = 4; // joints that a corner follows
const WHOLE = 1023; // what its shares sum to

/* Corners [vertex][xyz] and joints [joint][xyz] of the skin's own pose, metres; faces [face][3]; per corner the
   places among the joints of those that it follows, [vertex][4], and their shares, which sum to 1. */
function readSkin(next, told, step) {
  const { vertices, faces, joints } = told;
  const corners = series(next, 3, vertices, step, new Float32Array(3 * vertices));
  const rest = series(next, 3, joints.length, step, new Float32Array(3 * joints.length));
  const found = new Uint32Array(3 * faces);
  for (let i = 0, had = 0; i < found.length; i++) {
    found[i] = had - next();
    if (found[i] === had) had++;
  }
  const followed = new Uint16Array(FOLLOWED * vertices), shares = new Float32Array(FOLLOWED * vertices).fill(0);
  for (let k = 0; k < FOLLOWED; k++) for (let v = 0; v < vertices; v++) followed[FOLLOWED * v + k] = next();
  for (let v = 0; v < vertices; v++) shares[FOLLOWED * v] = 1;
  for (let k = 1; k < FOLLOWED; k++) {
    for (let v = 0; v < vertices; v++) {
      shares[FOLLOWED * v + k] = next() / WHOLE;
      shares[FOLLOWED * v] -= shares[FOLLOWED * v + k];
    }
  }
  return { joints, corners, rest, faces: found, followed, shares, normals: normalsOf(corners, found),
    over: Math.max(highest(corners) - highest(rest), 0), around: around(joints, corners, rest, followed) };
}

/* Joint of the body -> how far away the farthest corner is that follows it most. */
function around(joints, corners, rest, followed) {
  const found = new Map();
  for (let v = 0; v < corners.length / 3; v++) {
    const place = followed[FOLLOWED * v], joint = joints[place];
    const [x, y, z] = [0, 1, 2].map((axis) => corners[3 * v + axis] - rest[3 * place + axis]);
    found.set(joint, Math.max(found.get(joint) || 0, Math.hypot(x, y, z)));
  }
  return found;
}

/* Where the surface looks at each corner, [vertex][xyz] of length 1: the mean of its faces, the larger the more. */
function normalsOf(corners, faces) {
  const out = new Float32Array(corners.length);
  for (let face = 0; face < faces.length; face += 3) {
    const [i, j, k] = [3 * faces[face], 3 * faces[face + 1], 3 * faces[face + 2]];
    const [a, b] = [j, k].map((to) => [0, 1, 2].map((axis) => corners[to + axis] - corners[i + axis]));
    const across = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    for (const at of [i, j, k]) across.forEach((value, axis) => (out[at + axis] += value));
  }
  for (let at = 0; at < out.length; at += 3) {
    const length = Math.hypot(out[at], out[at + 1], out[at + 2]) || 1;
    for (let axis = 0; axis < 3; axis++) out[at + axis] /= length;
  }
  return out;
}

/* The largest y of [place][xyz]. */
function highest(places) {
  return places.reduce((most, value, i) => (i % 3 === 1 ? Math.max(most, value) : most), -Infinity);
}

function wears(player, figure) {
  return player.show.skins && hasSkin(figure);
}

function hasSkin(figure) {
  return figure.turns !== null || figure.moved !== null;
}

/* The corners of a figure's skin that are inside its body now, as far as that is known; null where none is. */
function litNow(player, figure) {
  return (player.show.lit && wears(player, figure) && figure.inside.get(frameOf(player))) || null;
}

/* Asks which corners are inside the body in the frame that is looked at: one figure at a time, each frame once. */
function lookInside(player) {
  const { options, show, scene } = player, frame = frameOf(player);
  const open = (figure) => wears(player, figure) && !figure.inside.has(frame);
  const figure = options.inside && show.lit && !player.looking && chosen(player).find(open);
  player.search.hidden = !figure && !player.looking;
  if (!figure) return;
  player.looking = true;
  const known = (corners) => {
    const now = new Uint8Array(figure.body.skin.corners.length / 3);
    for (const corner of corners) now[corner] = 1;
    figure.inside.set(frame, corners.length ? now : null);
  };
  options.inside(scene.figures.indexOf(figure), frame).then(known, () => known([])).then(() => {
    player.looking = false;
    redraw(player);
  });
}

/* Room for figures that reach so high and wide by their joints: heads of skins are above them, snouts before them. */
function reachOf(player, figures, { up, down, wide, worn }) {
  const over = figures.filter((each) => wears(player, each)).map((each) => each.body.skin.over);
  return { up: up + Math.max(0, ...over), down, wide: over.length ? worn : wide };
}

/* What takes each joint of a skin from its own pose to that at a time: three rows of four numbers each. */
function bindings(figure, time, frames) {
  const { skin } = figure.body, { turns, now } = figure, count = skin.joints.length;
  const out = figure.bound || (figure.bound = new Float32Array(12 * count));
  const frame = Math.min(Math.floor(time), frames - 1), next = Math.min(frame + 1, frames - 1);
  for (let j = 0; j < count; j++) {
    const at = 4 * (frame * count + j), to = 4 * (next * count + j);
    const between = (i) => turns[at + i] + (turns[to + i] - turns[at + i]) * (time - frame);
    let w = between(0), x = between(1), y = between(2), z = between(3);
    const s = 1 / (Math.hypot(w, x, y, z) || 1);
    w *= s, x *= s, y *= s, z *= s;
    const rows = [
      1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];
    for (let row = 0; row < 3; row++) {
      const [a, b, c] = rows.slice(3 * row, 3 * row + 3), m = 12 * j + 4 * row;
      out[m] = a, out[m + 1] = b, out[m + 2] = c;
      out[m + 3] = now[3 * skin.joints[j] + row]
        - a * skin.rest[3 * j] - b * skin.rest[3 * j + 1] - c * skin.rest[3 * j + 2];
    }
  }
  return out;
}

/* Corners of a skin by what takes each of its joints somewhere: out[vertex][xyz]. */
function blended({ corners, followed, shares }, bound, out) {
  for (let v = 0, at = 0; v < corners.length; v += 3, at += FOLLOWED) {
    const x = corners[v], y = corners[v + 1], z = corners[v + 2];
    let a = 0, b = 0, c = 0;
    for (let k = at; k < at + FOLLOWED; k++) {
      const share = shares[k], m = 12 * followed[k];
      if (share === 0) break; // they fall
      a += share * (bound[m] * x + bound[m + 1] * y + bound[m + 2] * z + bound[m + 3]);
      b += share * (bound[m + 4] * x + bound[m + 5] * y + bound[m + 6] * z + bound[m + 7]);
      c += share * (bound[m + 8] * x + bound[m + 9] * y + bound[m + 10] * z + bound[m + 11]);
    }
    out[v] = a, out[v + 1] = b, out[v + 2] = c;
  }
  return out;
}

/* Corners of a figure's skin at a time between frames, [vertex][xyz] metres. */
function surfaceAt(figure, time, frames) {
  const { skin, parents } = figure.body;
  if (figure.moved) return movedAt(figure, time, frames, new Float32Array(skin.corners.length));
  if (!figure.now) figure.now = new Float32Array(3 * parents.length);
  placeAt(figure, time, frames);
  return blended(skin, bindings(figure, time, frames), new Float32Array(skin.corners.length));
}

/* The same of a figure that moves by no skeleton. */
function movedAt({ moved }, time, frames, out) {
  const frame = Math.min(Math.floor(time), frames - 1), next = Math.min(frame + 1, frames - 1), share = time - frame;
  for (let i = 0, a = frame * out.length, b = next * out.length; i < out.length; i++, a++, b++) {
    out[i] = moved[a] + (moved[b] - moved[a]) * share;
  }
  return out;
}

/* The same for the eye, and how bright it is at each corner, into the fourth of tones[vertex]. */
function movedTo({ target, cy, sy, cp, sp }, surface, faces, tones) {
  const axes = [[cy, 0, -sy], [-sy * sp, cp, -cy * sp], [sy * cp, sp, cy * cp]];
  for (let i = 0; i < surface.length; i += 3) {
    const [x, y, z] = [surface[i] - target[0], surface[i + 1] - target[1], surface[i + 2] - target[2]];
    axes.forEach((axis, row) => (surface[i + row] = axis[0] * x + axis[1] * y + axis[2] * z));
  }
  const normals = normalsOf(surface, faces);
  for (let i = 0, n = 0; n < normals.length; i++, n += 3) {
    const bright = normals[n] * LIGHT[0] + normals[n + 1] * LIGHT[1] + normals[n + 2] * LIGHT[2];
    tones[4 * i + 3] = TONES * Math.min(Math.max(bright, 0), 1);
  }
  return surface;
}

/* Corners of a skin that bones move, for the eye, and their tones likewise. */
function followedTo(player, figure, view, tones) {
  const bound = turnedTo(view, bindings(figure, player.time, player.scene.frames));
  toned(figure.body.skin, bound, tones);
  return blended(figure.body.skin, bound, figure.surface);
}

/* The same for the eye: to its right, up, and towards it from the middle of what it sees, metres. */
function turnedTo({ target, cy, sy, cp, sp }, bound) {
  const axes = [[cy, 0, -sy], [-sy * sp, cp, -cy * sp], [sy * cp, sp, cy * cp]];
  for (let m = 0; m < bound.length; m += 12) {
    for (let row = 0; row < 3; row++) bound[m + 4 * row + 3] -= target[row];
    for (let column = 0; column < 4; column++) {
      const x = bound[m + column], y = bound[m + 4 + column], z = bound[m + 8 + column];
      axes.forEach((axis, row) => (bound[m + 4 * row + column] = axis[0] * x + axis[1] * y + axis[2] * z));
    }
  }
  return bound;
}

/* How bright a skin is at each corner, 0 to TONES, into the fourth of out[vertex]; bound: for the eye. */
function toned({ normals, followed, shares, joints }, bound, out) {
  const light = new Float32Array(3 * joints.length); // of each joint, as its skin's own pose sees it
  for (let j = 0; j < joints.length; j++) {
    for (let axis = 0, m = 12 * j; axis < 3; axis++, m++) {
      light[3 * j + axis] = bound[m] * LIGHT[0] + bound[m + 4] * LIGHT[1] + bound[m + 8] * LIGHT[2];
    }
  }
  for (let i = 0, v = 0, at = 0; v < normals.length; i++, v += 3, at += FOLLOWED) {
    let share = 0;
    for (let k = at; k < at + FOLLOWED; k++) {
      const l = 3 * followed[k];
      if (shares[k] === 0) break;
      share += shares[k] * (normals[v] * light[l] + normals[v + 1] * light[l + 1] + normals[v + 2] * light[l + 2]);
    }
    out[4 * i + 3] = TONES * Math.min(Math.max(share, 0), 1);
  }
}

/* Corners of a figure on a sheet, [vertex][x, y, nearness, tone]: nearness in pixels per metre. */
function cornersOn(player, figure, view, fine) {
  const { faces, corners } = figure.body.skin;
  if (!figure.onSheet) {
    Object.assign(figure, { surface: new Float32Array(corners.length), onSheet: new Float32Array((4 * corners.length) / 3) });
  }
  const out = figure.onSheet;
  const surface = figure.moved
    ? movedTo(view, movedAt(figure, player.time, player.scene.frames, figure.surface), faces, out)
    : followedTo(player, figure, view, out);
  for (let i = 0; 3 * i < surface.length; i++) {
    const near = view.strength / Math.max(view.eye - surface[3 * i + 2], 0.05 * view.eye);
    out[4 * i] = fine * (view.middleX + surface[3 * i] * near);
    out[4 * i + 1] = fine * (view.middleY - surface[3 * i + 1] * near);
    out[4 * i + 2] = near;
  }
  return out;
}

/* The faces of a figure that look towards the eye. */
function fillSkin(player, sheet, part, figure) {
  const { body: { skin: { joints, faces, followed } }, onSheet: at } = figure;
  const colours = joints.map((joint) => player.ink(toneOf(player, figure, joint, joint)));
  for (let i = 0; i < faces.length; i += 3) {
    const a = 4 * faces[i], b = 4 * faces[i + 1], c = 4 * faces[i + 2];
    const turn = (at[b] - at[a]) * (at[c + 1] - at[a + 1]) - (at[c] - at[a]) * (at[b + 1] - at[a + 1]);
    if (turn < 0) fill(sheet, part, colours[followed[FOLLOWED * faces[i]]], at, a, b, c); // the screen's y points down
  }
}

const OVER = 1e6; // pixels per metre: nearer than all that is not lit
const STRIPES = 9, DARK = 3; // pixels of the sheet from one stripe to the next, and those that are dark
const STRIPE = 0xff141414;

/* Flesh inside flesh, over all that hides it, striped. */
function fillLit(player, sheet, part, figure, now) {
  const { body: { skin: { faces } }, onSheet: at } = figure;
  const ink = player.ink(player.theme.lit), over = at.slice();
  for (let i = 2; i < over.length; i += 4) over[i] += OVER;
  for (let i = 0; i < faces.length; i += 3) {
    if (!now[faces[i]] && !now[faces[i + 1]] && !now[faces[i + 2]]) continue;
    const a = 4 * faces[i], b = 4 * faces[i + 1], c = 4 * faces[i + 2];
    const turn = (at[b] - at[a]) * (at[c + 1] - at[a + 1]) - (at[c] - at[a]) * (at[b + 1] - at[a + 1]);
    if (turn < 0) fill(sheet, part, ink, over, a, b, c);
  }
}

/* Stripes on what is lit: it is told without its colour, too. */
function stripe({ inks: pixels, depths }, { left, top, right, bottom, wide, start }) {
  for (let y = top; y < bottom; y++) {
    for (let x = left, at = start + y * wide + left; x < right; x++, at++) {
      if (depths[at] > OVER / 2 && (x + y) % STRIPES < DARK) pixels[at] = STRIPE;
    }
  }
}

/* All skins of all panels, on the sheet. It is written before any of it is copied to the canvas, since a browser
   would keep what it was for every copy that it has not made yet. */
function plotSkins(player, plan) {
  const drawn = (figure) => wears(player, figure);
  if (plan.sheet) plan.sheet.parts = [];
  if (!plan.groups.flat().some(drawn)) return;
  const sheet = plan.sheet || (plan.sheet = newSheet(player.width, player.height));
  sheet.used = 0;
  sheet.parts = plan.groups.map((group, place) => {
    let wanted = null;
    const clad = group.filter(drawn);
    for (const figure of clad) {
      const corners = cornersOn(player, figure, plan.seen[place], sheet.fine);
      wanted = joined(wanted, covered(corners, plan.boxes[place], sheet.fine));
    }
    if (!wanted) return null;
    const part = blank(sheet, wanted);
    for (const figure of clad) fillSkin(player, sheet, part, figure);
    const striped = clad.filter((figure) => litNow(player, figure));
    for (const figure of striped) fillLit(player, sheet, part, figure, litNow(player, figure));
    if (striped.length) stripe(sheet, part);
    return part;
  });
  for (const part of sheet.parts) if (part) put(sheet, part);
}

/* The skins of one panel, as they are on the sheet. */
function drawSkins(context, { canvas, fine }, { left, top, wide, bottom }) {
  const high = bottom - top;
  context.drawImage(canvas, left, top, wide, high, left / fine, top / fine, wide / fine, high / fine);
}

/* Whether a bone is behind the skins of its panel, by its middle. */
function behind({ figure: { screen }, from, to }, { depths, fine }, { left, top, right, bottom, wide, start }) {
  const half = (i) => (screen[4 * from + i] + screen[4 * to + i]) / 2;
  const x = Math.floor(fine * half(0)), y = Math.floor(fine * half(1));
  return x >= left && x < right && y >= top && y < bottom && depths[start + y * wide + x] > half(3);
}
