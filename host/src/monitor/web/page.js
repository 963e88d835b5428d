// Receives the state over a WebSocket and shows it.

const at = id => document.getElementById(id);
// Time without any text after which the connection counts as lost, ms: the command sends one at least every 3 s.
const SILENCE_MS = 9000;
const AGAIN_MS = 1000;
// Largest number of doublings of the frequency scale, as on the terminal.
const FINEST_ZOOM = 5;
const NAMES = {".": "air", q: "quiet", H: "chatter", D: "chatter", F: "forced", R: "forced", "?": "unsure", "|": "gone"};

const state = {head: null, strip: null, history: null, lobes: null, spectrum: {}, map: {}};
const chosen = {band: "structure", axes: [0, 1], zoom: null, frozen: null, cleared: -1};
let stale = new Set(), asked = false, alive = 0, drawnSpeed;

function take(frame) {
  alive = Date.now();
  document.body.dataset.link = "up";
  if (frame.topic === "alive") return;
  if (frame.topic === "spectrum" || frame.topic === "map") state[frame.topic][frame.band] = frame;
  else state[frame.topic] = frame;
  // Words at once; pictures with the next frame of the screen.
  if (frame.topic === "head" && !chosen.frozen) showHead(frame);
  redraw(frame.topic);
  if (frame.topic !== "head") return;
  // The lobes are many shapes: they are drawn again only where the speed has moved.
  const speed = frame.rpm === null ? null : Math.round(frame.rpm);
  redraw("spectrum");
  if (speed !== drawnSpeed) redraw("lobes");
  drawnSpeed = speed;
}

const put = (id, text) => { if (at(id).textContent !== text) at(id).textContent = text; };

function showHead(head) {
  const {body} = document;
  body.dataset.verdict = head.verdict || "none";
  body.dataset.connection = head.connection;
  put("word", head.word);
  put("rpm", head.rpm === null ? "?" : head.rpm.toFixed(0));
  put("connection", `${head.port}: ${head.connection_text}`);
  for (const id of ["device", "sentence", "advice", "reason", "margin"]) put(id, head[id]);
  document.title = `${head.word} ${at("rpm").textContent} · quietcut`;
}

function showStrip(strip) {
  const width = parseFloat(getComputedStyle(document.documentElement).fontSize) * 0.85;
  const room = Math.floor(at("strip").clientWidth / width);
  const cells = strip.letters.slice(-room).split("").map(letter => {
    const cell = document.createElement("span");
    cell.className = NAMES[letter] || "unsure";
    cell.textContent = letter;
    return cell;
  });
  at("strip").replaceChildren(...cells);
  put("strip-legend", `verdicts, newest at the right, ${strip.cell_s} s each: . in air, q quiet, H Hopf, D doubling, F forced, R runout, ? unsure, | no device`);
}

function showHistory(history) {
  at("history").replaceChildren(...history.lines.map(line => {
    const item = document.createElement("li");
    item.textContent = line.trim();
    return item;
  }));
}

const newest = map => map && map.points.length > 0 ? map.points[map.points.length - 1][3] : -1;

function drawAll() {
  asked = false;
  const topics = stale, shown = chosen.frozen || state;
  stale = new Set();
  const head = shown.head || {rpm: null, tooth_hz: null, chatter_hz: null};
  if (topics.has("strip") && shown.strip) showStrip(shown.strip);
  if (topics.has("history") && shown.history) showHistory(shown.history);
  if (topics.has("spectrum")) {
    drawSpectrum(at("spectrum"), shown.spectrum[chosen.band], head, chosen.zoom);
    put("spectrum-note", `${chosen.band} band`);
  }
  if (topics.has("map")) {
    const map = shown.map[chosen.band];
    // A device that was started again counts its tooth passings from 0.
    if (map && map.points.length > 0 && newest(map) < chosen.cleared) chosen.cleared = -1;
    const points = map ? map.points.filter(point => point[3] > chosen.cleared) : [];
    put("map-note", drawMap(at("map"), map && {points}, chosen.axes));
  }
  if (topics.has("lobes")) {
    put("lobes-note", drawLobes(at("lobes"), shown.lobes, head));
    lobesLegend(at("lobes-legend"), shown.lobes);
  }
}

function redraw(topic) {
  if (chosen.frozen) return;
  stale.add(topic);
  if (!asked) { asked = true; requestAnimationFrame(drawAll); }
}

function redrawAll() {
  ["strip", "history", "spectrum", "map", "lobes"].forEach(topic => stale.add(topic));
  if (!asked) { asked = true; requestAnimationFrame(drawAll); }
  for (const button of document.querySelectorAll("button[data-band]")) button.ariaPressed = String(button.dataset.band === chosen.band);
  for (const button of document.querySelectorAll("button[data-axes]")) button.ariaPressed = String(button.dataset.axes === chosen.axes.join(""));
  document.querySelector("button[data-zoom=fit]").ariaPressed = String(chosen.zoom === null);
  at("freeze").ariaPressed = String(chosen.frozen !== null);
}

function choose(event) {
  const button = event.target.closest("button");
  if (!button) return;
  const {band, axes, zoom} = button.dataset;
  if (band) chosen.band = band;
  if (axes) chosen.axes = axes.split("").map(Number);
  if (zoom === "in") chosen.zoom = Math.min(FINEST_ZOOM, (chosen.zoom ?? 0) + 1);
  if (zoom === "out") chosen.zoom = Math.max(0, (chosen.zoom ?? 0) - 1);
  if (zoom === "fit") chosen.zoom = null;
  if (button.id === "freeze") {
    chosen.frozen = chosen.frozen ? null : structuredClone(state);
    button.textContent = chosen.frozen ? "go on" : "freeze";
    if (!chosen.frozen && state.head) showHead(state.head);
  }
  if (button.id === "clear") chosen.cleared = newest(state.map[chosen.band]);
  redrawAll();
}

function connect() {
  const socket = new WebSocket(`ws://${location.host}/live${location.search}`);
  let over = false;
  const watch = setInterval(() => { if (Date.now() - alive > SILENCE_MS) lost(); }, 1000);
  alive = Date.now();
  function lost() {
    if (over) return;
    over = true;
    clearInterval(watch);
    socket.close();
    document.body.dataset.link = "down";
    put("connection", "no connection to quietcut monitor: trying again");
    document.title = "no connection · quietcut";
    setTimeout(connect, AGAIN_MS);
  }
  socket.onmessage = message => take(JSON.parse(message.data));
  socket.onclose = lost;
  socket.onerror = lost;
}

document.querySelector("nav").addEventListener("click", choose);
new ResizeObserver(redrawAll).observe(document.querySelector("main"));
redrawAll();
connect();
