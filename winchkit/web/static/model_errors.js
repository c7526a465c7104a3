// Held-out error ÷ noise floor of each model, one column per output.
import { drawingExporter } from "./exports.js";
import { el, svg } from "./page.js";

const LOG = (ratio) => Math.log2(Math.max(ratio, 1));

// Largest ratio of the models, as a power of two; two drawings with the same reach have one axis.
export const reach = ({ columns, rows }) => Math.max(1.2, ...rows.flatMap((row) => columns.map((c) => row.cells[c.output] && row.cells[c.output].ratio ? LOG(row.cells[c.output].ratio) : 0)));

// Place of a ratio in its drawing, in percent.
export const place = (ratio, most) => 10 + (LOG(ratio) / most) * 84;

export const presentName = (profile) => (profile && profile.added.length ? `+ ${profile.names.at(-1)}` : null);

export function counted({ rows, candidates }) {
  const shown = rows.filter((row) => row.kind === "candidate").length;
  return shown ? `${shown} of ${candidates} candidates shown; the others explain less, or nothing` : "";
}

// `output` has the focus, `effect` is chosen; `only` draws no other column; `most` is the reach;
// without `choose` the candidates are names, without `focus` the heads.
export function modelGrid({ columns, rows }, { output, effect, only, most, present, focus, choose }) {
  const seen = only ? columns.filter((c) => c.output === output) : columns;
  const grid = el("div", { class: "models", style: { gridTemplateColumns: `minmax(96px, min(330px, 52%)) ${seen.map((c) => c.output === output && !only ? "2fr" : "1fr").join(" ")}` } });
  grid.append(el("span", {}));
  for (const c of seen) grid.append(el("button", { class: `head ${c.output === output ? "focus" : ""}`, "aria-pressed": String(c.output === output), onclick: () => focus(c.output) }, c.name, el("span", {}, c.unit)));
  const today = rows.find((row) => row.kind === "today"), joined = rows.filter((row) => row.equal);
  for (const [at, row] of rows.entries()) {
    const earlier = rows[at - 1] && rows[at - 1].kind === "history" ? rows[at - 1] : null;
    const chosen = row.kind === "candidate" && row.effect === effect ? "chosen" : "";
    const bracket = row.equal ? el("b", { class: `bracket ${row === joined[0] ? "first" : ""} ${row === joined.at(-1) ? "last" : ""}`, title: "cannot be distinguished with these runs" }, el("span", { class: "visually-hidden" }, "cannot be distinguished"), row === joined[Math.floor((joined.length - 1) / 2)] ? "=" : "") : null;
    grid.append(row.kind === "candidate" && choose
      ? el("button", { class: `name ${chosen}`, "aria-pressed": String(Boolean(chosen)), onclick: () => choose(row.effect) }, el("span", {}, row.label, el("small", {}, row.effect)), bracket)
      : el("div", { class: `name ${row.kind}` }, el("span", {}, row.kind === "today" && present ? present : row.label, row.kind === "candidate" ? el("small", {}, row.effect) : null), bracket, row.kind === "today" ? el("i", {}, "today") : null));
    for (const c of seen) {
      const cell = row.cells[c.output];
      grid.append(el("div", { class: `cell ${row.kind} ${chosen} ${c.output === output && !chosen ? "focus" : ""}` }, change(row, cell, today.cells[c.output], most, c.output, Boolean(chosen), earlier && earlier.cells[c.output]), el("span", { class: "value" }, cell ? cell.text : "–")));
    }
  }
  grid.append(el("div", { class: "axis" }, "error ÷ noise floor"));
  for (const c of seen) grid.append(el("div", { class: `cell axis ${c.output === output ? "focus" : ""}` }, scale(most, c.output === output), el("span", { class: "value" })));
  return grid;
}

const NAMES = 270, WIDTH = 960, TOP = 28, ROW = 27;

// Exports of the models as they are seen; in the table the errors of every model.
export function modelExporter({ columns, rows }, { output, effect, present }, source) {
  const most = reach({ columns, rows }), today = rows.find((row) => row.kind === "today"), share = (WIDTH - NAMES) / (columns.length + 1), axis = TOP + ROW * rows.length, named = (row) => (row.kind === "today" && present ? present : row.label);
  const words = (text, x, y, more = {}) => svg("text", { x, y, fill: "var(--ink2)", ...more }, text), end = { "text-anchor": "end" }, inner = (node, x, y, w, height) => { for (const [name, value] of Object.entries({ x, y, width: w, height, overflow: "visible" })) node.setAttribute(name, value); return node; };
  const parts = [svg("defs", {}, svg("pattern", { id: "floor", width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" }, svg("rect", { width: 1.2, height: 6, fill: "var(--edge)" })))];
  rows.forEach((row, i) => {
    const chosen = row.kind === "candidate" && row.effect === effect, y = TOP + ROW * i + 18;
    if (chosen) parts.push(svg("rect", { x: 0, y: TOP + ROW * i, width: WIDTH, height: ROW, fill: "var(--tint)" }));
    parts.push(words(named(row), 0, y, chosen || row === today ? { "font-weight": 600 } : {}), row.equal ? words("=", NAMES - 12, y, end) : null);
  });
  let left = NAMES;
  for (const c of columns) {
    const wide = c.output === output ? 2 * share : share, right = left + wide - 8;
    parts.push(words(c.name, left + 8, 16, { "font-weight": 600 }), words(c.unit, right, 16, end), inner(scale(most, c.output === output), left, axis, wide - 60, ROW));
    rows.forEach((row, i) => {
      const cell = row.cells[c.output], before = rows[i - 1] && rows[i - 1].kind === "history" ? rows[i - 1].cells[c.output] : null;
      parts.push(inner(change(row, cell, today.cells[c.output], most, c.output, row.kind === "candidate" && row.effect === effect, before), left, TOP + ROW * i, wide - 60, ROW), words(cell ? cell.text : "–", right, TOP + ROW * i + 18, end));
    });
    left += wide;
  }
  parts.push(words("error ÷ noise floor", 0, axis + 17));
  const drawn = svg("svg", { viewBox: `0 0 ${WIDTH} ${axis + ROW}`, "font-size": 12 }, parts);
  return drawingExporter("models", "Held-out error of each candidate", drawn, source, [["model", rows.map(named)], ["effect", rows.map((row) => row.effect || "")], ...columns.map((c) => [`${c.name} [${c.unit}]`, rows.map((row) => (row.cells[c.output] ? row.cells[c.output].text : ""))])]);
}

// `before` is the error of the row above where that is an earlier profile.
function change(row, cell, now, most, output, picked, before) {
  const parts = [svg("rect", { x: "0%", y: 0, width: "10%", height: "100%", fill: "var(--band)" }), svg("rect", { x: "0%", y: 0, width: "10%", height: "100%", fill: "url(#floor)" }), svg("line", { x1: "10%", x2: "10%", y1: 0, y2: "100%", stroke: "var(--edge)", "stroke-width": 1.5 })];
  const right = now && now.ratio ? `${place(now.ratio, most)}%` : null;
  const moving = (names) => ({ "data-rail": right, "data-moves": names });
  if (right && row.kind !== "history") parts.push(svg("line", { x1: right, x2: right, y1: row.kind === "today" ? "50%" : 0, y2: "100%", stroke: "var(--today)", "stroke-width": 2, class: "rail", ...moving("x1 x2") }));
  if (cell && cell.ratio) {
    const at = `${place(cell.ratio, most)}%`;
    if (before && before.ratio) parts.push(...stair(`${place(before.ratio, most)}%`, at));
    if (row.kind === "candidate") {
      if (right) parts.push(svg("line", { x1: at, x2: right, y1: "50%", y2: "50%", stroke: "var(--with)", "stroke-width": picked ? 3.5 : 1.5, class: "change", ...moving("x2") }));
      parts.push(svg("circle", { cx: at, cy: "50%", r: picked ? 5.5 : 4, fill: picked ? "var(--with)" : "var(--surface)", stroke: "var(--with)", "stroke-width": 2, class: "dot" }));
    } else if (row.kind === "today") parts.push(svg("circle", { cx: at, cy: "50%", r: 5, fill: "var(--today)", class: "dot", ...moving("cx") }));
    else if (row.kind === "history") {
      parts.push(svg("line", { x1: at, x2: at, y1: "50%", y2: "100%", ...STAIR }), svg("circle", { cx: at, cy: "50%", r: 4, fill: "var(--surface)", stroke: "var(--muted)", "stroke-width": 1.5 }));
    }
  }
  return svg("svg", { "aria-hidden": "true", "data-output": output }, parts);
}

const STAIR = { stroke: "var(--muted)", "stroke-dasharray": "2 2" };
const stair = (from, to) => [svg("line", { x1: from, x2: from, y1: 0, y2: "50%", ...STAIR }), svg("line", { x1: from, x2: to, y1: "50%", y2: "50%", ...STAIR })];

// Every power of two at most four times, beside the column in focus the first and the last alone.
function scale(most, wide) {
  const parts = [svg("line", { x1: "10%", x2: "96%", y1: 1, y2: 1, stroke: "var(--edge)" })];
  const step = Math.max(1, wide ? Math.round(most / 3) : Math.floor(most));
  for (let k = 0; k <= most; k += step) parts.push(svg("text", { x: `${place(2 ** k, most)}%`, y: 17, "text-anchor": "middle", fill: "var(--muted)", "font-size": 12 }, `${2 ** k}×`));
  return svg("svg", { "aria-hidden": "true" }, parts);
}

