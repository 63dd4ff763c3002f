// Data that packed.rs put into the page, and how colours are shown. The files of
// the viewer are one script: packed.js, inspector.js, viewer.js in one function.

/** An element with attributes (a function is a listener) and children. */
function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(key, value);
    else if (value === true) element.setAttribute(key, '');
    else if (value !== false && value != null) element.setAttribute(key, value);
  }
  element.append(...children.flat().filter((child) => child != null));
  return element;
}

/** Whether this browser can read the page's data at all. */
function canInflate() {
  try {
    return Boolean(new DecompressionStream('deflate-raw'));
  } catch {
    return false;
  }
}

/** The bytes of the data element `id`. */
async function inflate(id) {
  const text = atob(document.getElementById(id).textContent);
  const deflated = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) deflated[i] = text.charCodeAt(i);
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * The bits of a picture's pixels, red, green and blue in turn, row by row: undoes
 * what `lay_out` in packed.rs did. Sums are those of 32-bit integers.
 */
function unpack(bytes, width, { from, channels }, reference) {
  const count = bytes.length / 12;
  const words = new Uint32Array(count * 3);
  const folded = from !== 'nothing' || channels;
  const left = new Uint32Array(3);
  for (let i = 0; i < count; i++) {
    if (i % width === 0) left.fill(0);
    let before = 0;
    for (let c = 0; c < 3; c++) {
      const at = c * 4 * count + i;
      let word = (bytes[at] << 24) | (bytes[at + count] << 16)
        | (bytes[at + 2 * count] << 8) | bytes[at + 3 * count];
      if (folded) word = (word >>> 1) ^ -(word & 1);
      if (channels) {
        word = (word + before) | 0;
        before = word;
      }
      if (from === 'left') {
        word = (word + left[c]) | 0;
        left[c] = word;
      } else if (from === 'reference') {
        word = (word + reference[i * 3 + c]) | 0;
      }
      words[i * 3 + c] = word;
    }
  }
  return words;
}

/** The sRGB encoding of a linear value, clamped to [0, 1]. */
function encode(linear) {
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 1;
  return linear <= 0.0031308 ? linear * 12.92 : 1.055 * Math.pow(linear, 1 / 2.4) - 0.055;
}

/** What the numbers of the colours that are told stand for. */
let toldSpace = 'linear';

/** A told colour for style sheets. */
function cssColour(colour) {
  const shown = (v) => (toldSpace === 'encoded' ? Math.min(Math.max(v, 0), 1) : encode(v));
  return `rgb(${colour.map((v) => Math.round(shown(v) * 255)).join(' ')})`;
}

/** A single-precision value with as many digits as make it unambiguous. */
function exactText(value) {
  if (!Number.isFinite(value)) return String(value).replace('Infinity', '∞');
  for (let digits = 1; digits < 9; digits++) {
    const text = value.toPrecision(digits);
    if (Math.fround(Number(text)) === value) return tidy(text);
  }
  return tidy(value.toPrecision(9));
}

function tidy(text) {
  const value = Number(text);
  if (Object.is(value, -0)) return '-0';
  return Math.abs(value) >= 1e-5 || value === 0 ? String(value) : value.toExponential();
}

/** A word as a POSIX shell takes it. */
function shellWord(word) {
  return /^[\w@%+=:,.\/-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

/** A button that copies what `text` gives; says so, and selects where it may not copy. */
function copyButton(text, source) {
  const button = make('button', {
    type: 'button',
    class: 'viewer-copy',
    click: async () => {
      try {
        await navigator.clipboard.writeText(text());
        button.textContent = 'Copied';
      } catch {
        getSelection().selectAllChildren(source());
        button.textContent = 'Selected';
      }
      setTimeout(() => { button.textContent = 'Copy'; }, 1500);
    },
  }, 'Copy');
  return button;
}

