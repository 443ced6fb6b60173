// Particles and springs as objects; a damping of zero falls back to one, as `||` does.
const serve = require("./serve.js");

class Particle {
  constructor(mass, [x, y, z], [u, v, w], pinned) {
    Object.assign(this, { mass, position: { x, y, z }, velocity: { x: u, y: v, z: w }, pinned });
    this.force = { x: 0, y: 0, z: 0 };
  }
  add(force, scale) {
    for (const c of "xyz") this.force[c] += scale * force[c];
  }
  step(h) {
    if (this.pinned) return;
    for (const c of "xyz") {
      this.velocity[c] += (h * this.force[c]) / this.mass;
      this.position[c] += h * this.velocity[c];
    }
  }
  list(name) { return [this[name].x, this[name].y, this[name].z]; }
}

class Spring {
  constructor(a, b, options) {
    this.a = a;
    this.b = b;
    this.restLength = options.restLength;
    this.stiffness = options.stiffness;
    this.damping = options.damping || 1;
  }
  apply() {
    const { a, b } = this, u = {}, length = Math.hypot(
      a.position.x - b.position.x, a.position.y - b.position.y, a.position.z - b.position.z);
    let speed = 0;
    for (const c of "xyz") {
      u[c] = (a.position[c] - b.position[c]) / length;
      speed += (a.velocity[c] - b.velocity[c]) * u[c];
    }
    const pull = this.stiffness * (length - this.restLength) + this.damping * speed;
    a.add(u, -pull);
    b.add(u, pull);
  }
}

function mass_spring_step(r) {
  const particles = r.masses.map((m, i) => (
    new Particle(m, r.positions[i], r.velocities[i], r.pinned.includes(i))));
  const springs = r.springs.map(([i, j], s) => new Spring(particles[i], particles[j], {
    restLength: r.rest_lengths[s], stiffness: r.stiffnesses[s], damping: r.dampings[s] }));
  const [x, y, z] = r.gravity;
  for (const p of particles) p.add({ x, y, z }, p.mass);
  for (const s of springs) s.apply();
  for (const p of particles) p.step(r.h);
  return { positions: particles.map((p) => p.list("position")),
    velocities: particles.map((p) => p.list("velocity")) };
}

serve({ name: "objects", language: "JavaScript", step: { method: "symplectic" } },
  { mass_spring_step });
