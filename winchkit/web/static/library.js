// The Library view: runs of the folder, overlaid, and opened in the Diagnose view.
import { ask, attempt, el, fill, number, order, sourceOf } from "./page.js";
import { exporter } from "./figures.js";
import { line, plot } from "./plots.js";

let root, found = { runs: [] }, chosen = new Set(), channel = "tension", filter = "";

export function enter(main) { root = main; root.removeAttribute("data-signature"); load(); }
export function update() {}

async function load() {
  fill(root, el("div", { class: "row context" }, el("span", { class: "label" }, "Reading the folder")));
  await attempt(async () => { found = await ask("/api/runs"); render(); });
}

const TONES = ["with", "today", "brush", "ok", "muted", "unknown", "warn", "ink"];

function render() {
  const channels = [...new Set(found.runs.flatMap((run) => run.channels || []))];
  if (!channels.includes(channel) && channels.length) channel = channels[0];
  const search = el("input", { type: "search", placeholder: "filter", value: filter, "aria-label": "Filter runs", oninput: () => { filter = search.value; fill(body, ...rows()); } });
  const pick = el("select", { "aria-label": "Channel", onchange: () => { channel = pick.value; overlay(); } }, channels.map((name) => el("option", { selected: name === channel }, name)));
  const body = el("tbody", {}, rows());
  fill(root, el("h1", { class: "visually-hidden" }, "Library"), el("div", { class: "row context" }, el("span", { class: "label" }, `Folder ${found.folder}: ${found.runs.length} file${found.runs.length === 1 ? "" : "s"}`), search,
    el("span", { class: "row end" }, el("label", { class: "row" }, "Overlay", pick), el("button", { class: "primary", id: "open", disabled: !chosen.size, onclick: () => attempt(async () => { await order("library", { names: [...chosen] }); location.hash = "#diagnose"; }) }, "Compare in Diagnose"))),
  el("div", { class: "grid" }, el("section", { class: "panel w7 scroll", "aria-label": "Runs" }, el("table", { class: "rows" }, el("thead", {}, el("tr", {}, ["", "Run", "Programme", "Load", "Winch", "Length", "Date, UTC"].map((text, i) => el("th", { class: i === 5 ? "number" : "" }, text || el("span", { class: "visually-hidden" }, "Choose"))))), body)),
    el("section", { class: "panel w5", "aria-label": "Overlay" }, el("header", {}, el("h2", {}, "Overlay"), el("span", { class: "note" }, "each from its own start")), el("div", { id: "overlay" }, el("p", { class: "note" }, "Choose runs on the left.")))));
  overlay();
}

function rows() {
  const words = filter.toLowerCase();
  const seen = found.runs.filter((run) => !words || [run.name, run.programme, run.load, ...(run.winches || [])].join(" ").toLowerCase().includes(words));
  if (!seen.length) return [el("tr", {}, el("td", { colspan: 7 }, found.runs.length ? "No run has these words." : "There are no runs in this folder; start with --folder DIR."))];
  return seen.map((run) => run.fault ? el("tr", {}, el("td", {}), el("td", {}, run.name), el("td", { colspan: 5, class: "note" }, run.fault))
    : el("tr", {}, el("td", {}, el("input", { type: "checkbox", style: { minHeight: "auto" }, checked: chosen.has(run.name), "aria-label": `Choose ${run.name}`, onchange: (event) => { if (event.target.checked) chosen.add(run.name); else chosen.delete(run.name); document.getElementById("open").disabled = !chosen.size; overlay(); } })),
      el("td", {}, run.name), el("td", {}, run.programme || "–"), el("td", { class: "tight" }, run.load || "–"), el("td", {}, run.winches.filter(Boolean).join(", ") || "–"), el("td", { class: "tight number" }, `${number(run.seconds, 3)} s`), el("td", { class: "tight note" }, run.date.slice(0, 16).replace("T", " "))));
}

async function overlay() {
  const box = document.getElementById("overlay");
  if (!box || !chosen.size) { if (box) fill(box, el("p", { class: "note" }, "Choose runs on the left.")); return; }
  await attempt(async () => {
    const query = [...chosen].map((name) => `name=${encodeURIComponent(name)}`).join("&");
    const { lines, difference } = await ask(`/api/overlay?channel=${encodeURIComponent(channel)}&${query}`);
    if (!lines.length) { fill(box, el("p", { class: "note" }, `None of these runs has ${channel}.`)); return; }
    const host = el("div", { class: "plot" }), toned = lines.map((own, i) => ({ name: own.name, tone: TONES[i % TONES.length] }));
    const figure = () => ({ title: `${channel}, each run from its own start`, source: sourceOf(`folder ${found.folder}`), legend: toned, height: 320,
      panels: [{ title: `${channel} [${lines[0].unit}]`, xLabel: "time [s]", series: lines.map((own, i) => ({ ...toned[i], name: `${own.name} [${own.unit}]`, x: own.x, y: own.y })) },
        ...(difference ? [{ title: `Difference [${difference.unit}]`, xLabel: "time [s]", series: [{ name: `${difference.name} [${difference.unit}]`, x: difference.x, y: difference.y, tone: "ink" }] }] : [])] });
    fill(box, el("div", { class: "row" }, el("div", { class: "legend" }, lines.map((own, i) => el("span", {}, el("i", { style: { background: `var(--${TONES[i % TONES.length]})` } }), own.name))), el("span", { class: "end" }, exporter(`overlay-${channel}`, figure))), host, el("p", { class: "note" }, `${channel} [${lines[0].unit}] over time [s]`));
    const data = uPlot.join(lines.map((own) => [own.x, own.y]));
    const style = (i) => line(TONES[i % TONES.length], 1.4, 1, { spanGaps: true, ...(i >= TONES.length / 2 ? { dash: [6, 3] } : {}) });
    plot(host, data, lines.map((_, i) => style(i)), { height: difference ? 200 : 320, xLabel: "s", label: `${channel} of ${lines.length} runs over time` });
    if (!difference) return;
    const below = el("div", { class: "plot" });
    box.append(el("h2", {}, "Difference", el("span", { class: "note" }, ` ${difference.unit}, ${difference.name}`)), below);
    plot(below, [difference.x, difference.y], [line("ink", 1.4)], { height: 140, xLabel: "s", label: `Difference of the ${channel} over time` });
  });
}

export function keys(event) { if (event.key === "/") { root.querySelector("input[type=search]")?.focus(); return true; } return false; }
