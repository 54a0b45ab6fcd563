// Where one looks from.
class Camera {
  constructor(scene) {
    this.scene = scene;
    this.radius = Math.hypot(...scene.half) || 1;
    this.reset();
  }

  // Flat scenes are looked at from above or from the front, others at a slant.
  reset() {
    const [x, y, z] = this.upright(this.scene.half).map(Math.abs), large = Math.max(x, y, z);
    this.first = y < 0.15 * large ? [0.5, 0.75] : z < 0.15 * large ? [0.3, 0.15]
      : x < 0.15 * large ? [Math.PI / 2 - 0.3, 0.15] : [0.6, 0.35];
    [this.yaw, this.pitch] = this.first;
    [this.zoom, this.right, this.up] = [1, 0, 0];
  }

  // In axes of which the second points upwards.
  upright([x, y, z]) { return this.scene.up === 2 ? [x, z, -y] : [x, y, z]; }

  aim(width, height) {
    if (this.width !== width || this.height !== height) [this.width, this.height, this.fit] = [width, height, null];
    if (!this.fit) this.fit = this.fitting();
    this.scale = this.zoom * this.fit;
    this.look(this.yaw, this.pitch);
  }

  look(yaw, pitch) {
    [this.siny, this.cosy] = [Math.sin(yaw), Math.cos(yaw)];
    [this.sinp, this.cosp] = [Math.sin(pitch), Math.cos(pitch)];
  }

  // Pixels per length with which the whole box is seen at first.
  fitting() {
    this.look(...this.first);
    let [right, up] = [0, 0];
    for (let corner = 0; corner < 8; corner++) {
      const [u, v, near] = this.direction(this.scene.half.map((x, k) => corner >> k & 1 ? x : -x));
      const nearer = 1 - near / this.nearest();
      [right, up] = [Math.max(right, Math.abs(u) / nearer), Math.max(up, Math.abs(v) / nearer)];
    }
    return 0.47 * Math.min(this.width / (right || 1), this.height / (up || 1));
  }

  // A direction as seen: to the right, upwards, towards the reader.
  direction(vector) {
    const [a, b, c] = this.upright(vector);
    const forth = this.siny * a + this.cosy * c;
    return [this.cosy * a - this.siny * c, this.cosp * b - this.sinp * forth, this.sinp * b + this.cosp * forth];
  }

  // The eye is so far in front of the middle.
  nearest() { return 5 * this.radius; }

  // A place on the canvas: x, y, how near it is, and pixels per length there.
  project([x, y, z]) {
    const [cx, cy, cz] = this.scene.center;
    const [u, v, near] = this.direction([x - cx, y - cy, z - cz]);
    const scale = this.scale / Math.max(0.05, 1 - near / this.nearest());
    return [this.width / 2 + (u + this.right) * scale, this.height / 2 - (v + this.up) * scale, near, scale];
  }

  turn(right, up) {
    this.yaw -= right;
    this.pitch = Math.max(-1.57, Math.min(1.57, this.pitch + up));
  }

  move(right, down) {
    this.right += right / this.scale;
    this.up -= down / this.scale;
  }

  closer(factor) { this.zoom = Math.max(0.1, Math.min(200, this.zoom * factor)); }
}
