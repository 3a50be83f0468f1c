// A force that the mouse applies to a point, proportional to the drag.
import { worldPoint, niceBelow } from "./motion.js";
import { project } from "./camera.js";
import { nameOf } from "./blob.js";

const NEAR = 12; // [pixels] largest distance at which a point is picked
const RENEWED = 0.1; // [s] between two commands of one drag; their leases are half a second

/** Returns the initial setting of the force for a drag of 100 pixels [N]. */
export function firstForce(body) {
  const force = niceBelow(0.05 * body.mass);
  return body.forceLimit > 0 ? Math.min(force, body.forceLimit) : force;
}

/** Returns the pushable point nearest to a pixel, or null. */
export function pick(body, frame, factor, target, matrix, width, height, x, y) {
  let found = null, least = NEAR;
  for (const point of body.pushable) {
    const position = worldPoint(body, frame, point, factor).map((value, axis) => value - target[axis]);
    const [px, py, depth] = project(matrix, position, width, height);
    const away = Math.hypot(px - x, py - y);
    if (depth > 0 && away < least) [found, least] = [point, away];
  }
  return found;
}

/** Returns the force [N] of a drag by dx, dy pixels, in world axes. */
export function forceOf(camera, dx, dy, newtonsPer100) {
  const { right, up } = camera.axes();
  return [0, 1, 2].map((axis) => (newtonsPer100 / 100) * (dx * right[axis] - dy * up[axis]));
}

/** Sends one push at a time. `send` is called with the message; `show` is called with the text of the answer. */
export class Push {
  constructor(body, send, show) {
    this.body = body;
    this.send = send;
    this.show = show;
    /** @type {number | null} */
    this.point = null;
    this.force = [0, 0, 0]; // [N]
    this.sent = 0; // [s]
    this.name = Math.random().toString(36).slice(2); // the answers to this page repeat this name
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
  /** Shows the answer to a push of this page; ignores answers to other pages. */
  answered({ by, point, force, reason, tick, text }) {
    if (by !== this.name) return;
    const what = force === undefined ? "push ended"
      : `${Math.hypot(...force).toPrecision(3)} N on ${nameOf(this.body.pointNames, point)}`;
    this.show(reason === 0 ? `${what}: accepted at tick ${tick}` : `refused: ${text}`, reason !== 0);
  }
}
