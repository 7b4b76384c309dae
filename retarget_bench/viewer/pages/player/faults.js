/* What is known before anything is drawn: sizes, paths, labels of contacts, slides, depths. */

const SUNK = 0.01; // metres below the floor that are no fault
const SLIDE = 0.001; // of the height per frame of 30 a second: slower feet rest

/* The floor below a figure's root, [frame][xyz], smoothed over a second so that the view does not shake. */
function smoothPath(figure, frames, fps, ground) {
  const joints = figure.body.parents.length, half = Math.max(Math.round(fps / 2), 1);
  const path = new Float32Array(frames * 3);
  const value = (frame, axis) => {
    const at = Math.min(Math.max(frame, 0), frames - 1) * joints * 3;
    const { positions } = figure;
    return axis === 1 ? floorAt(ground, positions[at], positions[at + 2]) : positions[at + axis];
  };
  for (let axis = 0; axis < 3; axis++) {
    let sum = 0;
    for (let frame = -half; frame <= half; frame++) sum += value(frame, axis);
    for (let frame = 0; frame < frames; frame++) {
      path[3 * frame + axis] = sum / (2 * half + 1);
      sum += value(frame + half + 1, axis) - value(frame - half, axis);
    }
  }
  return path;
}

/* Metres: how high a body is above the floor, how deep below it, and how far it is sideways of the path. */
function reach(figure, frames, ground) {
  const { positions, path, body: { sides } } = figure;
  const joints = sides.length;
  const thick = thickness(figure.body);
  if (hasSkin(figure)) for (const [joint, far] of figure.body.skin.around) thick[joint] = Math.max(thick[joint], far);
  let up = 0, down = 0, wide = 0;
  for (let frame = 0; frame < frames; frame++) {
    for (let joint = 0; joint < joints; joint++) {
      if (sides[joint] === "h") continue;
      const at = 3 * (frame * joints + joint);
      const x = positions[at], z = positions[at + 2];
      const high = positions[at + 1] - floorAt(ground, x, z);
      up = Math.max(up, high + (hasSkin(figure) ? thick[joint] : 0));
      down = Math.max(down, thick[joint] - high);
      wide = Math.max(wide, Math.hypot(x - path[3 * frame], z - path[3 * frame + 2]) + thick[joint]);
    }
  }
  return { up, down: Math.min(down, up), wide };
}

function largest(figures) {
  const up = Math.max(...figures.map((each) => each.reach.up), 0.1);
  const down = Math.max(...figures.map((each) => each.reach.down));
  return { up, down, wide: Math.max(...figures.map((each) => each.reach.wide), 0.3 * up) };
}

/* Steps of feet over the floor while they should stand, one object each. */
function slidesOf(figure, frames, fps) {
  const found = [];
  const labels = figure.asked || figure.planted;
  if (!labels) return found;
  const joints = figure.body.parents.length, count = figure.contacts.length;
  const least = (SLIDE * figure.body.height * 30) / fps;
  for (let k = 0; k < count; k++) {
    for (let frame = 1; frame < frames; frame++) {
      if (!labels[frame * count + k] || !labels[(frame - 1) * count + k]) continue;
      const to = 3 * (frame * joints + figure.contacts[k]), from = to - 3 * joints;
      const [x0, z0] = [figure.positions[from], figure.positions[from + 2]];
      const [x1, z1] = [figure.positions[to], figure.positions[to + 2]];
      const far = Math.hypot(x1 - x0, z1 - z0);
      if (far > least) found.push({ frame, x0, z0, x1, z1, far });
    }
  }
  return found;
}

/* Per frame, the joints that are below the floor. */
function sunkOf(figure, frames, ground) {
  const joints = figure.body.parents.length;
  return Array.from({ length: frames }, (_, frame) => {
    const found = [];
    for (let joint = 0; joint < joints; joint++) {
      if (figure.body.sides[joint] === "h") continue;
      const at = 3 * (frame * joints + joint);
      const depth = floorAt(ground, figure.positions[at], figure.positions[at + 2]) - figure.positions[at + 1];
      if (depth > SUNK) found.push({ joint, depth });
    }
    return found;
  });
}

/* A decoded scene with all of this. Predictions are asked for the contacts of the reference. */
function prepared(scene) {
  const { frames, fps, ground, figures } = scene;
  const reference = figures.find((each) => each.part === "reference" && each.positions);
  for (const figure of figures) {
    figure.id = figures.indexOf(figure);
    figure.inside = new Map(); // frame -> corners of its skin that are inside the body
    if (!figure.positions) continue;
    const joints = figure.body.parents.length;
    const compared = figure.part === "prediction" && reference && reference.body === figure.body;
    const same = compared && reference.planted && String(figure.contacts) === String(reference.contacts);
    figure.asked = same ? reference.planted : null;
    figure.path = smoothPath(figure, frames, fps, ground);
    figure.reach = reach(figure, frames, ground);
    figure.slides = slidesOf(figure, frames, fps);
    figure.sunk = sunkOf(figure, frames, ground);
    figure.now = new Float32Array(joints * 3);
    figure.screen = new Float32Array(joints * 4);
  }
  const shown = figures.filter((each) => each.positions);
  scene.shown = shown;
  scene.lead = reference || shown.find((each) => each.part === "source");
  for (const body of scene.bodies) body.reach = largest(shown.filter((each) => each.body === body));
  scene.reach = largest(shown);
  return scene;
}

/* Places of all joints at a time between frames, metres. */
function placeAt(figure, time, frames) {
  const frame = Math.min(Math.floor(time), frames - 1), next = Math.min(frame + 1, frames - 1);
  const share = time - frame, count = figure.now.length;
  const { positions, now } = figure;
  for (let i = 0, a = frame * count, b = next * count; i < count; i++, a++, b++) {
    now[i] = positions[a] + (positions[b] - positions[a]) * share;
  }
}
