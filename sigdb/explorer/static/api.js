// Requests to the server: JSON out, JSON or a packed picture back.

const key = "sigdb-token";

// The token comes once, in the address; it is kept in this browser and taken out of the address.
export function takeToken() {
  const settings = new URLSearchParams(location.hash.slice(1));
  if (settings.has("token")) {
    localStorage.setItem(key, settings.get("token"));
    settings.delete("token");
    history.replaceState(null, "", "#" + settings);
  }
}

export async function request(name, body, { raw = false } = {}) {
  let answer;
  try {
    answer = await fetch("api/" + name, {
      method: "POST",
      headers: { "X-Sigdb-Token": localStorage.getItem(key) ?? "" },
      body: raw ? body : JSON.stringify(body ?? {}),
    });
  } catch {
    throw new Error("The explorer's server has stopped. Start sigdb explore again, and open the address that it prints.");
  }
  if (!answer.ok) {
    let text = `The server answered ${answer.status}.`;
    try { text = (await answer.json()).error ?? text; } catch { /* not JSON: the number says it */ }
    throw new Error(text);
  }
  const type = answer.headers.get("content-type") ?? "";
  if (type.startsWith("application/json")) return answer.json();
  if (type.startsWith("application/octet-stream")) return unpack(await answer.arrayBuffer());
  return answer.blob();
}

// The inverse of `packed` of the server.
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const numbers = new Float32Array(buffer, 4 + length);
  const arrays = {}, shapes = {};
  for (const [name, shape, first] of facts.arrays) {
    arrays[name] = numbers.subarray(first, first + shape.reduce((a, b) => a * b, 1));
    shapes[name] = shape;
  }
  delete facts.arrays;
  return { facts, arrays, shapes };
}

// One request at a time; while it runs, only the newest of the others waits.
export class Latest {
  constructor(ask, show, fail) {
    this.ask = ask; this.show = show; this.fail = fail; this.busy = false; this.waiting = null;
  }
  async want(wanted) {
    if (this.busy) { this.waiting = wanted; return; }
    this.busy = true;
    try { await this.show(await this.ask(wanted), wanted); } catch (error) { this.fail(error); }
    this.busy = false;
    if (this.waiting !== null) {
      const next = this.waiting;
      this.waiting = null;
      this.want(next);
    }
  }
}
