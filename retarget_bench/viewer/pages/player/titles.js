/* Names and numbers in the panels. */

const VEIL = 0.66; // how much of the stage is between a body and letters in front of it
const UNDER = [[135, "under the floor"], [80, "under"], [0, "↓"]]; // words, and the pixels that they need

/* Text that fits, cut where it is too long, and how long it is. Measuring is slow, so that what was found is kept. */
function fitted(player, text, width) {
  const { context, plan } = player;
  const key = context.font + width + text;
  if (plan.fitted.size > 4000) plan.fitted.clear();
  if (!plan.fitted.has(key)) {
    const long = (told) => context.measureText(told).width;
    let end = text.length, told = text;
    while (end > 1 && long(told) > width) told = text.slice(0, --end) + "…";
    plan.fitted.set(key, { told, long: long(told) });
  }
  return plan.fitted.get(key);
}

/* Letters that can be read in front of bodies, too. */
function write(player, text, x, y, room, ink) {
  const { context, theme } = player;
  const { told, long } = fitted(player, text, room);
  context.fillStyle = theme.stage;
  context.globalAlpha = VEIL;
  context.fillRect(x - 3, y - 12, long + 6, 16);
  context.globalAlpha = 1;
  context.fillStyle = ink;
  context.fillText(told, x, y);
}

function offOf(figure, frame) {
  if (!figure.positions) return figure.status;
  if (figure.part === "reference" || !figure.error) return figure.body.name;
  return `${figure.error[frame].toFixed(1)} % off`;
}

/* How far a figure is below the floor, in words for so many pixels; "" where it is not. */
function underOf(player, figure, frame, room) {
  if (!player.show.contacts || !figure.positions || figure.part === "source") return "";
  const deep = Math.max(0, ...figure.sunk[frame].map((each) => each.depth));
  return deep > 0 ? `${(100 * deep).toFixed(1)} cm ${UNDER.find(([least]) => room >= least)[1]}` : "";
}

/* Words for a figure of which no joint is in a box of the screen. */
function awayOf({ positions, screen }, { x, y, w, h }) {
  if (!positions) return "";
  for (let at = 0; at < screen.length; at += 4) {
    if (screen[at] > x && screen[at] < x + w && screen[at + 1] > y && screen[at + 1] < y + h) return "";
  }
  return "out of view";
}

function drawSwatch(context, x, y, colour) {
  context.fillStyle = colour;
  context.beginPath();
  context.roundRect(x, y - 9, 10, 10, 3);
  context.fill();
}

/* Name and error of a panel's only figure in its upper left corner, its depth in the lower one. */
function drawTitle(player, box, figure, frame) {
  const { context, theme, colours } = player;
  const small = box.w < 170, x = box.x + 26, y = box.y + 18, room = box.w - 34;
  drawSwatch(context, box.x + 10, y, colours[figure.id][0]);
  context.font = `600 ${small ? 12 : 13}px ${theme.font}`;
  write(player, figure.label, x, y, room, theme.ink);
  context.font = `${small ? 11 : 12}px ${theme.font}`;
  write(player, offOf(figure, frame), x, y + 16, room, theme.faint);
  const under = underOf(player, figure, frame, box.w - 18);
  if (under) write(player, under, box.x + 10, box.y + box.h - 6, box.w - 18, theme.ink);
}

/* Those of all figures in one place, line by line: names are cut before numbers are. */
function drawTitles(player, box, figures, frame) {
  const { context, theme, colours } = player;
  const room = box.w - 34;
  context.font = `600 12px ${theme.font}`;
  figures.forEach((figure, i) => {
    const y = box.y + 18 + 17 * i;
    const told = [offOf(figure, frame), underOf(player, figure, frame, room / 3), awayOf(figure, box)];
    const numbers = told.filter(Boolean).join(" · ");
    const name = fitted(player, figure.label, Math.max(room - fitted(player, numbers, room).long - 12, 40)).told;
    drawSwatch(context, box.x + 10, y, colours[figure.id][0]);
    write(player, `${name}   ${numbers}`, box.x + 26, y, room, theme.ink);
  });
}

/* Why there is nothing to see, in lines of the panel's width. */
function drawMessage(player, box, text) {
  const { context, theme } = player;
  context.font = `13px ${theme.font}`;
  context.fillStyle = theme.faint;
  context.textAlign = "center";
  const lines = [""];
  for (const word of text.split(/\s+/)) {
    const tried = `${lines[lines.length - 1]} ${word}`.trim();
    if (lines[lines.length - 1] && context.measureText(tried).width > box.w - 32) lines.push(word);
    else lines[lines.length - 1] = tried;
  }
  const most = Math.max(Math.floor((box.h - 80) / 18), 1);
  if (lines.length > most) lines.splice(most, lines.length, "…");
  const top = box.y + box.h / 2 - (lines.length - 1) * 9;
  lines.forEach((line, i) =>
    context.fillText(fitted(player, line, box.w - 24).told, box.x + box.w / 2, top + 18 * i));
  context.textAlign = "left";
}
