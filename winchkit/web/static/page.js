// What all views use: the server, elements, numbers, icons and the dialog.
const token = new URLSearchParams(location.search).get("token") || "";

export async function ask(path, body, headers = {}) {
  const options = { headers: { "x-winchkit-token": token, ...headers } };
  if (body !== undefined) { options.method = "POST"; options.body = body; }
  const text = await (await answered(path, options)).text();
  return text ? JSON.parse(text) : {};
}

// The answer to a request; where it is refused, the sentence of the server as an error.
async function answered(path, options) {
  let response;
  try { response = await fetch(path, options); } catch { throw new Error("The server does not answer; nothing is changed."); }
  if (response.ok) return response;
  const text = await response.text();
  let said = text;
  try { said = JSON.parse(text).error; } catch { /* a plain text */ }
  throw new Error(said || `The server answered ${response.status}; nothing is changed.`);
}

// An order that is carried out ends the message of one that was refused.
export async function order(name, more = {}) {
  const answer = await ask("/api/do", JSON.stringify({ do: name, ...more }));
  alarm("", "order");
  return answer;
}

export function socket(path, receive, lost) {
  let open = true, line;
  const connect = () => {
    line = new WebSocket(`ws://${location.host}${path}?token=${encodeURIComponent(token)}`);
    line.onmessage = (event) => receive(JSON.parse(event.data));
    line.onclose = () => { if (open) { lost(); setTimeout(connect, 1000); } };
  };
  connect();
  return { send: (message) => line.readyState === 1 && line.send(JSON.stringify(message)), close: () => { open = false; line.close(); } };
}

export async function download(path) {
  const response = await answered(path, { headers: { "x-winchkit-token": token } });
  const name = /filename="([^"]+)"/.exec(response.headers.get("content-disposition") || "");
  keep(await response.blob(), name ? name[1] : "winchkit.txt");
}

export function keep(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// Null and false stand for no child.
const given = (children) => children.flat().filter((child) => child !== null && child !== undefined && child !== false);

// Elements are made from names and texts; no text becomes markup.
export function el(name, attributes = {}, ...children) {
  const node = document.createElement(name);
  set(node, attributes);
  node.append(...given(children));
  return node;
}

// Replaces the children of an element.
export function fill(node, ...children) {
  node.replaceChildren(...given(children));
}

// As fill, but elements that are there already stay and take what differs: a live picture costs what
// changed of it, and keeps focus and listeners. For pictures whose listeners do not change.
export function renew(node, ...children) {
  matched(node, given(children));
}

function matched(node, wanted) {
  const there = [...node.childNodes];
  wanted.forEach((item, i) => (there[i] ? match(there[i], item) : node.append(item)));
  for (const old of there.slice(wanted.length)) old.remove();
}

// Makes a node look like another one.
function match(old, item) {
  if (old.isEqualNode(item)) return;
  if (old.nodeName !== item.nodeName) { old.replaceWith(item); return; }
  if (old.nodeType === Node.TEXT_NODE) { if (old.nodeValue !== item.nodeValue) old.nodeValue = item.nodeValue; return; }
  for (const { name, value } of item.attributes) if (name !== "style" && old.getAttribute(name) !== value) old.setAttribute(name, value);
  for (const { name } of [...old.attributes]) if (!item.hasAttribute(name)) old.removeAttribute(name);
  if (old.style.cssText !== item.style.cssText) old.style.cssText = item.style.cssText;
  matched(old, [...item.childNodes]);
}

export function svg(name, attributes = {}, ...children) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  // A hundredth of a pixel is not seen, and noise below it changes nothing that is drawn.
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, typeof value === "number" ? Math.round(100 * value) / 100 : value);
  node.append(...given(children));
  return node;
}

function set(node, attributes) {
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (key === "style") Object.assign(node.style, value);
    else if (key === "data") Object.assign(node.dataset, value);
    else node.setAttribute(key, value === true ? "" : value);
  }
}

const PATHS = {
  explained: "M8 5v6M5 8h6", refitted: "M8 4.8V8h2.6", adequate: "M5 8.2l2.2 2.2L11 6", partly: "M8 5v4M8 11v.4", undecided: "M5 8h6", unknown: "M6.2 6.4a1.8 1.8 0 1 1 2.6 1.7c-.6.3-.8.6-.8 1.2M8 11.2v.2",
  trip: "M8 4.5v4.5M8 11v.4", watch: "M8 6.2a1.8 1.8 0 1 0 .01 0", command: "M4.8 8h6M8.4 5.4 11 8l-2.6 2.6",
};
const OUTLINES = { unknown: "M8 1.2 14.8 8 8 14.8 1.2 8z", trip: "M5.3 1.5h5.4l3.8 3.8v5.4l-3.8 3.8H5.3l-3.8-3.8V5.3z", watch: "M1 8c3.2-5 10.8-5 14 0-3.2 5-10.8 5-14 0z" };
export function icon(kind) {
  const shape = OUTLINES[kind] ? svg("path", { d: OUTLINES[kind] })
    : svg("circle", { cx: 8, cy: 8, r: 6.3, "stroke-dasharray": kind === "explained" ? "2.5 1.8" : "none" });
  return svg("svg", { viewBox: "0 0 16 16", fill: "none", stroke: "currentColor", "stroke-width": 1.5, "aria-hidden": "true" }, shape, svg("path", { d: PATHS[kind] }));
}

export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
export const number = (value, digits = 4) => value === null || !Number.isFinite(value) ? "–" : String(Number(value.toPrecision(digits))).replace("-", "−");

// Profile, runs and version, as every export names them.
export const sourceOf = (...parts) => [...parts.filter(Boolean), `winchkit ${version.text}`].join("; ");
export const version = { text: "" };

export function say(text) { document.getElementById("live").textContent = text; }

// Messages, one of each cause: until it is closed, replaced, or no longer true. They are in the open
// dialog, else in the view's place for files, else below the top bar.
const messages = new Map(), AT_ONCE = 1000;

// `holds` says whether the message is still true. A message that repeats is shown anew, with its time;
// the answers to orders that were under way together count once.
export function alarm(text, cause = "order", holds = () => true, kind = "") {
  const before = messages.get(cause), now = performance.now();
  if (before && before.text === text && now - before.at < AT_ONCE) return;
  if (before) { before.node.remove(); messages.delete(cause); }
  if (!text) return;
  const node = el("div", { class: `alert ${kind}`, role: "alert" }, el("div", {}, text), el("span", { class: "note" }, new Date().toTimeString().slice(0, 8)), el("button", { class: "plain", onclick: () => alarm("", cause) }, "Close"));
  messages.set(cause, { text, node, holds, at: now });
  place();
}

// Puts messages whose place is gone where they are seen.
export function place() {
  const box = document.getElementById("dialog"), host = box.open ? box : document.querySelector("main .drop") || document.getElementById("banner");
  for (const { node } of messages.values()) if (!node.isConnected || (box.contains(node) && !box.open)) host.prepend(node);
}

// Removes the messages that are no longer true.
export function review() { for (const [cause, { holds }] of [...messages]) if (!holds()) alarm("", cause); }

export function dialog(title, ...content) {
  const box = document.getElementById("dialog");
  const before = document.activeElement;
  fill(box, el("div", { class: "row title" }, el("h2", {}, title),
    el("button", { class: "plain", onclick: () => box.close() }, "Close")), ...content);
  box.setAttribute("aria-label", title);
  // The event comes a frame after the closing: a dialog that was opened since keeps its focus.
  box.onclose = () => { if (!box.open && box.contains((messages.get("order") || {}).node || null)) alarm(""); place(); if (!box.open && before && before.focus) before.focus(); };
  if (!box.open) box.show();
  place();
  (box.querySelector("select, input, .primary") || box.querySelector("button")).focus();
  return box;
}

export function closeDialog() { document.getElementById("dialog").close(); }

// Asks before something is done; the page goes on meanwhile, so that Stop is free.
export function confirmed(title, words, act, ...content) {
  dialog(title, el("p", {}, words), ...content, el("div", { class: "row", style: { marginTop: "16px" } },
    el("button", { class: "primary", onclick: () => { closeDialog(); act(); } }, title), el("button", { onclick: closeDialog }, "Cancel")));
}

// Files of a field, which is emptied: the same file can be chosen again after its correction.
export const filesOf = (field) => { const files = [...field.files]; field.value = ""; return files; };

export async function attempt(action) {
  try { await action(); } catch (error) { alarm(error.message); }
}

// Draws in a box the answer to the newest question for it: answers arrive in any order, and the box may be gone by then.
const newest = new WeakMap();
export const drawAnswer = (box, question, draw) => attempt(async () => {
  const own = {};
  newest.set(box, own);
  const answer = await question();
  if (box.isConnected && newest.get(box) === own) draw(answer);
});
