// The Diagnose view: verdict, errors of each model, candidate card, curves over time, residual over variables.
import { ask, attempt, closeDialog, dialog, download, drawAnswer, el, filesOf, fill, icon, number, order, say, sourceOf } from "./page.js";
import { channelPanel } from "./channels.js";
import { exporter } from "./figures.js";
import { importFile } from "./import.js";
import { counted, modelExporter, modelGrid, place, presentName, reach } from "./model_errors.js";
import { morph, slideRails } from "./motion.js";
import { newProfile } from "./profile.js";
import { both, drawSides } from "./sides.js";
import { dots, legend, line, plot, sorted, sym, unitOf } from "./plots.js";

// The output that the errors propose has the focus until another is chosen, and after an addition.
let view = null, root = null, shown = { effect: null, output: null, chosen: false }, brushed = null, panels = [], waiting = [], cards = {}, span = null, over = [], earlier = null, drawnCurve = null, wanted = null;

export function enter(main, state) { root = main; shown = wanted || { effect: null, output: null, chosen: false }; wanted = null; brushed = null; waiting = []; update(state); }

export function update(state) {
  const signature = JSON.stringify([state.runs, state.profile, state.diagnosis, state.outputs, state.compared, state.beside, !state.diagnosis && Boolean(state.busy)]);
  const same = root.dataset.signature === signature && root.firstChild;
  if (!same) earlier = view && comparable(view, state) ? { diagnosis: view.diagnosis, curve: drawnCurve } : null;
  const others = view && view.runs.length > 0 && JSON.stringify(view.runs) !== JSON.stringify(state.runs);
  view = state;
  if (same) { busy(); return; }
  root.dataset.signature = signature;
  cards = {};
  if (others) span = null;
  compareAgain();
  if (state.said) say(state.said);
  render();
}

// Whether two states differ in the profile's additions only, so that one becomes the other.
function comparable(before, after) {
  const own = (state) => JSON.stringify([state.profile && state.profile.name, state.runs]);
  return before.diagnosis && after.diagnosis && own(before) === own(after);
}

const source = () => sourceOf(`profile ${[view.profile.name, ...view.profile.added].join(" + ")}`, view.runs.filter((run) => run.used).map((run) => run.name).join(", "));

function render() {
  const d = view.diagnosis;
  fill(root, context(), el("div", { id: "busy" }));
  if (!view.runs.length) root.append(empty());
  else if (d && view.beside) {
    if (!both(view).includes(shown.output)) shown.output = both(view).includes(d.models.focus) ? d.models.focus : both(view)[0];
    drawSides(root, view, shown.output, focusOfSides);
  } else if (d) {
    const stays = shown.chosen || earlier, focus = stays && d.models.columns.some((c) => c.output === shown.output) ? shown.output : d.models.focus;
    shown.output = focus;
    const candidates = d.models.rows.filter((row) => row.kind === "candidate");
    if (!candidates.some((row) => row.effect === shown.effect)) shown.effect = candidates.length && d.verdict !== "adequate" ? candidates[0].effect : null;
    // Steps and cards have a column of their own: errors and residual are seen at a height of 900 px, whatever the number of steps.
    const open = d.patterns.length > 0, panel = (id, label, more = "") => el("section", { class: `panel ${more}`, id, "aria-label": label });
    const side = [d.steps.length && el("section", { class: "panel found", "aria-label": "Effects that were found" }, stepList(d.steps)), shown.effect && panel("card", "Candidate", "card"), open && panel("next", "What to do next", "card next")].filter(Boolean);
    root.append(head(d), el("div", { class: "grid" },
      el("div", { class: `stacked ${side.length ? "w8" : "w12"}` }, panel("models", "Held-out error of each candidate"), open ? panel("pattern", "The curve to explain") : null, panel("time", "Measured and predicted")),
      side.length ? el("div", { class: "stacked w4" }, side) : null,
      panel("over", "Residual against each variable", "w12"), panel("data", null, "w12")), channelPanel(view));
    drawModels(); drawTime(); drawMultiples(); drawData();
    if (earlier) slideRails(root.querySelector("#models"), earlierRails());
    if (shown.effect) drawCard();
    if (open) drawPattern();
  } else if (view.outputs.length) {
    if (!view.outputs.includes(shown.output)) shown.output = view.outputs[0];
    const heads = view.outputs.map((output) => el("button", { "aria-pressed": String(output === shown.output), onclick: () => { shown.output = output; shown.chosen = true; span = null; render(); } }, output.replaceAll("_", " ")));
    root.append(el("h1", { class: "visually-hidden" }, "Measured and predicted"), el("div", { class: "row", style: { paddingBottom: "12px" } }, el("span", { class: "row segments" }, heads), view.busy ? null : el("button", { class: "primary", onclick: () => attempt(() => order("diagnose")) }, "Diagnose")), el("div", { class: "grid" }, el("section", { class: "panel w12", id: "time", "aria-label": "Measured and predicted" })), channelPanel(view));
    drawTime();
  } else if (!view.profile) root.append(el("div", { class: "drop" }, el("h1", {}, "Choose a profile"), el("p", { class: "note" }, "The profile is the model that the runs are compared with: drum, gearbox, cable and pulleys."),
    el("div", { class: "row" }, el("button", { class: "primary", onclick: () => newProfile() }, "New profile…"), el("button", { onclick: chooseProfile }, "Choose a profile…"))));
  else if (!view.busy) root.append(el("div", { class: "panel" }, el("button", { class: "primary", onclick: () => attempt(() => order("diagnose")) }, "Diagnose")));
  busy();
}

// A file by its name, without its folder.
const leaf = (path) => path.split(/[\\/]/).at(-1);

function context() {
  const used = view.runs.filter((run) => run.used), loads = [...new Set(used.map((run) => run.load).filter(Boolean))];
  const profile = el("button", { onclick: chooseProfile, title: view.profile ? view.profile.name : null }, el("b", {}, view.profile ? leaf(view.profile.name) : "choose…"),
    view.profile && view.profile.added.length ? el("span", { class: "note" }, `+ ${view.profile.names.join(", ")}`) : null);
  return el("div", { class: "row context of-runs" },
    el("span", { class: "label" }, "Runs"), el("button", { onclick: chooseRuns }, el("b", {}, `${used.length} run${used.length === 1 ? "" : "s"}`), el("span", { class: "note" }, loads.join(", "))),
    el("span", { class: "label" }, "Profile"), profile,
    view.winch ? el("span", { class: "label" }, `Winch ${view.winch}`) : null,
    el("span", { class: "row end" },
      view.beside ? [el("button", { onclick: () => attempt(() => order("swap")) }, "Swap sides"), el("button", { onclick: () => attempt(() => order("end")) }, "End comparison")]
        : el("button", { disabled: !view.diagnosis || Boolean(view.busy), onclick: () => chooseBeside() }, "Compare…"),
      view.simulated ? el("button", { disabled: !view.diagnosis, onclick: () => attempt(async () => dialog("What the simulated bench hides", el("p", {}, (await ask("/api/truth")).truth))) }, "Reveal…") : null,
      el("button", { disabled: !view.can_undo || Boolean(view.busy), onclick: () => attempt(() => order("undo")) }, "Undo"),
      el("button", { disabled: !view.profile, onclick: () => attempt(() => download("/api/profile")) }, "Save profile"),
      el("button", { disabled: !view.diagnosis, onclick: () => attempt(() => download("/api/report")) }, "Report"),
      el("button", { disabled: !view.diagnosis, onclick: showCommands }, "Commands")));
}

function busy() {
  const box = root.querySelector("#busy");
  if (!box) return;
  const there = box.firstChild;
  if (!view.busy) { if (there) box.replaceChildren(); return; }
  if (there) { there.querySelector("span").textContent = view.busy.what; there.querySelector("progress").value = view.busy.share; return; }
  box.append(el("div", { class: "row", style: { paddingBottom: "12px" } }, el("progress", { max: 1, value: view.busy.share, "aria-label": "Progress" }),
    el("span", { class: "label" }, view.busy.what), el("button", { class: "plain", onclick: () => attempt(() => order("cancel")) }, "Cancel")));
}

function empty() {
  const input = el("input", { type: "file", multiple: true, class: "visually-hidden", id: "files", "aria-label": "Run files", tabindex: -1, onchange: (event) => drop(filesOf(event.target)) });
  const way = (title, words, ...buttons) => el("section", { class: "w4 way" }, el("h2", {}, title), el("p", { class: "note" }, words), el("div", { class: "row" }, buttons));
  return el("div", { class: "drop" }, el("h1", {}, view.profile ? `Runs to compare with ${leaf(view.profile.name)}` : "Which effect does the model of your winch lack?"), el("div", { class: "grid" },
    way("Open the demo", "Simulated runs with an effect that the profile lacks: see it found, add it, see the error fall.", el("button", { class: view.profile ? "" : "primary", onclick: () => attempt(() => order("example", { name: DEMO })) }, "Open the demo"), el("button", { onclick: openExample }, "Open an example…")),
    way("Drop runs", "Drop recordings of your winch anywhere on this page: files of winchkit or of another program (CSV, XLSX, MAT, HDF5 …).", input, el("button", { class: view.profile ? "primary" : "", onclick: () => input.click() }, "Choose files"), el("button", { onclick: () => newProfile() }, "New profile…")),
    way("Connect a bench", "Move a winch, record runs, watch the model live.", el("a", { class: "button", href: "#bench" }, "Connect a bench"))));
}

export async function drop(files) {
  for (const file of files) {
    await attempt(async () => {
      const answer = await ask("/api/drop", file, { "x-file-name": encodeURIComponent(file.name) });
      if (answer.import) await importFile(answer.file, answer.import);
    });
  }
}

const DEMO = "demo-eccentric-drum";
const openExample = () => attempt(async () => {
  const choices = await ask("/api/choices");
  const list = el("select", { "aria-label": "Example" }, choices.examples.filter((name) => !name.startsWith("programme")).map((name) => el("option", {}, name)));
  list.value = "demo-fat-drum";
  dialog("Open an example", el("p", { class: "note" }, "An example simulates two programmes under two loads, each twice, with the effect of its name."),
    el("div", { class: "row", style: { marginTop: "12px" } }, list, el("button", { class: "primary", onclick: () => attempt(async () => { await order("example", { name: list.value }); closeDialog(); }) }, "Open"),
      el("button", { onclick: () => attempt(async () => { await order("mystery", { seed: 1 + Math.floor(Math.random() * 1e6) }); closeDialog(); }) }, "Hide the effect")));
});

const chooseProfile = () => attempt(async () => {
  const choices = await ask("/api/choices");
  const list = el("select", { "aria-label": "Profile" }, choices.profiles.map((name) => el("option", {}, name)));
  const file = el("input", { type: "file", accept: ".toml", "aria-label": "Profile file", onchange: () => attempt(async () => { await drop(filesOf(file)); closeDialog(); }) });
  dialog("Profile", el("div", { class: "row" }, list, el("button", { class: "primary", onclick: () => attempt(async () => { await order("profile", { name: list.value }); closeDialog(); }) }, "Use")),
    el("p", { class: "note", style: { margin: "12px 0 4px" } }, "or a file"), file,
    el("p", { class: "note", style: { margin: "12px 0 4px" } }, "or from the drawing of your winch"), el("button", { onclick: () => newProfile() }, "New profile…"));
});

function chooseRuns() {
  const input = el("input", { type: "file", multiple: true, "aria-label": "Run files", onchange: () => { closeDialog(); drop(input.files); } });
  dialog("Runs", el("div", { class: "runs" }, view.runs.map((run) => el("label", {},
    el("input", { type: "checkbox", checked: run.used, style: { minHeight: "auto" }, onchange: (event) => attempt(() => order("use", { name: run.name, used: event.target.checked })) }),
    el("span", {}, run.name), el("span", { class: "note" }, `${run.load} · ${number(run.seconds, 3)} s · ${run.samples} samples`),
    el("button", { class: "plain", "aria-label": `Remove ${run.name}`, onclick: () => attempt(async () => { await order("remove", { name: run.name }); closeDialog(); }) }, "Remove")))),
  el("p", { class: "note", style: { margin: "12px 0 4px" } }, "Add files"), input);
}

const chooseBeside = () => attempt(async () => {
  const choices = await ask("/api/choices"), { name, added, names } = view.profile;
  const versions = ["", ...added].map((effect, i) => el("option", { value: i, selected: i === Math.max(0, added.length - 1) }, i ? `${name} + ${names.slice(0, i).join(" + ")}` : `${name} as loaded`));
  const list = el("select", { "aria-label": "Profile beside" }, el("optgroup", { label: "This profile" }, versions), el("optgroup", { label: "Others" }, choices.profiles.map((own) => el("option", {}, own))));
  const boxes = view.runs.map((run) => [run.name, el("input", { type: "checkbox", checked: run.used, style: { minHeight: "auto" } })]);
  dialog("Compare with", el("label", { class: "row" }, "Profile", list),
    el("fieldset", {}, el("legend", { class: "note" }, "on these runs"), el("div", { class: "runs" }, boxes.map(([own, box]) => el("label", {}, box, el("span", {}, own))))),
    el("button", { class: "primary", onclick: () => attempt(async () => {
      const version = list.selectedIndex <= added.length ? Number(list.value) : list.value;
      await order("compare", { profile: version, runs: boxes.filter(([, box]) => box.checked).map(([own]) => own) });
      closeDialog();
    }) }, "Show beside"));
});

function showCommands() {
  const text = view.commands.join("\n");
  dialog("What was clicked, as commands", el("pre", { tabindex: 0 }, text), el("button", { onclick: () => navigator.clipboard.writeText(text) }, "Copy"));
}

function head(d) {
  return el("div", { class: "verdict" }, el("div", { class: "head" }, el("span", { class: `chip ${d.verdict}` }, icon(d.verdict), d.chip), el("h1", {}, d.headline)),
    d.sentence ? el("p", {}, coloured(d.sentence)) : null);
}

// Every effect of the model with its values, and the doubts about it below.
function stepList(steps) {
  return el("ol", {}, steps.map((step) => el("li", {}, step.text, step.doubts.length ? el("ul", {}, step.doubts.map((text) => el("li", {}, text))) : null)));
}

// The errors before and after in the colours of the models, and no line break before a unit.
function coloured(sentence) {
  const joined = sentence.replace(/(\d) (?=[^\W\d_µ%°]|[µ%°])/g, "$1\u00a0").replace(/\u00a0(mN|N|kN) m\b/g, "\u00a0$1\u00a0m");
  return joined.split(/(from [^ ]+ to [^ ]+)(?= \()/).map((part, i) => {
    const [, before, after] = (i % 2 && /^from (.+) to (.+)$/.exec(part)) || [];
    return before ? el("span", {}, "from ", el("b", { class: "before" }, before), " to ", el("b", { class: "after" }, after)) : part;
  });
}

// Places of the earlier profile's errors on the present axis, in percent.
function earlierRails() {
  const { columns, rows } = earlier.diagnosis.models, today = rows.find((row) => row.kind === "today"), most = reach(view.diagnosis.models);
  return Object.fromEntries(columns.flatMap(({ output }) => today.cells[output] && today.cells[output].ratio ? [[output, place(today.cells[output].ratio, most)]] : []));
}

function drawModels() {
  const box = root.querySelector("#models"), own = view.diagnosis.models, narrow = matchMedia("(max-width: 699px)").matches;
  fill(box, el("header", {}, el("h2", {}, counted(own) ? "Held-out error of each candidate" : "Held-out error"), el("span", { class: "note" }, counted(own)), modelExporter(own, { output: shown.output, effect: shown.effect, present: presentName(view.profile) }, source)),
    narrow ? el("div", { class: "row segments" }, own.columns.map((c) => el("button", { "aria-pressed": String(c.output === shown.output), onclick: () => focus(c.output) }, c.name))) : null,
    modelGrid(own, { output: shown.output, effect: shown.effect, only: narrow, most: reach(own), present: presentName(view.profile), focus, choose }));
}

function focusOfSides(output) { shown.output = output; shown.chosen = true; address(); render(); }
matchMedia("(max-width: 699px)").addEventListener("change", () => { if (root && root.querySelector("#models")) drawModels(); });
function focus(output) { shown.output = output; shown.chosen = true; span = null; over = []; brushed = null; waiting = []; address(); drawModels(); drawTime(); drawMultiples(); }
function choose(effect) { shown.effect = effect; address(); drawModels(); drawCard(); }
// The address: output, candidate, the seconds that are shown, and the profile beside.
function address() {
  const beside = view.beside ? besideOf(view) : "", part = span ? span.map((value) => Number(value.toFixed(4))).join("to") : "";
  history.replaceState(null, "", `${location.pathname}${location.search}#diagnose/${[shown.output || "", shown.effect || "", part, beside].map(encodeURIComponent).join("/").replace(/\/+$/, "")}`);
}
export function restore(parts) {
  const [output, effect, part, beside] = parts.map(decodeURIComponent), ends = (part || "").split("to").map(Number);
  wanted = { output: output || null, effect: effect || null, chosen: Boolean(output) };
  span = ends.length === 2 && ends[0] < ends[1] ? ends : null;
  asked = beside || null;
}
// The profile beside as a comparison names it: the number of its additions where it is an earlier state of this one.
const besideOf = ({ profile, beside }) => (beside.profile.name === profile.name ? String(beside.profile.added.length) : beside.profile.name);
let asked = null;
function compareAgain() {
  if (view.beside || !asked) { asked = null; address(); return; }
  if (!view.diagnosis || view.busy) return;
  const profile = /^\d+$/.test(asked) ? Number(asked) : asked;
  asked = null;
  attempt(() => order("compare", { profile, runs: view.runs.filter((run) => run.used).map((run) => run.name) }));
}

// "F_c" of a formula as an F with the index c.
function subscripted(text) {
  return text.split(/(?<=[\p{L}\p{N}])_([\p{L}\p{N}]+)/u).map((part, k) => (k % 2 ? el("sub", {}, part) : part));
}

async function drawCard() {
  const box = root.querySelector("#card"), effect = shown.effect;
  if (!box) return;
  await drawAnswer(box, async () => cards[effect] || (cards[effect] = await ask(`/api/card?effect=${encodeURIComponent(effect)}`)), (card) => {
    const host = el("div", { class: "plot" });
    const equal = card.equal.length ? el("p", { class: "note" }, `= With these runs it cannot be distinguished from ${card.equal.join(", ")}. To decide: ${card.told_apart}`) : null;
    fill(box, el("header", { style: { margin: 0 } }, el("h2", { style: { fontSize: "16px" } }, card.name), el("code", { class: "note" }, card.effect)),
      host, card.signature ? el("div", { class: "row" }, el("span", { class: "note" }, `${card.signature.unit} over ${nameOf(card.signature.label)}`), legend(["today", "residual, mean"], ["with", "signature"], ["band", "±1σ", true]), exporter(`signature-${card.effect}`, () => signatureFigure(card))) : null,
      el("p", { class: "note" }, card.what), el("div", { class: "formula" }, subscripted(card.formula)),
      el("dl", {}, card.parameters.flatMap((p) => [el("dt", {}, p.name), el("dd", {}, p.text, p.interval ? el("small", {}, `95 %: ${p.interval}`) : null)])),
      view.diagnosis.steps.length > 1 ? el("p", { class: "note" }, "Values of a fit of this effect alone; the steps have those of all together.") : null, equal, card.next ? el("p", { class: "note" }, card.next) : null,
      el("div", { class: "buttons" }, el("button", { class: view.diagnosis.verdict === "unknown" ? "" : "primary", disabled: Boolean(view.busy), onclick: () => add(effect) }, "Add to profile ", el("kbd", {}, "A")),
        el("button", { onclick: planRun }, "Plan a run")));
    if (card.signature) drawSignature(host, card.signature);
  });
}

// The curve that no law explains, large, with the closest law on it, and what can be done about it.
async function drawPattern() {
  const box = root.querySelector("#pattern"), next = root.querySelector("#next"), [title] = view.diagnosis.patterns;
  fill(box, el("header", {}, el("h2", {}, title)));
  fill(next, el("h2", {}, "What to do next"));
  await drawAnswer(box, () => ask("/api/pattern?number=0"), (found) => {
    const host = el("div", { class: "plot" }), law = found.signature ? { name: `closest law: ${found.closest}`, values: found.signature } : null;
    fill(box, el("header", {}, el("h2", {}, found.title), exporter("pattern", () => signatureFigure({ name: found.title, signature: { ...found, signature: found.signature || [] } }))),
      el("div", { class: "row" }, el("span", { class: "note" }, `${found.unit} over ${nameOf(found.label)}`), legend(["today", "to explain, mean"], ...(law ? [["with", law.name]] : []), ["band", "±1σ", true])), host);
    const { columns } = sorted(found.x, found.residual);
    plot(host, columns, [{ paths: dots("today", 0.28, 2), points: { show: false } }], { height: 260, left: 58, noise: found.noise, xLabel: unitOf(found.label), range: sym(found.residual), logarithmic: found.logarithmic, names: ["residual"], unit: found.unit,
      traces: [{ name: "mean", x: found.bins, y: found.means, tone: "today", width: 2 }, ...(law ? [{ name: "law", x: found.bins, y: law.values, tone: "with", width: 3 }] : [])], label: `${found.title}: residual over ${found.label}` });
    const way = (head, words, button) => el("li", {}, el("b", {}, head), el("p", { class: "note" }, words), button), busy = Boolean(view.busy);
    fill(next, el("h2", {}, "What to do next"), el("ol", { class: "ways" },
      found.curve ? way("Take the curve as it is", "The profile then predicts it, without a cause.", el("button", { class: "primary", disabled: busy, onclick: () => add(found.curve) }, "Add the curve")) : null,
      way("Look for the cause", "A new file has a formula with the shape of this curve. Put in the physics that you recognise.", el("button", { disabled: busy, onclick: ownEffect }, "Make an effect of my own")),
      way("Record what isolates it", "Another speed, load or stroke shows what the curve follows.", el("button", { disabled: busy, onclick: planRun }, "Plan a run"))));
  });
}

const ownEffect = () => attempt(async () => {
  const { file, text } = await ask("/api/effect", "{}");
  dialog(`An effect of your own: ${file}`, el("p", { class: "note" }, "The file is in the folder of this page. Edit it there; the page reads it again at every diagnosis with it."), el("pre", { tabindex: 0 }, text),
    el("button", { class: "primary", onclick: () => attempt(async () => { await order("use-effect", { file }); closeDialog(); }) }, "Diagnose with it"));
});

const planRun = () => attempt(async () => {
  const { file, text, words, command } = await ask("/api/plan", "{}");
  dialog(`A programme for the next run: ${file}`, el("p", {}, words), el("pre", { tabindex: 0 }, text), el("p", { class: "note" }, "As a command:"), el("pre", { tabindex: 0 }, command));
});

// "drum angle" of "drum angle [°]".
const nameOf = (label) => label.replace(/ \[.*$/, "");

// Two sets of points over one x, sorted.
function mixed(x, y, others, marks) {
  const { columns } = sorted([...x, ...others], [...y, ...others.map(() => null)], [...x.map(() => null), ...marks]);
  return columns;
}

function drawSignature(host, s) {
  const { columns } = sorted(s.x, s.residual);
  plot(host, columns, [{ paths: dots("today", 0.28, 2), points: { show: false } }], { height: 140, noise: s.noise, xLabel: unitOf(s.label), range: sym(s.residual), logarithmic: s.logarithmic, names: ["residual"], unit: s.unit,
    traces: [{ name: "mean", x: s.bins, y: s.means, tone: "today", width: 2 }, { name: "signature", x: s.bins, y: s.signature, tone: "with", width: 3 }], label: `Residual and signature over ${s.label}` });
}

function signatureFigure({ name, signature: s }) {
  return { title: `${name}: its signature over the residual`, source: source(), legend: [{ name: "residual, mean", tone: "today" }, { name: "signature", tone: "with" }, { name: "noise floor ±1σ", tone: "edge" }],
    panels: [{ title: `Residual [${s.unit}]`, x: s.x, xLabel: s.label, noise: s.noise, range: sym(s.residual)(), logarithmic: s.logarithmic, series: [{ name: `residual [${s.unit}]`, y: s.residual, tone: "today", points: true, opacity: 0.28 },
      { name: `mean [${s.unit}]`, x: s.bins, y: s.means, tone: "today", width: 2 }, { name: `signature [${s.unit}]`, x: s.bins, y: s.signature, tone: "with", width: 3 }] }] };
}

// The new verdict and the rails that slide to it are at the top.
export const add = (effect) => attempt(async () => { await order("add", { effect }); scrollTo({ top: 0 }); });

async function drawTime() {
  const box = root.querySelector("#time"), output = shown.output;
  if (!box) return;
  const width = Math.max(300, box.clientWidth - 32), query = span ? `&from=${span[0]}&to=${span[1]}` : "";
  await drawAnswer(box, () => ask(`/api/curve?output=${output}&points=${Math.round(width * 2)}${query}`), (data) => {
    const upper = el("div", { class: "plot" }), lower = el("div", { class: "plot" });
    const runs = data.runs.map((run) => ({ ...run, labelled: true }));
    const zoom = (low, high) => {
      span = low === null ? null : [Math.max(data.first, low), Math.min(data.last, high)];
      if (span && span[1] - span[0] > 0.98 * (data.last - data.first)) span = null;
      address();
      clearTimeout(zoom.timer); zoom.timer = setTimeout(drawTime, 60);
    };
    const xLabel = "time [s]", marked = brushed && brushed.time;
    const figure = () => ({ title: `${data.name}: measured and predicted, and the residual`, source: source(), legend: [{ name: "measured", tone: "ink" }, { name: "predicted, residual", tone: "today" }, { name: "noise floor ±1σ", tone: "edge" }],
      panels: [{ title: `${data.name} [${data.unit}]`, x: data.x, xLabel, runs, series: [{ name: `measured [${data.unit}]`, y: data.measured, tone: "ink", width: 2.4, opacity: 0.35 }, { name: `predicted [${data.unit}]`, y: data.predicted, tone: "today" }] },
        { title: `Residual [${data.residual_unit}]`, x: data.x, xLabel, runs: data.runs, noise: data.noise, series: [{ name: `residual [${data.residual_unit}]`, y: data.residual, tone: "today" }, ...(brushed ? [{ name: `marked [${data.residual_unit}]`, x: brushed.time, y: brushed.residual, tone: "brush", points: true }] : [])] }] });
    if (!view.compared) {
      fill(box, el("header", {}, el("h2", {}, data.name, el("span", { class: "note" }, ` ${data.unit}; not compared yet`)), legend(["edge", "measured"])), upper);
      plot(upper, [data.x, data.measured], [line("ink", 1.6, 0.7)], { height: 120, top: 22, left: 58, runs, zoom, xLabel: "s", sync: "time", names: ["measured"], unit: data.unit, label: `${data.name}, measured over time` });
      return;
    }
    fill(box, el("header", {}, el("h2", {}, data.name, el("span", { class: "note" }, ` ${data.unit}, residual ${data.residual_unit}`)), legend(["edge", "measured"], ["today", "predicted, residual"], ["band", "noise ±1σ", true]),
      el("span", { class: "note" }, span ? el("button", { class: "plain", onclick: () => zoom(null, null) }, "Whole record") : null, exporter(`${output}-over-time`, figure))), upper, lower);
    plot(upper, [data.x, data.measured, data.predicted], [line("ink", 2.4, 0.35), line("today", 1.25)], { height: 120, top: 22, bare: true, left: 58, runs, zoom, sync: "time", names: ["measured", "predicted"], unit: data.unit, label: `${data.name}, measured and predicted over time` });
    const low = marked ? mixed(data.x, data.residual, marked, brushed.residual) : [data.x, data.residual];
    const drawn = plot(lower, low, [line("today", 1.25, 1, { spanGaps: Boolean(marked) }), ...(marked ? [{ paths: dots("brush", 0.9, 3), points: { show: false } }] : [])],
      { height: 188, left: 58, runs: runs.map((run) => ({ ...run, labelled: false })), zoom, noise: data.noise, xLabel: "s", sync: "time", names: ["residual"], unit: data.residual_unit, label: `Residual of the ${data.name} over time` });
    if (earlier && earlier.curve && earlier.curve.output === output && !span && !marked) {
      const { x, y, worth } = earlier.curve;
      morph(drawn, { x, y: y.map((value) => (value === null ? null : (value * worth) / data.residual_worth)) }, low);
    }
    earlier = null;
    drawnCurve = { output, x: data.x, y: data.residual, worth: data.residual_worth };
  });
}

async function drawMultiples() {
  const box = root.querySelector("#over"), output = shown.output;
  if (!box) return;
  await drawAnswer(box, () => ask(`/api/multiples?output=${output}${over.map((name) => `&over=${encodeURIComponent(name)}`).join("")}`), (found) => {
    const grid = el("div", { class: "multiples" }), drawnOver = found.panels.map((panel) => panel.variable), others = found.variables.filter(([name]) => !drawnOver.includes(name));
    const another = others.length ? el("select", { class: "another", "aria-label": "Another variable", onchange: () => { over = [another.value, ...drawnOver.slice(0, -1)]; drawMultiples(); } }, el("option", { value: "" }, "Over…"), others.map(([name, words]) => el("option", { value: name }, words))) : null;
    fill(box, el("header", {}, el("h2", {}, "Residual against each variable", el("span", { class: "note" }, ` ${found.unit}`)), el("span", { class: "note", id: "brush" }, "share of variance"), el("span", { class: "row end" }, another, exporter(`${output}-residual`, () => multiplesFigure(found)))), grid);
    const range = sym(found.residual);
    panels = found.panels.map((panel) => {
      const host = el("div", { class: "plot" });
      grid.append(el("div", {}, el("h3", {}, el("span", {}, panel.name, el("span", { class: "note" }, ` ${unitOf(panel.label)}`)), el("span", { class: "share" }, `${Math.round(100 * panel.share)} %`)), host));
      const { index, columns: data } = sorted(panel.x, found.residual, Array(panel.x.length).fill(null));
      const drawn = plot(host, data, [{ paths: dots("today", 0.28, 2), points: { show: false } }, { paths: dots("brush", 0.9, 3), points: { show: false } }],
        { height: 120, names: ["residual"], unit: found.unit, xUnit: unitOf(panel.label), traces: [{ name: "mean", x: panel.bins, y: panel.means, tone: "today", width: 2 }], noise: found.noise, range, logarithmic: panel.logarithmic, label: `Residual over ${panel.label}`, select: (low, high) => brush(found, panel, low, high) });
      return { drawn, index, data };
    });
  });
}

function multiplesFigure(found) {
  const name = view.diagnosis.models.columns.find((c) => c.output === shown.output).name, range = sym(found.residual)(), marked = brushed && found.residual.map((value, i) => (brushed.marked.has(i) ? value : null));
  return { title: `Residual of the ${name.toLowerCase()} [${found.unit}] against each variable`, source: source(), across: 3, legend: [{ name: "residual", tone: "today" }, { name: "noise floor ±1σ", tone: "edge" }],
    panels: found.panels.map((panel) => ({ title: `${panel.name}, ${Math.round(100 * panel.share)} %`, x: panel.x, xLabel: panel.label, noise: found.noise, range, logarithmic: panel.logarithmic,
      series: [{ name: `residual [${found.unit}]`, y: found.residual, tone: "today", points: true, opacity: 0.28 }, { name: `mean [${found.unit}]`, x: panel.bins, y: panel.means, tone: "today", width: 2, broken: true }, ...(marked ? [{ name: `marked [${found.unit}]`, y: marked, tone: "brush", points: true }] : [])] })) };
}

function brush(found, panel, low, high) {
  const marked = new Set();
  panel.x.forEach((x, i) => { if (x !== null && x >= low && x <= high) marked.add(i); });
  const order = [...marked].sort((a, b) => found.time[a] - found.time[b]);
  brushed = marked.size ? { marked, time: order.map((i) => found.time[i]), residual: order.map((i) => found.residual[i]) } : null;
  const first = panels.findIndex((_, i) => found.panels[i] === panel), marks = ({ drawn, index, data }) => () => {
    drawn.setData([data[0], data[1], index.map((i) => (marked.has(i) ? found.residual[i] : null))], false);
    drawn.redraw();
  };
  oneByOne([...panels.slice(first), ...panels.slice(0, first)].map(marks).concat(drawTime));
  fill(root.querySelector("#brush"), `${marked.size} of ${found.time.length} samples, ${panel.name} ${number(low, 3)} to ${number(high, 3)} ${unitOf(panel.label)} `, el("button", { class: "plain", onclick: clear }, "Clear"));
}

// One drawing in each frame of the browser, so that the pointer never waits for all of them; what a
// newer brush replaces is not drawn.
function oneByOne(drawings) {
  waiting = drawings;
  const next = () => {
    if (waiting !== drawings) return;
    drawings.shift()();
    if (drawings.length) requestAnimationFrame(next);
  };
  next();
}

export function clear() {
  if (!brushed) return false;
  brushed = null; waiting = [];
  drawMultiples(); drawTime();
  return true;
}

function drawData() {
  const d = view.diagnosis, box = root.querySelector("#data");
  const items = (list) => list.length ? el("ul", {}, list.map((text) => el("li", {}, text))) : el("p", { class: "note" }, "none");
  fill(box, el("details", { open: ["unknown", "partly", "undecided"].includes(d.verdict) }, el("summary", {}, "Data, patterns of the residual, and what would change this result"), el("div", { class: "facts" },
    el("div", {}, el("h2", {}, "Patterns of the residual"), items(d.unexplained)),
    el("div", {}, el("h2", {}, "Findings on the runs"), items(d.sanity.map((f) => [f.run, f.channel, f.text].filter(Boolean).join(": ")))),
    el("div", {}, el("h2", {}, "Notes"), items([...d.notes, d.changes])))));
}

export function keys(event) {
  if (!view || !view.diagnosis) return false;
  const rows = view.diagnosis.models.rows.filter((row) => row.kind === "candidate"), at = rows.findIndex((row) => row.effect === shown.effect);
  if (event.key === "j" && rows[at + 1]) choose(rows[at + 1].effect);
  else if (event.key === "k" && at > 0) choose(rows[at - 1].effect);
  else if (event.key === "a" && shown.effect && !view.busy) add(shown.effect);
  else if (event.key === "u" && view.can_undo && !view.busy) attempt(() => order("undo"));
  else if (event.key === "s") attempt(() => download("/api/profile"));
  else if (event.key === "c" && !view.beside && !view.busy) chooseBeside();
  else if (event.key === "Escape") return clear();
  else return false;
  return true;
}
