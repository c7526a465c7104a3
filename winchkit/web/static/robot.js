// The Robot view.
import { el } from "./page.js";

export function enter(main) { main.replaceChildren(el("div", { class: "drop" }, el("h1", {}, "No robot"), el("p", { class: "note" }, "Open a robot's profile and its poses in the Diagnose view."))); }
export function update() {}
