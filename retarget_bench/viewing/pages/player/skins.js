/* Skins: triangles that follow the joints by linear blend skinning, flat in the light, the far ones first. */

const FOLLOWED = 4; // joints that a corner follows
const WHOLE = 1023; // what its shares sum to
const TONES = 20; // shades of a colour
const OVER = 0.5; // pixels by which triangles are larger, so that nothing shines through between them

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
  return { joints, corners, rest, faces: found, followed, shares, over: Math.max(highest(corners) - highest(rest), 0) };
}

/* The largest y of [place][xyz]. */
function highest(places) {
  return places.reduce((most, value, i) => (i % 3 === 1 ? Math.max(most, value) : most), -Infinity);
}

function wears(player, figure) {
  return player.show.skins && figure.turns !== null;
}

/* Room for figures that reach so high and wide by their joints: heads of skins are above them. */
function reachOf(player, figures, { up, wide }) {
  return { up: up + Math.max(0, ...figures.map((each) => (wears(player, each) ? each.body.skin.over : 0))), wide };
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

/* Corners of a figure's skin at a time between frames, [vertex][xyz] metres. */
function surfaceAt(figure, time, frames) {
  const { corners, followed, shares } = figure.body.skin;
  if (!figure.now) figure.now = new Float32Array(3 * figure.body.parents.length);
  placeAt(figure, time, frames);
  const bound = bindings(figure, time, frames);
  const out = figure.surface || (figure.surface = new Float32Array(corners.length));
  for (let v = 0, at = 0; v < corners.length; v += 3, at += FOLLOWED) {
    const x = corners[v], y = corners[v + 1], z = corners[v + 2];
    let a = 0, b = 0, c = 0;
    for (let k = at; k < at + FOLLOWED; k++) {
      const share = shares[k], m = 12 * followed[k];
      if (share === 0) continue;
      a += share * (bound[m] * x + bound[m + 1] * y + bound[m + 2] * z + bound[m + 3]);
      b += share * (bound[m + 4] * x + bound[m + 5] * y + bound[m + 6] * z + bound[m + 7]);
      c += share * (bound[m + 8] * x + bound[m + 9] * y + bound[m + 10] * z + bound[m + 11]);
    }
    out[v] = a, out[v + 1] = b, out[v + 2] = c;
  }
  return out;
}

/* Colours as they are at so much light, 0 to TONES, each made once. */
function flats() {
  const made = new Map();
  return (hex) => {
    if (!made.has(hex)) {
      made.set(hex, Array.from({ length: TONES + 1 }, (_, i) => lit(hex, AMBIENT + (DIFFUSE * i) / TONES)));
    }
    return made.get(hex);
  };
}

/* LIGHT, which is told from the eye, in the world. */
function lightOf({ cy, sy, cp, sp }) {
  const [x, y, z] = LIGHT;
  return [x * cy - y * sp * sy + z * cp * sy, y * cp + z * sp, -x * sy - y * sp * cy + z * cp * cy];
}

/* Towards where the surface looks at each corner, longer where its faces are larger: faces take their light
   from there, so that slivers among them do not glitter. */
function normalsOf(figure, faces, surface) {
  const out = figure.normals || (figure.normals = new Float32Array(surface.length));
  out.fill(0);
  for (let face = 0; face < faces.length; face += 3) {
    const i = 3 * faces[face], j = 3 * faces[face + 1], k = 3 * faces[face + 2];
    const ax = surface[j] - surface[i], ay = surface[j + 1] - surface[i + 1], az = surface[j + 2] - surface[i + 2];
    const bx = surface[k] - surface[i], by = surface[k + 1] - surface[i + 1], bz = surface[k + 2] - surface[i + 2];
    const x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
    for (const at of [i, j, k]) out[at] += x, out[at + 1] += y, out[at + 2] += z;
  }
  return out;
}

/* How bright a face is, 0 to TONES. */
function toneAt(normals, i, j, k, light) {
  let share = 0, square = 0;
  for (let axis = 0; axis < 3; axis++) {
    const side = normals[i + axis] + normals[j + axis] + normals[k + axis];
    share += side * light[axis];
    square += side * side;
  }
  return Math.round(TONES * Math.max(share / (Math.sqrt(square) || 1), 0));
}

/* Faces that look towards the eye: their corners on the screen, how far they are, and their colours. */
function seenFaces(player, figure, view, found) {
  const { skin } = figure.body, { faces, followed, joints } = skin;
  const surface = surfaceAt(figure, player.time, player.scene.frames);
  const screen = figure.onScreen || (figure.onScreen = new Float32Array((4 * surface.length) / 3));
  for (let v = 0, p = 0; v < surface.length; v += 3, p += 4) {
    view.project(surface[v], surface[v + 1], surface[v + 2], screen, p);
  }
  const light = lightOf(view), normals = normalsOf(figure, faces, surface);
  const colours = joints.map((joint) => player.flat(toneOf(player, figure, joint, joint)));
  for (let i = 0; i < faces.length; i += 3) {
    const a = 4 * faces[i], b = 4 * faces[i + 1], c = 4 * faces[i + 2];
    const turn = (screen[b] - screen[a]) * (screen[c + 1] - screen[a + 1])
      - (screen[c] - screen[a]) * (screen[b + 1] - screen[a + 1]);
    if (turn >= 0) continue; // it looks away: the screen's y points down
    const tone = toneAt(normals, 3 * faces[i], 3 * faces[i + 1], 3 * faces[i + 2], light);
    const colour = colours[followed[FOLLOWED * faces[i]]][tone];
    found.push({ away: (screen[a + 2] + screen[b + 2] + screen[c + 2]) / 3, screen, a, b, c, colour });
  }
}

/* A corner, so much farther from the middle of its face. */
function corner(context, screen, at, x, y, first) {
  const dx = screen[at] - x, dy = screen[at + 1] - y;
  const more = 1 + OVER / Math.max(Math.hypot(dx, dy), OVER);
  if (first) context.moveTo(x + dx * more, y + dy * more);
  else context.lineTo(x + dx * more, y + dy * more);
}

/* Skins of one panel, and the bones of those that wear none. Neighbours of one colour are one shape. */
function drawSkins(player, list, views, bones) {
  const { context, ratio, paint } = player;
  const all = bones;
  list.forEach((figure, i) => wears(player, figure) && seenFaces(player, figure, views[i], all));
  all.sort((one, other) => other.away - one.away);
  let colour = null;
  const filled = () => {
    if (colour !== null) context.fill();
    colour = null;
  };
  for (const each of all) {
    if (each.figure) {
      filled();
      drawPiece(context, ratio, each, paint);
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      continue;
    }
    if (each.colour !== colour) {
      filled();
      context.fillStyle = colour = each.colour;
      context.beginPath();
    }
    const { screen, a, b, c } = each;
    const x = (screen[a] + screen[b] + screen[c]) / 3, y = (screen[a + 1] + screen[b + 1] + screen[c + 1]) / 3;
    corner(context, screen, a, x, y, true);
    corner(context, screen, b, x, y, false);
    corner(context, screen, c, x, y, false);
    context.closePath();
  }
  filled();
}
