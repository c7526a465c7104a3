// The Library view: runs of the folder in sets, overlaid, opened in Diagnose; and the fleet.
import { ask, attempt, drawAnswer, el, fill, icon, number, order, svg } from "./page.js";
import { MOST as MOST_LINES, TIME, choice, drawLines } from "./channels.js";
import * as fleet from "./fleet.js";

const MOST = 300;
const MARKS = { cable_length: "square", tension: "ring", motor_torque: "triangle" };
const NAMES = { cable_length: "cable length", tension: "tension", motor_torque: "motor torque" };

let root, state = null, found = { runs: [] }, chosen = new Set(), opened = new Set(), channel = "tension", over = TIME, filter = "", verdict = "", part = "runs", faultsOpen = false;

export function enter(main, fresh) { root = main; state = fresh; root.removeAttribute("data-signature"); load(); }
export function update(fresh) { const before = state; state = fresh; if (part === "fleet") fleet.update(fresh, before); }
export function restore(parts) {
  const [kind, words, judgement, shown, across, ...names] = parts.map(decodeURIComponent);
  part = kind === "fleet" ? "fleet" : "runs"; filter = words || ""; verdict = judgement || ""; channel = shown || channel; over = across || TIME; chosen = new Set(names);
}
// The address: runs or fleet, the filter, the verdict, the channel that is laid over, its x axis, and the runs where all of them are drawn.
function address() { history.replaceState(null, "", `${location.pathname}${location.search}#library/${part === "fleet" ? "fleet" : ["runs", filter, verdict, channel, ...(over === TIME && !named().length ? [] : [over]), ...named()].map(encodeURIComponent).join("/")}`); }

const named = () => (chosen.size <= MOST_LINES ? [...chosen] : []);

async function load() {
  fill(root, el("div", { class: "row context" }, el("span", { class: "label" }, "Reading the folder")));
  await attempt(async () => { found = await ask("/api/runs"); for (const name of chosen) if (!found.runs.some((run) => run.name === name)) chosen.delete(name); render(); });
}

function show(next) { part = next; address(); render(); }

function render() {
  const tabs = el("span", { class: "row segments tabs" }, [["runs", "Runs"], ["fleet", "Fleet"]].map(([name, words]) => el("button", { "aria-pressed": String(part === name), onclick: () => show(name) }, words)));
  if (part === "fleet") { fleet.enter(root, state, tabs); return; }
  const channels = [...new Set(found.runs.flatMap((run) => run.channels || []))];
  if (!channels.includes(channel) && channels.length) channel = channels[0];
  const body = el("tbody", {}, rows());
  const again = () => { address(); fill(body, ...rows()); };
  const search = el("input", { type: "search", placeholder: "filter: name, load, winch, date", value: filter, "aria-label": "Filter runs", oninput: () => { filter = search.value; again(); } });
  const verdicts = [...new Map(found.runs.filter((run) => run.verdict).map((run) => [run.verdict.verdict, run.verdict.chip]))];
  const judged = verdicts.length ? el("select", { "aria-label": "Verdict", onchange: () => { verdict = judged.value; again(); } }, [["", "any verdict"], ...verdicts].map(([value, words]) => el("option", { value, selected: value === verdict }, words))) : null;
  const pick = [choice("Channel", channels, channel, (name) => { channel = name; address(); overlay(); }), el("span", { class: "label" }, "over"), choice("Over", [TIME, ...channels], over, (name) => { over = name; address(); overlay(); })];
  const readable = found.runs.filter((run) => !run.fault).length;
  const outputs = [...new Set(found.runs.flatMap((run) => (run.verdict ? Object.keys(run.verdict.ratios) : [])))];
  fill(root, el("h1", { class: "visually-hidden" }, "Library"), el("div", { class: "row context" }, tabs, el("span", { class: "label" }, `Folder ${found.folder}: ${readable} run${readable === 1 ? "" : "s"} in ${sets().length} set${sets().length === 1 ? "" : "s"}`), search, judged,
    el("span", { class: "row end" }, el("button", { class: "primary", id: "open", disabled: !chosen.size, onclick: () => attempt(async () => { await order("library", { names: [...chosen] }); location.hash = "#diagnose"; }) }, openWords()))),
  el("div", { class: "grid" }, el("section", { class: "panel w8 scroll", "aria-label": "Runs" },
    el("table", { class: "rows library" }, el("thead", {}, el("tr", {}, ["", "Set, run", "Programme", "Load", "Duration", "Error ÷ noise", "Verdict"].map((text, i) => el("th", { class: i === 4 ? "number" : "" }, text || el("span", { class: "visually-hidden" }, "Choose"))))), body),
    outputs.length ? el("div", { class: "legend below" }, outputs.map((name) => el("span", {}, svg("svg", { width: 14, height: 12, "aria-hidden": "true" }, mark(name, 7, 6)), NAMES[name] || name)), el("span", {}, "line on the left: noise floor")) : el("p", { class: "note below" }, "Diagnose runs to see their verdict here.")),
  el("section", { class: "panel w4 beside", "aria-label": "Overlay" }, el("header", {}, el("h2", {}, "Overlay"), channels.length ? el("span", { class: "row end" }, pick) : null), el("div", { id: "overlay" }, el("p", { class: "note" }, "Choose runs of the list.")))));
  overlay();
}

const openWords = () => (chosen.size ? `Diagnose ${chosen.size} run${chosen.size === 1 ? "" : "s"}` : "Diagnose runs");

// Runs of one winch and session, in the order of the files.
function sets() {
  const out = new Map();
  for (const run of found.runs) {
    if (run.fault) continue;
    const key = `${run.winch}\n${run.session}`;
    if (!out.has(key)) out.set(key, []);
    out.get(key).push(run);
  }
  return [...out];
}

const matches = (run) => (!verdict || (run.verdict && run.verdict.verdict === verdict)) && filter.toLowerCase().split(/\s+/).every((word) => [run.name, run.programme, run.load, run.winch, run.session, run.verdict && run.verdict.cause].join(" ").toLowerCase().includes(word));

function rows() {
  const seen = sets().map(([key, runs]) => [key, runs.filter(matches)]).filter(([, runs]) => runs.length), faults = found.runs.filter((run) => run.fault && !verdict && run.name.toLowerCase().includes(filter.toLowerCase()));
  if (!seen.length && !faults.length) return [el("tr", {}, el("td", { colspan: 7 }, found.runs.length ? "No run fits the filter." : `There are no runs in the folder ${found.folder}. Serve the folder of your runs, or drop runs in the Diagnose view.`))];
  const all = seen.length <= 3, out = [];
  for (const [key, runs] of seen.slice(0, MOST)) {
    const open = all !== opened.has(key);
    out.push(setRow(key, runs, open), ...(open ? runs.map(runRow) : []));
  }
  if (seen.length > MOST) out.push(el("tr", {}, el("td", { colspan: 7, class: "note" }, `and ${seen.length - MOST} more sets; filter them`)));
  return [...out, ...(faults.length ? [faultsRow(faults), ...(faultsOpen ? faults.slice(0, MOST).map(faultRow) : [])] : [])];
}

const faultsRow = (faults) => el("tr", {}, el("td", {}), el("td", { colspan: 6 }, el("button", { class: "plain fold", id: "faults", "aria-expanded": String(faultsOpen), onclick: () => { faultsOpen = !faultsOpen; redraw(); } }, el("span", { "aria-hidden": "true" }, faultsOpen ? "▾" : "▸"), `${faults.length} file${faults.length === 1 ? " is no run" : "s are no runs"}`)));

const faultRow = (run) => el("tr", {}, el("td", {}), el("td", {}, run.name), el("td", { colspan: 5, class: "note" }, run.fault));

function redraw() { address(); fill(root.querySelector("table.library tbody"), ...rows()); const button = document.getElementById("open"); button.disabled = !chosen.size; fill(button, openWords()); overlay(); }

function setRow(key, runs, open) {
  const [first] = runs, alike = runs.every((run) => JSON.stringify(run.verdict) === JSON.stringify(first.verdict)), whole = runs.every((run) => chosen.has(run.name));
  const several = (values) => [...new Set(values.filter(Boolean))].join(", ");
  const toggle = () => { for (const run of runs) if (whole) chosen.delete(run.name); else chosen.add(run.name); redraw(); };
  return el("tr", { class: "set" }, el("td", {}, el("input", { type: "checkbox", style: { minHeight: "auto" }, checked: whole, "aria-label": `Choose all runs of ${first.winch || "the folder"}, ${first.session}`, onchange: toggle })),
    el("td", {}, el("button", { class: "plain fold", "aria-expanded": String(open), onclick: () => { if (opened.has(key)) opened.delete(key); else opened.add(key); redraw(); } }, el("span", { "aria-hidden": "true" }, open ? "▾" : "▸"), el("b", {}, first.winch || "No winch named")), el("span", { class: "note" }, `${first.session} · ${runs.length} run${runs.length === 1 ? "" : "s"}`)),
    el("td", {}, several(runs.map((run) => run.programme)) || "–"), el("td", {}, several(runs.map((run) => run.load).sort((a, b) => parseFloat(a) - parseFloat(b))).replaceAll(" kg", "\u00a0kg") || "–"), el("td", { class: "tight number" }, `${number(runs.reduce((sum, run) => sum + run.seconds, 0), 3)} s`),
    alike ? judged(first.verdict) : [el("td", {}), el("td", { class: "note" }, "see the runs")]);
}

const judged = (found) => (found ? [el("td", {}, shapes(found.ratios)), el("td", { class: "tight" }, el("span", { class: `chip ${found.verdict}` }, icon(found.verdict), found.chip), el("span", { class: "note cause", title: `profile ${found.profile}` }, found.cause))] : [el("td", {}), el("td", { class: "note" }, "not diagnosed")]);

function runRow(run) {
  const toggle = (event) => { if (event.target.checked) chosen.add(run.name); else chosen.delete(run.name); redraw(); root.querySelector(`input[aria-label="Choose ${CSS.escape(run.name)}"]`)?.focus(); };
  const [same] = sets().find(([, runs]) => runs.includes(run))[1];
  return el("tr", {}, el("td", {}, el("input", { type: "checkbox", style: { minHeight: "auto" }, checked: chosen.has(run.name), "aria-label": `Choose ${run.name}`, onchange: toggle })),
    el("td", {}, el("code", {}, run.name.split("/").at(-1)), run.sanity.length ? el("span", { class: "note", title: run.sanity.join(", ") }, ` ${run.sanity.length} finding${run.sanity.length === 1 ? "" : "s"}`) : null),
    el("td", {}, run.programme || "–"), el("td", { class: "tight" }, run.load || "–"), el("td", { class: "tight number" }, `${number(run.seconds, 3)} s`),
    JSON.stringify(run.verdict) === JSON.stringify(same.verdict) ? [el("td", { class: "tight note", colspan: 2 }, `${run.date.slice(0, 16).replace("T", " ")} UTC, ${run.samples} rows`)] : judged(run.verdict));
}

function mark(name, x, y) {
  if (MARKS[name] === "square") return svg("rect", { x: x - 4, y: y - 4, width: 8, height: 8, fill: "var(--today)" });
  if (MARKS[name] === "triangle") return svg("path", { d: `M${x} ${y - 5}l5 9h-10z`, fill: "var(--today)" });
  return svg("circle", { cx: x, cy: y, r: 4, fill: "var(--surface)", stroke: "var(--today)", "stroke-width": 2 });
}

// Error over the noise floor of each output on one logarithmic axis, 1 to 32.
function shapes(ratios) {
  const place = (ratio) => 8 + Math.min(5, Math.log2(Math.max(1, ratio))) * 22;
  const words = Object.entries(ratios).map(([name, ratio]) => `${NAMES[name] || name} ${number(ratio, 3)}`).join(", ");
  return svg("svg", { width: 126, height: 20, role: "img", "aria-label": `Error over noise: ${words || "unknown"}` }, svg("title", {}, words), svg("line", { x1: 8, x2: 122, y1: 10, y2: 10, stroke: "var(--line)" }), svg("line", { x1: 8, x2: 8, y1: 2, y2: 18, stroke: "var(--ink2)", "stroke-width": 1.5 }),
    Object.entries(ratios).map(([name, ratio]) => mark(name, place(ratio), 10)));
}

async function overlay() {
  const box = document.getElementById("overlay");
  if (!box) return;
  const names = [...chosen].slice(0, MOST_LINES).map((name) => `&name=${encodeURIComponent(name)}`).join("");
  await drawAnswer(box, async () => (names ? ask(`/api/overlay?channel=${encodeURIComponent(channel)}&over=${encodeURIComponent(over)}${names}`) : null),
    (lines) => (lines ? drawLines(box, lines, `folder ${found.folder}`, chosen.size > MOST_LINES ? `the first ${MOST_LINES} runs` : "") : fill(box, el("p", { class: "note" }, "Choose runs of the list."))));
}

export function keys(event) {
  if (part === "fleet") return fleet.keys(event);
  if (event.key === "/") { root.querySelector("input[type=search]")?.focus(); return true; }
  return false;
}
