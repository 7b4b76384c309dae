/* Packed scenes: the reader of what packing.py writes. */

/* Whole numbers out of bytes: seven bits a byte, low bits first, the sign in the lowest bit. */
function integers(bytes) {
  let at = 0;
  return () => {
    let value = 0, scale = 1, byte;
    do {
      byte = bytes[at++];
      value += (byte & 127) * scale;
      scale *= 128;
    } while (byte & 128);
    return value % 2 ? -(value + 1) / 2 : value / 2;
  };
}

/* Rows of second differences, as values in steps: out[column * rows + row]. */
function series(next, rows, columns, step, out) {
  for (let row = 0; row < rows; row++) {
    let value = 0, change = 0;
    for (let column = 0; column < columns; column++) {
      change += next();
      value += change;
      out[column * rows + row] = value * step;
    }
  }
  return out;
}

async function inflated(text) {
  if (typeof DecompressionStream === "undefined") {
    throw new Error("This browser is too old to unpack motions; open the page in a newer one.");
  }
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/* A scene with typed arrays: positions [frame][joint][xyz] metres, planted [frame][contact], error [frame],
   and where there are skins turns [frame][joint of the skin][wxyz], or moved [frame][corner of the skin][xyz] metres. */
async function decode(packed) {
  if (packed.schema !== 1) throw new Error("This scene was packed by another version of the program.");
  const next = integers(await inflated(packed.data));
  const frames = packed.frames;
  const bodies = packed.bodies.map((told) => ({ ...told }));
  const figures = packed.figures.map((told) => {
    const figure = { ...told, body: bodies[told.body], positions: null, planted: null, error: null, turns: null,
      moved: null };
    if (!told.shown) return figure;
    const rows = figure.body.parents.length * 3;
    figure.positions = series(next, rows, frames, packed.step, new Float32Array(rows * frames));
    if (told.contacts) {
      const count = told.contacts.length;
      figure.planted = series(next, count, frames, 1, new Uint8Array(count * frames));
    }
    if (told.error) figure.error = series(next, 1, frames, packed.errorStep, new Float32Array(frames));
    if (told.skin && told.surface) {
      const rows = 3 * figure.body.skin.vertices;
      figure.moved = series(next, rows, frames, packed.surfaceStep, new Float32Array(rows * frames));
    } else if (told.skin) {
      const turned = figure.body.skin.joints.length * 4;
      figure.turns = series(next, turned, frames, packed.turnStep, new Float32Array(turned * frames));
    }
    return figure;
  });
  const ground = { ...packed.ground };
  if (ground.rows) {
    const { rows, columns } = ground;
    ground.heights = series(next, rows, columns, packed.step, new Float32Array(rows * columns));
  }
  for (const body of bodies) if (body.skin) body.skin = readSkin(next, body.skin, packed.skinStep);
  return { ...packed, data: null, bodies, figures, ground };
}

/* Metres: the floor under a place; a height field is read bilinearly and goes on beyond its edge. */
function floorAt(ground, x, z) {
  if (!ground.heights) return ground.height;
  const { rows, columns, heights, origin, spacing } = ground;
  const u = Math.min(Math.max((x - origin[0]) / spacing, 0), columns - 1);
  const v = Math.min(Math.max((z - origin[1]) / spacing, 0), rows - 1);
  const left = Math.floor(u), near = Math.floor(v);
  const right = Math.min(left + 1, columns - 1), far = Math.min(near + 1, rows - 1);
  const a = heights[left * rows + near] * (1 - u + left) + heights[right * rows + near] * (u - left);
  const b = heights[left * rows + far] * (1 - u + left) + heights[right * rows + far] * (u - left);
  return a * (1 - v + near) + b * (v - near);
}
