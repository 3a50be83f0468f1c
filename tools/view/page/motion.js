// The arithmetic of the page: positions of points, amplification, interpolation between frames.

/** Load [N] per kilogram of the body; a smaller load is treated as a rounding error. */
export const NO_LOAD = 1e-9;

/** Returns the elastic displacement of one point [m] in body axes, as the sum over modes. */
export function displacement(body, q, point) {
  const stride = 3 * body.points;
  const V = [0, 0, 0];
  for (let l = 0; l < body.modes; ++l)
    for (let axis = 0; axis < 3; ++axis) V[axis] += q[l] * body.shapes[l * stride + 3 * point + axis];
  return V;
}

/** Returns the rows of the rotation matrix, body axes to world axes, of a quaternion w x y z. */
export function rotation([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

export function apply(R, v) {
  return R.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
}

/** Returns the rotation vector [rad], at most pi, from one attitude w x y z to another, in the body axes of the first. */
export function rotationBetween([a, b, c, d], [w, x, y, z]) {
  const real = a * w + b * x + c * y + d * z;
  const vector = [a * x - b * w - c * z + d * y, a * y + b * z - c * w - d * x, a * z - b * y + c * x - d * w];
  const sine = Math.hypot(...vector);
  if (sine === 0) return [0, 0, 0];
  const scale = (2 * Math.atan2(sine, Math.abs(real)) / sine) * (real < 0 ? -1 : 1);
  return vector.map((value) => scale * value);
}

/** Returns the position [m] of a point in world axes, with its displacement times `factor`. */
export function worldPoint(body, frame, point, factor = 1) {
  const V = displacement(body, frame.q, point);
  const x = [0, 1, 2].map((axis) => body.rest[3 * point + axis] + factor * V[axis]);
  return apply(rotation(frame.attitude), x).map((value, axis) => value + frame.position[axis]);
}

/** Returns the displacement [m], rms weighted by mass. Mode shapes are normalised to sum m b.b = M. */
export function rms(q) {
  let sum = 0;
  for (const value of q) sum += value * value;
  return Math.sqrt(sum);
}

/** Returns the largest number that is 1, 2 or 5 times a power of ten and not above the value. */
export function niceBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  const digits = value / power;
  return (digits >= 5 ? 5 : digits >= 2 ? 2 : 1) * power;
}

const SEEN = 0.04; // rms displacement in the picture, relative to the size of the body

/** Chooses an amplification that makes the recent peak displacement visible, in steps of 1, 2, 5. */
export class Amplifier {
  constructor(size) {
    this.size = size;
    this.peak = 0;
    this.factor = 1;
  }
  /** @param {number} now rms displacement [m]  @param {number} dt [s] since the last call */
  take(now, dt) {
    this.peak = Math.max(now, this.peak * Math.exp(-dt / 10));
    const wanted = this.peak > 0 ? (SEEN * this.size) / this.peak : 1;
    const isFar = wanted < this.factor || wanted > 4 * this.factor;
    if (isFar && Number.isFinite(wanted)) this.factor = Math.min(1e9, Math.max(1, niceBelow(wanted)));
    return this.factor;
  }
}

/** Returns a frame with one mode in free vibration; `phase` is in periods. */
export function modeFrame(body, mode, phase) {
  const q = new Float32Array(body.modes);
  q[mode] = SEEN * body.size * Math.sin(2 * Math.PI * phase);
  return { tick: 0, time: 0, position: [0, 0, 0], attitude: [1, 0, 0, 0], spin: [0, 0, 0], wheels: [], q };
}

/** A recording: frames ordered by time. */
export class Recording {
  constructor(motion, modes) {
    this.motion = motion;
    this.modes = modes;
    this.count = motion.time.length;
    this.begin = motion.clock[0];
    this.end = motion.clock[this.count - 1];
  }
  /** Returns the index of the last frame at or before a time [s] since the first tick. */
  before(time) {
    let low = 0, high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.motion.clock[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }
  frame(k) {
    const { motion, modes } = this, wheels = (motion.wheels?.length ?? 0) / this.count;
    return {
      tick: motion.tick[k], time: motion.time[k], position: [...motion.position.slice(3 * k, 3 * k + 3)],
      attitude: [...motion.attitude.slice(4 * k, 4 * k + 4)], spin: [...motion.spin.slice(3 * k, 3 * k + 3)],
      wheels: [...(motion.wheels ?? []).slice(wheels * k, wheels * (k + 1))],
      q: motion.q.subarray(k * modes, (k + 1) * modes),
    };
  }
  /** Returns the frame at a time, interpolated linearly between two frames. */
  at(time) {
    const k = this.before(time), one = this.frame(k);
    if (k + 1 >= this.count) return one;
    const { clock } = this.motion, fraction = (time - clock[k]) / (clock[k + 1] - clock[k]);
    if (!(fraction > 0)) return one;
    const other = this.frame(k + 1);
    const sign = one.attitude.reduce((sum, x, i) => sum + x * other.attitude[i], 0) < 0 ? -1 : 1;
    const between = (a, b) => a + fraction * (b - a);
    const attitude = one.attitude.map((x, i) => between(x, sign * other.attitude[i]));
    const norm = Math.hypot(...attitude);
    return {
      tick: Math.round(between(one.tick, other.tick)), time: between(one.time, other.time),
      position: one.position.map((x, i) => between(x, other.position[i])), attitude: attitude.map((x) => x / norm),
      spin: one.spin.map((x, i) => between(x, other.spin[i])), wheels: one.wheels.map((x, i) => between(x, other.wheels[i])),
      q: Float32Array.from(one.q, (x, i) => between(x, other.q[i])),
    };
  }
  /** Returns the last loads at or before a time. */
  loads(time) {
    const { loadClock, loads, linksPerTick } = this.motion;
    if (!loadClock || loadClock.length === 0) return null;
    let k = 0;
    while (k + 1 < loadClock.length && loadClock[k + 1] <= time) ++k;
    return loads.subarray(k * linksPerTick, (k + 1) * linksPerTick);
  }
  /** Returns the worst verdict of the recording: {verdict, tick, cause}; null if it has no STATUS. */
  verdict() {
    let worst = null;
    for (const { validity, tick, validity_cause, worst_validity, worst_validity_tick, worst_validity_cause } of this.motion.statuses ?? []) {
      for (const one of [{ verdict: worst_validity, tick: worst_validity_tick, cause: worst_validity_cause },
        { verdict: validity, tick, cause: validity_cause }])
        if (worst === null || one.verdict > worst.verdict) worst = one;
    }
    return worst;
  }
  /** Returns the last status at or before a time. */
  status(time) {
    let found = null;
    for (const status of this.motion.statuses ?? []) {
      if (status.clock > time) break;
      found = status;
    }
    return found;
  }
}
