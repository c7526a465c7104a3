// Curves by uPlot with the page's colours: axis at the bottom, hairlines, zoom, pan, brush, export.
import { colour, el, number } from "./page.js";

const FONT = "12px Inter, system-ui, sans-serif", RIGHT = 10, LEAST_LEFT = 60;

// Ticks as text, the unit beside the last one whose text then still ends within the plot.
function label(u, ticks, unit, words) {
  const shown = ticks.map((tick) => (tick === null ? "" : words(tick))), { min, max, distr } = u.scales.x, at = (value) => (distr === 3 ? Math.log10(value) : value);
  const room = (tick) => RIGHT + ((at(max) - at(tick)) / (at(max) - at(min) || 1)) * (u.width - LEAST_LEFT - RIGHT);
  const last = shown.findLastIndex((text, i) => text !== "" && 3.3 * (text.length + 1 + unit.length) <= room(ticks[i]));
  return shown.map((text, index) => (index === last && unit ? `${text} ${unit}` : text));
}

// Of a logarithmic axis whole powers of ten, at most four.
function powers(low, high) {
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9), step = Math.max(1, Math.ceil((last - first + 1) / 4));
  return Array.from({ length: Math.max(0, Math.floor((last - first) / step) + 1) }, (_, i) => 10 ** (first + i * step));
}
const power = (tick) => tick >= 0.01 && tick <= 1000 ? number(tick) : `10${String(Math.round(Math.log10(tick))).replace(/./g, (c) => ({ "-": "⁻" })[c] || "⁰¹²³⁴⁵⁶⁷⁸⁹"[c])}`;

// Ticks with the decimals of their step; steps below 0.001 as powers of ten, which stay short.
function steps(ticks) {
  const known = ticks.filter((tick) => tick !== null), step = known.length > 1 ? Math.abs(known[1] - known[0]) : 1, exponent = Math.floor(Math.log10(step) + 1e-9), more = Math.abs((step / 10 ** exponent) % 1 - 0.5) < 0.01 ? 1 : 0; // steps of 2.5
  const least = exponent < -3 && Math.max(...known.map(Math.abs)) < 0.01, of = (tick) => (least && tick ? `${number(tick / 10 ** exponent, 3)}·${power(10 ** exponent)}` : String(Number(tick.toFixed(Math.max(0, more - exponent)))).replace("-", "−"));
  return ticks.map((tick) => (tick === null ? "" : of(tick)));
}

function axes(xLabel, logarithmic, flat, left) {
  const ink = () => colour("muted");
  return [
    { stroke: ink, font: FONT, size: 26, space: (u, axis, low, high, width) => Math.max(flat ? 34 : 64, width / 7), grid: { show: false }, ticks: { stroke: () => colour("line"), size: 4 }, gap: 4,
      ...(logarithmic ? { splits: (u, axis, low, high) => powers(low, high), filter: (u, ticks) => ticks } : {}), values: (u, ticks) => label(u, ticks, xLabel, logarithmic ? power : number) },
    { stroke: ink, font: FONT, size: left || ((u, ticks) => Math.max(flat ? 34 : 44, 14 + 7.5 * Math.max(0, ...(ticks || []).map((text) => text.length)))), space: flat ? (u) => Math.max(16, u.height / 6) : 34, grid: { stroke: () => colour("line"), width: 1 }, ticks: { show: false }, gap: 6,
      values: (u, ticks) => steps(ticks) },
  ];
}

// Noise band: filled, with an edge line.
function band(noise) {
  return (u) => {
    if (!noise) return;
    const { ctx, bbox } = u;
    const top = Math.max(bbox.top, u.valToPos(noise, "y", true)), bottom = Math.min(bbox.top + bbox.height, u.valToPos(-noise, "y", true));
    if (bottom <= top) return;
    ctx.save();
    ctx.fillStyle = colour("band");
    ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
    ctx.strokeStyle = colour("edge"); ctx.lineWidth = devicePixelRatio; ctx.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
    for (const y of [top, bottom]) { ctx.beginPath(); ctx.moveTo(bbox.left, y); ctx.lineTo(bbox.left + bbox.width, y); ctx.stroke(); }
    ctx.restore();
  };
}

function marks(runs) {
  return (u) => {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.strokeStyle = colour("edge"); ctx.fillStyle = colour("muted"); ctx.lineWidth = devicePixelRatio; ctx.setLineDash([1.5 * devicePixelRatio, 3 * devicePixelRatio]);
    ctx.font = `${12 * devicePixelRatio}px Inter, system-ui, sans-serif`;
    ctx.textAlign = "left"; ctx.textBaseline = "alphabetic";
    const right = bbox.left + bbox.width, gap = 3 * devicePixelRatio;
    const place = (at) => Math.max(bbox.left, Math.min(right, u.valToPos(at, "x", true))), ends = runs.map((run, i) => [place(run.at), i + 1 < runs.length ? place(runs[i + 1].at) : right]);
    for (const { at } of runs) {
      const x = u.valToPos(at, "x", true);
      if (x >= bbox.left - 1 && x <= right) { ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke(); }
    }
    for (const [i, words] of runTexts(runs, ends, 2 * gap, (text) => ctx.measureText(text).width)) ctx.fillText(words, ends[i][0] + gap, bbox.top - 5 * devicePixelRatio);
    ctx.restore();
  };
}

// The largest step between two bins over which a line of means is drawn.
export function widest(x) {
  const steps = x.slice(1).map((value, i) => value - x[i]).sort((a, b) => a - b);
  return 6 * (steps[Math.floor(steps.length / 2)] || 1) + 0.04 * (x.at(-1) - x[0]);
}

// The name of each labelled run where it has room, else its load: once for neighbours of one load, at last its number alone.
export function runTexts(runs, ends, gap, width) {
  const load = (run) => (/[\d.]+ k?[gN]$/.exec(run.name) || [""])[0], out = [];
  for (let i = 0; i < runs.length; i++) {
    const own = load(runs[i]), fits = (text, last) => text && width(text) < ends[last][1] - ends[i][0] - gap;
    let last = i;
    if (!runs[i].labelled) continue;
    if (!fits(runs[i].name, i) && !fits(own, i)) while (own && runs[last + 1] && load(runs[last + 1]) === own) last += 1;
    const words = [runs[i].name, own, own.split(" ")[0]].find((text, k) => fits(text, k ? last : i));
    if (words) out.push([i, words]);
    i = last;
  }
  return out;
}

// Means over bins as lines, broken where no sample lies between two bins; `timed` ones, in the order
// of time, are broken where a value is missing.
function traced(traces) {
  return (u) => {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
    for (const { x, y, tone, width, timed } of traces) {
      const wide = timed || u.scales.x.distr === 3 ? Infinity : widest(x);
      ctx.strokeStyle = colour(tone); ctx.lineWidth = width * devicePixelRatio; ctx.lineJoin = "round";
      ctx.beginPath();
      let pen = false;
      x.forEach((value, i) => {
        if (value === null || y[i] === null) { pen = false; return; }
        const at = [u.valToPos(value, "x", true), u.valToPos(y[i], "y", true)];
        if (!pen || value - x[i - 1] > wide) ctx.moveTo(...at); else ctx.lineTo(...at);
        pen = true;
      });
      ctx.stroke();
    }
    ctx.restore();
  };
}

export function dots(tone, alpha, size = 3) {
  return (u, index, from, to) => {
    const { ctx } = u, half = (size * devicePixelRatio) / 2;
    ctx.save();
    ctx.fillStyle = colour(tone); ctx.globalAlpha = alpha;
    const [xs, ys] = [u.data[0], u.data[index]];
    for (let i = from; i <= to; i++) {
      if (ys[i] === null || ys[i] === undefined) continue;
      ctx.fillRect(u.valToPos(xs[i], "x", true) - half, u.valToPos(ys[i], "y", true) - half, 2 * half, 2 * half);
    }
    ctx.restore();
    return null;
  };
}

// y ranges that are kept, by the plot's label: they outlive its drawing.
const held = new Map(), drawnIn = new WeakMap();
const labelOf = (host) => host.getAttribute("aria-label");
// The y range that a plot shows.
export function seenRange(host) { const u = host && drawnIn.get(host); return u ? [u.scales.y.min, u.scales.y.max] : null; }
export function holds(host) { const { min, max } = drawnIn.get(host).scales.y; held.set(labelOf(host), [min, max]); }
export function freed(host) { held.delete(labelOf(host)); const u = drawnIn.get(host), { min, max } = u.scales.x; u.setData(u.data, false); u.setScale("x", { min, max }); }

// Beside the pointer: the place, the value of each of `names` there, and the run; `traces` by their bins.
function readout(box, { xLabel, names, unit, runs, traces }) {
  const nearest = (xs, x) => xs.reduce((best, value, i) => (Math.abs(value - x) < Math.abs(xs[best] - x) ? i : best), 0);
  return (u) => {
    const { left, idx } = u.cursor, inside = left >= 0 && idx !== null && idx !== undefined;
    box.hidden = !inside;
    if (!inside) return;
    const x = u.data[0][idx], run = runs.findLast((one) => one.at <= x);
    const values = [...names.map((name, i) => [name, (u.data[i + 1] || [])[idx], u.series[i + 1].show]), ...traces.filter(({ name }) => name).map(({ name, x: xs, y }) => [name, y[nearest(xs, x)], true])];
    box.textContent = [`${number(x, 5)} ${xLabel}`, ...values.filter(([, value, shown]) => shown && value !== null && value !== undefined).map(([name, value]) => `${name} ${number(value, 5)} ${unit}`), run ? run.name : ""].filter(Boolean).join(" · ");
    box.style.cssText = left < u.over.clientWidth / 2 ? "right: 10px" : `left: ${u.over.offsetLeft + 4}px`;
  };
}

// A drawing with the read-out of the mark that is nearest to the pointer; `marks` are [x, y, words].
export function readable({ node, marks }) {
  const shown = el("div", { class: "readout", style: { right: "4px" }, hidden: true });
  const far = ([x, y], at) => Math.hypot(x - at.x, y - at.y);
  node.addEventListener("pointermove", (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(node.getScreenCTM().inverse());
    shown.hidden = !marks.length;
    if (marks.length) shown.textContent = marks.reduce((best, mark) => (far(mark, at) < far(best, at) ? mark : best))[2];
  });
  node.addEventListener("pointerleave", () => { shown.hidden = true; });
  return el("div", { class: "plot" }, node, shown);
}

// One plot; `names` of its series and their `unit` are for the read-out.
export function plot(host, data, series, { names = [], unit = "", height, xLabel = "", xUnit = "", noise = null, runs = [], traces = [], top = 8, select = null, zoom = null, sync = null, range = null, xRange = null, logarithmic = false, bare = false, left = 0, label }) {
  const drag = { x: Boolean(select || zoom), y: false, setScale: false };
  const flat = height < 150, shown = el("div", { class: "readout", hidden: true });
  const chosen = (u) => {
    if (u.select.width < 3) return;
    const low = u.posToVal(u.select.left, "x"), high = u.posToVal(u.select.left + u.select.width, "x");
    if (select) select(low, high); else if (zoom) { u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false); zoom(low, high); }
  };
  const options = {
    width: Math.max(120, host.clientWidth), height, legend: { show: false }, padding: [top, RIGHT, bare ? 8 : 0, 0],
    cursor: { drag, points: { show: false }, ...(sync ? { sync: { key: sync } } : {}), y: false },
    scales: { x: { time: false, ...(xRange ? { range: () => xRange } : {}), ...(logarithmic ? { distr: 3 } : {}) }, y: { range: (u, low, high) => held.get(label) || (range ? range(u, low, high) : low === null ? [null, null] : uPlot.rangeNum(low, high, 0.1, true)) } },
    axes: axes(xLabel, logarithmic, flat, left).map((axis, i) => (bare && i === 0 ? { ...axis, show: false } : axis)), series: [{}, ...series],
    hooks: {
      drawClear: [band(noise)], draw: [marks(runs), traced(traces)],
      setSelect: [(u) => chosen(u)], setCursor: [readout(shown, { xLabel: xLabel || xUnit || (bare ? "s" : ""), names, unit, runs, traces })],
    },
  };
  host.setAttribute("role", "img");
  host.setAttribute("aria-label", label);
  host.replaceChildren();
  const drawn = new uPlot(options, data, host);
  host.append(shown);
  drawnIn.set(host, drawn);
  if (zoom) gestures(drawn, zoom);
  if (select || zoom) touched(drawn, chosen);
  if (select) typed(host, drawn, chosen);
  new ResizeObserver(() => { if (host.isConnected && host.clientWidth > 0 && Math.abs(host.clientWidth - drawn.width) > 1) drawn.setSize({ width: host.clientWidth, height }); }).observe(host);
  return drawn;
}

// One finger that moves sideways selects; the page scrolls up and down as ever.
function touched(u, chosen) {
  const over = u.over;
  let start = null;
  const mark = (from, to) => u.setSelect({ left: Math.min(from, to), width: Math.abs(to - from), top: 0, height: over.clientHeight }, false);
  const at = (event) => Math.max(0, Math.min(over.clientWidth, event.touches[0].clientX - over.getBoundingClientRect().left));
  over.addEventListener("touchstart", (event) => { start = event.touches.length === 1 ? at(event) : null; }, { passive: true });
  over.addEventListener("touchmove", (event) => { if (start !== null && event.touches.length === 1) mark(start, at(event)); else start = null; }, { passive: true });
  over.addEventListener("touchend", () => { if (start !== null) chosen(u); start = null; });
  over.addEventListener("touchcancel", () => { start = null; mark(0, 0); });
}

// B selects the middle fifth of a focused plot; arrows move the selection, with Shift its end.
function typed(host, u, chosen) {
  host.setAttribute("tabindex", "0");
  host.addEventListener("keydown", (event) => {
    const wide = u.over.clientWidth, step = { ArrowLeft: -wide / 20, ArrowRight: wide / 20 }[event.key];
    let { left, width } = u.select;
    if (event.key === "b") [left, width] = [0.4 * wide, 0.2 * wide];
    else if (!step || width < 3) return;
    else if (event.shiftKey) width = Math.max(4, Math.min(wide - left, width + step));
    else left = Math.max(0, Math.min(wide - width, left + step));
    event.preventDefault(); event.stopPropagation();
    u.setSelect({ left, width, top: 0, height: u.over.clientHeight }, false);
    chosen(u);
  });
}

// Wheel and pinch zoom, Shift-drag and two fingers pan, double click resets.
function gestures(u, zoom) {
  const over = u.over;
  const scaled = (at, factor, shift = 0) => {
    const { min, max } = u.scales.x, centre = u.posToVal(at, "x");
    zoom(centre - (centre - min) * factor + shift, centre + (max - centre) * factor + shift);
  };
  over.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.altKey && Math.abs(event.deltaY) < Math.abs(event.deltaX)) return;
    event.preventDefault();
    scaled(event.offsetX, event.deltaY > 0 ? 1.25 : 0.8);
  }, { passive: false });
  over.addEventListener("dblclick", () => zoom(null, null));
  let fingers = null;
  over.addEventListener("touchmove", (event) => {
    if (event.touches.length !== 2) return;
    event.preventDefault();
    const box = over.getBoundingClientRect(), [a, b] = [event.touches[0].clientX - box.left, event.touches[1].clientX - box.left];
    const now = { middle: (a + b) / 2, span: Math.max(20, Math.abs(a - b)) };
    if (fingers) {
      const shift = u.posToVal(fingers.middle, "x") - u.posToVal(now.middle, "x");
      scaled(now.middle, fingers.span / now.span, shift);
    }
    fingers = now;
  }, { passive: false });
  over.addEventListener("touchend", () => { fingers = null; });
  over.addEventListener("mousedown", (event) => {
    if (!event.shiftKey) return;
    event.stopImmediatePropagation();
    let last = event.clientX;
    const move = (e) => {
      const { min, max } = u.scales.x, shift = ((last - e.clientX) / over.clientWidth) * (max - min);
      last = e.clientX;
      zoom(min + shift, max + shift);
    };
    addEventListener("mousemove", move);
    addEventListener("mouseup", () => removeEventListener("mousemove", move), { once: true });
  }, true);
}

export const line = (tone, width, alpha = 1, more = {}) => ({ stroke: () => colour(tone), width, alpha, points: { show: false }, spanGaps: false, ...more });

export function legend(...items) {
  return el("div", { class: "legend" }, items.map(([tone, words, box]) => el("span", {}, el("i", { class: box ? "box" : "", style: { background: `var(--${tone})` } }), words)));
}

// Values in the order of x, without those that have none.
export function sorted(x, ...others) {
  const index = x.map((_, i) => i).filter((i) => x[i] !== null).sort((a, b) => x[a] - x[b]);
  return { index, columns: [x, ...others].map((values) => index.map((i) => values[i])) };
}

export const unitOf = (label) => (/\[(.+)\]$/.exec(label) || ["", ""])[1];
// Range about zero for all but the largest 0.5 %.
export function sym(values) {
  const sizes = values.filter((v) => v !== null).map(Math.abs).sort((a, b) => a - b), top = 1.15 * (sizes[Math.floor(0.995 * (sizes.length - 1))] || 1);
  return () => [-top, top];
}
