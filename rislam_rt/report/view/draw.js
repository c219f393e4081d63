// Drawing on a canvas: walls from the farthest to the nearest, then lines and points, then names that do not overlap.
class Painter {
  constructor(context, camera) {
    this.context = context;
    this.camera = camera;
    this.names = [];
  }
  clear(width, height) {
    this.context.clearRect(0, 0, width, height);
    this.names = [];
  }
  // Walls between the eye and the room are all but invisible, as a doll's house has its front open.
  walls(walls, shade, middle) {
    const eye = this.camera.eye;
    const sorted = walls.map((wall) => [Math.hypot(...wall.center.map((c, i) => c - eye[i])), wall]);
    sorted.sort((a, b) => b[0] - a[0]);
    for (const [, wall] of sorted) {
      const side = dot(wall.normal, eye) - wall.offset, room = dot(wall.normal, middle) - wall.offset;
      const front = side * room < 0;
      if (shade > 0) {
        this.context.globalAlpha = front ? 0.12 * shade : 0.75 * shade;
        this.context.fillStyle = wall.colour || "#9fb3c8";
        this.context.beginPath();
        for (const corners of wall.triangles) this.trace(corners, true);
        this.context.fill("nonzero");
      }
      this.context.globalAlpha = front ? 0.25 : 0.8;
      this.context.strokeStyle = "#6b7785";
      this.context.lineWidth = 1;
      this.context.setLineDash([]);
      this.context.beginPath();
      for (const edge of wall.edges) this.trace(edge, false);
      this.context.stroke();
      this.context.globalAlpha = 1;
      wall.front = front;
    }
  }
  trace(points, closed) {
    points.forEach((point, i) => {
      const [x, y] = this.camera.place(point);
      if (i) this.context.lineTo(x, y); else this.context.moveTo(x, y);
    });
    if (closed) this.context.closePath();
  }
  line(points, colour, width, alpha = 1, dash = []) {
    if (points.length < 2) return;
    this.context.globalAlpha = alpha;
    this.context.strokeStyle = colour;
    this.context.lineWidth = width;
    this.context.lineJoin = "round";
    this.context.setLineDash(dash);
    this.context.beginPath();
    this.trace(points, false);
    this.context.stroke();
    this.context.setLineDash([]);
    this.context.globalAlpha = 1;
  }
  face(points, fill, stroke) {
    this.context.beginPath();
    this.trace(points, true);
    this.context.globalAlpha = 0.75;
    this.context.fillStyle = fill;
    this.context.fill();
    this.context.globalAlpha = 1;
    this.context.strokeStyle = stroke;
    this.context.lineWidth = 1.2;
    this.context.stroke();
  }
  // What hides and reflects nothing. Triangle by triangle: in one path the front and the back of a body cancel.
  shade(triangles) {
    this.context.globalAlpha = 0.2;
    this.context.fillStyle = "#666";
    for (const corners of triangles) {
      this.context.beginPath();
      this.trace(corners, true);
      this.context.fill();
    }
    this.context.globalAlpha = 1;
  }
  point(point, shape, size, colour, filled = true) {
    const [x, y] = this.camera.place(point), c = this.context;
    c.strokeStyle = colour;
    c.fillStyle = colour;
    c.lineWidth = 2;
    c.beginPath();
    if (shape === "circle") c.arc(x, y, size, 0, 7);
    else if (shape === "square") c.rect(x - size, y - size, 2 * size, 2 * size);
    else { c.moveTo(x - size, y - size); c.lineTo(x + size, y + size); c.moveTo(x + size, y - size); c.lineTo(x - size, y + size); }
    if (shape === "cross" || !filled) c.stroke(); else c.fill();
  }
  name(point, text, colour = "#222", strong = false) {
    const [x, y] = this.camera.place(point);
    this.names.push([x, y, text, colour, strong]);
  }
  // Those asked for first come first; a name that would cover another is left out.
  write(width, height) {
    const taken = [], c = this.context;
    for (const [x, y, text, colour, strong] of this.names) {
      c.font = `${strong ? "600 " : ""}12px system-ui, sans-serif`;
      const wide = c.measureText(text).width;
      const left = Math.max(2, Math.min(width - wide - 2, x + 8)), top = Math.max(2, Math.min(height - 16, y - 7));
      if (x < -40 || y < -20 || x > width + 40 || y > height + 20) continue;
      if (taken.some((box) => left < box[2] && left + wide > box[0] && top < box[3] && top + 14 > box[1])) continue;
      taken.push([left, top, left + wide, top + 14]);
      c.fillStyle = "rgba(255,255,255,0.72)";
      c.fillRect(left - 2, top - 1, wide + 4, 16);
      c.fillStyle = colour;
      c.fillText(text, left, top + 11);
    }
  }
}

// A canvas as large as its box, sharp on fine screens.
function fit(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  canvas.style.height = `${height}px`;
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}

// Distance [px] of a place on the canvas from a line through points of the room.
function away(camera, points, x, y) {
  let least = Infinity;
  for (let i = 0; i + 1 < points.length; i++) {
    const [a, b] = [camera.place(points[i]), camera.place(points[i + 1])];
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const share = Math.max(0, Math.min(1, ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1)));
    least = Math.min(least, Math.hypot(x - a[0] - share * dx, y - a[1] - share * dy));
  }
  return least;
}
