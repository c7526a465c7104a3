// Objects of a winch's drive as a tree to read; the server reads them where the winch is disabled.
import { ask, el, fill } from "./page.js";

export async function objects(host, winch) {
  fill(host, el("p", { class: "note" }, "Reading the drive"));
  const again = el("button", { onclick: () => objects(host, winch) }, "Read again");
  try {
    const { groups } = await ask(`/api/bench/objects?winch=${encodeURIComponent(winch)}`);
    fill(host, groups.map(({ name, rows }, i) => el("details", { open: i < 2 }, el("summary", {}, name),
      el("table", {}, el("tbody", {}, rows.map(([object, what, value]) => el("tr", {}, el("td", { class: "tight" }, el("code", {}, object)), el("td", {}, what), el("td", { class: "number" }, String(value)))))))), again);
  } catch (error) { fill(host, el("p", {}, error.message), again); }
}
