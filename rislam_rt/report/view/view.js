// One view: a room, and in it the paths of a pose (scene) or what an agent believes at a time (run).
const make = (tag, parent, words, kind) => {
  const element = document.createElement(tag);
  if (words) element.textContent = words;
  if (kind) element.className = kind;
  parent.appendChild(element);
  return element;
};

class View {
  constructor(box) {
    this.data = JSON.parse(box.querySelector("script").textContent);
    this.camera = new Camera(this.data.bounds);
    this.state = { at: this.data.first || 0, walls: 0.5, names: true, heard: false, on: {}, picked: null };
    const stage = make("div", box, "", "stage");
    this.canvas = make("canvas", stage);
    this.said = make("div", box, "", "said");
    this.buildTime(box);
    this.buildBoxes(box);
    this.extra = this.data.kind === "run" ? new Beliefs(this, box) : new PathsOf(this);
    steer(this.canvas, this.camera, () => this.draw(), (x, y) => this.extra.pick(x, y));
    this.box = box;
    if (this.data.above) this.camera.lookDown();
    new ResizeObserver(() => this.resize()).observe(stage);
    this.resize();
  }
  buildTime(box) {
    const count = this.data.time.length, row = make("div", box, "", "time");
    if (this.data.kind === "run") {
      this.player = make("button", row, "▶");
      this.player.title = "play";
      this.player.addEventListener("click", () => this.play());
    }
    this.slider = make("input", row);
    Object.assign(this.slider, { type: "range", min: 0, max: count - 1, step: 1, value: this.state.at });
    this.slider.setAttribute("aria-label", "time");
    this.slider.addEventListener("input", () => this.to(Number(this.slider.value)));
    this.clock = make("span", row);
  }
  buildBoxes(box) {
    const row = make("div", box, "", "row");
    const button = (words, act) => make("button", row, words).addEventListener("click", () => { act(); this.draw(); });
    button("from above", () => this.camera.lookDown());
    button("aslant", () => this.camera.lookAcross());
    this.check(row, "names", this.state.names, (on) => { this.state.names = on; });
    const label = make("label", row, "walls");
    const shade = make("input", label);
    Object.assign(shade, { type: "range", min: 0, max: 1, step: 0.05, value: this.state.walls });
    shade.style.width = "6rem";
    shade.addEventListener("input", () => { this.state.walls = Number(shade.value); this.draw(); });
    this.choices = make("div", box, "", "row");
  }
  check(row, words, on, act, colour) {
    const label = make("label", row), input = make("input", label);
    input.type = "checkbox";
    input.checked = on;
    if (colour) make("span", label, "", "swatch").style.background = colour;
    const text = make("span", label, words);
    input.addEventListener("change", () => { act(input.checked); this.draw(); });
    return text;
  }
  to(at) {
    this.state.at = at;
    this.slider.value = at;
    this.draw();
  }
  play() {
    const last = this.data.time.length - 1;
    if (this.timer) {
      clearInterval(this.timer);
      this.timer = null;
    } else {
      if (this.state.at >= last) this.to(0);
      this.timer = setInterval(() => {
        if (this.state.at >= last) this.play(); else this.to(this.state.at + 1);
      }, 80);
    }
    this.player.textContent = this.timer ? "⏸" : "▶";
  }
  resize() {
    const width = this.canvas.parentElement.clientWidth;
    const height = Math.round(Math.max(260, Math.min(0.62 * window.innerHeight, 0.72 * width)));
    this.painter = new Painter(fit(this.canvas, width, height), this.camera);
    this.camera.frame(width, height);
    this.draw();
  }
  draw() {
    const { data, painter, camera, state } = this;
    painter.clear(camera.width, camera.height);
    painter.walls(data.walls, state.walls, camera.target);
    painter.shade(data.shades);
    painter.line(data.track, "#000", 4, 0.22);
    for (const panel of data.panels) {
      painter.face(panel.corners, "#d55e00", "#000");
      painter.point(panel.center, "square", 6, "#000", false);
    }
    for (const thing of data.scatterers) painter.point(thing.position, "circle", 6, "#000", false);
    this.extra.draw(state.at);
    for (const mark of [...data.panels, ...data.scatterers]) painter.name(mark.center || mark.position, mark.name, "#000", true);
    if (data.track.length) painter.name(data.track[0], "start");
    if (state.names) for (const wall of data.walls) if (wall.label && !wall.front) painter.name(wall.center, wall.label, "#54606e");
    painter.write(camera.width, camera.height);
    this.clock.textContent = `${data.time[state.at].toFixed(1)} s`;
  }
}

// The paths of the pose that the slider stands at, by class.
class PathsOf {
  constructor(view) {
    this.view = view;
    for (const name of Object.keys(view.data.classes)) {
      view.state.on[name] = !view.data.hidden.includes(name);
    }
    this.words = {};
    for (const [name, colour] of Object.entries(view.data.classes)) {
      this.words[name] = view.check(view.choices, name, view.state.on[name], (on) => { view.state.on[name] = on; }, colour);
    }
    view.check(view.choices, "only what is heard", false, (on) => { view.state.heard = on; });
  }
  shown(at) {
    const { state, data } = this.view;
    return data.poses[at].paths.filter((path) => state.on[path.k] && (!state.heard || path.s >= 0));
  }
  draw(at) {
    const { painter, data, state, said } = this.view, pose = data.poses[at], count = {};
    for (const path of pose.paths) {
      count[path.k] = count[path.k] || [0, 0];
      count[path.k][0] += 1;
      count[path.k][1] += path.s >= 0 ? 1 : 0;
    }
    for (const name of Object.keys(this.words)) {
      const [all, heard] = count[name] || [0, 0];
      this.words[name].textContent = `${name} ${heard}/${all}`;
    }
    for (const path of this.shown(at)) {
      const strong = path.k === "PS" || path.k === "RIS" || path.l === state.picked;
      const alpha = state.picked && path.l !== state.picked ? 0.25 : path.s >= 0 ? 0.95 : 0.45;
      painter.line(path.p, data.classes[path.k], strong ? 2.6 : 1.3, alpha, path.s >= 0 ? [] : [5, 4]);
    }
    painter.point(pose.at, "circle", 5, "#000");
    painter.name(pose.at, "agent", "#000", true);
    const chosen = pose.paths.find((path) => path.l === state.picked);
    said.textContent = chosen
      ? `${chosen.l}: ${chosen.d.toFixed(2)} m, ${chosen.g.toFixed(1)} dB, ${Math.abs(chosen.s).toFixed(1)} dB ${chosen.s < 0 ? "below" : "above"} the threshold`
      : `Beside each class: paths heard / paths there (${data.about}). Dashed: too weak. Click on a path to see which it is.`;
  }
  pick(x, y) {
    const { state, camera } = this.view;
    let best = 12;
    state.picked = null;
    for (const path of this.shown(state.at)) {
      const gap = away(camera, path.p, x, y);
      if (gap < best) { best = gap; state.picked = path.l; }
    }
    this.view.draw();
  }
}
