// Bytes that the program sends: a JSON head and arrays (tools/view/body.hpp).

const ARRAYS = { f32: Float32Array, f64: Float64Array, u32: Uint32Array };

/** The head, with its arrays under their names. Throws when the bytes are no such thing. */
export function parseBlob(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 8 || view.getUint32(0) !== 0x46465631) throw new Error("no data of freeflex");
  const size = view.getUint32(4, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size)));
  for (const [name, { type, offset, length }] of Object.entries(head.arrays ?? {}))
    head[name] = new ARRAYS[type](buffer, 8 + size + offset, length);
  delete head.arrays;
  return head;
}

/** Bytes of base64 text. */
export function fromBase64(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; ++k) bytes[k] = raw.charCodeAt(k);
  return bytes.buffer;
}

const FRAME_HEAD = 14; // doubles: kind, tick, time, position, attitude, angular velocity, number of wheels

/** A binary message of the socket: {kind: "state", ...} or {kind: "loads", ...}; null of any other. */
export function parseMessage(buffer) {
  const kind = new Float64Array(buffer, 0, 1)[0];
  if (kind === 1) {
    const head = new Float64Array(buffer, 0, FRAME_HEAD);
    const wheels = new Float64Array(buffer, 8 * FRAME_HEAD, head[13]);
    return {
      kind: "state", tick: head[1], time: head[2], position: [...head.slice(3, 6)],
      attitude: [...head.slice(6, 10)], spin: [...head.slice(10, 13)], wheels: [...wheels],
      q: new Float32Array(buffer, 8 * (FRAME_HEAD + wheels.length)),
    };
  }
  if (kind !== 2) return null;
  return { kind: "loads", tick: new Float64Array(buffer, 8, 1)[0], values: new Float32Array(buffer, 16) };
}

/** Number of the k-th mode, as `freeflex modes` counts. */
export function modeNumber(body, k) {
  return body.modeNumbers ? body.modeNumbers[k] : k + 1;
}

/** Name of the k-th of a list in which names that are numbers are left out. */
export function nameOf(names, k) {
  return names.length > 0 ? names[k] : String(k + 1);
}
