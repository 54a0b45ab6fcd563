// Paints one moment: back to front, faces shaded, what is far away paler.
const bodyColors = ["#2f7fd6", "#e07b2a", "#1c9f78", "#8a63d8", "#d3506b", "#c79a1e", "#2aa5b8", "#a0673c"];
const contactKinds = [
  ["#19a974", "contact, found by the fields and by Rapier", false],
  ["#e0a100", "only the fields find a contact", true],
  ["#d6452c", "only Rapier finds a contact", true],
  ["#c026d3", "both find a contact, but differ in where or how deep it is", true],
  ["#19a974", "contact, found by the fields", false],
  ["#4c7de0", "contact, found by Rapier", false],
];

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
const mix = (from, to, share) => from.map((x, k) => Math.round(x + share * (to[k] - x)));
const css = (color) => `rgb(${color[0]},${color[1]},${color[2]})`;

// Colours of the page as it is now, light or dark.
function pageColors() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => rgb(style.getPropertyValue(name).trim());
  return { back: of("--view"), wall: of("--wall"), line: of("--line"), ink: of("--ink"), quiet: of("--quiet"),
    fixed: of("--fixed") };
}

const turned = (q, at, v) => {
  const x = q[at], y = q[at + 1], z = q[at + 2], w = q[at + 3];
  const a = 2 * (y * v[2] - z * v[1]), b = 2 * (z * v[0] - x * v[2]), c = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * a + y * c - z * b, v[1] + w * b + z * a - x * c, v[2] + w * c + x * b - y * a];
};
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const sizeOf = (v) => Math.hypot(v[0], v[1], v[2]);

// Where light comes from, as seen: from above, on the left, in front.
const LIGHT = [-0.42, 0.7, 0.58];

class Painter {
  constructor(canvas, scene, camera) {
    Object.assign(this, { canvas, scene, camera, context: canvas.getContext("2d"), sprites: new Map() });
    this.reach = scene.shapes.map((shape) => shape.radius || Math.max(...shape.points.map(sizeOf), 0));
    // Parts as lists of points in the axes of their body.
    this.local = scene.bodies.map((body) => body.parts.map((part) => {
      const points = scene.shapes[part.shape].points;
      return points && points.map((point) => plus(part.at, turned(part.turn, 0, point)));
    }));
    this.balls = [];
    scene.bodies.forEach(({ parts }, k) => {
      if (parts.length === 1 && scene.shapes[parts[0].shape].kind === "ball") this.balls.push([7 * k, this.reach[parts[0].shape]]);
    });
    this.size = scene.bodies.map((body) => Math.max(0, ...body.parts.map((part) => sizeOf(part.at) + this.reach[part.shape])));
  }

  paint(at, shows) {
    const ratio = window.devicePixelRatio || 1, { canvas, context } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio))
      [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.lineJoin = "round";
    this.camera.aim(width, height);
    this.colors = pageColors();
    this.poses = posesAt(this.scene, at);
    this.sleepers = this.scene.asleep[Math.floor(at)] || new Set();
    this.items = [];
    this.faces = this.scene.walls.map((wall) => this.wallAsSeen(wall));
    this.bodies();
    if (shows.arrows) this.arrows(at);
    this.items.sort((a, b) => a.near - b.near);
    for (const item of this.items) if (item.behind) item.draw();
    this.walls();
    if (shows.trails) this.trails(at);
    for (const item of this.items) if (!item.behind) item.draw();
    if (shows.contacts) this.contacts(at);
    if (shows.names) this.names();
  }

  path(points) {
    this.context.beginPath();
    points.forEach((p, k) => k ? this.context.lineTo(p[0], p[1]) : this.context.moveTo(p[0], p[1]));
  }

  // How much of a colour the air takes, in eighths.
  haze(near) { return Math.round(Math.max(0, Math.min(1, 0.5 - 0.5 * near / this.camera.radius)) * 8) / 8; }

  hazy(color, near) { return mix(color, this.colors.back, 0.55 * this.haze(near)); }

  // Floors and walls that face the reader as faces, the others as outlines.
  walls() {
    const { context, colors } = this;
    for (const { wall, corners, faces } of this.faces) {
      this.path(corners);
      context.closePath();
      if (faces) {
        context.fillStyle = css(colors.wall);
        context.fill();
      }
      context.strokeStyle = css(colors.line);
      context.lineWidth = faces ? 1.2 : 0.8;
      context.stroke();
      if (faces) this.wallLines(wall);
      if (faces) this.shadows(this.faces.find((face) => face.wall === wall));
    }
  }

  wallAsSeen(wall) {
    const corners = wall.map((corner) => this.camera.project(corner));
    const normal = cross(minus(wall[1], wall[0]), minus(wall[2], wall[0])), size = sizeOf(normal) || 1;
    return { wall, corners, faces: signedArea(corners) < 0, normal: normal.map((x) => x / size) };
  }

  // Whether something is on the other side of a wall that one sees.
  isBehind(at, size) {
    return this.faces.some(({ wall, faces, normal }) => faces
      && minus(at, wall[0]).reduce((sum, x, n) => sum + x * normal[n], 0) < -size);
  }

  wallLines(wall) {
    if (wall.length !== 4) return;
    const between = (a, b, share) => a.map((x, k) => x + share * (b[k] - x));
    this.context.lineWidth = 0.5;
    for (let k = 1; k < 8; k++) for (const [a, b, c, d] of [wall, [wall[1], wall[2], wall[3], wall[0]]]) {
      this.path([between(a, b, k / 8), between(d, c, k / 8)].map((p) => this.camera.project(p)));
      this.context.stroke();
    }
  }

  // Of what is above a floor.
  shadows({ wall, corners, normal }) {
    const { context, camera, scene } = this, up = scene.up;
    if (Math.abs(normal[up]) < 0.9) return;
    context.save();
    this.path(corners);
    context.clip();
    context.fillStyle = "#000";
    scene.bodies.forEach((body, k) => {
      if (body.fixed) return;
      const at = [this.poses[7 * k], this.poses[7 * k + 1], this.poses[7 * k + 2]];
      const high = minus(at, wall[0]).reduce((sum, x, n) => sum + x * normal[n], 0) / normal[up];
      const foot = at.map((x, n) => n === up ? x - high : x), p = camera.project(foot);
      if (high < 0) return;
      context.globalAlpha = 0.16 / (1 + high / (2 * this.size[k] + 1));
      context.beginPath();
      context.ellipse(p[0], p[1], this.size[k] * p[3], this.size[k] * p[3] * Math.abs(camera.sinp), 0, 0, 7);
      context.fill();
    });
    context.restore();
  }

  colorOf(body, part, number) {
    const color = body.fixed ? this.colors.fixed : rgb(bodyColors[part.color % bodyColors.length]);
    return this.sleepers.has(number) ? mix(color, this.colors.back, 0.62) : color;
  }

  bodies() {
    this.scene.bodies.forEach((body, number) => body.parts.forEach((part, place) => {
      const shape = this.scene.shapes[part.shape], color = this.colorOf(body, part, number);
      const world = (point) => {
        const at = turned(this.poses, 7 * number + 3, point);
        for (let k = 0; k < 3; k++) at[k] += this.poses[7 * number + k];
        return at;
      };
      const at = world(part.at), middle = this.camera.project(at), reach = this.reach[part.shape];
      // Not what is about as near as the eye.
      if (middle[2] + reach > 0.8 * this.camera.nearest()) return;
      const seen = { color, middle, radius: reach * middle[3], alpha: part.sensor ? 0.25 : 1, fixed: body.fixed,
        behind: this.isBehind(at, body.fixed ? reach : 0) };
      const push = (draw) => this.items.push({ near: middle[2], behind: seen.behind, draw });
      if (shape.kind === "ball" || seen.radius < 2) return push(() => this.ball(seen));
      const points = this.local[number][place].map((point) => this.camera.project(world(point)));
      if (shape.kind === "lines") return push(() => this.lines(shape, points, seen));
      this.mesh(shape, points, seen, push);
    }));
  }

  ball({ color, middle, radius, alpha }) {
    const { context } = this;
    context.globalAlpha = alpha;
    if (radius > 40) {
      context.fillStyle = this.gradient(context, this.hazy(color, middle[2]), middle[0], middle[1], radius);
      context.beginPath(); context.arc(middle[0], middle[1], radius, 0, 7); context.fill();
    } else if (radius < 4) {
      context.fillStyle = css(this.hazy(color, middle[2]));
      context.beginPath(); context.arc(middle[0], middle[1], Math.max(radius, 2.2), 0, 7); context.fill();
    } else {
      const r = radius;
      context.drawImage(this.sprite(this.hazy(color, middle[2])), middle[0] - r, middle[1] - r, 2 * r, 2 * r);
    }
    context.globalAlpha = 1;
  }

  gradient(context, color, x, y, r) {
    const shade = context.createRadialGradient(x + LIGHT[0] * 0.55 * r, y - LIGHT[1] * 0.55 * r, r * 0.05, x, y, r);
    shade.addColorStop(0, css(mix(color, [255, 255, 255], 0.55)));
    shade.addColorStop(0.55, css(color));
    shade.addColorStop(1, css(mix(color, [0, 0, 0], 0.35)));
    return shade;
  }

  sprite(color) {
    const key = css(color);
    let sprite = this.sprites.get(key);
    if (!sprite) {
      sprite = document.createElement("canvas");
      sprite.width = sprite.height = 96;
      const context = sprite.getContext("2d");
      context.fillStyle = this.gradient(context, color, 48, 48, 47);
      context.beginPath(); context.arc(48, 48, 47, 0, 7); context.fill();
      if (this.sprites.size > 500) this.sprites.clear();
      this.sprites.set(key, sprite);
    }
    return sprite;
  }

  lines(shape, points, { color, middle }) {
    this.context.strokeStyle = css(this.hazy(color, middle[2]));
    this.context.lineWidth = 2;
    for (let k = 0; k < shape.lines.length; k += 2) {
      this.path([points[shape.lines[k]], points[shape.lines[k + 1]]]);
      this.context.stroke();
    }
  }

  // Convex bodies that move are one item. Of others each face is, and what is fixed counts as far as its
  // farthest corner, so that what lies on it is before it.
  mesh(shape, points, seen, push) {
    const faces = [];
    for (let k = 0; k < shape.faces.length; k += 4) {
      const corners = [points[shape.faces[k]], points[shape.faces[k + 1]], points[shape.faces[k + 2]]];
      const front = signedArea(corners) < 0;
      if (shape.convex && !front && seen.alpha === 1) continue;
      const far = Math.min(corners[0][2], corners[1][2], corners[2][2]);
      const mean = (corners[0][2] + corners[1][2] + corners[2][2]) / 3;
      faces.push({ near: seen.fixed ? far : mean, behind: seen.behind, draw: () => this.face(corners, shape.faces[k + 3], seen) });
    }
    if (!shape.convex || seen.fixed) this.items.push(...faces);
    else push(() => faces.forEach((face) => face.draw()));
  }

  face(corners, creases, { color, alpha }) {
    const { context } = this, [a, b, c] = corners;
    const flat = (p) => [p[0], -p[1], p[2] * p[3]];
    const normal = cross(minus(flat(b), flat(a)), minus(flat(c), flat(a))), size = sizeOf(normal) || 1;
    // What is seen from behind is lit as from the front.
    const light = Math.abs(normal[2]) < 1e-9 * size ? 0 : Math.sign(normal[2]) * (LIGHT[0] * normal[0] + LIGHT[1] * normal[1] + LIGHT[2] * normal[2]) / size;
    const base = this.hazy(color, (a[2] + b[2] + c[2]) / 3);
    const shade = light > 0.35 ? mix(base, [255, 255, 255], 0.55 * (light - 0.35)) : mix(base, [0, 0, 0], 0.6 * (0.35 - light));
    context.globalAlpha = alpha;
    context.fillStyle = context.strokeStyle = css(shade);
    context.lineWidth = 0.7;
    this.path(corners);
    context.closePath();
    context.fill();
    if (alpha === 1) context.stroke();
    context.strokeStyle = css(mix(shade, [0, 0, 0], 0.3));
    context.lineWidth = 0.8;
    [[1, a, b], [2, b, c], [4, c, a]].forEach(([bit, from, to]) => {
      if (creases & bit) { this.path([from, to]); context.stroke(); }
    });
    context.globalAlpha = 1;
  }

  // Where bodies came from in the last sixth of the run.
  trails(at) {
    const { context, scene } = this, last = Math.floor(at), long = Math.ceil(scene.frames.length / 6);
    context.lineWidth = 1.4;
    scene.bodies.forEach((body, k) => {
      if (body.fixed || !body.parts.length) return;
      context.strokeStyle = css(this.colorOf(body, body.parts[0], k));
      const place = (pose) => this.camera.project([pose[7 * k], pose[7 * k + 1], pose[7 * k + 2]]);
      let after = place(this.poses);
      for (let frame = last; frame >= Math.max(0, last - long); frame--) {
        const before = place(scene.frames[frame]);
        if (Math.max(before[2], after[2]) < 0.8 * this.camera.nearest()) {
          context.globalAlpha = 0.7 * (1 - (at - frame) / (long + 1));
          this.path([before, after]);
          context.stroke();
        }
        after = before;
      }
    });
    context.globalAlpha = 1;
  }

  // Those of the last moment at which fields were sampled.
  arrows(at) {
    const moments = this.scene.arrows.moments, now = moments.filter((moment) => moment.frame <= at);
    const { arrows } = now[now.length - 1] || moments[0];
    for (let k = 0; k < arrows.length; k += 6) {
      const begin = arrows.slice(k, k + 3), end = plus(begin, arrows.slice(k + 3, k + 6));
      if (this.isInBall(begin)) continue;
      const [from, to] = [this.camera.project(begin), this.camera.project(end)];
      this.items.push({ near: from[2], draw: () => this.arrow(from, to) });
    }
  }

  // Where an arrow would be hidden, if balls were not discs on the canvas.
  isInBall([x, y, z]) {
    const { poses, balls } = this;
    for (const [k, radius] of balls) {
      const [u, v, w] = [poses[k] - x, poses[k + 1] - y, poses[k + 2] - z];
      if (u * u + v * v + w * w < radius * radius) return true;
    }
    return false;
  }

  arrow(from, to) {
    const { context } = this, along = [to[0] - from[0], to[1] - from[1]], size = Math.hypot(...along);
    context.globalAlpha = 0.9 - 0.5 * this.haze(from[2]);
    context.strokeStyle = context.fillStyle = css(this.colors.quiet);
    context.lineWidth = 1.3;
    if (size < 1) {
      context.beginPath(); context.arc(to[0], to[1], 1.2, 0, 7); context.fill();
    } else {
      const head = Math.min(7, 0.5 * size), [u, v] = along.map((x) => x / size);
      const neck = [to[0] - head * u, to[1] - head * v];
      this.path([from, neck]); context.stroke();
      this.path([to, [neck[0] - 0.45 * head * v, neck[1] + 0.45 * head * u], [neck[0] + 0.45 * head * v, neck[1] - 0.45 * head * u]]);
      context.fill();
    }
    context.globalAlpha = 1;
  }

  // A contact flashes for a fortieth of the run. Many at once are small, so that one sees the bodies, but not
  // those about which the fields and Rapier differ.
  contacts(at) {
    const { context, scene } = this, last = Math.floor(at), long = Math.max(3, scene.frames.length / 40);
    const first = Math.max(0, Math.ceil(at - long));
    const many = scene.contacts.slice(first, last + 1).reduce((sum, row) => sum + row.length / 4, 0) > 40;
    for (let frame = first; frame <= last; frame++) {
      const row = scene.contacts[frame], age = (at - frame) / long;
      for (let k = 0; k < row.length; k += 4) {
        const p = this.camera.project(row.slice(k, k + 3)), [color, , differs] = contactKinds[row[k + 3]];
        const small = many && !differs;
        context.globalAlpha = (1 - age) * (small ? 0.6 : 1);
        context.fillStyle = context.strokeStyle = color;
        context.lineWidth = 2;
        context.beginPath(); context.arc(p[0], p[1], small ? 1.8 : 3.5, 0, 7); context.fill();
        if (small) continue;
        context.beginPath(); context.arc(p[0], p[1], 4 + (differs ? 16 : 10) * age, 0, 7); context.stroke();
      }
    }
    context.globalAlpha = 1;
  }

  names() {
    const { context, camera, colors } = this;
    context.font = "12px system-ui, sans-serif";
    context.lineWidth = 3;
    const taken = [];
    this.scene.bodies.forEach((body, k) => {
      if (body.name === undefined) return;
      const p = camera.project([this.poses[7 * k], this.poses[7 * k + 1], this.poses[7 * k + 2]]);
      if (!(p[0] > 0 && p[0] < camera.width && p[1] > 0 && p[1] < camera.height)) return;
      const beside = Math.min(0.75 * this.size[k] * p[3], 40), at = [p[0] + beside + 5, p[1] - beside - 3];
      const name = body.name.length > 24 ? body.name.slice(0, 23) + "…" : body.name;
      // Below those that are there already.
      const wide = context.measureText(name).width;
      at[0] = Math.max(4, Math.min(at[0], camera.width - wide - 4));
      const meets = ([x, y, w]) => at[0] < x + w && x < at[0] + wide && Math.abs(at[1] - y) < 13;
      for (let other; (other = taken.find(meets));) at[1] = other[1] + 13;
      taken.push([...at, wide]);
      context.strokeStyle = css(colors.back);
      context.strokeText(name, ...at);
      context.fillStyle = css(colors.ink);
      context.fillText(name, ...at);
    });
  }
}

// Twice the area on the canvas; negative if the corners go counter-clockwise there.
function signedArea(corners) {
  let sum = 0;
  corners.forEach((p, k) => {
    const q = corners[(k + 1) % corners.length];
    sum += p[0] * q[1] - q[0] * p[1];
  });
  return sum;
}
