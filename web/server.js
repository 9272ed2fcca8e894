/** Requests to the server, with relative addresses, the API key, and problems as errors. */

const KEY = "lookdown-key";

export const key = {
  get: () => sessionStorage.getItem(KEY) ?? "",
  set: (value) => (value ? sessionStorage.setItem(KEY, value) : sessionStorage.removeItem(KEY)),
};

/** A problem document of the server (RFC 9457) with its members, such as `parameter`, the invalid parameter. */
export class Problem extends Error {
  constructor(status, text, { parameter, refusal } = {}) {
    super(text);
    Object.assign(this, { status, parameter, refusal });
  }
}

/** Returns a successful response; throws a `Problem` otherwise. */
export async function ask(path, options = {}) {
  const headers = new Headers(options.headers);
  if (key.get()) headers.set("X-API-Key", key.get());
  let answer;
  try {
    answer = await fetch(path, { ...options, headers });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Problem(0, "The server does not respond.");
  }
  if (answer.ok) return answer;
  const problem = await answer.json().catch(() => ({}));
  if (answer.status === 401) document.dispatchEvent(new Event("key-wanted"));
  throw new Problem(answer.status, problem.detail ?? `The server returned ${answer.status}.`, problem);
}

export const askJson = async (path, options) => (await ask(path, options)).json();

/** Server-sent events of a path, `{id, data}` each. `EventSource` cannot send the key. */
export async function* events(path, options = {}) {
  const answer = await ask(path, { ...options, headers: { Accept: "text/event-stream", ...options.headers } });
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const blocks = (text + value).split(/\r?\n\r?\n/);
    text = blocks.pop();
    for (const block of blocks) {
      const event = parseEvent(block);
      if (event.data) yield event;
    }
  }
}

/** Parses one event. */
export function parseEvent(block) {
  const event = { id: "", data: "" };
  for (const line of block.split(/\r?\n/)) {
    const [, name, value] = /^(\w*): ?(.*)$/.exec(line) ?? [];
    if (name === "id") event.id = value;
    if (name === "data") event.data += (event.data && "\n") + value;
  }
  return event;
}
