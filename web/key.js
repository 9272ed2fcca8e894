/** The dialog for the API key, opened on a 401 response or by its button. */

import { find } from "./dom.js";
import { key } from "./server.js";

export function start(retry) {
  const dialog = find("#key-dialog");
  const input = find("input", dialog);
  const show = () => {
    if (dialog.open) return;
    input.value = key.get();
    dialog.showModal();
  };
  find("#key-button").addEventListener("click", show);
  document.addEventListener("key-wanted", () => {
    find("#key-wanted").hidden = false;
    show();
  });
  find("#key-cancel").addEventListener("click", () => dialog.close());
  find("form", dialog).addEventListener("submit", (event) => {
    event.preventDefault();
    key.set(input.value.trim());
    find("#key-wanted").hidden = true;
    dialog.close();
    retry();
  });
}
