"use strict";
(() => {
  const place = document.getElementById("turnable"), canvas = place.querySelector("canvas");
  const gl = canvas.getContext("webgl2", {antialias: true, alpha: true});
  if (!gl) { place.classList.add("without-webgl"); return; }
  const words = name => new Uint16Array(Uint8Array.from(atob(part[name]), c => c.charCodeAt(0)).buffer);
  const signed = name => new Int16Array(words(name).buffer);
  const nodes = signed("nodes"), moved = signed("displacement"), stress = words("stress");
  const triangles = words("triangles"), walls = words("walls");
  const count = nodes.length / 2, steps = part.deflection.length, copies = part.copies;
  const rest = part.deflection.indexOf(0), each = 2 * count;
  const index = new Uint32Array(copies * (2 * triangles.length + 3 * walls.length));
  let at = 0;
  for (let k = 0; k < copies; k++) {
    const top = k * each, low = top + count;
    for (let i = 0; i < triangles.length; i += 3) {
      const [a, b, c] = [triangles[i], triangles[i + 1], triangles[i + 2]];
      index.set([top + a, top + b, top + c, low + a, low + c, low + b], at); at += 6;
    }
    for (let i = 0; i < walls.length; i += 2) {
      const [a, b] = [walls[i], walls[i + 1]];
      index.set([low + a, low + b, top + b, low + a, top + b, top + a], at); at += 6;
    }
  }
  const shader = (kind, text) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, "#version 300 es\nprecision highp float;\n" + text);
    gl.compileShader(made); return made;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `
    in vec3 point; in float stress; uniform mat3 turn; uniform vec2 scale;
    out vec3 seen; out float level;
    void main() {
      seen = turn * point; level = stress;
      gl_Position = vec4(seen.xy * scale, -seen.z * min(scale.x, scale.y) * 0.2, 1.0);
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
    in vec3 seen; in float level; out vec4 colour;
    vec3 scale(float t) {
      const vec3 c[5] = vec3[5](vec3(.267, .005, .329), vec3(.230, .322, .546),
        vec3(.128, .567, .551), vec3(.369, .789, .383), vec3(.993, .906, .144));
      float x = clamp(t, 0.0, 1.0) * 4.0; int i = min(int(x), 3);
      return mix(c[i], c[i + 1], x - float(i));
    }
    void main() {
      vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
      float light = 0.68 + 0.32 * max(dot(n, normalize(vec3(.3, .5, .8))), 0.0);
      colour = vec4(scale(level) * light, 1.0);
    }`));
  gl.linkProgram(program); gl.useProgram(program); gl.enable(gl.DEPTH_TEST);
  const points = new Float32Array(4 * copies * each), buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, points, gl.DYNAMIC_DRAW);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
  for (const [name, size, offset] of [["point", 3, 0], ["stress", 1, 12]]) {
    const where = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, size, gl.FLOAT, false, 16, offset);
  }
  const uniform = name => gl.getUniformLocation(program, name);
  const turnAt = uniform("turn"), scaleAt = uniform("scale");
  const slider = place.querySelector("input"), now = place.querySelector("output");
  const largest = stress.reduce((a, b) => Math.max(a, b), 1);
  const radius = 32767 * part.unit * Math.SQRT2;
  place.querySelector(".most").textContent = (largest * part.stressUnit).toFixed(0) + " MPa";
  slider.max = steps - 1;
  const home = {turn: 0.5, tilt: 0.75, zoom: 1.42};
  const view = {...home};
  let step = rest, wanted = false;

  function load() {  // the nodes between two solved steps, all copies, both faces
    const i = Math.min(Math.floor(step), steps - 2), s = step - i, o = i * count, p = o + count;
    let peak = 0;
    for (let k = 0; k < copies; k++) {
      const c = Math.cos(2 * Math.PI * k / copies), n = Math.sin(2 * Math.PI * k / copies);
      for (let j = 0; j < count; j++) {
        const x = part.unit * (nodes[2 * j] + (1 - s) * moved[2 * (o + j)] + s * moved[2 * (p + j)]);
        const y = part.unit * (nodes[2 * j + 1] + (1 - s) * moved[2 * (o + j) + 1] + s * moved[2 * (p + j) + 1]);
        const level = (1 - s) * stress[o + j] + s * stress[p + j];
        peak = Math.max(peak, level);
        for (let face = 0; face < 2; face++) {
          const q = 4 * (k * each + face * count + j);
          points[q] = c * x - n * y; points[q + 1] = n * x + c * y;
          points[q + 2] = (0.5 - face) * part.width; points[q + 3] = level / largest;
        }
      }
    }
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, points);
    const mix = name => (1 - s) * part[name][i] + s * part[name][i + 1];
    const angle = mix("deflection"), touch = part.touch[angle > 0 ? "winding" : "unwinding"];
    const closed = touch !== undefined && Math.abs(angle) > Math.abs(touch) - 1e-3;
    const way = Math.abs(angle) < 1e-6 ? "at rest" : angle > 0 ? "winding" : "unwinding";
    now.textContent = `${angle.toFixed(2)}°, ${mix("torque").toFixed(2)} Nm, ${way}` +
      `${closed ? ", coils in contact" : ""}; largest stress ${(peak * part.stressUnit).toFixed(0)} MPa`;
    slider.setAttribute("aria-valuetext", now.textContent);
  }
  function draw() {
    wanted = false;
    const sharp = Math.min(devicePixelRatio || 1, 2);
    const w = Math.round(canvas.clientWidth * sharp), h = Math.round(canvas.clientHeight * sharp);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h); gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [a, b] = [view.turn, view.tilt];
    const [ca, sa, cb, sb] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
    gl.uniformMatrix3fv(turnAt, false, [ca, sa * cb, sa * sb, -sa, ca * cb, ca * sb, 0, -sb, cb]);
    const small = Math.min(w, h), f = view.zoom / radius;
    gl.uniform2f(scaleAt, f * small / w, f * small / h);
    gl.drawElements(gl.TRIANGLES, index.length, gl.UNSIGNED_INT, 0);
  }
  const again = () => { if (!wanted) { wanted = true; requestAnimationFrame(draw); } };
  function to(next) { step = Math.min(Math.max(next, 0), steps - 1.000001); slider.value = step; load(); again(); }
  function turn(dx, dy, by) {
    view.turn += dx; view.tilt = Math.min(Math.max(view.tilt + dy, -Math.PI), Math.PI);
    view.zoom = Math.min(Math.max(view.zoom * by, 0.5), 20); again();
  }
  slider.addEventListener("input", () => to(Number(slider.value)));
  const fingers = new Map();
  const apart = () => { const [p, q] = [...fingers.values()]; return Math.hypot(p.x - q.x, p.y - q.y); };
  canvas.addEventListener("pointerdown", e => {
    canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, {x: e.clientX, y: e.clientY});
  });
  canvas.addEventListener("pointermove", e => {
    const old = fingers.get(e.pointerId);
    if (!old) return;
    const before = fingers.size === 2 ? apart() : 0;
    fingers.set(e.pointerId, {x: e.clientX, y: e.clientY});
    const both = fingers.size === 2, by = both ? 0.004 : 0.008;  // one finger up or down scrolls
    turn(by * (e.clientX - old.x), by * (e.clientY - old.y), both ? apart() / before : 1);
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, e => fingers.delete(e.pointerId));
  canvas.addEventListener("wheel", e => {
    if (!e.ctrlKey && document.activeElement !== canvas) return;  // else the page scrolls
    e.preventDefault(); turn(0, 0, Math.exp(-0.0015 * e.deltaY));
  }, {passive: false});
  const keys = {
    ArrowLeft: () => turn(-0.1, 0, 1), ArrowRight: () => turn(0.1, 0, 1),
    ArrowUp: () => turn(0, -0.1, 1), ArrowDown: () => turn(0, 0.1, 1),
    "+": () => turn(0, 0, 1.15), "-": () => turn(0, 0, 1 / 1.15),
    PageUp: () => to(Math.floor(step + 1.001)), PageDown: () => to(Math.ceil(step - 1.001)),
    Home: () => { Object.assign(view, home); to(rest); },
  };
  canvas.addEventListener("keydown", e => {
    if (keys[e.key]) { e.preventDefault(); keys[e.key](); }
  });
  place.querySelector("button").addEventListener("click", keys.Home);
  new ResizeObserver(again).observe(canvas);
  to(part.touch.winding === undefined ? steps - 1
    : part.deflection.findIndex(angle => angle >= part.touch.winding - 1e-3));
})();
