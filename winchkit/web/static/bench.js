// The Bench view, and the Stop of all views. A jog lasts as long as its messages: one each 50 ms.
import { alarm, ask, attempt, colour, el, fill, icon, number, say, socket, svg } from "./page.js";
import { cycles } from "./cycle.js";
import { objects } from "./objects.js";
import { legend, line, plot } from "./plots.js";

const PERIOD = 50, MOVING = new Set(["moving", "running down"]);
let declared = null, link = null, picture = null, root = null, winch = null, speed = 0.05, held = null, timer = null, charts = [], history = {}, paused = false, drawnAt = 0, tab = "Charts", alive = null;

export async function station(state) {
  if (!state.bench) return;
  await attempt(async () => {
    declared = await ask("/api/bench");
    winch = Object.keys(declared.winch)[0];
    history = await ask("/api/bench/history");
    link = socket("/live/bench", receive, () => { picture = null; release(); show(); });
    show();
  });
}

export function enter(main) {
  root = main;
  if (!declared) { fill(root, el("div", { class: "drop" }, el("h1", {}, "No bench"), el("p", { class: "note" }, "Start with winchkit serve --bench BENCH.toml, or --sim NAME; with --allow-motion the page may move it."))); return; }
  build();
}
export function leave() { release(); root = null; charts = []; }
export function update() {}

function receive(message) {
  if (message.predicted) Object.assign(predictions, message.predicted);
  const before = picture;
  picture = message;
  const time = message.status.time;
  for (const [name, now] of Object.entries(message.status.winch || {})) {
    const rows = history[name] || (history[name] = []);
    if (!rows.length || rows.at(-1).time < time) rows.push({ ...now, time });
    while (rows.length && rows[0].time < time - 60) rows.shift();
  }
  if (message.said && (!before || before.said !== message.said)) { alarm(message.said); say(message.said); release(); }
  show();
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
  if (!box.firstChild) box.append(el("span", { id: "where" }), el("span", { id: "role" }), stopButton());
  const state = now();
  box.querySelector("#where").textContent = `${declared.name}${state ? ` · ${winch} ${words(state)} · ${number(state.cable_length)} m` : ""}`;
  const role = box.querySelector("#role"), kind = commands() ? "command" : "watch";
  if (role.dataset.kind !== kind) { role.dataset.kind = kind; fill(role, el("span", { class: `chip ${kind}` }, icon(kind), commands() ? "You command" : "Watching")); }
}

function words(state) {
  if (tripped().length) return "tripped";
  if (state.phase === "moving") return state.cable_speed > 0.0005 ? "paying out" : state.cable_speed < -0.0005 ? "winding in" : "at rest";
  return { disabled: "at rest", enabling: "enabling", "running down": "ramping", stopping: "stopping", resetting: "resetting" }[state.phase] || state.phase;
}

function show() {
  if (!declared) return;
  header();
  banner();
  if (root) refresh();
}

function banner() {
  const box = document.getElementById("banner"), trips = tripped(), lost = picture ? picture.lost : "The page's server does not answer: Stop cannot reach the bench. Use the emergency stop.";
  const text = lost ? `lost:${lost}` : trips.length ? `${commands()}|${trips.join("|")}` : "";
  if (box.dataset.text === text) return;
  if (!text && !box.dataset.text) return;
  box.dataset.text = text;
  if (!text) { fill(box); return; }
  const margin = { margin: "12px 24px 0" };
  if (lost) fill(box, el("div", { class: "alert", style: margin }, el("div", {}, lost)));
  else fill(box, el("div", { class: "alert trip", style: margin }, el("b", { class: "row" }, icon("trip"), "Tripped"), el("div", {}, trips.map((trip) => el("p", {}, trip)), el("p", { class: "note" }, "Everything stopped. After the reset nothing moves before a new command.")), el("button", { onclick: () => { if (confirm("Clear the trips and drive faults? Nothing moves before a new command.")) send("reset"); }, disabled: !commands() }, "Reset ", el("kbd", {}, "R"))));
}

function build() {
  const limits = declared.winch[winch].limits, names = Object.keys(declared.winch);
  const speeds = [0.02, 0.05, 0.15, 0.3].filter((v) => v <= limits.speed);
  if (!speeds.includes(speed)) speed = speeds[0] || limits.speed;
  const jogButton = (sign) => {
    const button = el("button", { class: "jog", data: { sign } }, el("span", {}, sign > 0 ? "↑ Wind in" : "↓ Pay out"), el("small", {}, "hold to move"));
    button.addEventListener("pointerdown", (event) => { if (event.button === 0 && event.isPrimary) { button.setPointerCapture(event.pointerId); hold(sign); } else release(); });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(kind, release);
    button.addEventListener("pointermove", (event) => { const r = button.getBoundingClientRect(); if (held && (event.clientX < r.left || event.clientX > r.right || event.clientY < r.top || event.clientY > r.bottom)) release(); });
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    return button;
  };
  const step = (mm) => el("button", { onclick: () => { send("step", { winch, change: -mm / 1000, speed }); watchMotion(); } }, `${mm > 0 ? "+" : "−"}${Math.abs(mm)}`);
  const target = el("input", { value: now() ? number(now().cable_length, 4) : "", "aria-label": "Cable length, m" });
  const file = el("input", { class: "file", value: "bench.csv", "aria-label": "Name of the log" });
  fill(root, el("h1", { class: "visually-hidden" }, `Bench ${declared.name}`),
    el("div", { class: "row context" }, el("span", { class: "label" }, "Winch"), el("span", { class: "segments" }, names.map((name) => el("button", { "aria-pressed": String(name === winch), onclick: () => { winch = name; send("show", { winch }); build(); } }, name))),
      el("span", { class: "segments" }, ["Charts", "Drive objects", "Cycle time"].map((name) => el("button", { "aria-pressed": String(name === tab), onclick: () => { tab = name; build(); } }, name))),
      el("span", { class: "row end" }, el("span", { id: "recording", class: "note" }), el("span", { id: "says", class: "note" }),
        declared.allow_motion ? el("button", { id: "take", onclick: () => send(commands() ? "leave" : "command") }, "Request command") : el("span", { class: "note" }, "watching: start with --allow-motion to move"))),
    el("div", { class: "bench-grid" },
      el("section", { class: "panel", "aria-label": `Winch ${winch}` }, el("header", {}, el("h2", {}, `Winch ${winch}`), el("span", { class: "note" }, `profile ${declared.winch[winch].profile}${declared.winch[winch].effects.length ? ` + ${declared.winch[winch].effects.length} effect${declared.winch[winch].effects.length === 1 ? "" : "s"}` : ""}`)), el("div", { id: "drawing" })),
      el("div", { style: { display: "grid", gap: "16px", alignContent: "start", minWidth: 0 } },
        el("section", { class: "panel live", id: "values", "aria-label": "Live values" }),
        tab === "Drive objects" ? el("section", { class: "panel", "aria-label": tab }, el("header", {}, el("h2", {}, `Objects of the drive of winch ${winch}`)), el("div", { id: "objects" })) :
        tab === "Cycle time" ? el("section", { class: "panel", "aria-label": tab }, el("header", {}, el("h2", {}, "Time between cycles of the control")), el("div", { id: "cycles" })) : el("section", { class: "panel", "aria-label": "Last 60 s" }, el("header", {}, el("h2", {}, "Last 60 s"), legend(["edge", "measured"], ["today", "predicted, residual"]), el("span", { class: "note" }, el("button", { id: "pause", onclick: () => { paused = !paused; document.getElementById("pause").firstChild.textContent = paused ? "Go on " : "Pause "; } }, "Pause ", el("kbd", {}, "P")))), el("div", { id: "strips" })))),
    el("section", { class: "panel controls", style: { marginTop: "16px" }, "aria-label": "Controls" },
      el("fieldset", { class: "jogs" }, el("legend", {}, "Jog"), el("div", { class: "row" }, jogButton(1), jogButton(-1))),
      el("fieldset", {}, el("legend", {}, "Jog speed, m/s"), el("div", { class: "segments", id: "speeds" }, speeds.map((v) => el("button", { "aria-pressed": String(v === speed), onclick: () => { speed = v; build(); } }, String(v))))),
      el("fieldset", {}, el("legend", {}, "Inch, mm (+ winds in)"), el("div", { class: "segments" }, [-10, -1, 1, 10].map(step))),
      el("fieldset", {}, el("legend", {}, "Move to, m"), el("div", { class: "row" }, target, el("button", { onclick: () => { send("move", { winch, to: Number(target.value.replace(",", ".")), speed }); watchMotion(); } }, "Move"))),
      el("fieldset", {}, el("legend", {}, "Load cell"), el("button", { onclick: () => send("tare", { winch }) }, "Tare ", el("kbd", {}, "T"))),
      el("fieldset", {}, el("legend", {}, "Log"), el("div", { class: "row" }, file, el("button", { id: "record", onclick: () => (picture && picture.recording ? send("end_record") : send("record", { file: file.value })) }, "Record")))),
    el("div", { class: "stopbar" }, jogButton(1), stopButton(), jogButton(-1)));
  strips();
  if (tab === "Drive objects") objects(document.getElementById("objects"), winch);
  refresh();
}

function hold(sign) {
  if (!commands() || tripped().length) { alarm(tripped().length ? "Tripped: reset first." : "This page only watches; request command first."); return; }
  held = sign;
  clearInterval(timer);
  beat();
  timer = setInterval(beat, PERIOD);
  mark();
}

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
function watchMotion() {
  clearInterval(alive);
  const until = Date.now() + 600;
  alive = setInterval(() => {
    const state = now();
    if (!state || (Date.now() > until && state.phase === "disabled")) { clearInterval(alive); return; }
    if (!document.hidden) send("alive", { winch });
  }, 100);
}

addEventListener("keyup", (event) => { if (["ArrowUp", "ArrowDown"].includes(event.key)) release(); });
export function keys(event) {
  if (!declared || event.repeat) return ["ArrowUp", "ArrowDown"].includes(event.key);
  if (event.key === "ArrowUp") hold(1);
  else if (event.key === "ArrowDown") hold(-1);
  else if (event.key === "t") send("tare", { winch });
  else if (event.key === "p") document.getElementById("pause")?.click();
  else if (event.key === "r" && tripped().length) document.querySelector("#banner button").click();
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
    button.querySelector("small").textContent = own ? (moving ? "held: moving" : "pressed") : button.disabled ? (tripped().length ? "tripped" : "watching") : "hold to move";
  }
}

function gauge(value, low, high, limits, unit) {
  const span = high - low || 1, x = (v) => Math.max(0, Math.min(100, ((v - low) / span) * 100));
  const parts = [svg("rect", { x: 0, y: 4, width: "100%", height: 8, fill: "var(--band)" })];
  const zone = (a, b) => parts.push(svg("rect", { x: `${x(a)}%`, y: 4, width: `${Math.max(0, x(b) - x(a))}%`, height: 8, fill: "var(--stop)", opacity: 0.35 }));
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
  const take = document.getElementById("take");
  if (take) { take.textContent = commands() ? "Release command" : "Request command"; take.disabled = !commands() && Boolean(picture && picture.commander); }
  document.getElementById("says").textContent = picture && picture.commander && !commands() ? `${picture.commander} commands` : "";
  const log = picture && picture.recording;
  document.getElementById("recording").textContent = log ? `● Recording ${log.file} · ${Math.floor(log.seconds / 60)}:${String(Math.floor(log.seconds % 60)).padStart(2, "0")}${log.rows === undefined ? "" : ` · ${log.rows} rows${log.lost ? `, ${log.lost} lost` : ""}`}` : "";
  document.getElementById("record").textContent = log ? "End" : "Record";
  if (!state || at - drawnAt < 90) return;
  drawnAt = at;
  const cell = (name, value, digits, unit, low, high, limits) => el("div", {}, el("span", { class: "note" }, name), el("div", { class: "value" }, value === null || value === undefined ? "–" : value.toFixed(digits).replace("-", "−"), el("small", {}, unit)), gauge(value, low, high, limits, unit));
  const length = own.length || [null, null], tension = own.tension, top = tension[1] || 500, winding = state.cable_speed === null ? null : -state.cable_speed;
  const kind = tripped().length ? "tripped" : MOVING.has(state.phase) ? "moving" : state.phase === "stopping" ? "stopping" : "";
  fill(values, cell("Cable length", state.cable_length, 3, "m", 0, (length[1] || 5) * 1.06, length), cell("Tension", state.tension, 1, "N", 0, top * 1.05, tension),
    cell("Speed, + winds in", winding, 3, "m/s", -own.speed * 1.05, own.speed * 1.05, [-own.speed, own.speed]),
    el("div", {}, el("span", { class: "note" }, "State"), el("div", { class: `state ${kind}` }, words(state)), el("span", { class: "note" }, `${state.state}${state.commander ? `; ${state.commander} commands` : ""}`)));
  drawing(state);
  const host = document.getElementById("cycles");
  if (host && picture.status.cycle_time) cycles(host, picture.status.cycle_time, picture.status.overruns);
  if (!paused) for (const chart of charts) chart();
}

// Drum and pulleys to scale; the cable's way between them is schematic.
function drawing(state) {
  const box = document.getElementById("drawing"), own = declared.winch[winch], limits = own.limits.length || [0, Math.max(1, state.cable_length || 1)];
  const scale = Math.min(60 / own.drum_radius, ...own.pulleys.map((p) => 36 / p.radius)), drum = own.drum_radius * scale, most = limits[1] * 1.06;
  const y = (length) => 50 + (Math.max(0, Math.min(most, length)) / most) * 380, at = y(state.cable_length || 0), angle = state.motor_angle || 0;
  const radii = own.pulleys.slice(0, 2).map((p) => p.radius * scale), hatch = "url(#hatch)";
  const parts = [svg("defs", {}, svg("pattern", { id: "hatch", width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" }, svg("rect", { width: 2, height: 6, fill: "var(--stop)", opacity: 0.5 })))];
  const cx = 110, cy = 250, px = 150, py = 70, qx = 250, r1 = radii[0] || 20, r2 = radii[1] || r1, qy = 110;
  const cable = `M${cx - drum} ${cy} L${px - r1} ${py} A${r1} ${r1} 0 0 1 ${px + r1 * 0.7} ${py - r1 * 0.7} L${qx + r2 * 0.7} ${qy - r2 * 0.7} A${r2} ${r2} 0 0 1 ${qx + r2} ${qy} L${qx + r2} ${Math.max(at, qy + 20)}`;
  parts.push(svg("circle", { cx: px, cy: py, r: r1, fill: "var(--sunk)", stroke: "var(--edge)" }), svg("circle", { cx: qx, cy: qy, r: r2, fill: "var(--sunk)", stroke: "var(--edge)" }), svg("circle", { cx, cy, r: drum, fill: "var(--sunk)", stroke: "var(--with)", "stroke-width": 4 }),
    svg("line", { x1: cx, y1: cy, x2: cx + drum * 0.8 * Math.cos(angle / gear()), y2: cy - drum * 0.8 * Math.sin(angle / gear()), stroke: "var(--ink2)", "stroke-width": 4 }), svg("circle", { cx, cy, r: 6, fill: "var(--ink2)" }),
    svg("path", { d: cable, fill: "none", stroke: "var(--with)", "stroke-width": 3 }),
    svg("text", { x: cx, y: cy + drum + 22, "text-anchor": "middle", "font-weight": 600, fill: "var(--ink)" }, `Drum ${winch}`), svg("text", { x: cx, y: cy + drum + 38, "text-anchor": "middle", fill: "var(--muted)" }, `winding radius ${number(own.drum_radius * 1000, 3)} mm`));
  const load = Math.max(at, qy + 20);
  parts.push(svg("rect", { x: qx + r2 - 26, y: load, width: 52, height: 38, rx: 3, fill: "var(--ink2)" }), own.load_mass ? svg("text", { x: qx + r2, y: load + 24, "text-anchor": "middle", fill: "var(--surface)", "font-weight": 600 }, `${number(own.load_mass, 3)} kg`) : null,
    state.tension !== null ? svg("text", { x: qx + r2 - 12, y: load - 12, "text-anchor": "end", fill: "var(--with)", "font-weight": 600 }, `${state.tension.toFixed(1)} N`) : null);
  const gx = 350;
  parts.push(svg("rect", { x: gx, y: y(0), width: 12, height: y(most) - y(0), fill: "var(--band)" }), svg("rect", { x: gx, y: y(0), width: 12, height: y(limits[0]) - y(0), fill: hatch }), svg("rect", { x: gx, y: y(limits[1]), width: 12, height: y(most) - y(limits[1]), fill: hatch }));
  for (let k = 0; k <= most; k++) parts.push(svg("text", { x: gx + 20, y: y(k) + 4, fill: "var(--muted)" }, k ? String(k) : "0 m"));
  parts.push(svg("text", { x: gx + 46, y: y(limits[0]) + 4, fill: "var(--ink2)" }, `limit ${number(limits[0], 3)}`), svg("text", { x: gx + 46, y: y(limits[1]) + 4, fill: "var(--ink2)" }, `limit ${number(limits[1], 3)}`),
    svg("path", { d: `M${gx - 12} ${at - 6}l9 6l-9 6z`, fill: "var(--ink)" }), svg("line", { x1: gx - 3, x2: gx + 14, y1: at, y2: at, stroke: "var(--ink)", "stroke-width": 2 }));
  const mm = drum > 0 ? 0.1 * scale : 0;
  parts.push(svg("path", { d: `M20 450v-5m0 2.5h${mm}m0 -2.5v5`, stroke: "var(--ink2)", fill: "none" }), svg("text", { x: 20, y: 440, fill: "var(--muted)" }, "100 mm, drum and pulleys; distances schematic"));
  fill(box, svg("svg", { viewBox: "0 0 460 460", width: "100%", "font-size": 12, role: "img", "aria-label": `Winch ${winch}: ${words(state)}, ${number(state.cable_length)} m` }, parts.filter(Boolean)));
}

const gear = () => declared.winch[winch].ratio || 1;

function strips() {
  const box = document.getElementById("strips");
  charts = [];
  if (!box) return;
  const chart = (title, unit, height, read, more = {}) => {
    const last = el("span", { class: "note" }), host = el("div", { class: "plot" });
    box.append(el("div", { class: "strip" }, el("h3", {}, title, el("span", { class: "note" }, unit), last), host));
    const first = read();
    const drawn = plot(host, first.data, more.series || [line("ink", 1.4, 0.6), line("today", 1.4)], { height, label: `${title} over the last 60 s`, xLabel: more.axis ? "s" : "", range: more.range });
    charts.push(() => { const next = read(); drawn.setData(next.data, false); drawn.setScale("x", { min: -60, max: 0 }); last.textContent = next.last; });
  };
  const rows = () => history[winch] || [], end = () => (rows().length ? rows().at(-1).time : 0);
  const measured = (channel, sign = 1) => rows().map((row) => (row[channel] === null || row[channel] === undefined ? null : sign * row[channel]));
  const joined = (channel, output, part) => {
    const own = rows(), p = predictions[winch], found = p && p[output], at = new Map(found ? p.time.map((t, i) => [t, found[part][i]]) : []);
    return own.map((row) => at.get(row.time) ?? null);
  };
  const top = declared.winch[winch].limits.speed;
  const times = () => rows().map((row) => row.time - end());
  const text = (values, digits, unit) => { const v = values.filter((x) => x !== null).at(-1); return v === undefined ? "" : `${v.toFixed(digits).replace("-", "−")} ${unit}`; };
  chart("Tension", "N", 110, () => { const m = measured("tension"); return { data: [times(), m, joined("tension", "tension", "predicted")], last: text(m, 1, "N") }; });
  chart("Motor torque residual", "N m, measured − predicted", 90, () => { const r = joined("motor_torque", "motor_torque", "residual"); return { data: [times(), r], last: text(r, 3, "N m") }; }, { series: [line("today", 1)] });
  chart("Cable length", "m", 90, () => { const m = measured("cable_length"); return { data: [times(), m], last: text(m, 3, "m") }; }, { series: [line("ink", 1.4)] });
  chart("Speed", "m/s, winding in is positive", 90, () => { const m = measured("cable_speed", -1); return { data: [times(), m], last: text(m, 3, "m/s") }; }, { series: [line("ink", 1.4)], axis: true, range: () => [-1.05 * top, 1.05 * top] });
}
