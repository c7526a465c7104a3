// Frames of the CAN buses in words: the newest of each COB-ID with its rate, or the last ones.
import { ask, el, fill } from "./page.js";

const PERIOD = 300;
let filter = "", trace = false, held = false, before = null, found = null;

// Asks while its table is in the page; the server collects frames only then.
export function frames(host) {
  const table = el("table", { class: "rows frames" }), note = el("span", { class: "note" });
  const buttons = el("span", { class: "segments" }, [["By COB-ID", false], ["Last 60", true]].map(([name, value]) => el("button", { "aria-pressed": String(trace === value), onclick: () => { trace = value; for (const b of buttons.children) b.setAttribute("aria-pressed", String((b.textContent === "Last 60") === trace)); draw(); } }, name)));
  fill(host, el("div", { class: "row", style: { marginBottom: "8px" } }, buttons, el("input", { value: filter, placeholder: "filter, e.g. TPDO", "aria-label": "Filter of the frames", oninput: (event) => { filter = event.target.value.toLowerCase(); draw(); } }),
    el("button", { id: "hold", onclick: (event) => { held = !held; event.target.textContent = held ? "Go on" : "Hold"; } }, held ? "Go on" : "Hold"), note), el("div", { class: "scroll" }, table));

  function draw() {
    if (!found) { note.textContent = "listening"; return; }
    const rows = (trace ? found.last : found.newest).filter((row) => !filter || `${hex(row)} ${row.kind} ${row.words}`.toLowerCase().includes(filter));
    fill(table, el("thead", {}, el("tr", {}, [...(trace ? ["Time, s"] : ["Per s"]), "COB-ID", "Kind", "Decoded"].map((name, i) => el("th", { class: i === 0 ? "number" : null }, name)))),
      el("tbody", {}, rows.map((row) => el("tr", {}, el("td", { class: "number tight" }, trace ? row.time.toFixed(3) : rate(row)), el("td", { class: "tight" }, el("code", {}, hex(row))), el("td", { class: "tight" }, row.kind), el("td", { title: row.data }, row.words)))));
    note.textContent = `${rows.length} of ${(trace ? found.last : found.newest).length}`;
  }
  const rate = (row) => { const earlier = before && before.newest.find((one) => one.bus === row.bus && one.identifier === row.identifier); return earlier && row.time > earlier.time ? ((row.count - earlier.count) / (row.time - earlier.time)).toFixed(0) : "0"; };
  const hex = (row) => `${row.identifier.toString(16).toUpperCase().padStart(3, "0")}h`;

  async function look() {
    if (!host.isConnected) return;
    if (!held && !document.hidden) {
      try { const next = await ask("/api/bench/frames"); if (!before || next.newest.some((row) => row.time - (before.newest[0]?.time ?? 0) > 1)) { before = found; } found = next; draw(); } catch (error) { note.textContent = error.message; }
    }
    setTimeout(look, PERIOD);
  }
  draw();
  look();
}
