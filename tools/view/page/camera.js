// The camera of the picture: rotated, moved and zoomed by the mouse.

/** 4 x 4 matrices are arrays of 16 numbers, column by column, as WebGL requires. */
export function multiply(a, b) {
  const c = new Float64Array(16);
  for (let column = 0; column < 4; ++column)
    for (let row = 0; row < 4; ++row)
      for (let k = 0; k < 4; ++k) c[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return c;
}

/** Returns the matrix of a rotation, which is given by rows, followed by a translation. */
export function rigid(R, p) {
  return [
    R[0][0], R[1][0], R[2][0], 0, R[0][1], R[1][1], R[2][1], 0,
    R[0][2], R[1][2], R[2][2], 0, p[0], p[1], p[2], 1,
  ];
}

const FILLED = 0.86; // fraction of the picture's width or height that a fitted body fills
const OBLIQUE = 0.5; // [rad] angle between the longest extent and the plane of the picture

export class Camera {
  constructor(size) {
    this.yaw = 0.6;
    this.pitch = 0.4;
    this.distance = 3.4 * size;
    this.size = size;
    this.pan = [0, 0]; // [m] across the picture
  }
  /**
   * Moves the camera so that positions [m], relative to the target, fill a picture of this size with a margin.
   * `isCentred`: only centres the positions and keeps the distance.
   */
  fit(positions, width, height, isCentred = false) {
    if (positions.length === 0) return;
    const { right, up, back } = this.axes();
    const along = (axis) => positions.map((position) => position[0] * axis[0] + position[1] * axis[1] + position[2] * axis[2]);
    const depth = along(back), across = [along(right), along(up)];
    const slope = Math.tan(0.5 * Camera.ANGLE), slopes = [(slope * width) / height, slope];
    const deepest = Math.max(...depth);
    // iterates, because the centre on the screen depends on the distance and the distance depends on the centre
    for (let round = 0; round < 8; ++round) {
      const needed = across.map((values, axis) => Math.max(...values.map((value, k) =>
        depth[k] + Math.abs(value - this.pan[axis]) / (FILLED * slopes[axis]))));
      if (!isCentred) this.distance = Math.max(...needed, deepest + 0.02 * this.size, 1e-3 * this.size);
      across.forEach((values, axis) => {
        const ratios = values.map((value, k) => (value - this.pan[axis]) / Math.max(1e-9 * this.size, this.distance - depth[k]));
        this.pan[axis] += 0.5 * (Math.max(...ratios) + Math.min(...ratios)) * this.distance;
      });
    }
  }
  /** Rotates the camera until the longest horizontal extent of the positions lies across the picture. */
  face(positions) {
    let xx = 0, xy = 0, yy = 0;
    for (const [x, y] of positions) {
      xx += x * x;
      xy += x * y;
      yy += y * y;
    }
    if (Math.hypot(xx - yy, 2 * xy) > 0.05 * (xx + yy)) this.yaw = 0.5 * Math.atan2(2 * xy, xx - yy) - 0.5 * Math.PI + OBLIQUE;
  }
  turn(dx, dy) {
    this.yaw -= 0.008 * dx;
    this.pitch = Math.min(1.57, Math.max(-1.57, this.pitch + 0.008 * dy));
  }
  /** Moves the camera by a number of pixels in a picture of this height. */
  move(dx, dy, height) {
    const scale = this.metresPerPixel(height);
    this.pan[0] -= dx * scale;
    this.pan[1] += dy * scale;
  }
  approach(steps) {
    this.distance = Math.min(1e3 * this.size, Math.max(1e-3 * this.size, this.distance * 1.1 ** steps));
  }
  metresPerPixel(height) {
    return (2 * this.distance * Math.tan(0.5 * Camera.ANGLE)) / height;
  }
  /** Returns the axes of the picture in world axes: right, up, towards the eye. The world's z axis points up. */
  axes() {
    const cy = Math.cos(this.yaw), sy = Math.sin(this.yaw), cp = Math.cos(this.pitch), sp = Math.sin(this.pitch);
    return { right: [-sy, cy, 0], up: [-sp * cy, -sp * sy, cp], back: [cp * cy, cp * sy, sp] };
  }
  /** Returns the matrix from world axes, with the target at the origin, to clip coordinates. */
  matrix(width, height) {
    const { right, up, back } = this.axes();
    const view = rigid([right, up, back], [-this.pan[0], -this.pan[1], -this.distance]);
    const f = 1 / Math.tan(0.5 * Camera.ANGLE);
    const near = 0.01 * this.distance, far = this.distance + 100 * this.size;
    const projection = [
      (f * height) / width, 0, 0, 0, 0, f, 0, 0,
      0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0,
    ];
    return multiply(projection, view);
  }
}
Camera.ANGLE = 0.7; // [rad] vertical field of view

/** Returns the pixel of a position: [x, y, depth]; depth < 0 if the position is behind the eye. */
export function project(matrix, position, width, height) {
  const at = [0, 1, 2, 3].map(
    (row) => matrix[row] * position[0] + matrix[4 + row] * position[1] + matrix[8 + row] * position[2] + matrix[12 + row]);
  return [(0.5 + (0.5 * at[0]) / at[3]) * width, (0.5 - (0.5 * at[1]) / at[3]) * height, at[3]];
}
