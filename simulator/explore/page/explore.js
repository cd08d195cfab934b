"use strict";
// The page of `photosite explore`. One request is under way at a time; when its answer is there, the latest one follows.

const REST_MS = 300; // without a move, after which the place at 1:1 and the whole frame are asked for
const FINE_MS = 120; // without a move, after which a coarse preview is followed by a fine one
const find = (id) => document.getElementById(id);
const state = { socket: null, shot: "", controls: [], settings: {}, at: [0.5, 0.5], number: 0, sent: null, next: null, rest: 0,
                command: "", data: null, window: null, moved: null, shown: null };
// What a test or a curious reader may measure: times from a move to its picture [ms], and answers by kind.
const measured = { paints_ms: [], answers: { controls: 0, preview: 0, detail: 0, frame: 0, error: 0 }, last: null };
window.photosite = { state, measured };

function connect() {
  const socket = new WebSocket(`ws://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => tell("");
  socket.onmessage = (event) => receive(event.data);
  socket.onclose = () => { tell("the server has ended; start photosite explore again and reload the page"); status("not connected"); };
  state.socket = socket;
}

function receive(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  if (head.kind === "shots") return listShots(head.shots);
  if (head.kind === "refused") { state.sent = null; return tell(head.message); }
  if (head.kind === "error") {
    measured.answers.error += 1;
    tell(head.message);
    find("picture").classList.add("stale");
    if (head.want === "controls" && isLatest(head)) goBack();
    return answered(head);
  }
  if (head.kind === "controls") {
    measured.answers.controls += 1;
    if (isLatest(head)) showControls(head);
    return answered(head);
  }
  const pixels = new ImageData(new Uint8ClampedArray(buffer, 4 + length, head.width * head.height * 4), head.width, head.height);
  state.command = head.command;
  measured.answers[head.want] += 1;
  measured.last = head;
  if (head.want === "detail") {
    paint(find("detail"), pixels);
    state.window = head.data.window;
    drawHistogram(head.data.histogram);
    drawPixel(head.data.pixel);
    placeMarker();
  } else {
    paint(find("picture"), pixels);
    find("picture").classList.remove("stale");
    if (head.want === "frame") find("warnings").textContent = head.data.warnings.join(". ");
    if (head.want === "preview") { state.data = head.data; drawFigures(head.data); tell(""); }
    const moved = state.moved;
    if (moved !== null && head.want === "preview") {
      state.moved = null;
      requestAnimationFrame(() => measured.paints_ms.push(performance.now() - moved));
    }
  }
  answered(head);
}

// Whether nothing newer was asked for than what is answered here.
function isLatest(head) { return state.sent !== null && head.number === state.sent.number && state.next === null; }

function answered(head) {
  if (state.sent === null || head.number !== state.sent.number) return; // of a request that a newer one has replaced
  const was_moving = state.sent.is_moving;
  state.sent = null;
  if (state.next !== null) return send();
  clearTimeout(state.rest);
  const is_error = head.kind === "error";
  if (head.want === "controls" && !is_error) return ask("preview");
  status(is_error ? "this view cannot be taken" : { preview: "preview", detail: "preview, 1:1", frame: "whole frame" }[head.want]);
  if (is_error || head.want === "frame") return;
  if (head.want === "detail") ask("frame");
  else if (head.data.is_coarse) state.rest = setTimeout(() => ask("preview"), FINE_MS);
  else state.rest = setTimeout(() => ask("detail"), was_moving ? REST_MS : REST_MS - FINE_MS);
}

function ask(wanted, is_moving = false) {
  clearTimeout(state.rest);
  const waiting = state.next || state.sent; // another scene or camera comes with its controls, whatever is moved meanwhile
  const want = waiting && waiting.want === "controls" ? "controls" : wanted;
  state.number += 1;
  state.next = { number: state.number, want, shot: state.shot, settings: { ...state.settings }, at: state.at, is_moving };
  // A frame takes seconds, and its server drops it for a newer request; everything else is waited for.
  if (state.sent === null || state.sent.want === "frame" || state.sent.want === "detail") send();
}

function send() {
  if (state.socket.readyState !== WebSocket.OPEN) return;
  state.sent = state.next;
  state.next = null;
  status({ controls: "loading", preview: "computing a preview", detail: "computing 1:1", frame: "computing the whole frame" }[state.sent.want]);
  state.socket.send(JSON.stringify(state.sent));
}

function status(text) { find("status").textContent = text; }
function tell(text) { find("message").textContent = text; }

// ---------------------------------------------------------------------------------------------------------- controls

function listShots(shots) {
  find("shot").replaceChildren(...shots.map((name) => new Option(name.split("/").pop(), name)));
  open(shots[0]);
}

function open(shot) {
  state.shot = shot;
  state.settings = {};
  ask("controls");
}

function showControls(head) {
  const focused = document.activeElement && document.activeElement.id;
  state.controls = head.data.controls;
  state.settings = head.data.settings;
  state.command = head.command;
  state.shown = { shot: head.shot, settings: { ...head.data.settings } };
  find("shot").value = head.shot;
  find("sliders").replaceChildren(...state.controls.map((control) => (control.kind === "list" ? makeList(control) : makeSlider(control))));
  if (state.controls.some((control) => control.key === focused)) find(focused).focus();
  find("notes").textContent = head.data.notes.join(". ");
}

// What was chosen last cannot be taken: the page shows what it had.
function goBack() {
  if (state.shown === null) return;
  state.shot = state.shown.shot;
  state.settings = { ...state.shown.settings };
  find("shot").value = state.shot;
  for (const control of state.controls) show(control);
}

function makeRow(control, input) {
  const row = document.createElement("div"), label = document.createElement("label");
  row.className = "slider";
  input.id = label.htmlFor = control.key;
  label.textContent = control.name;
  control.input = input;
  row.append(label);
  return row;
}

// A camera brings its own sensor; the rest of what was set stays.
function makeList(control) {
  const input = document.createElement("select"), row = makeRow(control, input);
  input.replaceChildren(...control.choices.map((choice) => new Option(choice.label, choice.text)));
  input.value = control.choices[control.index].text;
  input.addEventListener("change", () => {
    state.settings[control.key] = input.value;
    if (control.key === "camera") delete state.settings["camera.pixel_pitch"];
    ask("controls");
  });
  row.append(input);
  return row;
}

function makeSlider(control) {
  const input = document.createElement("input"), row = makeRow(control, input), output = document.createElement("output");
  input.type = "range";
  input.min = 0;
  input.max = control.choices.length - 1;
  input.value = control.index;
  output.htmlFor = control.key;
  control.output = output;
  show(control);
  input.addEventListener("input", () => { move(control, Number(input.value)); });
  row.append(output, input);
  return row;
}

function show(control) {
  const choice = control.choices[control.index];
  if (control.kind === "list") { control.input.value = choice.text; return; }
  control.input.value = control.index;
  control.output.textContent = choice.label;
  control.input.setAttribute("aria-valuetext", choice.label);
}

function set(control, index) {
  control.index = index;
  if (index === control.own) delete state.settings[control.key];
  else state.settings[control.key] = control.choices[index].text;
  show(control);
}

function move(control, index) {
  const before = control.choices[control.index].number, after = control.choices[index].number;
  set(control, index);
  find("notes").textContent = "";
  if (find("lock").checked) keepExposure(control.key, after / before);
  if (state.moved === null) state.moved = performance.now();
  ask("preview", true);
}

// Equal exposures: t ISO / N^2 stays. What moves in answer is the shutter, and the aperture where the shutter moved.
function keepExposure(key, ratio) {
  const light = { "lens.f_number": ratio ** -2, "exposure.time": ratio, "exposure.iso": ratio }[key];
  if (light === undefined) return;
  const other = state.controls.find((one) => one.key === (key === "exposure.time" ? "lens.f_number" : "exposure.time"));
  if (other === undefined) return;
  const wanted = other.choices[other.index].number * (other.key === "lens.f_number" ? Math.sqrt(light) : 1 / light);
  const off = (choice) => Math.abs(Math.log(choice.number / wanted));
  set(other, other.choices.reduce((best, choice, place) => (off(choice) < off(other.choices[best]) ? place : best), 0));
}

// ---------------------------------------------------------------------------------------------------------- pictures

function paint(canvas, pixels) {
  if (canvas.width !== pixels.width || canvas.height !== pixels.height) { canvas.width = pixels.width; canvas.height = pixels.height; }
  canvas.getContext("2d").putImageData(pixels, 0, 0);
}

function placeMarker() {
  const marker = find("marker"), sensor = state.data && state.data.sensor;
  if (!sensor || !state.window) return;
  const part = (value, whole) => `${(100 * value) / whole}%`;
  marker.style.left = part(state.window.x, sensor.width_px);
  marker.style.top = part(state.window.y, sensor.height_px);
  marker.style.width = part(state.window.width, sensor.width_px);
  marker.style.height = part(state.window.height, sensor.height_px);
}

function lookAt(across, down) {
  const inside = (share) => Math.min(Math.max(share, 0), 1);
  state.at = [inside(across), inside(down)];
  ask("detail");
}

// ---------------------------------------------------------------------------------------------------------- diagrams

const SVG = "http://www.w3.org/2000/svg";
function element(name, attributes, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}
function drawing(id, width, height) {
  const svg = find(id);
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren();
  return {
    line: (x1, y1, x2, y2, stroke = "var(--ink)", more = {}) => svg.append(element("line", { x1, y1, x2, y2, stroke, ...more })),
    path: (points, stroke = "var(--accent)", more = {}) =>
      svg.append(element("polyline", { points: points.map((one) => one.map((v) => v.toFixed(2)).join()).join(" "), fill: "none", stroke, "stroke-width": 1.5, ...more })),
    box: (x, y, w, h, fill, more = {}) => svg.append(element("rect", { x, y, width: Math.max(w, 0), height: Math.max(h, 0), fill, ...more })),
    dot: (cx, cy, r, fill = "var(--warm)") => svg.append(element("circle", { cx, cy, r, fill })),
    text: (x, y, text, more = {}) => svg.append(element("text", { x, y, ...more }, text)),
  };
}

const digits = (value, count = 3) => (value === null || value === undefined ? "∞" : Number(value.toPrecision(count)).toString());
const metres = (value) => (value === null ? "infinity" : `${digits(value, 3)} m`);
function seconds(value) { return value < 0.3 ? `1/${digits(1 / value, 4)} s` : `${digits(value)} s`; }
function fill(id, rows) {
  find(id).replaceChildren(...rows.filter(Boolean).map(([name, value]) => {
    const row = document.createElement("tr"), head = document.createElement("th"), cell = document.createElement("td");
    head.scope = "row";
    head.textContent = name;
    cell.textContent = value;
    row.append(head, cell);
    return row;
  }));
}

function drawFigures(data) {
  for (const section of document.querySelectorAll("[data-needs]")) section.hidden = !data[section.dataset.needs];
  if (data.lens) { drawRays(data.lens, data.sensor); drawBlur(data.lens, data.sensor); drawLensTable(data.lens, data.sensor); }
  drawShutter(data.shutter, data.motion);
  drawExposureTable(data.exposure);
  drawFormat(data.sensor, data.lens);
  placeMarker();
  const lens = data.lens ? `${digits(data.lens.focal_length_mm)} mm, f/${digits(data.lens.f_number)}, ` : "";
  find("facts").textContent = `${data.sensor.name}, ${lens}${seconds(data.exposure.time_s)}, ISO ${data.exposure.iso}`;
  find("warnings").textContent = "";
}

// Along the axis all is to scale behind the lens; in front of it, where metres stand against millimetres, the scale is another.
function drawRays(lens, sensor) {
  const d = drawing("rays", 420, 170), lens_x = 250, axis_y = 85;
  const behind = 150 / Math.max(lens.image_distance_mm * 1.15, 1), front = lens.focus_distance_m === null ? null : 220;
  const half_mm = Math.max(lens.pupil_diameter_mm, sensor.height_mm), up = 52 / (half_mm / 2);
  const sensor_x = lens_x + lens.image_distance_mm * behind, focal_x = lens_x + lens.focal_length_mm * behind;
  const pupil = (lens.pupil_diameter_mm / 2) * up;
  d.line(5, axis_y, 415, axis_y, "var(--line)");
  d.path([[lens_x, axis_y - 62], [lens_x + 5, axis_y], [lens_x, axis_y + 62], [lens_x - 5, axis_y], [lens_x, axis_y - 62]], "var(--ink)");
  d.line(sensor_x, axis_y - (sensor.height_mm / 2) * up, sensor_x, axis_y + (sensor.height_mm / 2) * up, "var(--ink)", { "stroke-width": 3 });
  for (const side of [-1, 1]) { // the stop, its opening, and rays of a point in focus and of one at infinity
    d.line(lens_x, axis_y + side * pupil, lens_x, axis_y + side * 62, "var(--soft)", { "stroke-width": 4 });
    const start = front === null ? [5, axis_y + side * pupil] : [lens_x - front, axis_y];
    d.path([start, [lens_x, axis_y + side * pupil], [sensor_x, axis_y]]);
    const blur = (side * pupil * (lens.focal_length_mm - lens.image_distance_mm)) / lens.focal_length_mm;
    d.path([[5, axis_y + side * pupil], [lens_x, axis_y + side * pupil], [focal_x, axis_y], [sensor_x, axis_y + blur]], "var(--warm)", { "stroke-dasharray": "4 3" });
  }
  d.dot(focal_x, axis_y, 2.5, "var(--ink)");
  d.text(focal_x - 4, axis_y + 14, "F");
  d.text(6, 14, lens.focus_distance_m === null ? "in focus: infinity" : `in focus: ${metres(lens.focus_distance_m)} (not to scale)`, { class: "soft" });
  d.text(6, 164, "- - - from infinity", { class: "soft" });
  d.text(lens_x + 8, 14, `A = ${digits(lens.pupil_diameter_mm)} mm`);
  d.text(lens_x + 8, 164, `zᵢ = ${digits(lens.image_distance_mm, 4)} mm`);
}

function drawBlur(lens, sensor) {
  const d = drawing("blur", 420, 150), left = 40, right = 410, top = 10, bottom = 120;
  const first = Math.log(lens.distances_m[0]), last = Math.log(lens.distances_m[lens.distances_m.length - 1]);
  const x = (m) => left + ((Math.log(m) - first) / (last - first)) * (right - left);
  const most = Math.max(4 * lens.circle_of_confusion_um, 1.15 * lens.blur_at_infinity_um);
  const y = (um) => bottom - (Math.min(um, most) / most) * (bottom - top);
  if (lens.near_m !== null) {
    const near = Math.max(x(lens.near_m), left), far = lens.far_m === null ? right : Math.min(x(lens.far_m), right);
    d.box(near, top, far - near, bottom - top, "var(--accent)", { opacity: 0.15 });
  }
  d.path(lens.distances_m.map((m, i) => [x(m), y(lens.blur_diameter_um[i])]));
  d.line(left, y(lens.circle_of_confusion_um), right, y(lens.circle_of_confusion_um), "var(--warm)", { "stroke-dasharray": "4 3" });
  d.line(left, bottom, right, bottom);
  d.line(left, top, left, bottom);
  for (const m of [0.2, 0.5, 1, 2, 5, 10, 20, 50, 100]) if (m > lens.distances_m[0]) d.text(x(m), bottom + 13, `${m}`, { "text-anchor": "middle", class: "soft" });
  d.text(right, bottom + 27, "distance [m]", { "text-anchor": "end", class: "soft" });
  d.text(left - 4, top + 8, `${digits(most, 2)}`, { "text-anchor": "end", class: "soft" });
  d.text(left - 4, bottom, "0", { "text-anchor": "end", class: "soft" });
  d.text(left, bottom + 27, "blur circle [µm]; shaded: depth of field", { class: "soft" });
}

function drawLensTable(lens, sensor) {
  fill("lens-table", [
    ["Field of view", `${lens.field_of_view_deg.map((one) => digits(one)).join("° × ").replace(/° × (?=[^×]*$)/, "°, diagonal ")}°`],
    ["Depth of field", `${metres(lens.near_m)} to ${metres(lens.far_m)}`],
    ["Hyperfocal distance", metres(lens.hyperfocal_m)],
    ["Blur of infinity", `${digits(lens.blur_at_infinity_um)} µm, ${digits(lens.blur_at_infinity_um / sensor.pixel_pitch_um)} photosites`],
    ["Airy disk", `${digits(lens.airy_diameter_um)} µm`],
    ["On 36 mm × 24 mm", `${digits(lens.focal_length_35mm_mm)} mm f/${digits(lens.f_number_35mm)}`],
  ]);
}

function drawShutter(shutter, motion) {
  const d = drawing("shutter", 420, 130), left = 40, right = 410, top = 12, bottom = 100;
  const end = Math.max(...shutter.closed_s), rows = shutter.lines.length, step = (bottom - top) / rows;
  const x = (s) => left + (s / end) * (right - left);
  shutter.lines.forEach((line, i) => {
    const y = top + i * step;
    d.path([[x(shutter.opens_s[i]), y + step - 2], [x(shutter.open_s[i]), y + 2], [x(shutter.closes_s[i]), y + 2], [x(shutter.closed_s[i]), y + step - 2]], "var(--accent)", { fill: "var(--accent)", "fill-opacity": 0.35 });
    if (i === 0 || i === rows - 1) d.text(left - 4, y + step / 2 + 4, shutter.axis === "all" ? "all" : `${line}`, { "text-anchor": "end", class: "soft" });
  });
  if (motion !== null) {
    d.path([[left, bottom], [right, top]], "var(--warm)", { "stroke-dasharray": "4 3" });
    d.text(left + 6, top + 12, `image moves by ${digits(motion.way_px)} photosites in the exposure, ${digits(motion.speed_px_per_s)} per second`);
  }
  d.line(left, bottom, right, bottom);
  d.text(left, bottom + 14, "0");
  d.text(right, bottom + 14, `${digits(1e3 * end)} ms`, { "text-anchor": "end" });
  d.text(left, bottom + 27, shutter.axis === "all" ? "all lines are open together" : `${shutter.axis} of the sensor, of ${shutter.total_lines}`, { class: "soft" });
}

function drawExposureTable(exposure) {
  fill("exposure-table", [
    exposure.exposure_value === null ? null : ["Exposure value", `${digits(exposure.exposure_value)} EV`],
    exposure.white_exposure_lx_s === null ? null : ["Exposure H of white", `${digits(exposure.white_exposure_lx_s)} lx s`],
    ...Object.entries(exposure.white_electrons || {}).map(([name, mean]) => [`Electrons of white, ${COLOR_NAMES[name]}`, `${digits(mean, 4)} e⁻`]),
    ["Clipping", `${digits(exposure.full_scale_e, 4)} e⁻`],
    ["Gain", `${digits(exposure.gain_dn_per_e, 4)} DN/e⁻`],
    ["Noise in the dark", `${digits(exposure.dark_noise_e)} e⁻`],
  ]);
}

function drawFormat(sensor, lens) {
  const d = drawing("format", 420, 150), scale = 4.4, middle_x = 210, middle_y = 72;
  const frame = (w, h, stroke, more) => d.box(middle_x - (w * scale) / 2, middle_y - (h * scale) / 2, w * scale, h * scale, "none", { stroke, "stroke-width": 1.5, ...more });
  frame(36, 24, "var(--soft)", { "stroke-dasharray": "4 3" });
  frame(sensor.width_mm, sensor.height_mm, "var(--accent)");
  d.text(middle_x, 146, `${digits(sensor.width_mm)} mm × ${digits(sensor.height_mm)} mm; dashed: 36 mm × 24 mm`, { "text-anchor": "middle", class: "soft" });
  if (lens) {
    const half = (lens.field_of_view_deg[0] * Math.PI) / 360, reach = 75, foot = middle_y + 36;
    d.path([[middle_x - reach * Math.sin(half), foot - reach * Math.cos(half)], [middle_x, foot], [middle_x + reach * Math.sin(half), foot - reach * Math.cos(half)]], "var(--warm)");
    d.text(middle_x, foot + 12, `${digits(lens.field_of_view_deg[0])}°`, { "text-anchor": "middle" });
  }
  fill("format-table", [
    ["Photosites", `${sensor.width_px} × ${sensor.height_px}`],
    ["Pitch", `${digits(sensor.pixel_pitch_um)} µm`],
    lens ? ["Crop factor", digits(lens.crop_factor)] : null,
  ]);
}

const COLORS = { R: "#d5493d", G: "#3a9a4a", B: "#4a7bd8", C: "var(--soft)", W: "var(--soft)", M: "var(--soft)" };
const COLOR_NAMES = { R: "red", G: "green", B: "blue", C: "clear", W: "white", M: "no filter" };
function drawHistogram(histogram) {
  const d = drawing("histogram", 420, 120), left = 10, right = 410, bottom = 95;
  const most = Math.max(1, ...Object.values(histogram.counts).flat()), bins = histogram.edges_e.length - 1;
  const x = (i) => left + (i / bins) * (right - left);
  for (const [name, counts] of Object.entries(histogram.counts)) {
    d.path(counts.flatMap((count, i) => [[x(i), bottom - 85 * Math.sqrt(count / most)], [x(i + 1), bottom - 85 * Math.sqrt(count / most)]]), COLORS[name]);
  }
  d.line(left, bottom, right, bottom);
  const last = histogram.edges_e[bins], zero = left + ((0 - histogram.edges_e[0]) / (last - histogram.edges_e[0])) * (right - left);
  d.line(zero, bottom, zero, bottom + 4);
  d.text(zero, bottom + 16, "0", { "text-anchor": "middle" });
  d.text(right, bottom + 16, `${digits(last)} e⁻`, { "text-anchor": "end" });
  d.text(right, 12, "electrons of each photosite (root scale)", { class: "soft", "text-anchor": "end" });
}

function drawPixel(pixel) {
  const stated = (name, value, unit) => (value === null ? null : [name, `${digits(value, 4)} ${unit}`]);
  fill("pixel-table", [
    ["Colour", COLOR_NAMES[pixel.color]],
    stated("Luminance of such a grey", pixel.luminance_cd_m2, "cd/m²"),
    stated("Exposure H", pixel.exposure_lx_s, "lx s"),
    stated("Photons", pixel.photons, ""),
    stated("Mean electrons", pixel.mean_electrons, "e⁻"),
    ["Noise", `${digits(pixel.sigma_e)} e⁻, ${digits(pixel.sigma_dn)} DN`],
    ["Signal to noise", pixel.snr === null ? "0" : digits(pixel.snr)],
    ["Code, without noise", `${digits(pixel.mean_dn, 6)} DN`],
    ["Code of this frame", `${pixel.code_dn} DN${pixel.is_clipped ? ", clipped" : ""}`],
  ]);
  const shares = Object.entries(pixel.shares).filter(([, share]) => share >= 0.001), d = drawing("shares", 420, 18 * shares.length + 6);
  shares.forEach(([name, share], i) => {
    d.box(170, 18 * i + 3, 200 * share, 12, "var(--accent)");
    d.text(165, 18 * i + 13, name.replaceAll("_", " "), { "text-anchor": "end" });
    d.text(175 + 200 * share, 18 * i + 13, `${digits(100 * share, 2)} %`);
  });
  drawTransfer(pixel.transfer);
}

function drawTransfer(transfer) {
  const d = drawing("transfer", 420, 170), left = 40, right = 410, top = 10, bottom = 140;
  const points = transfer.curve_dn.map((mean, i) => [mean, transfer.curve_dn2[i]]).filter(([mean, variance]) => mean > 0 && variance > 0);
  if (points.length < 2) return;
  const logs = (at) => points.map((one) => Math.log10(one[at])), range = (values) => [Math.min(...values), Math.max(...values)];
  const [x0, x1] = range(logs(0)), [y0, y1] = range(logs(1));
  const x = (mean) => left + ((Math.log10(mean) - x0) / (x1 - x0 || 1)) * (right - left);
  const y = (variance) => bottom - ((Math.log10(variance) - y0) / (y1 - y0 || 1)) * (bottom - top);
  d.path(points.map(([mean, variance]) => [x(mean), y(variance)]));
  if (transfer.mean_dn > 0 && transfer.variance_dn2 > 0) d.dot(Math.min(Math.max(x(transfer.mean_dn), left), right), Math.min(Math.max(y(transfer.variance_dn2), top), bottom), 4);
  d.line(left, bottom, right, bottom);
  d.line(left, top, left, bottom);
  d.text(left + 8, top + 8, "variance [DN²]; dot: the patch around this photosite", { class: "soft" });
  d.text(right, bottom + 26, "signal [DN]", { "text-anchor": "end", class: "soft" });
  d.text(left, bottom + 13, digits(10 ** x0, 2), { class: "soft" });
  d.text(right, bottom + 13, digits(10 ** x1, 2), { "text-anchor": "end", class: "soft" });
}

// ---------------------------------------------------------------------------------------------------------- actions

async function fetchView(kind) {
  const body = JSON.stringify({ want: "frame", shot: state.shot, settings: state.settings });
  const answer = await fetch(`view.${kind}`, { method: "POST", body });
  if (!answer.ok) throw new Error(await answer.text());
  return answer;
}

async function act(what, done) {
  try {
    await what();
    status(done);
  } catch (error) {
    tell(`${error.message || error}`);
  }
}

window.addEventListener("DOMContentLoaded", () => {
  find("shot").addEventListener("change", (event) => open(event.target.value));
  find("sliders").addEventListener("submit", (event) => event.preventDefault());
  find("reset").addEventListener("click", () => open(state.shot));
  find("copy-command").addEventListener("click", () => act(() => navigator.clipboard.writeText(state.command), "command copied"));
  find("copy-yaml").addEventListener("click", () =>
    act(async () => navigator.clipboard.writeText(await (await fetchView("yaml")).text()), "YAML copied"));
  find("download").addEventListener("click", () =>
    act(async () => {
      status("computing the DNG");
      const link = document.createElement("a");
      link.href = URL.createObjectURL(await (await fetchView("dng")).blob());
      link.download = `${state.shot.split("/").pop().replace(/\.yaml$/, "")}.dng`;
      link.click();
      URL.revokeObjectURL(link.href);
    }, "DNG downloaded"));
  const picture = find("picture");
  picture.addEventListener("click", (event) => {
    const box = picture.getBoundingClientRect();
    lookAt((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
  });
  picture.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!by) return;
    event.preventDefault();
    lookAt(state.at[0] + 0.02 * by[0], state.at[1] + 0.02 * by[1]);
  });
  connect();
});
