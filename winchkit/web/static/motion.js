// Motion after an addition or its undoing: the rail of today's error slides, the residual changes, in
// 600 ms. Without motion the earlier rail stays dotted for 3 s.
import { svg } from "./page.js";

const TIME = 600, STAYS = 3000;
const still = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
const eased = (share) => 1 - (1 - share) ** 3;

// Calls `step` with the share of the motion, 0 to 1; then `end`.
function over(step, end = () => {}) {
  const start = performance.now();
  const frame = (now) => {
    const share = Math.min(1, Math.max(0, (now - start) / TIME));
    step(eased(share));
    if (share < 1) requestAnimationFrame(frame); else end();
  };
  step(0);
  requestAnimationFrame(frame);
}

// `before` is the earlier place of the rail, in percent, by the name in `data-output` of each drawing.
export function slideRails(box, before) {
  const moved = [...box.querySelectorAll("svg[data-output]")].flatMap((drawn) => {
    const from = before[drawn.dataset.output];
    return from === undefined ? [] : [...drawn.querySelectorAll("[data-rail]")].map((node) => ({ node, drawn, from, to: parseFloat(node.dataset.rail) }));
  }).filter((item) => Math.abs(item.from - item.to) > 0.2);
  if (!moved.length) return;
  if (still()) {
    for (const { node, drawn, from } of moved) if (node.tagName === "line" && node.getAttribute("class") === "rail") {
      const earlier = svg("line", { x1: `${from}%`, x2: `${from}%`, y1: node.getAttribute("y1"), y2: "100%", stroke: "var(--today)", "stroke-width": 2, "stroke-dasharray": "2 4", class: "earlier" });
      drawn.append(earlier);
      setTimeout(() => earlier.remove(), STAYS);
    }
    return;
  }
  over((share) => {
    for (const { node, from, to } of moved) for (const name of node.dataset.moves.split(" ")) node.setAttribute(name, `${from + (to - from) * share}%`);
  });
}

// Changes the values of a plot's first curve from an earlier curve over the same x.
export function morph(drawn, earlier, data) {
  const from = at(earlier.x, earlier.y, data[0]);
  if (still() || from.every((value) => value === null)) return;
  const { min, max } = drawn.scales.y, sizes = from.filter((value) => value !== null).map(Math.abs), top = sizes.reduce((a, b) => Math.max(a, b), 0);
  const held = [Math.min(min, -top), Math.max(max, top)];
  over((share) => {
    const values = data[1].map((value, i) => (value === null || from[i] === null ? value : from[i] + (value - from[i]) * share));
    drawn.batch(() => { drawn.setData([data[0], values, ...data.slice(2)], false); drawn.setScale("y", { min: held[0], max: held[1] }); });
  }, () => { if (drawn.root.isConnected) drawn.setData(data); });
}

// Values of a curve at other places, between its points; null outside and in gaps.
function at(x, y, places) {
  let i = 0;
  return places.map((place) => {
    while (i < x.length - 2 && x[i + 1] < place) i += 1;
    if (x.length < 2 || place < x[i] || place > x[i + 1] || y[i] === null || y[i + 1] === null) return null;
    return y[i] + ((y[i + 1] - y[i]) * (place - x[i])) / (x[i + 1] - x[i] || 1);
  });
}
