"use strict";
(() => {
  const data = JSON.parse(document.getElementById("figures").textContent);
  const figures = [...document.querySelectorAll("[data-figure]")];
  const zoomed = figures.filter(figure => figure.querySelector("[data-zoom]"));
  const SVG = "http://www.w3.org/2000/svg";
  const STEPS = [1, 2, 2.5, 5, 10];
  const LEAST = 0.002;
  let view = [0, 1];

  const px = value => String(Math.round(value * 10) / 10);
  const plain = (value, digits) => (value == null ? "–" : String(+value.toPrecision(digits)).replace("-", "−"));
  const axisOf = svg => JSON.parse(svg.dataset.axis);

  // The selected part of the time axis, the same in every figure over time.
  function show([low, high]) {
    const span = Math.min(1, Math.max(LEAST, high - low));
    const start = Math.min(Math.max(0, low), 1 - span);
    view = [start, start + span];
    for (const figure of zoomed) {
      for (const svg of figure.querySelectorAll("svg.drawn")) place(svg);
      const whole = span >= 1;
      for (const [name, off] of [["out", whole], ["left", start <= 0], ["right", start + span >= 1], ["reset", whole]])
        figure.querySelector(`[data-zoom=${name}]`).setAttribute("aria-disabled", String(off));
      figure.classList.toggle("enlarged", !whole);
    }
  }

  function place(svg) {
    const axis = axisOf(svg), [from, to] = view;
    for (const area of svg.querySelectorAll("svg.area"))
      area.setAttribute("viewBox", `${from * 1000} 0 ${(to - from) * 1000} 1000`);
    const low = axis.low + from * (axis.high - axis.low), high = axis.low + to * (axis.high - axis.low);
    const at = value => axis.left + (value - low) / (high - low) * axis.width;
    const [ticks, decimals] = round(low, high, Math.max(2, Math.min(6, Math.floor(axis.width / 80))));
    const group = svg.querySelector(".xticks");
    group.replaceChildren(...ticks.map(value => {
      const text = document.createElementNS(SVG, "text");
      for (const [key, own] of [["x", px(at(value))], ["y", axis.tick], ["text-anchor", "middle"], ["class", "f-tick"]])
        text.setAttribute(key, own);
      text.textContent = value.toFixed(decimals).replace("-", "−");
      return text;
    }));
    svg.querySelectorAll(".xmark").forEach(mark => mark.remove());
    for (const value of ticks) {
      const line = document.createElementNS(SVG, "line");
      for (const [key, own] of [["x1", px(at(value))], ["x2", px(at(value))], ["y1", axis.bottom], ["y2", axis.bottom + 4],
        ["class", "f-axis xmark"]]) line.setAttribute(key, own);
      group.before(line);
    }
    const labels = [...svg.querySelectorAll(".f-run-label")];
    labels.forEach(label => { label.dataset.at ??= (label.getAttribute("x") - axis.left) / axis.width; });
    const shares = labels.map(label => (label.dataset.at - from) / (to - from));
    labels.forEach((label, n) => {
      // The run at the left edge keeps its name there.
      const next = shares[n + 1] ?? 1.1, share = shares[n] < 0 && next > 0.25 ? 0 : shares[n];
      label.setAttribute("x", px(axis.left + share * axis.width));
      label.style.display = share < 0 || share > 0.95 ? "none" : "";
    });
  }

  function round(low, high, count) {
    return [1, 2, 3].map(more => even(low, high, more * count)).find(found => found[0].length >= 3);
  }

  function even(low, high, count) {
    const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * STEPS.find(one => power * one >= rough * (1 - 1e-9));
    const ticks = [];
    for (let n = Math.ceil(low / step - 1e-9); n <= Math.floor(high / step + 1e-9); n++) ticks.push(n * step + 0);
    let decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const scaled = step * 10 ** decimals;
    if (Math.abs(scaled - Math.round(scaled)) > 1e-6) decimals += 1;
    return [ticks, decimals];
  }

  function zoom(kind) {
    const [low, high] = view, span = high - low, middle = (low + high) / 2;
    if (kind === "in") show([middle - span / 4, middle + span / 4]);
    if (kind === "out") show([middle - span, middle + span]);
    if (kind === "left") show([low - span / 2, low + span / 2]);
    if (kind === "right") show([low + span / 2, high + span / 2]);
    if (kind === "reset") show([0, 1]);
  }

  // Drag to select, double click to reset; a cursor with the values of the nearest sample.
  function listen(figure) {
    const able = zoomed.includes(figure), part = () => (able ? view : [0, 1]);
    const canvas = figure.querySelector(".canvas"), table = data.figures[figure.dataset.figure];
    const tip = document.createElement("div"), band = document.createElement("div");
    tip.className = "tip";
    band.className = "selection";
    tip.hidden = band.hidden = true;
    canvas.append(band, tip);
    let start = null;
    const shown = () => [...canvas.querySelectorAll("svg.drawn")].find(svg => svg.clientWidth);
    const shareAt = event => {
      const svg = shown(), axis = axisOf(svg), box = svg.getBoundingClientRect();
      const scale = box.width / svg.viewBox.baseVal.width;
      return [Math.min(1, Math.max(0, ((event.clientX - box.left) / scale - axis.left) / axis.width)), axis, scale, svg];
    };
    const across = (share, axis, scale) => (axis.left + share * axis.width) * scale;
    canvas.addEventListener("pointerdown", event => {
      if (!able || event.button || event.pointerType === "touch") return;
      [start] = shareAt(event);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", event => {
      const [share, axis, scale, svg] = shareAt(event);
      const [low, high] = part();
      const value = axis.low + (low + share * (high - low)) * (axis.high - axis.low);
      readout(table, tip, value);
      tip.style.top = `${axis.top * scale}px`;
      const right = share > 0.5;
      tip.style.left = right ? "" : `${across(share, axis, scale) + 12}px`;
      tip.style.right = right ? `${svg.clientWidth - across(share, axis, scale) + 12}px` : "";
      const from = start ?? share;
      band.hidden = false;
      band.style.left = `${across(Math.min(from, share), axis, scale)}px`;
      band.style.width = `${Math.abs(across(share, axis, scale) - across(from, axis, scale))}px`;
      band.style.top = `${axis.top * scale}px`;
      band.style.height = `${(axis.bottom - axis.top) * scale}px`;
    });
    canvas.addEventListener("pointerup", event => {
      if (start === null) return;
      const [end] = shareAt(event), [low, high] = view, span = high - low;
      if (Math.abs(end - start) > 0.01) show([low + Math.min(start, end) * span, low + Math.max(start, end) * span]);
      start = null;
    });
    canvas.addEventListener("pointerleave", () => { tip.hidden = band.hidden = true; });
    canvas.addEventListener("pointercancel", () => { start = null; });
    if (!able) return;
    canvas.addEventListener("dblclick", () => show([0, 1]));
    canvas.tabIndex = 0;
    canvas.setAttribute("aria-label", "Enlarge with + and −, move with the arrow keys, 0 shows the whole time");
    canvas.addEventListener("keydown", event => {
      const kind = { "+": "in", "=": "in", "-": "out", "−": "out", ArrowLeft: "left", ArrowRight: "right", 0: "reset", Escape: "reset" }[event.key];
      if (!kind || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      zoom(kind);
    });
  }

  function readout(table, tip, value) {
    const counted = table.head[0] === "pose", at = table.words.length ? 1 : 0;
    const x = counted ? table.columns[0].map(one => one + 1) : table.columns[at];
    let best = 0;
    for (let n = 1; n < x.length; n++) if (Math.abs(x[n] - value) < Math.abs(x[best] - value)) best = n;
    const lines = table.head.map((name, n) => {
      const own = table.columns[n][best];
      if (n < at) return table.words[own];
      const [, text, unit] = name.match(/^(.*?)(?: \[(.*)\])?$/);
      return `${text} ${plain(own, 4)}${unit ? " " + unit : ""}`;
    });
    tip.textContent = lines.join("\n");
    tip.hidden = false;
  }

  // A figure as a file of its own: px and colours of the light theme as attributes.
  function standalone(figure) {
    const svg = figure.querySelector("svg.at-wide").cloneNode(true);
    const box = figure.querySelector("svg.at-wide").viewBox.baseVal;
    const source = data.figures[figure.dataset.figure].source;
    const height = box.height + (source ? 20 : 0);
    const label = svg.getAttribute("aria-label");
    for (const name of ["style", "class", "data-axis", "aria-label"]) svg.removeAttribute(name);
    svg.setAttribute("xmlns", SVG);
    svg.setAttribute("viewBox", `-12 -8 ${box.width + 24} ${height + 16}`);
    svg.setAttribute("width", box.width + 24);
    svg.setAttribute("height", height + 16);
    svg.setAttribute("font-family", "Inter, system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif");
    svg.querySelectorAll("svg.area").forEach((area, n) => svg.replaceChild(flat(area, `clip-${n}`), area));
    const ground = document.createElementNS(SVG, "rect");
    for (const [key, own] of [["x", -12], ["y", -8], ["width", box.width + 24], ["height", height + 16], ["class", "f-ground"]])
      ground.setAttribute(key, own);
    const title = document.createElementNS(SVG, "title");
    title.textContent = label;
    svg.prepend(title, ground);
    if (source) {
      const text = document.createElementNS(SVG, "text");
      for (const [key, own] of [["x", 0], ["y", box.height + 14], ["class", "f-source"]]) text.setAttribute(key, own);
      text.textContent = source.length > 110 ? source.slice(0, 109) + "…" : source;
      svg.append(text);
    }
    for (const one of svg.querySelectorAll("[class]")) {
      const name = one.getAttribute("class").split(" ")[0];
      for (const [key, own] of Object.entries(data.styles[name] || {})) one.setAttribute(key, own);
      one.removeAttribute("class");
      one.removeAttribute("data-at");
    }
    return [new XMLSerializer().serializeToString(svg), box.width + 24, height + 16];
  }

  function flat(area, id) {
    const [x, y, width, height] = ["x", "y", "width", "height"].map(name => +area.getAttribute(name));
    const [from, , span] = area.getAttribute("viewBox").split(" ").map(Number);
    const clip = document.createElementNS(SVG, "clipPath"), frame = document.createElementNS(SVG, "rect");
    const group = document.createElementNS(SVG, "g"), whole = document.createElementNS(SVG, "g");
    for (const [key, own] of Object.entries({ x, y, width, height })) frame.setAttribute(key, own);
    clip.id = id;
    clip.append(frame);
    const marks = document.getElementById(area.querySelector("use").getAttribute("href").slice(1));
    for (const path of marks.children) {
      const own = path.cloneNode();
      own.setAttribute("d", path.getAttribute("d").replace(/(-?[\d.]+) (-?[\d.]+)/g,
        (_, a, b) => `${px(x + (a - from) / span * width)} ${px(y + b / 1000 * height)}`));
      group.append(own);
    }
    group.setAttribute("clip-path", `url(#${id})`);
    whole.append(clip, group);
    return whole;
  }

  function csv(table) {
    const quoted = text => {
      const safe = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
      return /[",\n\r]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
    };
    const lines = [table.head.map(quoted)];
    for (let n = 0; n < table.columns[0].length; n++)
      lines.push(table.columns.map((column, at) =>
        (at === 0 && table.words.length ? quoted(table.words[column[n]]) : column[n] ?? "")));
    return lines.map(line => line.join(",")).join("\n") + "\n";
  }

  function save(name, content, type) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  function savePng(figure, name) {
    const [text, width, height] = standalone(figure), image = new Image();
    const url = URL.createObjectURL(new Blob([text], { type: "image/svg+xml" }));
    image.onload = () => {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [2 * width, 2 * height];
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      URL.revokeObjectURL(url);
      canvas.toBlob(content => save(name, content), "image/png");
    };
    image.src = url;
  }

  for (const figure of figures) {
    const id = figure.dataset.figure, table = data.figures[id];
    figure.querySelector(".tools").hidden = false;
    figure.querySelectorAll("[data-zoom]").forEach(button =>
      button.addEventListener("click", () => zoom(button.dataset.zoom)));
    figure.querySelectorAll("[data-save]").forEach(button => button.addEventListener("click", () => {
      const kind = button.dataset.save;
      if (kind === "csv") save(`${id}.csv`, csv(table), "text/csv");
      if (kind === "svg") save(`${id}.svg`, standalone(figure)[0], "image/svg+xml");
      if (kind === "png") savePng(figure, `${id}.png`);
    }));
  }
  const named = figures.filter(figure => data.figures[figure.dataset.figure].head[0] === "pose");
  [...zoomed, ...named].forEach(listen);
  if (zoomed.length) show(view);
  // What is folded is printed where it holds a figure.
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = [...document.querySelectorAll("details:not([open])")].filter(one => one.querySelector("[data-figure]"));
    opened.forEach(one => { one.open = true; });
  });
  addEventListener("afterprint", () => opened.forEach(one => { one.open = false; }));
})();
