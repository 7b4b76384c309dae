/* The page of bench view: asks its server for cases, shows one, and looks now and then whether anything changed. */

const POLL = 2000; // milliseconds
const STOPPED = "bench view has stopped; start it again to go on.";
const at = (id) => document.getElementById(id);
let cases = {}, state = null, shown = null, known = "", player = null;

async function asked(path, query = {}) {
  const answer = await fetch(`${path}?${new URLSearchParams(query)}`);
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

function say(words) {
  at("words").textContent = words;
}

/* The case that the address names; "" where it names none. */
function named() {
  try {
    return decodeURIComponent(location.hash.slice(1));
  } catch {
    return "";
  }
}

/* Shows a case from its beginning; where it has changed, as it was looked at before. */
async function show(id) {
  const again = id === shown && player ? player.state() : null;
  [shown, known] = [id, cases[id]];
  location.replace(`#${encodeURIComponent(id)}`);
  say("Loading the motion…");
  try {
    const scene = await asked("/scene", { case: id });
    if (shown !== id) return;
    if (player) player.destroy();
    document.title = `${scene.title} · bench view`;
    player = RetargetPlayer.mount(at("player"), scene, {
      skins: true, autoplay: true, ...(again && { state: again }),
      inside: (figure, frame) => asked("/inside", { case: id, figure, frame }),
    });
    say("");
  } catch (error) {
    if (shown === id) failed(error);
  }
}

/* Nothing is drawn beside a sentence that says why. */
function failed(error) {
  if (player) player.destroy();
  player = null;
  say(error instanceof TypeError ? STOPPED : String(error.message)); // no answer at all, or a refusal
}

/* Lists the cases that there are now, and shows one anew only if it is another, or has changed. */
async function list() {
  const told = await asked("/cases");
  ({ cases, state } = told);
  const ids = Object.keys(cases), box = at("case");
  box.replaceChildren(...ids.map((id) => new Option(id, id)));
  box.parentElement.hidden = ids.length < 2;
  if (!ids.length) {
    const why = shown === null ? "Waiting for the first case…" : "These results are not there any more.";
    return failed(new Error(told.problem || why));
  }
  const id = [shown, named(), told.first, ids[0]].find((each) => ids.includes(each));
  box.value = id;
  if (id !== shown || cases[id] !== known || !player) await show(id);
  else say("");
  if (told.problem) say(told.problem);
}

async function look() {
  if (document.hidden) return;
  try {
    const now = await asked("/state");
    if (now !== state || at("words").textContent === STOPPED) await list();
  } catch (error) {
    say(error instanceof TypeError ? STOPPED : String(error.message)); // what is drawn is still what it was
  }
}

at("case").addEventListener("change", () => show(at("case").value));
look();
setInterval(look, POLL);
document.addEventListener("visibilitychange", look);
