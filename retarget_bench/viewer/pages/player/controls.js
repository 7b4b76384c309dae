/* The player's elements. Names are put in as text, never as markup. */

const ICONS = {
  first: "M6 5h2v14H6zM20 5v14l-10-7z",
  back: "M16 5v14L6 12z",
  play: "M7 4v16l13-8z",
  pause: "M6 5h4v14H6zM14 5h4v14h-4z",
  on: "M8 5v14l10-7z",
  last: "M16 5h2v14h-2zM4 5v14l10-7z",
};
const SPEEDS = [0.1, 0.25, 0.5, 1, 2];
const TOGGLES = [
  ["overlay", "Overlay", "O", "all figures in one place"],
  ["contacts", "Contacts", "C", "feet that stand, that should and do not, or that slid, and joints below the floor"],
];
const SKINS = ["skins", "Skins", "K", "the surface of bodies that have one, in place of bones"];
const LIT = ["lit", "Flesh inside", "X", "striped, and seen through the skin: limbs inside the rest of the body"];
const KEYS = [
  ["Space", "play or pause"],
  ["← →", "one frame; with Shift, ten"],
  ["Home End", "first and last frame"],
  ["[ ]", "slower, faster"],
  ["A D W S", "turn the view; with Shift, move it"],
  ["+ −", "zoom"],
  ["0", "the view as it was"],
  ["1 – 9", "show or hide a figure"],
  ["?", "this help"],
];

/* What can be switched in a scene. */
function togglesOf({ scene, options }) {
  if (!scene.figures.some(hasSkin)) return TOGGLES;
  return [...TOGGLES, SKINS, ...(options.inside ? [LIT] : [])];
}

function node(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === true) made.setAttribute(key, "");
    else if (value !== false) made.setAttribute(key, String(value));
  }
  made.append(...children);
  return made;
}

function icon(name) {
  const space = "http://www.w3.org/2000/svg";
  const picture = document.createElementNS(space, "svg");
  picture.setAttribute("viewBox", "0 0 24 24");
  picture.setAttribute("aria-hidden", "true");
  const path = document.createElementNS(space, "path");
  path.setAttribute("d", ICONS[name]);
  picture.append(path);
  return picture;
}

function iconButton(name, label, action, extra) {
  const made = node("button", { type: "button", class: `rp-icon ${extra || ""}`, "aria-label": label, title: label });
  made.append(icon(name));
  made.addEventListener("click", action);
  return made;
}

function transport(player) {
  const { scene } = player;
  player.playButton = iconButton("play", "Play", () => setPlaying(player, !player.playing), "rp-play");
  player.speedBox = node("select", { "aria-label": "Speed" },
    ...SPEEDS.map((speed) => node("option", { value: speed, selected: speed === player.speed }, `${speed}×`)));
  player.speedBox.addEventListener("change", () => (player.speed = Number(player.speedBox.value)));
  player.readout = node("span", { class: "rp-readout", "aria-hidden": "true" });
  return node("div", { class: "rp-bar", role: "group", "aria-label": "Playback" },
    iconButton("first", "First frame", () => step(player, -Infinity)),
    iconButton("back", "One frame back", () => step(player, -1)),
    player.playButton,
    iconButton("on", "One frame on", () => step(player, 1)),
    iconButton("last", "Last frame", () => step(player, Infinity)),
    player.speedBox, player.readout,
    node("span", { class: "rp-rate", "aria-hidden": "true" }, `${+scene.fps.toFixed(2)} fps`));
}

function timeline(player) {
  const { scene } = player;
  player.slider = node("input", { type: "range", min: 0, max: Math.max(scene.frames - 1, 0), step: 1, value: 0,
    "aria-label": "Frame", disabled: scene.frames < 2 });
  player.slider.addEventListener("input", () => {
    setPlaying(player, false);
    setTime(player, Number(player.slider.value));
  });
  player.curve = node("canvas", { role: "img",
    "aria-label": "Error of each figure over frames, in per cent of height" });
  player.cursor = node("div", { class: "rp-cursor" });
  player.curveTop = node("div", { class: "rp-top", "aria-hidden": "true" });
  player.curveBox = node("div", { class: "rp-curve" }, player.curve, player.cursor);
  return node("div", { class: "rp-time" }, player.slider, player.curveTop, player.curveBox);
}

function figureChips(player) {
  player.errorPlaces = [];
  player.chips = player.scene.figures.map((figure) => {
    const box = node("input", { type: "checkbox" });
    box.checked = player.selected.has(figure.id);
    box.addEventListener("change", () => {
      if (box.checked) player.selected.add(figure.id);
      else player.selected.delete(figure.id);
      changed(player);
    });
    const swatch = node("span", { class: "rp-swatch" });
    swatch.style.background = player.colours[figure.id][0];
    const told = node("small", {}, figure.positions ? "" : figure.status);
    if (figure.error && figure.part !== "reference") player.errorPlaces.push([figure, told]);
    const about = `${figure.body.name}, ${figure.body.joints.length} joints`;
    return node("label", { class: "rp-chip", title: figure.message || about }, box, swatch,
      node("span", { class: "rp-name" }, figure.label), told);
  });
  return node("fieldset", { class: "rp-figures" }, node("legend", {}, "Figures"), ...player.chips);
}

function toggles(player) {
  player.toggles = {};
  const buttons = togglesOf(player).map(([key, name, letter, what]) => {
    const button = node("button", { type: "button", class: "rp-toggle", title: `${what} (${letter})`,
      "aria-pressed": String(player.show[key]) }, name);
    button.addEventListener("click", () => toggle(player, key));
    player.toggles[key] = button;
    return button;
  });
  const views = Object.keys(VIEWS).map((name) => {
    const button = node("button", { type: "button", class: "rp-view" }, name[0].toUpperCase() + name.slice(1));
    button.addEventListener("click", () => setView(player, VIEWS[name]));
    return button;
  });
  const reset = node("button", { type: "button", class: "rp-view", title: "The view as it was (0)" }, "Reset view");
  reset.addEventListener("click", () => setView(player, HOME));
  return node("div", { class: "rp-tools" },
    node("div", { class: "rp-show", role: "group", "aria-label": "Show" }, ...buttons),
    node("div", { class: "rp-show", role: "group", "aria-label": "View" }, ...views, reset));
}

function help(player) {
  const shown = togglesOf(player).map(([, name, key, what]) => [key, `${name}: ${what}`]);
  const rows = [...KEYS, ...shown].flatMap(([key, what]) => [node("dt", {}, node("kbd", {}, key)), node("dd", {}, what)]);
  player.help = node("details", { class: "rp-help" }, node("summary", {}, "Keys and marks"),
    node("p", {}, "Drag to turn, drag with Shift or the right button to move, use the wheel to zoom once the "
      + "picture has the focus. By touch: swipe sideways to turn, pinch to zoom, two fingers to move. The right "
      + "side of a body is darker. A filled disc is a foot that stands, an empty one a foot that should and "
      + "does not; red lines are feet that slid, crossed circles joints below the floor. Lines of the floor are "
      + "1, 0.5, 0.25 or 0.1 m apart, by the size of the body."),
    node("dl", {}, ...rows));
  return player.help;
}

/* Everything inside the player's element. */
function build(player) {
  const { scene } = player;
  player.canvas = node("canvas", { role: "img", tabindex: 0, class: "rp-canvas", "aria-label": scene.title });
  player.context = player.canvas.getContext("2d", { alpha: false });
  player.live = node("p", { class: "rp-live", "aria-live": "polite" });
  player.search = node("p", { class: "rp-search", role: "status", hidden: true }, "Looking for flesh inside flesh…");
  const messages = scene.figures.filter((figure) => !figure.positions || figure.message).map((figure) =>
    node("li", {}, `${figure.label}: ${figure.positions ? "" : `${figure.status}. `}${figure.message}`));
  const missing = node("ul", { class: "rp-missing", hidden: !messages.length }, ...messages);
  player.root.replaceChildren(player.canvas, transport(player), timeline(player),
    figureChips(player), toggles(player), player.search, missing, help(player), player.live);
}
