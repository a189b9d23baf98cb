/* What a page does beyond being read: poses named, marked in all figures and chosen by ranges of joints; tables sorted. Kept by
   hand, without anything to load. Comments stand between these marks alone, so that no line of the page looks like an address. */
"use strict";
const flexcal = (() => {
  const store = document.getElementById("poses");
  const data = store ? JSON.parse(store.textContent) : { joints: [], poses: [], traced: [], uncovered: [] };
  const byRow = new Map(data.poses.map((pose) => [pose.row, pose]));
  /* Of a pose without an equilibrium, whose residual is null, no number. */
  const norm = (v) => (v.every(Number.isFinite) ? Math.hypot(...v) : 0 / 0);
  const shown = (value) => (Number.isFinite(value) ? value.toFixed(Math.min(4, Math.max(0, 2 - Math.floor(Math.log10(Math.abs(value) || 1))))) : "\u2013").replace("-", "\u2212");
  const kind = (pose) => (pose.held_out ? "held out" : "fitted");
  const joints = (pose) => data.joints.map(([name, unit], k) => name + " " + pose.q[k].toFixed(2).replace("-", "\u2212") + (unit === "\u00b0" ? "" : "\u202f") + unit).join(", ");
  const words = (pose) => pose.place + " (" + kind(pose) + "): residual " + shown(norm(pose.after)) + " mm, nominal arm " + shown(norm(pose.before)) + " mm";
  const listeners = [];
  const state = { row: null, kept: () => true };
  const tell = () => listeners.forEach((listener) => listener(state));

  /* Dots by their figure: where they are in its own coordinates, and of which row. */
  const figures = [...document.querySelectorAll("figure > svg")].map((svg) => {
    const dots = [...svg.querySelectorAll("[data-p]")];
    return { svg, dots: dots.map((dot) => ({ dot, row: Number(dot.dataset.p), x: Number(dot.getAttribute("cx")), y: Number(dot.getAttribute("cy")) })), rings: [] };
  }).filter((figure) => figure.dots.length > 0);

  const mark = (row) => figures.forEach((figure) => {
    figure.rings.forEach((ring) => ring.remove());
    figure.rings = figure.dots.filter((own) => own.row === row).map((own) => {
      const ring = own.dot.cloneNode();
      ring.setAttribute("class", "ring");
      ring.setAttribute("r", "5");
      ["fill", "stroke", "data-p"].forEach((name) => ring.removeAttribute(name));
      figure.svg.append(ring);
      return ring;
    });
  });

  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  document.body.append(tip);
  const point = (pose, x, y) => {
    tip.hidden = !pose;
    if (!pose) return;
    tip.textContent = words(pose) + ". " + joints(pose);
    const left = Math.min(x + 14, document.documentElement.clientWidth - tip.offsetWidth - 8);
    tip.style.left = Math.max(8, left) + window.scrollX + "px";
    tip.style.top = y + 16 + window.scrollY + "px";
  };

  const panel = document.getElementById("chosen");
  const choose = (row) => {
    state.row = row;
    mark(row);
    const pose = byRow.get(row);
    if (panel) {
      panel.hidden = !pose;
      panel.querySelector("output").textContent = pose ? words(pose) + ". " + joints(pose) + (pose.kind ? ". Target at " : ". Measured at ") + pose.position.map((value) => value.toFixed(2).replace("-", "\u2212")).join(", ") + " mm" + (pose.kind && pose.kind !== "point" ? "." : "; residual " + pose.after.map(shown).join(", ") + " mm.") : "";
    }
    document.querySelectorAll("tr[data-row]").forEach((line) => line.classList.toggle("picked", Number(line.dataset.row) === row));
    tell();
  };

  const nearest = (figure, event) => {
    const matrix = figure.svg.getScreenCTM();
    if (!matrix) return null;
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    let best = null;
    let least = 12 / matrix.a;
    for (const own of figure.dots) {
      const distance = Math.hypot(own.x - at.x, own.y - at.y);
      if (distance < least && !own.dot.classList.contains("away")) [best, least] = [own, distance];
    }
    return best;
  };
  for (const figure of figures) {
    figure.svg.addEventListener("pointermove", (event) => {
      const own = nearest(figure, event);
      point(own && byRow.get(own.row), event.clientX, event.clientY);
      mark(own ? own.row : state.row);
      figure.svg.style.cursor = own ? "pointer" : "";
    });
    figure.svg.addEventListener("pointerleave", () => { point(null); mark(state.row); });
    figure.svg.addEventListener("click", (event) => {
      const own = nearest(figure, event);
      if (own) choose(own.row);
    });
  }

  /* Poses by size of the residual, the largest first. */
  const bySize = data.poses.filter((pose) => norm(pose.after) >= 0).sort((a, b) => norm(b.after) - norm(a.after));
  if (panel) {
    const step = (by) => {
      const kept = bySize.filter((pose) => state.kept(pose));
      const place = kept.findIndex((pose) => pose.row === state.row);
      if (kept.length) choose(kept[Math.min(kept.length - 1, Math.max(0, place + by))].row);
    };
    panel.querySelector("[data-do=larger]").addEventListener("click", () => step(-1));
    panel.querySelector("[data-do=smaller]").addEventListener("click", () => step(1));
    panel.querySelector("[data-do=none]").addEventListener("click", () => choose(null));
  }
  for (const line of document.querySelectorAll("tr[data-row]")) {
    const cell = line.cells[0];
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = cell.textContent;
    button.addEventListener("click", () => choose(Number(line.dataset.row)));
    cell.replaceChildren(button);
  }

  /* Ranges of the joints. */
  const brush = document.getElementById("brush");
  if (brush && data.poses.length) {
    brush.hidden = false;
    const ranges = data.joints.map(([, unit], k) => {
      const values = data.poses.map((pose) => pose.q[k]);
      const ends = [Math.floor(Math.min(...values)), Math.ceil(Math.max(...values))];
      const inputs = [...brush.querySelectorAll("[data-joint=\"" + k + "\"]")];
      inputs.forEach((input, end) => { [input.min, input.max] = ends; input.step = "any"; input.value = ends[end]; });
      return { inputs, ends, unit, label: brush.querySelector("[data-range=\"" + k + "\"]") };
    });
    /* Of many poses some are drawn, and one stands for so many. */
    const count = (poses) => poses.reduce((sum, pose) => sum + (pose.n || 1), 0);
    const about = data.poses.some((pose) => pose.n) ? "about " : "";
    const rms = (poses) => about + shown(Math.sqrt(poses.reduce((sum, pose) => sum + (pose.n || 1) * norm(pose.after) ** 2, 0) / count(poses))) + " mm";
    const update = () => {
      const limits = ranges.map(({ inputs, label, unit }) => {
        const values = inputs.map((input) => Number(input.value)).sort((a, b) => a - b);
        label.textContent = values.map((value) => value.toFixed(0).replace("-", "\u2212")).join(" to ") + " " + unit;
        return values;
      });
      state.kept = (pose) => limits.every(([low, high], k) => pose.q[k] >= low && pose.q[k] <= high);
      const away = new Set(data.poses.filter((pose) => !state.kept(pose)).map((pose) => pose.row));
      figures.forEach((figure) => figure.dots.forEach((own) => own.dot.classList.toggle("away", away.has(own.row))));
      document.querySelectorAll("tr[data-row]").forEach((line) => line.classList.toggle("away", away.has(Number(line.dataset.row))));
      const kept = bySize.filter(state.kept);
      brush.querySelector("output").textContent = about + Math.round(count(kept)) + " of " + Math.round(count(data.poses)) + " poses; rms residual of the fitted ones " + rms(kept.filter((pose) => !pose.held_out)) + ", of those held out " + rms(kept.filter((pose) => pose.held_out));
      tell();
    };
    brush.addEventListener("input", update);
    brush.querySelector("button").addEventListener("click", () => {
      ranges.forEach(({ inputs, ends }) => inputs.forEach((input, end) => { input.value = ends[end]; }));
      update();
    });
    for (const box of document.querySelectorAll("rect[data-joint]")) {
      box.addEventListener("click", () => {
        const k = data.joints.findIndex((joint) => joint[2] === Number(box.dataset.joint));
        if (k < 0) return;
        /* Joints are rounded to 1e-5. */
        ranges[k].inputs[0].value = Number(box.dataset.low) - 6e-6;
        ranges[k].inputs[1].value = Number(box.dataset.high) + 6e-6;
        update();
      });
    }
    update();
  }

  /* Tables by any of their columns. */
  for (const table of document.querySelectorAll("table.sort")) {
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      if (!head.textContent) return;
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const falling = head.getAttribute("aria-sort") === "ascending";
        [...table.tHead.rows[0].cells].forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", falling ? "descending" : "ascending");
        const value = (line) => {
          const text = line.cells[column].textContent.trim().replaceAll("\u2212", "-");
          const number = Number.parseFloat(text);
          return Number.isFinite(number) ? number : text;
        };
        const order = (a, b) => {
          const [one, other] = [value(a), value(b)];
          if (typeof one !== typeof other) return typeof one === "number" ? -1 : 1;
          return (falling ? -1 : 1) * (typeof one === "number" ? one - other : one.localeCompare(other, "en", { numeric: true }));
        };
        table.tBodies[0].append(...[...table.tBodies[0].rows].sort(order));
      });
    });
  }
  document.querySelectorAll("[data-script]").forEach((part) => { part.hidden = false; });
  return { data, state, norm, kind, choose, point, listeners };
})();
