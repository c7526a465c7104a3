// A winch as a picture: drum, its turns and layers, guide and pulleys to scale; the distances between
// them are not in the profile, hence schematic. Length has its own axis, with the limits hatched.
import { el, fill, number, svg } from "./page.js";

const MOVING = 0.0005;
const arrow = (speed) => (speed > MOVING ? 1 : speed < -MOVING ? -1 : 0);

export function words(state, tripped) {
  if (tripped) return "tripped";
  if (state.phase === "moving") return state.cable_speed > MOVING ? "paying out" : state.cable_speed < -MOVING ? "winding in" : "at rest";
  return { disabled: "at rest", enabling: "enabling", "running down": "ramping", stopping: "stopping", resetting: "resetting" }[state.phase] || state.phase;
}

// Point where a cable leaves a wheel and where it meets the next one, both on its left side.
function tangent([ax, ay], ra, [bx, by], rb) {
  const dx = bx - ax, dy = by - ay, far = Math.hypot(dx, dy) || 1, sine = Math.max(-1, Math.min(1, (ra - rb) / far)), cosine = Math.sqrt(1 - sine * sine);
  const n = [(dy / far) * cosine + (dx / far) * sine, (-dx / far) * cosine + (dy / far) * sine];
  return [[ax + ra * n[0], ay + ra * n[1]], [bx + rb * n[0], by + rb * n[1]]];
}

export function picture(name, own, state, drum, tripped) {
  const limits = own.limits.length || [0, Math.max(1, state.cable_length || 1)], rim = own.drum.flange_radius || 1.25 * own.drum_radius;
  const scale = Math.min(72 / Math.max(rim, drum.radius || 0), ...own.pulleys.map((p) => 36 / p.radius)), r0 = own.drum_radius * scale, wound = Math.max(r0, (drum.radius || own.drum_radius) * scale);
  const most = limits[1] * 1.06, y = (length) => 60 + (Math.max(0, Math.min(most, length)) / most) * 350, at = Math.round(10 * y(state.cable_length || 0)) / 10, centre = [100, 260];
  const places = own.pulleys.length > 1 ? [[150, 92], [252, 122]] : [[212, 92]], wheels = own.pulleys.slice(0, 2).map((p, i) => ({ at: places[i], r: p.radius * scale, wrap: p.wrap }));
  const narrow = matchMedia("(max-width: 699px)").matches, size = narrow ? 16 : 12, parts = [];
  const text = (x, top, content, more = {}) => svg("text", { x, y: top, fill: "var(--muted)", ...more }, content);
  for (const wheel of wheels) parts.push(svg("circle", { cx: wheel.at[0], cy: wheel.at[1], r: wheel.r, fill: "var(--sunk)", stroke: "var(--edge)" }), svg("circle", { cx: wheel.at[0], cy: wheel.at[1], r: 3.5, fill: "var(--ink2)" }),
    text(wheel.at[0] + (wheel === wheels.at(-1) && wheels.length > 1 ? 24 : 0), wheel.at[1] - wheel.r - 10, `wrap ${number((wheel.wrap * 180) / Math.PI, 3)}°`, { "text-anchor": "middle" }));
  // The drum: flange, core, a ring for each layer.
  const layers = own.drum.kind === "grooved" ? (drum.turns > 0 ? 1 : 0) : Math.min(14, Math.floor(drum.turns || 0) + 1), [cx, cy] = centre;
  if (own.drum.flange_radius) parts.push(svg("circle", { cx, cy, r: rim * scale, fill: "none", stroke: "var(--edge)", "stroke-dasharray": "2 3" }));
  parts.push(svg("circle", { cx, cy, r: r0, fill: "var(--sunk)", stroke: "var(--edge)" }));
  for (let k = 0; k < layers; k++) parts.push(svg("circle", { cx, cy, r: layers > 1 ? r0 + ((wound - r0) * k) / (layers - 1) : wound, fill: "none", stroke: "var(--with)", "stroke-width": layers > 4 ? 1.5 : 3 }));
  const turn = (state.motor_angle || 0) / (own.ratio || 1), sense = arrow(-state.cable_speed);
  parts.push(svg("line", { x1: cx, y1: cy, x2: cx + 0.75 * r0 * Math.cos(turn), y2: cy - 0.75 * r0 * Math.sin(turn), stroke: "var(--ink2)", "stroke-width": 4 }), svg("circle", { cx, cy, r: 6, fill: "var(--ink2)" }));
  if (sense) { const q = 0.6 * r0, tip = cx + sense * q; parts.push(svg("path", { d: `M${cx - sense * q} ${cy + 6}A${q} ${q} 0 0 ${sense > 0 ? 0 : 1} ${tip} ${cy + 6}`, fill: "none", stroke: "var(--ink)", "stroke-width": 1.6 }), svg("path", { d: `M${tip - 5} ${cy + 9}L${tip} ${cy - 1}L${tip + 5} ${cy + 9}z`, fill: "var(--ink)" })); }
  // The cable over the pulleys to the load.
  const stops = [{ at: centre, r: wound }, ...wheels], last = stops.at(-1), xLoad = last.at[0] + last.r, load = Math.max(at, last.at[1] + 48), width = state.gross === null ? 1.5 : 1.5 + 3 * Math.min(1, Math.max(0, state.gross / (own.limits.tension[1] || 500)));
  let path = "";
  for (let i = 0; i + 1 < stops.length; i++) { const [from, to] = tangent(stops[i].at, stops[i].r, stops[i + 1].at, stops[i + 1].r); path += `${i ? `A${stops[i].r} ${stops[i].r} 0 0 1 ` : "M"}${from.join(" ")}L${to.join(" ")}`; }
  path += `${path ? `A${last.r} ${last.r} 0 0 1 ` : "M"}${xLoad} ${last.at[1]}V${load}`;
  const cut = last.at[1] + 22;
  parts.push(svg("path", { d: path, fill: "none", stroke: "var(--with)", "stroke-width": width, "data-tension": String(state.tension) }), svg("path", { d: `M${xLoad - 8} ${cut}l16 -5v7l-16 5z`, fill: "var(--surface)" }), svg("path", { d: `M${xLoad - 9} ${cut}l18 -6M${xLoad - 9} ${cut + 8}l18 -6`, stroke: "var(--ink2)", fill: "none" }));
  parts.push(svg("rect", { x: xLoad - 24, y: load, width: 48, height: 36, rx: 3, fill: "var(--ink2)" }), own.load_mass ? text(xLoad, load + 23, `${number(own.load_mass, 3)} kg`, { "text-anchor": "middle", fill: "var(--surface)", "font-weight": 600 }) : null,
    state.tension !== null ? text(xLoad - 12, load - 12, `${state.tension.toFixed(1)} N`, { "text-anchor": "end", fill: "var(--with)", "font-weight": 600, "font-size": size + 2 }) : null);
  const run = arrow(state.cable_speed);
  if (run) parts.push(svg("path", { d: `M${xLoad - 40} ${load + 18 - run * 14}v${run * 28}m-5 ${-run * 6}l5 ${run * 6}l5 ${-run * 6}`, fill: "none", stroke: "var(--ink)", "stroke-width": 1.6 }));
  // The drum from the side: its turns beside each other, or the layers of one turn; the guide.
  const under = cy + Math.max(rim * scale, wound) + 6 + size, row = size + 4;
  parts.push(text(cx, under, `Drum ${name}`, { "text-anchor": "middle", "font-weight": 600, fill: "var(--ink)" }), text(cx, under + row, drum.turns === null ? "turns not known" : `${drum.turns.toFixed(1)} turns wound${layers > 1 ? `, layer ${layers}` : ""}`, { "text-anchor": "middle", fill: "var(--ink2)" }),
    text(cx, under + 2 * row, `winding radius ${number((drum.radius || own.drum_radius) * 1000, 3)} mm`, { "text-anchor": "middle" }));
  if (own.drum.kind === "grooved" && drum.turns !== null) {
    const whole = own.drum.turns || Math.max(1, Math.ceil(drum.turns * 1.2)), w = own.drum.width ? Math.min(180, own.drum.width * scale) : 120, x0 = cx - w / 2, top = under + 2 * row + 10;
    parts.push(svg("rect", { x: x0, y: top, width: w, height: 14, fill: "var(--sunk)", stroke: "var(--edge)" }), svg("rect", { x: x0, y: top, width: w * Math.min(1, drum.turns / whole), height: 14, fill: "var(--with)", opacity: 0.75 }));
    for (let k = 1; k < Math.min(60, whole); k++) parts.push(svg("line", { x1: x0 + (w * k) / whole, x2: x0 + (w * k) / whole, y1: top, y2: top + 14, stroke: "var(--surface)" }));
    if (drum.guide !== null && own.drum.width) parts.push(svg("path", { d: `M${x0 + w * Math.max(0, Math.min(1, drum.guide / own.drum.width))} ${top - 1}l-5 -8h10z`, fill: "var(--ink)" }), text(x0 + w + 6, top + 11, "guide"));
  } else if (own.guide) parts.push(text(cx, under + 3 * row, `guide ${drum.guide === null ? "" : `at ${number(drum.guide * 1000, 3)} mm`}`, { "text-anchor": "middle" }));
  // The axis of the length.
  const gx = 352;
  parts.push(svg("rect", { x: gx, y: y(0), width: 12, height: y(most) - y(0), fill: "var(--band)" }), svg("rect", { x: gx, y: y(0), width: 12, height: y(limits[0]) - y(0), fill: "url(#hatch)" }), svg("rect", { x: gx, y: y(limits[1]), width: 12, height: y(most) - y(limits[1]), fill: "url(#hatch)" }));
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50].find((s) => most / s <= 7) || 100;
  for (let k = 0; k * step <= most; k++) parts.push(svg("line", { x1: gx + 12, x2: gx + 17, y1: y(k * step), y2: y(k * step), stroke: "var(--edge)" }), limits.every((limit) => Math.abs(y(limit) - y(k * step)) > size + 2) ? text(gx + 21, y(k * step) + 4, k ? number(k * step) : "0 m") : null);
  for (const limit of limits) parts.push(text(narrow ? 458 : gx + 48, y(limit) + 4, `limit ${number(limit, 3)}`, { fill: "var(--ink2)", "text-anchor": narrow ? "end" : "start" }));
  parts.push(svg("path", { d: `M${gx - 12} ${at - 6}l9 6l-9 6z`, fill: "var(--ink)" }), svg("line", { x1: gx - 3, x2: gx + 14, y1: at, y2: at, stroke: "var(--ink)", "stroke-width": 2 }));
  parts.push(svg("path", { d: `M20 450v-5m0 2.5h${0.1 * scale}m0 -2.5v5`, stroke: "var(--ink2)", fill: "none" }), text(28 + 0.1 * scale, 452, narrow ? "100 mm at drum and pulleys" : "100 mm, drum and pulleys; distances schematic"));
  return svg("svg", { viewBox: "0 26 460 434", width: "100%", "font-size": size, role: "img", "aria-label": `Winch ${name}: ${words(state, tripped)}, ${lengthOf(state)}, ${state.tension === null ? "no tension" : `${number(state.tension, 4)} N`}` }, parts.filter(Boolean));
}

// Cable length in words.
export const lengthOf = (state) => state.length_known === false ? "length unknown" : `${number(state.cable_length)} m`;

// A card of one winch among several: a small picture, state and values; a click enlarges it.
export function card(name, own, state, drum, tripped, chosen, choose) {
  const limits = own.limits.length || [0, 5], most = limits[1] * 1.06, x = (v, top) => `${Math.max(0, Math.min(100, (v / top) * 100)).toFixed(1)}%`, high = own.limits.tension[1] || 500;
  const bar = (value, top, [low, up], unit, digits, at = value) => el("span", { class: "bar" }, svg("svg", { width: "100%", height: 10, "aria-hidden": "true" }, svg("rect", { y: 3, width: "100%", height: 5, fill: "var(--band)" }),
    low ? svg("rect", { y: 2, width: x(low, top), height: 7, fill: "url(#hatch)" }) : null, up ? svg("rect", { x: x(up, top), y: 2, width: `${100 - parseFloat(x(up, top))}%`, height: 7, fill: "url(#hatch)" }) : null,
    at === null ? null : svg("rect", { x: `calc(${x(at, top)} - 1px)`, width: 2, height: 10, fill: "var(--ink)" })), el("b", {}, value === null ? "–" : value.toFixed(digits).replace("-", "−"), el("small", {}, ` ${unit}`)));
  const full = own.drum.turns || Math.max(1, drum.turns || 1), share = Math.max(0, Math.min(1, (drum.turns || 0) / full));
  return el("button", { class: `winch ${chosen ? "chosen" : ""}`, "aria-pressed": String(chosen), onclick: choose },
    svg("svg", { viewBox: "0 0 40 40", width: 40, height: 40, "aria-hidden": "true" }, svg("circle", { cx: 20, cy: 20, r: 18, fill: "var(--sunk)", stroke: "var(--edge)" }), svg("circle", { cx: 20, cy: 20, r: 10 + 7 * share, fill: "none", stroke: "var(--with)", "stroke-width": 2 }),
      svg("line", { x1: 20, y1: 20, x2: 20 + 10 * Math.cos((state.motor_angle || 0) / (own.ratio || 1)), y2: 20 - 10 * Math.sin((state.motor_angle || 0) / (own.ratio || 1)), stroke: "var(--ink2)", "stroke-width": 3 })),
    el("span", { class: "name" }, el("b", {}, name), el("span", { class: tripped ? "state tripped" : arrow(state.cable_speed) ? "state moving" : "state" }, words(state, tripped)), state.commander ? el("small", {}, `by ${state.commander}`) : null),
    el("span", { class: "bars" }, state.length_known === false ? el("small", {}, lengthOf(state)) : bar(state.cable_length, most, limits, "m", 3), bar(state.tension, high * 1.05, own.limits.tension, "N", 0, state.gross), el("small", {}, `${state.cable_speed === null ? "–" : (-state.cable_speed).toFixed(3).replace("-", "−")} m/s`)));
}
