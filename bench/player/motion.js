(() => {
"use strict";
// From near to far, each lighter than the one before.
const STOPS = [[61, 78, 198], [143, 63, 181], [208, 72, 111], [240, 138, 60], [245, 195, 59]];
const {cos, sin, min, max, abs, hypot} = Math, three = [0, 1, 2];
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const colour = (share, shade = 1) => {
  const x = 4 * max(0, min(1, share)), i = min(3, x | 0);
  return `rgb(${three.map(k => shade * (STOPS[i][k] + (STOPS[i + 1][k] - STOPS[i][k]) * (x - i)) | 0)})`;
};
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt());
const numbers = text => {
  const b = bytes(text);
  return Float32Array.from({length: b.length / 2}, (_, i) => (b[2 * i] + 256 * b[2 * i + 1]) / 65535);
};
const length = m => {
  if (m === null) return "no number";
  const k = [1, 1e-3, 1e-6].findIndex(size => m >= size);
  return m && m < 1e-9 ? "< 1 nm" : m ? `${+(m / [1e-9, 1, 1e-3, 1e-6][k + 1]).toPrecision(2)} ${["nm", "m", "mm", "µm"][k + 1]}` : "0";
};

function play(figure) {
  const find = (what, within = figure) => within.querySelector(what);
  const data = JSON.parse(find("script").textContent), n = data.points, [low, high] = data.decades;
  const curve = numbers(data.curve);
  const motions = data.motions.map(m => ({...m, at: numbers(m.at), shades: bytes(m.shades)}));
  const slider = find("input"), button = find("button"), told = find(".motion-time output");
  const panes = [...figure.querySelectorAll(".motion-pane")], last = +slider.max;
  const share = m => m === null ? 1 : (Math.log10(m) - low) / (high - low);
  let [azimuth, lift] = data.view, timer = 0, asked = 0, middle, reach;
  find("i").style.background = `linear-gradient(90deg,${STOPS.map((_, k) => colour(k / 4))})`;

  // Right, up and towards the eye, of point i of an array.
  const seen = (at, i) => {
    const [x, y, z] = three.map(k => at[3 * i + k] - data.extent[k] / 2);
    const near = cos(azimuth) * z - sin(azimuth) * x;
    return [cos(azimuth) * x + sin(azimuth) * z, cos(lift) * y - sin(lift) * near, sin(lift) * y + cos(lift) * near];
  };
  // The middle and half the extent of all that moves, as it is seen.
  function fit() {
    const all = [curve, ...motions.map(m => m.at)].flatMap(at => {
      const count = at.length / 3, step = 1 + (count / 900 | 0);
      return Array.from({length: count / step | 0}, (_, i) => seen(at, i * step));
    });
    const ends = [0, 1].map(k => [all.reduce((a, p) => min(a, p[k]), 9), all.reduce((a, p) => max(a, p[k]), -9)]);
    middle = ends.map(([a, b]) => (a + b) / 2);
    reach = ends.map(([a, b]) => max(b - a, 1e-3) / 2);
  }

  function draw(pane) {
    const canvas = find("canvas", pane), c = canvas.getContext("2d"), dense = devicePixelRatio;
    const m = motions[find("select", pane)?.value ?? 0], frame = +slider.value;
    const style = getComputedStyle(figure), ink = name => style.getPropertyValue("--" + name);
    const w = canvas.width = canvas.clientWidth * dense, h = canvas.height = canvas.clientHeight * dense;
    const scale = 0.44 * min(w / reach[0], h / reach[1]);
    const place = (at, i) => {
      const [x, y, near] = seen(at, i);
      return [w / 2 + scale * (x - middle[0]), h / 2 - scale * (y - middle[1]), scale * near];
    };
    const line = (points, stroke, wide) => {
      c.strokeStyle = stroke;
      c.lineWidth = wide * dense;
      c.beginPath();
      points.forEach(p => c.lineTo(p[0], p[1]));
      c.stroke();
    };
    const dot = (p, fill, r) => {
      c.fillStyle = fill;
      c.beginPath();
      c.arc(p[0], p[1], r * dense, 0, 7);
      c.fill();
    };
    const points = Array.from({length: n}, (_, i) => place(m.at, frame * n + i));
    c.lineJoin = c.lineCap = "round";
    if (curve.length) {
      line(Array.from({length: curve.length / 3}, (_, i) => place(curve, i)), ink("rule"), 5);
      for (let f = 1; f <= frame; f++)
        line([place(m.at, f * n - 1), place(m.at, f * n + n - 1)], colour(share(m.errors[f])), 2.5);
      line(points, ink("ink"), 4);
      points.forEach((p, i) => dot(p, ink(i ? "ink" : "brass"), i ? 5 : 8));
      dot(points[n - 1], colour(share(m.errors[frame])), 6);
    } else {
      const side = Math.sqrt(n), faces = [];
      for (let a = 0; a < n - side; a++) if ((a + 1) % side) {
        const q = [a, a + side, a + side + 1, a + 1], p = q.map(k => points[k]);
        const [u, v] = [0, 1].map(d => three.map(k => p[d + 2][k] - p[d][k]));
        const [x, y, z] = three.map(k => u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
        const far = q.reduce((sum, k) => sum + m.shades[frame * n + k], 0) / 1020;
        faces.push([p[0][2] + p[2][2], p, colour(far, 0.8 + 0.2 * abs(z) / hypot(x, y, z, 1e-9))]);
      }
      faces.sort((a, b) => a[0] - b[0]).forEach(([, p, fill]) => {
        c.fillStyle = fill;
        line([...p, p[0]], ink("card"), 0.5);
        c.fill();
      });
      data.marked.forEach(i => dot(points[i], ink("brass"), 5));
    }
    find("output", pane).textContent = `error now ${length(m.errors[frame])}, largest ${length(max(...m.errors))}`;
  }

  function show() {
    asked = 0;
    told.textContent = `${(slider.value * data.seconds).toFixed(2)} s`;
    slider.ariaValueText = told.textContent;
    fit();
    panes.forEach(draw);
  }
  const later = () => { asked ||= requestAnimationFrame(show); };
  const stop = () => { timer = clearInterval(timer); button.textContent = "Play"; };
  // Whoever asked for less motion gets eight moments, a second each.
  const start = () => {
    if (+slider.value === last) slider.value = 0;
    button.textContent = "Pause";
    timer = setInterval(() => {
      slider.value = +slider.value + (calm.matches ? Math.ceil(last / 8) : 1);
      later();
      if (+slider.value === last) stop();
    }, 1000 * (calm.matches || data.seconds));
  };
  const toggle = () => timer ? stop() : start();
  const orbit = (x, y) => {
    azimuth += x;
    lift = max(-1.5, min(1.5, lift + y));
    later();
  };
  button.onclick = toggle;
  slider.oninput = () => { stop(); later(); };
  panes.forEach(pane => {
    const canvas = find("canvas", pane);
    pane.onchange = later;
    canvas.onpointerdown = e => canvas.setPointerCapture(e.pointerId);
    canvas.onpointermove = e => e.buttons && orbit(e.movementX / 120, e.movementY / 120);
    canvas.onkeydown = e => {
      const by = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1]}[e.key];
      if (by) orbit(...by);
      else if (e.key === " ") toggle();
      else return;
      e.preventDefault();
    };
  });
  new ResizeObserver(later).observe(figure);
  matchMedia("(prefers-color-scheme: dark)").onchange = later;
}
document.querySelectorAll(".motion").forEach(play);
})();
