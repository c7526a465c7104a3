// Import of a file of another program: its columns, the channels that they may be, and a preview.
import { ask, attempt, dialog, el, icon, order, svg } from "./page.js";

let last = {};

// Resolves when the file is imported or its dialog closed. The answers of the previous file are
// taken for the next one where they fit it.
export async function importFile(file, found) {
  let given = {}, shown = found;
  if (Object.keys(last).length) try {
    const next = await guess(file, last);
    if (next.questions.length <= found.questions.length) { shown = next; given = last; }
  } catch { shown = found; }
  await new Promise((done) => { show(file, shown, given); document.getElementById("dialog").addEventListener("close", done, { once: true }); });
}

const guess = async (file, answers) => (await ask("/api/guess", JSON.stringify({ file, answers }))).import;

// `given` are the answers so far: `columns` as the command line takes them, and constants by name.
function show(file, found, given) {
  const columns = given.columns || [], factors = given.factors || {};
  // What is typed while the answer is awaited would be lost with the old table.
  const again = (next) => attempt(async () => {
    const open = [...document.querySelectorAll("#dialog :is(input, select, .primary):enabled")];
    open.forEach((node) => { node.disabled = true; });
    try { show(file, await guess(file, next), next); } finally { open.forEach((node) => { node.disabled = false; }); }
  });
  const column = (row, name, unit, factor) => again({ ...given, factors: { ...factors, [row.source]: factor },
    columns: [...columns.filter((text) => text.split("=")[0] !== row.channel && text.split("=")[0] !== name && !new RegExp(`^[^=]*=${escaped(row.source)}( |\\*|$)`).test(text)), name ? `${name}=${row.source}${factor ? ` *${factor}` : ""}${unit ? ` [${unit}]` : ""}` : `${row.channel}=`] });
  const cells = (row) => {
    const factor = factors[row.source] || "";
    const name = el("select", { "aria-label": `Channel of ${row.source}`, onchange: () => column(row, name.value, "", factor) }, ["", ...found.channels].map((own) => el("option", { value: own, selected: own === row.channel }, own || "not used")));
    const unit = el("input", { value: row.unit, size: 6, placeholder: "unit", "aria-label": `Unit of ${row.source}`, onchange: () => column(row, row.channel, unit.value, factor) });
    const times = el("input", { value: factor, size: 6, placeholder: "× 1", "aria-label": `Factor of ${row.source}`, onchange: () => column(row, row.channel, times.value ? "" : row.unit, times.value.trim()) });
    return [el("td", {}, el("b", {}, row.source)), el("td", {}, name), el("td", {}, row.channel ? times : ""), el("td", {}, row.channel ? unit : el("span", { class: "note" }, row.unit)), el("td", {}, row.first.slice(0, 3).join(" ")), el("td", {}, spark(row.plot)), el("td", { class: "note" }, [row.confidence, row.reason].filter(Boolean).join(": "))];
  };
  const questions = found.questions.map((q) => el("p", { class: "question" }, icon("partly"), q.text, q.options.length ? el("select", { "aria-label": q.text, onchange: (event) => again({ ...given, options: [...(given.options || []), event.target.value] }) }, ["", ...q.options].map((own) => el("option", { value: own }, own.replace(/^--/, "").replaceAll(/[-"]/g, " ")))) : q.key ? el("input", { "aria-label": q.text, placeholder: q.key.replaceAll("_", " "), onchange: (event) => again({ ...given, [q.key]: event.target.value }) }) : null));
  const mass = el("input", { size: 8, placeholder: "10 kg", value: given.load_mass || "", "aria-label": "Mass on the cable", onchange: () => { given.load_mass = mass.value; } });
  dialog(`Import ${file.split("/").at(-1)}`, el("p", { class: "note" }, `${found.layout}; ${found.columns.length} columns, ${found.rows} rows. Factor: multiply this column by a number, or by a constant of the file.`),
    el("div", { class: "scroll" }, el("table", { class: "rows" }, el("thead", {}, el("tr", {}, ["Column", "Channel", "Factor", "Unit", "First values", "Plot", "Why"].map((text) => el("th", {}, text)))), el("tbody", {}, found.columns.map((row) => el("tr", {}, cells(row)))))),
    ...questions, found.notes.map((text) => el("p", { class: "note" }, text)),
    el("div", { class: "row", style: { marginTop: "12px" } }, el("label", { class: "row" }, "Mass on the cable", mass),
      el("button", { class: "primary", disabled: found.questions.length > 0, onclick: () => attempt(async () => { last = { ...given, load_mass: "" }; await order("import", { file, answers: given }); document.getElementById("dialog").close(); }) }, "Import")));
}

const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

function spark(values) {
  const known = values.filter((v) => v !== null);
  if (known.length < 2) return el("span", {});
  const low = known.reduce((a, b) => Math.min(a, b)), high = known.reduce((a, b) => Math.max(a, b));
  const points = values.map((v, i) => v === null ? null : `${((i / (values.length - 1)) * 96 + 2).toFixed(1)},${(22 - ((v - low) / (high - low || 1)) * 18).toFixed(1)}`).filter(Boolean).join(" ");
  return svg("svg", { width: 100, height: 26, role: "img", "aria-label": "values over the record" }, svg("polyline", { points, fill: "none", stroke: "var(--ink2)", "stroke-width": 1 }));
}
