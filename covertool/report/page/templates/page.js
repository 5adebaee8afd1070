"use strict";
(async () => {
  const items = JSON.parse(document.getElementById("figures").textContent);
  const wantsDark = window.matchMedia("(prefers-color-scheme: dark)");
  // Bokeh hands Python's dictionaries over as maps.
  const entry = (tag, key) => (tag instanceof Map ? tag.get(key) : tag?.[key]);
  const plain = (map) => (map instanceof Map ? Object.fromEntries(map) : map);

  // Colours: every model carries those of both schemes in its tags.
  function paint(scheme) {
    for (const page of Bokeh.documents) {
      for (const model of page.all_models) {
        for (const tag of model.tags ?? []) {
          const colours = entry(tag, scheme);
          if (colours) model.setv(plain(colours));
        }
      }
    }
  }
  const repaint = () => paint(wantsDark.matches ? "dark" : "light");

  const views = {};
  for (const [name, item] of Object.entries(items)) {
    views[name] = [...(await Bokeh.embed.embed_item(item, name))][0];
    // Bokeh's canvas would be one more stop of the Tab key at which nothing can be done.
    const canvas = views[name].canvas_view?.events_el;
    if (canvas) canvas.tabIndex = -1;
  }
  repaint();
  wantsDark.addEventListener("change", repaint);
  // Bokeh takes up new colours of a glyph a moment later; a printer does not wait.
  function takeUp(view) {
    for (const { glyph, nonselection_glyph, model, all_indices } of view.renderer_views.values()) {
      for (const drawn of [glyph, nonselection_glyph]) {
        drawn?.set_visuals?.(model.data_source, all_indices);
      }
    }
  }

  // On paper: a still picture of each figure in light colours, which scales with the sheet.
  window.addEventListener("beforeprint", () => {
    paint("light");
    for (const [name, view] of Object.entries(views)) {
      takeUp(view);
      const picture = view.export("png").canvas;
      picture.removeAttribute("style");
      picture.className = "printed";
      document.getElementById(name).append(picture);
    }
    for (const folded of document.querySelectorAll("details")) folded.open = true;
  });
  window.addEventListener("afterprint", () => {
    for (const picture of document.querySelectorAll(".printed")) picture.remove();
    repaint();
  });
  if (views.map) startMap(views.map);
  document.documentElement.dataset.ready = "yes";

  function startMap(view) {
    const plot = view.model;
    const box = document.getElementById("map-box");
    const tip = document.getElementById("map-tip");
    const picked = document.getElementById("map-picked");
    const layers = plot.renderers.map((renderer) => {
      const tag = renderer.tags[0];
      return {
        renderer,
        key: entry(tag, "key"),
        label: entry(tag, "label"),
        radius: entry(tag, "radius"),
        heads: entry(tag, "heads"),
        form: entry(tag, "form"),
      };
    });
    const whole = { x: span(plot.x_range), y: span(plot.y_range) };

    function span(range) {
      return [range.start, range.end];
    }

    // Switches.
    const controls = document.querySelectorAll("input[name=layer], input[name=radius]");
    function refresh() {
      const on = new Set(
        [...document.querySelectorAll("input[name=layer]:checked")].map((box) => box.value),
      );
      const chosen = document.querySelector("input[name=radius]:checked")?.value;
      for (const layer of layers) {
        const here = layer.radius === null || chosen === undefined || layer.radius === chosen;
        layer.renderer.visible = on.has(layer.key) && here;
      }
    }
    for (const control of controls) control.addEventListener("change", refresh);
    refresh();

    // Moving and zooming; the ranges keep their proportion.
    function show(x, y) {
      plot.x_range.setv({ start: x[0], end: x[1] });
      plot.y_range.setv({ start: y[0], end: y[1] });
    }
    function zoom(factor) {
      const scaled = ([low, high]) => {
        const middle = (low + high) / 2;
        const half = ((high - low) / 2) * factor;
        return [middle - half, middle + half];
      };
      show(scaled(span(plot.x_range)), scaled(span(plot.y_range)));
    }
    function move(right, up) {
      const shifted = ([low, high], share) => {
        const way = (high - low) * share;
        return [low + way, high + way];
      };
      show(shifted(span(plot.x_range), right), shifted(span(plot.y_range), up));
    }
    const all = () => show(whole.x, whole.y);
    document.getElementById("zoom-in").addEventListener("click", () => zoom(0.6));
    document.getElementById("zoom-out").addEventListener("click", () => zoom(1 / 0.6));
    document.getElementById("zoom-all").addEventListener("click", all);

    // The scale bar: a round length of at most 130 pixels.
    function rule() {
      const metresPerPixel = (plot.x_range.end - plot.x_range.start) / 10 / box.clientWidth;
      const most = 130 * metresPerPixel;
      const power = 10 ** Math.floor(Math.log10(most));
      const metres = [5, 2, 1].map((step) => step * power).find((length) => length <= most);
      // A share of the map's width, so that it holds on paper too.
      const share = (100 * metres) / metresPerPixel / box.clientWidth;
      document.getElementById("scale-bar").style.width = `${share}cqw`;
      document.getElementById("scale-text").textContent =
        metres >= 1000 ? `${metres / 1000} km` : `${metres} m`;
    }
    for (const range of [plot.x_range, plot.y_range]) range.change.connect(rule);
    new ResizeObserver(rule).observe(box);
    rule();

    // What lies at a place of the box, the topmost first; outlines, which hide nothing, last.
    function hits(sx, sy) {
      const found = [];
      for (const layer of [...layers].reverse()) {
        if (!layer.renderer.visible) continue;
        const point = layer.form === "car" || layer.form === "mark";
        const row = point ? nearest(layer, sx, sy) : inside(layer, sx, sy);
        if (row !== undefined) found.push({ layer, row });
      }
      const outlined = (hit) => hit.layer.form === "outline";
      return [...found.filter((hit) => !outlined(hit)), ...found.filter(outlined)];
    }
    function inside(layer, sx, sy) {
      const hit = view.views.find_one(layer.renderer)?.hit_test({ type: "point", sx, sy });
      return hit?.indices[0] ?? hit?.multiline_indices?.keys?.().next().value;
    }
    function nearest(layer, sx, sy) {
      const [left, right] = span(plot.x_range);
      const [bottom, top] = span(plot.y_range);
      const perPixel = (right - left) / box.clientWidth;
      const x = left + sx * perPixel;
      const y = top - (sy / box.clientHeight) * (top - bottom);
      const data = layer.renderer.data_source.data;
      const xs = column(data, "x");
      const ys = column(data, "y");
      let best;
      let reach = Math.max(6 * perPixel, 15) ** 2;
      for (let i = 0; i < xs.length; i++) {
        const away = (xs[i] - x) ** 2 + (ys[i] - y) ** 2;
        if (away < reach) [best, reach] = [i, away];
      }
      return best;
    }
    function column(data, name) {
      return data instanceof Map ? data.get(name) : data[name];
    }

    // Pop-ups; texts of the study go in as text, never as markup.
    function card({ layer, row }) {
      const data = layer.renderer.data_source.data;
      const part = document.createElement("div");
      const title = document.createElement("strong");
      title.textContent = layer.label;
      const list = document.createElement("dl");
      layer.heads.forEach((head, i) => {
        const term = document.createElement("dt");
        const value = document.createElement("dd");
        term.textContent = head;
        value.textContent = column(data, `v${i}`)[row];
        list.append(term, value);
      });
      part.append(title, list);
      return part;
    }
    function place(event) {
      const frame = box.getBoundingClientRect();
      return [event.clientX - frame.left - box.clientLeft, event.clientY - frame.top - box.clientTop];
    }
    function point(event) {
      const [sx, sy] = place(event);
      const top = event.buttons === 0 ? hits(sx, sy)[0] : undefined;
      tip.hidden = top === undefined;
      if (top === undefined) return;
      tip.replaceChildren(card(top));
      const flipX = sx + tip.offsetWidth + 24 > box.clientWidth;
      const flipY = sy + tip.offsetHeight + 24 > box.clientHeight;
      tip.style.left = `${Math.max(4, flipX ? sx - tip.offsetWidth - 14 : sx + 14)}px`;
      tip.style.top = `${Math.max(4, flipY ? sy - tip.offsetHeight - 14 : sy + 14)}px`;
    }
    function pick(sx, sy) {
      const found = hits(sx, sy);
      for (const { renderer } of layers) {
        if (renderer.data_source.selected.indices.length) renderer.data_source.selected.indices = [];
      }
      if (found.length) found[0].layer.renderer.data_source.selected.indices = [found[0].row];
      const nothing = document.createElement("p");
      nothing.textContent = "Nothing is drawn here.";
      picked.replaceChildren(...(found.length ? found.map(card) : [nothing]));
    }
    let pressed;
    box.addEventListener("pointermove", (event) => event.pointerType === "mouse" && point(event));
    box.addEventListener("pointerleave", () => (tip.hidden = true));
    box.addEventListener("pointerdown", (event) => (pressed = place(event)), true);
    box.addEventListener("pointerup", (event) => {
      const [sx, sy] = place(event);
      if (pressed && Math.hypot(sx - pressed[0], sy - pressed[1]) < 5) pick(sx, sy);
      pressed = undefined;
    }, true);

    const keys = {
      ArrowLeft: () => move(-0.15, 0),
      ArrowRight: () => move(0.15, 0),
      ArrowUp: () => move(0, 0.15),
      ArrowDown: () => move(0, -0.15),
      "+": () => zoom(0.6),
      "=": () => zoom(0.6),
      "-": () => zoom(1 / 0.6),
      0: all,
      Enter: () => pick(box.clientWidth / 2, box.clientHeight / 2),
    };
    box.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in keys)) return;
      keys[event.key]();
      event.preventDefault();
    });
  }
})();
