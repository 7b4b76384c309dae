/* Error over frames under the slider. */

const THUMB = 16; // pixels: the slider's thumb, so that curve and slider say the same place

function drawCurves(player) {
  const { curve, scene, theme, colours, selected } = player;
  const lines = scene.shown.filter((each) => each.error && each.part !== "reference" && selected.has(each.id));
  player.curveBox.hidden = player.curveTop.hidden = !scene.shown.some((each) => each.error);
  if (player.curveBox.hidden) return;
  const width = curve.clientWidth, height = curve.clientHeight, ratio = player.ratio;
  curve.width = Math.max(Math.round(width * ratio), 1);
  curve.height = Math.max(Math.round(height * ratio), 1);
  const context = curve.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const top = Math.max(...lines.map((each) => each.error.reduce((a, b) => Math.max(a, b), 0)), 1e-6) * 1.08;
  const x = (frame) => THUMB / 2 + ((width - THUMB) * frame) / Math.max(scene.frames - 1, 1);
  const y = (error) => height - 1 - ((height - 4) * Math.max(error, 0)) / top;
  context.strokeStyle = theme.line;
  context.beginPath();
  for (const share of [0, 0.5, 1]) {
    const level = Math.round(y(share * top)) + 0.5;
    context.moveTo(0, level);
    context.lineTo(width, level);
  }
  context.stroke();
  context.lineWidth = 1.6;
  context.lineJoin = "round";
  for (const each of lines) {
    context.strokeStyle = colours[each.id][0];
    context.beginPath();
    each.error.forEach((error, frame) => context.lineTo(x(frame), y(error)));
    if (scene.frames === 1) context.arc(x(0), y(each.error[0]), 3, 0, 2 * Math.PI);
    context.stroke();
  }
  player.curveTop.textContent = "Error, % of height" + (lines.length ? `; top ${top.toFixed(1)} %` : "");
}

/* The cursor, the slider and the numbers follow the time; people who listen are told when it rests. */
function showTime(player) {
  const { scene, slider, cursor, readout } = player;
  const frame = frameOf(player);
  const share = player.time / Math.max(scene.frames - 1, 1);
  cursor.style.left = `calc(${THUMB / 2}px + (100% - ${THUMB}px) * ${Math.min(share, 1)})`;
  if (player.toldFrame === frame) return;
  player.toldFrame = frame;
  slider.value = String(frame);
  slider.setAttribute("aria-valuetext", `frame ${frame + 1} of ${scene.frames}`);
  readout.textContent = `${frame + 1} / ${scene.frames}  ·  ${(frame / scene.fps).toFixed(2)} s`;
  for (const [figure, place] of player.errorPlaces) {
    place.textContent = figure.error ? `${figure.error[frame].toFixed(1)} %` : "";
  }
  clearTimeout(player.telling);
  if (!player.playing) player.telling = setTimeout(() => tell(player, frame), 350);
}

/* The picture in words: also what the canvas is called. */
function tell(player, frame) {
  const { scene, live, canvas } = player;
  const parts = chosen(player).map((figure) => {
    if (!figure.positions) return `${figure.label}: ${figure.status}`;
    const off = figure.error && figure.part !== "reference" ? ` ${figure.error[frame].toFixed(1)} % off` : "";
    return `${figure.label} (${figure.body.name})${off}`;
  });
  const layoutName = player.show.overlay ? "overlaid" : "side by side";
  live.textContent = `Frame ${frame + 1} of ${scene.frames}`;
  canvas.setAttribute("aria-label",
    `${scene.title}. Frame ${frame + 1} of ${scene.frames}, ${layoutName}: ${parts.join("; ") || "no figure"}`);
}

