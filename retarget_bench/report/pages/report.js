"use strict";
(() => {
  const data = JSON.parse(document.getElementById("report-data").textContent);
  /* Where only some cases are listed, the others are holes. */
  for (const split of data.chapters.flatMap((chapter) => chapter.splits)) {
    if (!split.kept) continue;
    const spread = (row) => Object.assign([], Object.fromEntries(row.map((each, k) => [split.kept[k], each])));
    split.cases = spread(split.cases);
    for (const [id, rows] of Object.entries(split.numbers)) split.numbers[id] = rows.map(spread);
  }
  const at = (id) => document.getElementById(id);
  const GROUPS = ["kind", "pair", "clip", "level", "structure"];
  const MOST = 150;
  /* What is asked for: a split, a method, a value, and one group of the cases or a list of them. */
  const asked = { chapter: 0, split: 0, method: 0, value: 0, by: "", part: "", list: null, what: "" };
  let shown = null; /* [chapter, split, case] that the player shows */
  let playing = null;
  let answers = []; /* what the player calls the methods of the case that it shows */
  let from = null; /* the number that was pressed */

  const splitNow = () => data.chapters[asked.chapter].splits[asked.split];
  const valueNow = () => splitNow().values[asked.value];

  /* How bad a number is: the larger the worse. */
  function badness(value, number) {
    if (value.better === "higher") return -number;
    if (value.better !== "target") return number;
    return number / value.goal > 0 ? Math.abs(Math.log(number / value.goal)) : Infinity;
  }

  /* [case, number or null], worst first; without a number last. */
  function listed() {
    const split = splitNow();
    if (asked.list) return asked.list.filter(([each]) => split.cases[each] && matches(split.cases[each]));
    const value = valueNow();
    const numbers = split.numbers[value.id][asked.method];
    const found = split.cases.map((each, k) => [k, numbers[k]]).filter(([k]) => {
      const each = split.cases[k];
      return (!asked.by || each[asked.by] === asked.part) && matches(each);
    });
    const key = ([, number]) => (number === null ? -Infinity : badness(value, number));
    return found.sort((a, b) => (key(b) > key(a) ? 1 : key(b) < key(a) ? -1 : a[0] - b[0]));
  }

  function matches(each) {
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

  function drawList() {
    const split = splitNow();
    const found = listed();
    const lost = split.lost[asked.method];
    const rows = found.slice(0, MOST).map(([k, number]) => {
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
      if (lost[k]) name.append(element("small", lost[k]));
      else if (each.reason) name.append(element("small", each.reason));
      const digits = asked.list ? 2 : valueNow().decimals;
      row.append(name, element("td", each.level || each.kind), element("td", number === null ? "–" : number.toFixed(digits)));
      if (shown && shown[0] === asked.chapter && shown[1] === asked.split && shown[2] === k) row.setAttribute("aria-current", "true");
      return row;
    });
    at("cases").replaceChildren(...rows);
    at("number").textContent = asked.list ? asked.what : valueNow().label;
    const more = found.length > MOST ? `, the first ${MOST} shown` : "";
    const moving = found.filter(([k]) => split.cases[k].scene >= 0).length;
    const part = asked.by ? `, ${asked.by} ${asked.part}` : "";
    at("what").textContent =
      `${split.name}, ${split.methods[asked.method]}${part}${asked.list ? `: worst by ${asked.what}` : ""}: ` +
      `${found.length} ${found.length === 1 ? "case" : "cases"}${more}, ` +
      (moving ? `${moving} with motion in this file (▶).` : "none of them with motion in this file (bench report --case ID adds one).");
    at("clear").hidden = !(asked.by || asked.list || at("name").value);
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
      answers = scene.figures.filter((figure) => figure.part === "prediction").map((figure) => figure.label);
      const colours = Object.fromEntries(answers.map((name, m) => [name, data.colours[split.labels[m]]]));
      playing = RetargetPlayer.mount(at("player"), scene, { labels: figures(methods || [asked.method]), colours });
    } else {
      at("lost").replaceChildren(...gone.map((text) => element("li", text)));
    }
    drawList();
  }

  /* What the player is to show: a method may be called otherwise there, lest it be taken for the reference. */
  const figures = (methods) => ["source", "reference", ...methods.map((m) => answers[m])];

  /* From a number or a mark to its cases, and to the first of them that is here in motion. */
  function go(origin, wish) {
    asked.chapter = wish.chapter;
    const splits = data.chapters[asked.chapter].splits;
    asked.split = Math.max(0, splits.findIndex((each) => each.name === wish.split));
    const split = splitNow();
    asked.method = Math.max(0, split.methods.indexOf(wish.method));
    asked.value = Math.max(0, split.values.findIndex((each) => each.id === wish.value));
    asked.by = wish.by || "";
    asked.part = wish.part || "";
    asked.list = wish.list || null;
    asked.what = wish.what || "";
    at("name").value = "";
    drawControls();
    for (const each of document.querySelectorAll(".now")) each.classList.remove("now");
    const lit = origin.closest("td, .pick");
    lit.classList.add("now");
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

  const chapterOf = (node) => Number(node.closest("[data-chapter]").dataset.chapter);

  /* Numbers of tables become buttons. */
  function linkTable(table) {
    const { split, by, subject } = table.dataset;
    const chapter = chapterOf(table);
    const known = data.chapters[chapter].splits.find((each) => each.name === split);
    if (!known || (subject && !GROUPS.includes(by))) return;
    const heads = table.tHead.rows[0].cells;
    for (const row of table.querySelectorAll("tbody tr[data-row]")) {
      for (const cell of row.querySelectorAll("td[data-sort]")) {
        const column = heads[cell.cellIndex].dataset.column;
        if (!column) continue;
        const value = subject || (column === "fps" ? known.values[0].id : column);
        const method = subject ? column : row.dataset.row;
        if (!known.methods.includes(method) || !known.values.some((each) => each.id === value)) continue;
        const button = element("button", cell.firstChild.textContent, { type: "button", className: "num" });
        button.setAttribute("aria-label", `${button.textContent}: ${method}, ${subject ? row.dataset.row : heads[cell.cellIndex].innerText.split("\n")[0]}; show its cases`);
        cell.firstChild.replaceWith(button);
        const part = subject ? { by, part: row.dataset.row } : {};
        cell.addEventListener("click", (event) => {
          if (!event.target.closest("a")) go(button, { chapter, split, method, value, ...part });
        });
      }
    }
  }

  function pressed(mark) {
    const { split, method, value, worst, what } = mark.dataset;
    const by = GROUPS.find((each) => mark.dataset[each] !== undefined);
    const wish = { chapter: chapterOf(mark), split, method, value, what };
    if (by) Object.assign(wish, { by, part: mark.dataset[by] });
    if (worst !== undefined) {
      wish.list = worst.split(" ").filter(Boolean).map((pair) => pair.split(":").map(Number));
    }
    go(mark, wish);
  }

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
      if (each === mark) continue;
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

  function begin() {
    for (const table of document.querySelectorAll("main table.results")) linkTable(table);
    for (const chart of document.querySelectorAll("main svg.chart")) {
      const first = chart.querySelector(".pick");
      if (first) first.setAttribute("tabindex", "0");
    }
    document.querySelector("main").addEventListener("click", (event) => {
      const mark = event.target.closest(".pick");
      if (mark) pressed(mark);
    });
    document.querySelector("main").addEventListener("keydown", (event) => {
      const mark = event.target.closest(".pick");
      if (!mark) return;
      if (event.key === "Enter" || event.key === " ") pressed(mark);
      else if (event.key.startsWith("Arrow")) step(mark, event.key);
      else return;
      event.preventDefault();
    });
    for (const name of ["chapter", "split", "method", "value"]) {
      at(name).addEventListener("change", () => {
        const method = splitNow().methods[asked.method];
        const value = valueNow().id;
        asked[name] = Number(at(name).value);
        if (name === "chapter") asked.split = 0;
        if (name === "chapter" || name === "split") {
          asked.method = Math.max(0, splitNow().methods.indexOf(method));
          asked.value = Math.max(0, splitNow().values.findIndex((each) => each.id === value));
          asked.by = "";
        }
        asked.list = null;
        drawControls();
        drawList();
        if (name === "method" && playing) playing.select(figures([asked.method]));
      });
    }
    at("name").addEventListener("input", drawList);
    at("asked").addEventListener("submit", (event) => event.preventDefault());
    at("clear").addEventListener("click", () => {
      at("name").value = "";
      asked.by = "";
      asked.list = null;
      drawList();
    });
    at("back").addEventListener("click", () => {
      from.scrollIntoView({ block: "center" });
      from.focus();
    });
    if (data.first) {
      asked.chapter = data.first[0];
      asked.split = data.first[1];
    }
    drawControls();
    if (data.first) show(...data.first, [0, 1].slice(0, splitNow().methods.length));
    else drawList();
  }

  begin();
})();
