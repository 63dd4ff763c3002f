// The pixel inspector: tells what `screendoor explain --json` says, fragment by
// fragment.

const STEPS_AT_FIRST = 20;

/** A depth as a share of the depth range. */
function depthText(depth, digits = 6) {
  return depth === 0xffffffff ? 'far' : (depth / 0xffffffff).toFixed(digits);
}

/** An opacity, short. */
function alphaText(alpha) {
  return alpha > 0 && alpha < 0.001 ? alpha.toExponential(2) : String(Number(alpha.toPrecision(4)));
}

function swatch(colour, title) {
  const element = make('span', { class: 'swatch', title });
  element.style.background = cssColour(colour);
  return element;
}

/** A cell a sample; all grids of a page have them in the same order and lines. */
function cellGrid(samples, name, label, cell) {
  const many = samples > 16 ? ' many' : '';
  const grid = make('div', { class: `cells ${name}${many}`, role: 'img', 'aria-label': label });
  grid.style.setProperty('--samples', Math.min(samples, 8));
  for (let s = 0; s < samples; s++) grid.append(cell(s));
  return grid;
}

const STATES = {
  outside: 'not covered',
  hidden: 'covered, behind what the sample holds',
  refused: 'in front, not written',
  written: 'written',
};

/** How far a fragment came at sample `s`. */
function sampleState(record, s) {
  if (record.written.includes(s)) return 'written';
  if (!record.covered.includes(s)) return 'outside';
  return record.passed && !record.passed.includes(s) ? 'hidden' : 'refused';
}

/** One cell a sample: how far the fragment came there. */
function fate({ fragment, record }, samples) {
  const { covered, passed, written } = record;
  const label = `covers ${covered.length} of ${samples} samples`
    + (passed ? `, ${passed.length} in front` : '') + `, writes ${written.length}`;
  const grid = cellGrid(samples, 'fate', label, (s) => {
    const state = sampleState(record, s);
    const cell = make('span', { class: `cell ${state}`, title: `sample ${s}: ${STATES[state]}` });
    if (state === 'written') cell.style.background = cssColour(fragment.colour);
    return cell;
  });
  return [grid, make('p', { class: 'counts' }, `covers ${covered.length}, writes ${written.length}`)];
}

/** Reference values on a line from 0 to 1, of which alpha's share passes. */
function referenceLine({ fragment, record }) {
  const tests = record.references;
  if (tests.length === 0) return null;
  const line = make('div', {
    class: 'references',
    role: 'img',
    'aria-label': `${tests.filter((t) => t.passed).length} of ${tests.length} reference values pass against alpha`,
  });
  const share = make('span', { class: 'share' });
  share.style.width = `${100 * fragment.alpha}%`;
  line.append(share);
  for (const test of tests) {
    const tick = make('span', {
      class: `tick ${test.passed ? 'passes' : 'fails'}`,
      title: `sample ${test.sample} as number ${test.number} of its surface: ${test.value.toFixed(4)} ${test.passed ? 'passes' : 'fails'}`,
    });
    tick.style.left = `${100 * test.value}%`;
    line.append(tick);
  }
  return line;
}

/** What the design says of the fragment beside that. */
function remarks({ record }) {
  return (record.remarks ?? []).map((line) => make('p', { class: 'counts' }, line));
}

/** The reference values in words, folded away, in the order in which they were drawn. */
function referenceWords({ record }) {
  const count = record.references.length;
  if (count === 0) return null;
  const rows = record.references.map((t) => make('tr', { class: t.passed ? 'passes' : 'fails' },
    make('td', {}, String(t.sample)), make('td', {}, String(t.number)),
    make('td', {}, t.value.toFixed(6)), make('td', {}, t.passed ? 'passes' : 'fails')));
  const head = ['sample', 'number', 'value', ''].map((h) => make('th', {}, h));
  return make('details', {}, make('summary', {}, `${count} reference value${count === 1 ? '' : 's'}, ${record.references.filter((t) => t.passed).length} below alpha`),
    make('table', {}, make('thead', {}, make('tr', {}, head)), make('tbody', {}, rows)));
}

function sameSample(a, b) {
  return a && b && a.depth === b.depth && a.colour.every((v, c) => v === b.colour[c]);
}

/** What the samples hold, what changed marked. */
function heldSamples(samples, before) {
  const changed = samples.map((sample, s) => !sameSample(sample, before[s]));
  const count = changed.filter(Boolean).length;
  // Many samples that are as they were would only hide what happens.
  if (count === 0 && samples.length > 8) return make('p', { class: 'unchanged' }, 'samples as before');
  const digits = samples.length > 16 ? 3 : 4;
  return cellGrid(samples.length, 'held', `${count} of ${samples.length} samples changed`, (s) => {
    const { depth, colour } = samples[s];
    const values = colour.map((v) => v.toFixed(3)).join(' ');
    return make('span', {
      class: changed[s] ? 'cell changed' : 'cell',
      title: `sample ${s}: depth ${depthText(depth)}, colour ${values}${changed[s] ? ', changed' : ''}`,
    }, swatch(colour), make('span', { class: 'depth' }, depthText(depth, digits).replace(/^0\./, '.')));
  });
}

/** What else the pixel holds: names and values, lists of samples as cells. */
function heldField([name, value], before, samples) {
  const change = value === before ? '' : ' changed';
  let shown = value.split('; ').map((line) => make('span', { class: 'line' }, line));
  if (name === 'covered' && /^\d+( \d+)*$/.test(value)) {
    const set = new Set(value.split(' ').map(Number));
    shown = cellGrid(samples, 'set', `samples ${value}`, (s) => make('span', {
      class: set.has(s) ? 'cell in' : 'cell',
      title: `sample ${s}`,
    }));
  }
  return make('div', { class: `field${change}` },
    make('span', { class: 'name' }, name), make('span', { class: 'value' }, shown));
}

function contents(after, before, samples) {
  return [
    after.samples.length > 0 ? heldSamples(after.samples, before.samples) : null,
    ...after.fields.map((field, i) => heldField(field, before.fields[i]?.[1], samples)),
  ];
}

/** The samples from the nearest on, where they were sorted. */
function sortedOrder({ order }) {
  if (!order || order.length < 2) return null;
  const text = order.join(' ');
  if (order.length <= 16) return make('p', { class: 'order', title: 'the samples from the nearest on' }, `sorted ${text}`);
  return make('details', {}, make('summary', {}, `${order.length} samples sorted`), text);
}

/** One fragment's row. */
function stepRow(step, number, { samples, severalPasses }, before) {
  const { fragment, record } = step;
  const values = fragment.colour.map((v) => v.toFixed(4)).join(' ');
  const facts = [
    ['alpha', alphaText(fragment.alpha)],
    ['depth', depthText(fragment.depth.z)],
    ['object', String(fragment.object)],
  ];
  return make('li', { class: record.written.length > 0 ? 'step' : 'step idle' },
    make('div', { class: 'number' }, String(number),
      severalPasses ? make('span', { class: 'pass' }, `pass ${step.pass + 1}`) : null),
    make('div', { class: 'fragment', title: `row ${step.row} of the trace, primitive ${fragment.primitive}, colour ${values}` },
      swatch(fragment.colour, `colour ${values}`),
      make('dl', {}, facts.map(([name, value]) =>
        make('div', {}, make('dt', {}, name), make('dd', {}, value))))),
    make('div', { class: 'tests' }, fate(step, samples)),
    make('div', { class: 'opacity' },
      record.surface === null ? null : make('p', { class: 'surface' }, `starts surface ${record.surface}`),
      sortedOrder(record), referenceLine(step), referenceWords(step), ...remarks(step)),
    make('div', { class: 'after' }, contents(step.contents, before, samples)));
}

function legend(samples) {
  const item = (name, text) => make('span', {}, make('span', { class: `cell ${name}` }), text);
  return make('p', { class: 'legend' }, `${samples} cells, one a sample: `,
    item('outside', 'not covered'), item('hidden', 'covered, behind'),
    item('refused', 'in front, not written'), item('written', 'written'));
}

/** A pass that does not look at the fragment, as Record::is_idle has it. */
function isIdle({ record }) {
  return record.samples_tested + record.written.length + record.state_bits_read + record.state_bits_written === 0;
}

/** The whole story of one pixel. */
function story(explained) {
  const { cleared, samples, colour } = explained;
  const severalPasses = explained.steps.at(-1)?.pass > 0;
  const steps = explained.steps.filter((step) => !severalPasses || !isIdle(step));
  const list = make('ol', { class: 'steps' });
  const rows = (from, to) => steps.slice(from, to).map((step, i) =>
    stepRow(step, from + i + 1, { samples, severalPasses }, from + i > 0 ? steps[from + i - 1].contents : cleared));
  list.append(...rows(0, STEPS_AT_FIRST));
  const left = steps.length - STEPS_AT_FIRST;
  const more = left <= 0 ? null : make('button', {
    type: 'button',
    class: 'more',
    click: () => {
      list.append(...rows(STEPS_AT_FIRST));
      more.remove();
    },
  }, `Show all ${steps.length} fragments`);
  const head = [['', ''], ['', 'fragment'], ['', 'samples'], ['references-head', 'reference values against alpha'],
    ['', 'the pixel after it']].map(([name, text]) => make('span', { class: name }, text));
  const hasTests = steps.some(({ record }) => record.references.length > 0 || record.surface !== null || record.order);
  return [
    steps.length === 0 ? make('p', {}, 'No fragment of the trace covers this pixel.') : legend(samples),
    make('div', { class: hasTests ? 'steps-frame' : 'steps-frame no-tests', tabindex: 0, role: 'group', 'aria-label': 'fragments in API order' },
      steps.length === 0 ? null
        : make('div', { class: 'steps-head', 'aria-hidden': 'true' }, head),
      list, more),
    make('p', { class: 'resolved' }, 'Resolved: ', swatch(colour), ' ',
      make('span', { class: 'figure' }, colour.map((v) => exactText(Math.fround(v))).join('  '))),
  ];
}

/**
 * Fills `element`; gives the function that shows a pixel of a picture. `picture`
 * may be null for the reference.
 */
function inspector(element) {
  const parsed = new Map();
  let latest = 0;

  async function explanation(picture) {
    if (!parsed.has(picture.explain)) {
      const bytes = await inflate(picture.explain);
      parsed.set(picture.explain, JSON.parse(new TextDecoder().decode(bytes)));
    }
    return parsed.get(picture.explain);
  }

  function told(picture, x, y) {
    return Boolean(picture?.explain) && picture.explained[0] === x && picture.explained[1] === y;
  }

  function chooser(scene, picture, x, y) {
    const select = make('select', {
      'aria-label': 'design to explain',
      change: () => show(scene, scene.pictures[select.value] ?? null, x, y),
    }, scene.pictures.map((p, i) => make('option', { value: i, selected: p === picture },
      told(p, x, y) ? p.name : `${p.name} (command)`)),
    make('option', { value: 'reference', selected: picture === null }, 'exact (command)'));
    return select;
  }

  /** Links to the pixels whose story is in the page. */
  function elsewhere(scene, picture, x, y) {
    const other = told(picture, x, y) ? null : [picture, ...scene.pictures].find((p) => p?.explain);
    if (!other) return null;
    const [ox, oy] = other.explained;
    return make('button', { type: 'button', click: () => show(scene, other, ox, oy) },
      `Pixel ${ox},${oy} of ${other.name} is told here`);
  }

  async function show(scene, picture, x, y) {
    const turn = ++latest;
    const design = picture ? picture.name : 'exact';
    const command = ['screendoor', 'explain', scene.trace, '--design', design, '--samples',
      String(scene.samples), '--pixel', `${x},${y}`,
      ...(scene.seed ? ['--seed', String(scene.seed)] : [])].map(shellWord).join(' ');
    const code = make('code', {}, command);
    const tells = told(picture, x, y);
    const run = tells ? await explanation(picture) : {};
    toldSpace = run.space ?? 'linear';
    const body = tells ? story(run) : [
      make('p', {}, 'This tells the pixel’s story, fragment by fragment:')];
    if (turn !== latest) return;
    element.dataset.pixel = `${x},${y}`;
    element.dataset.design = design;
    element.dataset.told = tells;
    element.replaceChildren(
      make('h3', {}, `Pixel ${x},${y} as `, chooser(scene, picture, x, y), ` drew it, ${scene.samples} samples`),
      ...(tells ? body : []),
      make('div', { class: 'command' }, tells ? null : body, make('div', {}, code, copyButton(() => command, () => code))),
      elsewhere(scene, picture, x, y) ?? '');
  }

  return show;
}

