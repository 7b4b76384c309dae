/* Bodies as solid, shaded bones, the far ones first. */

const LIGHT = [-0.48, 0.62, 0.62]; // from the upper left, behind the eye
const AMBIENT = 0.46, DIFFUSE = 0.72, LEVELS = 8;
const RIGHT_DIMMED = 0.8; // the right side is darker, so that sides can be told apart

function rgb(hex) {
  return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
}

function mixed(hex, other, share) {
  const a = rgb(hex), b = rgb(other);
  return "#" + a.map((v, i) => Math.round(v + (b[i] - v) * share).toString(16).padStart(2, "0")).join("");
}

function luminance(hex) {
  const linear = rgb(hex).map((v) => (v <= 10 ? v / 3295 : ((v / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
}

/* A colour that stands out from the paper, by so much contrast. */
function readable(hex, paper, contrast) {
  const towards = luminance(paper) > 0.18 ? "#000000" : "#ffffff";
  for (let share = 0; share <= 1; share += 0.05) {
    const tried = mixed(hex, towards, share);
    const lights = [luminance(tried), luminance(paper)].map((l) => l + 0.05);
    if (Math.max(...lights) / Math.min(...lights) >= contrast) return tried;
  }
  return towards;
}

/* A colour in a light of 1, or darker or brighter. */
function lit(hex, bright) {
  return bright <= 1 ? mixed("#000000", hex, bright) : mixed(hex, "#ffffff", Math.min((bright - 1) * 1.6, 0.6));
}

/* Across a round bone, from one edge to the other, where the light falls from a (sideways) and b (front). */
function shading(context, hex, a, b) {
  const gradient = context.createLinearGradient(0, -1, 0, 1);
  for (let stop = 0; stop <= 6; stop++) {
    const y = stop / 3 - 1, front = Math.sqrt(Math.max(1 - y * y, 0));
    const bright = (AMBIENT + DIFFUSE * Math.max(y * a + front * b, 0)) * (0.72 + 0.28 * front);
    gradient.addColorStop(stop / 6, lit(hex, bright));
  }
  return gradient;
}

/* Shadings that are made once: they lie in the bone's own frame, which the canvas is turned into. */
function shades(context) {
  const made = new Map();
  return (hex, a, b) => {
    let ofColour = made.get(hex);
    if (!ofColour) made.set(hex, (ofColour = []));
    const i = Math.round((a + 1) * LEVELS), j = Math.round((b + 1) * LEVELS);
    const at = i * (2 * LEVELS + 1) + j;
    return ofColour[at] || (ofColour[at] = shading(context, hex, i / LEVELS - 1, j / LEVELS - 1));
  };
}

/* The outline of a bone from (0, 0) to (length, 0) that is as thick as a at one end and as b at the other. */
function tapered(context, length, a, b) {
  if (length <= Math.abs(a - b)) {
    context.moveTo(a > b ? a : length + b, 0);
    context.arc(a > b ? 0 : length, 0, Math.max(a, b), 0, 2 * Math.PI);
    return;
  }
  const turn = Math.acos((a - b) / length);
  context.moveTo(a * Math.cos(turn), a * Math.sin(turn));
  context.arc(0, 0, a, turn, 2 * Math.PI - turn);
  context.arc(length, 0, b, -turn, turn);
  context.closePath();
}

/* All joints of a figure on the screen: four numbers each, see lens.project. */
function projected(figure, view) {
  const { now, screen } = figure;
  for (let joint = 0, p = 0; p < now.length; joint++, p += 3) {
    view.project(now[p], now[p + 1], now[p + 2], screen, joint * 4);
  }
}

const PLACE = {}; // of the piece that is drawn
const DOT = 40; // millimetres: radius of a body that is one joint
const HEAD = { before: 0.55, long: 0.75, narrow: 0.86 }; // in its radii: from joint to ball, to the other ball, its size

/* Metres that bones go beyond each joint, on any side of it. */
function thickness({ parents, radii, heads }) {
  const found = new Float32Array(parents.length);
  const thicken = (joint, radius) => (found[joint] = Math.max(found[joint], radius / 1000));
  if (parents.length === 1) thicken(0, DOT);
  parents.forEach((parent, joint) => {
    if (parent < 0 || !radii[2 * joint]) return;
    thicken(parent, radii[2 * joint]);
    thicken(joint, radii[2 * joint + 1]);
  });
  for (const [joint, , radius] of heads) thicken(joint, (HEAD.before + HEAD.long + HEAD.narrow) * radius);
  return found;
}

/* Bones and heads of a figure as things to be drawn: how far they are, and how. */
function pieces(figure, thin, found) {
  const { parents, heads, radii } = figure.body;
  if (parents.length === 1) found.push({ away: figure.screen[2], figure, from: 0, to: 0, a: DOT, b: DOT });
  for (let joint = 0; joint < parents.length; joint++) {
    const parent = parents[joint];
    if (parent < 0 || !radii[2 * joint]) continue;
    const away = (figure.screen[4 * joint + 2] + figure.screen[4 * parent + 2]) / 2;
    found.push({ away, figure, from: parent, to: joint, a: radii[2 * joint] * thin, b: radii[2 * joint + 1] * thin });
  }
  for (const [joint, below, radius] of heads) {
    const away = figure.screen[4 * joint + 2];
    found.push({ away, figure, from: joint, to: joint, below, a: radius * thin, b: radius * thin });
  }
}

/* Where a piece begins on the screen, which way it goes, how long and how thick it is, in pixels. */
function placed(piece, out) {
  const { screen } = piece.figure;
  const from = 4 * piece.from, to = 4 * piece.to;
  out.a = Math.max(piece.a * 0.001 * screen[from + 3], 0.8);
  out.b = Math.max(piece.b * 0.001 * screen[to + 3], 0.8);
  out.x = screen[from];
  out.y = screen[from + 1];
  let dx = screen[to] - out.x, dy = screen[to + 1] - out.y;
  let deep = (screen[from + 2] - screen[to + 2]) * screen[to + 3];
  if (piece.below !== undefined) { // a head goes on in the direction of the neck
    const below = 4 * piece.below;
    dx = out.x - screen[below];
    dy = out.y - screen[below + 1];
    deep = (screen[below + 2] - screen[from + 2]) * screen[from + 3];
    const share = out.a / (Math.hypot(dx, dy, deep) || 1);
    out.x += HEAD.before * dx * share;
    out.y += HEAD.before * dy * share;
    dx *= HEAD.long * share;
    dy *= HEAD.long * share;
    deep *= HEAD.long * share;
    out.b *= HEAD.narrow;
  }
  out.length = Math.hypot(dx, dy);
  out.cos = out.length > 1e-6 ? dx / out.length : 1;
  out.sin = out.length > 1e-6 ? dy / out.length : 0;
  out.tilt = deep / (Math.hypot(out.length, deep) || 1);
  return out;
}

/* One bone. Draws in pixels of the canvas, whose scale is ratio, and leaves the bone's frame behind. */
function drawPiece(context, ratio, piece, paint) {
  const { a, b, x, y, length, cos, sin, tilt } = placed(piece, PLACE);
  const thick = Math.max(a, b);
  const level = Math.sqrt(Math.max(1 - tilt * tilt, 0));
  const sideways = -sin * LIGHT[0] - cos * LIGHT[1]; // the screen's y points down
  const front = level * LIGHT[2] - tilt * (cos * LIGHT[0] - sin * LIGHT[1]);
  const scale = ratio * thick;
  context.setTransform(cos * scale, sin * scale, -sin * scale, cos * scale, x * ratio, y * ratio);
  context.fillStyle = paint(piece, sideways, front);
  context.beginPath();
  tapered(context, length / thick, a / thick, b / thick);
  context.fill();
}

/* Bodies of one panel, far pieces first; sheet, part: where their skins are, if any wears one. */
function drawBodies(player, list, thin, sheet, part) {
  const { context, ratio, paint } = player;
  const all = [];
  for (const figure of list) if (!wears(player, figure)) pieces(figure, thin, all);
  all.sort((one, other) => other.away - one.away);
  const draw = (some) => {
    for (const piece of some) drawPiece(context, ratio, piece, paint);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
  };
  if (!part) return draw(all);
  draw(all.filter((piece) => behind(piece, sheet, part)));
  drawSkins(context, sheet, part);
  draw(all.filter((piece) => !behind(piece, sheet, part)));
}

