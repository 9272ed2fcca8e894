/** The state of the editor: areas with undo, the selected corner, and the outline that is being drawn. */

import { KINDS, MOST_OF_A_KIND, areaOf, freeName, placed, withCornerAt, withNewCorner, withoutCorner } from "./areas.js";
import { EditHistory } from "./edit_history.js";

export class AreaEditor {
  #history;
  #saved;
  #changed;
  /** The selected area and its selected corner: `{key, corner}`; `corner` may be null. */
  selected = null;
  /** The outline that is being drawn: `{kind, space, corners, cursor}`; null while none is. */
  draft = null;
  /** The last message for the user. */
  note = "";

  /** `changed` is called after every change. */
  constructor(areas, changed) {
    this.#history = new EditHistory(areas);
    this.#saved = areas;
    this.#changed = changed;
  }

  get areas() {
    return this.#history.now;
  }

  get canUndo() {
    return this.#history.canUndo || Boolean(this.draft?.corners.length);
  }

  get canRedo() {
    return this.#history.canRedo;
  }

  get isUnsaved() {
    return this.areas !== this.#saved;
  }

  area(key) {
    return this.areas.find((area) => area.key === key) ?? null;
  }

  get selectedArea() {
    return this.selected && this.area(this.selected.key);
  }

  #done(note = "") {
    if (this.selected) {
      const area = this.selectedArea;
      if (!area) this.selected = null;
      else if (this.selected.corner >= area.corners.length) this.selected = { ...this.selected, corner: null };
    }
    this.note = note;
    this.#changed();
  }

  /** Replaces all areas in one undoable step. */
  replaceAll(areas, { isSaved }) {
    this.#history.edit(areas);
    if (isSaved) this.#saved = areas;
    this.#done();
  }

  /** Notes that these areas are those of the server. */
  saved(areas) {
    this.#saved = areas;
    this.#done();
  }

  /** Replaces an area; consecutive changes with the same `mark` are undone together. */
  change(area, mark) {
    this.#history.edit(this.areas.map((other) => (other.key === area.key ? area : other)), mark);
    this.#done();
  }

  cancelChange(mark) {
    this.#history.cancel(mark);
    this.#done();
  }

  select(key, corner = null) {
    const { selected } = this;
    if (key === (selected?.key ?? null) && corner === (selected?.corner ?? null)) return;
    this.selected = key === null ? null : { key, corner };
    this.#done();
  }

  moveCorner(key, corner, place, bounds, mark) {
    const area = this.area(key);
    this.change(withCornerAt(area, corner, placed(area.space, place, bounds)), mark);
  }

  /** Adds a corner before the corner with this index, and selects it. */
  addCorner(key, corner, place, bounds, mark) {
    const area = this.area(key);
    this.selected = { key, corner };
    this.change(withNewCorner(area, corner, placed(area.space, place, bounds)), mark);
  }

  removeCorner(key, corner) {
    const area = this.area(key);
    const { least } = KINDS[area.kind];
    if (area.corners.length <= least) {
      this.#done(area.kind === "line" ? "A line has two ends." : `A ${area.kind} has at least ${least} corners.`);
      return;
    }
    this.selected = { key, corner: null };
    this.change(withoutCorner(area, corner));
  }

  removeArea(key) {
    this.#history.edit(this.areas.filter((area) => area.key !== key));
    this.#done("Deleted. Undo restores it.");
  }

  undo() {
    if (this.draft?.corners.length) {
      this.removeLastCorner();
      return;
    }
    this.#history.undo();
    this.#done();
  }

  redo() {
    this.#history.redo();
    this.#done();
  }

  #hasRoomFor(kind) {
    const hasRoom = this.areas.filter((area) => area.kind === kind).length < MOST_OF_A_KIND;
    if (!hasRoom) this.#done(`A calibration has at most ${MOST_OF_A_KIND} ${KINDS[kind].field}.`);
    return hasRoom;
  }

  /** Begins to draw; the cursor begins at `cursor`. */
  begin(kind, space, cursor) {
    this.draft = null;
    if (!this.#hasRoomFor(kind)) return;
    this.selected = null;
    this.draft = { kind, space, corners: [], cursor };
    this.#done();
  }

  moveCursor(place, bounds) {
    this.draft = { ...this.draft, cursor: placed(this.draft.space, place, bounds) };
    this.#done();
  }

  /** True if the outline has enough corners. */
  get canFinish() {
    return Boolean(this.draft) && this.draft.corners.length >= KINDS[this.draft.kind].least;
  }

  /** Adds the cursor to the outline. The second end of a line finishes it. */
  addAtCursor() {
    const { kind, corners, cursor } = this.draft;
    const isRepeated = corners.some(([x, y]) => x === cursor[0] && y === cursor[1]);
    if (isRepeated) {
      if (this.canFinish) this.finish();
      return;
    }
    this.draft = { ...this.draft, corners: [...corners, cursor] };
    if (this.draft.corners.length === KINDS[kind].most) this.finish();
    else this.#done();
  }

  removeLastCorner() {
    this.draft = { ...this.draft, corners: this.draft.corners.slice(0, -1) };
    this.#done();
  }

  /** Makes the outline an area, and selects it. */
  finish() {
    const { kind, space, corners } = this.draft;
    const name = ["mask", "area"].includes(kind) ? "" : freeName(kind, this.areas);
    this.draft = null;
    this.add(areaOf(kind, space, name, corners));
  }

  /** Adds an area and selects it, unless there are too many of its kind. */
  add(area) {
    if (!this.#hasRoomFor(area.kind)) return;
    this.selected = { key: area.key, corner: null };
    this.#history.edit([...this.areas, area]);
    this.#done();
  }

  cancelDraft() {
    this.draft = null;
    this.#done("Drawing cancelled.");
  }
}
