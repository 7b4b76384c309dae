/* Triangles as pixels of a sheet that lies behind the canvas, finer than it, so that edges are smooth. Every pixel
   knows how near it is: nothing has to be sorted, and what is hidden costs next to nothing. */

const FINE = 2; // pixels of the sheet beside each other on one of the page
const ROOM = 12e6; // pixels of the largest sheet; those of larger canvases are as fine as the page
const TONES = 48; // shades of a colour

/* A sheet for a canvas of so many pixels of the page. Its parts, one for each panel with skins, lie one after the
   other in inks and depths, so that each is wiped at once; no two of them overlap. */
function newSheet(width, height) {
  const fine = width * height * FINE * FINE > ROOM ? 1 : FINE;
  const canvas = document.createElement("canvas");
  canvas.width = Math.max(Math.ceil(width * fine), 1);
  canvas.height = Math.max(Math.ceil(height * fine), 1);
  const pixels = canvas.width * canvas.height;
  return { fine, canvas, context: canvas.getContext("2d", { willReadFrequently: true }), used: 0,
    inks: new Uint32Array(pixels), depths: new Float32Array(pixels) };
}

/* Colours as they are at so much light, 0 to TONES, as pixels; each made once. */
function inks() {
  const made = new Map();
  return (hex) => {
    if (!made.has(hex)) {
      made.set(hex, Uint32Array.from({ length: TONES + 2 }, (_, i) => {
        const [red, green, blue] = rgb(lit(hex, AMBIENT + (DIFFUSE * i) / TONES));
        return (255 << 24) | (blue << 16) | (green << 8) | red;
      }));
    }
    return made.get(hex);
  };
}

/* The part of a sheet, [left, top, right, bottom], that corners [corner][x, y, nearness, tone] and a box of the
   page both cover, to whole pixels of the page; null where there is none. */
function covered(corners, box, fine) {
  let left = Infinity, top = Infinity, right = -Infinity, bottom = -Infinity;
  for (let i = 0; i < corners.length; i += 4) {
    const x = corners[i], y = corners[i + 1];
    if (x < left) left = x;
    if (x > right) right = x;
    if (y < top) top = y;
    if (y > bottom) bottom = y;
  }
  const down = (value, least) => Math.max(fine * Math.floor(value / fine), fine * least);
  const up = (value, most) => Math.min(fine * Math.ceil(value / fine), fine * most);
  const found = [down(left, box.x), down(top, box.y), up(right, box.x + box.w), up(bottom, box.y + box.h)];
  return found[0] < found[2] && found[1] < found[3] ? found : null;
}

/* Both parts in one. */
function joined(one, other) {
  if (!one || !other) return one || other;
  return one.map((value, i) => (i < 2 ? Math.min : Math.max)(value, other[i]));
}

/* A part of a sheet with nothing on it; its pixel (x, y) is number start + y * wide + x. */
function blank(sheet, [left, top, right, bottom]) {
  const wide = right - left, begin = sheet.used, end = (sheet.used += wide * (bottom - top));
  sheet.inks.fill(0, begin, end);
  sheet.depths.fill(0, begin, end);
  return { left, top, right, bottom, wide, begin, start: begin - top * wide - left };
}

/* What is on a part, put where it belongs. */
function put({ context, inks: { buffer } }, { left, top, right, bottom, wide, begin }) {
  const bytes = new Uint8ClampedArray(buffer, 4 * begin, 4 * wide * (bottom - top));
  context.putImageData(new ImageData(bytes, right - left, bottom - top), left, top);
}

/* A triangle between corners of p [corner][x, y, nearness, tone], on pixels whose middles lie in it: each belongs to
   one of two neighbours, so that nothing shines through between them. */
function fill(sheet, part, ink, p, a, b, c) {
  let spare;
  if (p[b + 1] < p[a + 1]) spare = a, a = b, b = spare;
  if (p[c + 1] < p[a + 1]) spare = a, a = c, c = spare;
  if (p[c + 1] < p[b + 1]) spare = b, b = c, c = spare;
  const { depths, inks: pixels } = sheet, { left, top, right, bottom, wide, start } = part;
  const ax = p[a], ay = p[a + 1], bx = p[b] - ax, by = p[b + 1] - ay, cx = p[c] - ax, cy = p[c + 1] - ay;
  const area = bx * cy - cx * by; // above 0 where b is on the right of the long edge
  if (Math.abs(area) < 1e-3) return;
  const bz = p[b + 2] - p[a + 2], cz = p[c + 2] - p[a + 2], bt = p[b + 3] - p[a + 3], ct = p[c + 3] - p[a + 3];
  const zx = (bz * cy - cz * by) / area, zy = (cz * bx - bz * cx) / area;
  const tx = (bt * cy - ct * by) / area, ty = (ct * bx - bt * cx) / area;
  const long = cx / cy, upper = bx / by, lower = (cx - bx) / (cy - by);
  const last = Math.min(Math.ceil(ay + cy - 0.5), bottom);
  for (let y = Math.max(Math.ceil(ay - 0.5), top); y < last; y++) {
    const down = y + 0.5 - ay;
    const one = ax + down * long, other = ax + (down < by ? down * upper : bx + (down - by) * lower);
    const from = Math.max(Math.ceil((area > 0 ? one : other) - 0.5), left);
    const end = start + y * wide + Math.min(Math.ceil((area > 0 ? other : one) - 0.5), right);
    const over = from + 0.5 - ax;
    let near = p[a + 2] + over * zx + down * zy, tone = p[a + 3] + over * tx + down * ty;
    for (let at = start + y * wide + from; at < end; at++) {
      if (near > depths[at]) {
        depths[at] = near;
        pixels[at] = ink[tone | 0];
      }
      near += zx;
      tone += tx;
    }
  }
}
