"use strict";
(() => {
  const tone = name => getComputedStyle(document.documentElement).getPropertyValue(`--figure-${name}`);
  const spring = document.getElementById("spring"), trace = document.getElementById("trace");
  const slider = document.getElementById("moment"), button = document.getElementById("play");
  const now = document.getElementById("now"), n = film.time.length, end = film.time[n - 1];
  const largest = Math.max(1e-9, ...film.torque.map(Math.abs));
  const mix = (a, b, s) => a + s * (b - a);
  const at = (series, x) => {
    const i = Math.min(Math.floor(x), n - 2);
    return mix(series[i], series[i + 1], x - i);
  };
  function shape(winds) {
    const grid = film.grid, step = grid[1] - grid[0];
    const x = Math.min(Math.max((winds - grid[0]) / step, 0), grid.length - 1.000001);
    const i = Math.floor(x), s = x - i, a = film.shapes[i], b = film.shapes[i + 1];
    return a.map((p, k) => [mix(p[0], b[k][0], s), mix(p[1], b[k][1], s)]);
  }
  function ring(c, outer, inner, fill) {
    c.beginPath(); c.arc(0, 0, outer, 0, 2 * Math.PI); c.arc(0, 0, inner, 0, 2 * Math.PI, true);
    c.fillStyle = fill; c.fill("evenodd"); c.stroke();
  }
  function mark(c, angle, from, to) {
    c.save(); c.rotate(angle); c.beginPath(); c.moveTo(from, 0); c.lineTo(to, 0);
    c.lineWidth = 2.2; c.strokeStyle = tone("1f2933"); c.stroke(); c.restore();
  }
  function drawSpring(x) {
    const c = spring.getContext("2d"), size = spring.width, scale = size / (2.12 * film.rimOuter);
    const output = at(film.output, x), load = at(film.load, x), torque = at(film.torque, x);
    c.setTransform(1, 0, 0, 1, 0, 0); c.clearRect(0, 0, size, size);
    c.setTransform(scale, 0, 0, -scale, size / 2, size / 2);
    c.lineWidth = 0.25; c.strokeStyle = tone("69737d");
    ring(c, film.rimOuter, film.rimInner, tone("e6ebf1"));
    const points = shape(load - output), share = Math.min(1, Math.abs(torque) / largest);
    const to = torque > 0 ? [213, 94, 0] : [0, 114, 178];
    const colour = [176, 184, 192].map((v, k) => Math.round(mix(v, to[k], share)));
    for (let arm = 0; arm < film.arms; arm++) {
      c.save(); c.rotate(output + arm * 2 * Math.PI / film.arms);
      c.beginPath(); points.forEach((p, k) => k ? c.lineTo(p[0], p[1]) : c.moveTo(p[0], p[1]));
      c.lineWidth = film.thickness; c.lineCap = "butt"; c.lineJoin = "round";
      c.strokeStyle = c.fillStyle = `rgb(${colour})`; c.stroke();
      const grown = points.slice(-film.rimPoints);
      c.beginPath(); grown.forEach((p, k) => k ? c.lineTo(p[0], p[1]) : c.moveTo(p[0], p[1]));
      grown.reverse().forEach(p => {
        const out = 1.01 * film.rimInner / Math.hypot(p[0], p[1]);
        c.lineTo(out * p[0], out * p[1]);
      });
      c.fill(); c.restore();
    }
    c.lineWidth = 0.25; c.strokeStyle = tone("69737d");
    ring(c, film.hub, film.bore, tone("cfd6de"));
    mark(c, output, film.bore, film.hub); mark(c, load, film.rimInner, film.rimOuter);
  }
  function drawTrace(x) {
    const c = trace.getContext("2d"), w = trace.width, h = trace.height, left = 90, low = h - 60;
    const all = film.traceTorque.concat(film.traceReference || []);
    const top = Math.max(...all), bottom = Math.min(...all), span = (top - bottom || 1) * 1.15;
    const middle = (top + bottom) / 2;
    const px = t => left + (w - left - 20) * t / end;
    const py = v => 20 + (low - 20) * (0.5 - (v - middle) / span);
    c.clearRect(0, 0, w, h); c.font = "24px system-ui, sans-serif"; c.fillStyle = tone("1f2933");
    c.strokeStyle = tone("cfd6de"); c.lineWidth = 1.5;
    const step = 10 ** Math.floor(Math.log10(span)), tick = span / step < 3 ? step / 2 : step;
    for (let v = Math.ceil((middle - span / 2) / tick) * tick; v < middle + span / 2; v += tick) {
      c.beginPath(); c.moveTo(left, py(v)); c.lineTo(w - 20, py(v)); c.stroke();
      c.textAlign = "right"; c.fillText(Number(v.toPrecision(3)), left - 12, py(v) + 8);
    }
    c.textAlign = "left"; c.fillText("torque (Nm)", left + 8, 22);
    c.textAlign = "right"; c.fillText(`${end} s`, w - 20, h - 20); c.fillText("0", left, h - 20);
    const line = (series, colour, width) => {
      c.beginPath(); series.forEach((v, k) => {
        const a = px(film.traceTime[k]), b = py(v); k ? c.lineTo(a, b) : c.moveTo(a, b);
      });
      c.strokeStyle = colour; c.lineWidth = width; c.stroke();
    };
    if (film.traceReference) line(film.traceReference, "#E69F00", 6);
    line(film.traceTorque, "#0072B2", 2.5);
    c.beginPath(); c.moveTo(px(at(film.time, x)), 20); c.lineTo(px(at(film.time, x)), low);
    c.strokeStyle = tone("1f2933"); c.lineWidth = 2; c.stroke();
  }
  function draw(x) {
    drawSpring(x); drawTrace(x);
    const winds = (at(film.load, x) - at(film.output, x)) * 180 / Math.PI;
    now.textContent = `${at(film.time, x).toFixed(2)} s, ${at(film.torque, x).toFixed(2)} Nm, ` +
      `${Math.abs(winds).toFixed(2)}° ${winds > 0 ? "wound" : "unwound"}`;
  }
  let playing = !location.hash, t = Number(location.hash.slice(1)) || 0, last = null;
  const place = () => Math.min(t / end, 1) * (n - 1.000001);
  function tick(stamp) {
    if (playing) {
      if (last !== null) t = (t + (stamp - last) / 1000) % end;
      slider.value = 1000 * t / end; draw(place());
    }
    last = stamp; requestAnimationFrame(tick);
  }
  button.addEventListener("click", () => {
    playing = !playing; button.textContent = playing ? "Pause" : "Play";
  });
  slider.addEventListener("input", () => {
    playing = false; button.textContent = "Play"; t = slider.value / 1000 * end; draw(place());
  });
  if (!playing) button.textContent = "Play";
  draw(place()); requestAnimationFrame(tick);
})();
