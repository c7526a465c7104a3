// The last two seconds before a trip and half a second after it: tension, and speed as it was
// commanded and measured, with the limits; the events beside their times.
import { el, fill, number, sourceOf, svg } from "./page.js";
import { drawingExporter } from "./exports.js";
import { legend } from "./plots.js";

const FROM = -2, TO = 0.5;
const LEFT = 52;
// Of the chart's width, so that its text has one size on every screen.
const scaleOf = (right) => (time) => LEFT + ((time - FROM) / (TO - FROM)) * (right - LEFT);

// `tare`: gross less net tension, N; the limits act on the gross one, and the net one is drawn.
export function trip(host, found, winch, declared, tare) {
  const own = found.winch[winch], limits = declared.winch[winch].limits, WIDTH = Math.max(300, Math.min(660, host.clientWidth)), RIGHT = WIDTH - 60, x = scaleOf(RIGHT), negated = (values) => values.map((v) => (v === null ? null : -v));
  const speed = negated(own.cable_speed), commanded = negated(own.commanded_speed);
  const parts = [svg("defs", {}, svg("pattern", { id: "forbidden", width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" }, svg("rect", { width: 2, height: 6, fill: "var(--stop)", opacity: 0.4 }))),
    ...panel({ title: "Tension", unit: "N", top: 22, height: 130, times: found.time, curves: [[own.tension, "ink", 1.6]], limits: limits.tension.map((v) => v === null ? null : v - (tare || 0)), RIGHT, x }),
    ...panel({ title: "Speed", unit: "m/s, + winds in", top: 184, height: 80, times: found.time, curves: [[commanded, "with", 2.4, "5 3"], [speed, "ink", 1.6]], limits: [-limits.speed, limits.speed], RIGHT, x })];
  for (let t = FROM; t <= TO + 1e-9; t += WIDTH < 500 ? 1 : 0.5) parts.push(svg("text", { x: x(t), y: 284, "text-anchor": "middle", fill: "var(--muted)" }, `${number(t)}${t + (WIDTH < 500 ? 1 : 0.5) > TO ? " s" : ""}`));
  parts.push(svg("line", { x1: x(0), x2: x(0), y1: 22, y2: 264, stroke: "var(--stop)", "stroke-width": 1.5 }));
  const title = `Winch ${winch}: two seconds before the trip, half a second after`;
  const drawn = svg("svg", { viewBox: `0 0 ${WIDTH} 290`, width: "100%", "font-size": 12, role: "img", "aria-label": title }, parts);
  const columns = [["time from trip [s]", found.time], ["tension [N]", own.tension], ["speed, + winds in [m/s]", speed], ["commanded speed [m/s]", commanded], ["cable length [m]", own.cable_length]];
  fill(host, el("div", { class: "row" }, legend(["ink", "measured"], ["with", "commanded (dashed)"]), drawingExporter("trip", title, drawn, () => sourceOf(`bench ${declared.name}`, found.tripped.map((one) => one.message).join("; ")), columns)), drawn,
    el("table", { class: "events" }, el("thead", { class: "visually-hidden" }, el("tr", {}, el("th", {}, "Time from the trip, s"), el("th", {}, "Event"))), el("tbody", {}, found.events.map(([time, words]) =>
      el("tr", { class: found.tripped.some((one) => one.message === words) ? "cause" : null }, el("td", { class: "number tight" }, `${time > 0 ? "+" : ""}${time.toFixed(3).replace("-", "−")} s`), el("td", {}, words))))));
}

// What the trip allows: when it came to rest, and what is still forbidden after a reset.
export function consequences(found) {
  const rest = found.events.filter(([time, words]) => time >= 0 && words.includes("disabled")).map(([time]) => time);
  const stopped = rest.length ? `Stopped and disabled within ${number(Math.max(...rest) * 1000, 3)} ms.` : "Everything stopped.";
  const still = found.blocked.filter((one) => one.forbids !== "nothing" && !found.tripped.some((trip) => trip.message === one.message)).map((one) => `${one.message}: forbids ${one.forbids}`);
  const same = found.blocked.filter((one) => one.forbids !== "nothing" && found.tripped.some((trip) => trip.message === one.message)).map((one) => one.forbids);
  const now = el("p", {}, `${stopped} After the reset nothing moves before a new command${same.length ? `; ${[...new Set(same)].join(", ")} stays forbidden until this ends` : ""}.`);
  return !still.length ? now : el("div", {}, now, el("details", {}, el("summary", {}, "Still present; a reset alone does not free the winch:"), el("ul", {}, still.map((words) => el("li", {}, words)))));
}

// Messages that differ by the name of the winch only, as one: "winches A and B: …".
export function together(messages) {
  const found = new Map();
  for (const message of messages) {
    const [, winch, rest] = /^winch ([^:]+): (.*)$/s.exec(message) || [null, null, message];
    found.set(rest, [...(found.get(rest) || []), winch]);
  }
  return [...found].map(([rest, winches]) => (winches[0] === null ? rest : `${winches.length > 1 ? `winches ${winches.slice(0, -1).join(", ")} and ${winches.at(-1)}` : `winch ${winches[0]}`}: ${rest}`));
}

function panel({ title, unit, top, height, times, curves, limits, RIGHT, x }) {
  const values = curves.flatMap(([own]) => own.filter((v) => v !== null)), least = Math.min(...values), most = Math.max(...values), known = limits.filter((v) => v !== null && v !== undefined), margin = Math.max(0.15 * (most - least), 0.02 * ((known.length ? Math.max(...known.map(Math.abs)) : 0) || 1));
  const low = least - margin, high = most + margin, y = (v) => top + height - ((Math.max(low, Math.min(high, v)) - low) / (high - low)) * height;
  const [under, over] = limits, away = [under, over].filter((v) => v !== null && v !== undefined && (v <= low || v >= high)).map((v) => number(v, 3));
  const out = [svg("text", { x: LEFT, y: top - 8, "font-weight": 600, fill: "var(--ink)" }, title, svg("tspan", { "font-weight": 400, fill: "var(--muted)" }, ` ${unit}${away.length && RIGHT > 400 ? ` · limit${away.length > 1 ? "s" : ""} ${away.join(" and ")} outside` : ""}`))];
  if (!values.length) return [...out, svg("text", { x: LEFT, y: top + 20, fill: "var(--muted)" }, "not measured")];
  const band = (from, to) => out.push(svg("rect", { x: LEFT, y: y(to), width: RIGHT - LEFT, height: Math.max(0, y(from) - y(to)), fill: "url(#forbidden)" }));
  const limit = (v) => out.push(svg("text", { x: RIGHT + 6, y: y(v) + 4, fill: "var(--ink2)" }, `limit ${number(v, 3)}`));
  if (over !== null && over !== undefined && over < high) { band(over, high); limit(over); }
  if (under !== null && under !== undefined && under > low) { band(low, under); limit(under); }
  for (const tick of ticks(low, high)) out.push(svg("line", { x1: LEFT, x2: RIGHT, y1: y(tick), y2: y(tick), stroke: "var(--line)" }), svg("text", { x: LEFT - 6, y: y(tick) + 4, "text-anchor": "end", fill: "var(--muted)" }, number(tick, 4)));
  for (const [own, tone, width, dash] of curves) out.push(svg("path", { d: path(times, own, x, y), fill: "none", stroke: `var(--${tone})`, "stroke-width": width, ...(dash ? { "stroke-dasharray": dash } : {}) }));
  return out;
}

function path(times, values, x, y) {
  let out = "", pen = false;
  times.forEach((time, i) => { if (values[i] === null) { pen = false; return; } out += `${pen ? "L" : "M"}${x(time).toFixed(1)} ${y(values[i]).toFixed(1)}`; pen = true; });
  return out;
}

function ticks(low, high) {
  const raw = (high - low) / 4, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw), out = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) out.push(Number((k * step).toPrecision(12)));
  return out;
}
