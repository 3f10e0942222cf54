"use strict";
// Shows two clips side by side and sends each answer at once. All data is stored on the server. The address of the page
// contains the key that grants access, so all requests are below that address.

const SCALE = ["left much better", "left better", "left slightly better", "no preference",
  "right slightly better", "right better", "right much better"];
const at = (id) => document.getElementById(id);
const state = { code: null, item: null, began: 0, shownClips: null, sides: [], busy: false, pairs: [], place: 0 };

function show(id) {
  for (const each of ["welcome", "pair", "thanks"]) at(each).hidden = each !== id;
}

function showError(text) {
  at("fault").textContent = text ?? "";
  at("fault").hidden = !text;
}

async function request(path, body) {
  const sent = body && { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  let reply;
  try {
    reply = await fetch(`.${path}`, sent);
  } catch {
    throw new Error("The page is not reached; tell the person who runs the study, then try again.");
  }
  const content = await reply.json();
  if (!reply.ok) throw new Error(content.error);
  return content;
}

// Runs one action at a time: further key presses are ignored meanwhile.
async function once(work) {
  if (state.busy) return;
  state.busy = true;
  try {
    showError();
    await work();
  } catch (error) {
    showError(error.message);
  } finally {
    state.busy = false;
  }
}

// Clips. A picture restarts with a new address, so each replay makes one; a video is rewound.

async function load(address, video) {
  const reply = await fetch(`.${address}`);
  if (!reply.ok) throw new Error((await reply.json()).error);
  return { bytes: await reply.blob(), video, element: null };
}

async function prepare(side) {
  if (side.video && side.element) return side.element;
  const element = document.createElement(side.video ? "video" : "img");
  const unplayable = new Error("This browser cannot play this clip; tell the person who runs the study.");
  if (side.video) {
    Object.assign(element, { muted: true, playsInline: true, preload: "auto" });
    element.addEventListener("ended", replayAll);
    await new Promise((done, failed) => {
      element.oncanplaythrough = done;
      element.onerror = () => failed(unplayable);
      element.src = URL.createObjectURL(side.bytes);
    });
  } else {
    element.alt = "";
    element.src = URL.createObjectURL(side.bytes);
    await element.decode().catch(() => { throw unplayable; });
  }
  return element;
}

function replayAll() {
  if (state.sides.every((side) => side.element.ended)) play().catch((error) => showError(error.message));
}

function checkAlike([a, b]) {
  const far = Math.abs(a.duration - b.duration) > 0.1; // unknown durations are infinite, and not compared
  if (a.videoWidth !== b.videoWidth || a.videoHeight !== b.videoHeight || far)
    throw new Error("These two videos differ in size or length; tell the person who runs the study.");
}

async function play() {
  const sides = state.sides;
  if (!sides.length) return;
  const elements = await Promise.all(sides.map(prepare));
  if (sides[0].video) checkAlike(elements);
  const { naturalWidth, naturalHeight, videoWidth, videoHeight } = elements[0];
  at("clips").style.setProperty("--aspect", (naturalWidth ?? videoWidth) / (naturalHeight ?? videoHeight));
  elements.forEach((element, place) => {
    const side = sides[place];
    if (!side.video && side.element) URL.revokeObjectURL(side.element.src);
    side.element = element;
    at(place ? "right" : "left").replaceChildren(element);
  });
  if (sides[0].video) {
    for (const element of elements) element.currentTime = 0;
    await Promise.all(elements.map((element) => element.play()));
  }
}

async function showClips(pair) {
  const shownClips = `${pair.left} ${pair.right}`;
  if (state.shownClips === shownClips) return;
  for (const side of state.sides) if (side.element) URL.revokeObjectURL(side.element.src);
  for (const id of ["left", "right"]) at(id).replaceChildren();
  Object.assign(state, { shownClips: null, sides: [] });
  state.sides = await Promise.all([load(pair.left, pair.video), load(pair.right, pair.video)]);
  await play();
  state.shownClips = shownClips;
}

// Questions

function chosenPoint() {
  return Number(document.querySelector("#scale input:checked")?.value ?? 0);
}

function choose(point) {
  const button = document.querySelector(`#scale input[value="${point}"]`);
  if (!button) return;
  button.checked = true;
  button.focus();
  at("confirm").disabled = false;
}

async function showItem({ item, total }) {
  state.item = item;
  if (!item) {
    at("finished").textContent = `All ${total} answers of ${state.code} are kept.`;
    show("thanks");
    document.querySelector("#thanks button").focus();
    return;
  }
  at("asked").reset();
  at("confirm").disabled = true;
  document.activeElement?.blur();
  at("asked").hidden = false;
  at("question").textContent = item.question;
  const part = item.questions > 1 ? `, question ${item.ordinal} of ${item.questions}` : "";
  at("place").textContent = `Pair ${item.pair} of ${item.pairs}${part}`;
  show("pair");
  await showClips(item);
  state.began = performance.now();
}

const beginSession = () => once(async () => {
  const code = at("code").value.trim();
  const reply = await request("/next", { participant: code });
  state.code = code;
  await showItem(reply);
});

const confirm = () => once(async () => {
  const point = chosenPoint();
  if (!point || !state.item || !state.shownClips) return;
  const seconds = (performance.now() - state.began) / 1000;
  await showItem(await request("/answer", { participant: state.code, token: state.item.token, point, seconds }));
});

function welcome() {
  Object.assign(state, { code: null, item: null });
  at("welcome").reset();
  show("welcome");
  at("code").focus();
}

// Without questions: all pairs, with the names of their files.

const showPair = (step) => once(async () => {
  state.place = (state.place + step + state.pairs.length) % state.pairs.length;
  const pair = state.pairs[state.place];
  at("place").textContent = `${pair.name}, pair ${state.place + 1} of ${state.pairs.length}`;
  document.querySelectorAll("figcaption").forEach((caption, side) => { caption.textContent = pair.labels[side]; });
  await showClips(pair);
});

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || at("pair").hidden) return;
  const { key } = event;
  if (key === "Enter" && event.target.closest?.("button:not(#confirm)")) return;
  const step = { ArrowLeft: -1, ArrowRight: 1 }[key];
  if (key === "r" || key === "R") once(play);
  else if (at("asked").hidden && step) showPair(step);
  else if (at("asked").hidden) return;
  else if (/^[1-7]$/.test(key)) choose(Number(key));
  else if (step) choose(Math.min(7, Math.max(1, (chosenPoint() || 4) + step)));
  else if (key === "Enter") confirm();
  else return;
  event.preventDefault();
}

async function main() {
  SCALE.forEach((words, place) => {
    const label = document.createElement("label");
    const button = Object.assign(document.createElement("input"), { type: "radio", name: "point", value: place + 1 });
    const key = Object.assign(document.createElement("kbd"), { textContent: place + 1 });
    label.append(button, key, words);
    at("scale").append(label);
  });
  at("scale").addEventListener("change", () => { at("confirm").disabled = false; });
  for (const [id, work] of [["welcome", beginSession], ["asked", confirm], ["thanks", welcome]])
    at(id).addEventListener("submit", (event) => { event.preventDefault(); work(); });
  for (const button of document.querySelectorAll(".replay")) button.addEventListener("click", () => once(play));
  at("back").addEventListener("click", () => showPair(-1));
  at("forth").addEventListener("click", () => showPair(1));
  document.addEventListener("keydown", onKey);
  const study = await request("/study");
  if (study.blind) return welcome();
  state.pairs = study.pairs;
  at("looked").hidden = false;
  show("pair");
  await showPair(0);
}

main().catch((error) => showError(error.message));
