/* Keys, selects and the first case. */

/* The arrow keys go to the nearest mark in their direction; a chart is one stop of the tab key. */
function step(mark, key) {
  const centre = (each) => {
    const box = each.getBoundingClientRect();
    return [box.x + box.width / 2, box.y + box.height / 2];
  };
  const [x, y] = centre(mark);
  const along = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
  let best = null;
  for (const each of mark.closest("svg").querySelectorAll(".pick")) {
    if (each === mark || !each.getClientRects().length) continue;
    const [dx, dy] = centre(each).map((place, k) => place - [x, y][k]);
    const ahead = dx * along[0] + dy * along[1];
    const aside = Math.abs(dx * along[1]) + Math.abs(dy * along[0]);
    if (ahead > 0.3 && (!best || ahead + 3 * aside < best[0])) best = [ahead + 3 * aside, each];
  }
  if (best) focus(best[1]);
}

function focus(mark) {
  for (const each of mark.closest("svg").querySelectorAll('.pick[tabindex="0"]')) each.setAttribute("tabindex", "-1");
  mark.setAttribute("tabindex", "0");
  mark.focus();
}

/* The first mark of a chart that is seen is its stop. */
function stop(chart) {
  const seen = [...chart.querySelectorAll(".pick")].filter((each) => each.getClientRects().length);
  for (const each of chart.querySelectorAll('.pick[tabindex="0"]')) each.setAttribute("tabindex", "-1");
  if (seen.length) seen[0].setAttribute("tabindex", "0");
}

/* Methods are switched off and on by a class of their chapter. */
function beginLegends() {
  for (const button of document.querySelectorAll(".legend button")) {
    button.addEventListener("click", () => {
      const chapter = button.closest(".chapter");
      const off = chapter.classList.toggle(`off-${button.dataset.style}`);
      button.setAttribute("aria-pressed", String(!off));
      for (const chart of chapter.querySelectorAll("svg.chart")) stop(chart);
    });
  }
}

function beginMarks() {
  for (const mark of document.querySelectorAll(".pick")) {
    mark.setAttribute("role", "button");
    mark.setAttribute("tabindex", "-1");
  }
  for (const chart of document.querySelectorAll("main svg.chart")) stop(chart);
  document.querySelector("main").addEventListener("click", (event) => {
    const mark = event.target.closest(".pick");
    if (mark) pressed(mark);
  });
  /* What a mark says in words is its tooltip, too. */
  document.querySelector("main").addEventListener("pointerover", (event) => {
    const mark = event.target.closest(".pick:not(:has(title))");
    if (!mark) return;
    const title = document.createElementNS("http://www.w3.org/2000/svg", "title");
    title.textContent = mark.getAttribute("aria-label");
    mark.prepend(title);
  });
  document.querySelector("main").addEventListener("keydown", (event) => {
    const mark = event.target.closest(".pick");
    if (!mark) return;
    if (event.key === "Enter" || event.key === " ") pressed(mark);
    else if (event.key.startsWith("Arrow")) step(mark, event.key);
    else return;
    event.preventDefault();
  });
}

function chosen(name) {
  const method = splitNow().methods[asked.method];
  const value = valueNow().id;
  const parts = asked.parts;
  forget();
  if (name === "method" || name === "value") asked.parts = parts;
  asked[name] = Number(at(name).value);
  if (name === "chapter") asked.split = 0;
  if (name === "chapter" || name === "split") {
    asked.method = Math.max(0, splitNow().methods.indexOf(method));
    asked.value = Math.max(0, splitNow().values.findIndex((each) => each.id === value));
  }
  widen();
  drawControls();
  drawList();
  if (name === "method" && playing) playing.select(figures(beside(asked.method)));
}

function beginControls() {
  for (const name of ["chapter", "split", "method", "value"]) at(name).addEventListener("change", () => chosen(name));
  at("name").addEventListener("input", drawList);
  at("asked").addEventListener("submit", (event) => event.preventDefault());
  at("clear").addEventListener("click", () => {
    at("name").value = "";
    forget();
    drawList();
  });
  at("back").addEventListener("click", () => {
    from.scrollIntoView({ block: "center" });
    from.focus();
  });
}

for (const table of document.querySelectorAll("table.results")) linkTable(table);
for (const table of document.querySelectorAll("main table.problems")) linkProblems(table);
beginMarks();
beginLegends();
beginControls();
if (data.first) {
  [asked.chapter, asked.split] = data.first.case;
  asked.method = data.first.methods[data.first.methods.length - 1];
}
drawControls();
if (data.first) show(...data.first.case, data.first.methods);
else drawList();
