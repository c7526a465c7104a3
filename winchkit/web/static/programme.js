// The programme runner: choose one, see what it would do, hold a button to start it; its progress.
import { TONES } from "./channels.js";
import { ask, attempt, closeDialog, dialog, el, fill, number, svg } from "./page.js";

const HOLD = 800, SIGN = 100;
let signs = null, asked = 0;

// `start` orders it; the dialog leaves Stop free.
export function choose(start) {
  attempt(async () => {
    const { programmes } = await ask("/api/bench/programmes");
    const shown = el("div", { id: "preview" }), folder = el("input", { value: "runs", "aria-label": "Folder of the runs" });
    const list = el("select", { "aria-label": "Programme", onchange: () => preview(list.value) }, programmes.map((name) => el("option", {}, name)));
    const file = el("input", { type: "file", class: "visually-hidden", accept: ".toml", "aria-label": "Programme file", tabindex: -1, onchange: (event) => attempt(async () => {
      const own = event.target.files[0], { name } = await ask("/api/bench/programme", own, { "x-file-name": encodeURIComponent(own.name) });
      if (![...list.options].some((option) => option.value === name)) list.append(el("option", {}, name));
      list.value = name;
      preview(name);
    }) });
    dialog("Programme", el("div", { class: "row", style: { marginBottom: "12px" } }, list, file, el("button", { onclick: () => file.click() }, "Choose a file…"), el("label", { class: "label" }, "Runs into ", folder)), shown);
    if (programmes.length) preview(programmes[0]); else fill(shown, el("p", {}, "There is no programme in the folder of this page. Choose a file."));

    // Plans may be answered in another order than they were asked for; the last one counts.
    async function preview(name) {
      const mine = ++asked;
      fill(shown, el("p", { class: "note" }, "Planning"));
      try {
        const plan = await ask(`/api/bench/programme?name=${encodeURIComponent(name)}`);
        if (mine !== asked) return;
        fill(shown, el("p", {}, plan.description || plan.name), curves(plan), el("p", { class: "note" }, `${plan.repeats} run${plan.repeats === 1 ? "" : "s"} of ${number(plan.duration, 3)} s${plan.asks.length ? `, ${plan.asks.length} pause${plan.asks.length === 1 ? "" : "s"} for you` : ""}. It stops if you hide or close this page.`),
          el("details", {}, el("summary", {}, `${plan.steps.length} step${plan.steps.length === 1 ? "" : "s"}`), el("ol", {}, plan.steps.map((words) => el("li", {}, words)))), held("Hold to start", () => { closeDialog(); start(name, folder.value.trim() || "."); }));
      } catch (error) { if (mine === asked) fill(shown, el("p", {}, error.message)); }
    }
  });
}

// A button that acts after it was held; a release before, or another way to leave it, does nothing.
function held(words, act) {
  let timer = null;
  const button = el("button", { class: "primary hold" }, el("i", {}), words);
  const end = () => { clearTimeout(timer); timer = null; button.classList.remove("held"); };
  const begin = () => { if (timer) return; button.classList.add("held"); timer = setTimeout(() => { end(); act(); }, HOLD); };
  button.addEventListener("pointerdown", (event) => { if (event.button === 0) begin(); });
  for (const kind of ["pointerup", "pointerleave", "pointercancel", "blur"]) button.addEventListener(kind, end);
  button.addEventListener("keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); begin(); } });
  button.addEventListener("keyup", end);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  return button;
}

function curves(plan) {
  const names = Object.keys(plan.curves), width = 640, height = 220, left = 48, right = width - 96, bottom = 192, values = names.flatMap((name) => plan.curves[name]);
  const least = Math.min(...values), most = Math.max(...values), margin = 0.08 * (most - least || 1), low = least - margin, high = most + margin;
  const x = (t) => left + (t / (plan.duration || 1)) * (right - left), y = (v) => bottom - ((v - low) / (high - low)) * (bottom - 16), parts = [];
  for (let k = 0; k <= 4; k++) { const v = low + (k * (high - low)) / 4; parts.push(svg("line", { x1: left, x2: right, y1: y(v), y2: y(v), stroke: "var(--line)" }), svg("text", { x: left - 6, y: y(v) + 4, "text-anchor": "end", fill: "var(--muted)" }, number(v, 3))); }
  for (let k = 0; k <= 4; k++) parts.push(svg("text", { x: x((plan.duration * k) / 4), y: bottom + 18, "text-anchor": "middle", fill: "var(--muted)" }, `${number((plan.duration * k) / 4, 3)}${k === 4 ? " s" : ""}`));
  for (const [time] of plan.asks) parts.push(svg("line", { x1: x(time), x2: x(time), y1: 12, y2: bottom, stroke: "var(--edge)", "stroke-dasharray": "2 3" }), svg("text", { x: x(time) + 3, y: 12, fill: "var(--muted)" }, "?"));
  const same = names.every((name) => plan.curves[name].every((v, i) => v === plan.curves[names[0]][i]));
  (same ? names.slice(0, 1) : names).forEach((name, i) => parts.push(svg("path", { d: plan.time.map((t, k) => `${k ? "L" : "M"}${x(t).toFixed(1)} ${y(plan.curves[name][k]).toFixed(1)}`).join(""), fill: "none", stroke: `var(--${TONES[i % TONES.length]})`, "stroke-width": 1.8 }), svg("text", { x: right + 6, y: same ? y(plan.curves[name].at(-1)) + 4 : 24 + 15 * i, fill: `var(--${TONES[i % TONES.length]})` }, same && names.length > 1 ? "all winches" : name)));
  return svg("svg", { viewBox: `0 0 ${width} ${height}`, width: "100%", "font-size": 12, role: "img", "aria-label": `${plan.name}: ${names.join(", ")} in m over ${number(plan.duration, 3)} s` }, parts, svg("text", { x: 0, y: 12, fill: "var(--muted)" }, "m"));
}

// The programme under way: signs of life while this page is seen, progress, its questions, its end.
export function progress(host, now, send) {
  if (!now) { clearInterval(signs); signs = null; if (host.firstChild) { fill(host); delete host.dataset.text; } return; }
  if (now.ended) { clearInterval(signs); signs = null; } else if (!signs) signs = setInterval(() => { if (!document.hidden) send("programme"); }, SIGN);
  const text = JSON.stringify(now);
  if (host.dataset.text === text) return;
  host.dataset.text = text;
  if (now.ended) {
    fill(host, el("div", { class: `alert ${now.error ? "" : "done"}` }, el("div", {}, el("b", {}, `${now.name} ${now.error ? "ended early" : "is done"}`), el("p", {}, now.error || `${now.files.length} run${now.files.length === 1 ? "" : "s"}: ${now.files.map((path) => path.split("/").at(-1)).join(", ")}`)), el("button", { class: "plain", onclick: () => { fill(host); host.dataset.text = text; } }, "Close")));
    return;
  }
  // A button under the pointer stays the same element from step to step, so that no click is lost.
  if (!host.querySelector(".running")) fill(host, el("div", { class: "alert running", role: "status" }, el("div", {}, el("b", {}), el("span", {}), el("progress", { "aria-label": "Progress", max: 1 })), el("button", { class: "primary", hidden: true, onclick: () => send("answer_programme") }, "It is done"), el("button", { onclick: () => send("end_programme") }, "End programme")));
  const place = now.repeat ? `repeat ${now.repeat} of ${now.repeats}${now.steps ? `, step ${now.step} of ${now.steps}` : ""}` : "beginning";
  host.querySelector("b").textContent = now.name;
  host.querySelector("span").textContent = ` ${place}: ${now.asks ? `please ${now.asks}` : now.does}`;
  const bar = host.querySelector("progress");
  if (now.steps) bar.value = ((now.repeat ? now.repeat - 1 : 0) * now.steps + Math.max(0, now.step - 1)) / (now.repeats * now.steps); else bar.removeAttribute("value");
  host.querySelector(".primary").hidden = !now.asks;
}
