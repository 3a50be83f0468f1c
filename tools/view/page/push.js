// A force by the mouse: from a point, as far as it is drawn.
import { worldPoint, niceBelow } from "./motion.js";
import { project } from "./camera.js";
import { nameOf } from "./blob.js";

const NEAR = 12; // [pixels]
const RENEWED = 0.1; // [s] between two commands of one drag, whose leases are half a second

/** Newtons that a drag of 100 pixels means, until somebody says otherwise. */
export function firstForce(body) {
  const force = niceBelow(0.05 * body.mass);
  return body.forceLimit > 0 ? Math.min(force, body.forceLimit) : force;
}

/** The pushable point nearest to a pixel, or null. */
export function pick(body, frame, factor, target, matrix, width, height, x, y) {
  let found = null, least = NEAR;
  for (const point of body.pushable) {
    const place = worldPoint(body, frame, point, factor).map((value, axis) => value - target[axis]);
    const [px, py, depth] = project(matrix, place, width, height);
    const away = Math.hypot(px - x, py - y);
    if (depth > 0 && away < least) [found, least] = [point, away];
  }
  return found;
}

/** Force [N] of a drag by so many pixels, in world axes. */
export function forceOf(camera, dx, dy, newtonsPer100) {
  const { right, up } = camera.axes();
  return [0, 1, 2].map((axis) => (newtonsPer100 / 100) * (dx * right[axis] - dy * up[axis]));
}

/** One push at a time. `send` takes the message; `show` the text of what was answered. */
export class Push {
  constructor(body, send, show) {
    this.body = body;
    this.send = send;
    this.show = show;
    /** @type {number | null} */
    this.point = null;
    this.force = [0, 0, 0]; // [N]
    this.sent = 0; // [s]
    this.name = Math.random().toString(36).slice(2); // that answers bear
  }
  begin(point) {
    this.point = point;
    this.force = [0, 0, 0];
  }
  drag(force, now) {
    this.force = force;
    if (now - this.sent >= RENEWED) this.renew(now);
  }
  renew(now) {
    if (this.point === null || Math.hypot(...this.force) === 0) return;
    this.sent = now;
    this.send({ push: { point: this.point, force: this.force }, by: this.name });
  }
  tick(now) {
    if (now - this.sent >= RENEWED) this.renew(now);
  }
  end() {
    if (this.point !== null) this.send({ push: null, by: this.name });
    this.point = null;
    this.sent = 0;
  }
  /** The answer to a push, of this page or of another. */
  answered({ by, point, force, reason, tick, text }) {
    if (by !== this.name) return;
    const what = force === undefined ? "push ended"
      : `${Math.hypot(...force).toPrecision(3)} N on ${nameOf(this.body.pointNames, point)}`;
    this.show(reason === 0 ? `${what}: accepted at tick ${tick}` : `refused: ${text}`, reason !== 0);
  }
}
