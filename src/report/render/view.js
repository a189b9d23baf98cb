/* The arm in its poses, in three dimensions: lines of some width and round points, by WebGL alone. */
(() => {
  const box = document.getElementById("view");
  const { data, state, norm, choose, point, listeners } = flexcal;
  if (!box || data.poses.length === 0) return;
  const canvas = box.querySelector("canvas");
  const gl = canvas.getContext("webgl", { alpha: false, antialias: true, preserveDrawingBuffer: true });
  if (!gl) return;
  box.hidden = false;

  /* Each end of a segment is a place and a way that it gives, by the factor `give`. */
  const LINE = "attribute vec3 a,b,ga,gb;attribute vec2 corner;attribute vec4 colour;attribute float width;" +
    "uniform mat4 camera;uniform vec2 size;uniform float give;varying vec4 c;" +
    "void main(){vec4 p=camera*vec4(a+give*ga,1.),q=camera*vec4(b+give*gb,1.);" +
    "vec2 d=(q.xy/q.w-p.xy/p.w)*size;d=length(d)>1e-6?normalize(d):vec2(1.,0.);" +
    "vec4 e=mix(p,q,corner.x);e.xy+=vec2(-d.y,d.x)*corner.y*width/size*e.w;gl_Position=e;c=colour;}";
  const POINT = "attribute vec3 a;attribute vec4 colour;attribute float width;uniform mat4 camera;varying vec4 c;" +
    "void main(){gl_Position=camera*vec4(a,1.);gl_PointSize=width;c=colour;}";
  const FLAT = "precision mediump float;varying vec4 c;void main(){gl_FragColor=c;}";
  const ROUND = "precision mediump float;varying vec4 c;void main(){if(length(gl_PointCoord-.5)>.5)discard;gl_FragColor=c;}";
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    return made;
  };
  const kinds = {
    line: { program: program(LINE, FLAT), layout: [["a", 3], ["b", 3], ["ga", 3], ["gb", 3], ["corner", 2], ["colour", 4], ["width", 1]], mode: gl.TRIANGLES },
    point: { program: program(POINT, ROUND), layout: [["a", 3], ["colour", 4], ["width", 1]], mode: gl.POINTS },
  };
  const buffer = gl.createBuffer();
  const draw = (kind, numbers, camera, give) => {
    const { program: own, layout, mode } = kinds[kind];
    const stride = layout.reduce((sum, [, size]) => sum + size, 0);
    gl.useProgram(own);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STREAM_DRAW);
    let offset = 0;
    for (const [name, size] of layout) {
      const place = gl.getAttribLocation(own, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * stride, 4 * offset);
      offset += size;
    }
    gl.uniformMatrix4fv(gl.getUniformLocation(own, "camera"), false, camera);
    gl.uniform2f(gl.getUniformLocation(own, "size"), canvas.width / 2, canvas.height / 2);
    gl.uniform1f(gl.getUniformLocation(own, "give"), give);
    gl.drawArrays(mode, 0, numbers.length / stride);
    layout.forEach(([name]) => gl.disableVertexAttribArray(gl.getAttribLocation(own, name)));
  };
  const NONE = [0, 0, 0];
  /* Strokes of x, y and z: from and to, right and up. */
  const LETTERS = [
    [[-1, -1, 1, 1], [-1, 1, 1, -1]],
    [[-1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 0, -1]],
    [[-1, 1, 1, 1], [1, 1, -1, -1], [-1, -1, 1, -1]],
  ];
  const segment = (numbers, a, b, ga, gb, colour, width) => {
    for (const corner of [[0, -1], [0, 1], [1, -1], [1, -1], [0, 1], [1, 1]]) numbers.push(...a, ...b, ...ga, ...gb, ...corner, ...colour, width);
  };

  /* Places of targets, joints and base: the middle of everything, and how far it reaches [mm]. */
  const triples = (list) => Array.from({ length: Math.floor(list.length / 3) }, (_, k) => list.slice(3 * k, 3 * k + 3));
  const places = data.poses.map((pose) => pose.position).concat(data.poses.flatMap((pose) => triples(pose.rigid || [])));
  const ends = [0, 1, 2].map((k) => [Math.min(...places.map((p) => p[k])), Math.max(...places.map((p) => p[k]))]);
  /* Height of the floor [mm]. */
  const bodies = data.poses.flatMap((pose) => pose.rigid || []);
  const ground = Math.min(ends[2][0], ...bodies.filter((_, k) => k % 3 === 2));
  /* The measuring frame is in view unless it is far away. */
  const away = Math.max(...ends.map(([low, high]) => Math.max(low, -high)));
  if (away < Math.max(...ends.map(([low, high]) => high - low))) {
    const tip = 0.15 * Math.hypot(...ends.map(([low, high]) => high - low));
    for (const place of [[0, 0, 0], [tip, 0, 0], [0, tip, 0], [0, 0, tip]]) {
      places.push(place);
      ends.forEach((end, k) => { end[0] = Math.min(end[0], place[k]); end[1] = Math.max(end[1], place[k]); });
    }
  }
  const middle = ends.map(([low, high]) => (low + high) / 2);
  const reach = Math.max(1, ...places.map((p) => Math.hypot(p[0] - middle[0], p[1] - middle[1], p[2] - middle[2])));
  /* Side of the squares of the floor: 1, 2 or 5 times a power of ten [mm]. */
  const decade = 10 ** Math.floor(Math.log10(reach / 3));
  const square = decade * [1, 2, 5, 10].filter((k) => k * decade <= reach / 3).pop();
  const most = Math.max(...data.poses.flatMap((pose) => (pose.give ? pose.give.map(Math.abs) : [0])), 0);
  const sizes = data.poses.map((pose) => norm(pose.after)).filter(Number.isFinite).sort((a, b) => a - b);
  const large = sizes[Math.floor(sizes.length * 0.95)] || 1;
  const largeBefore = data.poses.map((pose) => norm(pose.before)).filter(Number.isFinite).sort((a, b) => a - b)[Math.floor(sizes.length * 0.95)] || 1;

  const input = (name) => box.querySelector("[data-view=" + name + "]");
  const give = input("give");
  give.disabled = most === 0;
  if (most > 0) give.value = Math.min(3, Math.max(0, Math.log10((0.12 * reach) / most)));
  data.traced.forEach(([label], k) => input("colour").append(new Option(label, "traced" + k)));

  const orbit = { yaw: -0.9, pitch: 0.45, distance: 2.3 };
  /* To the right, up, towards the eye; z of the measuring frame points up. */
  const directions = () => {
    const [cy, sy, cp, sp] = [Math.cos(orbit.yaw), Math.sin(orbit.yaw), Math.cos(orbit.pitch), Math.sin(orbit.pitch)];
    return [[-sy, cy, 0], [-sp * cy, -sp * sy, cp], [cp * cy, cp * sy, sp]];
  };
  const camera = () => {
    const rows = directions();
    const eye = orbit.distance * reach;
    const [f, near, far] = [2, 0.02 * reach, eye + 4 * reach];
    const aspect = canvas.width / canvas.height;
    const matrix = new Float32Array(16);
    rows.forEach((row, i) => {
      const shift = -(row[0] * middle[0] + row[1] * middle[1] + row[2] * middle[2]) - (i === 2 ? eye : 0);
      const put = (to, by) => { for (let k = 0; k < 3; k++) matrix[4 * k + to] += by * row[k]; matrix[12 + to] += by * shift; };
      if (i === 0) put(0, f / Math.max(1, aspect));
      if (i === 1) put(1, f * Math.min(1, aspect));
      if (i === 2) { put(2, (far + near) / (near - far)); put(3, -1); }
    });
    matrix[14] += (2 * far * near) / (near - far);
    return matrix;
  };
  const project = (matrix, p) => {
    const at = [0, 1, 3].map((row) => matrix[row] * p[0] + matrix[4 + row] * p[1] + matrix[8 + row] * p[2] + matrix[12 + row]);
    return [(at[0] / at[2] + 1) / 2 * canvas.clientWidth, (1 - at[1] / at[2]) / 2 * canvas.clientHeight];
  };

  const colourOf = (name) => {
    const hex = getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
    return [1, 3, 5].map((k) => Number.parseInt(hex.slice(k, k + 2), 16) / 255);
  };
  const mix = (a, b, part) => a.map((own, k) => own + (b[k] - own) * Math.min(1, Math.max(0, part)));
  const legend = box.querySelector("output");

  const paint = () => {
    const ratio = window.devicePixelRatio || 1;
    [canvas.width, canvas.height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
    const [paper, ink, muted, faint, accent, warm] = ["paper", "ink", "muted", "faint", "accent", "warm"].map(colourOf);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const by = input("colour").value;
    const kinds = { fitted: input("fitted").checked, held_out: input("held_out").checked };
    const poses = data.poses.filter((pose) => (pose.held_out ? kinds.held_out : kinds.fitted) && state.kept(pose));
    const traced = by.startsWith("traced") ? data.traced[Number(by.slice(6))] : null;
    const values = traced ? traced[1].map((own) => own[1]) : [];
    const ends = traced ? [Math.min(...values), Math.max(...values)] : [0, large];
    const valueOf = traced ? new Map(traced[1]) : null;
    const tone = (pose) => {
      if (by === "kind") return pose.held_out ? ink : faint;
      const value = traced ? valueOf.get(pose.row) : norm(pose.after);
      return value === undefined ? faint : mix(accent, warm, (value - ends[0]) / (ends[1] - ends[0] || 1));
    };
    const matrix = camera();
    const factor = most > 0 ? 10 ** Number(give.value) : 1;
    const lengthen = 10 ** Number(input("length").value) * 0.12 * reach;

    /* The floor below everything, with squares of a round size. */
    const floor = [];
    const [low, high] = [0, 1].map((k) => middle.map((at, j) => (k ? at + 1.15 * reach : at - 1.15 * reach)));
    for (let j = 0; j < 2; j++) {
      for (let at = Math.ceil(low[j] / square) * square; at <= high[j]; at += square) {
        const line = (end) => (j === 0 ? [at, end[1], ground] : [end[0], at, ground]);
        segment(floor, line(low), line(high), NONE, NONE, [...faint, 0.45], 1 * ratio);
      }
    }
    draw("line", floor, matrix, 0);

    /* The arm in up to 24 poses evenly, and in the one that is chosen. */
    const [arms, joints] = [[], []];
    const bodies = poses.filter((pose) => pose.rigid);
    const every = Math.max(1, Math.ceil(bodies.length / 24));
    const drawn = input("arms").checked ? bodies.filter((_, k) => k % every === 0) : [];
    const chosen = data.poses.find((pose) => pose.row === state.row && pose.rigid);
    for (const pose of chosen ? drawn.concat([chosen]) : drawn) {
      const main = pose === chosen;
      for (let k = 0; k + 5 < pose.rigid.length; k += 3) {
        const at = (list, j) => list.slice(j, j + 3);
        if (main) segment(arms, at(pose.rigid, k), at(pose.rigid, k + 3), NONE, NONE, [...muted, 0.8], 1 * ratio);
        segment(arms, at(pose.rigid, k), at(pose.rigid, k + 3), pose.give ? at(pose.give, k) : NONE, pose.give ? at(pose.give, k + 3) : NONE, main ? [...accent, 1] : [...muted, 0.4], (main ? 5 : 1.3) * ratio);
        if (main) joints.push(...pose.rigid.slice(k, k + 3).map((x, j) => x + (pose.give ? factor * pose.give[k + j] : 0)), ...ink, 1, 8 * ratio);
      }
      const foot = pose.rigid.slice(0, 3);
      if (main) segment(arms, foot, [foot[0], foot[1], ground], NONE, NONE, [...muted, 0.9], 7 * ratio);
    }
    draw("line", arms, matrix, factor);
    draw("point", joints, matrix, 0);

    /* The measuring frame, each axis with its letter, which faces the eye and keeps its size. */
    const axes = [];
    const [right, up] = directions();
    const size = 0.012 * orbit.distance * reach;
    [warm, muted, accent].forEach((colour, k) => {
      const along = (length) => [0, 1, 2].map((j) => (j === k ? length : 0));
      const stroke = (a, b) => segment(axes, a, b, NONE, NONE, [...colour, 0.9], 1.4 * ratio);
      stroke(NONE, along(0.25 * reach));
      const middle = along(0.25 * reach + 2.2 * size);
      const at = (x, y) => middle.map((own, j) => own + size * (0.7 * x * right[j] + y * up[j]));
      LETTERS[k].forEach(([x0, y0, x1, y1]) => stroke(at(x0, y0), at(x1, y1)));
    });
    draw("line", axes, matrix, 0);

    const strokes = [];
    const before = input("vectors").value === "before";
    const unit = before ? largeBefore : large;
    if (input("vectors").value !== "none") {
      for (const pose of poses) {
        const vector = before ? pose.before : pose.after;
        if ((!pose.kind || pose.kind === "point") && vector.every(Number.isFinite)) segment(strokes, pose.position, pose.position, NONE, vector.map((x) => x / unit), [...tone(pose), 0.95], 1.5 * ratio);
      }
    }
    draw("line", strokes, matrix, lengthen);

    const dots = [];
    if (input("uncovered").checked) for (const p of data.uncovered) dots.push(...p, ...warm, 0.35, 3 * ratio);
    for (const pose of poses) dots.push(...pose.position, ...tone(pose), 1, (pose.row === state.row ? 11 : 4.5) * ratio);
    draw("point", dots, matrix, 0);

    const scale = (value) => String(Number(value.toPrecision(2)));
    legend.textContent = poses.length + " poses; axes of the measuring frame; squares of the floor: " + scale(square) + " mm" + (most > 0 ? "; deflection \u00d7 " + scale(factor) : "; the model is rigid") +
      (input("vectors").value === "none" ? "" : "; lines \u00d7 " + scale(lengthen / unit)) +
      (by === "kind" ? "; strong: held out, faint: fitted" : "; blue to orange: " + scale(ends[0]) + " to " + scale(ends[1]) + " " + (traced ? traced[0] : "mm"));
    box.dataset.drawn = String(poses.length);
  };
  let asked = false;
  const repaint = () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => { asked = false; paint(); });
  };

  const nearest = (event) => {
    const matrix = camera();
    const frame = canvas.getBoundingClientRect();
    let best = null;
    let least = 12;
    for (const pose of data.poses.filter(state.kept)) {
      const [x, y] = project(matrix, pose.position);
      const distance = Math.hypot(x - (event.clientX - frame.left), y - (event.clientY - frame.top));
      if (distance < least) [best, least] = [pose, distance];
    }
    return best;
  };
  let held = null;
  const turn = (dx, dy) => {
    orbit.yaw -= dx;
    orbit.pitch = Math.min(1.55, Math.max(-1.55, orbit.pitch + dy));
    repaint();
  };
  canvas.addEventListener("pointerdown", (event) => { held = { x: event.clientX, y: event.clientY, moved: 0 }; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return point(nearest(event), event.clientX, event.clientY);
    const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
    held = { x: event.clientX, y: event.clientY, moved: held.moved + Math.abs(dx) + Math.abs(dy) };
    turn(dx * 0.008, dy * 0.008);
  });
  canvas.addEventListener("pointerup", (event) => {
    const pose = held && held.moved < 4 ? nearest(event) : null;
    held = null;
    if (pose) choose(pose.row);
  });
  canvas.addEventListener("pointerleave", () => point(null));
  const zoom = (by) => { orbit.distance = Math.min(12, Math.max(0.4, orbit.distance * by)); repaint(); };
  /* A page scrolls past the view unless that is asked to zoom. */
  canvas.addEventListener("wheel", (event) => { if (!event.ctrlKey && document.activeElement !== canvas) return; event.preventDefault(); zoom(Math.exp(event.deltaY * 0.001)); }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const act = { ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1), "+": () => zoom(0.9), "-": () => zoom(1.1) }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  box.addEventListener("input", repaint);
  listeners.push(repaint);
  window.addEventListener("resize", repaint);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  repaint();
})();
