// Channels of runs over time or over each other: a panel of Diagnose, and the Library's overlay.
import { ask, drawAnswer, el, fill, sourceOf } from "./page.js";
import { exporter } from "./figures.js";
import { dots, line, plot, sorted } from "./plots.js";

// Colours of runs and of winches, each unlike the others.
export const TONES = ["with", "today", "brush", "ok", "muted", "rose", "warn", "ink"];
export const TIME = "time", MOST = TONES.length;
const toneOf = (i) => TONES[i], lower = (name) => name.replaceAll("_", " "), capital = (name) => `${name[0].toUpperCase()}${lower(name).slice(1)}`;

// Choice of a channel; `chosen` is called with its name.
export const choice = (label, names, value, chosen) => el("select", { "aria-label": label, onchange: (event) => chosen(event.target.value) }, names.map((name) => el("option", { value: name, selected: name === value }, lower(name))));

// Draws what the server sent of some runs: legend, lines, and the difference of two over time.
export function drawLines(box, { channel, over, lines, difference }, source, note = "") {
  if (!lines.length) { fill(box, el("p", { class: "note" }, `None of these runs has ${lower(channel)}${over === TIME ? "" : ` and ${lower(over)}`}.`)); return; }
  const timed = over === TIME, [{ unit, x_unit: xUnit }] = lines, label = `${over} [${xUnit}]`, title = `${capital(channel)} over ${lower(over)}`, names = lines.map((own) => own.name.split("/").at(-1));
  const figure = () => ({ title, source: sourceOf(source), legend: lines.map((own, i) => ({ name: own.name, tone: toneOf(i) })), height: 320,
    panels: [{ title: `${channel} [${unit}]`, xLabel: label, series: lines.map((own, i) => ({ name: `${own.name} [${own.unit}]`, tone: toneOf(i), x: own.x, y: own.y })) },
      ...(difference ? [{ title: `Difference [${difference.unit}]`, xLabel: label, series: [{ name: `${difference.name} [${difference.unit}]`, x: difference.x, y: difference.y, tone: "ink" }] }] : [])] });
  const host = el("div", { class: "plot" });
  fill(box, el("div", { class: "legend column" }, lines.map((own, i) => el("span", {}, el("i", { style: { background: `var(--${toneOf(i)})` } }), own.name))),
    el("h3", { class: "row" }, title, el("span", { class: "note" }, [unit, timed ? "each run from its own start" : "", note].filter(Boolean).join(", ")), exporter(`${channel}-over-${over}`, figure)), host);
  const own = (i) => lines.flatMap((each, k) => (k === i ? each.y : each.y.map(() => null)));
  const data = timed ? uPlot.join(lines.map((each) => [each.x, each.y])) : sorted(lines.flatMap((each) => each.x), ...lines.map((_, i) => own(i))).columns;
  const style = (i) => (timed ? line(toneOf(i), 1.4, 1, { spanGaps: true }) : { paths: dots(toneOf(i), 0.5, 2), points: { show: false } });
  plot(host, data, lines.map((_, i) => style(i)), { height: difference ? 200 : 320, xLabel: xUnit, sync: timed ? "lines" : null, names, unit, label: `${title}, ${lines.length} runs`,
    traces: timed ? [] : lines.map(({ x, y }, i) => ({ x, y, tone: toneOf(i), width: 1, timed: true })) });
  if (!difference) return;
  const below = el("div", { class: "plot" });
  box.append(el("h3", { class: "row" }, "Difference", el("span", { class: "note" }, `${difference.unit}, ${difference.name}`)), below);
  plot(below, [difference.x, difference.y], [line("ink", 1.4)], { height: 140, xLabel: xUnit, sync: "lines", names: ["difference"], unit: difference.unit, label: `Difference of the ${lower(channel)} over time` });
}

let shown = false, channel = "tension", over = "motor_angle";

// The panel: any channel of the used runs over another one; it is drawn while it is open.
export function channelPanel({ runs }) {
  const used = runs.filter((run) => run.used), known = [...new Set(used.flatMap((run) => run.channels))], box = el("div", {});
  if (!known.includes(channel)) channel = known[0];
  if (over !== TIME && !known.includes(over)) over = TIME;
  const draw = () => drawAnswer(box, () => ask(`/api/lines?channel=${encodeURIComponent(channel)}&over=${encodeURIComponent(over)}`),
    (found) => drawLines(box, found, used.map((run) => run.name).join(", "), used.length > MOST ? `the first ${MOST} runs` : ""));
  return el("section", { class: "panel", id: "channels", style: { marginTop: "16px" } }, el("details", { open: shown, ontoggle: (event) => { shown = event.target.open; if (shown) draw(); } }, el("summary", {}, "Any channel over another"),
    el("div", { class: "row" }, choice("Channel", known, channel, (name) => { channel = name; draw(); }), el("span", { class: "label" }, "over"), choice("Over", [TIME, ...known], over, (name) => { over = name; draw(); })), box));
}
