// Decodes the bytes that the program sends: a JSON head and arrays (tools/view/body.hpp).

const ARRAYS = { f32: Float32Array, f64: Float64Array, u32: Uint32Array };

/** Returns the head, with the arrays as properties. Throws if the bytes have another format. */
export function parseBlob(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 8 || view.getUint32(0) !== 0x46465631) throw new Error("the bytes are not data of freeflex");
  const size = view.getUint32(4, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size)));
  for (const [name, { type, offset, length }] of Object.entries(head.arrays ?? {}))
    head[name] = new ARRAYS[type](buffer, 8 + size + offset, length);
  delete head.arrays;
  return head;
}

/** Decodes base64 text. */
export function fromBase64(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; ++k) bytes[k] = raw.charCodeAt(k);
  return bytes.buffer;
}

const FRAME_HEAD = 14; // doubles: kind, tick, time, position, attitude, angular velocity, number of wheels

/** Decodes a binary message of the socket: {kind: "state", ...} or {kind: "loads", ...}; null for any other. */
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

/** Returns the number of the k-th mode in the numbering of `freeflex modes`. */
export function modeNumber(body, k) {
  return body.modeNumbers ? body.modeNumbers[k] : k + 1;
}

/** Returns the k-th name of a list. The list is empty if every name is the item's number. */
export function nameOf(names, k) {
  return names.length > 0 ? names[k] : String(k + 1);
}
