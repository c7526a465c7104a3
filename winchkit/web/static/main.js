// Routes by the hash, the connection to the server, keys of all views.
import * as bench from "./bench.js";
import * as diagnose from "./diagnose.js";
import * as library from "./library.js";
import * as robot from "./robot.js";
import { alarm, closeDialog, dialog, el, place, socket, version } from "./page.js";

const views = { diagnose, bench, robot, library };
const main = document.getElementById("main");
const MOST = 8;
let state = null, name = null;

function route() {
  const [wanted, ...parts] = location.hash.replace(/^#/, "").split("/");
  if (!state) return;
  // Without a view in the address a page with a bench and no runs shows the bench.
  const next = views[wanted] ? wanted : state.bench && !state.runs.length ? "bench" : "diagnose";
  if (next === name && !parts.length) return; // a link within the view says what it shows
  if (name && views[name].leave) views[name].leave();
  alarm("", "order");
  name = next;
  for (const link of document.querySelectorAll("#views a")) { if (link.dataset.view === name) link.setAttribute("aria-current", "page"); else link.removeAttribute("aria-current"); }
  document.title = `${name[0].toUpperCase()}${name.slice(1)} · winchkit`;
  if (views[name].restore) views[name].restore(parts);
  main.removeAttribute("data-signature");
  main.replaceChildren();
  views[name].enter(main, state);
}

// A view may draw itself anew at any time: a message that stood in it is put where it is seen.
new MutationObserver(place).observe(main, { childList: true, subtree: true });

// Refusals of work under way, in every view; each is shown once.
let refusal = 0;
function refused({ refusals, faults }) {
  if (refusals !== refusal || !faults.length) alarm([...faults.slice(0, MOST), ...(faults.length > MOST ? [`and ${faults.length - MOST} more`] : [])].join("\n"), "work");
  refusal = refusals;
}

socket("/live", (fresh) => {
  const first = !state;
  alarm("", "server");
  state = fresh;
  version.text = fresh.version;
  refused(state);
  if (first) bench.station(state).finally(route); else if (name) views[name].update(state);
}, () => { if (!state || !state.bench) alarm("The server does not answer. Trying again; if it was ended, start 'winchkit serve' anew.", "server"); });

// Messages stand above a dialog, and a dialog below them.
const head = document.getElementById("head");
new ResizeObserver(() => document.documentElement.style.setProperty("--head", `${head.offsetHeight}px`)).observe(head);

addEventListener("hashchange", route);

for (const kind of ["dragover", "drop"]) addEventListener(kind, (event) => {
  event.preventDefault();
  if (kind === "drop" && event.dataTransfer.files.length) { if (name === "robot") robot.drop(event.dataTransfer.files); else { location.hash = "#diagnose"; diagnose.drop(event.dataTransfer.files); } }
});

const KEYS = [["Space", "Stop, with a bench; everywhere but in a text field"], ["Esc", "Stop while a winch moves, also in a text field; else close, clear the brush"], ["Enter", "a button or a box that has the focus"], ["↑ ↓", "Bench: hold to wind in, pay out"], ["[ ]", "Bench: jog speed"], ["T", "Bench: tare"], ["R", "Bench: reset"], ["P", "Bench: pause the charts"], ["1–4", "views"], ["J K", "candidate"], ["A", "add to the profile"], ["B", "mark samples in a focused plot; arrows move the mark"], ["U", "undo"], ["C", "compare"], ["S", "save the profile"], ["/", "filter the library"], ["?", "this list"]];
const WRITTEN = "textarea, input:not([type=checkbox], [type=radio], [type=range], [type=file])";

addEventListener("keydown", (event) => {
  if (bench.stopKey(event, Boolean(event.target.closest(WRITTEN)))) { event.preventDefault(); event.stopPropagation(); return; }
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "Escape" && document.getElementById("dialog").open) { closeDialog(); event.preventDefault(); event.stopPropagation(); return; }
  if (event.key === "Enter" && event.target.type === "checkbox") { event.target.click(); event.preventDefault(); return; }
  if (event.target.closest("input, select, textarea") && event.target.type !== "checkbox") return;
  if (document.getElementById("dialog").open) return;
  if ("1234".includes(event.key)) { location.hash = `#${Object.keys(views)[event.key - 1]}`; event.preventDefault(); return; }
  if (event.key === "?") { dialog("Keys", el("table", {}, el("tbody", {}, KEYS.map(([key, words]) => el("tr", {}, el("td", { class: "tight" }, el("kbd", {}, key)), el("td", {}, words)))))); event.preventDefault(); return; }
  if (name && views[name].keys && views[name].keys(event)) event.preventDefault();
}, true);
// Some browsers press a focused button where Space is let go.
addEventListener("keyup", (event) => { if (event.code === "Space" && bench.attached() && !event.target.closest(WRITTEN)) event.preventDefault(); }, true);
