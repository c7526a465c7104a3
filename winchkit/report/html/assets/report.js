"use strict";
(() => {
  const plots = JSON.parse(document.getElementById("plots").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const print = matchMedia("print");
  const HEIGHT = 240;
  const PRINTED = 640;
  let drawn = [];

  const colour = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const short = value => (value == null ? "–" : String(+value.toPrecision(4)).replace("-", "−"));

  function noiseBand(u, noise) {
    if (!noise) return;
    const top = Math.max(u.valToPos(noise, "y", true), u.bbox.top);
    const bottom = Math.min(u.valToPos(-noise, "y", true), u.bbox.top + u.bbox.height);
    u.ctx.save();
    u.ctx.fillStyle = colour("noise");
    u.ctx.fillRect(u.bbox.left, top, u.bbox.width, bottom - top);
    u.ctx.restore();
  }

  function noiseLines(u, noise) {
    if (!noise) return;
    u.ctx.save();
    u.ctx.strokeStyle = colour("quiet");
    u.ctx.lineWidth = devicePixelRatio;
    u.ctx.setLineDash([2 * devicePixelRatio, 3 * devicePixelRatio]);
    for (const level of [noise, -noise]) {
      const y = u.valToPos(level, "y", true);
      if (y < u.bbox.top || y > u.bbox.top + u.bbox.height) continue;
      u.ctx.beginPath();
      u.ctx.moveTo(u.bbox.left, y);
      u.ctx.lineTo(u.bbox.left + u.bbox.width, y);
      u.ctx.stroke();
    }
    u.ctx.restore();
  }

  function zeroLine(u) {
    const y = u.valToPos(0, "y", true);
    if (y < u.bbox.top || y > u.bbox.top + u.bbox.height) return;
    u.ctx.save();
    u.ctx.strokeStyle = colour("quiet");
    u.ctx.lineWidth = devicePixelRatio;
    u.ctx.beginPath();
    u.ctx.moveTo(u.bbox.left, y);
    u.ctx.lineTo(u.bbox.left + u.bbox.width, y);
    u.ctx.stroke();
    u.ctx.restore();
  }

  function span(columns, margin) {
    let low = Infinity, high = -Infinity;
    for (const column of columns) for (const value of column) {
      if (value == null) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    const edge = margin * (high - low);
    return high > low ? [low - edge, high + edge] : [low - 1, high + 1];
  }

  // The range of everything, until the user zooms into a part of it.
  function ranges(plot) {
    const y = span([...plot.series, ...(plot.means || [])].map(one => one.values), 0.06);
    const scales = { x: { time: false, distr: plot.log ? 3 : 1 }, y: { range: y } };
    if (plot.kind === "over" && !plot.log) {
      const [low, high] = [plot.x[0], plot.x[plot.x.length - 1]];
      const edge = 0.03 * (high - low) || 1;
      scales.x.range = (u, from, to) => (from <= low && to >= high ? [low - edge, high + edge] : [from, to]);
    }
    return scales;
  }

  function runMarks(u, marks) {
    const ctx = u.ctx, ratio = devicePixelRatio, right = u.bbox.left + u.bbox.width;
    ctx.save();
    ctx.font = `${11 * ratio}px system-ui, sans-serif`;
    ctx.fillStyle = colour("quiet");
    ctx.strokeStyle = colour("quiet");
    ctx.lineWidth = ratio;
    ctx.textAlign = "left";
    ctx.textBaseline = "bottom";
    ctx.setLineDash([3 * ratio, 3 * ratio]);
    marks.forEach((mark, n) => {
      const from = u.valToPos(mark.at, "x", true);
      const to = n + 1 < marks.length ? u.valToPos(marks[n + 1].at, "x", true) : right;
      if (from < u.bbox.left - 1 || from > right) return;
      if (n > 0) {
        ctx.beginPath();
        ctx.moveTo(from, u.bbox.top);
        ctx.lineTo(from, u.bbox.top + u.bbox.height);
        ctx.stroke();
      }
      let name = mark.name;
      const room = to - from - 4 * ratio;
      while (name.length > 2 && ctx.measureText(name).width > room) name = name.slice(0, -2) + "…";
      if (name.length > 2) ctx.fillText(name, from + 3 * ratio, u.bbox.top - 2 * ratio);
    });
    ctx.restore();
  }

  function tooltip(plot) {
    const tip = document.createElement("div");
    tip.className = "tip";
    tip.hidden = true;
    return {
      hooks: {
        init: u => u.over.appendChild(tip),
        setCursor: u => {
          const { left, top, idxs } = u.cursor;
          const lines = u.series.slice(1)
            .map((series, n) => [series, idxs && idxs[n + 1]])
            .filter(([series, at]) => series.show && at != null)
            .map(([series, at]) => `${series.label}: ${short(u.data[u.series.indexOf(series)][at])} ${plot.unit}`);
          tip.hidden = left < 0 || !lines.length;
          if (tip.hidden) return;
          const [, name, unit] = plot.xLabel.match(/^([^,([]+)[^[]*(?:\[(.*)\])?$/);
          const here = short(u.posToVal(left, "x"));
          tip.textContent = [`${name.trim()} ${here} ${unit || ""}`, ...lines].join("\n");
          const right = left > u.over.clientWidth / 2;
          tip.style.left = right ? "" : `${left + 12}px`;
          tip.style.right = right ? `${u.over.clientWidth - left + 12}px` : "";
          tip.style.top = `${Math.min(Math.max(top - 10, 0), u.over.clientHeight - 60)}px`;
        },
      },
    };
  }

  function nearest(u, series, at) {
    const values = u.data[series];
    for (let away = 0; away < values.length; away++) {
      if (values[at - away] != null) return at - away;
      if (values[at + away] != null) return at + away;
    }
    return null;
  }

  function seriesOf(plot) {
    const faint = plot.kind === "over";
    const lines = plot.series.map(one => ({
      label: faint ? `${one.name}, samples` : one.name,
      stroke: colour(one.tone) + (faint ? "59" : ""),
      width: 1,
      paths: faint ? () => null : undefined,
      points: faint
        ? { show: true, size: 4, width: 0, fill: colour(one.tone) + "59", stroke: "transparent" }
        : { show: false },
    }));
    const means = (plot.means || []).map(one => ({
      label: `${one.name}, mean`,
      stroke: colour(one.tone),
      width: 2,
      spanGaps: true,
      points: { show: true, size: 6, fill: colour(one.tone), stroke: colour(one.tone) },
    }));
    return [{}, ...lines, ...means];
  }

  function options(plot, width) {
    const axis = {
      stroke: colour("quiet"),
      font: "11px system-ui, sans-serif",
      labelFont: "12px system-ui, sans-serif",
      labelSize: 18,
      labelGap: 0,
      grid: { stroke: colour("line"), width: 1 },
      ticks: { stroke: colour("line"), width: 1, size: 4 },
    };
    const values = (u, ticks) => ticks.map(tick => (tick == null ? "" : short(tick)));
    return {
      width,
      height: HEIGHT,
      padding: [plot.marks ? 18 : 10, 10, 0, 0],
      scales: ranges(plot),
      axes: [
        { ...axis, label: plot.xLabel, size: 30, values },
        { ...axis, label: plot.yLabel, size: 48, values },
      ],
      series: seriesOf(plot),
      legend: { live: false },
      cursor: { dataIdx: nearest, y: false, points: { size: 6 } },
      hooks: {
        drawClear: [u => noiseBand(u, plot.noise)],
        drawAxes: [zeroLine, u => plot.marks && runMarks(u, plot.marks)],
        draw: [u => noiseLines(u, plot.noise)],
      },
      plugins: [tooltip(plot)],
    };
  }

  function draw(printed) {
    drawn.forEach(u => u.destroy());
    drawn = [...document.querySelectorAll("[data-plot]")].map(place => {
      const plot = plots[place.dataset.plot];
      const columns = [plot.x, ...plot.series.map(s => s.values), ...(plot.means || []).map(s => s.values)];
      const width = printed ? PRINTED : place.clientWidth;
      return new uPlot(options(plot, width), columns, place);
    });
  }

  draw(false);
  dark.addEventListener("change", () => draw(print.matches));
  print.addEventListener("change", () => draw(print.matches));
  let wait = 0;
  addEventListener("resize", () => {
    clearTimeout(wait);
    wait = setTimeout(() => {
      if (!print.matches) drawn.forEach(u => u.setSize({ width: u.root.parentElement.clientWidth, height: HEIGHT }));
    }, 80);
  });
})();
