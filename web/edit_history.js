/** Undo and redo: a bounded list of versions. */

const MAX_VERSIONS = 200;

export class EditHistory {
  #past = [];
  #future = [];
  #mark = null;

  constructor(first) {
    this.now = first;
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  /** Adds a version. Consecutive edits with the same `mark`, such as those of a drag, are one version. */
  edit(next, mark = null) {
    if (mark === null || mark !== this.#mark) {
      this.#past.push(this.now);
      this.#past.splice(0, this.#past.length - MAX_VERSIONS);
    }
    this.#future = [];
    this.#mark = mark;
    this.now = next;
  }

  /** Removes the version of `mark`, if it is the latest. */
  cancel(mark) {
    if (mark !== this.#mark) return;
    this.now = this.#past.pop();
    this.#mark = null;
  }

  undo() {
    this.#step(this.#past, this.#future);
  }

  redo() {
    this.#step(this.#future, this.#past);
  }

  #step(from, to) {
    if (!from.length) return;
    to.push(this.now);
    this.now = from.pop();
    this.#mark = null;
  }
}
