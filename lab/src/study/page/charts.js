const data = JSON.parse(document.getElementById("data").textContent);
const draw = (tag, attributes = {}, text) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  return element;
};
const short = (x) => x === null ? "none" : x === 0 ? "0" : Math.abs(x) >= 1e-2 && Math.abs(x) < 1e4
  ? String(Number(x.toPrecision(3))) : x.toExponential(1);

// Blue and green for this crate, red and brown without it; each can be told from its neighbours.
const ours = ["#1f77d0", "#0f9d76", "#7a5cd6", "#12a5b8", "#5c9e1c", "#3d5a9e", "#a05bb5", "#0b6e4f", "#4b83ff", "#19b27b", "#8c7bd8", "#2b9fd0"];
const theirs = ["#d6452c", "#e08a00", "#b5651d", "#c2185b", "#8d6e63", "#d98032"];
const colors = new Map();
{
  let own = 0, other = 0;
  for (const [name, isOurs] of data.methods)
    colors.set(name, isOurs ? ours[own++ % ours.length] : theirs[other++ % theirs.length]);
}
const isOurs = new Map(data.methods);
const hidden = new Set();
const precisions = [...new Set(data.runs.map((run) => run.precision))].sort();
let precision = precisions[0];

const W = 520, H = 380, LEFT = 58, RIGHT = 12, TOP = 10, BOTTOM = 44;

function ticks(low, high, most) {
  const step = Math.max(1, Math.ceil((high - low) / most));
  const all = [];
  for (let x = Math.ceil(low); x <= high; x += step) all.push(x);
  return all;
}

function power(exponent) {
  const sign = exponent < 0 ? "−" : "";
  const digits = String(Math.abs(exponent)).replace(/\d/g, (d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]);
  return exponent === 0 ? "1" : "10" + sign.replace("−", "⁻") + digits;
}

function chart(scene, metric) {
  const runs = data.runs.filter((run) => run.case === scene.name && run.precision === precision
    && run.errors[metric] !== undefined && run.errors[metric] !== null && !run.diverged);
  // What is exactly right has no logarithm: it is drawn at the left edge.
  const errors = runs.map((run) => run.errors[metric]).filter((x) => x > 0);
  const least = errors.length ? Math.min(...errors) : 1e-16;
  const x = (run) => Math.log10(run.errors[metric] > 0 ? run.errors[metric] : least / 3);
  const y = (seconds, run) => Math.log10(1e6 * seconds / run.simulated);
  const svg = draw("svg", { viewBox: `0 0 ${W} ${H}`, role: "img",
    "aria-label": `${scene.name}: cost against error (${metric})` });
  if (!runs.length) {
    svg.append(draw("text", { x: W / 2, y: H / 2, "text-anchor": "middle" }, "no run came to anything"));
    return svg;
  }
  const xs = runs.map(x), ys = runs.flatMap((run) => [y(run.seconds.q1, run), y(run.seconds.q3, run)]);
  const [x0, x1] = [Math.min(...xs) - 0.15, Math.max(...xs) + 0.15];
  const [y0, y1] = [Math.min(...ys) - 0.15, Math.max(...ys) + 0.15];
  const px = (v) => LEFT + (v - x0) / (x1 - x0) * (W - LEFT - RIGHT);
  const py = (v) => H - BOTTOM - (v - y0) / (y1 - y0) * (H - TOP - BOTTOM);
  for (const t of ticks(x0, x1, 7)) {
    svg.append(draw("line", { class: "grid", x1: px(t), x2: px(t), y1: TOP, y2: H - BOTTOM }));
    svg.append(draw("text", { x: px(t), y: H - BOTTOM + 17, "text-anchor": "middle" }, power(t)));
  }
  for (const t of ticks(y0, y1, 6)) {
    svg.append(draw("line", { class: "grid", x1: LEFT, x2: W - RIGHT, y1: py(t), y2: py(t) }));
    svg.append(draw("text", { x: LEFT - 6, y: py(t) + 4, "text-anchor": "end" }, power(t)));
  }
  const unit = data.metrics[metric].unit;
  svg.append(draw("text", { x: (LEFT + W - RIGHT) / 2, y: H - 8, "text-anchor": "middle" },
    `error: ${metric}${unit === "1" ? "" : ", " + unit}`));
  const label = draw("text", { transform: `translate(13 ${(TOP + H - BOTTOM) / 2}) rotate(-90)`, "text-anchor": "middle" },
    `µs per ${scene.time_unit}`);
  svg.append(label);
  for (const [method] of data.methods) {
    if (hidden.has(method)) continue;
    const own = runs.filter((run) => run.method === method).sort((a, b) => b.dt - a.dt);
    if (!own.length) continue;
    const color = colors.get(method);
    const group = draw("g", { stroke: color, fill: color });
    const points = own.map((run) => `${px(x(run)).toFixed(1)},${py(y(run.seconds.median, run)).toFixed(1)}`);
    group.append(draw("polyline", { points: points.join(" "), fill: "none", "stroke-width": 2,
      "stroke-dasharray": isOurs.get(method) ? "none" : "5 4" }));
    for (const run of own) {
      const [at, mid] = [px(x(run)), py(y(run.seconds.median, run))];
      group.append(draw("line", { x1: at, x2: at, y1: py(y(run.seconds.q1, run)), y2: py(y(run.seconds.q3, run)), "stroke-width": 1.5 }));
      const dot = draw("circle", { cx: at, cy: mid, r: 3.4, "stroke-width": 1.4, fill: run.warned ? "var(--panel)" : color });
      dot.append(draw("title", {}, `${method}, dt ${short(run.dt)}: error ${short(run.errors[metric])}, ${short(run.cost)} µs per ${scene.time_unit}`
        + (run.warned ? ", warned" : "")));
      group.append(dot);
    }
    svg.append(group);
  }
  return svg;
}

function legend(methods) {
  const box = make("div", { class: "legend" });
  for (const method of methods) {
    const swatch = draw("svg", { viewBox: "0 0 22 8", style: "width:22px;height:8px" });
    swatch.append(draw("line", { x1: 0, x2: 22, y1: 4, y2: 4, stroke: colors.get(method), "stroke-width": 3,
      "stroke-dasharray": isOurs.get(method) ? "none" : "5 3" }));
    const button = make("button", { type: "button", "aria-pressed": String(!hidden.has(method)) }, swatch, method);
    button.onclick = () => {
      hidden.has(method) ? hidden.delete(method) : hidden.add(method);
      show();
    };
    box.append(button);
  }
  return box;
}

function table(rows, numbers = []) {
  const parts = rows.map((row, line) => make("tr", {}, ...row.map((cell, column) =>
    make(line ? "td" : "th", numbers.includes(column) ? { class: "number" } : {}, cell))));
  return parts;
}

function runsTable(scene) {
  const runs = data.runs.filter((run) => run.case === scene.name && run.precision === precision);
  const metrics = [...new Set(runs.flatMap((run) => Object.keys(run.errors)))];
  const head = ["method", "dt", "steps", "evaluations", ...metrics, "µs", "spread", ""];
  const rows = runs.map((run) => [run.method, short(run.dt), String(run.steps), run.evaluations ? String(run.evaluations) : "",
    ...metrics.map((metric) => run.errors[metric] === undefined ? "" : short(run.errors[metric])),
    short(run.cost), (100 * (run.seconds.q3 - run.seconds.q1) / run.seconds.median).toFixed(0) + " %",
    [run.diverged ? "came to nothing" : "", run.warned ? "warned" : ""].filter(Boolean).join(", ")]);
  const wide = make("div", { class: "wide" }, make("table", {}, ...table([head, ...rows], head.map((_, i) => i).filter((i) => i && i < head.length - 1))));
  return make("details", {}, make("summary", {}, `all ${runs.length} runs`), wide);
}

function show() {
  const scenes = document.getElementById("scenes"), contents = document.getElementById("contents");
  const open = [...scenes.querySelectorAll("details[open]")].map((it) => it.parentElement.id);
  scenes.replaceChildren();
  contents.replaceChildren();
  data.scenes.forEach((scene, place) => {
    const runs = data.runs.filter((run) => run.case === scene.name && run.precision === precision);
    if (!runs.length) return;
    const id = `scene-${place}`;
    contents.append(make("a", { href: "#" + id }, scene.name));
    const metrics = [...new Set(runs.flatMap((run) => Object.keys(run.errors)))].slice(0, 2);
    const advice = data.advice.filter((it) => it.case === scene.name && it.precision === precision);
    const methods = data.methods.map((it) => it[0]).filter((it) => runs.some((run) => run.method === it));
    const article = make("article", { class: "scene", id }, make("h3", {}, scene.name), make("p", { class: "quiet" }, scene.description),
      legend(methods), make("div", { class: "charts" }, ...metrics.map((metric) => chart(scene, metric))),
      make("ul", {}, ...advice.map((it) => make("li", {}, it.sentence))), runsTable(scene));
    if (open.includes(id)) article.querySelector("details").open = true;
    scenes.append(article);
  });
  const rows = [["scene", "error of", "error", "best with fields", "µs", "best without", "µs", "without / with"]];
  for (const it of data.advice.filter((it) => it.precision === precision)) {
    const name = (best) => best ? best[0] : "none gets there";
    const cost = (best) => best ? short(best[1]) : "";
    rows.push([it.case, it.metric, short(it.target), name(it.ours), cost(it.ours), name(it.theirs), cost(it.theirs),
      it.ours && it.theirs ? (it.theirs[1] / it.ours[1]).toPrecision(2) : ""]);
  }
  document.getElementById("advice").replaceChildren(...table(rows, [2, 4, 6, 7]));
  const own = data.overall.filter((it) => it.startsWith(`f${precision}`));
  document.getElementById("overall").replaceChildren(...own.map((it) => make("li", {}, it)));
  showStability();
  showCosts();
  for (const button of document.querySelectorAll("#precisions button"))
    button.setAttribute("aria-pressed", String(Number(button.dataset.bits) === precision));
}

const classColors = { ".": "#8fd6b0", "~": "#f2d36b", d: "#c3cede", w: "#9cc3ff", X: "#f0a35e", R: "#b9a5e8", "!": "#ef6f6c" };
const cellOf = (cls, text, title) => make("span", { class: "cell", style: `background:${classColors[cls]}`, title }, text);

function showStability() {
  const cells = data.stability.filter((it) => it.precision === precision);
  document.getElementById("stability").hidden = !cells.length;
  if (!cells.length) return;
  const legend = document.getElementById("legend");
  legend.replaceChildren(...data.legend.flatMap(([cls, text]) => [cellOf(cls, cls, text), ` ${text}  `]));
  document.getElementById("safe").replaceChildren(...table([["scheme", "stable in all undamped scenes up to dt·ω"],
    ...data.safe.map(([scheme, turn]) => [scheme, turn === null ? "none" : String(turn)])], [1]));
  const schemes = [...new Set(cells.map((it) => it.scheme))], turns = [...new Set(cells.map((it) => it.turn))];
  const maps = document.getElementById("maps");
  const open = [...maps.querySelectorAll("details[open]")].map((it) => it.dataset.kind);
  maps.replaceChildren();
  for (const kind of new Set(cells.map((it) => it.kind))) {
    const details = make("details", { "data-kind": kind }, make("summary", {}, kind));
    details.open = open.includes(kind);
    for (const damping of new Set(cells.filter((it) => it.kind === kind).map((it) => it.damping))) {
      const rows = [[`damping: ${damping}`, ...turns.map(String)]];
      for (const scheme of schemes) {
        const own = cells.filter((it) => it.kind === kind && it.damping === damping && it.scheme === scheme);
        rows.push([scheme, ...turns.map((turn) => {
          const it = own.find((it) => it.turn === turn);
          const most = it.most === null ? "∞" : it.most < 100 ? it.most.toFixed(2) : it.most.toExponential(0);
          return cellOf(it.class, most, `largest energy ${most}`);
        })]);
      }
      details.append(make("div", { class: "wide maps" }, make("table", {}, ...table(rows))));
    }
    maps.append(details);
  }
}

function showCosts() {
  const spared = data.leaves_out.filter((it) => it.precision === precision);
  document.getElementById("leaves-out").hidden = !spared.length;
  document.getElementById("spared").replaceChildren(...table([["scene", "with", "step, µs", "times as long", "middle half", "change"],
    ...spared.map((it) => [it.case, it.switch, short(1e6 * it.step), it.ratios[1].toFixed(2),
      `${it.ratios[0].toFixed(2)} to ${it.ratios[2].toFixed(2)}`, short(it.change)])], [2, 3, 4, 5]));
  const paced = data.real_time.filter((it) => it.precision === precision);
  document.getElementById("real-time").hidden = !paced.length;
  document.getElementById("paced").replaceChildren(...table([["scene", "bodies", "step, ms", "too many", "step, ms"],
    ...paced.map((it) => [it.scene, String(it.count), short(1e3 * it.step), it.beyond ? String(it.beyond[0]) : "not reached",
      it.beyond ? short(1e3 * it.beyond[1]) : ""])], [1, 2, 3, 4]));
}

{
  const m = data.machine;
  document.getElementById("machine").textContent =
    `${m.processor}, one thread of ${m.threads}; ${m.system}; version ${m.version}, commit ${m.commit}.`;
  for (const bits of precisions) {
    const button = make("button", { type: "button", "data-bits": bits }, `f${bits}`);
    button.onclick = () => { precision = bits; show(); };
    document.getElementById("precisions").append(button, " ");
  }
  document.getElementById("theme").onclick = switchTheme;
  for (const [name, about] of Object.entries(data.metrics))
    document.getElementById("metrics").append(make("dt", {}, about.unit === "1" ? name : `${name}, ${about.unit}`),
      make("dd", {}, `${about.definition}. Why: ${about.reason}.`));
  show();
  const section = document.getElementById("replays");
  if (data.replays.length) section.append(make("p", { class: "quiet" }, replayHelp),
    make("div", { class: "replays" }, ...data.replays.map((it) => replay(it, { help: false }))));
  else section.remove();
}
