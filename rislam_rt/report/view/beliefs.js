// What each scheme's agent believes at a time: its way, itself with its ellipse, landmarks, the code, and a close-up.
class Beliefs {
  constructor(view, box) {
    this.view = view;
    for (const scheme of view.data.schemes) {
      view.state.on[scheme.name] = true;
      view.check(view.choices, scheme.name, true, (on) => { view.state.on[scheme.name] = on; }, scheme.colour);
    }
    view.state.images = false;
    view.check(view.choices, "mirror images", false, (on) => { view.state.images = on; });
    const side = make("div", box, "", "side");
    const figure = make("figure", side);
    this.near = make("canvas", figure);
    this.nearWords = make("figcaption", figure);
    this.codes = view.data.schemes.filter((scheme) => scheme.codes).map((scheme) => {
      const one = make("figure", side, "", "code");
      return { scheme, canvas: make("canvas", one), words: make("figcaption", one) };
    });
  }
  draw(at) {
    const { view } = this, { painter, data, state } = view, lines = [];
    painter.point(data.truth[at], "circle", 5, "#000");
    painter.name(data.truth[at], "agent", "#000", true);
    for (const scheme of data.schemes) {
      if (!state.on[scheme.name]) continue;
      painter.line(scheme.position.slice(0, at + 1), scheme.colour, 2);
      const lost = scheme.lost[at] === "1";
      painter.line(ring(scheme.position[at], scheme.ellipse[at]), scheme.colour, 1.5, 1, lost ? [3, 3] : []);
      painter.point(scheme.position[at], "circle", 3.5, scheme.colour);
      let points = 0, panels = [];
      for (const mark of scheme.landmarks) {
        const place = mark.at[at - mark.first];
        if (at < mark.first || !place) continue;
        if (mark.image) {
          if (state.images) painter.point(place, "circle", 2.5, scheme.colour, false);
          continue;
        }
        points += 1;
        const known = mark.panel[at - mark.first] === "1";
        painter.point(place, known ? "square" : "cross", 5, scheme.colour, false);
        if (known) panels.push(mark);
      }
      const [error, sigma] = scheme.error[at];
      lines.push(`${scheme.name}: ${size(error)} off (2σ ${size(2 * sigma)}), ${points} landmark${points === 1 ? "" : "s"}` +
        (scheme.codes ? knownPanels(panels.length, data.panels.length) : "") + (lost ? ", holds itself for lost" : ""));
    }
    view.said.textContent = lines.join(" · ");
    this.closeUp(at);
    for (const one of this.codes) this.drawCode(one, at);
  }
  // From above, the true place in the middle, as wide as the largest error needs.
  closeUp(at) {
    const { data, state } = this.view, shown = data.schemes.filter((scheme) => state.on[scheme.name]);
    const truth = data.truth[at], errors = shown.map((scheme) => scheme.error[at][0] + 2 * scheme.error[at][1]);
    const need = Math.max(0.02, 1.2 * Math.max(0, ...errors));
    const half = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 1e9].find((step) => step >= need), side = 190;
    const c = fit(this.near, side, side), f = side / 2 / half;
    this.near.style.width = `${side}px`;
    const xy = (p) => [side / 2 + f * (p[0] - truth[0]), side / 2 - f * (p[1] - truth[1])];
    const path = (points, colour, width, alpha) => {
      c.globalAlpha = alpha;
      c.strokeStyle = colour;
      c.lineWidth = width;
      c.beginPath();
      points.forEach((p, i) => { const [x, y] = xy(p); if (i) c.lineTo(x, y); else c.moveTo(x, y); });
      c.stroke();
      c.globalAlpha = 1;
    };
    c.clearRect(0, 0, side, side);
    path(data.track, "#000", 5, 0.22);
    for (const scheme of shown) {
      path(scheme.position.slice(0, at + 1), scheme.colour, 1.5, 1);
      path(ring(scheme.position[at], scheme.ellipse[at]), scheme.colour, 1.2, 1);
      c.fillStyle = scheme.colour;
      c.beginPath();
      c.arc(...xy(scheme.position[at]), 4, 0, 7);
      c.fill();
    }
    c.fillStyle = "#000";
    c.beginPath();
    c.arc(side / 2, side / 2, 3.5, 0, 7);
    c.fill();
    c.strokeStyle = "#bbb";
    c.lineWidth = 1;
    c.strokeRect(0.5, 0.5, side - 1, side - 1);
    this.nearWords.textContent = `Close-up from above, ${size(2 * half)} wide: the agent (black), estimates with their 2σ ellipses.`;
  }
  drawCode({ scheme, canvas, words }, at) {
    const parts = scheme.codes[at].split("|"), shapes = scheme.shapes, cell = Math.max(2, Math.floor(120 / Math.max(...shapes.map((s) => Math.max(...s)))));
    const width = shapes.reduce((sum, s) => sum + s[1] * cell + 6, 0), height = Math.max(...shapes.map((s) => s[0])) * cell;
    const c = fit(canvas, width, height);
    canvas.style.width = `${width}px`;
    let left = 0;
    parts.forEach((part, number) => {
      const [rows, cols] = shapes[number], digits = part.length / (rows * cols);
      for (let k = 0; k < rows * cols; k++) {
        const level = parseInt(part.slice(k * digits, (k + 1) * digits), 36), row = Math.floor(k / cols);
        c.fillStyle = `hsl(${(360 * level) / scheme.levels}, 55%, 58%)`;
        c.fillRect(left + (k % cols) * cell, (rows - 1 - row) * cell, cell - 0.5, cell - 0.5);
      }
      left += cols * cell + 6;
    });
    words.textContent = `Code of ${scheme.name}: ${scheme.levels} phase levels, a colour each.`;
  }
  pick() {}
}
const knownPanels = (known, all) =>
  all > 1 ? `, ${known} of ${all} panels known` : known ? ", panel known" : ", panel not known";
const size = (metres) => (metres < 1 ? `${Number((100 * metres).toPrecision(2))} cm` : `${Number(metres.toPrecision(2))} m`);

// The 2σ ellipse (axis a, axis b, angle) about a point.
function ring(center, [a, b, angle]) {
  const points = [];
  for (let k = 0; k <= 48; k++) {
    const u = a * Math.cos((2 * Math.PI * k) / 48), v = b * Math.sin((2 * Math.PI * k) / 48);
    points.push([center[0] + u * Math.cos(angle) - v * Math.sin(angle), center[1] + u * Math.sin(angle) + v * Math.cos(angle), center[2]]);
  }
  return points;
}
