// Charts as SVG: each function clears its picture and draws the newest state at the size that the picture has.

const SVG = "http://www.w3.org/2000/svg";
// Range of the spectrum below its largest line, dB: as on the terminal.
const RANGE_DB = 50;
// Smallest range of the map, m/s²: above the noise of the sensor, which would fill the map otherwise.
const LEAST_RANGE = 0.05;
const KINDS = {H: "Hopf", D: "period doubling", F: "fold", b: "bistable", "?": "undecided"};
const AXES = ["x", "y", "z"];

function make(parent, name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

// Empties a picture; returns its drawing area with the scales of both axes, or null while it has no size.
function begin(svg, margin) {
  svg.replaceChildren();
  const width = svg.clientWidth, height = svg.clientHeight;
  if (width < 80 || height < 80) return null;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const area = {left: margin.left, right: width - margin.right, top: margin.top, bottom: height - margin.bottom};
  make(svg, "rect", {class: "frame", x: area.left, y: area.top, width: area.right - area.left, height: area.bottom - area.top});
  return area;
}

function note(svg, text) {
  svg.replaceChildren();
  make(svg, "text", {x: 4, y: 24}, text);
}

// About `count` round numbers from 0 or `from` to `to`.
function ticks(from, to, count) {
  const raw = (to - from) / count;
  if (!(raw > 0) || !Number.isFinite(raw)) return [];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(n => n * power).find(n => n >= raw);
  const all = [];
  for (let n = Math.ceil(from / step - 1e-9); n * step <= to * (1 + 1e-9); n++) all.push(Number((n * step).toPrecision(12)));
  return all;
}

const rounded = n => Math.round(n * 10) / 10;

// Ticks below the area with the unit behind the last one.
function bottomAxis(svg, area, from, to, unit) {
  const x = value => area.left + (value - from) / (to - from) * (area.right - area.left);
  const count = Math.max(2, Math.floor((area.right - area.left) / 60));
  const unitWidth = 8 * unit.length + 6;
  for (const value of ticks(from, to, count)) {
    make(svg, "path", {class: "grid", d: `M${rounded(x(value))} ${area.top}V${area.bottom}`});
    if (x(value) > area.right - unitWidth - 12) continue;
    make(svg, "text", {x: x(value), y: area.bottom + 16, "text-anchor": x(value) < 14 ? "start" : "middle"}, String(value));
  }
  make(svg, "text", {x: area.right, y: area.bottom + 16, "text-anchor": "end"}, unit);
  return x;
}

function leftLabel(svg, area, y, text) {
  make(svg, "path", {class: "grid", d: `M${area.left} ${rounded(y)}H${area.right}`});
  if (y < area.top + 5 && text !== "") y = area.top + 5;
  make(svg, "text", {x: area.left - 5, y: y + 4, "text-anchor": "end"}, text);
}

function drawSpectrum(svg, spectrum, head, zoom) {
  if (!spectrum || spectrum.decibel_tenths.length === 0) return note(svg, "no spectrum yet");
  const area = begin(svg, {left: 48, right: 10, top: 24, bottom: 40});
  if (!area) return;
  const levels = spectrum.decibel_tenths.map(tenths => tenths / 10);
  const whole = spectrum.bin_hz * levels.length;
  const end = zoom === null ? spectrum.fitted_end_hz : whole / 2 ** zoom;
  const shown = levels.slice(0, Math.max(2, Math.ceil(end / spectrum.bin_hz) + 1));
  const top = Math.max(...shown);
  const y = db => area.top + Math.min(1, Math.max(0, (top - db) / RANGE_DB)) * (area.bottom - area.top);
  const x = bottomAxis(svg, area, 0, end, "Hz");
  for (const text of svg.querySelectorAll("text")) text.setAttribute("y", area.bottom + 34);
  // Decades of the amplitude.
  for (let power = Math.ceil((top - RANGE_DB) / 20); 20 * power <= top; power++) {
    leftLabel(svg, area, y(20 * power), power < -2 || power > 3 ? `1e${power}` : String(10 ** power));
  }
  make(svg, "text", {x: 4, y: 14}, "m/s²");
  let line = "";
  shown.forEach((db, bin) => {
    const at = bin * spectrum.bin_hz;
    if (at <= end) line += `${line ? "L" : "M"}${rounded(x(at))} ${rounded(y(db))}`;
  });
  make(svg, "path", {class: "area", d: `${line}V${area.bottom}H${area.left}Z`});
  make(svg, "path", {class: "curve", d: line});
  drawHarmonics(svg, area, area.bottom + 16, x, end, head);
  drawChatter(svg, area, x, end, head);
}

// Below the area: dots at the harmonics of the spindle, T at those of the tooth passing.
function drawHarmonics(svg, area, below, x, end, head) {
  const {rpm, tooth_hz: tooth} = head;
  const width = hz => x(hz) - x(0);
  let spindle = "";
  if (rpm > 0 && width(rpm / 60) > 5) {
    for (let hz = rpm / 60; hz <= end; hz += rpm / 60) spindle += `M${rounded(x(hz))} ${area.bottom + 3}v5`;
  }
  make(svg, "path", {class: "spindle-line", d: spindle || "M0 0"});
  if (!(tooth > 0) || width(tooth) < 3) return;
  const every = Math.ceil(14 / width(tooth));
  for (let count = 1; count * tooth <= end; count++) {
    const at = x(count * tooth);
    make(svg, "path", {class: "tooth-line", d: `M${rounded(at)} ${area.bottom}v8`});
    if (count % every === 0 && at < area.right - 4) make(svg, "text", {class: "tooth", x: at, y: below + 3, "text-anchor": "middle"}, "T");
  }
}

function drawChatter(svg, area, x, end, head) {
  if (!(head.chatter_hz > 0) || head.chatter_hz > end) return;
  const at = x(head.chatter_hz);
  make(svg, "path", {class: "chatter-line", d: `M${rounded(at)} ${area.top}V${area.bottom}`});
  make(svg, "path", {class: "chatter-sign", d: `M${rounded(at)} ${area.bottom - 9}l-6 9h12Z`});
  const anchor = at > (area.left + area.right) / 2 ? "end" : "start";
  make(svg, "text", {class: "strong", id: "chatter-label", x: anchor === "end" ? Math.min(at + 40, area.right) : Math.max(at - 8, area.left), y: 14, "text-anchor": anchor}, `▲ chatter ${head.chatter_hz.toFixed(1)} Hz`);
}

function drawMap(svg, map, axes) {
  const points = map ? map.points : [];
  if (points.length === 0) return note(svg, "no tooth passing yet"), "";
  const area = begin(svg, {left: 48, right: 10, top: 10, bottom: 24});
  if (!area) return "";
  const [across, up] = axes;
  const at = points.map(point => [point[across] / 1e4, point[up] / 1e4]);
  const range = 1.1 * Math.max(LEAST_RANGE, ...at.flat().map(Math.abs));
  // Both axes have the same scale, so that a circle is one.
  const [width, height] = [area.right - area.left, area.bottom - area.top];
  const scale = Math.min(width, height) / 2 / range;
  const x = bottomAxis(svg, area, -width / 2 / scale, width / 2 / scale, `m/s² ${AXES[across]}`);
  const y = value => (area.top + area.bottom) / 2 - value * scale;
  for (const value of ticks(-height / 2 / scale, height / 2 / scale, 4)) {
    if (y(value) < area.top + 16) continue;
    leftLabel(svg, area, y(value), String(value));
  }
  make(svg, "text", {x: area.left - 5, y: area.top + 8, "text-anchor": "end"}, AXES[up]);
  const dots = some => some.map(([a, b]) => `M${rounded(x(a))} ${rounded(y(b))}h0`).join("") || "M0 0";
  const recent = Math.max(0, at.length - 40);
  make(svg, "path", {class: "dots old", d: dots(at.slice(0, recent))});
  make(svg, "path", {class: "dots recent", d: dots(at.slice(recent))});
  return `${AXES[across]} → ${AXES[up]} ↑, ±${range.toPrecision(2)} m/s²`;
}

// A colour is not needed to tell the kinds apart: each has its pattern.
function patterns(svg) {
  const defs = make(svg, "defs", {});
  const pattern = (kind, size, draw) => {
    const element = make(defs, "pattern", {id: `hatch-${kind}`, width: size, height: size, patternUnits: "userSpaceOnUse"});
    make(element, "rect", {class: "ground", width: size, height: size});
    draw(element);
  };
  pattern("H", 8, p => make(p, "path", {d: "M-2 2l4-4M0 8l8-8M6 10l4-4"}));
  pattern("D", 8, p => make(p, "circle", {cx: 4, cy: 4, r: 1.5}));
  pattern("F", 8, p => make(p, "path", {d: "M0 4h8"}));
  pattern("b", 8, p => make(p, "path", {d: "M4 0v8"}));
  pattern("u", 8, p => make(p, "path", {d: "M0 4h8M4 0v8"}));
}

function drawLobes(svg, lobes, head) {
  if (!lobes || !lobes.rpm) return note(svg, "no table: start with --table FILE.qct"), "";
  const area = begin(svg, {left: 48, right: 10, top: 22, bottom: 24});
  if (!area) return "";
  patterns(svg);
  const [from, to] = lobes.rpm;
  const x = bottomAxis(svg, area, from, to, "rev/min");
  const y = depth => area.bottom - depth / lobes.depth_mm * (area.bottom - area.top);
  for (const depth of ticks(0, lobes.depth_mm, 4)) leftLabel(svg, area, y(depth), String(depth));
  make(svg, "text", {x: 4, y: 14}, "mm");
  const wide = (area.right - area.left) / lobes.columns.length;
  const regions = {};
  const add = (kind, column, low, high) => {
    const left = area.left + column * wide, right = left + wide;
    regions[kind] = (regions[kind] || "") + `M${rounded(left)} ${rounded(y(high))}H${rounded(right)}V${rounded(y(low))}H${rounded(left)}Z`;
  };
  lobes.columns.forEach((column, index) => {
    if (column === null) return add("x", index, 0, lobes.depth_mm);
    for (const [low, high, kind] of column) add(kind === "?" ? "u" : kind, index, low, high);
  });
  for (const [kind, d] of Object.entries(regions)) make(svg, "path", {class: kind, d, "shape-rendering": "crispEdges"});
  drawPoint(svg, area, lobes, head, x, y);
  return lobes.working_depth_mm === null ? "first layer of the table, no depth set" : `at ${lobes.working_depth_mm.toFixed(2)} mm`;
}

// The working point at the present speed: a cross, or a line without a depth.
function drawPoint(svg, area, lobes, head, x, y) {
  const {rpm} = head, [from, to] = lobes.rpm;
  if (!(rpm >= from && rpm <= to)) return;
  const depth = lobes.working_depth_mm, at = rounded(x(rpm));
  const d = depth === null ? `M${at} ${area.top}V${area.bottom}` : `M${at - 7} ${rounded(y(depth))}h14M${at} ${rounded(y(depth)) - 7}v14`;
  make(svg, "path", {class: "point-halo", d});
  make(svg, "path", {class: "point", d});
  const anchor = at > (area.left + area.right) / 2 ? "end" : "start";
  const text = depth === null ? `${rpm.toFixed(0)} rev/min` : `✚ ${rpm.toFixed(0)} rev/min, ${depth.toFixed(2)} mm`;
  make(svg, "text", {class: "strong", x: anchor === "end" ? area.right : area.left, y: 14, "text-anchor": anchor}, text);
}

// Kinds that the chart has, with their patterns.
function lobesLegend(legend, lobes) {
  const kinds = new Set((lobes && lobes.columns || []).flatMap(column => column === null ? ["x"] : column.map(([, , kind]) => kind)));
  legend.replaceChildren();
  for (const kind of kinds) {
    const swatch = document.createElementNS(SVG, "svg");
    swatch.setAttribute("class", "swatch");
    make(swatch, "rect", {class: kind === "?" ? "u" : kind, width: 40, height: 30});
    const entry = document.createElement("span");
    entry.className = "entry";
    entry.append(swatch, KINDS[kind] || "not in the table");
    legend.append(entry, " ");
  }
}
