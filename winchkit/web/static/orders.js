// A move and a tare: what is typed is checked at its field, what changes a reading is asked for.
import { confirmed, el, number } from "./page.js";

const METRES = /^(\d+\.?\d*|\.\d+)$/, SPEED = 0.05;
let typed = "", speed = SPEED;

// The field of another winch is empty: a length is never one that nobody typed for it.
export function forget() { typed = ""; }

// Field, speed and button of a move; `start` orders it with a length in m and a speed in m/s.
export function move(speeds, start) {
  if (!speeds.includes(speed)) speed = speeds.includes(SPEED) ? SPEED : speeds[0];
  const fault = el("p", { id: "move-fault", class: "fault", role: "alert" });
  const field = el("input", { value: typed, inputmode: "decimal", autocomplete: "off", "aria-label": "Cable length, m", "aria-describedby": "move-fault", oninput: () => { typed = field.value; tell(""); } });
  const at = el("select", { "aria-label": "Speed of the move, m/s", onchange: () => { speed = Number(at.value); } }, speeds.map((value) => el("option", { value, selected: value === speed }, `${value} m/s`)));
  function tell(words) { fault.textContent = words; field.setAttribute("aria-invalid", String(Boolean(words))); }
  function order() {
    const text = field.value.trim();
    if (METRES.test(text)) { start(Number(text), speed); return; }
    tell(`${text ? `"${text}" is not a length.` : "No length is given."} Type metres, for example 2.5.`);
    field.focus();
  }
  return el("fieldset", { class: "orders move" }, el("legend", {}, "Move to, m"), el("div", { class: "upright" }, el("div", { class: "row" }, field, el("button", { onclick: order }, "Move")), el("label", { class: "row" }, "at ", at)), fault);
}

const newtons = (value) => (value === null ? "–" : `${number(value, 4)} N`);

// Gross tension of a winch, on which its limits act, N; null where it is not known.
export const grossOf = (net, tare) => net === null || tare === null || tare === undefined ? null : net + tare;

// Asks for a tare, with the readings as they are while it asks.
export function tare(winch, limits, read, start) {
  const known = limits.filter((limit) => limit !== null).map((limit) => `${number(limit, 3)} N`);
  confirmed(`Tare winch ${winch}`, `The net tension counts from what hangs on the load cell now.${known.length ? ` The limit${known.length > 1 ? "s" : ""} of ${known.join(" and ")} still act${known.length > 1 ? "" : "s"} on the gross value.` : ""}`, start,
    el("p", { id: "tensions", style: { marginTop: "8px" } }, readings(read())));
}

export function renewTare(read) {
  const shown = document.getElementById("tensions");
  if (shown) shown.textContent = readings(read());
}

const readings = ({ tension, gross }) => `Now: gross ${newtons(gross)}, net ${newtons(tension)}.`;
