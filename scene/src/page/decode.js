// What a replay's numbers mean: differences become places, and lists become points.
function decodeReplay(scene) {
  const size = 7 * scene.bodies.length;
  const now = new Float64Array(size);
  const frames = scene.frames.map((row) => {
    for (let k = 0; k < row.length;) {
      const body = row[k++], shown = scene.bodies[body].turns ? 7 : 3;
      for (let n = 0; n < shown; n++) now[7 * body + n] += row[k++];
    }
    return Float64Array.from(now);
  });
  const sleepers = new Set();
  const asleep = scene.asleep.map((row) => {
    for (const body of row) sleepers.has(body) ? sleepers.delete(body) : sleepers.add(body);
    return row.length || !sleepers.size ? new Set(sleepers) : null;
  });
  asleep.forEach((set, k) => { if (!set) asleep[k] = asleep[k - 1]; });
  const points = (shape) => {
    const all = [];
    for (let k = 0; k < shape.points.length; k += 3)
      all.push(shape.points.slice(k, k + 3).map((x) => x * shape.scale));
    return all;
  };
  const shapes = scene.shapes.map((shape) => shape.kind === "ball" ? shape : { ...shape, points: points(shape) });
  return { ...scene, frames, asleep, shapes };
}

// Places and attitudes (of length one) at a frame, or between two.
function posesAt(scene, at) {
  const first = Math.floor(at), share = at - first;
  const from = scene.frames[first], to = scene.frames[Math.min(first + 1, scene.frames.length - 1)];
  const poses = from.map((x, k) => x + share * (to[k] - x));
  for (let k = 3; k < poses.length; k += 7) {
    const size = Math.hypot(poses[k], poses[k + 1], poses[k + 2], poses[k + 3]);
    if (size > 0) for (let n = 0; n < 4; n++) poses[k + n] /= size;
    else poses[k + 3] = 1;
  }
  return poses;
}
