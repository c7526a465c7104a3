// Routes by the hash, the connection to the server, keys of all views.
import * as bench from "./bench.js";
import * as diagnose from "./diagnose.js";
import * as library from "./library.js";
import * as robot from "./robot.js";
import { alarm, dialog, el, socket, version } from "./page.js";

const views = { diagnose, bench, robot, library };
const main = document.getElementById("main");
let state = null, name = null;

function route() {
  const [wanted, ...parts] = location.hash.replace(/^#/, "").split("/");
  const next = views[wanted] ? wanted : "diagnose";
  if (next === name || !state) return;
  if (name && views[name].leave) views[name].leave();
  name = next;
  for (const link of document.querySelectorAll("#views a")) { if (link.dataset.view === name) link.setAttribute("aria-current", "page"); else link.removeAttribute("aria-current"); }
  document.title = `${name[0].toUpperCase()}${name.slice(1)} · winchkit`;
  if (views[name].restore) views[name].restore(parts);
  main.removeAttribute("data-signature");
  main.replaceChildren();
  views[name].enter(main, state);
}

socket("/live", (fresh) => {
  const first = !state;
  if (first) alarm("");
  state = fresh;
  version.text = fresh.version;
  if (first) bench.station(state).finally(route); else if (name) views[name].update(state);
}, () => alarm("The server does not answer. Trying again; if it was ended, start 'winchkit serve' anew."));

addEventListener("hashchange", route);

for (const kind of ["dragover", "drop"]) addEventListener(kind, (event) => {
  event.preventDefault();
  if (kind === "drop" && event.dataTransfer.files.length) { if (name === "robot") robot.drop(event.dataTransfer.files); else { location.hash = "#diagnose"; diagnose.drop(event.dataTransfer.files); } }
});

const KEYS = [["1–4", "views"], ["J K", "candidate"], ["A", "add to the profile"], ["B", "mark samples in a focused plot; arrows move the mark"], ["U", "undo"], ["C", "compare"], ["S", "save the profile"], ["/", "filter the library"], ["Esc", "clear the brush, close"], ["Space", "Stop, with a bench"], ["?", "this list"]];

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (bench.stopKey(event)) { event.preventDefault(); event.stopPropagation(); return; }
  if (event.target.closest("input, select, textarea") && event.target.type !== "checkbox") return;
  if (document.getElementById("dialog").open) return;
  if ("1234".includes(event.key)) { location.hash = `#${Object.keys(views)[event.key - 1]}`; event.preventDefault(); return; }
  if (event.key === "?") { dialog("Keys", el("table", {}, el("tbody", {}, KEYS.map(([key, words]) => el("tr", {}, el("td", {}, el("kbd", {}, key)), el("td", {}, words)))))); event.preventDefault(); return; }
  if (name && views[name].keys && views[name].keys(event)) event.preventDefault();
}, true);
