const replayHelp = "Drag to turn, Shift and drag to move, use the wheel or two fingers to come closer. Keys: arrows turn, + and − come closer, space plays, 0 gives the first view.";

// A replay with its controls, as an element; with heading and help unless the page has them.
function replay(data, { heading = true, help = true } = {}) {
  const scene = decodeReplay(data), camera = new Camera(scene);
  const canvas = make("canvas", { role: "img", "aria-label": `${scene.name}. ${replayHelp}`, tabindex: "0" });
  const painter = new Painter(canvas, scene, camera);
  const shows = firstShown(scene), last = scene.frames.length - 1;
  const slider = make("input", { type: "range", min: 0, max: last, step: "any", value: 0, "aria-label": "time" });
  const time = make("span", { class: "time" });
  const play = make("button", { type: "button" });
  const state = { at: 0, running: false, seen: true, speed: 1 };

  function paint() {
    painter.paint(state.at, shows);
    time.textContent = timeText(scene, state.at);
  }
  function run(on) {
    state.running = on;
    play.textContent = on ? "pause" : "play";
  }
  function seek(to) {
    state.at = Math.max(0, Math.min(last, to));
    slider.value = state.at;
    paint();
  }

  play.onclick = () => {
    if (!state.running && state.at >= last) seek(0);
    run(!state.running);
  };
  slider.oninput = () => { run(false); seek(Number(slider.value)); };
  const step = (by) => { run(false); seek(Math.round(state.at) + by); };
  listen(canvas, camera, { paint, step, toggle: () => play.onclick() });
  document.addEventListener("theme", paint);
  new ResizeObserver(paint).observe(canvas);
  new IntersectionObserver((entries) => { state.seen = entries[0].isIntersecting; }).observe(canvas);
  run(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  animate(scene, state, seek);

  const reset = make("button", { type: "button" }, "first view");
  reset.onclick = () => { camera.reset(); paint(); };
  const toggles = Object.keys(shows).map((what) => toggle(what, shows, paint));
  const controls = make("div", { class: "controls" }, play, slider, time, speedChoice(state), reset, ...toggles);
  const head = heading ? [make("h3", {}, scene.name)] : [];
  if (scene.description) head.push(make("p", { class: "quiet" }, scene.description));
  const foot = help ? [make("p", { class: "quiet help" }, replayHelp)] : [];
  return make("div", { class: "replay" }, ...head, canvas, controls, replayLegend(scene), ...foot);
}

// What there is to show or to leave out, and which of it is shown at first: what does not hide the rest.
function firstShown(scene) {
  const moving = scene.bodies.filter((body) => !body.fixed).length;
  const named = scene.bodies.filter((body) => body.name !== undefined).length;
  const counts = contactCounts(scene), differ = counts.some((count, kind) => count && contactKinds[kind][2]);
  const shows = {};
  if (scene.arrows) shows.arrows = true;
  if (counts.some(Boolean)) shows.contacts = moving <= 200 || differ;
  if (moving) shows.trails = moving <= 12;
  if (named) shows.names = named <= 12;
  return shows;
}

function toggle(what, shows, paint) {
  const button = make("button", { type: "button", "aria-pressed": String(shows[what]) }, what);
  button.onclick = () => {
    shows[what] = !shows[what];
    button.setAttribute("aria-pressed", String(shows[what]));
    paint();
  };
  return button;
}

function speedChoice(state) {
  const speeds = [["¼ ×", 0.25], ["½ ×", 0.5], ["1 ×", 1], ["2 ×", 2], ["4 ×", 4]];
  const choice = make("select", { "aria-label": "speed" }, ...speeds.map(([text, value]) => make("option", { value }, text)));
  choice.value = "1";
  choice.onchange = () => { state.speed = Number(choice.value); };
  return choice;
}

// Goes on while it runs and is in sight; the end is seen for a moment.
function animate(scene, state, seek) {
  const last = scene.frames.length - 1, seconds = lasting(scene), rest = 0.8;
  let [before, rested] = [0, 0];
  requestAnimationFrame(function tick(now) {
    requestAnimationFrame(tick);
    const passed = Math.min(0.1, (now - before) / 1000);
    before = now;
    if (!state.running || !state.seen || !last) return;
    if (state.at < last) return seek(state.at + state.speed * passed * last / seconds);
    rested += passed;
    if (rested > rest) { rested = 0; seek(0); }
  });
}

// The simulated time at a frame, or between two.
function timeText(scene, at) {
  const first = Math.floor(at), last = scene.times.length - 1, next = Math.min(first + 1, last);
  const now = scene.times[first] + (at - first) * (scene.times[next] - scene.times[first]);
  return `${precisely(now, scene.times[last])} ${scene.time_unit}`.trim();
}

// As long as the run itself, if that is known and fit to look at.
function lasting(scene) {
  const all = scene.times[scene.times.length - 1] - scene.times[0];
  return ["", "s"].includes(scene.time_unit) ? Math.max(4, Math.min(20, all || 0)) : 12;
}

// With as many digits as three of the largest.
function precisely(x, largest) {
  const digits = largest > 0 ? Math.max(0, 2 - Math.floor(Math.log10(largest))) : 2;
  return digits > 6 ? x.toExponential(2) : x.toFixed(digits);
}

// By kind, how many there are.
function contactCounts(scene) {
  const counts = contactKinds.map(() => 0);
  for (const row of scene.contacts) for (let k = 3; k < row.length; k += 4) counts[row[k]]++;
  return counts;
}

// What the colours mean, of those that occur.
function replayLegend(scene) {
  const entry = (mark, text, kind = "") => make("li", { class: kind }, mark, text);
  const dot = (color) => make("span", { class: "key", style: `background:${color}` });
  const entries = [];
  contactCounts(scene).forEach((count, kind) => {
    if (count) entries.push(entry(dot(contactKinds[kind][0]), `${contactKinds[kind][1]} (${count} ×)`,
      contactKinds[kind][2] ? "differs" : ""));
  });
  if (scene.bodies.some((body) => body.fixed && body.parts.length)) entries.push(entry(dot("var(--fixed)"), "fixed"));
  if (scene.asleep.some((set) => set && set.size)) entries.push(entry(dot("color-mix(in srgb, #2f7fd6 38%, var(--view))"), "muted: asleep"));
  if (!scene.arrows) entries.push(entry("", "no arrows: no field gives a force on a resting point of unit mass and no charge"));
  else entries.push(entry(make("span", { class: "mark" }, "→"),
    `force on a resting point of unit mass and no charge; four times the force is twice the length; the longest stand for ${Number(scene.arrows.longest.toPrecision(3))} and more`));
  return make("ul", { class: "keys" }, ...entries);
}

// Mouse, fingers and keys.
function listen(canvas, camera, act) {
  const fingers = new Map();
  canvas.onpointerdown = (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); };
  canvas.onpointerup = canvas.onpointercancel = (e) => fingers.delete(e.pointerId);
  canvas.onpointermove = (e) => {
    const before = fingers.get(e.pointerId), now = [e.clientX, e.clientY];
    if (!before) return;
    const [right, down] = [now[0] - before[0], now[1] - before[1]];
    if (fingers.size === 1) {
      if (e.shiftKey || e.buttons & 2) camera.move(right, down);
      else camera.turn(right / 150, down / 150);
    } else {
      const other = [...fingers].find(([id]) => id !== e.pointerId)[1];
      const apart = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
      camera.closer(apart(now) / apart(before));
      camera.move(right / 2, down / 2);
    }
    fingers.set(e.pointerId, now);
    act.paint();
  };
  canvas.oncontextmenu = (e) => e.preventDefault();
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    camera.closer(Math.exp(-e.deltaY / 600));
    act.paint();
  }, { passive: false });
  const keys = {
    ArrowLeft: () => camera.turn(-0.1, 0), ArrowRight: () => camera.turn(0.1, 0),
    ArrowUp: () => camera.turn(0, -0.1), ArrowDown: () => camera.turn(0, 0.1),
    "+": () => camera.closer(1.15), "=": () => camera.closer(1.15), "-": () => camera.closer(1 / 1.15),
    "0": () => camera.reset(), " ": act.toggle, ",": () => act.step(-1), ".": () => act.step(1),
  };
  canvas.onkeydown = (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || !keys[e.key]) return;
    e.preventDefault();
    keys[e.key]();
    act.paint();
  };
}
