/** The list of areas beside the drawing: counts, names, directions, and the problems of the server. */

import { KINDS, titleOf } from "./areas.js";
import { element, plural } from "./dom.js";

const PLACES = { frame_px: "in the frame", floor_m: "on the floor" };

/** The rows by the key of their area. They are updated in place, so that a field keeps its cursor. */
const rows = new Map();

/** Shows the areas in `list`; `invalid` is the problem of an area, `{key, text}`, or null. */
export function showList(list, { editor, countOf, invalid }) {
  const { areas } = editor;
  for (const [key, { node }] of rows) {
    if (editor.area(key)) continue;
    node.remove();
    rows.delete(key);
  }
  areas.forEach((area, index) => {
    if (!rows.has(area.key)) rows.set(area.key, rowOf(area));
    const row = rows.get(area.key);
    row.editor = editor;
    if (list.children[index] !== row.node) list.insertBefore(row.node, list.children[index] ?? null);
    updateRow(row, area, { editor, countOf, invalid });
  });
}

/** Scrolls to the row of an area. */
export const scrollToRow = (key) => rows.get(key)?.node.scrollIntoView({ block: "nearest" });

function rowOf({ key, kind }) {
  const row = { node: element("li", { class: `area-row ${kind}`, "data-key": key, "data-kind": kind }) };
  const area = () => row.editor.area(key);
  const change = (changes, mark = null) => row.editor.change({ ...area(), ...changes }, mark && `${mark}-${key}`);
  const field = (label, name, act) => {
    const typing = { maxlength: 64, autocomplete: "off", autocapitalize: "off", spellcheck: "false" };
    const input = element("input", { id: `${name}-${key}`, ...typing, oninput: act });
    return [input, element("label", { class: "field", for: `${name}-${key}` }, label, input)];
  };
  const button = (words, act, kindOf = "") => element("button", { type: "button", class: kindOf, onclick: act }, words);
  row.title = element("b");
  row.facts = element("span", { class: "facts" });
  row.count = element("span", { class: "count" });
  row.head = element(
    "button",
    { type: "button", class: "area-head", onclick: () => row.editor.select(row.editor.selected?.key === key ? null : key) },
    element("span", { class: "swatch", "aria-hidden": "true" }),
    element("span", { class: "area-name" }, row.title, row.facts),
    row.count,
  );
  row.problem = element("p", { class: "failure", role: "alert", hidden: true });
  row.form = element("div", { class: "area-form" });
  const fields = [];
  if (kind !== "mask") {
    const [input, label] = field("Name", "area-name", () => change({ name: input.value.trim() }, "name"));
    row.name = input;
    fields.push(label);
  }
  if (kind === "zone") {
    row.lying = element("input", { type: "checkbox", id: `lying-${key}`, onchange: () => change({ lying: row.lying.checked ? "expected" : undefined }) });
    fields.push(element("label", { for: row.lying.id }, row.lying, " People may lie here: bed, sofa, mat"));
  }
  if (kind === "line") {
    const sides = ["Along the arrow", "Against it"].map((label, side) => {
      const [input, node] = field(label, `direction-${side}`, () =>
        change({ directions: area().directions.with(side, input.value.trim()) }, `direction-${side}`),
      );
      return { input, node };
    });
    row.directions = sides.map(({ input }) => input);
    fields.push(element("div", { class: "pair" }, sides.map(({ node }) => node)));
  }
  const tools = [];
  if (kind === "line") tools.push(button("Turn the arrow", () => change({ corners: area().corners.toReversed() })));
  else {
    row.dropCorner = button("Delete corner", () => row.editor.removeCorner(key, row.editor.selected.corner));
    tools.push(row.dropCorner);
  }
  tools.push(button(`Delete ${kind}`, () => row.editor.removeArea(key), "danger"));
  row.form.append(...fields, element("div", { class: "area-tools" }, tools));
  row.node.append(row.head, row.problem, row.form);
  return row;
}

function updateRow(row, area, { editor, countOf, invalid }) {
  const isSelected = editor.selected?.key === area.key;
  const title = titleOf(area, editor.areas);
  row.node.classList.toggle("selected", isSelected);
  row.head.setAttribute("aria-expanded", String(isSelected));
  row.title.textContent = title[0].toUpperCase() + title.slice(1);
  const size = area.kind === "line" ? area.directions.join(" / ") : plural(area.corners.length, "corner");
  row.facts.textContent = `${size}, ${PLACES[area.space]}`;
  row.count.textContent = countOf(area) ?? "";
  row.form.hidden = !isSelected;
  if (row.name && row.name.value.trim() !== area.name) row.name.value = area.name;
  if (row.lying) row.lying.checked = area.lying === "expected";
  row.directions?.forEach((input, side) => {
    if (input.value.trim() !== area.directions[side]) input.value = area.directions[side];
  });
  const canDrop = isSelected && editor.selected.corner !== null && area.corners.length > KINDS[area.kind].least;
  if (row.dropCorner) row.dropCorner.disabled = !canDrop;
  const text = invalid?.key === area.key ? invalid.text : "";
  if (row.problem.textContent !== text) row.problem.textContent = text;
  row.problem.hidden = !text;
  for (const input of [row.name, ...(row.directions ?? [])].filter(Boolean)) {
    if (text) input.setAttribute("aria-invalid", "true");
    else input.removeAttribute("aria-invalid");
  }
}
