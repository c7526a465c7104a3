// Times between the cycles of the bench's control as a histogram: a bar for each tenth of the period.
import { el, fill, number, svg } from "./page.js";

const WIDTH = 640, HEIGHT = 320, LEFT = 56, BOTTOM = 280, TOP = 12;

export function cycles(host, { period, counts }, overruns) {
  const all = counts.reduce((a, b) => a + b, 0), near = counts[9] + counts[10], decades = Math.max(1, Math.ceil(Math.log10(Math.max(...counts, 1) + 1)));
  const step = (WIDTH - LEFT - 24) / counts.length, x = (tenth) => LEFT + tenth * step, ms = (tenth) => number(tenth * period * 100, 3);
  const y = (count) => BOTTOM - (Math.log10(1 + count) / decades) * (BOTTOM - TOP), parts = [];
  for (let p = 0; p <= decades; p++) parts.push(svg("line", { x1: LEFT, x2: WIDTH - 24, y1: y(10 ** p - 1), y2: y(10 ** p - 1), stroke: "var(--line)" }), svg("text", { x: LEFT - 6, y: y(10 ** p - 1) + 4, "text-anchor": "end", fill: "var(--muted)" }, p ? number(10 ** p) : "0"));
  counts.forEach((count, i) => { if (count) parts.push(svg("rect", { x: x(i) + 1, y: y(count), width: step - 2, height: BOTTOM - y(count), fill: i === 9 || i === 10 ? "var(--with)" : "var(--today)" })); });
  for (let tenth = 0; tenth < counts.length - 1; tenth += 10) parts.push(svg("text", { x: x(tenth), y: BOTTOM + 18, "text-anchor": "middle", fill: "var(--muted)" }, tenth ? ms(tenth) : "0"));
  parts.push(svg("text", { x: WIDTH - 24, y: BOTTOM + 18, "text-anchor": "end", fill: "var(--muted)" }, `≥ ${ms(counts.length - 1)} ms`));
  const late = `${overruns} cycle${overruns === 1 ? "" : "s"} ended late`, words = `${all} cycles of ${ms(10)} ms: ${all ? number((100 * near) / all, 4) : "–"} % within a tenth of the period, ${counts.at(-1)} longer than ${ms(counts.length - 1)} ms; ${late}`;
  fill(host, el("p", { class: "note" }, words), svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, width: "100%", role: "img", "aria-label": words, "font-size": 12 }, parts));
}
