/* One picture of all panels at a time of the scene. */

const TITLE = 40; // pixels above a figure, for its name and numbers

/* Colours of the picture, from the style sheet, so that they follow the scheme of the page. */
function themeOf(root) {
  const style = getComputedStyle(root);
  const names = ["stage", "stage-far", "band", "ink", "faint", "grid", "shadow", "contact", "contact-edge",
    "slide", "sunk", "line", "lit"];
  const theme = {};
  for (const name of names) {
    const key = name.replace(/-(.)/g, (_, letter) => letter.toUpperCase());
    theme[key] = style.getPropertyValue(`--rp-${name}`).trim();
  }
  theme.font = style.fontFamily;
  return theme;
}

/* Figures that people chose, in order; those without positions have a panel with their message. */
function chosen(player) {
  return player.scene.figures.filter((figure) => player.selected.has(figure.id));
}

/* [x, y, z]: the floor in the middle of where figures are. */
function middle(list, frame) {
  const at = [0, 0, 0];
  for (const { path } of list) {
    for (let axis = 0; axis < 3; axis++) at[axis] += path[3 * frame + axis] / list.length;
  }
  return at;
}

/* Metres that figures are from their middle, at most. */
function spread(player, list) {
  let far = 0;
  for (let frame = 0; frame < player.scene.frames; frame += 5) {
    const [x, , z] = middle(list, frame);
    for (const { path } of list) far = Math.max(far, Math.hypot(path[3 * frame] - x, path[3 * frame + 2] - z));
  }
  return far;
}

/* Those in one place that have to be seen: source, reference, and who stays near these. Whoever goes far away from
   them may leave the picture, so that the others are not tiny. */
function nearest(scene, list) {
  const lead = scene.lead;
  if (!lead) return list;
  const most = sizeOf(lead.reach);
  const stays = ({ path }) => {
    for (let i = 0; i < path.length; i += 3) {
      if (Math.hypot(path[i] - lead.path[i], path[i + 2] - lead.path[i + 2]) > most) return false;
    }
    return true;
  };
  const near = list.filter((figure) => figure.part !== "prediction" || stays(figure));
  return near.length ? near : list;
}

/* The panels of what is chosen: each a rectangle and the figures in it. Kept until something changes. */
function layout(player) {
  const { scene, show, width, height } = player;
  const list = chosen(player), shown = list.filter((figure) => figure.positions);
  const together = show.overlay && shown.length > 0;
  const groups = together ? [shown] : list.map((figure) => [figure]);
  const near = together ? nearest(scene, shown) : shown;
  const apart = Math.max(0, ...(together ? [near] : groups).map((group) => {
    const seen = group.filter((figure) => figure.positions);
    return seen.length ? spread(player, seen) : 0;
  }));
  const room = needed(together ? largest(near) : scene.reach, apart);
  const boxes = panels(groups.length, width, height, room.across, room.up * (1 + (2 * TITLE) / height));
  const rooms = groups.map(([figure]) =>
    together || !figure.positions ? room
      : needed(figure.body.reach, apart));
  const scales = rooms.map((each) => Math.min(boxes[0].w / each.across, (boxes[0].h - TITLE) / each.up));
  return { groups, near, boxes, rooms, scales, together, backdrop: backdrop(player, boxes), fitted: new Map(),
    missing: together ? list.filter((each) => !each.positions) : [] };
}

function sizeOf({ up, wide }) {
  return Math.max(up, 1.2 * wide);
}

/* Metres that have to fit into a panel, and the size of what is seen, which the eye keeps away from. */
function needed({ up, down, wide }, apart) {
  return {
    across: 2.05 * (wide + apart),
    up: 1.08 * up + down + 0.3 * wide + 0.35 * apart,
    size: sizeOf({ up, wide }),
    middle: 0.49 * up - 0.5 * down,
  };
}

function viewOf(player, plan, i, figures, frame) {
  const box = plan.boxes[i], room = plan.rooms[i];
  const [x, y, z] = middle(figures, frame);
  const shifted = { x: box.x, y: box.y + TITLE * 0.75, w: box.w, h: box.h - TITLE * 0.75 };
  return lens(player.camera, shifted, [x, y + room.middle, z], room.size, plan.scales[i]);
}

/* The colour of a piece: its figure's, that of feet that stand, or grey of what is no limb. */
function toneOf(player, figure, from, to) {
  if (player.show.contacts && rests(player, figure, from, to)) return player.theme.contact;
  if (figure.body.sides[to] === "h") return player.theme.grid;
  return player.colours[figure.id][figure.body.sides[to] === "r" ? 2 : 1];
}

function painter(player) {
  return ({ figure, from, to }, sideways, front) =>
    player.shade(toneOf(player, figure, from, to), sideways, front);
}

/* Whether a bone lies on a foot that stands: it begins there, or ends there and is the last one. */
function rests(player, figure, from, to) {
  if (!figure.planted) return false;
  const { contacts, planted, body } = figure;
  const frame = frameOf(player);
  const stands = (joint) => planted[frame * contacts.length + contacts.indexOf(joint)] === 1;
  if (contacts.includes(from)) return stands(from) || (contacts.includes(to) && stands(to));
  return contacts.includes(to) && !body.parents.includes(to) && stands(to);
}

/* What is seen in a panel now: in the middle of its figures. */
function seenIn(player, plan, place) {
  const group = plan.groups[place];
  return group[0].positions ? viewOf(player, plan, place, plan.together ? plan.near : group, frameOf(player)) : null;
}

function frameOf({ time, scene }) {
  return Math.min(Math.round(time), scene.frames - 1);
}

function drawPanel(player, plan, place) {
  const { context, scene, show, theme, ratio } = player;
  const frame = frameOf(player);
  const back = Math.round(scene.fps);
  const group = plan.groups[place], view = plan.seen[place];
  drawFloor(context, view, scene.ground, plan.rooms[place].size, theme, ratio);
  context.globalAlpha = 1 / Math.sqrt(group.length); // many shadows in one place are no hole
  for (const figure of group) drawShadow(context, view, figure, scene.ground, theme);
  context.globalAlpha = 1;
  for (const figure of show.contacts ? group : []) {
    drawFaults(context, view, figure, frame, back, scene.ground, theme);
    drawContacts(context, view, figure, frame, scene.ground, theme);
  }
  for (const figure of group) projected(figure, view);
  const part = plan.sheet && plan.sheet.parts[place];
  drawBodies(player, group, plan.together && group.length > 1 ? 0.55 : 1, plan.sheet, part);
}

/* What is behind all panels, and the lines between them: drawn once, and copied into every picture. */
function backdrop(player, boxes) {
  const { theme, ratio, width, height } = player;
  const made = document.createElement("canvas");
  made.width = player.canvas.width;
  made.height = player.canvas.height;
  const context = made.getContext("2d", { alpha: false });
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.fillStyle = theme.stage;
  context.fillRect(0, 0, width, height);
  for (const { x, y, w, h } of boxes) {
    const sky = context.createLinearGradient(0, y, 0, y + h);
    sky.addColorStop(0, theme.stageFar);
    sky.addColorStop(1, theme.stage);
    context.fillStyle = sky;
    context.fillRect(x, y, w, h);
    context.fillStyle = theme.line;
    if (x > 0) context.fillRect(Math.round(x), y, 1, h);
    if (y > 0) context.fillRect(x, Math.round(y), w, 1);
  }
  return made;
}

function drawStage(player) {
  const { context, scene, ratio, width, height } = player;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const plan = player.plan || (player.plan = layout(player));
  context.drawImage(plan.backdrop, 0, 0, width, height);
  for (const figure of scene.shown) placeAt(figure, player.time, scene.frames);
  plan.seen = plan.groups.map((_, place) => seenIn(player, plan, place));
  plotSkins(player, plan);
  const frame = frameOf(player);
  plan.boxes.forEach((box, i) => {
    const group = plan.groups[i];
    context.save();
    context.beginPath();
    context.rect(box.x, box.y, box.w, box.h);
    context.clip();
    if (group[0].positions) drawPanel(player, plan, i);
    else drawMessage(player, box, group[0].message || `This figure is ${group[0].status}.`);
    const all = [...group, ...plan.missing];
    if (all.length > 1) drawTitles(player, box, all, frame);
    else drawTitle(player, box, all[0], frame);
    context.restore();
  });
  if (!plan.boxes.length) drawMessage(player, { x: 0, y: 0, w: width, h: height }, "No figure is chosen.");
}
