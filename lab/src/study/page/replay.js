// Spheres and boxes in the order of their depth: enough to see what a scene does, in a few lines.
function replay(scene) {
  const canvas = make("canvas", { role: "img", "aria-label": scene.name, tabindex: "0" });
  const play = make("button", { type: "button" }, "pause");
  const slider = make("input", { type: "range", min: 0, max: scene.frames.length - 1, value: 0, "aria-label": "time" });
  const time = make("span", { class: "quiet" });
  const key = make("p", { class: "quiet" }, scene.description);
  if (scene.contacts) for (const [color, text] of [["#19a974", "both detect"], ["#e0a100", "fields only"], ["#d6452c", "Rapier only"]])
    key.append(make("span", { class: "key", style: `background:${color}` }), text);
  const box = make("div", { class: "replay" }, make("h3", {}, scene.name), key, canvas, make("div", { class: "controls" }, play, slider, time));
  let [yaw, pitch, zoom, running, at, seen] = [0.6, 0.35, 1, true, 0, true];
  const context = canvas.getContext("2d");
  const [cx, cy, cz] = scene.center;

  const turn = (q, v) => {
    const [x, y, z, w] = q, [a, b, c] = v;
    const t = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
    return [a + w * t[0] + y * t[2] - z * t[1], b + w * t[1] + z * t[0] - x * t[2], c + w * t[2] + x * t[1] - y * t[0]];
  };

  function paint() {
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    if (!w) return;
    if (canvas.width !== Math.round(w * ratio)) { canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio); }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, w, h);
    const style = getComputedStyle(document.documentElement);
    const [ink, line] = [style.getPropertyValue("--quiet"), style.getPropertyValue("--line")];
    const scale = zoom * Math.min(w, h) / (2.3 * scene.radius);
    const [sy, cyaw, sp, cp] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
    const project = ([x, y, z]) => {
      const [a, b, c] = [x - cx, y - cy, z - cz];
      const u = cyaw * a - sy * c, v = sy * a + cyaw * c;
      const up = cp * b - sp * v, depth = sp * b + cp * v;
      const near = 1 / (1 - depth / (5 * scene.radius));
      return [w / 2 + u * scale * near, h / 2 - up * scale * near, depth, scale * near];
    };
    const stroke = (points, color, width) => {
      context.strokeStyle = color; context.lineWidth = width; context.beginPath();
      points.forEach((p, i) => i ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1]));
      context.stroke();
    };
    for (const edge of scene.lines || []) stroke(edge.map(project), line, 1);
    for (const [from, to] of scene.arrows || []) {
      const [a, b] = [project(from), project(to)];
      stroke([a, b], ink, 1);
      context.fillStyle = ink; context.beginPath(); context.arc(b[0], b[1], 1.8, 0, 7); context.fill();
    }
    const frame = scene.frames[at], items = [];
    scene.bodies.forEach((body, i) => {
      const pose = frame.slice(7 * i, 7 * i + 7), q = pose.slice(3);
      const world = (p) => { const r = turn(q, p); return [pose[0] + r[0], pose[1] + r[1], pose[2] + r[2]]; };
      for (const part of body) {
        const middle = project(world(part.at));
        if (part.radius) items.push([middle[2], () => {
          const r = Math.max(part.radius * middle[3], 0.5);
          const shade = context.createRadialGradient(middle[0] - r / 3, middle[1] - r / 3, r / 8, middle[0], middle[1], r);
          shade.addColorStop(0, part.light); shade.addColorStop(1, part.color);
          context.fillStyle = shade; context.beginPath(); context.arc(middle[0], middle[1], r, 0, 7); context.fill();
        }]);
        else items.push([middle[2], () => {
          const [a, b, c] = part.half;
          const corner = (i) => project(world([part.at[0] + (i & 1 ? a : -a), part.at[1] + (i & 2 ? b : -b), part.at[2] + (i & 4 ? c : -c)]));
          const corners = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
          const faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
            .map((f) => [f.reduce((s, i) => s + corners[i][2], 0), f]).sort((p, q) => p[0] - q[0]).slice(3);
          faces.forEach(([, f], i) => {
            context.fillStyle = i === 2 ? part.light : part.color; context.strokeStyle = ink; context.lineWidth = 0.6;
            context.beginPath(); f.forEach((i, k) => k ? context.lineTo(corners[i][0], corners[i][1]) : context.moveTo(corners[i][0], corners[i][1]));
            context.closePath(); context.fill(); context.stroke();
          });
        }]);
      }
    });
    items.sort((a, b) => a[0] - b[0]).forEach((it) => it[1]());
    // A contact flashes for a few frames.
    for (let back = 0; scene.contacts && back < 6 && at - back >= 0; back++)
      for (const [x, y, z, kind] of scene.contacts[at - back]) {
        const p = project([x, y, z]);
        context.globalAlpha = 1 - back / 6;
        context.fillStyle = ["#19a974", "#e0a100", "#d6452c"][kind];
        context.beginPath(); context.arc(p[0], p[1], 4 + back, 0, 7); context.fill();
        context.globalAlpha = 1;
      }
    time.textContent = `${(at * scene.interval).toPrecision(3)} ${scene.time_unit}`;
  }

  let last = 0;
  function tick(now) {
    requestAnimationFrame(tick);
    if (!running || !seen || now - last < 33) return;
    last = now;
    at = (at + 1) % scene.frames.length;
    slider.value = at;
    paint();
  }
  play.onclick = () => { running = !running; play.textContent = running ? "pause" : "play"; };
  slider.oninput = () => { at = Number(slider.value); running = false; play.textContent = "play"; paint(); };
  const fingers = new Map();
  canvas.onpointerdown = (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); };
  canvas.onpointerup = canvas.onpointercancel = (e) => fingers.delete(e.pointerId);
  canvas.onpointermove = (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    if (fingers.size === 1) {
      yaw += (e.clientX - before[0]) / 150;
      pitch = Math.max(-1.5, Math.min(1.5, pitch + (e.clientY - before[1]) / 150));
    } else {
      const others = [...fingers].filter(([id]) => id !== e.pointerId).map((it) => it[1]);
      const apart = (p) => Math.hypot(p[0] - others[0][0], p[1] - others[0][1]);
      zoom *= apart([e.clientX, e.clientY]) / Math.max(apart(before), 1);
    }
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    paint();
  };
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom *= Math.exp(-e.deltaY / 600); paint(); }, { passive: false });
  canvas.onkeydown = (e) => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
    if (!step) return;
    e.preventDefault();
    [yaw, pitch] = [yaw + step[0], pitch + step[1]];
    paint();
  };
  document.addEventListener("theme", paint);
  new ResizeObserver(paint).observe(canvas);
  new IntersectionObserver((entries) => { seen = entries[0].isIntersecting; }).observe(canvas);
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) play.onclick();
  requestAnimationFrame(tick);
  return box;
}

{
  const section = document.getElementById("replays");
  if (data.replays.length) section.append(make("div", { class: "replays" }, ...data.replays.map(replay)));
  else section.remove();
}
