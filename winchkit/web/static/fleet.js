// The fleet: a grid of winches and time for each effect, coloured by the deviation from the median
// winch; a cell leads to the runs behind it.
import { ask, attempt, dialog, el, fill, number, order, say, sourceOf, svg } from "./page.js";
import { drawingExporter } from "./exports.js";
import { steps } from "./figures.js";
import { readable } from "./plots.js";

const ROW = 20, DAY = 86400;

// A value to the second digit of its standard deviation.
function withStd(value, std) {
  if (!(std > 0)) return number(value);
  const decimals = Math.max(0, 1 - Math.floor(Math.log10(std)));
  return `${value.toFixed(decimals).replace("-", "−")} ± ${std.toFixed(decimals)}`;
}

let root, state = null, found = null, tabs = null, picked = null;

export async function enter(main, fresh, switcher) {
  root = main; state = fresh; tabs = switcher;
  fill(root, el("div", { class: "row context" }, tabs, el("span", { class: "label" }, "Reading the library")));
  await load();
}

async function load() { await attempt(async () => { found = await ask("/api/fleet"); render(); }); }

export function update(fresh, before) {
  state = fresh;
  if (before && before.busy && !fresh.busy) load(); else busy();
}

const day = (time) => new Date(1000 * time).toISOString().slice(0, 10);
const words = (name) => name.replaceAll("-", " ").replaceAll("_", " ");
const title = (own) => `${own.name}, ${words(own.parameter)}`;
const heading = (winch, own) => `${winch.winch}: ${own.name[0].toLowerCase()}${own.name.slice(1)}`;
// The winches of a kind with their effects, where they are few.
const named = (fitted, count, fits) => (count <= 2 ? `: ${fitted.parameters.flatMap((own) => own.winches.filter(fits).map((winch) => heading(winch, own).replace(":", ","))).join("; ")}` : "");
const many = (count, word) => `${count} ${word}${count === 1 ? "" : word.endsWith("ch") ? "es" : "s"}`;

function render() {
  if (!root.isConnected) return;
  const fitted = found.fitted;
  fill(root, context(), el("div", { id: "busy" }));
  busy();
  if (!fitted) { root.append(start()); return; }
  if (!picked) picked = first(fitted);
  root.append(el("div", { class: "verdict" }, el("h1", {}, fitted.changed || fitted.odd ? [fitted.changed ? many(fitted.changed, "change") + named(fitted, fitted.changed, (w) => w.change) : null, fitted.odd ? `${many(fitted.odd, "winch")} that differ${fitted.odd === 1 ? "s" : ""} from the others` : null].filter(Boolean).join(", ") : fitted.nothing),
    el("p", {}, `${many(fitted.winches, "winch")}, ${many(fitted.sessions, "session")}, the same effects fitted to all; false discovery rate 1 % (${fitted.procedure}).${fitted.undetermined ? ` ${fitted.undetermined} estimates left out, which their runs leave open.` : ""}`)),
  el("div", { class: "grid" }, el("section", { class: "panel w8", "aria-label": "Fleet" }, fitted.parameters.map(drawGrid), scale()), el("section", { class: "panel w4", id: "series", "aria-label": "Estimates of a winch" })));
  for (const [name, reason] of Object.entries(fitted.failures)) root.append(el("p", { class: "note" }, `${name}: ${reason}`));
  drawSeries();
}

function context() {
  const profile = el("input", { value: found.profile || (state.profile ? state.profile.name : ""), size: 22, placeholder: "name, file or folder", "aria-label": "Profile of the fleet" });
  const effects = el("input", { value: found.fitted ? found.fitted.effects.join(", ") : "", size: 22, placeholder: "those that are named", "aria-label": "Effects to follow" });
  const fit = () => attempt(() => { if (!profile.value.trim()) throw new Error("No profile is given. Type the name of a profile, a file, or a folder with WINCH.toml for each winch."); return order("fleet", { profile: profile.value.trim(), effects: effects.value.split(/[\s,]+/).filter(Boolean) }); });
  return el("div", { class: "row context" }, tabs, el("span", { class: "label" }, `Folder ${found.folder}: ${many(found.sessions, "session")}, ${found.diagnosed} diagnosed`),
    el("span", { class: "row end" }, el("label", { class: "row" }, "Profile", profile), el("label", { class: "row" }, "Effects", effects), el("button", { class: "primary", disabled: !found.indexed || Boolean(state.busy), onclick: fit }, found.fitted ? "Fit again" : "Fit all sessions")));
}

function start() {
  const command = [found.indexed ? null : `winchkit library index ${found.folder}`, found.diagnosed ? null : `winchkit fleet diagnose ${found.folder} -p PROFILE`].filter(Boolean);
  return el("div", { class: "drop" }, el("h1", {}, found.indexed ? "Which winch differs, since when?" : "This folder has no index yet"),
    el("p", { class: "note" }, command.length ? "The fleet shows tables that these commands write. Effects can also be named above." : "Fits one set of effects to every session (0.2 s each), and tests every series for a step and a trend."), command.length ? el("pre", { tabindex: 0 }, command.join("\n")) : null);
}

function busy() {
  const box = root.querySelector("#busy");
  if (!box) return;
  fill(box, state.busy ? el("div", { class: "row", style: { paddingBottom: "12px" } }, el("progress", { max: 1, value: state.busy.share, "aria-label": "Progress" }), el("span", { class: "label" }, state.busy.what), el("button", { class: "plain", onclick: () => attempt(() => order("cancel")) }, "Cancel")) : null);
}

// The most striking series first: a change, then an odd winch.
function first({ parameters }) {
  for (const fits of [(w) => w.change, (w) => w.odd, () => true]) for (const [p, own] of parameters.entries()) { const w = own.winches.findIndex(fits); if (w >= 0) return { p, w, s: own.winches[w].times.length - 1 }; }
  return null;
}

const LIMIT = 6;
const tone = (z) => (z === null ? "line" : z < 0 ? "with" : "today");
const depth = (z) => (z === null ? 0.3 : Math.min(1, 0.06 + (0.94 * Math.abs(z)) / LIMIT));

function ends() { const times = found.fitted.parameters.flatMap((own) => own.winches.flatMap((w) => w.times)); return [times.reduce((a, b) => Math.min(a, b)), times.reduce((a, b) => Math.max(a, b))]; }

// Start and end of every cell of a winch: half way to the sessions before and after.
function cellEnds(times, whole) {
  const steps = times.slice(1).map((t, i) => t - times[i]), usual = steps.length ? [...steps].sort((a, b) => a - b)[Math.floor(steps.length / 2)] : (whole[1] - whole[0]) || DAY;
  return times.map((t, i) => [t - Math.min(i ? steps[i - 1] : usual, usual) / 2, t + Math.min(i < steps.length ? steps[i] : usual, usual) / 2]);
}

function drawGrid(own, p) {
  const whole = ends(), narrow = root.clientWidth < 700, W = narrow ? Math.max(260, root.clientWidth - 66) : 760, NAME = narrow ? 72 : 110, height = ROW * own.winches.length;
  const edges = own.winches.flatMap((winch) => cellEnds(winch.times, whole).flat()), low = edges.reduce((a, b) => Math.min(a, b)), high = edges.reduce((a, b) => Math.max(a, b));
  const X = (t) => NAME + ((t - low) / (high - low)) * (W - NAME - 8), parts = [];
  own.winches.forEach((winch, w) => {
    const y = w * ROW;
    parts.push(svg("text", { x: NAME - 8, y: y + 14, "text-anchor": "end", fill: winch.odd || winch.change ? "var(--ink)" : "var(--ink2)", "font-weight": winch.odd || winch.change ? 700 : 400 }, `${winch.odd ? "≠ " : ""}${winch.winch.length > NAME / 8 ? `${winch.winch.slice(0, NAME / 8 - 1)}…` : winch.winch || "winch"}`));
    cellEnds(winch.times, whole).forEach(([from, to], s) => {
      const z = winch.deviations[s], x = X(from), width = Math.max(2, X(to) - x - 1), chosen = picked && picked.p === p && picked.w === w && picked.s === s;
      const cell = svg("g", { class: "cell", "data-at": `${p} ${w} ${s}` }, svg("title", {}, `${winch.winch} ${day(winch.times[s])}: ${number(winch.values[s])} ${own.unit}, ${number(z, 2)} σ from the median winch`),
        svg("rect", { x, y: y + 2, width, height: ROW - 4, fill: "var(--sunk)" }), svg("rect", { x, y: y + 2, width, height: ROW - 4, fill: `var(--${tone(z)})`, opacity: depth(z) }),
        width > 9 && z !== null && Math.abs(z) >= 3 ? svg("text", { x: x + width / 2, y: y + 14, "text-anchor": "middle", fill: Math.abs(z) > 4 ? "var(--surface)" : "var(--ink)", "pointer-events": "none" }, z > 0 ? "+" : "−") : null,
        chosen ? svg("rect", { x: x - 1, y: y + 1, width: width + 2, height: ROW - 2, fill: "none", stroke: "var(--ink)", "stroke-width": 2 }) : null);
      cell.addEventListener("click", () => choose(p, w, s));
      parts.push(cell);
    });
    if (winch.change && winch.change.date !== null) {
      const [a, b, at] = [winch.change.earliest, winch.change.latest, winch.change.date].map(X);
      parts.push(svg("line", { x1: a, x2: Math.max(b, a + 1), y1: y + ROW - 1, y2: y + ROW - 1, stroke: "var(--ink)", "stroke-width": 2 }), svg("path", { d: `M${at} ${y + ROW - 1}v-${ROW - 2}l6 4l-6 4z`, fill: "var(--ink)", stroke: "var(--surface)", "stroke-width": 0.75, class: "step" }));
    }
  });
  // As many dates as have room.
  const last = day(whole[0]) === day(whole[1]) ? 0 : Math.min(narrow ? 1 : 3, Math.floor((X(whole[1]) - X(whole[0])) / 110)), marks = Array.from({ length: last + 1 }, (_, i) => whole[0] + (last && ((whole[1] - whole[0]) * i) / last));
  parts.push(svg("line", { x1: NAME, x2: W - 8, y1: height + 2, y2: height + 2, stroke: "var(--edge)" }), ...marks.map((t, i) => svg("text", { x: X(t), y: height + 18, "text-anchor": i ? (i === last ? "end" : "middle") : "start", fill: "var(--muted)" }, day(t))));
  const drawn = svg("svg", { viewBox: `0 0 ${W} ${height + 24}`, "font-size": 12, role: "group", tabindex: 0, "aria-label": `${title(own)}: deviation of every session from the median winch; arrows choose a session`, class: "fleet" }, parts);
  drawn.addEventListener("keydown", (event) => move(event, p));
  const cells = own.winches.flatMap((winch) => winch.times.map((t, s) => [winch.winch, day(t), winch.values[s], winch.stds[s], winch.deviations[s]]));
  const columns = ["winch", "date", `value [${own.unit}]`, `std [${own.unit}]`, "deviation [σ]"].map((head, i) => [head, cells.map((cell) => cell[i])]);
  return el("div", { class: "effect" }, el("header", { class: "row" }, el("h2", {}, title(own)), el("span", { class: "note" }, `common ${withStd(own.common, own.common_std)} ${own.unit}; between winches ${number(own.between_std, 2)} ${own.unit}, between sessions ${number(own.session_std, 2)} ${own.unit}`),
    drawingExporter(`fleet-${own.effect}`, `${title(own)}: deviation from the median winch`, drawn, () => sourceOf(`folder ${found.folder}`, `profile ${found.profile}`), columns)), drawn);
}

function scale() {
  const steps = [-6, -4, -2, 0, 2, 4, 6];
  return el("div", { class: "legend below" }, el("span", {}, "Deviation from the median winch, σ:"), steps.map((z) => el("span", {}, el("i", { class: "box", style: { background: `color-mix(in srgb, var(--${tone(z)}) ${Math.round(100 * depth(z))}%, var(--sunk))` } }), number(z))), el("span", {}, "⚑ step with the 95 % interval of its date"), el("span", {}, "≠ differs from the others"));
}

function move(event, p) {
  const own = found.fitted.parameters[p], at = picked && picked.p === p ? { ...picked } : { p, w: 0, s: 0 };
  if (event.key === "ArrowRight") at.s += 1; else if (event.key === "ArrowLeft") at.s -= 1; else if (event.key === "ArrowDown") at.w += 1; else if (event.key === "ArrowUp") at.w -= 1;
  else if (event.key === "Enter") { behind(); return; } else return;
  event.preventDefault(); event.stopPropagation();
  at.w = Math.max(0, Math.min(own.winches.length - 1, at.w));
  at.s = Math.max(0, Math.min(own.winches[at.w].times.length - 1, at.s));
  choose(p, at.w, at.s);
}

function choose(p, w, s) {
  picked = { p, w, s };
  const winch = found.fitted.parameters[p].winches[w], focused = document.activeElement && document.activeElement.classList.contains("fleet");
  const box = root.querySelector("section[aria-label=Fleet]");
  fill(box, found.fitted.parameters.map(drawGrid), scale());
  if (focused) box.querySelectorAll("svg.fleet")[p].focus();
  say(`${winch.winch} ${day(winch.times[s])}: ${number(winch.deviations[s], 2)} standard deviations from the median winch`);
  drawSeries();
}

function drawSeries() {
  const box = root.querySelector("#series");
  if (!box || !picked) return;
  const own = found.fitted.parameters[picked.p], winch = own.winches[picked.w], W = 340, H = 200;
  const known = winch.values.map((v, i) => [winch.times[i], v, winch.stds[i]]), whole = ends();
  const low = Math.min(own.common, ...known.map(([, v, s]) => v - 2 * s)), high = Math.max(own.common, ...known.map(([, v, s]) => v + 2 * s)), span = high - low || 1, ticks = steps(low, high), LEFT = 14 + 7 * Math.max(...ticks.map((v) => number(v, 3).length));
  const X = (t) => LEFT + 6 + ((t - whole[0]) / (whole[1] - whole[0] || 1)) * (W - LEFT - 18), Y = (v) => H - 26 - ((v - low) / span) * (H - 40);
  const parts = ticks.flatMap((v) => [svg("line", { x1: LEFT, x2: W - 4, y1: Y(v), y2: Y(v), stroke: "var(--line)" }), svg("text", { x: LEFT - 6, y: Y(v) + 4, "text-anchor": "end", fill: "var(--muted)" }, number(v, 3))]);
  const sigma = Math.hypot(own.session_std, own.common_std);
  parts.push(svg("rect", { x: LEFT, width: W - LEFT - 4, y: Y(Math.min(high, own.common + sigma)), height: Math.max(1, Y(Math.max(low, own.common - sigma)) - Y(Math.min(high, own.common + sigma))), fill: "var(--band)" }), svg("line", { x1: LEFT, x2: W - 4, y1: Y(own.common), y2: Y(own.common), stroke: "var(--edge)", "stroke-dasharray": "4 3" }));
  if (winch.change) {
    const { before, after, date } = winch.change, [a, b] = [X(winch.times[0]), X(winch.times.at(-1))];
    parts.push(svg("path", { d: date === null ? `M${a} ${Y(before)}L${b} ${Y(after)}` : `M${a} ${Y(before)}H${X(date)}V${Y(after)}H${b}`, fill: "none", stroke: "var(--with)", "stroke-width": 2.5 }));
  }
  known.forEach(([t, v, s], i) => {
    const dot = svg("g", { class: "cell" }, svg("line", { x1: X(t), x2: X(t), y1: Y(v - s), y2: Y(v + s), stroke: "var(--today)" }), svg("circle", { cx: X(t), cy: Y(v), r: i === picked.s ? 6 : 4, fill: i === picked.s ? "var(--today)" : "var(--surface)", stroke: "var(--today)", "stroke-width": 2 }));
    dot.addEventListener("click", () => choose(picked.p, picked.w, i));
    parts.push(dot);
  });
  parts.push(svg("text", { x: LEFT, y: H - 4, fill: "var(--muted)" }, day(whole[0])), svg("text", { x: W - 4, y: H - 4, "text-anchor": "end", fill: "var(--muted)" }, day(whole[1])));
  const drawn = svg("svg", { viewBox: `0 0 ${W} ${H}`, "font-size": 12, role: "img", "aria-label": `Estimates of ${winch.winch} over time` }, parts);
  fill(box, el("header", {}, el("h2", {}, heading(winch, own)), el("span", { class: "note" }, `${words(own.parameter)}, ${own.unit}`)), readable({ node: drawn, marks: known.map(([t, v, s]) => [X(t), Y(v), `${day(t)}: ${number(v)} ± ${number(s, 2)} ${own.unit}`]) }),
    el("div", { class: "row" }, el("span", { class: "note" }, "± one standard deviation; dashed: common value"), drawingExporter(`${winch.winch}-${own.effect}`.replaceAll("/", "-"), `${winch.winch}: ${title(own)}`, drawn, () => sourceOf(`folder ${found.folder}`, `profile ${found.profile}`), [["date", winch.times.map(day)], [`value [${own.unit}]`, winch.values], [`std [${own.unit}]`, winch.stds]])),
    winch.texts.map((text) => el("p", { class: "note" }, text)), winch.texts.length ? null : el("p", { class: "note" }, "No change, and no difference from the others."),
    el("div", { class: "buttons" }, el("button", { onclick: behind }, `Runs of ${day(winch.times[picked.s])}`)));
}

// The runs behind the chosen estimate, opened with the profile that they were fitted with.
const behind = () => attempt(async () => {
  const own = found.fitted.parameters[picked.p].winches[picked.w], { session, runs, profile } = await ask(`/api/fleet/runs?winch=${encodeURIComponent(own.winch)}&time=${own.times[picked.s]}`);
  dialog(`${own.winch}, session ${session}`, el("ul", {}, runs.map((name) => el("li", {}, el("code", {}, name)))),
    el("button", { class: "primary", onclick: () => attempt(async () => { await order("library", { names: runs, profile }); document.getElementById("dialog").close(); location.hash = "#diagnose"; }) }, "Open in Diagnose"));
});

export function keys() { return false; }
