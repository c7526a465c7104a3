// The Bench view, and the Stop of all views. A jog lasts as long as its messages: one each 50 ms.
import { alarm, ask, attempt, confirmed, download, el, fill, icon, number, renew, review, socket, svg } from "./page.js";
import { cycles } from "./cycle.js";
import { frames } from "./frames.js";
import { objects } from "./objects.js";
import * as orders from "./orders.js";
import { choose, progress } from "./programme.js";
import { live } from "./robot.js";
import * as strips from "./strips.js";
import { consequences, together, trip } from "./trip.js";
import { card, lengthOf, picture as drawn, words as said } from "./winch.js";

// Values that are older than `OLD` ms, twenty pictures, are grey, and nothing is offered.
const PERIOD = 50, OLD = 1000, LOOK = 250, ANSWER = 3000, SENSE = { "winding in": "↑ ", "paying out": "↓ ", }, MOVING = new Set(["moving", "running down"]);
const ONLY_WATCHES = "only watching: this page was started without permission to move";
let declared = null, link = null, picture = null, root = null, winch = null, speed = 0.05, held = null, timer = null, history = {}, drawnAt = 0, stripsAt = 0, tab = "Charts", alive = null, heard = 0, cut = false, answers = 0, beaten = 0, posed, drawnAge = "", lastTrip = null, askedTrip = 0, logName = "", wanted = null, awaited = false;

// A request that fails is repeated: without it there is no Stop.
export async function station(state) {
  if (!state.bench || declared) return;
  try {
    const found = await ask("/api/bench");
    history = await ask("/api/bench/history");
    declared = found;
    logName = found.log;
    winch = Object.keys(declared.winch)[0];
    link = socket("/live/bench", receive, () => { cut = true; answers = 0; look(); });
    setInterval(look, LOOK);
    alarm("", "station");
    show();
    if (root) enter(root);
  } catch (error) {
    alarm(`${error.message} (the bench is asked again in a second)`, "station");
    setTimeout(() => station(state), 1000);
  }
}

export function enter(main) {
  root = main;
  if (wanted) { const parts = wanted; wanted = null; restore(parts); }
  if (!declared) { fill(root, el("div", { class: "drop" }, el("h1", {}, "Connect a bench"), el("p", { class: "note" }, "A page shows the bench that it was started with. In a terminal:"), el("pre", { tabindex: 0 }, "winchkit serve --sim demo-adequate\nwinchkit serve --bench bench.toml --allow-motion"), el("p", { class: "note" }, "The first command starts a simulated bench, which the page may move. The second one opens your own; without its last word the page only watches."))); return; }
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
  if (message.robot !== undefined) { posed = message.robot; live(posed, declared.robot && platform); }
  const before = picture, time = message.status.time;
  if (!before || cut) send("show", { winch });
  if (!before || time === undefined || time !== before.status.time) heard = performance.now();
  cut = false;
  picture = message;
  for (const [name, now] of Object.entries(message.status.winch || {})) {
    now.gross = orders.grossOf(now.tension, message.status.tare && message.status.tare[name]);
    const rows = history[name] || (history[name] = []);
    if (!rows.length || rows.at(-1).time < time) rows.push({ ...now, time });
    while (rows.length && rows[0].time < time - 60) rows.shift();
  }
  watchTrip();
  answer(message.said);
  soon();
}

// What the bench answered to an order of this page; a command that a trip ended is told by the trip.
function answer({ number: count, text }) {
  if (count === answers) return;
  answers = count;
  if (text) release();
  alarm(text, "bench", () => !tripped().some((words) => text.startsWith(words)));
}

// Where the pictures end: the last values stay, grey and with their age, and nothing is offered.
const since = () => (performance.now() - heard) / 1000;
const old = () => cut || Boolean(picture && (picture.lost || 1000 * since() > OLD));
const ago = () => (since() < 120 ? `${Math.floor(since())} s old` : `${Math.floor(since() / 60)} min old`);
let wasOld = false;
function look() {
  if (!old() && !wasOld) return;
  wasOld = old();
  if (wasOld) { release(); clearInterval(alive); }
  if (posed !== undefined) live(posed, declared.robot && platform);
  show();
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
// An order says which picture of the bench its giver saw.
const send = (name, more = {}) => link && link.send({ do: name, seen: (picture && picture.status.time) ?? null, ...more });
const tripped = () => (picture && picture.status.tripped) || [];
const now = () => (picture && picture.status.winch && picture.status.winch[winch]) || null;
const commands = () => Boolean(picture && picture.you_command && !old());
const moving = () => Object.values((picture && picture.status.winch) || {}).some((one) => one.phase !== "disabled");
const tensions = () => now() || { tension: null, gross: null };
const tared = () => Boolean(picture && picture.status.tare && winch in picture.status.tare);
export const attached = () => Boolean(declared);

// Whether nothing can be ordered now; says why, for as long as it is so.
function refused() {
  if (old()) alarm("There are no new values of the bench: nothing is ordered.", "refused", old);
  else if (!commands()) alarm("This page only watches; request command first.", "refused", () => !commands());
  else if (tripped().length) alarm("Tripped: reset first.", "refused", () => tripped().length > 0);
  else return false;
  return true;
}

// Space stops but where text is typed, Esc also there. Where the values are old Esc stops as well,
// since nobody knows whether something moves.
export function stopKey(event, writes) {
  if (!declared) return false;
  const space = event.code === "Space" && !writes;
  if (!space && !(event.key === "Escape" && (moving() || old()))) return false;
  if (!event.repeat) stop();
  return space || moving();
}

async function stop() {
  release();
  const late = setTimeout(() => alarm(`Stop has had no answer for ${ANSWER / 1000} s: use the emergency stop.`, "stop"), ANSWER);
  try {
    await ask("/api/bench/stop", "");
    alarm("", "stop");
  } catch (error) {
    alarm(`Stop did not reach the bench: use the emergency stop. (${error.message})`, "stop");
  } finally { clearTimeout(late); }
}

const stopButton = () => el("button", { class: "stop", onclick: stop, "aria-keyshortcuts": "Space" }, svg("svg", { width: 22, height: 22, viewBox: "0 0 22 22", "aria-hidden": "true" }, svg("path", { d: "M7 1h8l6 6v8l-6 6H7l-6-6V7z", fill: "#fff" }), svg("rect", { x: 8, y: 8, width: 6, height: 6, fill: "#C5221A" })), "Stop ", el("kbd", {}, "Space"));

function header() {
  const box = document.getElementById("station");
  if (!box.firstChild) { box.append(el("span", { id: "recording", class: "chip recording" }), el("span", { id: "where" }), el("span", { id: "tripped", class: "chip trip" }, icon("trip"), "Tripped"), el("span", { id: "role" }), stopButton()); if (!root) fill(document.getElementById("stopbar"), stopButton()); }
  const state = now();
  box.querySelector("#where").textContent = `${declared.name}${state ? ` · ${winch} ${words(state)} · ${lengthOf(state)}` : ""}${old() && picture ? ` · ${ago()}` : ""}`;
  recording(box.querySelector("#recording"), picture && picture.recording);
  box.querySelector("#tripped").hidden = !tripped().length;
  const role = box.querySelector("#role"), kind = old() ? "unknown" : commands() ? "command" : "watch";
  if (role.dataset.kind !== kind) { role.dataset.kind = kind; fill(role, el("span", { class: `chip ${kind}` }, icon(kind), { unknown: "No values", command: "You command", watch: "Watching" }[kind])); }
}

// The log under way, in every view; where it is once it has ended, and a free name for the next one.
let logged = null;
function recording(chip, log) {
  const time = log && `${Math.floor(log.seconds / 60)}:${String(Math.floor(log.seconds % 60)).padStart(2, "0")}`;
  fill(chip, ...(log ? [el("i", {}, "●"), `${log.file} ${time}${log.rows === undefined ? "" : ` · ${log.rows} rows${log.lost ? `, ${log.lost} lost` : ""}`}`] : []));
  chip.hidden = !log;
  if (logged && !log) {
    alarm(`Recorded: ${logged.path}, ${logged.rows ?? "no"} rows.`, "recorded", () => true, "done");
    logName = logged.file.replace(/(?:-(\d+))?(\.\w+)$/, (all, count, suffix) => `-${Number(count || 1) + 1}${suffix}`);
    const field = document.querySelector(".context input.file");
    if (field) field.value = logName;
  }
  logged = log;
}

const words = (state) => said(state, tripped().length > 0);
// States of a drive (CiA 402) in words; its own name for the state is the tooltip.
const OFF = ["not ready to switch on", "switch on disabled", "ready to switch on", "switched on"];
const DRIVE = { ...Object.fromEntries(OFF.map((name) => [name, "drive off"])), "operation enabled": "drive on", "quick stop active": "quick stop", fault: "drive fault", "fault reaction active": "drive fault" };
const by = (name) => (!name || old() || commands() ? "" : name.startsWith("page ") ? "commanded from another tab" : `commanded by ${name}`);
const drum = (name) => (picture && picture.status.drum && picture.status.drum[name]) || { turns: null, radius: null, guide: null };

function show() {
  if (!declared) return;
  header();
  banner();
  review();
  document.body.classList.toggle("old", old());
  for (const node of document.querySelectorAll(".offers, #dialog")) node.inert = old();
  requested(document.getElementById("request"));
  progress(document.getElementById("programme"), picture && picture.programme, send);
  if (root) refresh();
}

function banner() {
  const box = document.getElementById("trips"), trips = tripped(), lost = (!cut && picture && picture.lost) || (old() ? `${cut ? "The page's server does not answer" : "The bench sends no values"}: Stop cannot reach the bench. Use the emergency stop.` : "");
  const text = lost ? `lost:${lost}` : trips.length ? `${commands()}|${Boolean(lastTrip)}|${Boolean(root)}|${trips.join("|")}` : "";
  const aged = box.querySelector(".age");
  if (aged && picture) aged.textContent = `What is shown is ${ago()}.`;
  if (box.dataset.text === text) return;
  if (!text && !box.dataset.text) return;
  box.dataset.text = text;
  if (!text) { fill(box); return; }
  if (lost) fill(box, el("div", { class: "alert" }, el("div", {}, lost), el("span", { class: "age", "aria-hidden": "true" })));
  else fill(box, el("div", { class: "alert trip" }, el("b", { class: "row title" }, icon("trip"), "Tripped"), el("div", {}, together(trips).map((words) => el("p", {}, el("b", { class: "title" }, words))), lastTrip ? consequences(lastTrip) : el("p", {}, "Everything stopped. After the reset nothing moves before a new command."), lastTrip && !root ? el("a", { href: "#bench" }, "Show the last two seconds") : null), el("span", { class: "row offers" }, lastTrip ? el("button", { id: "save-trip", onclick: () => attempt(() => download("/api/bench/trip.csv")) }, "Save these 2.5 s") : null,
    el("button", { id: "reset", class: "primary", onclick: () => confirmed("Reset", "Clear the trips and drive faults? Nothing moves before a new command.", () => send("reset")), disabled: !commands() }, "Reset… ", el("kbd", {}, "R")))));
}

function build() {
  const limits = declared.winch[winch].limits, names = Object.keys(declared.winch);
  const slow = [0.02, 0.05, 0.15, 0.3].filter((v) => v <= limits.speed), speeds = slow.length ? slow : [limits.speed];
  if (!speeds.includes(speed)) speed = speeds[0];
  const jogButton = (sign) => {
    const button = el("button", { class: "jog", data: { sign } }, el("span", {}, sign > 0 ? "↑ Wind in" : "↓ Pay out"), el("span", {}, el("small", {}, "hold to move"), " ", el("kbd", {}, sign > 0 ? "↑" : "↓")));
    button.addEventListener("pointerdown", (event) => { if (event.button === 0 && event.isPrimary) { button.setPointerCapture(event.pointerId); hold(sign); } else release(); });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(kind, release);
    button.addEventListener("pointermove", (event) => { const r = button.getBoundingClientRect(); if (held && (event.clientX < r.left || event.clientX > r.right || event.clientY < r.top || event.clientY > r.bottom)) release(); });
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    return button;
  };
  const step = (mm) => el("button", { onclick: () => { send("step", { winch, change: -mm / 1000, speed }); watchMotion(); } }, `${mm > 0 ? "+" : "−"}${Math.abs(mm)}`);
  const file = el("input", { class: "file", value: logName, onchange: (event) => { logName = event.target.value; }, "aria-label": "Name of the log" });
  keep();
  fill(root, el("h1", { class: "visually-hidden" }, `Bench ${declared.name}`),
    el("div", { class: "row context" }, names.length > 1 ? [el("span", { class: "label" }, "Winch"), el("span", { class: "segments" }, names.map((name) => el("button", { "aria-pressed": String(name === winch), onclick: () => chooseWinch(name) }, name)))] : null,
      el("span", { class: "segments", id: "tabs" }, tabs().map((name) => el("button", { "aria-pressed": String(name === tab), onclick: () => { tab = name; build(); } }, name))),
      el("span", { class: "row end offers" }, el("span", { id: "says", class: "note" }),
        declared.allow_motion ? [file, el("button", { id: "record", onclick: () => (picture && picture.recording ? send("end_record") : send("record", { file: file.value })) }, "Record"), el("button", { id: "take", onclick: take }, "Request command")] : el("span", { class: "note" }, ONLY_WATCHES))),
    el("div", { class: `bench-grid${names.length > 1 ? " several" : ""}` },
      el("div", { class: "column" }, el("section", { class: "panel", "aria-label": `Winch ${winch}` }, el("header", {}, el("h2", {}, `Winch ${winch}`), el("span", { class: "note" }, `profile ${declared.winch[winch].profile}${declared.winch[winch].effects.length ? ` + ${declared.winch[winch].effects.length} effect${declared.winch[winch].effects.length === 1 ? "" : "s"}` : ""}`)), el("div", { id: "drawing" })),
        names.length > 1 ? el("section", { class: "panel", "aria-label": "All winches" }, el("div", { id: "cards" })) : null),
      el("div", { class: "column" },
        el("section", { class: "panel live", id: "values", "aria-label": "Live values" }),
        panel())),
    el("section", { class: "panel controls offers", style: { marginTop: "16px" }, "aria-label": "Controls" },
      el("fieldset", { class: "jogs" }, el("legend", {}, "Jog"), el("div", { class: "row" }, jogButton(1), jogButton(-1))),
      el("fieldset", {}, el("legend", {}, "Jog speed, m/s"), el("div", { class: "segments", id: "speeds" }, speeds.map((v) => el("button", { "aria-pressed": String(v === speed), onclick: () => { speed = v; build(); } }, String(v))))),
      el("fieldset", { class: "orders" }, el("legend", {}, "Inch, mm (+ winds in)"), el("div", { class: "segments" }, [-10, -1, 1, 10].map(step)), el("span", { class: "note" }, `at ${speed} m/s`)),
      orders.move(speeds, (to, at) => { send("move", { winch, to, speed: at }); watchMotion(); }),
      el("fieldset", { class: "orders" }, el("legend", {}, "Load cell"), el("div", { class: "upright" }, el("button", { id: "tare", onclick: tare }, "Tare… ", el("kbd", {}, "T")), el("button", { id: "untare", hidden: true, onclick: () => send("undo_tare", { winch }) }, "Undo tare"))),
      el("fieldset", { class: "orders" }, el("legend", {}, "Programme"), el("button", { id: "programmes", onclick: () => { if (!refused()) choose((name, folder) => send("run_programme", { name, folder })); } }, "Run…"))));
  fill(document.getElementById("stopbar"), jogButton(1), jogButton(-1), stopButton());
  if (tab === "Charts") strips.strips(document.getElementById("strips"), () => ({ rows: [...(history[winch] || [])], predicted: predictions[winch] }), { winch, limits, bench: declared.name, profile: declared.winch[winch].profile, taller: beside(Object.keys(declared.winch).length) });
  if (tab === "Trip") trip(document.getElementById("trip"), lastTrip, winch, declared, picture && picture.status.tare && picture.status.tare[winch]);
  if (tab === "Bus frames") frames(document.getElementById("frames"));
  if (tab === "Drive objects") objects(document.getElementById("objects"), winch);
  drawnAt = 0;
  refresh();
}

// Requests the command, takes the request back, or releases the command.
const take = () => send(commands() || picture?.you_request ? "leave" : "command");
const takeWords = () => (commands() ? "Release command" : picture?.you_request ? "Withdraw request" : "Request command");

// Another page that requests the command: this one hands it over or keeps it.
function requested(host) {
  const asked = Boolean(picture && picture.requested && !old());
  if (asked !== Boolean(host.firstChild)) fill(host, asked && el("div", { class: "alert", role: "alert" }, el("div", {}, "Another page requests the command of this bench."), el("button", { onclick: () => send("leave") }, "Hand over"), el("button", { onclick: () => send("keep_command") }, "Keep")));
}

function chooseWinch(name) { release(); winch = name; orders.forget(); send("show", { winch }); build(); }

function tare() { const own = winch; if (!refused()) orders.tare(own, declared.winch[own].limits.tension, tensions, () => send("tare", { winch: own })); }

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
  if (refused()) return;
  if (!jogSpeed()) { alarm(`The cable length of winch ${winch} is unknown, and limits.unhomed = "none" forbids jogs: home it first, in a terminal by winchkit home.`, "refused", () => !jogSpeed()); return; }
  alarm("", "bench");
  release();
  held = sign;
  beaten = performance.now();
  clearInterval(timer);
  beat("jog");
  timer = setInterval(() => beat("refresh"), PERIOD);
  mark();
}

// What the Robot view may order of a robot's bench.
const platform = {
  allowed: () => declared.allow_motion, commands, old, ago, tripped: () => tripped().length > 0,
  command: take, words: takeWords, watches: ONLY_WATCHES,
  step: (axis, change, speed) => { if (refused()) return; send("move_pose", { axis, change, speed }); watchMotion("all"); },
};

// Faster jogs are refused while the cable length is unknown (limits.unhomed); 0: all are.
function jogSpeed() {
  const state = now();
  return state && state.length_known === false ? Math.min(speed, declared.winch[winch].limits.unhomed) : speed;
}
// A browser that was too slow for the dead-man ends its jog: the key may be up meanwhile.
// The press begins a jog, and what follows only refreshes it.
function beat(what) {
  if (!held) return;
  if (!jogSpeed()) { release(); return; }
  const at = performance.now();
  if (at - beaten > 1000 * declared.dead_man) { release(); alarm("Jog ended: the browser was too slow. Release and press again.", "bench"); return; }
  beaten = at;
  send(what, { winch, speed: held * jogSpeed() });
}

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
    if (!state || !commands() || (Date.now() > until && all.every((one) => one.phase === "disabled"))) { clearInterval(alive); return; }
    if (!document.hidden) send("alive", { winch: moved });
  }, 100);
}

addEventListener("keyup", (event) => { if (["ArrowUp", "ArrowDown"].includes(event.key)) release(); });
export function keys(event) {
  if (!declared || event.repeat) return ["ArrowUp", "ArrowDown"].includes(event.key);
  if (event.key === "ArrowUp") hold(1);
  else if (event.key === "ArrowDown") hold(-1);
  else if (event.key === "t") { if (tared()) tare(); }
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
    button.disabled = !commands() || tripped().length > 0 || !jogSpeed();
    button.querySelector("kbd").hidden = button.disabled;
    button.querySelector("small").textContent = own ? (moving ? "held: moving" : "pressed") : button.disabled ? (old() ? "no values" : tripped().length ? "tripped" : jogSpeed() ? "watching" : "home first") : "hold to move";
  }
}

// Orders without effect are off while the page watches, and after a trip until the reset.
function offer() {
  const off = !commands() || tripped().length > 0;
  for (const node of document.querySelectorAll(".controls .orders :is(button, input, select)")) node.disabled = off;
  const button = document.getElementById("tare"), undo = document.getElementById("untare");
  if (button) button.disabled = off || !tared();
  if (undo) undo.hidden = !(picture && picture.undo_tare.includes(winch));
  orders.renewTare(tensions);
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
  const button = document.getElementById("take");
  if (button) button.textContent = takeWords();
  document.getElementById("says").textContent = picture && !old() ? by(picture.commander) : "";
  const log = picture && picture.recording;
  const record = document.getElementById("record"), mine = commands() || Boolean(log);
  const named = document.querySelector(".context input.file");
  if (record) { record.hidden = !mine; named.hidden = !mine || Boolean(log); }
  if (record) { record.textContent = log ? "End" : "Record"; record.disabled = !commands(); }
  if (!state) { fill(values, el("p", { class: "note" }, "No values of the bench yet.")); return; }
  const aged = old() ? ` · ${ago()}` : "";
  if (drawnAt === picture.status.time && drawnAge === aged) return;
  drawnAt = picture.status.time; drawnAge = aged;
  values.dataset.time = drawnAt;
  const cell = (name, value, digits, unit, low, high, limits, at = value) => el("div", {}, el("span", { class: "note" }, name, aged), el("div", { class: "value" }, value === null || value === undefined ? "–" : value.toFixed(digits).replace("-", "−"), el("small", {}, unit)), gauge(at, low, high, limits, unit));
  const length = own.length || [null, null], tension = own.tension, top = tension[1] || 500, net = state.gross !== null && state.gross !== state.tension, winding = state.cable_speed === null ? null : -state.cable_speed;
  const kind = tripped().length ? "tripped" : MOVING.has(state.phase) ? "moving" : state.phase === "stopping" ? "stopping" : "";
  renew(values, cell(state.length_known === false ? `Cable length unknown: home the winch; ${own.unhomed ? "held jogs only" : "no jogs"}` : "Cable length", state.cable_length, 3, "m", 0, (length[1] || 5) * 1.06, length), cell(net ? `Tension, net; gross ${state.gross.toFixed(1).replace("-", "−")} N` : "Tension", state.tension, 1, "N", 0, top * 1.05, tension, state.gross),
    cell("Speed, + winds in", winding, 3, "m/s", -own.speed * 1.05, own.speed * 1.05, [-own.speed, own.speed]),
    el("div", {}, el("span", { class: "note" }, "State", aged), el("div", { class: `state ${kind}` }, kind === "tripped" ? icon("trip") : SENSE[words(state)] || "", el("span", {}, words(state))), el("span", { class: "note", title: state.state }, [DRIVE[state.state] || state.state, by(state.commander)].filter(Boolean).join(" · "))));
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

// Rows of cards beyond two make the left column longer than four plots: px for each of them.
function beside(winches) { return matchMedia("(min-width: 1200px)").matches ? Math.max(0, Math.ceil(winches / 2) - 2) * 20 : 0; }

// Every winch of the bench as a card.
function cards() {
  const box = document.getElementById("cards");
  if (box) renew(box, Object.entries(picture.status.winch).map(([name, state]) => card(name, declared.winch[name], state, drum(name), tripped().length > 0, name === winch, () => chooseWinch(name))));
}
