// Exports of drawn figures: CSV of the values, SVG as drawn in the light theme, PNG at twice the size.
import { el, keep } from "./page.js";
import { freed, holds } from "./plots.js";

export const LIGHT = { surface: "#FFFFFF", ink: "#12161C", ink2: "#414B58", muted: "#5F6B79", line: "#DDE2E8", edge: "#858F9C", today: "#C2500F", with: "#0B4A8A", band: "#E4E8ED", brush: "#7B2FA8", rose: "#D6246E", tint: "#E9F1FB", action: "#1D4F91", stop: "#C5221A", ok: "#14693A", warn: "#805300", unknown: "#6A3A96" };

// `columns` are pairs of a name and its values; `source` says profile and runs when it is asked.
export function drawingExporter(name, title, node, source, columns) {
  return menu(name, (kind) => saved(kind, name, title, () => node, source(), columns));
}

// The one menu of a panel: its exports, and for `axes` whether its plots keep their y range.
export function menu(name, save, axes = false) {
  const plots = (box) => [...(box.closest("section") || document).querySelectorAll(".plot")];
  const act = ({ target }) => {
    const kind = target.value;
    target.value = "";
    if (kind === HOLD) plots(target).forEach(holds); else if (kind === FREE) plots(target).forEach(freed); else save(kind, plots(target));
  };
  return el("select", { class: "exports", "aria-label": `Save ${name}`, onchange: act }, el("option", { value: "" }, "Export…"), ["PNG", "SVG", "CSV"].map((kind) => el("option", {}, kind)),
    axes ? el("optgroup", { label: "y axis" }, [HOLD, FREE].map((words) => el("option", {}, words))) : null);
}
const HOLD = "Keep this range", FREE = "Fit to the values";

// Keeps a drawing, which `draw` makes, or its values.
export function saved(kind, name, title, draw, source, columns) {
  if (kind === "CSV") { keep(new Blob([table(title, source, columns)], { type: "text/csv" }), `${name}.csv`); return; }
  const { text, width, height } = standalone(title, draw(), source);
  if (kind === "SVG") { keep(new Blob([text], { type: "image/svg+xml" }), `${name}.svg`); return; }
  const image = new Image();
  image.onload = () => {
    const canvas = el("canvas", { width: 2 * width, height: 2 * height });
    canvas.getContext("2d").drawImage(image, 0, 0, 2 * width, 2 * height);
    canvas.toBlob((blob) => keep(blob, `${name}.png`));
  };
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
}

function table(title, source, columns) {
  const quoted = (value) => /[",\n]/.test(String(value)) ? `"${String(value).replaceAll('"', '""')}"` : String(value ?? "");
  const rows = Array.from({ length: Math.max(...columns.map(([, values]) => values.length)) }, (_, i) => columns.map(([, values]) => quoted(values[i] ?? "")).join(","));
  return `# ${title}\n# ${source}\n${columns.map(([head]) => quoted(head)).join(",")}\n${rows.join("\n")}\n`;
}

// A copy of the drawing on a white ground with title and source, and colours as numbers.
function standalone(title, node, source) {
  const [, , w, h] = node.getAttribute("viewBox").split(" ").map(Number), said = lines(source), [width, height] = [w + 32, h + 52 + 16 * said.length];
  const inner = new XMLSerializer().serializeToString(node).replace(/<svg[^>]*>/, `<g transform="translate(16 44)" font-size="${node.getAttribute("font-size") || 12}">`).replace(/<\/svg>$/, "</g>").replace(/var\(--([\w-]+)\)/g, (all, token) => LIGHT[token] || LIGHT.ink);
  const words = (text) => String(text).replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
  const text = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" font-family="Inter, system-ui, sans-serif"><rect width="${width}" height="${height}" fill="#fff"/><text x="16" y="26" font-size="14" font-weight="600" fill="${LIGHT.ink}">${words(title)}</text>${inner}${said.map((line, i) => `<text x="16" y="${height - 8 - 16 * (said.length - 1 - i)}" font-size="12" fill="${LIGHT.muted}">${words(line)}</text>`).join("")}</svg>`;
  return { text, width, height };
}

// A text in lines of at most 110 characters, broken between words.
function lines(text) {
  const out = [""];
  for (const word of text.split(" ")) { if (out.at(-1) && out.at(-1).length + word.length > 109) out.push(word); else out[out.length - 1] += `${out.at(-1) ? " " : ""}${word}`; }
  return out;
}
