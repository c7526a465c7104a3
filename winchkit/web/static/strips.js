// Strip charts of the last 60 s: any channels of one unit in one chart, with the profile's prediction
// and residual; zoomed and paused while the bench runs.
import { el, fill, number, sourceOf } from "./page.js";
import { exporter } from "./figures.js";
import { line, plot } from "./plots.js";

const LEFT = 58, WHOLE = [-60, 0], DEFAULT = [["tension", "tension predicted"], ["tension residual"], ["cable length"], ["speed", "commanded speed"]];
const measured = (key, sign = 1) => ({ rows }) => rows.map((row) => (row[key] === null || row[key] === undefined ? null : sign * row[key]));
const modelled = (output, part) => ({ rows, predicted }) => { const own = predicted && predicted[output], at = new Map(own ? predicted.time.map((t, i) => [t, own[part][i]]) : []); return rows.map((row) => at.get(row.time) ?? null); };
const CHANNELS = {
  tension: { unit: "N", least: 2, digits: 1, read: measured("tension"), style: ["ink", 1.6, 0.5] },
  "tension predicted": { unit: "N", least: 2, digits: 1, read: modelled("tension", "predicted"), style: ["today", 1.25] },
  "tension residual": { unit: "N", least: 2, digits: 2, read: modelled("tension", "residual"), mean: modelled("tension", "mean"), noise: "tension", style: ["today", 1, 0.45] },
  "motor torque": { unit: "N m", least: 0.01, digits: 3, read: measured("motor_torque"), style: ["ink", 1.6, 0.5] },
  "motor torque predicted": { unit: "N m", least: 0.01, digits: 3, read: modelled("motor_torque", "predicted"), style: ["today", 1.25] },
  "motor torque residual": { unit: "N m", least: 0.01, digits: 3, read: modelled("motor_torque", "residual"), mean: modelled("motor_torque", "mean"), noise: "motor_torque", style: ["today", 1, 0.45] },
  "cable length": { unit: "m", least: 0.01, digits: 3, read: measured("cable_length"), style: ["ink", 1.4] },
  "length instrument": { unit: "m", least: 0.01, digits: 3, read: measured("length"), style: ["ink", 1.6, 0.5] },
  "length predicted": { unit: "m", least: 0.01, digits: 3, read: modelled("cable_length", "predicted"), style: ["today", 1.25] },
  "length residual": { unit: "m", least: 0.01, digits: 4, read: modelled("cable_length", "residual"), mean: modelled("cable_length", "mean"), noise: "cable_length", style: ["today", 1, 0.45] },
  speed: { unit: "m/s, + winds in", least: 0.05, digits: 3, read: measured("cable_speed", -1), style: ["ink", 1.4] },
  "commanded speed": { unit: "m/s, + winds in", least: 0.05, digits: 3, read: measured("commanded_speed", -1), style: ["with", 1.8, 0.8] },
  load: { unit: "N", least: 2, digits: 1, read: measured("load"), style: ["with", 1.4] },
  "motor angle": { unit: "rad", least: 0.1, digits: 2, read: measured("motor_angle"), style: ["ink", 1.4] },
  "motor velocity": { unit: "rad/s", least: 0.5, digits: 2, read: measured("motor_velocity"), style: ["ink", 1.4] },
  temperature: { unit: "°C", least: 2, digits: 1, read: measured("temperature"), style: ["ink", 1.4] },
};

// The range of values, no narrower than `least`, with a margin.
function spread(low, high, least) {
  if (low === null || high === null) return [-least, least];
  const middle = (low + high) / 2, half = Math.max(0.55 * (high - low), least / 2);
  return [middle - half, middle + half];
}

let chosen = DEFAULT.map((names) => [...names]), span = [...WHOLE], drawn = [], paused = false, kept = null;

export const isPaused = () => paused;
export function pause(button) { paused = !paused; if (!paused) kept = null; button.firstChild.textContent = paused ? "Go on " : "Pause "; }

// `read` gives the rows of the history and the predictions, now; each plot is `taller` by px.
export function strips(box, read, { winch, limits, bench, profile, taller }) {
  drawn = []; kept = null;
  fill(box, chosen.map((names, index) => strip(names, index)));
  fill(box.parentElement.querySelector(".more"), el("select", { "aria-label": "Add a chart", onchange: (event) => { if (event.target.value) { chosen.push([event.target.value]); again(); } } }, el("option", { value: "" }, "Add a chart…"), Object.keys(CHANNELS).map((name) => el("option", {}, name))),
    chosen.length ? exporter("strips", describe) : null);
  const hosts = [...box.querySelectorAll(".plot")];
  chosen.forEach((names, i) => draw(names, hosts[i], box.querySelectorAll(".last")[i], i === chosen.length - 1));

  function again() { strips(box, read, { winch, limits, bench, profile, taller }); refresh(); }

  function strip(names, index) {
    const unit = CHANNELS[names[0]].unit, more = Object.keys(CHANNELS).filter((name) => CHANNELS[name].unit === unit && !names.includes(name));
    return el("div", { class: "strip" }, el("h3", {}, names.map((name) => el("span", { class: "channel" }, el("i", { style: { background: `var(--${CHANNELS[name].style[0]})` } }), name, el("button", { class: "plain", "aria-label": `Remove ${name}`, onclick: () => { chosen[index] = names.filter((other) => other !== name); chosen = chosen.filter((list) => list.length); again(); } }, "×"))),
      el("span", { class: "note" }, names.some((name) => CHANNELS[name].noise) ? `${unit}, dashed: noise ±1σ, strong: mean of 1 s` : unit), more.length ? el("select", { "aria-label": `Add a channel to ${names.join(", ")}`, onchange: (event) => { if (event.target.value) { names.push(event.target.value); again(); } } }, el("option", { value: "" }, "+"), more.map((name) => el("option", {}, name))) : null, el("span", { class: "note beyond" }), el("span", { class: "last" })), el("div", { class: "plot" }));
  }

  function draw(names, host, last, axis) {
    const means = names.filter((name) => CHANNELS[name].mean), residual = names.find((name) => CHANNELS[name].noise), band = { noise: null };
    const series = [...names.map((name) => line(...CHANNELS[name].style)), ...means.map(() => line("today", 2)), ...(residual ? [line("edge", 1, 1, { dash: [4, 3] }), line("edge", 1, 1, { dash: [4, 3] })] : [])];
    const data = () => {
      const now = (paused && kept) || (kept = read()), end = now.rows.length ? now.rows.at(-1).time : 0, columns = [...names.map((name) => CHANNELS[name].read(now)), ...means.map((name) => CHANNELS[name].mean(now))];
      const noise = residual && now.predicted && now.predicted[CHANNELS[residual].noise] ? now.predicted[CHANNELS[residual].noise].noise : null;
      if (residual) columns.push(now.rows.map(() => noise), now.rows.map(() => (noise === null ? null : -noise)));
      return [now.rows.map((row) => row.time - end), ...columns];
    };
    const own = plot(host, data(), series, { height: (axis ? 96 : 72) + taller, left: LEFT, names, unit: CHANNELS[names[0]].unit.split(",")[0], sync: "strips", label: `${names.join(", ")} over the last 60 s`, xLabel: axis ? "s" : "", bare: !axis, range: (u, low, high) => spread(low, high, CHANNELS[names[0]].least), zoom: (low, high) => { span = low === null || high - low > 60 ? [...WHOLE] : [Math.max(-60, low), Math.min(0, high)]; refresh(true); } });
    const lines = ({ gross, tension } = {}) => names[0] === "tension" ? limits.tension.map((v) => v === null ? null : v - ((gross ?? tension) - tension)) : names[0] === "speed" ? [-limits.speed, limits.speed] : names[0] === "cable length" ? limits.length || [] : [];
    const beyond = last.parentElement.querySelector(".beyond");
    drawn.push(() => {
      const next = data(), top = lines(kept.rows.at(-1));
      own.setData(next, false);
      own.setScale("x", { min: span[0], max: span[1] });
      const values = next[1].filter((v, i) => v !== null && next[0][i] >= span[0] && next[0][i] <= span[1]), away = top.filter((v) => v !== null && (!values.length || v > Math.max(...values) || v < Math.min(...values)));
      beyond.textContent = away.length ? `limit${away.length > 1 ? "s lie" : " lies"} outside this plot: ${away.map((v) => `${number(v, 3)} ${CHANNELS[names[0]].unit.split(",")[0]}`).join(" and ")}` : "";
      fill(last, names.map((name, i) => { const v = next[1 + i].filter((x) => x !== null).at(-1); return el("b", { style: { color: CHANNELS[name].style[0] === "ink" ? null : `var(--${CHANNELS[name].style[0]})` } }, v === undefined ? "–" : `${v.toFixed(CHANNELS[name].digits).replace("-", "−")} `); }), CHANNELS[names[0]].unit.split(",")[0]);
    });
  }

  function describe() {
    const now = kept || read(), end = now.rows.length ? now.rows.at(-1).time : 0, x = now.rows.map((row) => row.time - end);
    return { title: `Winch ${winch}: the last 60 s`, source: sourceOf(`bench ${bench}`, `profile ${profile}`), legend: [{ name: "measured", tone: "ink" }, { name: "predicted, residual", tone: "today" }, { name: "commanded", tone: "with" }],
      panels: chosen.map((names) => ({ title: `${names.join(", ")} [${CHANNELS[names[0]].unit}]`, xLabel: "time [s]", x, series: names.map((name) => ({ name: `${name} [${CHANNELS[name].unit}]`, tone: CHANNELS[name].style[0], y: CHANNELS[name].read(now) })) })) };
  }
}

export function refresh(always = false) {
  if (!paused) kept = null;
  if (!paused || always) for (const each of drawn) each();
}
