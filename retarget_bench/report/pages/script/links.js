/* From numbers and marks to their cases. */
const GROUPS = ["kind", "pair", "clip", "level", "structure"];
let from = null; /* the number that was pressed */

const chapterOf = (node) => Number(node.closest("[data-chapter]").dataset.chapter);
const splitOf = (chapter, name) => data.chapters[chapter].splits.find((each) => each.name === name);

/* From a number or a mark to its cases, and to the first of them that is here in motion. */
function go(origin, wish) {
  const { chapter, split: name, method, value, ...rest } = wish;
  asked.chapter = chapter;
  asked.split = Math.max(0, data.chapters[chapter].splits.findIndex((each) => each.name === name));
  const split = splitNow();
  asked.method = Math.max(0, split.methods.indexOf(method));
  asked.value = Math.max(0, split.values.findIndex((each) => each.id === value));
  forget();
  Object.assign(asked, rest, { notes: [...(rest.notes || [])] });
  at("name").value = "";
  widen();
  drawControls();
  for (const each of document.querySelectorAll(".now")) each.classList.remove("now");
  origin.closest("td, .pick").classList.add("now");
  from = origin;
  at("back").hidden = false;
  const first = drawList().find(([k]) => split.cases[k].scene >= 0);
  if (first) show(asked.chapter, asked.split, first[0]);
  const smooth = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  at("watch").scrollIntoView({ behavior: smooth ? "smooth" : "auto", block: "nearest" });
  if (getComputedStyle(at("watch")).position !== "sticky") {
    at("watch").scrollIntoView({ behavior: smooth ? "smooth" : "auto", block: "start" });
    at("watch-title").focus({ preventScroll: true });
  }
}

/* Very many cases are not all listed: what has none of its own leads to the nearest that are. */
function widen() {
  if (listed().length) return;
  if (asked.list) {
    asked.notes.push(`The very cases are not in this page; these are by ${splitNow().values[0].label}.`);
    Object.assign(asked, { list: null, what: "", value: 0 });
  }
  if (!listed().length && Object.keys(asked.parts).length) {
    const parts = Object.entries(asked.parts).map(([by, part]) => `${by} ${part}`).join(", ");
    asked.notes.push(`Which cases are of ${parts} is not in this page; these are all that are listed.`);
    asked.parts = {};
  }
}

/* The first words of a cell become a button; the whole cell is pressed. */
function link(cell, words, wish) {
  const text = cell.firstChild;
  const button = element("button", text.textContent, { type: "button", className: "num" });
  button.setAttribute("aria-label", `${button.textContent}: ${words}; show its cases`);
  text.replaceWith(button);
  cell.addEventListener("click", (event) => {
    if (!event.target.closest("a")) go(button, wish);
  });
}

const titleOf = (head) => head.querySelector(".label").innerText.replace(/\s*⇅/, "").trim();

/* Numbers of tables become buttons. A table of several splits says in its heads which. */
function linkTable(table) {
  const chapter = chapterOf(table);
  const heads = [...table.tHead.rows[0].cells].map((head) => [
    head, splitOf(chapter, head.dataset.split || table.dataset.split)]);
  for (const row of table.querySelectorAll("tbody tr[data-row]")) {
    for (const cell of row.querySelectorAll("td[data-sort]")) {
      const [head, known] = heads[cell.cellIndex];
      const wish = known && wishOf(table.dataset, head, row.dataset.row, known);
      if (wish) link(cell, `${row.dataset.row}, ${titleOf(head)}`, { chapter, split: known.name, ...wish });
    }
  }
  if (!table.tFoot) return;
  for (const cell of table.tFoot.querySelectorAll("td")) {
    const [head, known] = heads[cell.cellIndex];
    const value = known && known.values.find((each) => each.id === head.dataset.column);
    if (!value || !cell.textContent.trim()) continue;
    const only = (k) => !value.alone.includes(k);
    link(cell, `common cases, ${value.label}`, { chapter, split: known.name, method: known.methods[value.among[0]], value: value.id, only });
  }
}

/* What a cell of a table asks for, in the column of this head and the row of this name; null for nothing. */
function wishOf({ by, subject, structure, kind }, head, row, known) {
  const column = head.dataset.column || "";
  if (structure !== undefined) return ofSet(row, head, known, { structure, ...(kind ? { kind } : {}) });
  const method = subject ? column || known.methods[0] : row;
  if (!known.methods.includes(method)) return null;
  const parts = subject && GROUPS.includes(by) ? { [by]: row } : {};
  if (!column) return { method, value: subject || known.values[0].id, parts, open: true, notes: [] };
  const value = subject || column;
  const notes = known.values.some((each) => each.id === value)
    ? []
    : [`Of ${titleOf(head)} there is no number per case; those below are ${known.values[0].label}.`];
  return { method, value, parts, notes };
}

/* A value of a whole set leads to the set: the answers that are in it, and what they are compared with. */
function ofSet(row, head, known, parts) {
  const bare = known.methods.includes(row) ? "" : row;
  const answers = "all answers to these cases, as one set, are compared with";
  const single = known.numbers[known.values[0].id].some((row) => row.some((number) => number !== null));
  const numbers = single ? `Numbers below are of single cases: ${known.values[0].label}.` : "Single cases have no number here.";
  const told = known.paired
    ? bare
      ? "the right answers to these cases are compared with each other, half of the clips with the other half."
      : `${answers} the right answers to them (the reference). ${numbers}`
    : bare
      ? "real motion of such bodies, which is not in this page, is compared with itself. Answers are to these cases."
      : `${answers} other real motion of such bodies, which is not in this page. ${numbers}`;
  return { method: row, value: known.values[0].id, parts, bare, notes: [`${titleOf(head)}: ${told}`] };
}

/* Counts of cases without an answer lead to them. */
function linkProblems(table) {
  const chapter = chapterOf(table);
  for (const row of table.tBodies[0].rows) {
    const [split, method] = [...row.cells].map((cell) => cell.textContent);
    const known = splitOf(chapter, split);
    const m = known ? known.methods.indexOf(method) : -1;
    if (m < 0) continue;
    const { status, message } = row.dataset;
    const told = (k) => known.lost[m][k] || "";
    const only = (k) => (message ? told(k) === `${status}: ${message}` : told(k).startsWith(`${status}: `));
    const words = row.cells[3].firstChild;
    words.splitText(words.textContent.indexOf(":"));
    link(row.cells[3], `${method}, ${split}, ${status}`, { chapter, split, method, value: known.values[0].id, only });
  }
}

/* What the marks of a chart, or of a method in it, have in common, is said once. */
function pressed(mark) {
  const { split, value } = mark.closest("svg").dataset;
  const { method } = mark.closest("[data-method]").dataset;
  const { worst, what } = mark.dataset;
  const by = GROUPS.find((each) => mark.dataset[each] !== undefined);
  const wish = { chapter: chapterOf(mark), split, method, value, what: what || "", parts: by ? { [by]: mark.dataset[by] } : {} };
  if (worst !== undefined) wish.list = worst.split(" ").filter(Boolean).map((pair) => pair.split(":").map(Number));
  go(mark, wish);
}
