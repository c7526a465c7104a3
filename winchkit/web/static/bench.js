// The Bench view, and the Stop of all views. A jog lasts as long as its messages: one each 50 ms.
import { alarm, ask, attempt, download, el, fill, icon, number, renew, say, socket, svg } from "./page.js";
import { cycles } from "./cycle.js";
import { frames } from "./frames.js";
import { objects } from "./objects.js";
import { choose, progress, refused } from "./programme.js";
import { live } from "./robot.js";
import * as strips from "./strips.js";
import { consequences, together, trip } from "./trip.js";
import { card, picture as drawn, words as said } from "./winch.js";

const PERIOD = 50, SENSE = { "winding in": "↑ ", "paying out": "↓ ", }, MOVING = new Set(["moving", "running down"]);
let declared = null, link = null, picture = null, root = null, winch = null, speed = 0.05, held = null, timer = null, history = {}, drawnAt = 0, stripsAt = 0, tab = "Charts", alive = null, lastTrip = null, askedTrip = 0, logName = "bench.csv", wanted = null, awaited = false;

// A request that fails is repeated: without it there is no Stop.
export async function station(state) {
  if (!state.bench || declared) return;
  try {
    const found = await ask("/api/bench");
    history = await ask("/api/bench/history");
    declared = found;
    winch = Object.keys(declared.winch)[0];
    link = socket("/live/bench", receive, () => { picture = null; release(); show(); });
    show();
    if (root) enter(root);
  } catch (error) {
    alarm(`${error.message} (the bench is asked again in a second)`);
    setTimeout(() => station(state), 1000);
  }
}

export function enter(main) {
  root = main;
  if (wanted) { const parts = wanted; wanted = null; restore(parts); }
  if (!declared) { fill(root, el("div", { class: "drop" }, el("h1", {}, "No bench"), el("p", { class: "note" }, "Start with winchkit serve --bench BENCH.toml, or --sim NAME; with --allow-motion the page may move it."))); return; }
  build();
}
export function leave() { release(); root = null; if (declared) fill(document.getElementById("stopbar"), stopButton()); }
const plain = (text) => { try { return decodeURIComponent(text); } catch { return text; } };
export function restore(parts) {
  if (!declared) { wanted = parts; return; }
  const [name, part] = parts.map(plain);
  if (declared.winch[name]) winch = name;
  if (tabs().includes(part)) tab = part;
}
const keep = () => window.history.replaceState(null, "", `${location.search}#bench/${encodeURIComponent(winch)}/${encodeURIComponent(tab)}`);
export function update() {}

function receive(message) {
  if (message.predicted) Object.assign(predictions, message.predicted);
  if (message.robot !== undefined) live(message.robot, declared.robot && platform);
  const before = picture;
  if (!before) send("show", { winch });
  picture = message;
  const time = message.status.time;
  for (const [name, now] of Object.entries(message.status.winch || {})) {
    const rows = history[name] || (history[name] = []);
    if (!rows.length || rows.at(-1).time < time) rows.push({ ...now, time });
    while (rows.length && rows[0].time < time - 60) rows.shift();
  }
  watchTrip();
  if (message.said && (!before || before.said !== message.said)) { alarm(message.said); say(message.said); release(); }
  saidOnce();
  soon();
}

// A command that a trip ended is told by the trip's banner alone.
function saidOnce() {
  const shown = document.getElementById("banner");
  if (tripped().some((words) => shown.textContent.startsWith(words))) alarm("");
}

// Pictures that come faster than the screen is drawn are skipped, so that keys never wait behind them.
function soon() {
  if (document.hidden) { show(); return; }
  if (awaited) return;
  awaited = true;
  requestAnimationFrame(() => { awaited = false; show(); });
}

// The cycles around a trip: asked for once they are complete, shown until the reset.
function watchTrip() {
  if (!tripped().length) {
    if (askedTrip) { askedTrip = 0; lastTrip = null; if (tab === "Trip") { tab = "Charts"; if (root) build(); } }
    return;
  }
  if (askedTrip) return;
  const mine = askedTrip = performance.now();
  setTimeout(async () => {
    try {
      const found = await ask("/api/bench/trip");
      if (askedTrip !== mine || !found) return;
      lastTrip = found; tab = "Trip";
      if (root) build();
      show();
    } catch { if (askedTrip === mine) askedTrip = 0; }
  }, 700);
}

const predictions = {};
const send = (name, more = {}) => link && link.send({ do: name, ...more });
const tripped = () => (picture && picture.status.tripped) || [];
const now = () => (picture && picture.status.winch && picture.status.winch[winch]) || null;
const commands = () => Boolean(picture && picture.you_command);

export function stopKey(event) {
  if (!declared) return false;
  if (event.code === "Space" && !event.target.closest("input, textarea, select")) { stop(); return true; }
  if (event.key === "Escape" && now() && MOVING.has(now().phase)) { stop(); return true; }
  return false;
}

async function stop() {
  release();
  await attempt(() => ask("/api/bench/stop", ""));
}

const stopButton = () => el("button", { class: "stop", onclick: stop, "aria-keyshortcuts": "Space" }, svg("svg", { width: 22, height: 22, viewBox: "0 0 22 22", "aria-hidden": "true" }, svg("path", { d: "M7 1h8l6 6v8l-6 6H7l-6-6V7z", fill: "#fff" }), svg("rect", { x: 8, y: 8, width: 6, height: 6, fill: "#C5221A" })), "Stop ", el("kbd", {}, "Space"));

function header() {
  const box = document.getElementById("station");
  if (!box.firstChild) { box.append(el("span", { id: "where" }), el("span", { id: "tripped", class: "chip trip" }, icon("trip"), "Tripped"), el("span", { id: "role" }), stopButton()); if (!root) fill(document.getElementById("stopbar"), stopButton()); }
  const state = now();
  box.querySelector("#where").textContent = `${declared.name}${state ? ` · ${winch} ${words(state)} · ${number(state.cable_length)} m` : ""}`;
  box.querySelector("#tripped").hidden = !tripped().length;
  const role = box.querySelector("#role"), kind = commands() ? "command" : "watch";
  if (role.dataset.kind !== kind) { role.dataset.kind = kind; fill(role, el("span", { class: `chip ${kind}` }, icon(kind), commands() ? "You command" : "Watching")); }
}

const words = (state) => said(state, tripped().length > 0);
const drum = (name) => (picture && picture.status.drum && picture.status.drum[name]) || { turns: null, radius: null, guide: null };

function show() {
  if (!declared) return;
  header();
  banner();
  if (root) refresh(); else progress(null, picture && picture.programme, send);
}

function banner() {
  const box = document.getElementById("trips"), trips = tripped(), lost = picture ? picture.lost : "The page's server does not answer: Stop cannot reach the bench. Use the emergency stop.";
  const text = lost ? `lost:${lost}` : trips.length ? `${commands()}|${Boolean(lastTrip)}|${Boolean(root)}|${trips.join("|")}` : "";
  if (box.dataset.text === text) return;
  if (!text && !box.dataset.text) return;
  box.dataset.text = text;
  if (!text) { fill(box); return; }
  const margin = { margin: "12px 24px 0" };
  if (lost) fill(box, el("div", { class: "alert", style: margin }, el("div", {}, lost)));
  else fill(box, el("div", { class: "alert trip", style: margin }, el("b", { class: "row title" }, icon("trip"), "Tripped"), el("div", {}, together(trips).map((words) => el("p", {}, el("b", { class: "title" }, words))), lastTrip ? consequences(lastTrip) : el("p", {}, "Everything stopped. After the reset nothing moves before a new command."), lastTrip && !root ? el("a", { href: "#bench" }, "Show the last two seconds") : null), el("span", { class: "row" }, lastTrip ? el("button", { id: "save-trip", onclick: () => attempt(() => download("/api/bench/trip.csv")) }, "Save these 2.5 s") : null,
    el("button", { id: "reset", class: "primary", onclick: () => { if (confirm("Clear the trips and drive faults? Nothing moves before a new command.")) send("reset"); }, disabled: !commands() }, "Reset… ", el("kbd", {}, "R")))));
}

function build() {
  const limits = declared.winch[winch].limits, names = Object.keys(declared.winch);
  const speeds = [0.02, 0.05, 0.15, 0.3].filter((v) => v <= limits.speed);
  if (!speeds.includes(speed)) speed = speeds[0] || limits.speed;
  const jogButton = (sign) => {
    const button = el("button", { class: "jog", data: { sign } }, el("span", {}, sign > 0 ? "↑ Wind in" : "↓ Pay out"), el("span", {}, el("small", {}, "hold to move"), " ", el("kbd", {}, sign > 0 ? "↑" : "↓")));
    button.addEventListener("pointerdown", (event) => { if (event.button === 0 && event.isPrimary) { button.setPointerCapture(event.pointerId); hold(sign); } else release(); });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(kind, release);
    button.addEventListener("pointermove", (event) => { const r = button.getBoundingClientRect(); if (held && (event.clientX < r.left || event.clientX > r.right || event.clientY < r.top || event.clientY > r.bottom)) release(); });
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    return button;
  };
  const step = (mm) => el("button", { onclick: () => { send("step", { winch, change: -mm / 1000, speed }); watchMotion(); } }, `${mm > 0 ? "+" : "−"}${Math.abs(mm)}`);
  const target = el("input", { value: now() ? number(now().cable_length, 4) : "", "aria-label": "Cable length, m" });
  const file = el("input", { class: "file", value: logName, onchange: (event) => { logName = event.target.value; }, "aria-label": "Name of the log" });
  keep();
  fill(root, el("h1", { class: "visually-hidden" }, `Bench ${declared.name}`),
    el("div", { class: "row context" }, el("span", { class: "label" }, "Winch"), el("span", { class: "segments" }, names.map((name) => el("button", { "aria-pressed": String(name === winch), onclick: () => chooseWinch(name) }, name))),
      el("span", { class: "segments", id: "tabs" }, tabs().map((name) => el("button", { "aria-pressed": String(name === tab), onclick: () => { tab = name; build(); } }, name))),
      el("span", { class: "row end" }, el("span", { id: "recording", class: "note" }), el("span", { id: "says", class: "note" }),
        declared.allow_motion ? [file, el("button", { id: "record", onclick: () => (picture && picture.recording ? send("end_record") : send("record", { file: file.value })) }, "Record"), el("button", { id: "take", onclick: () => send(commands() ? "leave" : "command") }, "Request command")] : el("span", { class: "note" }, "watching: start with --allow-motion to move"))),
    el("div", { id: "programme" }),
    el("div", { class: `bench-grid${names.length > 1 ? " several" : ""}` },
      el("div", { class: "column" }, el("section", { class: "panel", "aria-label": `Winch ${winch}` }, el("header", {}, el("h2", {}, `Winch ${winch}`), el("span", { class: "note" }, `profile ${declared.winch[winch].profile}${declared.winch[winch].effects.length ? ` + ${declared.winch[winch].effects.length} effect${declared.winch[winch].effects.length === 1 ? "" : "s"}` : ""}`)), el("div", { id: "drawing" })),
        names.length > 1 ? el("section", { class: "panel", "aria-label": "All winches" }, el("div", { id: "cards" })) : null),
      el("div", { class: "column" },
        el("section", { class: "panel live", id: "values", "aria-label": "Live values" }),
        panel())),
    el("section", { class: "panel controls", style: { marginTop: "16px" }, "aria-label": "Controls" },
      el("fieldset", { class: "jogs" }, el("legend", {}, "Jog"), el("div", { class: "row" }, jogButton(1), jogButton(-1))),
      el("fieldset", {}, el("legend", {}, "Jog speed, m/s"), el("div", { class: "segments", id: "speeds" }, speeds.map((v) => el("button", { "aria-pressed": String(v === speed), onclick: () => { speed = v; build(); } }, String(v))))),
      el("fieldset", { class: "orders" }, el("legend", {}, "Inch, mm (+ winds in)"), el("div", { class: "segments" }, [-10, -1, 1, 10].map(step))),
      el("fieldset", { class: "orders" }, el("legend", {}, "Move to, m"), el("div", { class: "row" }, target, el("button", { onclick: () => { send("move", { winch, to: Number(target.value.replace(",", ".")), speed }); watchMotion(); } }, "Move"))),
      el("fieldset", { class: "orders" }, el("legend", {}, "Load cell"), el("button", { onclick: () => send("tare", { winch }) }, "Tare ", el("kbd", {}, "T"))),
      el("fieldset", { class: "orders" }, el("legend", {}, "Programme"), el("button", { id: "programmes", onclick: () => { if (!refused(commands(), tripped().length > 0)) choose((name, folder) => send("run_programme", { name, folder })); } }, "Run…"))));
  fill(document.getElementById("stopbar"), jogButton(1), jogButton(-1), stopButton());
  if (tab === "Charts") strips.strips(document.getElementById("strips"), () => ({ rows: [...(history[winch] || [])], predicted: predictions[winch] }), { winch, limits, bench: declared.name, profile: declared.winch[winch].profile });
  if (tab === "Trip") trip(document.getElementById("trip"), lastTrip, winch, declared);
  if (tab === "Bus frames") frames(document.getElementById("frames"));
  if (tab === "Drive objects") objects(document.getElementById("objects"), winch);
  drawnAt = 0;
  refresh();
}

function chooseWinch(name) { release(); winch = name; send("show", { winch }); build(); }

function panel() {
  const own = (id, title, more = {}) => el("section", { class: "panel", "aria-label": tab, ...more }, el("header", {}, el("h2", {}, title)), el("div", { id }));
  if (tab === "Trip") return own("trip", "Two seconds before the trip, half a second after", { class: "panel trip" });
  if (tab === "Bus frames") return own("frames", "Frames of the CAN buses");
  if (tab === "Drive objects") return own("objects", `Objects of the drive of winch ${winch}`);
  if (tab === "Cycle time") return own("cycles", "Time between cycles of the control");
  return el("section", { class: "panel", "aria-label": "Last 60 s" }, el("header", {}, el("h2", {}, "Last 60 s"), el("span", { class: "row more" }, ),
    el("span", {}, el("button", { id: "pause", onclick: (event) => strips.pause(event.currentTarget) }, strips.isPaused() ? "Go on " : "Pause ", el("kbd", {}, "P")))), el("div", { id: "strips" }));
}

const tabs = () => [...(lastTrip ? ["Trip"] : []), "Charts", "Bus frames", "Drive objects", "Cycle time"];

function hold(sign) {
  if (!commands() || tripped().length) { alarm(tripped().length ? "Tripped: reset first." : "This page only watches; request command first."); return; }
  alarm("");
  held = sign;
  clearInterval(timer);
  beat();
  timer = setInterval(beat, PERIOD);
  mark();
}

// What the Robot view may order of a robot's bench.
const platform = {
  allowed: () => declared.allow_motion, commands, tripped: () => tripped().length > 0,
  command: () => send(commands() ? "leave" : "command"), taken: () => Boolean(picture && picture.commander && !commands()),
  step: (axis, change, speed) => { if (refused(commands(), tripped().length > 0)) return; send("move_pose", { axis, change, speed }); watchMotion("all"); },
};

function beat() { if (held && picture) send("jog", { winch, speed: held * speed, seen: picture.status.time }); }

function release() {
  if (!held) return;
  held = null;
  clearInterval(timer);
  send("release", { winch });
  mark();
}

for (const kind of ["blur", "pagehide"]) addEventListener(kind, release);
document.addEventListener("visibilitychange", () => { if (document.hidden) release(); });
addEventListener("touchstart", (event) => { if (event.touches.length > 1) release(); }, { passive: true });

// Signs of life of a move: while something moves that this page ordered.
function watchMotion(moved = winch) {
  clearInterval(alive);
  const until = Date.now() + 600;
  alive = setInterval(() => {
    const state = now();
    const all = moved === "all" && picture ? Object.values(picture.status.winch) : [state];
    if (!state || (Date.now() > until && all.every((one) => one.phase === "disabled"))) { clearInterval(alive); return; }
    if (!document.hidden) send("alive", { winch: moved });
  }, 100);
}

addEventListener("keyup", (event) => { if (["ArrowUp", "ArrowDown"].includes(event.key)) release(); });
export function keys(event) {
  if (!declared || event.repeat) return ["ArrowUp", "ArrowDown"].includes(event.key);
  if (event.key === "ArrowUp") hold(1);
  else if (event.key === "ArrowDown") hold(-1);
  else if (event.key === "t") send("tare", { winch });
  else if (event.key === "p") document.getElementById("pause")?.click();
  else if (event.key === "r" && tripped().length) document.getElementById("reset")?.click();
  else if (event.key === "[" || event.key === "]") { const all = [...document.querySelectorAll("#speeds button")], at = all.findIndex((b) => b.getAttribute("aria-pressed") === "true") + (event.key === "]" ? 1 : -1); if (all[at]) all[at].click(); }
  else return false;
  return true;
}

function mark() {
  const state = now();
  for (const button of document.querySelectorAll(".jog")) {
    const own = held === Number(button.dataset.sign), moving = state && MOVING.has(state.phase) && Math.abs(state.cable_speed) > 0.0005;
    button.className = `jog ${own ? (moving ? "held" : "pressed") : !held && state && state.phase === "running down" ? "ramping" : ""}`;
    button.disabled = !commands() || tripped().length > 0;
    button.querySelector("kbd").hidden = button.disabled;
    button.querySelector("small").textContent = own ? (moving ? "held: moving" : "pressed") : button.disabled ? (tripped().length ? "tripped" : "watching") : "hold to move";
  }
}

// Orders without effect are off while the page watches, and after a trip until the reset.
function offer() {
  const off = !commands() || tripped().length > 0;
  for (const node of document.querySelectorAll(".controls .orders button, .controls .orders input")) node.disabled = off;
  const target = document.querySelector(".orders input"), state = now();
  if (target && state && target.value === "" && document.activeElement !== target && state.cable_length !== null) target.value = state.cable_length.toFixed(3);
}

function gauge(value, low, high, limits, unit) {
  const span = high - low || 1, x = (v) => Math.max(0, Math.min(100, ((v - low) / span) * 100)).toFixed(2);
  const parts = [svg("rect", { x: 0, y: 4, width: "100%", height: 8, fill: "var(--band)" })];
  const zone = (a, b) => parts.push(svg("rect", { x: `${x(a)}%`, y: 4, width: `${Math.max(0, x(b) - x(a)).toFixed(2)}%`, height: 8, fill: "url(#hatch)" }));
  if (limits[0] !== null) { zone(low, limits[0]); parts.push(svg("text", { x: `${x(limits[0])}%`, y: 28, "font-size": 12, fill: "var(--ink2)" }, number(limits[0], 3))); }
  if (limits[1] !== null) { zone(limits[1], high); parts.push(svg("text", { x: `${x(limits[1])}%`, y: 28, "font-size": 12, "text-anchor": "end", fill: "var(--ink2)" }, number(limits[1], 3))); }
  if (value !== null) parts.push(svg("rect", { x: `calc(${x(value)}% - 1.5px)`, y: 0, width: 3, height: 16, fill: "var(--ink)" }));
  return svg("svg", { class: "gauge", role: "img", "aria-label": `limits ${limits.filter((v) => v !== null).join(" and ")} ${unit}` }, parts);
}

function refresh() {
  const state = now(), values = document.getElementById("values");
  if (!values) return;
  const own = declared.winch[winch].limits, at = performance.now();
  mark();
  offer();
  const take = document.getElementById("take");
  if (take) { take.textContent = commands() ? "Release command" : "Request command"; take.disabled = !commands() && Boolean(picture && picture.commander); }
  document.getElementById("says").textContent = picture && picture.commander && !commands() ? `${picture.commander} commands` : "";
  progress(document.getElementById("programme"), picture && picture.programme, send);
  const log = picture && picture.recording;
  document.getElementById("recording").textContent = log ? `● Recording ${log.file} · ${Math.floor(log.seconds / 60)}:${String(Math.floor(log.seconds % 60)).padStart(2, "0")}${log.rows === undefined ? "" : ` · ${log.rows} rows${log.lost ? `, ${log.lost} lost` : ""}`}` : "";
  const record = document.getElementById("record"), mine = commands() || Boolean(log);
  const named = document.querySelector(".context input.file");
  if (record) { record.hidden = !mine; named.hidden = !mine || Boolean(log); }
  if (record) { record.textContent = log ? "End" : "Record"; record.disabled = !commands(); }
  if (!state) { fill(values, el("p", { class: "note" }, "No values of the bench yet.")); return; }
  if (drawnAt === picture.status.time) return;
  drawnAt = picture.status.time;
  values.dataset.time = drawnAt;
  const cell = (name, value, digits, unit, low, high, limits) => el("div", {}, el("span", { class: "note" }, name), el("div", { class: "value" }, value === null || value === undefined ? "–" : value.toFixed(digits).replace("-", "−"), el("small", {}, unit)), gauge(value, low, high, limits, unit));
  const length = own.length || [null, null], tension = own.tension, top = tension[1] || 500, winding = state.cable_speed === null ? null : -state.cable_speed;
  const kind = tripped().length ? "tripped" : MOVING.has(state.phase) ? "moving" : state.phase === "stopping" ? "stopping" : "";
  renew(values, cell("Cable length", state.cable_length, 3, "m", 0, (length[1] || 5) * 1.06, length), cell("Tension", state.tension, 1, "N", 0, top * 1.05, tension),
    cell("Speed, + winds in", winding, 3, "m/s", -own.speed * 1.05, own.speed * 1.05, [-own.speed, own.speed]),
    el("div", {}, el("span", { class: "note" }, "State"), el("div", { class: `state ${kind}` }, kind === "tripped" ? icon("trip") : SENSE[words(state)] || "", el("span", {}, words(state))), el("span", { class: "note" }, `${state.state}${state.commander ? `; ${state.commander} commands` : ""}`)));
  renew(document.getElementById("drawing"), drawn(winch, declared.winch[winch], state, drum(winch), tripped().length > 0));
  const host = document.getElementById("cycles");
  if (host && picture.status.cycle_time) cycles(host, picture.status.cycle_time, picture.status.overruns);
  charts(at);
  cards();
}

// The strip charts, five times a second: one pixel of 60 s is 0.08 s, and they cost most of a picture.
function charts(at) {
  if (at - stripsAt < 190) return;
  stripsAt = at;
  strips.refresh();
}

// Every winch of the bench as a card.
function cards() {
  const box = document.getElementById("cards");
  if (box) renew(box, Object.entries(picture.status.winch).map(([name, state]) => card(name, declared.winch[name], state, drum(name), tripped().length > 0, name === winch, () => chooseWinch(name))));
}
