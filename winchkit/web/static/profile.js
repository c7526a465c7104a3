// A new profile from the drawing of a winch: the fields that the command line asks for.
import { ask, attempt, closeDialog, dialog, el, fill, order } from "./page.js";

export const newProfile = () => attempt(async () => {
  const { fields, drums, pulley } = (await ask("/api/choices")).drawing, values = {}, pulleys = [""];
  const name = el("input", { value: "my-winch", "aria-label": "Name of the profile" });
  const kind = el("select", { "aria-label": "How the cable lies on the drum", onchange: () => { values["drum.kind"] = kind.value; draw(); } }, Object.entries(drums).map(([id, words]) => el("option", { value: id }, `${id}: ${words}`)));
  const table = el("div", { class: "drawing" }), list = el("div", { class: "drawing" });
  values["drum.kind"] = kind.value;

  const row = (words, unknown, input) => el("label", {}, el("span", {}, words), input, el("span", { class: "note" }, unknown));
  function draw() {
    const seen = fields.filter((field) => field.key !== "drum.kind" && field.drums.includes(values["drum.kind"]) && (!field.after || values[field.after]));
    fill(table, seen.map((field) => {
      const unknown = () => (values[field.key] ? "" : field.without ? `unknown: ${field.without}` : "needed");
      const input = field.choices.length ? el("select", { "aria-label": field.words, onchange: () => { values[field.key] = input.value; } }, ["", ...field.choices].map((own) => el("option", {}, own)))
        : el("input", { size: 14, placeholder: field.example, value: values[field.key] || "", "aria-label": field.words, oninput: () => { values[field.key] = input.value.trim(); line.lastChild.textContent = unknown(); }, onchange: () => { if (fields.some((own) => own.after === field.key)) draw(); } });
      const line = row([el("b", {}, field.key.split(".")[1].replaceAll("_", " ")), el("span", { class: "note" }, ` ${field.words}`)], unknown(), input);
      return line;
    }));
    fill(list, pulleys.map((text, i) => {
      const input = el("input", { size: 14, placeholder: pulley.example, value: text, "aria-label": `Pulley ${i + 1}`, oninput: () => { pulleys[i] = input.value; } });
      return row(el("b", {}, `pulley ${i + 1}`), i ? "" : `${pulley.words}; ${pulley.without}`, input);
    }), el("button", { onclick: () => { pulleys.push(""); draw(); } }, "Add a pulley"));
  }
  draw();
  dialog("New profile", el("p", { class: "note" }, "Each value with its unit. What you do not know, leave empty."), el("label", { class: "row", style: { margin: "12px 0" } }, "Name", name),
    el("img", { src: "/static/drums.svg", width: 620, height: 178, alt: "Sections through the axis of the kinds of drum: spiral, archimedean, grooved, squared" }), el("label", { class: "row" }, "Drum", kind), table, list,
    el("div", { class: "row", style: { marginTop: "12px" } }, el("button", { class: "primary", onclick: () => attempt(async () => {
      const seen = Object.fromEntries(fields.filter((field) => field.drums.includes(values["drum.kind"]) && (!field.after || values[field.after])).map(({ key }) => [key, values[key] || ""]));
      await order("new-profile", { name: name.value, values: seen, pulleys: pulleys.filter((text) => text.trim()) });
      closeDialog();
    }) }, "Write the profile"), el("button", { onclick: closeDialog }, "Cancel")));
});
