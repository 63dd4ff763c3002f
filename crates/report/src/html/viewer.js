// The picture viewer: panels that show one scene's pictures at the same place.
//
// The state says what is to be seen; whoever changes it calls `invalidate`, and
// all panels are drawn from it at the next frame. Data attributes of the section
// repeat the state for tests.

const MODES = ['colour', 'signed', 'absolute', 'flip'];
const LARGEST_SCALE = 256; // screen pixels a pixel
const VALUES_FROM = 64; // screen pixels a pixel from which values stand in it

// Lightness rises evenly from black to pale yellow, as in matplotlib's magma, of
// which these are every eighth: sRGB, in between interpolated.
const MAGMA = [[0, 0, 4], [28, 16, 68], [79, 18, 123], [129, 37, 129], [181, 54, 122],
  [229, 80, 100], [251, 135, 97], [254, 194, 135], [252, 253, 191]];

/** The colour of a FLIP difference from 0 to 1. */
function magma(share) {
  const at = Math.min(Math.max(share, 0), 1) * (MAGMA.length - 1);
  const low = Math.min(Math.floor(at), MAGMA.length - 2);
  return MAGMA[low].map((v, c) => Math.round(v + (at - low) * (MAGMA[low + 1][c] - v)));
}

const FLIP_COLOURS = Array.from({ length: 256 }, (_, i) => magma(i / 255));

/** A picture of the scene, decoded when it is first asked for. */
class Shown {
  constructor(scene, data, name) {
    Object.assign(this, { scene, data, name, words: null, values: null, flip: null });
    this.loading = null;
    this.tinted = null;
  }

  get isReference() {
    return this === this.scene.reference;
  }

  load() {
    this.loading ??= this.decode();
    return this.loading;
  }

  async decode() {
    const { scene, data } = this;
    if (!this.isReference) await scene.reference.load();
    const [bytes, flip] = await Promise.all([inflate(data.pixels), data.flip ? inflate(data.flip) : null]);
    if (bytes.length !== scene.width * scene.height * 12) throw new Error('pixels are missing');
    this.words = unpack(bytes, scene.width, data.prediction, scene.reference.words);
    this.values = new Float32Array(this.words.buffer);
    this.flip = flip;
    this.hasOddValues = !this.values.every(Number.isFinite);
  }

  /** Whether it has a map of visible differences; the reference differs nowhere. */
  get hasFlip() {
    return this.isReference || Boolean(this.data.flip);
  }

  colour(x, y) {
    const at = (y * this.scene.width + x) * 3;
    return [...this.values.subarray(at, at + 3)];
  }

  flipAt(x, y) {
    return this.flip ? this.flip[y * this.scene.width + x] / 255 : 0;
  }

  /** Its pixels as `look` shows them: a canvas, and their bytes. */
  as(look) {
    const key = JSON.stringify(look);
    if (this.tinted?.key !== key) {
      const { width, height } = this.scene;
      const canvas = this.tinted?.canvas ?? make('canvas', { width, height });
      const image = this.paint(look);
      canvas.getContext('2d').putImageData(image, 0, 0);
      this.tinted = { key, canvas, bytes: image.data };
    }
    return this.tinted;
  }

  paint({ mode, srgb, exposure, gain }) {
    const { width, height } = this.scene;
    const image = new ImageData(width, height);
    const pixels = image.data;
    const reference = this.scene.reference.values;
    const [brighter, louder] = [2 ** exposure, 2 ** gain];
    const shown = srgb ? encode : (v) => v;
    const values = this.values;
    for (let i = 0; i < width * height; i++) {
      pixels[i * 4 + 3] = 255;
      if (mode === 'flip') {
        const colour = FLIP_COLOURS[this.flip ? this.flip[i] : 0];
        for (let c = 0; c < 3; c++) pixels[i * 4 + c] = colour[c];
        continue;
      }
      let finite = true;
      for (let c = 0; c < 3; c++) {
        const value = values[i * 3 + c];
        finite &&= Number.isFinite(value);
        let share;
        if (mode === 'colour') {
          share = shown(value * brighter);
        } else {
          const error = (shown(value) - shown(reference[i * 3 + c])) * louder;
          share = mode === 'signed' ? 0.5 + error / 2 : Math.abs(error);
        }
        pixels[i * 4 + c] = share * 255 + 0.5; // clamped; rounded down, so to nearest
      }
      // What is no number shall not pass for black.
      if (!finite) pixels.set([255, 0, 255], i * 4);
    }
    return image;
  }
}

/** A scene of the page's data, with its pictures and the reference as the last. */
function openScene(data) {
  const scene = { ...data };
  scene.reference = new Shown(scene, data.reference, 'reference');
  scene.all = data.pictures.map((picture) => new Shown(scene, picture, picture.name));
  scene.all.push(scene.reference);
  scene.hasFlip = data.pictures.some((picture) => picture.flip);
  return scene;
}

function viewer(section) {
  const find = (selector) => section.querySelector(selector);
  const panelsElement = find('.viewer-panels');
  const scenes = JSON.parse(find('#viewer-data').textContent).scenes.map(openScene);
  const explain = inspector(find('.inspector'));

  const state = {
    scene: scenes[0],
    panels: [],
    active: 0,
    mode: 'colour',
    srgb: true,
    exposure: 0, // stops
    gain: 3, // stops: errors eight times as large
    // Scale in screen (CSS) pixels a pixel; x and y lie in the panels' centres.
    view: { scale: 1, x: 0, y: 0, fitted: true },
    cursor: null,
    explained: null,
  };
  let loads = 0;

  function fail(text) {
    const sentence = find('.viewer-failure');
    sentence.textContent = text;
    sentence.hidden = false;
  }

  // ---- drawing -------------------------------------------------------------

  let drawn = true;
  function invalidate() {
    if (!drawn) return;
    drawn = false;
    requestAnimationFrame(() => {
      drawn = true;
      draw();
    });
  }

  function look() {
    const { mode, srgb, exposure, gain } = state;
    // What a mode does not depend on does not paint anew.
    if (mode === 'colour') return { mode, srgb, exposure };
    return mode === 'flip' ? { mode } : { mode, srgb, gain };
  }

  /** Where the picture's corner lies in a panel, and how large a pixel is: device pixels. */
  function frame(canvas) {
    const { scale, x, y } = state.view;
    const size = scale * devicePixelRatio;
    // Whole device pixels, so that all panels cut a picture alike.
    return { size, left: Math.round(canvas.width / 2 - x * size), top: Math.round(canvas.height / 2 - y * size) };
  }

  function draw() {
    for (const panel of state.panels) drawPanel(panel);
    readValues();
    describe();
  }

  function drawPanel({ canvas, shown, note }) {
    const context = canvas.getContext('2d');
    context.clearRect(0, 0, canvas.width, canvas.height);
    const missing = state.mode === 'flip' && shown && !shown.hasFlip;
    note.hidden = !missing;
    if (!shown || missing) return;
    const { width, height } = state.scene;
    const { size, left, top } = frame(canvas);
    context.imageSmoothingEnabled = size < 1;
    context.imageSmoothingQuality = 'high';
    context.drawImage(shown.as(look()).canvas, left, top, Math.round(width * size), Math.round(height * size));
    if (state.view.scale >= VALUES_FROM) drawValues(context, shown, { size, left, top });
    const mark = (pixel, draw) => pixel && draw(context, left + pixel.x * size, top + pixel.y * size, size);
    mark(state.explained, drawExplained);
    mark(state.cursor, drawCross);
  }

  /** The channels' values in pixels that are large enough. */
  function drawValues(context, shown, { size, left, top }) {
    const { width, height } = state.scene;
    const { canvas } = context;
    const first = (start) => Math.max(0, Math.floor(-start / size));
    const end = (start, extent, count) => Math.min(count, Math.ceil((extent - start) / size));
    const line = 13 * devicePixelRatio;
    context.font = `${11 * devicePixelRatio}px ui-monospace, monospace`;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    const { bytes } = shown.as(look());
    for (let y = first(top); y < end(top, canvas.height, height); y++) {
      for (let x = first(left); x < end(left, canvas.width, width); x++) {
        const [r, g, b] = bytes.subarray((y * width + x) * 4);
        context.fillStyle = r * 0.3 + g * 0.6 + b * 0.1 > 120 ? '#000' : '#fff';
        const texts = pixelTexts(shown, x, y);
        texts.forEach((text, i) => context.fillText(text,
          left + (x + 0.5) * size, top + (y + 0.5) * size + (i - (texts.length - 1) / 2) * line));
      }
    }
  }

  function pixelTexts(shown, x, y) {
    if (state.mode === 'flip') return [shown.flipAt(x, y).toFixed(3)];
    const values = shown.colour(x, y);
    if (state.mode === 'colour') return values.map((v) => v.toFixed(4));
    const reference = state.scene.reference.colour(x, y);
    return values.map((v, c) => signed(v - reference[c], 4));
  }

  /** A stroke that shows on anything: light, with a dark edge. */
  function strokeTwice(context, colour, light = 1) {
    const ratio = Math.max(1, Math.round(devicePixelRatio));
    for (const [width, style] of [[light + 2, 'rgb(0 0 0 / 55%)'], [light, colour]]) {
      context.lineWidth = width * ratio;
      context.strokeStyle = style;
      context.stroke();
    }
  }

  /** A box around the pixel, and short arms that end at it. */
  function drawCross(context, x, y, size) {
    const [cx, cy] = [x, y].map((v) => Math.floor(v + size / 2) + 0.5);
    const from = size / 2 + 4 * devicePixelRatio;
    const to = from + 18 * devicePixelRatio;
    context.beginPath();
    // Where values stand in the pixels, arms would strike them out.
    if (size < VALUES_FROM * devicePixelRatio) {
      for (const [dx, dy] of [[-1, 0], [1, 0], [0, -1], [0, 1]]) {
        context.moveTo(cx + dx * from, cy + dy * from);
        context.lineTo(cx + dx * to, cy + dy * to);
      }
    }
    if (size >= 3) {
      const [left, right] = [Math.round(x), Math.round(x + size)];
      const [top, bottom] = [Math.round(y), Math.round(y + size)];
      context.rect(left - 0.5, top - 0.5, right - left + 1, bottom - top + 1);
    }
    strokeTwice(context, '#fff');
  }

  /** A ring around the pixel whose story the inspector tells; in it, where it is large. */
  function drawExplained(context, x, y, size) {
    context.beginPath();
    const radius = size > 24 * devicePixelRatio ? size / 2 - 5 * devicePixelRatio : size / 2 + 5 * devicePixelRatio;
    context.roundRect(x + size / 2 - radius, y + size / 2 - radius, 2 * radius, 2 * radius, Math.min(radius, 8 * devicePixelRatio));
    strokeTwice(context, '#ffd34d', 2);
  }

  // ---- values under the cross-hair --------------------------------------------

  function signed(value, digits) {
    const text = value.toFixed(digits);
    if (Number(text) === 0) return text.replace('-', '');
    return value > 0 ? `+${text}` : text.replace('-', '−');
  }

  function fillValues(element, shown) {
    const { cursor, scene } = state;
    element.dataset.picture = shown?.name ?? '';
    if (!cursor || !shown?.values) {
      element.replaceChildren();
      return;
    }
    const values = shown.colour(cursor.x, cursor.y);
    const channels = values.map((value, c) => make('span', {
      class: 'channel',
      'data-channel': 'RGB'[c],
      'data-value': exactText(value),
    }, make('b', {}, 'RGB'[c]), exactText(value).replace('-', '−')));
    const parts = [swatch(values, 'colour'), ...channels];
    if (!shown.isReference && scene.reference.values) {
      const reference = scene.reference.colour(cursor.x, cursor.y);
      const errors = values.map((v, c) => signed(v - reference[c], 5)).join(' ');
      const flip = shown.data.flip ? ` FLIP ${shown.flipAt(cursor.x, cursor.y).toFixed(3)}` : '';
      parts.push(make('span', { class: 'error' }, make('b', {}, 'error '), errors, make('span', { class: 'flip' }, flip)));
    }
    element.replaceChildren(...parts);
  }

  function readValues() {
    const { cursor } = state;
    find('.viewer-where').textContent = cursor ? `pixel ${cursor.x},${cursor.y}` : 'pixel –';
    for (const panel of state.panels) fillValues(panel.values, panel.shown);
    fillValues(find('.viewer-readout .viewer-values'), state.scene.reference);
  }

  // ---- words and controls that follow the state ---------------------------------

  function describe() {
    const { view, mode, srgb, cursor } = state;
    const press = (selector, isPressed) => section.querySelectorAll(selector).forEach((button) =>
      button.setAttribute('aria-pressed', isPressed(button)));
    press('[data-mode]', (button) => button.dataset.mode === mode);
    press('[data-panels]', (button) => Number(button.dataset.panels) === state.panels.length);
    press('[data-do=encoding]', () => srgb);
    find('[data-mode=flip]').disabled = !state.scene.hasFlip;
    find('[data-do=encoding]').disabled = mode === 'flip';
    find('.viewer-zoom').textContent = `${Number((view.scale * devicePixelRatio * 100).toPrecision(3))}%`;
    describeAmount();
    legendLine();
    for (const [i, panel] of state.panels.entries()) {
      panel.figure.classList.toggle('active', i === state.active && state.panels.length > 1);
      panel.canvas.setAttribute('aria-label', `${panel.wanted.name}, ${find(`[data-mode=${mode}]`).textContent}`);
      panel.canvas.style.touchAction = view.fitted ? 'pan-y' : 'none';
      panel.select.value = state.scene.all.indexOf(panel.wanted);
      panel.referenceButton.setAttribute('aria-pressed', panel.wanted.isReference);
    }
    Object.assign(section.dataset, {
      mode,
      encoding: srgb ? 'srgb' : 'linear',
      exposure: state.exposure,
      gain: state.gain,
      scale: view.scale,
      x: view.x,
      y: view.y,
      active: state.active,
      cursor: cursor ? `${cursor.x},${cursor.y}` : '',
      ready: loads === 0,
    });
  }

  function describeAmount() {
    const { mode, exposure, gain } = state;
    const slider = find('.viewer-amount input');
    const errors = mode === 'signed' || mode === 'absolute';
    slider.disabled = mode === 'flip';
    slider.value = errors ? gain : exposure;
    find('.viewer-amount-name').textContent = errors ? 'Gain' : 'Exposure';
    find('.viewer-amount output').textContent = errors ? `${Number((2 ** gain).toPrecision(3))}×`
      : `${exposure < 0 ? '−' : '+'}${Math.abs(exposure)} stops`;
  }

  /** What the colours of a mode mean. */
  function legendLine() {
    const { mode, srgb, gain } = state;
    const bar = (colours) => {
      const element = make('span', { class: 'viewer-bar' });
      element.style.background = `linear-gradient(to right, ${colours.join(', ')})`;
      return element;
    };
    const full = String(Number((2 ** -gain).toPrecision(3)));
    const unit = srgb ? 'of sRGB-encoded values, 1 = white' : 'of linear values, 1 = white';
    const parts = {
      colour: () => [srgb ? 'Shown sRGB-encoded.' : 'Linear values, shown as they are.'],
      signed: () => [`−${full}`, bar(['#000', '#808080', '#fff']), `+${full}, picture minus reference `, unit],
      absolute: () => ['0', bar(['#000', '#fff']), `${full}, size of the error `, unit],
      flip: () => ['0', bar(MAGMA.map((c) => `rgb(${c.join(' ')})`)), '1, FLIP: difference seen when flipping'],
    };
    const odd = mode !== 'flip' && state.panels.some(({ shown }) => shown?.hasOddValues);
    const line = find('.viewer-legend');
    const key = `${mode} ${srgb} ${gain} ${odd}`;
    // Spoken only where it is new.
    if (line.dataset.key === key) return;
    line.dataset.key = key;
    line.replaceChildren(...parts[mode](), odd ? ' Magenta: infinite, or no number.' : '');
  }

  // ---- what is shown ---------------------------------------------------------

  /** Shows a picture in a panel; what was there stays until it is decoded. */
  async function show(panel, wanted) {
    panel.wanted = wanted;
    panel.figures.textContent = (wanted.data.figures ?? []).map((figure) => figure.join(' ')).join(' · ');
    panel.figures.title = wanted.data.command ?? '';
    if (!wanted.values) {
      loads++;
      invalidate();
      try {
        await wanted.load();
      } catch {
        fail(`The picture “${wanted.name}” of “${wanted.scene.name}” cannot be read: the file is damaged.`);
      }
      loads--;
    }
    // Meanwhile something else may have been chosen.
    if (panel.wanted === wanted && wanted.values) panel.shown = wanted;
    invalidate();
    if (wanted.values) loadNeighbours(wanted);
  }

  /** Decodes what a key press would show next. */
  function loadNeighbours({ scene }) {
    const { all } = scene;
    const near = state.panels.flatMap(({ wanted }) =>
      [1, all.length - 1].map((step) => all[(all.indexOf(wanted) + step) % all.length]));
    for (const picture of near) picture?.load().catch(() => {}); // said when it is shown
  }

  function step(panel, by) {
    const { all } = state.scene;
    show(panel, all[(all.indexOf(panel.wanted) + by + all.length) % all.length]);
  }

  /** To the reference and back. */
  function toggleReference(panel) {
    const { reference, all } = state.scene;
    if (panel.wanted !== reference) panel.before = panel.wanted;
    show(panel, panel.wanted === reference ? panel.before ?? all[0] : reference);
  }

  function setMode(mode) {
    if (mode === 'flip' && !state.scene.hasFlip) return;
    state.mode = mode;
    invalidate();
  }

  function nextMode() {
    const modes = MODES.filter((mode) => mode !== 'flip' || state.scene.hasFlip);
    setMode(modes[(modes.indexOf(state.mode) + 1) % modes.length]);
  }

  /** Changes what the slider shows: exposure or gain. */
  function setAmount(stops) {
    const amount = Math.min(8, Math.max(-8, stops));
    if (state.mode === 'colour') state.exposure = amount;
    else if (state.mode !== 'flip') state.gain = amount;
    invalidate();
  }

  function setEncoding() {
    state.srgb = !state.srgb;
    invalidate();
  }

  function openSceneAt(index) {
    const kept = state.panels.map((panel) => panel.wanted.name);
    for (const picture of state.scene.all) picture.tinted = null;
    state.scene = scenes[index];
    if (state.mode === 'flip' && !state.scene.hasFlip) state.mode = 'colour';
    state.cursor = null;
    panelsElement.style.setProperty('--ratio', state.scene.width / state.scene.height);
    // The same designs as far as the scene has them, else others.
    const { all } = state.scene;
    const wanted = kept.map((name) => all.find((picture) => picture.name === name));
    state.panels.forEach((panel, i) => {
      panel.shown = null;
      panel.before = null;
      listPictures(panel);
      wanted[i] ??= all.find((picture) => !wanted.includes(picture)) ?? all[0];
      show(panel, wanted[i]);
    });
    fit();
    const [x, y] = state.scene.pixel;
    explainPixel({ x, y }, state.scene.pictures.find((picture) => picture.explain) ?? state.scene.pictures[0]);
  }

  function explainPixel(pixel, picture = state.panels[state.active].wanted.data) {
    if (!pixel) return;
    state.explained = { ...pixel };
    state.cursor ??= { ...pixel };
    const isDesign = state.scene.pictures.includes(picture);
    explain(state.scene, isDesign ? picture : null, pixel.x, pixel.y)
      .catch(() => fail('The pixel’s story cannot be read: the file is damaged.'));
    invalidate();
  }

  // ---- zoom and place -----------------------------------------------------------

  function fittingScale() {
    const { canvas } = state.panels[0];
    return Math.min(canvas.clientWidth / state.scene.width, canvas.clientHeight / state.scene.height) || 1;
  }

  function fit() {
    const { width, height } = state.scene;
    state.view = { scale: fittingScale(), x: width / 2, y: height / 2, fitted: true };
    invalidate();
  }

  /** Zooms to `scale`; the place `at` (offsets from a panel's centre) stays put. */
  function zoom(scale, at = { x: 0, y: 0 }) {
    const { view } = state;
    const to = Math.min(LARGEST_SCALE, Math.max(scale, Math.min(fittingScale(), 1 / devicePixelRatio) / 2));
    view.x += at.x / view.scale - at.x / to;
    view.y += at.y / view.scale - at.y / to;
    view.scale = to;
    view.fitted = false;
    keepInSight();
    invalidate();
  }

  /** Moves the picture by screen pixels. */
  function pan(dx, dy) {
    const { view } = state;
    view.x -= dx / view.scale;
    view.y -= dy / view.scale;
    view.fitted = false;
    keepInSight();
    invalidate();
  }

  function keepInSight() {
    const { view, scene } = state;
    view.x = Math.min(scene.width, Math.max(0, view.x));
    view.y = Math.min(scene.height, Math.max(0, view.y));
  }

  /** Zoom by keys and buttons is about the cross-hair, where it is in sight. */
  function zoomStep(by) {
    const { view, cursor } = state;
    const { canvas } = state.panels[state.active];
    const at = cursor && { x: (cursor.x + 0.5 - view.x) * view.scale, y: (cursor.y + 0.5 - view.y) * view.scale };
    const inSight = at && Math.abs(at.x) < canvas.clientWidth / 2 && Math.abs(at.y) < canvas.clientHeight / 2;
    zoom(view.scale * by, inSight ? at : undefined);
  }

  function moveCursor(dx, dy) {
    const { scene, view } = state;
    const from = state.cursor ?? { x: Math.floor(view.x), y: Math.floor(view.y) };
    const x = Math.min(scene.width - 1, Math.max(0, from.x + dx));
    const y = Math.min(scene.height - 1, Math.max(0, from.y + dy));
    state.cursor = { x, y };
    const { canvas } = state.panels[state.active];
    const off = (centre, at, extent) => Math.abs(at + 0.5 - centre) * view.scale > extent / 2;
    if (off(view.x, x, canvas.clientWidth)) view.x = x + 0.5;
    if (off(view.y, y, canvas.clientHeight)) view.y = y + 0.5;
    invalidate();
  }

  // ---- pointers -------------------------------------------------------------------

  /** Where an event lies, from the panel's centre. */
  function fromCentre(canvas, event) {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left - box.width / 2, y: event.clientY - box.top - box.height / 2 };
  }

  function pixelAt(canvas, event) {
    const box = canvas.getBoundingClientRect();
    const { size, left, top } = frame(canvas);
    const [ratioX, ratioY] = [canvas.width / box.width, canvas.height / box.height];
    const x = Math.floor(((event.clientX - box.left) * ratioX - left) / size);
    const y = Math.floor(((event.clientY - box.top) * ratioY - top) / size);
    const { width, height } = state.scene;
    return x >= 0 && y >= 0 && x < width && y < height ? { x, y } : null;
  }

  function listenToPointers(panel) {
    const { canvas } = panel;
    const pointers = new Map();
    let dragged = false;
    const activate = () => {
      state.active = state.panels.indexOf(panel);
      invalidate();
    };
    const hover = (event) => {
      state.cursor = pixelAt(canvas, event) ?? state.cursor;
      invalidate();
    };
    canvas.addEventListener('pointerenter', activate);
    canvas.addEventListener('focus', activate);
    canvas.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      activate();
      if (pointers.size === 0) dragged = false;
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) {
        hover(event);
        return;
      }
      const now = { x: event.clientX, y: event.clientY };
      // A hand is not still: a click may move a little.
      dragged ||= Math.hypot(now.x - before.x, now.y - before.y) > 4 || pointers.size > 1;
      if (!dragged) return;
      pointers.set(event.pointerId, now);
      const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
      if (other) {
        const spread = (point) => Math.hypot(point.x - other.x, point.y - other.y) || 1;
        pan((now.x - before.x) / 2, (now.y - before.y) / 2);
        const middle = { clientX: (now.x + other.x) / 2, clientY: (now.y + other.y) / 2 };
        zoom(state.view.scale * spread(now) / spread(before), fromCentre(canvas, middle));
      } else {
        pan(now.x - before.x, now.y - before.y);
      }
    });
    canvas.addEventListener('pointerup', (event) => {
      if (!pointers.delete(event.pointerId) || dragged) return;
      hover(event);
      explainPixel(pixelAt(canvas, event));
    });
    canvas.addEventListener('pointercancel', (event) => pointers.delete(event.pointerId));
    canvas.addEventListener('wheel', (event) => wheel(canvas, event), { passive: false });
  }

  // Whoever scrolls the page past the viewer shall get past it: a turn of the
  // wheel that began outside stays the page's.
  let scrolledAt = -Infinity;
  document.addEventListener('wheel', (event) => {
    if (!event.defaultPrevented) scrolledAt = event.timeStamp;
  }, { passive: true });

  function wheel(canvas, event) {
    if (!event.ctrlKey && event.timeStamp - scrolledAt < 250) return;
    event.preventDefault();
    const unit = [1, 30, 300][event.deltaMode];
    // A pinch on a touchpad comes as a wheel with Ctrl, in small steps.
    const speed = event.ctrlKey ? 0.01 : 0.003;
    const by = Math.exp(-Math.max(-200, Math.min(200, event.deltaY * unit)) * speed);
    zoom(state.view.scale * by, fromCentre(canvas, event));
  }

  // ---- keys ---------------------------------------------------------------------

  const active = () => state.panels[state.active];
  const KEYS = {
    ArrowLeft: () => step(active(), -1),
    ArrowRight: () => step(active(), 1),
    e: nextMode,
    s: setEncoding,
    '[': () => setAmount((state.mode === 'colour' ? state.exposure : state.gain) - 0.5),
    ']': () => setAmount((state.mode === 'colour' ? state.exposure : state.gain) + 0.5),
    '+': () => zoomStep(Math.SQRT2),
    '=': () => zoomStep(Math.SQRT2),
    '-': () => zoomStep(Math.SQRT1_2),
    '−': () => zoomStep(Math.SQRT1_2),
    _: () => zoomStep(Math.SQRT1_2),
    f: fit,
    0: fit,
    o: () => zoom(1 / devicePixelRatio),
    x: () => explainPixel(state.cursor),
    '?': toggleKeys,
  };
  const SHIFTED = {
    ArrowLeft: () => moveCursor(-1, 0),
    ArrowRight: () => moveCursor(1, 0),
    ArrowUp: () => moveCursor(0, -1),
    ArrowDown: () => moveCursor(0, 1),
  };

  function toggleKeys() {
    const list = find('.viewer-keys');
    list.hidden = !list.hidden;
    find('[data-do=keys]').setAttribute('aria-expanded', !list.hidden);
  }

  let isPointerOver = false;
  panelsElement.addEventListener('pointerenter', () => { isPointerOver = true; });
  panelsElement.addEventListener('pointerleave', () => { isPointerOver = false; });

  /** Whether a key is the viewer's: within it, or over its panels where nothing has the focus. */
  function isOurs(event) {
    const { target } = event;
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return false;
    if (target.closest('input, select, textarea, [contenteditable], .inspector')) return false;
    return section.contains(target) || (target === document.body && isPointerOver);
  }

  // The panel that shows the reference while 'r' is held, and since when.
  let held = null;

  document.addEventListener('keydown', (event) => {
    if (!isOurs(event)) return;
    const { key } = event;
    if (key === 'r') {
      if (event.repeat || held) return;
      held = { panel: active(), since: event.timeStamp };
      toggleReference(held.panel);
    } else if (/^[1-9]$/.test(key)) {
      const picture = state.scene.all[Number(key) - 1];
      if (picture) show(active(), picture);
    } else {
      const does = event.shiftKey ? SHIFTED[key] ?? KEYS[key] : KEYS[key];
      if (!does) return;
      does();
    }
    event.preventDefault();
  });

  document.addEventListener('keyup', (event) => {
    if (event.key !== 'r' || !held) return;
    const { panel, since } = held;
    held = null;
    if (event.timeStamp - since > 350 && state.panels.includes(panel)) toggleReference(panel);
  });

  // ---- panels -------------------------------------------------------------------

  function listPictures({ select }) {
    select.replaceChildren(...state.scene.all.map((picture, i) =>
      make('option', { value: i }, i < 9 ? `${i + 1} ${picture.name}` : picture.name)));
  }

  function makePanel(number) {
    const panel = { wanted: null, shown: null, before: null };
    panel.select = make('select', {
      'aria-label': `picture in panel ${number}`,
      change: () => show(panel, state.scene.all[panel.select.value]),
    });
    const flip = (by, label, text) => make('button', { type: 'button', 'aria-label': label, title: label, click: () => step(panel, by) }, text);
    panel.referenceButton = make('button', {
      type: 'button',
      title: 'to the reference and back (r)',
      'aria-pressed': 'false',
      click: () => toggleReference(panel),
    }, 'Ref');
    panel.canvas = make('canvas', { tabindex: 0, role: 'img' });
    panel.note = make('p', { class: 'viewer-note', hidden: true }, 'No FLIP map of this picture.');
    panel.values = make('div', { class: 'viewer-values', 'data-of': 'panel' });
    panel.figures = make('div', { class: 'viewer-figures' });
    panel.figure = make('figure', { class: 'viewer-panel' },
      make('figcaption', {}, flip(-1, 'previous picture (←)', '‹'), panel.select, flip(1, 'next picture (→)', '›'), panel.referenceButton),
      make('div', { class: 'viewer-frame' }, panel.canvas, panel.note), panel.values, panel.figures);
    listPictures(panel);
    listenToPointers(panel);
    sizes.observe(panel.canvas);
    return panel;
  }

  const sizes = new ResizeObserver((entries) => {
    for (const { target } of entries) {
      // While it is printed the page lies otherwise; the canvas stays as it is.
      const [width, height] = [target.clientWidth, target.clientHeight].map((v) => Math.round(v * devicePixelRatio));
      if (width > 0 && (target.width !== width || target.height !== height)) Object.assign(target, { width, height });
    }
    if (state.view.fitted) fit();
    // At once: a canvas that has been given a size is empty.
    draw();
  });

  function setPanels(count) {
    const { all, reference } = state.scene;
    while (state.panels.length > count) {
      const panel = state.panels.pop();
      sizes.unobserve(panel.canvas);
      panel.figure.remove();
    }
    while (state.panels.length < count) {
      const panel = makePanel(state.panels.length + 1);
      state.panels.push(panel);
      panelsElement.append(panel.figure);
      // What no panel shows yet; the reference as the last of several.
      const taken = state.panels.map((other) => other.wanted);
      const isLast = state.panels.length === count && count > 1;
      show(panel, isLast && !taken.includes(reference) ? reference : all.find((picture) => !taken.includes(picture)) ?? reference);
    }
    state.active = Math.min(state.active, count - 1);
    panelsElement.style.setProperty('--panels', count);
    invalidate();
  }

  // ---- start ----------------------------------------------------------------------

  const BUTTONS = {
    in: () => zoomStep(Math.SQRT2),
    out: () => zoomStep(Math.SQRT1_2),
    fit,
    one: KEYS.o,
    encoding: setEncoding,
    keys: toggleKeys,
  };
  find('.viewer-controls').addEventListener('click', ({ target }) => {
    const button = target.closest('button');
    if (!button) return;
    if (button.dataset.mode) setMode(button.dataset.mode);
    else if (button.dataset.panels) setPanels(Number(button.dataset.panels));
    else BUTTONS[button.dataset.do]();
  });
  find('.viewer-scene').addEventListener('change', ({ target }) => openSceneAt(target.value));
  find('.viewer-amount input').addEventListener('input', ({ target }) => setAmount(Number(target.value)));

  // Browsers keep what was chosen when a page is loaded again.
  find('.viewer-scene').value = 0;
  const isNarrow = matchMedia('(max-width: 700px)').matches;
  setPanels(isNarrow ? 1 : Math.min(3, state.scene.all.length));
  openSceneAt(0);
}

function startViewer() {
  const section = document.getElementById('viewer');
  if (canInflate()) {
    viewer(section);
    return;
  }
  const sentence = section.querySelector('.viewer-failure');
  sentence.textContent = 'This browser cannot show the pictures: it lacks DecompressionStream (deflate-raw), '
    + 'which Chrome 103, Firefox 113 and Safari 16.4 brought.';
  sentence.hidden = false;
  section.classList.add('unable');
}

startViewer();
