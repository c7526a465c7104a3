// Exports of plots: panels of curves and points as CSV, SVG and PNG at twice the size, light theme.
// A figure has a title, a source, columns of panels; a panel a title, labels, series, noise and runs.
import { number, svg } from "./page.js";
import { menu, saved } from "./exports.js";
import { runTexts, seenRange, widest } from "./plots.js";

const GAP = 30, BOTTOM = 40, TOP = 26;

// The panels of a figure are drawn in the range that the plots of its section show.
export function exporter(name, describe) {
  return menu(name, (kind, plots) => {
    const figure = describe();
    figure.panels.forEach((panel, i) => { panel.range = seenRange(plots[i]) || panel.range; });
    save(kind, name, figure);
  }, true);
}

function save(kind, name, figure) {
  const columns = figure.panels.flatMap((panel) => panel.series.flatMap((own, i) => {
    const x = own.x || panel.x, shared = i > 0 && x === (panel.series[i - 1].x || panel.x);
    return [...(shared ? [] : [[panel.xLabel, x]]), [own.name, own.y]];
  }));
  saved(kind, name, figure.title, () => drawing(figure), figure.source, columns);
}

const finite = (values) => values.filter((value) => value !== null && value !== undefined && Number.isFinite(value));
const ends = (values) => (values.length ? [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))] : [0, 1]);

export function steps(low, high) {
  const raw = (high - low || 1) / 4, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw);
  return Array.from({ length: 12 }, (_, i) => (Math.ceil(low / step) + i) * step).filter((value) => value <= high + step * 1e-9);
}

function drawing(figure) {
  const across = figure.across || 1, width = 800 / across, height = figure.height || (across > 1 ? 190 : 210), parts = [];
  figure.panels.forEach((panel, i) => parts.push(svg("g", { transform: `translate(${(i % across) * width} ${Math.floor(i / across) * height})` }, drawnPanel(panel, width, height))));
  const rows = Math.ceil(figure.panels.length / across), low = rows * height + 14;
  let right = 0;
  for (const { name, tone } of figure.legend) {
    parts.push(svg("line", { x1: right, x2: right + 18, y1: low, y2: low, stroke: `var(--${tone})`, "stroke-width": 3 }), svg("text", { x: right + 24, y: low + 4, fill: "var(--ink2)" }, name));
    right += 48 + 7 * name.length;
  }
  return svg("svg", { viewBox: `0 0 800 ${low + 10}`, "font-size": 12 }, parts);
}

function drawnPanel(panel, w, h) {
  const LEFT = 56, wide = (text) => 7 * text.length;
  const x = (value) => (panel.logarithmic ? Math.log10(value) : value);
  const [x0, x1] = ends(finite(panel.series.flatMap((own) => finite(own.x || panel.x)).map(x)));
  const [y0, y1] = panel.range || ends([...panel.series.flatMap((own) => finite(own.y)), ...(panel.noise ? [panel.noise, -panel.noise] : [])]);
  const px = (value) => LEFT + ((x(value) - x0) / (x1 - x0 || 1)) * (w - LEFT - GAP), py = (value) => h - BOTTOM - ((Math.max(y0, Math.min(y1, value)) - y0) / (y1 - y0 || 1)) * (h - TOP - BOTTOM);
  const parts = [svg("text", { x: Math.max(0, Math.min(LEFT, w - wide(panel.title))), y: 12, "font-weight": 600, fill: "var(--ink)" }, panel.title)];
  if (panel.noise) parts.push(svg("rect", { x: LEFT, y: py(panel.noise), width: w - LEFT - GAP, height: Math.max(0, py(-panel.noise) - py(panel.noise)), fill: "var(--band)", stroke: "var(--edge)", "stroke-dasharray": "3 3" }));
  for (const value of steps(y0, y1)) parts.push(svg("line", { x1: LEFT, x2: w - GAP, y1: py(value), y2: py(value), stroke: "var(--line)" }), svg("text", { x: LEFT - 6, y: py(value) + 4, "text-anchor": "end", fill: "var(--muted)" }, number(value)));
  for (const value of steps(x0, x1)) parts.push(svg("text", { x: LEFT + ((value - x0) / (x1 - x0 || 1)) * (w - LEFT - GAP), y: h - BOTTOM + 16, "text-anchor": "middle", fill: "var(--muted)" }, number(panel.logarithmic ? 10 ** value : value, 3)));
  parts.push(svg("text", { x: (w + LEFT - GAP) / 2, y: h - BOTTOM + 32, "text-anchor": "middle", fill: "var(--muted)" }, wide(panel.xLabel) > w ? panel.xLabel.replace(/;.*(?= \[)/, "") : panel.xLabel));
  const runs = panel.runs || [], edges = runs.map((run, i) => [run.at, runs[i + 1] ? runs[i + 1].at : x1].map((value) => Math.max(px(x0), Math.min(px(x1), px(value)))));
  for (const [i, { at }] of runs.entries()) if (at >= x0 && at <= x1) parts.push(svg("line", { x1: edges[i][0], x2: edges[i][0], y1: TOP, y2: h - BOTTOM, stroke: "var(--edge)", "stroke-dasharray": "2 3" }));
  for (const [i, words] of runTexts(runs, edges, 0, wide)) parts.push(svg("text", { x: edges[i][0] + 3, y: TOP - 1, fill: "var(--muted)" }, words));
  for (const own of panel.series) parts.push(drawnSeries(own, own.x || panel.x, px, py, own.broken && !panel.logarithmic ? widest(own.x) : Infinity));
  return parts;
}

function drawnSeries(own, xs, px, py, most) {
  let path = "", pen = false;
  xs.forEach((value, i) => {
    const y = own.y[i];
    if (y === null || y === undefined || value === null || !Number.isFinite(value)) { pen = false; return; }
    const at = `${px(value).toFixed(1)} ${py(y).toFixed(1)}`;
    path += own.points ? `M${at}h0` : `${pen && value - xs[i - 1] <= most ? "L" : "M"}${at}`;
    pen = true;
  });
  return svg("path", { d: path, fill: "none", stroke: `var(--${own.tone})`, "stroke-width": own.points ? 2.5 : own.width || 1.4, "stroke-linecap": "round", opacity: own.opacity || 1 });
}
