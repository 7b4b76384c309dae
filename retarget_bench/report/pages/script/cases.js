/* What is asked for, the cases that answer it, and the player with one of them. */
const data = JSON.parse(document.getElementById("report-data").textContent);
/* Where only some cases are here, the others are holes. */
for (const split of data.chapters.flatMap((chapter) => chapter.splits)) {
  if (split.kept) {
    const spread = (row) => Object.assign([], Object.fromEntries(row.map((each, k) => [split.kept[k], each])));
    split.cases = spread(split.cases);
    for (const [id, rows] of Object.entries(split.numbers)) split.numbers[id] = rows.map(spread);
  }
}
const at = (id) => document.getElementById(id);
const MOST = 150;
/* parts: groups of the cases; list: cases with numbers of their own, which are of what; only: which cases;
   open: those without a number first; bare: what is asked about instead of a method; notes: sentences. */
const NOTHING = { parts: {}, list: null, what: "", only: null, open: false, bare: "", notes: [] };
const asked = { chapter: 0, split: 0, method: 0, value: 0, ...NOTHING };
let shown = null; /* [chapter, split, case] that the player shows */
let playing = null;
let answers = []; /* what the player calls the methods of the case that it shows */

const splitNow = () => data.chapters[asked.chapter].splits[asked.split];
const valueNow = () => splitNow().values[asked.value];

/* How bad a number is: the larger the worse. */
function badness(value, number) {
  if (value.better === "higher") return -number;
  if (value.better !== "target") return number;
  return number / value.goal > 0 ? Math.abs(Math.log(number / value.goal)) : Infinity;
}

/* [case, number or null], worst first; without a number last, or first where asked so. */
function listed() {
  const split = splitNow();
  if (asked.list) return asked.list.filter(([k]) => split.cases[k] && matches(split.cases[k], k));
  const value = valueNow();
  const numbers = asked.bare ? [] : split.numbers[value.id][asked.method];
  const found = [];
  split.cases.forEach((each, k) => {
    if (matches(each, k)) found.push([k, numbers[k] ?? null]);
  });
  const key = ([, number]) => (number === null ? (asked.open ? Infinity : -Infinity) : badness(value, number));
  return found.sort((a, b) => (key(b) > key(a) ? 1 : key(b) < key(a) ? -1 : a[0] - b[0]));
}

function matches(each, k) {
  if (asked.only && !asked.only(k)) return false;
  if (!Object.entries(asked.parts).every(([by, part]) => each[by] === part)) return false;
  const words = at("name").value.toLowerCase().split(/\s+/).filter(Boolean);
  const text = `${each.id} ${each.kind} ${each.level || ""}`.toLowerCase();
  return words.every((word) => text.includes(word));
}

const element = (name, text, attributes) => {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  return Object.assign(made, attributes || {});
};

function fill(select, names, chosen) {
  select.replaceChildren(...names.map((name, k) => element("option", name, { value: String(k) })));
  select.value = String(chosen);
  select.parentNode.hidden = names.length < 2;
}

function drawControls() {
  const split = splitNow();
  fill(at("chapter"), data.chapters.map((each) => each.title), asked.chapter);
  fill(at("split"), data.chapters[asked.chapter].splits.map((each) => each.name), asked.split);
  fill(at("method"), split.methods, asked.method);
  fill(at("value"), split.values.map((each) => each.label + (each.unit ? `, ${each.unit}` : "")), asked.value);
}

/* What is said below a case: why there is no answer, and whether its number counts in means. */
function remark(split, k) {
  if (asked.bare) return split.cases[k].reason;
  const value = valueNow();
  const apart = !asked.list && value.among.includes(asked.method) && value.alone.includes(k);
  const why = apart ? "not in the means of ranked methods: one of them has no number here" : "";
  return [split.lost[asked.method][k] || split.cases[k].reason, why].filter(Boolean).join("; ");
}

function drawRow([k, number]) {
  const split = splitNow();
  const each = split.cases[k];
  const row = element("tr");
  const name = element("td");
  const title = `${each.clip}: ${each.source} to ${each.target}`;
  if (each.scene >= 0) {
    const button = element("button", `▶ ${title}`, { type: "button" });
    button.addEventListener("click", () => show(asked.chapter, asked.split, k));
    name.append(button);
  } else {
    name.append(element("span", title, { className: "still", title: each.reason || each.id }));
  }
  const more = remark(split, k);
  if (more) name.append(element("small", more));
  const digits = asked.list ? 2 : valueNow().decimals;
  row.append(name, element("td", each.level || (each.kind === "unknown" ? "–" : each.kind)), element("td", number === null ? "–" : number.toFixed(digits)));
  if (shown && shown[0] === asked.chapter && shown[1] === asked.split && shown[2] === k) row.setAttribute("aria-current", "true");
  return row;
}

function drawList() {
  const split = splitNow();
  const found = listed();
  at("cases").replaceChildren(...found.slice(0, MOST).map(drawRow));
  at("number").textContent = asked.list ? asked.what : valueNow().label;
  const more = found.length > MOST ? `, the first ${MOST} shown` : "";
  const moving = found.filter(([k]) => split.cases[k].scene >= 0).length;
  const parts = Object.entries(asked.parts).map(([by, part]) => `, ${by} ${part}`).join("");
  at("what").textContent =
    `${split.name}, ${asked.bare || split.methods[asked.method]}${parts}${asked.list ? `: worst by ${asked.what}` : ""}: ` +
    `${found.length} ${found.length === 1 ? "case" : "cases"}${more}, ` +
    (moving ? `${moving} with motion in this file (▶).` : "none of them with motion in this file (bench report --case ID adds one).");
  at("why").textContent = asked.notes.join(" ");
  at("clear").hidden = !(Object.keys(asked.parts).length || asked.list || asked.only || asked.bare || at("name").value);
  return found;
}

/* The player with a case, its source, reference and the methods asked for. */
function show(chapter, number, k, methods) {
  const split = data.chapters[chapter].splits[number];
  const each = split.cases[k];
  shown = [chapter, number, k];
  const kind = [each.kind === "unknown" ? "" : each.kind, each.level].filter(Boolean).join(", ");
  at("lost").replaceChildren();
  at("caption").textContent = `${split.name}: ${each.clip}, ${each.source} to ${each.target}` + (kind ? ` (${kind})` : "");
  const gone = split.methods.flatMap((name, m) => (split.lost[m][k] ? [`${name}: ${split.lost[m][k]}`] : []));
  if (playing) playing.destroy();
  playing = null;
  if (each.scene >= 0) {
    const scene = JSON.parse(at(`scene-${each.scene}`).textContent);
    const own = scene.figures.filter((figure) => figure.part === "prediction").map((figure) => figure.label);
    const once = scene.figures.some((figure) => figure.part === "reference");
    answers = split.labels.map((label) => (once && label === "reference" ? label : own.shift()));
    const colours = Object.fromEntries(answers.map((name, m) => [name, data.colours[split.labels[m]]]));
    if (once) delete colours.reference;
    const labels = figures(methods || (asked.bare ? [] : beside(asked.method)));
    playing = RetargetPlayer.mount(at("player"), scene, { labels, colours, autoplay: true });
  } else {
    at("lost").replaceChildren(...gone.map((text) => element("li", text)));
  }
  drawList();
}

/* What the player is to show: a method may be called otherwise there, lest it be taken for the reference. */
const figures = (methods) => ["source", "reference", ...methods.map((m) => answers[m])];

/* A method and one to compare it with: the best of those that are seen without being asked for, or the next. */
const beside = (method) => [method, ...splitNow().seen.filter((m) => m !== method).slice(0, 1)];

/* Whatever was asked beyond a method and a value is forgotten. */
function forget() {
  Object.assign(asked, NOTHING);
}
