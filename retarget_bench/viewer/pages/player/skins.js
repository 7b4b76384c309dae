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
  return { joints, corners, rest, faces: found, followed, shares, around: around(joints, corners, rest, followed) };
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

/* Where the surface looks at each corner, [vertex][xyz]: the mean of its faces, the larger the more. */
function normalsOf(corners, faces, out) {
  out.fill(0);
  for (let face = 0; face < faces.length; face += 3) {
    const i = 3 * faces[face], j = 3 * faces[face + 1], k = 3 * faces[face + 2];
    const ax = corners[j] - corners[i], ay = corners[j + 1] - corners[i + 1], az = corners[j + 2] - corners[i + 2];
    const bx = corners[k] - corners[i], by = corners[k + 1] - corners[i + 1], bz = corners[k + 2] - corners[i + 2];
    const x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
    out[i] += x, out[i + 1] += y, out[i + 2] += z;
    out[j] += x, out[j + 1] += y, out[j + 2] += z;
    out[k] += x, out[k + 1] += y, out[k + 2] += z;
  }
  return out;
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
  if (!figure.now) figure.now = new Float32Array(3 * parents.length);
  placeAt(figure, time, frames);
  return cornersAt(figure, time, frames, new Float32Array(skin.corners.length));
}

/* The same into out, of a figure whose joints are placed. */
function cornersAt(figure, time, frames, out) {
  if (!figure.moved) return blended(figure.body.skin, bindings(figure, time, frames), out);
  const { moved } = figure;
  const frame = Math.min(Math.floor(time), frames - 1), next = Math.min(frame + 1, frames - 1), share = time - frame;
  for (let i = 0, a = frame * out.length, b = next * out.length; i < out.length; i++, a++, b++) {
    out[i] = moved[a] + (moved[b] - moved[a]) * share;
  }
  return out;
}

/* A surface for the eye: to its right, up, and towards it from the middle of what it sees, metres; and how bright
   it is at each corner, 0 to TONES, into the fourth of tones[vertex]. */
function turnedTo({ target, cy, sy, cp, sp }, surface, faces, normals, tones) {
  for (let i = 0; i < surface.length; i += 3) {
    const x = surface[i] - target[0], y = surface[i + 1] - target[1], z = surface[i + 2] - target[2];
    const back = x * sy + z * cy;
    surface[i] = cy * x - sy * z;
    surface[i + 1] = cp * y - sp * back;
    surface[i + 2] = sp * y + cp * back;
  }
  normalsOf(surface, faces, normals);
  for (let i = 0, n = 0; n < normals.length; i++, n += 3) {
    const x = normals[n], y = normals[n + 1], z = normals[n + 2];
    const bright = (x * LIGHT[0] + y * LIGHT[1] + z * LIGHT[2]) / (Math.hypot(x, y, z) || 1);
    tones[4 * i + 3] = TONES * Math.min(Math.max(bright, 0), 1);
  }
}

/* Corners of a figure on a sheet, [vertex][x, y, nearness, tone]: nearness in pixels per metre. */
function cornersOn(player, figure, view, fine) {
  const { faces, corners } = figure.body.skin, count = corners.length;
  if (!figure.onSheet) {
    const [surface, normals, onSheet] = [count, count, (4 * count) / 3].map((size) => new Float32Array(size));
    Object.assign(figure, { surface, normals, onSheet });
  }
  const { surface, normals, onSheet: out } = figure;
  cornersAt(figure, player.time, player.scene.frames, surface);
  turnedTo(view, surface, faces, normals, out);
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
