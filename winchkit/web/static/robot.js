// The Robot view: cables and platform, feasible poses, errors before and after the calibration.
import { alarm, ask, attempt, dialog, download, el, filesOf, fill, icon, number, order, sourceOf, svg } from "./page.js";
import { drawingExporter } from "./exports.js";
import { readable } from "./plots.js";

let bench = null, drawnAt = 0, root = null, view = null, now = null, newest = null, signature = null, shown = { row: 0, side: "Iso", z: null, limits: null }, picture = null, slice = null, asked = 0;

export function enter(main, state) { root = main; signature = null; update(state); }
export function leave() { root = null; }
// The address: pose (or live), height of the slice, side that is looked at.
let wanted = null, scrolled = false;
export function restore(parts) {
  const [row, z, side] = parts.map(decodeURIComponent);
  wanted = row === undefined || row === "" ? null : { row: row === "live" ? "live" : Math.max(0, Number(row) || 0), z: z && Number.isFinite(Number(z)) ? Number(z) : null, side: side in SIDES ? side : "Iso" };
}

export function update(state) {
  newest = state;
  const now = JSON.stringify([state.robot, state.busy]);
  if (now === signature && root.firstChild) return;
  const fresh = !signature || !state.robot || JSON.parse(signature)[0]?.number !== state.robot.number;
  signature = now;
  if (!state.robot) { view = null; fill(root, empty()); return; }
  if (!fresh && view) { render(state); return; }
  read();
}

// One reading at a time, and again where the state has changed meanwhile: answers cannot overtake
// each other. A reading that failed is repeated while the view is open.
let reading = false, again = false;
async function read() {
  again = reading;
  if (reading) return;
  reading = true;
  try {
    do {
      again = false;
      const next = await ask("/api/robot");
      alarm("", "robot");
      if (!view || next.name !== view.name) { shown = { row: now ? "live" : 0, side: "Iso", z: null, limits: next.limits }; slice = null; }
      view = next;
      if (wanted) { shown = { ...shown, ...wanted }; wanted = null; }
      if (shown.row !== "live") shown.row = Math.min(shown.row, view.poses);
      await fetchPicture();
      if (root && newest.robot) render(newest);
    } while (again);
    if (root && newest.robot) fetchSlice();
  } catch (error) {
    alarm(`${error.message} (read again in a second)`, "robot");
    setTimeout(() => { if (root && newest.robot) read(); }, 1000);
  } finally { reading = false; }
}

// The platform of the bench as its motor angles have it: drawn while it is chosen and nothing else is.
export function live(found, station) {
  const first = !now;
  bench = station;
  now = found && station ? found : null;
  if (!root || !view || !picture) return;
  if (first && now && shown.row === 0 && !view.poses) { shown.row = "live"; picture = now; render(newest); return; }
  drawPlatform();
  if (shown.row !== "live") return;
  picture = now || picture;
  const old = root.querySelector("#picture > svg"), head = root.querySelector("#picture h2");
  if (old && head) { old.replaceWith(scene()); head.textContent = where(); }
}

const FORCES = { live: "Cable forces now", measured: "Measured cable forces", computed: "Computed cable forces", none: "No forces within the limits hold the platform" };
const where = () => { if (shown.row === "live" && !now) return "The motor angles fit no pose now"; const at = picture.position.map((v) => number(v, 3)); return `${shown.row === "live" && bench.old() ? `Cable forces, ${bench.ago()},` : FORCES[shown.row === "live" ? "live" : picture.source]} at x ${at[0]}, y ${at[1]}, z ${at[2]} m`; };

async function fetchPicture() {
  const [low, high] = shown.limits;
  if (shown.row === "live" && !now) shown.row = 0;
  if (shown.row === "live") picture = now;
  else picture = await ask(`/api/robot/picture?row=${shown.row}&low=${low}&high=${high}`);
  if (shown.z === null) shown.z = picture.position[2];
}

function fetchSlice() {
  const mine = ++asked, [low, high] = shown.limits;
  attempt(async () => {
    const found = await ask(`/api/robot/slice?z=${shown.z}&row=${shown.row === "live" ? 0 : shown.row}&low=${low}&high=${high}`);
    if (mine !== asked) return;
    slice = found;
    drawPicture();
  });
}

function empty() {
  return el("div", { class: "drop" }, el("h1", {}, "No robot is open"), el("p", { class: "note" }, "Choose the profile of a robot, then drop a recording of its poses."),
    el("div", { class: "row" }, el("button", { class: "primary", onclick: chooseProfile }, "Choose a robot…")));
}

function chooseProfile() {
  attempt(async () => {
    const { robots } = await ask("/api/choices");
    dialog("Robots", el("div", { class: "runs" }, robots.map((name) => el("button", { onclick: () => attempt(async () => { await order("profile", { name }); document.getElementById("dialog").close(); }) }, name))));
  });
}

function choosePoses() { root.querySelector("#poses").click(); }

async function drop(files) {
  for (const file of files) await attempt(async () => {
    const answer = await ask("/api/drop", file, { "x-file-name": encodeURIComponent(file.name), "x-view": "robot" });
    if (answer.import) alarm(`${file.name}: is no run of winchkit; convert it with 'winchkit import ${file.name}' and drop the result`);
  });
}
export { drop };

function render(state) {
  const found = view.calibration;
  fill(root, context(state), state.busy ? el("div", { class: "row", style: { paddingBottom: "12px" } }, el("progress", { "aria-label": "Progress" }), el("span", { class: "label" }, state.busy.what)) : null,
    found ? head(found) : el("div", { class: "verdict" }, el("h1", {}, view.poses ? `${view.poses} poses` : now ? "Platform and cables" : "No poses yet"), view.poses ? null : el("p", {}, "Drop a recording of poses to calibrate the robot.")),
    el("div", { class: "grid" },
      el("section", { class: "panel w7", id: "picture", "aria-label": "Cables and platform" }),
      el("div", { class: "w5 stack" }, found ? [error(found), el("section", { class: "panel", id: "details", "aria-label": "Errors of poses and cables" }), warnings(found)] : null, platform(), proposals())));
  drawPicture();
  drawnAt = 0; drawPlatform();
  if (found) drawDetails(found);
  const next = root.querySelector("[aria-label='Poses to measure next']");
  if (scrolled && next && !state.busy) { scrolled = false; next.scrollIntoView({ block: "center" }); }
}

function context(state) {
  const input = el("input", { type: "file", multiple: true, class: "visually-hidden", id: "poses", "aria-label": "Recordings of poses", tabindex: -1, onchange: (event) => drop(filesOf(event.target)) });
  const busy = Boolean(state.busy), without = !view.calibration;
  return el("div", { class: "row context" }, input,
    el("span", { class: "label" }, "Robot"), el("button", { onclick: chooseProfile }, el("b", {}, view.name), el("span", { class: "note" }, `${view.lines.length} cables, ${number(view.mass, 3)} kg platform`)),
    el("span", { class: "label" }, "Poses"), el("button", { onclick: choosePoses }, el("b", {}, view.poses ? `${view.poses - view.held_out} to fit` : "choose…"), view.poses ? el("span", { class: "note" }, `${view.held_out} held out`) : null),
    el("span", { class: "row end" },
      el("button", { disabled: busy || without, onclick: () => attempt(async () => { scrolled = true; await order("propose"); }) }, "Propose poses"),
      el("button", { disabled: busy || without || Boolean(view.calibration.refused), onclick: () => attempt(() => download("/api/robot/profile")) }, "Save profile"),
      el("button", { disabled: busy || without, onclick: () => attempt(() => download("/api/robot/report")) }, "Report"),
      el("button", { disabled: without, onclick: () => dialog("Commands", el("pre", {}, view.command)) }, "Commands")));
}

function head(found) {
  const kind = found.refused ? "unknown" : found.unobservable.length ? "partly" : "adequate";
  const words = found.refused ? "Not calibrated" : found.unobservable.length ? "Calibrated in part" : "Calibrated";
  return el("div", { class: "verdict" }, el("div", { class: "head" }, el("span", { class: `chip ${kind}` }, icon(kind), words), el("h1", {}, found.headline)),
    el("p", {}, found.refused || `${found.parameters} parameters, ${found.fitted} poses; rms over ${view.held_out} poses that were not fitted, largest ${mm(found.largest)}.`));
}

const mm = (value) => value === null ? "–" : `${number(value * 1e3, 3)} mm`;

// One logarithmic axis in mm: rows of [name, before, after], optional mark of the instrument.
function logarithmic(rows, { width, height, left, mark = null, label }) {
  const values = rows.flatMap((row) => [row[1], row[2]]).concat(mark ?? []).filter((v) => v > 0).map((v) => v * 1e3);
  const low = Math.floor(Math.log10(Math.min(...values)) * 2) / 2 - 0.1, high = Math.ceil(Math.log10(Math.max(...values)) * 2) / 2 + 0.1;
  const x = (value) => left + ((Math.log10(value * 1e3) - low) / (high - low)) * (width - left - 24), bottom = height - 22;
  const out = svg("svg", { viewBox: `0 0 ${width} ${height}`, width: "100%", role: "img", "aria-label": label, "font-size": 12 }), marks = [];
  const powers = []; for (let p = Math.ceil(low); p <= high; p++) powers.push(p);
  powers.forEach((p, i) => out.append(svg("path", { d: `M${x(10 ** (p - 3))} 12V${bottom}`, stroke: "var(--line)" }), svg("text", { x: x(10 ** (p - 3)), y: height - 6, "text-anchor": "middle", fill: "var(--muted)" }, `${number(10 ** p)}${i === powers.length - 1 ? " mm" : ""}`)));
  if (mark) out.append(svg("path", { d: `M${x(mark)} 4V${bottom}`, stroke: "var(--muted)", "stroke-dasharray": "3 3" }), svg("text", { x: x(mark) + 5, y: 12, fill: "var(--muted)" }, `instrument ${mm(mark)}`));
  rows.forEach(([name, before, after], i) => {
    const y = rows.length === 1 ? bottom - 16 : 18 + (i * (bottom - 30)) / Math.max(1, rows.length - 1);
    for (const [words, value] of [["before", before], ["after", after]]) if (value > 0) marks.push([x(value), y, `${name ? `cable ${name}, ` : ""}${words} ${mm(value)}`]);
    if (name) out.append(svg("text", { x: 0, y: y + 4, fill: "var(--ink2)" }, name));
    if (before > 0 && after > 0) out.append(svg("path", { d: `M${x(before)} ${y}H${x(after)}`, stroke: rows.length === 1 ? "var(--with)" : "var(--edge)", "stroke-width": rows.length === 1 ? 3 : 1 }));
    if (before > 0) out.append(svg("circle", { cx: x(before), cy: y, r: rows.length === 1 ? 6 : 4.5, fill: "var(--today)" }));
    if (after > 0) { const r = rows.length === 1 ? 6 : 4; out.append(svg("rect", { x: x(after) - r, y: y - r, width: 2 * r, height: 2 * r, fill: "var(--with)" })); }
  });
  return { node: out, marks };
}

const narrow = () => innerWidth < 700;
const legend = (before, after) => el("span", { class: "legend" }, el("span", {}, el("i", { class: "disc" }), before), el("span", {}, el("i", { class: "square" }), after));

function error(found) {
  const drawn = logarithmic([["", found.before, found.after]], { width: narrow() ? 330 : 470, height: 84, left: 8, mark: found.instrument, label: `Pose error before ${mm(found.before)}, after ${mm(found.after)}` });
  return el("section", { class: "panel", "aria-label": "Pose error, held out" }, el("header", {}, el("h2", {}, "Pose error, held out"), legend(`before ${mm(found.before)}`, `after ${mm(found.after)}`), drawingExporter("pose-error", "Pose error, held out", drawn.node, source, [["before [m]", [found.before]], ["after [m]", [found.after]], ["instrument [m]", [found.instrument]]])), readable(drawn));
}

const source = () => sourceOf(`robot ${view.name}`, view.files.join(", "));

function drawDetails(found) {
  const box = root.querySelector("#details"), arrows = vectors(found.arrows), rows = view.lines.map((name, i) => [name, found.cables.before[i], found.cables.after[i]]);
  const cables = logarithmic(rows, { width: narrow() ? 330 : 230, height: 270, left: 26, label: "Residual of each cable's length before and after" });
  const columns = (values, word) => ["x", "y", "z"].map((axis, i) => [`${word} ${axis} [m]`, values.map((row) => row[i])]);
  fill(box, el("div", { class: "halves" },
    el("div", {}, el("header", {}, el("h2", {}, "Error vectors, top view"), arrows && drawingExporter("error-vectors", "Error vectors, top view", arrows.node, source, [...columns(found.arrows.at, "measured"), ...columns(found.arrows.before, "error before"), ...columns(found.arrows.after, "error after")])), el("p", { class: "note" }, arrows ? `mm; before × ${arrows.factor}, after: points` : "No position was held out."), arrows && readable(arrows)),
    el("div", {}, el("header", {}, el("h2", {}, "Residual per cable"), drawingExporter("cable-residuals", "Residual per cable", cables.node, source, [["cable", view.lines], ["before [m]", found.cables.before], ["after [m]", found.cables.after]])), el("p", { class: "note" }, "length, rms of the fitted poses"), readable(cables))),
    el("h2", { style: { margin: "12px 0 4px" } }, "Largest parameter changes"),
    el("table", {}, el("thead", { class: "visually-hidden" }, el("tr", {}, ["Parameter", "Change", "From, to"].map((t) => el("th", {}, t)))), el("tbody", {}, found.changes.slice(0, 3).map(([name, change, values]) => el("tr", {}, el("td", {}, name), el("td", { class: "number" }, el("b", {}, change)), el("td", { class: "number note" }, values))))));
}

function vectors({ at, before, after }) {
  if (!at.length) return null;
  const [w, h, left, bottom] = narrow() ? [330, 330, 40, 22] : [260, 270, 40, 22], size = Math.max(...before.map((v) => Math.hypot(v[0], v[1])), 1e-9);
  const xs = at.map((p) => p[0]), ys = at.map((p) => p[1]), span = Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys), 1e-6);
  const factor = Number((span / 6 / size).toPrecision(1)), pad = 0.2 * span, whole = span + 2 * pad;
  const x0 = (Math.max(...xs) + Math.min(...xs)) / 2 - whole / 2, y0 = (Math.max(...ys) + Math.min(...ys)) / 2 - whole / 2, scale = Math.min(w - left - 6, h - bottom - 6) / whole;
  const px = (x) => left + (x - x0) * scale, py = (y) => h - bottom - (y - y0) * scale;
  const node = svg("svg", { viewBox: `0 0 ${w} ${h}`, width: "100%", role: "img", "aria-label": `Error vectors of ${at.length} poses from above, before enlarged ${factor} times`, "font-size": 12 },
    svg("defs", {}, svg("marker", { id: "tip", viewBox: "0 0 6 6", refX: 5, refY: 3, markerWidth: 6, markerHeight: 6, orient: "auto" }, svg("path", { d: "M0 0L6 3L0 6", fill: "none", stroke: "var(--today)" }))));
  const step = [10, 20, 50, 100, 200, 500, 1000, 2000].find((s) => whole * 1e3 / s <= 5) || 5000;
  for (let t = Math.ceil(y0 * 1e3 / step) * step; t < (y0 + whole) * 1e3; t += step) node.append(svg("path", { d: `M${left} ${py(t / 1e3)}H${left + whole * scale}`, stroke: "var(--line)" }), svg("text", { x: left - 6, y: py(t / 1e3) + 4, "text-anchor": "end", fill: "var(--muted)" }, number(t)));
  for (let t = Math.ceil(x0 * 1e3 / step) * step; t < (x0 + whole) * 1e3; t += step) node.append(svg("text", { x: px(t / 1e3), y: h - 6, "text-anchor": "middle", fill: "var(--muted)" }, number(t)));
  at.forEach((p, i) => node.append(svg("path", { d: `M${px(p[0])} ${py(p[1])}L${px(p[0] + factor * before[i][0])} ${py(p[1] + factor * before[i][1])}`, stroke: "var(--today)", "stroke-width": 1.2, fill: "none", "marker-end": "url(#tip)" })));
  at.forEach((p, i) => node.append(svg("circle", { cx: px(p[0] + after[i][0]), cy: py(p[1] + after[i][1]), r: 2.2, fill: "var(--with)" })));
  const length = (v) => mm(Math.hypot(v[0], v[1]));
  return { node, factor, marks: at.map((p, i) => [px(p[0]), py(p[1]), `x ${mm(p[0])}, y ${mm(p[1])}: before ${length(before[i])}, after ${length(after[i])}`]) };
}

function warnings(found) {
  const texts = [...found.warnings, ...(found.unobservable.length ? [`Not identifiable from these poses: ${found.unobservable.slice(0, 2).join("; ")}${found.unobservable.length > 2 ? ` and ${found.unobservable.length - 2} more` : ""}.`] : [])];
  if (!texts.length) return null;
  return el("div", { class: "alert", style: { margin: 0 } }, icon("partly"), el("div", {}, el("p", {}, texts[0]), texts.length > 1 ? el("button", { class: "plain", onclick: () => dialog("Notes", el("ul", {}, texts.map((text) => el("li", {}, text)))) }, `Show all ${texts.length}`) : null));
}

function proposals() {
  if (!view.proposed.length) return null;
  return el("section", { class: "panel", "aria-label": "Poses to measure next" }, el("h2", {}, "Measure next"), el("table", {}, el("thead", {}, el("tr", {}, ["x", "y", "z", "roll", "pitch", "yaw"].map((t, i) => el("th", { class: "number" }, `${t} ${i < 3 ? "mm" : "°"}`)))),
    el("tbody", {}, view.proposed.map((p) => el("tr", {}, [...p.position.map((v) => number(v * 1e3, 4)), ...p.angles.map((v) => number((v * 180) / Math.PI, 3))].map((t) => el("td", { class: "number" }, t)))))));
}

const AXES = ["x", "y", "z"], CHANGES = [-50, -10, -1, 1, 10, 50], SPEED = 0.05;

// The platform of the bench: where it is, the force of each cable, and steps along an axis.
function platform() {
  if (!now || !bench) return null;
  const step = (axis, mm) => el("button", { onclick: () => bench.step(axis, mm / 1000, SPEED), "aria-label": `${axis} ${mm > 0 ? "+" : "−"}${Math.abs(mm)} mm` }, `${mm > 0 ? "+" : "−"}${Math.abs(mm)}`);
  return el("section", { class: "panel", id: "platform", "aria-label": "Platform" }, el("header", {}, el("h2", {}, "Platform"), bench.allowed() ? el("span", { class: "note offers" }, el("button", { id: "take", onclick: () => bench.command() }, "Request command")) : el("span", { class: "note" }, bench.watches)),
    el("div", { class: "live three", id: "position" }), el("h2", {}, "Force of each cable"), el("div", { id: "forces" }),
    view.lines.length < 6 ? el("p", { class: "note" }, `No steps: ${view.lines.length} cables do not determine the rotation of the platform; a move along a path needs at least 6.`) : el("fieldset", { class: "steps offers" }, el("legend", { class: "note" }, `Step the platform, mm, at ${number(SPEED)} m/s`), AXES.map((axis) => el("div", { class: "row" }, el("b", {}, axis), el("span", { class: "segments" }, CHANGES.map((mm) => step(axis, mm)))))));
}

function drawPlatform() {
  const box = root && root.querySelector("#platform"), at = performance.now();
  if (!box || !now || at - drawnAt < 240) return;
  drawnAt = at;
  const off = !bench.commands() || bench.tripped(), take = box.querySelector("#take");
  if (take) take.textContent = bench.words();
  for (const button of box.querySelectorAll(".steps button")) button.disabled = off;
  fill(box.querySelector("#position"), AXES.map((axis, i) => el("div", {}, el("span", { class: "note" }, axis, bench.old() ? ` · ${bench.ago()}` : ""), el("div", { class: "value" }, (now.position[i] * 1e3).toFixed(1).replace("-", "−"), el("small", {}, "mm")))));
  const most = Math.max(shown.limits[1] * 1.1, ...now.tension.map((v) => v ?? 0)), share = (v) => `${Math.max(0, Math.min(100, (v / most) * 100))}%`;
  fill(box.querySelector("#forces"), view.lines.map((name, i) => el("div", { class: "force" }, el("span", {}, name), svg("svg", { width: "100%", height: 12, "aria-hidden": "true" }, svg("rect", { y: 2, width: "100%", height: 8, fill: "var(--band)" }), svg("rect", { y: 2, width: share(shown.limits[0]), height: 8, fill: "url(#hatch)" }), svg("rect", { x: share(shown.limits[1]), y: 2, width: `${100 - parseFloat(share(shown.limits[1]))}%`, height: 8, fill: "url(#hatch)" }),
    now.tension[i] === null ? null : svg("rect", { x: `calc(${share(now.tension[i])} - 1.5px)`, width: 3, height: 12, fill: "var(--ink)" })), el("b", {}, now.tension[i] === null ? "–" : `${now.tension[i].toFixed(1)} N`))));
}

const SIDES = { Iso: [0.38, 0.32], Top: [0, Math.PI / 2], Front: [0, 0], Side: [Math.PI / 2, 0] };
const STEPS = ["#9DC1E8", "#6BA0D8", "#3C7DC0", "#1E5C9F", "#0B3A70"];

// The edges of a box by its corners.
const EDGES = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

const renewed = () => attempt(async () => { await fetchPicture(); drawPicture(); fetchSlice(); });

function drawPicture() {
  const box = root && root.querySelector("#picture");
  if (!box || !picture) return;
  const [low, high] = shown.limits, focus = document.activeElement && document.activeElement.id;
  const drawn = scene();
  const z = el("input", { type: "range", id: "height", min: bounds()[0][2], max: bounds()[1][2], step: "any", value: shown.z, "aria-label": "Height of the slice", oninput: (event) => { shown.z = Number(event.target.value); height.textContent = `Slice height z = ${number(shown.z, 3)} m`; }, onchange: fetchSlice });
  const height = el("span", {}, `Slice height z = ${number(shown.z, 3)} m`);
  const limit = (index, name) => el("input", { type: "number", class: "narrow", min: 0, value: shown.limits[index], "aria-label": `${name} cable force, N`, onchange: ({ target }) => { const next = [...shown.limits]; next[index] = target.value === "" ? NaN : Number(target.value); if (!(next[0] >= 0 && next[0] < next[1])) { alarm(target.value === "" ? "The force limit is no number. Type newtons, for example 20." : `The lower force limit, ${number(next[0])} N, is not below the upper one, ${number(next[1])} N, or it is negative.`); target.value = shown.limits[index]; return; } alarm("", "order"); shown.limits = next; renewed(); } });
  const margins = slice ? slice.margin.flat().filter((v) => v !== null) : [];
  fill(box, el("header", {}, el("h2", {}, where()),
    el("span", { class: "row end" }, now ? el("button", { class: "plain", "aria-pressed": String(shown.row === "live"), style: { fontWeight: shown.row === "live" ? 700 : 400 }, onclick: () => { shown.row = shown.row === "live" ? 0 : "live"; renewed(); } }, "Live") : null, Object.keys(SIDES).map((side) => el("button", { class: "plain", "aria-pressed": String(shown.side === side), style: { fontWeight: shown.side === side ? 700 : 400 }, onclick: () => { shown.side = side; drawPicture(); } }, side)), drawingExporter("robot", `${view.name}: ${where()}`, drawn, source, [["cable", view.lines], ["force [N]", picture.tension], ["exit x [m]", view.exit_points.map((p) => p[0])], ["exit y [m]", view.exit_points.map((p) => p[1])], ["exit z [m]", view.exit_points.map((p) => p[2])]]))),
    drawn,
    el("div", { class: "under" },
      el("div", {}, el("span", { class: "note" }, "Cable force, N (colour and width)"), el("div", { class: "row" }, limit(0, "Least"), el("span", { class: "scale" }, STEPS.map((c) => el("i", { class: "swatch", style: { background: c } }))), limit(1, "Largest"))),
      el("div", {}, el("span", { class: "note" }, `Feasible at z = ${number(slice ? slice.height : shown.z, 3)} m, ${number(low)} to ${number(high)} N`), el("div", { class: "row" }, el("span", { class: "scale" }, [0.25, 0.5, 0.75, 1].map((o) => el("i", { class: "swatch", style: { background: `color-mix(in srgb, var(--ok) ${o * 50}%, transparent)` } }))), el("span", { class: "note" }, slice ? (margins.length ? `margin 0 to ${number(Math.max(...margins), 3)} N` : "no feasible pose at this height") : "computing"))),
      el("label", {}, el("span", { class: "note" }, height), z),
      view.poses ? el("label", {}, el("span", { class: "note" }, shown.row === "live" ? `Now; ${view.poses} poses` : shown.row === 0 ? `Home; ${view.poses} poses` : `Pose ${shown.row} of ${view.poses}`), el("input", { type: "range", id: "row", min: 0, max: view.poses, value: shown.row === "live" ? 0 : shown.row, "aria-label": "Pose", onchange: (event) => { shown.row = Number(event.target.value); renewed(); } })) : null));
  if (focus) box.querySelector(`#${focus}`)?.focus();
  history.replaceState(null, "", `${location.pathname}${location.search}#robot/${shown.row}/${number(shown.z).replace("−", "-")}/${shown.side}`);
}

function bounds() {
  const points = [...view.exit_points, ...picture.corners];
  return [0, 1, 2].reduce(([low, high], i) => { low.push(Math.min(...points.map((p) => p[i]))); high.push(Math.max(...points.map((p) => p[i]))); return [low, high]; }, [[], []]);
}

function scene() {
  const [w, h] = narrow() ? [360, 380] : [700, 560], [turn, tilt] = SIDES[shown.side], [low, high] = bounds();
  const flat = ([x, y, z]) => { const a = x * Math.cos(turn) - y * Math.sin(turn), b = x * Math.sin(turn) + y * Math.cos(turn); return [a, z * Math.cos(tilt) + b * Math.sin(tilt)]; };
  const corner = (i) => [i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]];
  const all = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => flat(corner(i))), xs = all.map((p) => p[0]), ys = all.map((p) => p[1]);
  const scale = Math.min((w - (narrow() ? 156 : 140)) / Math.max(1e-9, Math.max(...xs) - Math.min(...xs)), (h - 60) / Math.max(1e-9, Math.max(...ys) - Math.min(...ys)));
  const centre = [(Math.max(...xs) + Math.min(...xs)) / 2, (Math.max(...ys) + Math.min(...ys)) / 2];
  const at = (p) => { const [a, b] = flat(p); return [w / 2 + (a - centre[0]) * scale, h / 2 - (b - centre[1]) * scale]; };
  const path = (points, more) => svg("path", { d: `M${points.map((p) => at(p).map((v) => v.toFixed(1)).join(" ")).join("L")}`, fill: "none", ...more });
  const out = svg("svg", { viewBox: `0 0 ${w} ${h}`, width: "100%", role: "img", "aria-label": `Robot ${view.name}: ${view.lines.map((name, i) => `cable ${name} ${number(picture.tension[i], 3)} N`).join(", ")}`, "font-size": 13 });
  for (const [a, b] of EDGES) out.append(path([corner(a), corner(b)], { stroke: "var(--line)", "stroke-width": 2 }));
  const [fmin, fmax] = shown.limits, z = slice ? slice.height : shown.z;
  if (slice) {
    const half = slice.x.length > 1 ? (slice.x[1] - slice.x[0]) / 2 : 0, best = Math.max(1e-9, ...slice.margin.flat().map((v) => v ?? 0));
    slice.margin.forEach((cells, j) => cells.forEach((value, i) => { if (value !== null) { const [x, y] = [slice.x[i], slice.y[j]]; out.append(path([[x - half, y - half, z], [x + half, y - half, z], [x + half, y + half, z], [x - half, y + half, z]], { fill: "var(--ok)", "fill-opacity": (0.12 + 0.4 * value / best).toFixed(2), stroke: "none" })); } }));
  }
  out.append(path([[low[0], low[1], z], [high[0], low[1], z], [high[0], high[1], z], [low[0], high[1], z], [low[0], low[1], z]], { stroke: "var(--ok)", "stroke-dasharray": "4 3" }));
  view.exit_points.forEach((p, i) => {
    const force = picture.tension[i], share = force === null ? 0 : Math.min(1, Math.max(0, (force - fmin) / (fmax - fmin)));
    out.append(path([p, picture.anchors[i]], { stroke: force === null ? "var(--muted)" : STEPS[Math.min(4, Math.floor(share * 5))], "stroke-width": force === null ? 1 : 1.2 + 3 * share, ...(force === null ? { "stroke-dasharray": "4 4" } : {}) }));
  });
  const c = picture.corners;
  for (const [a, b] of EDGES) out.append(path([c[a], c[b]], { stroke: "var(--ink)", "stroke-width": 1.4 }));
  const [ox, oy] = at(picture.position);
  out.append(svg("circle", { cx: ox, cy: oy, r: 3.5, fill: "var(--ink)" }));
  const taken = [];
  view.exit_points.forEach((p, i) => {
    const [x, y] = at(p), left = x < w / 2;
    let ty = y + (at([0, 0, 0])[1] > y ? -6 : 6) + 4;
    while (taken.some(([a, b]) => a === left && Math.abs(b - ty) < 15 )) ty += 15;
    taken.push([left, ty]);
    const words = svg("text", { x: left ? x - 8 : x + 8, y: ty, "text-anchor": left ? "end" : "start", fill: "var(--ink)", "paint-order": "stroke", stroke: "var(--surface)", "stroke-width": 3 }, svg("tspan", { fill: "var(--muted)" }, `${view.lines[i]} `), svg("tspan", { "font-weight": 700 }, picture.tension[i] === null ? "–" : `${number(picture.tension[i], 3)} N`));
    out.append(svg("circle", { cx: x, cy: y, r: 4, fill: "var(--surface)", stroke: "var(--ink2)", "stroke-width": 1.6 }), words);
  });
  return out;
}

export function keys(event) {
  if (event.key === "s" && view && view.calibration && !view.calibration.refused) { attempt(() => download("/api/robot/profile")); return true; }
  return false;
}
