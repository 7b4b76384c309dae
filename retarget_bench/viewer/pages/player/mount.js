/* The player itself: what it knows, how that changes, and when it is drawn. */

const SHOWN = { overlay: false, contacts: true, skins: false, lit: true };
const CONTRAST = 3; // WCAG 2, of what is no text

function listen(player, target, name, action, passive) {
  const options = { signal: player.stop.signal, passive: passive !== false && name.startsWith("touch") };
  target.addEventListener(name, action, options);
}

/* A picture is drawn at most once per refresh of the screen, and only if something changed. */
function redraw(player) {
  if (player.asked || player.gone) return;
  player.asked = requestAnimationFrame((now) => {
    player.asked = 0;
    if (player.playing) advance(player, now);
    drawStage(player);
    showTime(player);
    if (player.playing) redraw(player);
    else lookInside(player);
  });
}

function advance(player, now) {
  const { scene } = player;
  const passed = Math.min((now - (player.before || now)) / 1000, 0.25);
  player.before = now;
  player.time += passed * scene.fps * player.speed;
  if (player.time > scene.frames - 0.5) player.time %= scene.frames - 0.5;
}

function setTime(player, frame) {
  const last = player.scene.frames - 1;
  player.time = Math.min(Math.max(Number.isFinite(frame) ? Math.round(frame) : frame, 0), last) || 0;
  redraw(player);
}

function step(player, by) {
  setPlaying(player, false);
  setTime(player, Math.round(player.time) + by);
}

function setPlaying(player, on) {
  const playing = on && player.scene.frames > 1;
  if (playing === player.playing) return;
  player.playing = playing;
  player.before = 0;
  if (!playing) player.time = Math.min(Math.round(player.time), player.scene.frames - 1);
  const name = playing ? "Pause" : "Play";
  player.playButton.setAttribute("aria-label", name);
  player.playButton.title = name;
  player.playButton.replaceChildren(icon(playing ? "pause" : "play"));
  player.toldFrame = -1;
  redraw(player);
}

function faster(player, by) {
  const at = SPEEDS.indexOf(player.speed) + by;
  if (at < 0 || at >= SPEEDS.length) return;
  player.speed = SPEEDS[at];
  player.speedBox.value = String(player.speed);
}

function setView(player, view) {
  Object.assign(player.camera, HOME, view);
  redraw(player);
}

function toggle(player, key) {
  player.show[key] = !player.show[key];
  player.toggles[key].setAttribute("aria-pressed", player.show[key]);
  changed(player);
}

/* What is shown has changed, so panels, curves and lists have too. */
function changed(player) {
  player.plan = null;
  player.toldFrame = -1;
  drawCurves(player);
  redraw(player);
}

/* Colours that stand out from all that is behind them: of names and curves, of left sides and of right sides. */
function recolour(player) {
  player.theme = themeOf(player.root);
  const given = player.options.colours || {}, dark = luminance(player.theme.stage) < 0.18;
  player.colours = player.scene.figures.map((figure) => {
    const own = dark && figure.part === "reference" ? player.theme.ink : figure.colour; // else grey, too
    const asked = Object.hasOwn(given, figure.label) ? given[figure.label] : own;
    const colour = readable(readable(asked, player.theme.stage, CONTRAST), player.theme.band, CONTRAST);
    const lit = luminance(colour) < 0.03 ? mixed(colour, "#ffffff", 0.2) : colour; // else black all over
    return [colour, lit, mixed("#000000", lit, RIGHT_DIMMED)];
  });
}

function resized(player) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const { width, height } = player.canvas.getBoundingClientRect();
  if (!width || (width === player.width && height === player.height && ratio === player.ratio)) return;
  Object.assign(player, { width, height, ratio, plan: null });
  player.canvas.width = Math.round(width * ratio);
  player.canvas.height = Math.round(height * ratio);
  drawCurves(player);
  drawStage(player);
}

/* Puts a decoded scene into the player's element. */
function start(player) {
  const { options, scene, root } = player;
  recolour(player);
  select(player, options.labels);
  build(player);
  player.shade = shades(player.context);
  player.paint = painter(player);
  player.ink = inks();
  pointers(player);
  keys(player);
  const watched = new ResizeObserver(() => resized(player));
  watched.observe(player.canvas);
  player.stop.signal.addEventListener("abort", () => watched.disconnect());
  const dark = matchMedia("(prefers-color-scheme: dark)");
  listen(player, dark, "change", () => {
    recolour(player);
    root.querySelectorAll(".rp-chip .rp-swatch").forEach((each, i) => {
      each.style.background = player.colours[i][0];
    });
    changed(player);
  });
  resized(player);
  setTime(player, options.frame || 0);
  changed(player);
  showTime(player); // names never stand without their errors, not even until the first picture
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (options.autoplay && !still) setPlaying(player, true);
  return scene;
}

/* The figures with these labels, or all. */
function select(player, labels) {
  const asked = labels && new Set(labels);
  player.selected = new Set(
    player.scene.figures.filter((each) => !asked || asked.has(each.label)).map((each) => each.id));
}

function mount(element, packed, options = {}) {
  const root = node("div", { class: "rp", role: "group", "aria-label": `Motion player: ${packed.title}` });
  root.append(node("p", { class: "rp-wait" }, "Unpacking the motion…"));
  element.replaceChildren(root);
  const as = options.state || {};
  const player = { root, options: { ...options }, camera: { ...newCamera(), ...as.camera }, stop: new AbortController(),
    time: 0, speed: as.speed || 1, playing: false, looking: false, toldFrame: -1,
    show: { ...SHOWN, overlay: Boolean(options.overlay), skins: Boolean(options.skins), ...as.show } };
  if (options.state) Object.assign(player.options, { labels: as.labels, frame: as.frame, autoplay: as.playing });
  const ready = decode(packed).then((scene) => {
    if (player.gone) return;
    player.scene = prepared(scene);
    start(player);
  }).catch((error) => {
    root.replaceChildren(node("p", { class: "rp-wait", role: "alert" }, String(error.message || error)));
  });
  return {
    ready,
    seek(frame) {
      player.options.frame = frame;
      if (!player.canvas) return;
      setPlaying(player, false);
      setTime(player, frame);
    },
    select(labels) {
      player.options.labels = labels;
      if (!player.canvas) return;
      select(player, labels);
      player.chips.forEach((chip, i) => (chip.control.checked = player.selected.has(i)));
      changed(player);
    },
    state() {
      if (!player.canvas) return {};
      const { playing, speed, show, camera } = player;
      return { playing, speed, show, camera, frame: frameOf(player), labels: chosen(player).map((each) => each.label) };
    },
    destroy() {
      player.gone = true;
      clearTimeout(player.telling);
      player.stop.abort();
      root.remove();
    },
  };
}
