'use strict';
// What the page does beyond showing: panels, sorting, tooltips, filters, theme, copying.
// All data is in the document's attributes; nothing is fetched, nothing is global.
(() => {
  const all = (query, from = document) => Array.from(from.querySelectorAll(query));
  const make = (name, attributes = {}, text = '') => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.textContent = text;
    return element;
  };

  // Theme: automatic, light, dark; remembered where the browser lets it.
  const themes = ['auto', 'light', 'dark'];
  const contents = document.querySelector('.contents');
  const theme = make('button', { type: 'button', class: 'theme' });
  const shownTheme = () => document.documentElement.dataset.theme || 'auto';
  const nameTheme = () => { theme.textContent = `Theme: ${shownTheme()}`; };
  theme.addEventListener('click', () => {
    const next = themes[(themes.indexOf(shownTheme()) + 1) % themes.length];
    if (next === 'auto') delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = next;
    try { localStorage.setItem('screendoor-theme', next); } catch (e) { /* not remembered */ }
    nameTheme();
  });
  nameTheme();
  contents.append(theme);

  // Contents: open beside the text, a closed menu above it.
  const menu = contents.querySelector('details');
  const wide = matchMedia('(min-width: 80rem)');
  const fold = () => { menu.open = wide.matches; };
  wide.addEventListener('change', fold);
  fold();
  contents.addEventListener('click', (event) => {
    if (event.target.closest('a') && !wide.matches) menu.open = false;
  });
  const links = new Map(all('a', contents).map((a) => [a.getAttribute('href').slice(1), a]));
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      for (const link of links.values()) link.classList.remove('here');
      links.get(entry.target.id)?.classList.add('here');
    }
  }, { rootMargin: '-10% 0px -80% 0px' });
  for (const section of all('main > section')) seen.observe(section);

  // Panels: all figures that choose a scene follow each other.
  const groups = all('.tabs').map((box) => ({
    box, panels: Array.from(box.children), label: box.dataset.label,
  })).filter((group) => group.panels.length > 1);
  const choose = (group, name) => {
    group.panels.forEach((panel, i) => {
      const on = panel.dataset.name === name;
      panel.classList.toggle('on', on);
      group.buttons[i].setAttribute('aria-selected', on);
      group.buttons[i].tabIndex = on ? 0 : -1;
    });
  };
  for (const group of groups) {
    const row = make('div', { class: 'choose', role: 'tablist', 'aria-label': group.label });
    group.buttons = group.panels.map((panel) => {
      const name = panel.dataset.name;
      const button = make('button', { type: 'button', role: 'tab' }, name);
      panel.setAttribute('role', 'tabpanel');
      panel.setAttribute('aria-label', name);
      button.addEventListener('click', () => {
        const top = group.box.getBoundingClientRect().top;
        for (const other of groups) {
          if (other === group || group.label === 'Scene' && other.label === 'Scene') choose(other, name);
        }
        // Figures above may have changed their height.
        scrollBy({ top: group.box.getBoundingClientRect().top - top, behavior: 'instant' });
      });
      return button;
    });
    row.addEventListener('keydown', (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      const from = group.buttons.indexOf(event.target);
      if (!step || from < 0) return;
      const to = group.buttons[(from + step + group.buttons.length) % group.buttons.length];
      to.click();
      to.focus();
      event.preventDefault();
    });
    row.append(...group.buttons);
    group.box.prepend(row);
    choose(group, group.panels[0].dataset.name);
  }

  // Tables: by a column, numbers by their exact values, what is missing last.
  const value = (row, column) => {
    const cell = row.cells[column];
    if (!cell || cell.classList.contains('none')) return null;
    return cell.dataset.v === undefined ? cell.textContent.trim() : Number(cell.dataset.v);
  };
  for (const table of all('table.sortable')) {
    Array.from(table.tHead.rows[0].cells).forEach((head, column) => {
      const button = make('button', { type: 'button', title: 'Sort' }, head.textContent);
      head.replaceChildren(button);
      button.addEventListener('click', () => {
        const falling = head.getAttribute('aria-sort') === 'ascending';
        for (const other of table.tHead.rows[0].cells) other.removeAttribute('aria-sort');
        head.setAttribute('aria-sort', falling ? 'descending' : 'ascending');
        const body = table.tBodies[0];
        const rows = Array.from(body.rows).map((row) => [value(row, column), row]);
        rows.sort(([a], [b]) => {
          if (a === null || b === null) return (a === null) - (b === null);
          const order = typeof a === 'number' && typeof b === 'number'
            ? a - b : String(a).localeCompare(String(b), 'en', { numeric: true });
          return falling ? -order : order;
        });
        body.append(...rows.map(([, row]) => row));
      });
    });
  }

  // Copying.
  const copying = (button, text) => button.addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = 'copied';
    } catch (e) {
      // Pages opened as files may not: select it, so that one key copies it.
      const code = button.parentElement.querySelector('code');
      if (code) getSelection().selectAllChildren(code);
      else prompt('Copy this command:', text);
      return;
    }
    setTimeout(() => { button.textContent = 'copy'; }, 1200);
  });
  for (const line of all('.command')) {
    const button = make('button', { type: 'button', class: 'copy' }, 'copy');
    copying(button, line.querySelector('code').textContent);
    line.append(button);
  }
  for (const button of all('.copy[data-copy]')) copying(button, button.dataset.copy);

  // Tooltips: pointer, tap, and arrow keys within a focused chart.
  const tip = make('div', { class: 'tip', role: 'status', hidden: '' });
  document.body.append(tip);
  for (const title of all('.plot title')) {
    title.parentElement.setAttribute('aria-label', title.textContent);
    title.remove();
  }
  let now = null;
  const hide = () => {
    now?.classList.remove('now');
    now = null;
    tip.hidden = true;
  };
  const show = (point) => {
    hide();
    now = point;
    point.classList.add('now');
    tip.textContent = point.getAttribute('aria-label');
    tip.hidden = false;
    const at = (point.querySelector('.mk, rect') || point).getBoundingClientRect();
    const left = Math.min(Math.max(at.left + at.width / 2 - tip.offsetWidth / 2, 8),
      document.documentElement.clientWidth - tip.offsetWidth - 8);
    const above = at.top - tip.offsetHeight - 8;
    tip.style.left = `${left + scrollX}px`;
    tip.style.top = `${(above > 0 ? above : at.bottom + 8) + scrollY}px`;
  };
  const pointAt = (event) => event.target.closest?.('.plot .pt');
  document.addEventListener('pointerover', (event) => {
    const point = pointAt(event);
    if (point) show(point);
    else if (now && event.pointerType === 'mouse') hide();
  });
  document.addEventListener('click', (event) => {
    const point = pointAt(event);
    if (point) show(point);
    else hide();
  });
  for (const plot of all('.plot')) {
    plot.addEventListener('blur', hide);
    plot.addEventListener('keydown', (event) => {
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      if (event.key === 'Escape') hide();
      if (!step) return;
      const points = all('.curve:not(.off) .pt', plot);
      const from = points.indexOf(now);
      const to = points[(from + step + points.length) % points.length];
      if (to) show(to);
      event.preventDefault();
    });
  }

  // Legends: one design stands out, as long as it is pointed at or until it is chosen again.
  for (const legend of all('.legend')) {
    const scope = legend.closest('.panel') || legend.closest('figure');
    let held = null;
    const stress = (series) => {
      for (const item of all('.curve, .name', scope)) {
        item.classList.toggle('away', series !== null && item.dataset.series !== series);
      }
    };
    for (const item of all('li', legend)) {
      const { series } = item.dataset;
      item.tabIndex = 0;
      item.setAttribute('role', 'button');
      item.setAttribute('aria-pressed', 'false');
      const hold = () => {
        held = held === series ? null : series;
        for (const other of all('li', legend)) {
          const on = other.dataset.series === held;
          other.classList.toggle('held', on);
          other.setAttribute('aria-pressed', on);
        }
        stress(held);
      };
      item.addEventListener('pointerenter', () => stress(series));
      item.addEventListener('pointerleave', () => stress(held));
      item.addEventListener('click', hold);
      item.addEventListener('keydown', (event) => {
        if (event.key === 'Enter' || event.key === ' ') { hold(); event.preventDefault(); }
      });
    }
  }

  // Filters: designs without a promise vanish, and the front is drawn through the rest.
  const front = (plot) => {
    const line = plot.querySelector('.front-line');
    if (!line) return;
    const points = all('.curve .pt', plot).map((element) => ({
      element,
      shown: !element.parentElement.classList.contains('off'),
      cost: Number(element.dataset.cost),
      error: Number(element.dataset.error),
      at: element.getAttribute('transform').match(/-?[\d.]+/g).map(Number),
    }));
    const rivals = points.filter((p) => p.shown);
    const beats = (a, b) => a.cost <= b.cost && a.error <= b.error
      && (a.cost < b.cost || a.error < b.error);
    const on = rivals.filter((p) => !rivals.some((other) => beats(other, p)));
    for (const p of points) p.element.classList.toggle('front', on.includes(p));
    on.sort((a, b) => a.at[0] - b.at[0] || b.at[1] - a.at[1]);
    const steps = on.map(({ at: [x, y] }, i) => i ? `H${x}V${y}` : `M${x},${line.dataset.top}V${y}`);
    line.setAttribute('d', on.length ? `${steps.join('')}H${line.dataset.right}` : '');
  };
  for (const central of all('.central')) {
    const filters = all('[data-filter]', central);
    // Filters hold for the charts of single scenes, too.
    const scope = central.closest('section');
    const apply = () => {
      const wanted = filters.filter((f) => f.checked).map((f) => `data-${f.dataset.filter}`);
      const passes = (curve) => wanted.every((name) => curve.hasAttribute(name));
      const plots = all('.plot', scope);
      const kept = new Set();
      for (const curve of all('.curve', scope)) {
        const keep = passes(curve);
        curve.classList.toggle('off', !keep);
        if (keep) kept.add(curve.dataset.series);
      }
      for (const item of all('.name, .legend li', scope)) {
        item.classList.toggle('off', wanted.length > 0 && !kept.has(item.dataset.series));
      }
      plots.forEach(front);
    };
    for (const filter of filters) filter.addEventListener('change', apply);
    if (filters.some((f) => f.checked)) apply();
  }

  // Paper shows what is folded.
  let folded = [];
  addEventListener('beforeprint', () => {
    folded = all('main details:not([open]):not(.records)');
    for (const details of folded) details.open = true;
    hide();
  });
  addEventListener('afterprint', () => {
    for (const details of folded) details.open = false;
  });
})();
