// Two profiles, or two sets of runs, side by side: errors of each model and residuals on the same axes.
import { ask, drawAnswer, el, icon, number, sourceOf } from "./page.js";
import { exporter } from "./figures.js";
import { modelGrid, presentName, reach } from "./model_errors.js";
import { dots, legend, line, plot, sorted, sym, unitOf } from "./plots.js";

let span = null;

const sidesOf = (view) => [view, view.beside];
const profileOf = ({ profile }) => [profile.name, ...profile.names].join(" + ");
const usedOf = ({ runs }) => runs.filter((run) => run.used);

// Outputs that both sides have.
export const both = (view) => view.outputs.filter((output) => view.beside.outputs.includes(output));

// Number of runs and their loads; their names where the other side has other runs.
function runsText(side, view) {
  const names = usedOf(side).map((run) => run.name), [a, b] = sidesOf(view).map((each) => JSON.stringify(usedOf(each).map((run) => run.name)));
  const loads = [...new Set(usedOf(side).map((run) => run.load).filter(Boolean))].join(", ");
  return `${names.length} run${names.length === 1 ? "" : "s"}${loads ? `, ${loads}` : ""}${a === b ? "" : names.length > 3 ? `: ${names[0]} to ${names.at(-1)}` : `: ${names.join(", ")}`}`;
}

const source = (side) => sourceOf(`profile ${profileOf(side)}`, usedOf(side).map((run) => run.name).join(", "));

export function drawSides(root, view, output, focus) {
  span = null;
  const most = Math.max(...sidesOf(view).map((side) => reach(side.diagnosis.models)));
  const panels = (id, label) => sidesOf(view).map((side, i) => el("section", { class: "panel w6", id: `${id}-${"ab"[i]}`, "aria-label": `${label}, ${"AB"[i]}` }));
  const models = panels("models", "Held-out error of each candidate"), times = panels("time", "Residual over time"), over = panels("over", "Residual against each variable");
  sidesOf(view).forEach((side, i) => {
    const d = side.diagnosis;
    models[i].append(el("header", {}, el("h2", {}, `${"AB"[i]}  ${profileOf(side)}`), el("span", { class: `chip ${d.verdict}` }, icon(d.verdict), d.chip)),
      el("p", { class: "note" }, runsText(side, view)), el("p", { class: "said" }, d.headline),
      modelGrid(d.models, { output, only: true, most, present: presentName(side.profile), focus }));
  });
  root.append(el("div", { class: "verdict" }, el("h1", {}, headline(view, output))),
    el("div", { class: "grid" }, el("section", { class: "panel w12", "aria-label": "Errors of both sides" }, errors(view, output, focus)), models, times, over));
  drawTimes(view, output, times);
  drawOver(view, output, over);
}

const todayOf = (side) => side.diagnosis.models.rows.find((row) => row.kind === "today").cells;
const floorOf = (side) => side.diagnosis.models.rows.find((row) => row.kind === "floor").cells;
const text = (cell) => (cell ? cell.text : "–");

// Colours of both sides: that of the better model for the smaller error above its noise floor.
function tones(view, output) {
  const [a, b] = sidesOf(view).map((side) => (todayOf(side)[output] || {}).ratio ?? Infinity);
  return a < b ? ["with", "today"] : ["today", "with"];
}

function headline(view, output) {
  const { name, unit } = view.diagnosis.models.columns.find((c) => c.output === output), [a, b] = sidesOf(view).map((side) => text(todayOf(side)[output]));
  const [first, second] = tones(view, output).map((tone) => (tone === "with" ? "after" : "before"));
  return [`${name} error `, el("b", { class: first }, `${a} ${unit}`), " with A, ", el("b", { class: second }, `${b} ${unit}`), " with B"];
}

function errors(view, output, focus) {
  const ratio = (cell) => (cell && cell.ratio ? `${cell.ratio < 100 ? cell.ratio.toPrecision(3) : number(cell.ratio, 3)}×` : "–");
  const shared = view.diagnosis.models.columns.filter((c) => both(view).includes(c.output));
  const rows = shared.map((c) => el("tr", {}, el("td", {}, el("button", { class: "plain", "aria-pressed": String(c.output === output), onclick: () => focus(c.output) }, c.name, el("span", { class: "note" }, c.unit))),
    sidesOf(view).flatMap((side) => [el("td", { class: "number" }, text(todayOf(side)[c.output])), el("td", { class: "number wide" }, text(floorOf(side)[c.output])), el("td", { class: "number" }, ratio(todayOf(side)[c.output]))])));
  return el("div", { class: "scroll" }, el("table", { class: "sides" }, el("thead", {}, el("tr", {}, ["Held-out error", "A", "noise floor A", "A ÷ floor", "B", "noise floor B", "B ÷ floor"].map((words, i) => el("th", { class: `${i ? "number" : ""} ${i % 3 === 2 ? "wide" : ""}` }, words)))), el("tbody", {}, rows)));
}

// A comparison that was ended meanwhile, whose other side is null, is not drawn.
async function answers(view, path) {
  const found = await Promise.all(sidesOf(view).map((side, i) => ask(`${path}${i ? "&beside=1" : ""}`)));
  return found.includes(null) ? new Promise(() => {}) : found;
}
const ends = (values) => values.reduce(([low, high], value) => (value === null ? [low, high] : [Math.min(low, value), Math.max(high, value)]), [Infinity, -Infinity]);
const wider = ([low, high]) => [low - 0.05 * (high - low || 1), high + 0.05 * (high - low || 1)];

async function drawTimes(view, output, boxes) {
  const width = Math.max(300, boxes[0].clientWidth - 32), part = span ? `&from=${span[0]}&to=${span[1]}` : "";
  await drawAnswer(boxes[0], () => answers(view, `/api/curve?output=${output}&points=${Math.round(2 * width)}${part}`), (found) => {
    const whole = [0, Math.max(...found.map((data) => data.last))], xRange = span || whole;
    const signal = wider(ends(found.flatMap((data) => [...data.measured, ...data.predicted]))), residual = wider(ends(found.flatMap((data) => [...data.residual, data.noise, data.noise && -data.noise].filter((v) => v !== null))));
    const zoom = (low, high) => {
      span = low === null ? null : [Math.max(whole[0], low), Math.min(whole[1], high)];
      if (span && span[1] - span[0] > 0.98 * (whole[1] - whole[0])) span = null;
      clearTimeout(zoom.timer); zoom.timer = setTimeout(() => drawTimes(view, output, boxes), 60);
    };
    found.forEach((data, i) => {
      const [upper, lower] = [el("div", { class: "plot" }), el("div", { class: "plot" })], side = sidesOf(view)[i], tone = tones(view, output)[i], label = `${"AB"[i]}: ${data.name}`, runs = data.runs.map((run) => ({ ...run, labelled: true }));
      const figure = () => ({ title: `${label}, measured and predicted, and the residual`, source: source(side), legend: [{ name: "measured", tone: "ink" }, { name: "predicted, residual", tone }, { name: "noise floor ±1σ", tone: "edge" }],
        panels: [{ title: `${data.name} [${data.unit}]`, x: data.x, xLabel: "time [s]", runs, range: signal, series: [{ name: `measured [${data.unit}]`, y: data.measured, tone: "ink", width: 2.4, opacity: 0.35 }, { name: `predicted [${data.unit}]`, y: data.predicted, tone }] },
          { title: `Residual [${data.residual_unit}]`, x: data.x, xLabel: "time [s]", runs: data.runs, range: residual, noise: data.noise, series: [{ name: `residual [${data.residual_unit}]`, y: data.residual, tone }] }] });
      boxes[i].replaceChildren(el("header", {}, el("h2", {}, label, el("span", { class: "note" }, ` ${data.unit}, residual ${data.residual_unit}`)), legend(["edge", "measured"], [tone, "predicted, residual"], ["band", "noise ±1σ", true]), exporter(`${output}-over-time-${"ab"[i]}`, figure)), upper, lower);
      plot(upper, [data.x, data.measured, data.predicted], [line("ink", 2.4, 0.35), line(tone, 1.25)], { height: 110, top: 22, bare: true, left: 58, runs, zoom, xRange, range: () => signal, sync: "sides", names: ["measured", "predicted"], unit: data.unit, label: `${label}, measured and predicted over time` });
      plot(lower, [data.x, data.residual], [line(tone, 1.25)], { height: 150, left: 58, runs: data.runs, zoom, xRange, range: () => residual, noise: data.noise, xLabel: "s", sync: "sides", names: ["residual"], unit: data.residual_unit, label: `${label}, residual over time` });
    });
  });
}

async function drawOver(view, output, boxes) {
  let names;
  await drawAnswer(boxes[0], async () => {
    const most = await answers(view, `/api/multiples?output=${output}`), shares = most.flatMap((own) => own.panels).sort((a, b) => b.share - a.share);
    names = [...new Set(shares.map((panel) => panel.variable))].slice(0, 3);
    return answers(view, `/api/multiples?output=${output}${names.map((name) => `&over=${name}`).join("")}`);
  }, (found) => {
    const range = sym(found.flatMap((own) => own.residual));
    found.forEach((own, i) => {
      const grid = el("div", { class: "multiples" }), tone = tones(view, output)[i];
      boxes[i].replaceChildren(el("header", {}, el("h2", {}, `${"AB"[i]}: residual against each variable`, el("span", { class: "note" }, ` ${own.unit}`)), el("span", { class: "note" }, "share of variance")), grid);
      for (const name of names) {
        const pair = found.map((each) => each.panels.find((panel) => panel.variable === name)), panel = pair[i];
        if (!panel) continue;
        const host = el("div", { class: "plot" }), { columns } = sorted(panel.x, own.residual), known = pair.filter(Boolean);
        const same = known.every((each) => each.label === known[0].label) ? ends(known.flatMap((each) => each.x)) : null;
        grid.append(el("div", {}, el("h3", {}, el("span", {}, panel.name, el("span", { class: "note" }, ` ${unitOf(panel.label)}`)), el("span", { class: "share" }, `${Math.round(100 * panel.share)} %`)), host));
        plot(host, columns, [{ paths: dots(tone, 0.28, 2), points: { show: false } }], { height: 130, names: ["residual"], unit: own.unit, traces: [{ name: "mean", x: panel.bins, y: panel.means, tone, width: 2 }], noise: own.noise, range, xRange: panel.logarithmic ? null : same, logarithmic: panel.logarithmic, label: `${"AB"[i]}: residual over ${panel.label}` });
      }
    });
  });
}
