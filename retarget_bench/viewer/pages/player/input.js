/* Mouse, touch and keys. Keys work while the player has the focus, and the wheel while its picture has it. */

function pointers(player) {
  const { canvas, camera } = player;
  const held = new Map();
  let before = null; // the view when the first of them came
  const gap = () => {
    const [a, b] = [...held.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) };
  };
  const perPixel = () => {
    const { rooms, scales } = player.plan;
    return rooms.length ? 1 / (scales[0] * rooms[0].size) : 0;
  };
  const moved = (event) => {
    const last = held.get(event.pointerId);
    if (!last) return;
    const old = held.size === 2 ? gap() : null;
    const dx = event.clientX - last.x, dy = event.clientY - last.y;
    held.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: last.pans });
    if (old) {
      const now = gap();
      zoom(camera, now.apart / Math.max(old.apart, 1));
      pan(camera, (now.x - old.x) * perPixel(), (now.y - old.y) * perPixel());
    } else if (last.pans || event.shiftKey) pan(camera, dx * perPixel(), dy * perPixel());
    else orbit(camera, -dx * 0.009, dy * 0.007);
    redraw(player);
  };
  listen(player, canvas, "pointerdown", (event) => {
    if (held.size === 2) return;
    if (!held.size) before = { ...camera };
    held.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: event.button > 0 });
    canvas.setPointerCapture(event.pointerId);
    canvas.classList.add("rp-held");
  });
  listen(player, canvas, "pointermove", moved);
  const ended = (event) => {
    const ours = held.delete(event.pointerId);
    if (!held.size) canvas.classList.remove("rp-held");
    return ours;
  };
  listen(player, canvas, "pointerup", ended);
  /* A finger that goes sideways is ours, two are ours. One that goes up or down scrolls the page: the browser says so
     only when it has turned the view a little, which is taken back. */
  listen(player, canvas, "pointercancel", (event) => {
    if (!ended(event)) return;
    Object.assign(camera, before);
    redraw(player);
  });
  listen(player, canvas, "touchmove", (event) => event.touches.length > 1 && event.preventDefault(), false);
  listen(player, canvas, "contextmenu", (event) => event.preventDefault());
  listen(player, canvas, "wheel", (event) => {
    if (!event.ctrlKey && document.activeElement !== canvas) return;
    event.preventDefault();
    zoom(camera, Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0014)));
    redraw(player);
  }, false);
  scrubbing(player);
}

/* The curve is a second slider for those who point. */
function scrubbing(player) {
  const { curveBox, scene } = player;
  const seekTo = (event) => {
    const box = curveBox.getBoundingClientRect();
    const share = (event.clientX - box.left - THUMB / 2) / Math.max(box.width - THUMB, 1);
    setPlaying(player, false);
    setTime(player, Math.round(share * (scene.frames - 1)));
  };
  listen(player, curveBox, "pointerdown", (event) => {
    curveBox.setPointerCapture(event.pointerId);
    seekTo(event);
  });
  listen(player, curveBox, "pointermove", (event) => event.buttons && seekTo(event));
}

function keys(player) {
  const { camera } = player;
  const turn = (yaw, pitch, x, y) => (event) => {
    if (event.shiftKey) pan(camera, x, y);
    else orbit(camera, yaw, pitch);
    redraw(player);
  };
  const closer = (factor) => () => {
    zoom(camera, factor);
    redraw(player);
  };
  const actions = {
    " ": () => setPlaying(player, !player.playing),
    arrowleft: (event) => step(player, event.shiftKey ? -10 : -1),
    arrowright: (event) => step(player, event.shiftKey ? 10 : 1),
    home: () => step(player, -Infinity),
    end: () => step(player, Infinity),
    "[": () => faster(player, -1),
    "]": () => faster(player, 1),
    a: turn(-0.15, 0, 0.06, 0),
    d: turn(0.15, 0, -0.06, 0),
    w: turn(0, 0.1, 0, 0.06),
    s: turn(0, -0.1, 0, -0.06),
    "+": closer(1.15),
    "=": closer(1.15),
    "-": closer(1 / 1.15),
    0: () => setView(player, HOME),
    "?": () => (player.help.open = !player.help.open),
  };
  for (const [key, , letter] of togglesOf(player)) actions[letter.toLowerCase()] = () => toggle(player, key);
  listen(player, player.root, "keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const { tagName, type } = event.target;
    const key = event.key.toLowerCase();
    const pressable = tagName === "BUTTON" || tagName === "SUMMARY" || type === "checkbox";
    if (tagName === "SELECT" || (pressable && (key === " " || key === "enter"))) return;
    if (type === "range" && /^(arrow|home|end)/.test(key) && !event.shiftKey) return;
    if (/^[1-9]$/.test(key)) flip(player, Number(key) - 1);
    else if (Object.hasOwn(actions, key)) actions[key](event);
    else return;
    event.preventDefault();
  });
}

function flip(player, place) {
  const chip = player.chips[place];
  if (chip) chip.control.click();
}
