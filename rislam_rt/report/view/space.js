// The camera: from points of the room [m] to the canvas, orbiting about the room's middle.
"use strict";
class Camera {
  constructor(bounds) {
    this.corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => bounds[(k >> i) & 1][i]));
    [this.width, this.height] = [600, 400];
    this.target = [0, 1, 2].map((i) => (bounds[0][i] + bounds[1][i]) / 2);
    this.size = Math.hypot(...[0, 1, 2].map((i) => bounds[1][i] - bounds[0][i])) || 1;
    this.lookAcross();
  }
  turn(yaw, pitch, zoom) {
    this.yaw = yaw;
    this.pitch = Math.max(-0.2, Math.min(Math.PI / 2, pitch));
    this.zoom = Math.max(0.3, Math.min(20, zoom));
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    this.right = [-sy, cy, 0];
    this.up = [-sp * cy, -sp * sy, cp];
    this.back = [cp * cy, cp * sy, sp];
    this.distance = 1.9 * this.size;
    this.eye = this.target.map((t, i) => t + this.distance * this.back[i]);
  }
  frame(width, height) {
    this.width = width;
    this.height = height;
    this.fill();
  }
  // So that the room, as it is looked at now, fills the canvas but for a margin.
  fill() {
    [this.base, this.zoom] = [1, 1];
    const places = this.corners.map((corner) => this.place(corner));
    const reach = (i, middle) => Math.max(...places.map((place) => Math.abs(place[i] - middle))) || 1;
    this.base = Math.min((0.47 * this.width) / reach(0, this.width / 2), (0.46 * this.height) / reach(1, this.height / 2));
  }
  // [x, y, depth]: pixels, and metres before the eye
  place(point) {
    const d = [point[0] - this.target[0], point[1] - this.target[1], point[2] - this.target[2]];
    const depth = this.flat ? this.distance : Math.max(this.distance - dot(d, this.back), 0.02 * this.size);
    const f = (this.base * this.zoom) / depth;
    return [this.width / 2 + f * dot(d, this.right), this.height / 2 - f * dot(d, this.up), depth];
  }
  look(yaw, pitch, flat) {
    this.flat = flat; // a plan: what is high stands where it is
    this.turn(yaw, pitch, 1.0);
    this.fill();
  }
  lookDown() { this.look(-Math.PI / 2, Math.PI / 2, true); }
  lookAcross() { this.look(-1.08, 0.5, false); }
}
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// Drag turns, wheel and two fingers zoom, double click resets; `moved` is told of every change, `picked` of clicks.
function steer(canvas, camera, moved, picked) {
  const fingers = new Map();
  let gap = 0, travelled = 0;
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    travelled = 0;
    if (fingers.size === 2) gap = spread();
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    travelled += Math.abs(dx) + Math.abs(dy);
    if (fingers.size === 2) {
      const now = spread();
      camera.turn(camera.yaw, camera.pitch, camera.zoom * (now / (gap || now)));
      gap = now;
    } else {
      camera.turn(camera.yaw - 0.008 * dx, camera.pitch + 0.008 * dy, camera.zoom);
    }
    moved();
  });
  const lift = (event) => {
    if (fingers.size === 1 && travelled < 5 && event.type === "pointerup") {
      const box = canvas.getBoundingClientRect();
      picked(event.clientX - box.left, event.clientY - box.top);
    }
    fingers.delete(event.pointerId);
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.turn(camera.yaw, camera.pitch, camera.zoom * Math.exp(-0.0012 * event.deltaY));
    moved();
  }, { passive: false });
}
