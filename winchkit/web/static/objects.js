// Objects of a winch's drive as a tree to read, and its settings to write where the bench is disabled.
import { ask, confirmed, el, fill, number } from "./page.js";

export async function objects(host, winch) {
  fill(host, el("p", { class: "note" }, "Reading the drive"));
  const again = el("button", { onclick: () => objects(host, winch) }, "Read again");
  try {
    const { groups, settings } = await ask(`/api/bench/objects?winch=${encodeURIComponent(winch)}`);
    fill(host, settings.length ? writer(winch, settings) : null, groups.map(({ name, rows }, i) => el("details", { open: i < 2 }, el("summary", {}, name),
      el("table", {}, el("tbody", {}, rows.map(([object, what, value]) => el("tr", {}, el("td", { class: "tight" }, el("code", {}, object)), el("td", {}, what), el("td", { class: "number" }, String(value)))))))), again);
  } catch (error) { fill(host, el("p", {}, error.message), again); }
}

// Writes one setting: its type and limits, the present value, a confirmation, the value read back.
function writer(winch, settings) {
  const said = el("p", { class: "note", role: "status" }), value = el("input", { "aria-label": "New value", disabled: true }), write = el("button", { disabled: true, onclick: asked }, "Write…");
  const list = el("select", { "aria-label": "Setting", onchange: () => read() }, el("option", { value: "" }, "Choose a setting…"), settings.map((one) => el("option", { value: one.object }, `${one.object} ${one.name}`)));
  const chosen = () => settings.find((one) => one.object === list.value);
  let present = null;

  async function read() {
    const one = chosen();
    for (const node of [value, write]) node.disabled = true;
    said.textContent = "";
    if (!one) return;
    try {
      present = (await ask(`/api/bench/setting?winch=${encodeURIComponent(winch)}&object=${encodeURIComponent(one.object)}`)).value;
      value.value = present === null ? "" : String(present);
      said.textContent = present === null ? "The drive has no such object." : `A ${one.type}${one.low === null ? "" : ` from ${number(one.low, 10)} to ${number(one.high, 10)}`}; it is ${present} now.`;
      for (const node of [value, write]) node.disabled = present === null;
    } catch (error) { said.textContent = error.message; }
  }

  function asked() {
    const one = chosen();
    confirmed("Write", `Write ${one.object} ${one.name} of winch ${winch}: ${value.value} instead of ${present}? The bench is opened anew; the drive forgets it when it is switched off, unless 'winchkit config store' follows.`, () => store(one));
  }

  async function store(one) {
    write.disabled = true;
    try {
      const done = await ask("/api/bench/setting", JSON.stringify({ winch, object: one.object, value: value.value }));
      present = done.value;
      said.textContent = `Written and read back: ${one.object} is ${done.value}, was ${done.before}.`;
    } catch (error) { said.textContent = error.message; }
    write.disabled = false;
  }

  return el("div", { class: "writer" }, el("div", { class: "row" }, list, value, write), said);
}
