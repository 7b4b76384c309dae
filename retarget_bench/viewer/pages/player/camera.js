/* Where people look from, and what of a scene lands where on the screen. */

const HOME = { yaw: 0.62, pitch: 0.2, zoom: 1, panX: 0, panY: 0 };
const VIEWS = {
  front: { yaw: 0, pitch: 0.06 },
  side: { yaw: Math.PI / 2, pitch: 0.06 },
  top: { yaw: 0, pitch: 1.55 },
};
const STRENGTH = 4.2; // distance of the eye, in sizes of the scene

function newCamera() {
  return { ...HOME };
}

function orbit(camera, yaw, pitch) {
  camera.yaw += yaw;
  camera.pitch = Math.min(Math.max(camera.pitch + pitch, -0.06), 1.55);
}

/* Pans are in sizes of the scene, so that all panels move alike. */
function pan(camera, x, y) {
  camera.panX = Math.min(Math.max(camera.panX + x, -3), 3);
  camera.panY = Math.min(Math.max(camera.panY + y, -3), 3);
}

function zoom(camera, factor) {
  camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.25), 12);
}

/* What a camera sees in a rectangle of the canvas; target: [x, y, z] metres in its middle. */
function lens(camera, box, target, size, scale) {
  const cy = Math.cos(camera.yaw), sy = Math.sin(camera.yaw);
  const cp = Math.cos(camera.pitch), sp = Math.sin(camera.pitch);
  const eye = STRENGTH * size;
  const middleX = box.x + box.w / 2 + camera.panX * scale * size;
  const middleY = box.y + box.h / 2 + camera.panY * scale * size;
  const strength = scale * camera.zoom * eye;
  return {
    box, target, eye, cy, sy, cp, sp, middleX, middleY, strength,
    scale: scale * camera.zoom,
    /* Pixels x and y, metres away from the eye, and pixels per metre there. */
    project(x, y, z, out, at) {
      const dx = x - target[0], dy = y - target[1], dz = z - target[2];
      const back = dx * sy + dz * cy;
      const away = Math.max(eye - dy * sp - back * cp, 0.05 * eye);
      const k = strength / away;
      out[at] = middleX + (dx * cy - dz * sy) * k;
      out[at + 1] = middleY - (dy * cp - back * sp) * k;
      out[at + 2] = away;
      out[at + 3] = k;
    },
  };
}

/* Rectangles for so many panels of these proportions, as large as they get. */
function panels(count, width, height, across, up) {
  let best = { scale: 0, columns: 1, rows: 1 };
  for (let columns = 1; columns <= count; columns++) {
    const rows = Math.ceil(count / columns);
    const scale = Math.min(width / columns / across, height / rows / up);
    if (scale > best.scale * 1.001) best = { scale, columns, rows };
  }
  const edge = (i, whole, parts) => Math.round((whole * i) / parts); // clipping between pixels is slow
  return Array.from({ length: count }, (_, i) => {
    const column = i % best.columns, row = Math.floor(i / best.columns);
    const x = edge(column, width, best.columns), y = edge(row, height, best.rows);
    return { x, y, w: edge(column + 1, width, best.columns) - x, h: edge(row + 1, height, best.rows) - y };
  });
}
