/* The page of bench view: asks its server for cases, shows one, and looks now and then whether anything changed. */

const POLL = 2000; // milliseconds
const at = (id) => document.getElementById(id);
let state = null, shown = null, player = null;

async function asked(path, query = {}) {
  const answer = await fetch(`${path}?${new URLSearchParams(query)}`);
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

/* Shows a case from its beginning, or at the frame where it was before it changed. */
async function show(id, frame = 0) {
  shown = id;
  location.replace(`#${encodeURIComponent(id)}`);
  at("words").textContent = "Loading the motion…";
  const labels = player && player.chosen();
  try {
    const scene = await asked("/scene", { case: id });
    if (shown !== id) return;
    if (player) player.destroy();
    document.title = `${scene.title} · bench view`;
    player = RetargetPlayer.mount(at("player"), scene, {
      skins: true, frame, autoplay: !frame, labels: labels && scene.figures.some((each) => labels.includes(each.label)) ? labels : undefined,
      inside: (figure, frame) => asked("/inside", { case: id, figure, frame }),
    });
    at("words").textContent = "";
  } catch (error) {
    at("words").textContent = String(error.message || error);
  }
}

/* Lists the cases that there are now; keeps the one that is shown. */
async function list() {
  const told = await asked("/cases");
  state = told.state;
  const box = at("case");
  box.replaceChildren(...told.cases.map((id) => new Option(id, id)));
  box.parentElement.hidden = told.cases.length < 2;
  if (!told.cases.length) {
    at("words").textContent = told.problem || "Waiting for the first case…";
    return;
  }
  const wanted = [shown, decodeURIComponent(location.hash.slice(1)), told.first, told.cases[0]];
  const id = wanted.find((each) => told.cases.includes(each));
  box.value = id;
  await show(id, id === shown && player ? player.frame() : 0);
}

async function look() {
  if (document.hidden) return;
  try {
    if ((await asked("/state")) !== state) await list();
  } catch {
    at("words").textContent = "bench view has stopped; start it again to go on.";
  }
}

at("case").addEventListener("change", () => show(at("case").value));
list();
setInterval(look, POLL);
document.addEventListener("visibilitychange", look);
