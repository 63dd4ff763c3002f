#!/usr/bin/env python3
"""Drives the picture viewer of a report in a headless Chromium.

    python tests/browser/report.py REPORT.html EXR_FOLDER
    python tests/browser/report.py --self-test REPORT.html EXR_FOLDER
    python tests/browser/report.py --screenshots FOLDER REPORT.html EXR_FOLDER

Needs selenium, numpy and OpenEXR from PyPI, and chromium with chromedriver (CHROMIUM and
CHROMEDRIVER name others). One line a check, a summary last, exit code 1 where one failed.
--self-test plants defects in copies of the page and expects the right check to fail.
"""

import argparse
import base64
import contextlib
import json
import os
import random
import re
import sys
import tempfile
import time
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

PIXELS = 40  # of each picture whose values are held against its EXR file


class Checks:
    """Results, printed as they come."""

    def __init__(self, quiet=False):
        self.failed, self.count, self.quiet = [], 0, quiet

    def __call__(self, name, holds, detail=""):
        self.count += 1
        if not holds:
            self.failed.append(name)
        if not self.quiet:
            print(f"{'ok  ' if holds else 'FAIL'} {name}{f': {detail}' if detail != '' else ''}", flush=True)


@contextlib.contextmanager
def browser(width=1400, height=1000):
    options = webdriver.ChromeOptions()
    options.binary_location = os.environ.get("CHROMIUM", "/usr/bin/chromium")
    for argument in ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                     "--disable-dev-shm-usage", f"--window-size={width},{height}"]:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    service = webdriver.ChromeService(os.environ.get("CHROMEDRIVER", "/usr/bin/chromedriver"))
    driver = webdriver.Chrome(options=options, service=service)
    driver.set_script_timeout(60)
    try:
        yield driver
    finally:
        driver.quit()


class Page:
    """A report in a browser."""

    def __init__(self, driver, path):
        self.driver = driver
        driver.get(Path(path).resolve().as_uri())
        self.settle()
        self.data = self.script("return JSON.parse(document.getElementById('viewer-data').textContent)")

    def script(self, code, *arguments):
        return self.driver.execute_script(code, *arguments)

    def settle(self):
        """Waits until pictures are decoded and drawn."""
        self.driver.execute_async_script("""
            const done = arguments[0], section = document.getElementById('viewer');
            const start = performance.now();
            const look = () => requestAnimationFrame(() => requestAnimationFrame(() => {
              if (section.dataset.ready === 'true' || performance.now() - start > 30000) done();
              else look();
            }));
            look();""")

    def state(self):
        self.settle()
        return dict(self.script("return {...document.getElementById('viewer').dataset}"))

    def canvases(self):
        return self.driver.find_elements(By.CSS_SELECTOR, ".viewer-frame canvas")

    def images(self):
        """What the panels show, to tell whether it changes."""
        self.settle()
        return self.script("return [...document.querySelectorAll('.viewer-frame canvas')].map((c) => c.toDataURL())")

    def press(self, *keys):
        ActionChains(self.driver).send_keys(*keys).perform()
        self.settle()

    def click(self, selector):
        self.script("document.querySelector(arguments[0]).click()", selector)
        self.settle()

    def choose(self, selector, value, index=0):
        self.script("""
            const select = document.querySelectorAll(arguments[0])[arguments[2]];
            select.value = arguments[1];
            select.dispatchEvent(new Event('change', {bubbles: true}));""", selector, value, index)
        self.settle()

    def pictures(self):
        return self.script("return [...document.querySelectorAll('.viewer-panel .viewer-values')].map((v) => v.dataset.picture)")

    def hover(self, x, y):
        """Moves a real pointer over a pixel of the first panel."""
        at = self.script("""
            const canvas = document.querySelector('.viewer-frame canvas');
            canvas.scrollIntoView({block: 'center', behavior: 'instant'});
            const box = canvas.getBoundingClientRect(), d = document.getElementById('viewer').dataset;
            return [box.left + box.width / 2 + (arguments[0] + 0.5 - d.x) * d.scale,
                    box.top + box.height / 2 + (arguments[1] + 0.5 - d.y) * d.scale]""", x, y)
        self.pointer(*at)
        self.settle()

    def pointer(self, x, y, kind="mouseMoved", **more):
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, **more})

    def readouts(self, pixels):
        """For each pixel: what the panels and the reference say there, and the colours that
        the first panel shows there."""
        return self.driver.execute_async_script("""
            const [pixels, done] = arguments, section = document.getElementById('viewer');
            const canvas = section.querySelector('.viewer-frame canvas');
            // Read from a canvas of our own: browsers warn of reading what is meant for the screen.
            const reader = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
            const frame = () => new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(r)));
            (async () => {
              const out = [];
              for (const [x, y] of pixels) {
                const box = canvas.getBoundingClientRect(), d = section.dataset;
                const [px, py] = [box.width / 2 + (x + 0.5 - d.x) * d.scale, box.height / 2 + (y + 0.5 - d.y) * d.scale];
                canvas.dispatchEvent(new PointerEvent('pointermove', {
                  clientX: box.left + px, clientY: box.top + py, pointerId: 1, bubbles: true}));
                await frame();
                const inside = px > 0 && py > 0 && px < box.width && py < box.height;
                const ratio = canvas.width / box.width;
                out.push({
                  cursor: section.dataset.cursor,
                  values: Object.fromEntries([...section.querySelectorAll('.viewer-values')].map((v) =>
                    [v.dataset.picture, [...v.querySelectorAll('[data-channel]')].map((c) => c.dataset.value)])),
                  shown: inside ? (reader.clearRect(0, 0, 1, 1), reader.drawImage(canvas, Math.floor(px * ratio), Math.floor(py * ratio), 1, 1, 0, 0, 1, 1),
                    [...reader.getImageData(0, 0, 1, 1).data]) : null,
                });
              }
              return out;
            })().then(done);""", pixels)


def exr_layers(path):
    layers = {}
    for part in OpenEXR.File(str(path), separate_channels=True).parts:
        channels = [part.channels[c].pixels for c in "RGB"]
        layers[part.name()] = np.stack(channels, -1).astype(np.float32)
    return layers


def bits(values):
    return np.asarray(values, dtype=np.float32).view(np.uint32).tolist()


def same(shown, value):
    """Whether three texts are these single-precision values, bit for bit (any NaN is NaN)."""
    said = np.asarray([float(v.replace("∞", "inf")) for v in shown], dtype=np.float32)
    if len(said) != 3:
        return False
    return all(a == b or (np.isnan(x) and np.isnan(y))
               for a, b, x, y in zip(bits(said), bits(value), said, value))


def srgb8(values):
    v = np.clip(values.astype(np.float64), 0, 1)
    encoded = np.where(v <= 0.0031308, v * 12.92, 1.055 * v ** (1 / 2.4) - 0.055)
    return np.floor(encoded * 255 + 0.5)


def check_opens(page, check, _folder):
    scenes = page.data["scenes"]
    check("the viewer starts", len(page.canvases()) == 3 and page.state().get("ready") == "true",
          f"{len(scenes)} scenes, {sum(len(s['pictures']) for s in scenes)} pictures")
    failure = page.script("return document.querySelector('.viewer-failure')")
    check("nothing failed to decode", failure.get_attribute("hidden") is not None, failure.text)


def check_values(page, check, folder, pixels_each=PIXELS):
    """Readouts against EXR files, all designs of all scenes."""
    compared = drawn = 0
    for index, scene in enumerate(page.data["scenes"]):
        page.choose(".viewer-scene", str(index))
        for _ in range(8):
            if float(page.state()["scale"]) >= 4:
                break
            page.click("[data-do=in]")
        generator = random.Random(f"{scene['name']} {scene['samples']}")
        pixels = [[generator.randrange(scene["width"]), generator.randrange(scene["height"])] for _ in range(pixels_each)]
        pixels += [[0, 0], [scene["width"] - 1, scene["height"] - 1], scene["pixel"]]
        for at, picture in enumerate(scene["pictures"]):
            path = folder / picture["exr"]
            if not path.exists():
                continue
            layers = exr_layers(path)
            colour = layers.get("colour", next(iter(layers.values())))
            page.choose(".viewer-panel figcaption select", str(at))
            wrong, off = [], []
            for (x, y), said in zip(pixels, page.readouts(pixels)):
                if said["cursor"] != f"{x},{y}" or not same(said["values"].get(picture["name"], []), colour[y, x]):
                    wrong.append((x, y, said["values"].get(picture["name"]), colour[y, x].tolist()))
                if "reference" in layers and not same(said["values"]["reference"], layers["reference"][y, x]):
                    wrong.append((x, y, "reference", said["values"]["reference"], layers["reference"][y, x].tolist()))
                if said["shown"]:
                    drawn += 1
                    if np.abs(srgb8(colour[y, x]) - said["shown"][:3]).max() > 1:
                        off.append((x, y, said["shown"], srgb8(colour[y, x]).tolist()))
            compared += len(pixels)
            check(f"values of {scene['name']}, {picture['name']} are those of {picture['exr']}", not wrong, wrong[:2] or "")
            check(f"colours of {scene['name']}, {picture['name']} are drawn where they belong", not off, off[:2] or "")
    check("values were compared", compared > 0, f"{compared} pixels, of which {drawn} in sight")
    page.choose(".viewer-scene", "0")
    page.press_fit()


def check_keys(page, check, _folder):
    page.hover(20, 20)
    start = page.pictures()

    def changes(key, what, holds, *, panels=True):
        before, images = page.state(), page.images()
        page.press(key)
        after = page.state()
        changed = page.images() != images
        check(f"key {what}", holds(before, after) and changed == panels,
              "" if changed == panels else "the panels " + ("changed" if changed else "did not change"))

    def place(state):
        return [state[k] for k in ("scale", "x", "y", "cursor", "mode")]

    def kept(before, after):
        return place(before) == place(after)

    first = lambda: page.pictures()[0]
    names = [p["name"] for p in page.data["scenes"][0]["pictures"]] + ["reference"]
    page.hover(20, 20)
    page.press("1")
    changes(Keys.ARROW_RIGHT, "→ flips forward", lambda a, b: first() == names[1] and kept(a, b))
    changes(Keys.ARROW_LEFT, "← flips back", lambda a, b: first() == names[0] and kept(a, b))
    changes("2", "2 shows the second picture", lambda a, b: first() == names[1] and kept(a, b))
    changes("1", "1 shows the first picture", lambda a, b: first() == names[0] and kept(a, b))
    changes("r", "r shows the reference", lambda a, b: first() == "reference" and kept(a, b))
    changes("r", "r shows the picture again", lambda a, b: first() == names[0] and kept(a, b))
    ActionChains(page.driver).key_down("r").perform()
    page.settle()
    during = first()
    time.sleep(0.5)
    ActionChains(page.driver).key_up("r").perform()
    page.settle()
    check("key r held shows the reference while it is held", during == "reference" and first() == names[0])
    check("other panels stay", page.pictures()[1:] == start[1:])

    modes = ["colour", "signed", "absolute"] + (["flip"] if any(p["flip"] for p in page.data["scenes"][0]["pictures"]) else [])
    for mode in modes[1:] + modes[:1]:
        changes("e", f"e shows {mode}", lambda a, b, mode=mode: b["mode"] == mode)
    changes("s", "s shows linear values", lambda a, b: b["encoding"] == "linear")
    changes("s", "s shows sRGB-encoded values", lambda a, b: b["encoding"] == "srgb")
    changes("]", "] raises the exposure", lambda a, b: float(b["exposure"]) == float(a["exposure"]) + 0.5)
    changes("[", "[ lowers the exposure", lambda a, b: float(b["exposure"]) == float(a["exposure"]) - 0.5)
    page.press("e")
    changes("]", "] raises the gain of errors", lambda a, b: float(b["gain"]) == float(a["gain"]) + 0.5)
    changes("[", "[ lowers the gain of errors", lambda a, b: float(b["gain"]) == float(a["gain"]) - 0.5)
    page.press(*"e" * (len(modes) - 1))
    scale = lambda state: float(state["scale"])
    changes("+", "+ enlarges", lambda a, b: scale(b) > scale(a) and a["cursor"] == b["cursor"])
    changes("-", "- reduces", lambda a, b: scale(b) < scale(a))
    page.press("+", "+", "+")
    changes("f", "f fits", lambda a, b: scale(b) < scale(a))
    page.press("+", "+", "+")
    changes("0", "0 fits", lambda a, b: scale(b) < scale(a))
    ratio = page.script("return devicePixelRatio")
    changes("o", "o shows 1:1", lambda a, b: abs(scale(b) * ratio - 1) < 1e-9)
    page.press("f")
    for key, name, step in [(Keys.ARROW_RIGHT, "→", (1, 0)), (Keys.ARROW_DOWN, "↓", (0, 1)),
                            (Keys.ARROW_LEFT, "←", (-1, 0)), (Keys.ARROW_UP, "↑", (0, -1))]:
        before = [int(v) for v in page.state()["cursor"].split(",")]
        ActionChains(page.driver).key_down(Keys.SHIFT).send_keys(key).key_up(Keys.SHIFT).perform()
        after = [int(v) for v in page.state()["cursor"].split(",")]
        check(f"key Shift {name} moves the cross-hair", after == [before[0] + step[0], before[1] + step[1]], after)
    hidden = lambda: page.script("return document.getElementById('viewer-keys').hidden")
    page.press("?")
    opened = not hidden()
    page.press("?")
    check("key ? lists the keys", opened and hidden())
    page.press("x")
    told = page.script("return {...document.querySelector('.inspector').dataset}")
    check("key x sends the pixel to the inspector", told["pixel"] == page.state()["cursor"], told["pixel"])


def check_keys_are_not_stolen(page, check, _folder):
    page.script("document.querySelector('.viewer-scene').focus()")
    before = page.state()["mode"]
    page.press("e")
    in_select = page.state()["mode"] == before
    page.script("document.activeElement.blur()")
    page.pointer(2, 2)
    page.press("e")
    outside = page.state()["mode"] == before
    check("keys are the page's in a list and away from the viewer", in_select and outside)


def check_pointer(page, check, _folder):
    page.press_fit()
    page.hover(40, 70)
    box = page.script("const b = document.querySelector('.viewer-frame canvas').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]")
    # Whole: a wheel's event has no fractions of a pixel.
    x, y = round(box[0] + box[2] * 0.3), round(box[1] + box[3] * 0.6)
    page.pointer(x, y)
    before = page.state()
    for _ in range(4):
        page.pointer(x, y, "mouseWheel", deltaX=0, deltaY=-200)
        time.sleep(0.05)
    page.pointer(x + 0.1, y)
    zoomed = page.state()
    check("the wheel enlarges about the pointer", float(zoomed["scale"]) > 2 * float(before["scale"])
          and zoomed["cursor"] == before["cursor"], f"{before['cursor']} stays {zoomed['cursor']}")
    explained = page.script("return document.querySelector('.inspector').dataset.pixel")
    page.pointer(x, y, "mousePressed", button="left", clickCount=1)
    for i in range(1, 11):
        page.pointer(x + 3 * i, y + 2 * i, button="left", buttons=1)
    page.pointer(x + 30, y + 20, "mouseReleased", button="left", clickCount=1)
    dragged = page.state()
    moved = [(float(zoomed[k]) - float(dragged[k])) * float(zoomed["scale"]) for k in "xy"]
    still = page.script("return document.querySelector('.inspector').dataset.pixel") == explained
    check("a drag moves the picture, and is no click", np.allclose(moved, [30, 20], atol=0.01) and still, moved)
    images = page.images()
    page.press(Keys.ARROW_RIGHT)
    flipped = page.state()
    check("flipping keeps zoom and place", all(flipped[k] == dragged[k] for k in ("scale", "x", "y")) and page.images()[0] != images[0])
    page.press(Keys.ARROW_LEFT)
    check("flipping back shows the very same", page.images() == images)
    page.pointer(x, y, "mousePressed", button="left", clickCount=1)
    page.pointer(x, y, "mouseReleased", button="left", clickCount=1)
    page.settle()
    told = page.script("return {...document.querySelector('.inspector').dataset}")
    check("a click sends the pixel to the inspector", told["pixel"] == page.state()["cursor"], told)
    page.press_fit()


def check_flicker(page, check, _folder):
    """In no frame between two pictures is a panel empty."""
    blank = page.driver.execute_async_script("""
        const done = arguments[0], canvas = document.querySelector('.viewer-frame canvas');
        const reader = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
        let blank = 0, frames = 0;
        const look = () => {
          reader.clearRect(0, 0, 1, 1);
          reader.drawImage(canvas, canvas.width / 2 | 0, canvas.height / 2 | 0, 1, 1, 0, 0, 1, 1);
          blank += reader.getImageData(0, 0, 1, 1).data[3] === 0;
          if (++frames === 60) { done(blank); return; }
          if (frames % 6 === 0) canvas.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}));
          requestAnimationFrame(look);
        };
        look();""")
    check("flipping does not flicker", blank == 0, f"{blank} of 60 frames empty")


def check_inspector(page, check, folder):
    for index, scene in enumerate(page.data["scenes"]):
        page.choose(".viewer-scene", str(index))
        for at, picture in enumerate(scene["pictures"]):
            if not picture["explain"] or picture["explained"] != scene["pixel"]:
                continue
            page.choose(".inspector h3 select", str(at))
            page.driver.execute_async_script("setTimeout(arguments[0], 150)")
            more = page.driver.find_elements(By.CSS_SELECTOR, ".inspector .more")
            if more:
                page.click(".inspector .more")
            told = page.script("return {...document.querySelector('.inspector').dataset}")
            steps = len(page.driver.find_elements(By.CSS_SELECTOR, ".inspector .step"))
            resolved = page.script("return document.querySelector('.resolved .figure')?.textContent ?? ''").split()
            path = folder / picture["exr"]
            right = True
            if path.exists():
                x, y = scene["pixel"]
                right = same(resolved, exr_layers(path)["colour"][y, x])
            check(f"the inspector tells {scene['name']}, {picture['name']} to the picture's colour",
                  told["told"] == "true" and told["design"] == picture["name"] and right, f"{steps} fragments")
    page.choose(".viewer-scene", "0")
    scene = page.data["scenes"][0]
    page.hover(3, 5)
    page.press("x")
    page.driver.execute_async_script("setTimeout(arguments[0], 100)")
    command = page.script("return document.querySelector('.inspector code').textContent")
    name = page.pictures()[0].replace("reference", "exact")
    wanted = f"screendoor explain {scene['trace']} --design {name} --samples {scene['samples']} --pixel 3,5"
    check("any other pixel has its command", command == wanted, command)
    page.driver.execute_cdp_cmd("Browser.grantPermissions", {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]})
    page.driver.find_element(By.CSS_SELECTOR, ".viewer-copy").click()
    page.driver.execute_async_script("setTimeout(arguments[0], 200)")
    said = page.script("return document.querySelector('.viewer-copy').textContent")
    check("the command can be copied", said in ("Copied", "Selected"), said)


def contrast(page, selector):
    """The contrast of an element's text with what is behind it."""
    return page.script("""
        const element = document.querySelector(arguments[0]);
        const parse = (c) => c.match(/[\\d.]+/g).map(Number);
        let behind = element, back;
        do { back = parse(getComputedStyle(behind).backgroundColor); behind = behind.parentElement; } while (behind && back[3] === 0);
        const light = (c) => c.slice(0, 3).map((v) => v / 255).map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
          .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
        const [a, b] = [light(parse(getComputedStyle(element).color)), light(back)].sort((p, q) => q - p);
        return (a + 0.05) / (b + 0.05);""", selector)


def check_themes(page, check, _folder):
    backs = {}
    for scheme in ("light", "dark"):
        page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
        page.settle()
        backs[scheme] = page.script("return getComputedStyle(document.body).backgroundColor")
        texts = [".viewer-legend", ".viewer-where", ".viewer-short", "[data-mode=colour]", "[data-mode=signed]", ".viewer-values b",
                 ".viewer-values", ".inspector h3", ".inspector code"]
        worst = min((contrast(page, s), s) for s in texts)
        check(f"text is readable on {scheme}", worst[0] >= 4.5, f"least contrast {worst[0]:.1f} ({worst[1]})")
    check("light and dark differ", backs["light"] != backs["dark"], backs)
    page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def check_print(page, check, _folder):
    page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    visible = page.script("""return [...document.querySelectorAll('.viewer-controls, .viewer-short, .viewer-copy')]
        .filter((e) => e.offsetParent !== null).length""")
    canvases = page.script("return [...document.querySelectorAll('.viewer-frame canvas')].filter((c) => c.offsetWidth > 0).length")
    page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    pdf = base64.b64decode(page.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])
    check("on paper there are panels and no controls", visible == 0 and canvases == len(page.canvases())
          and pdf.count(b"/Subtype /Image") >= canvases, f"{pdf.count(b'/Subtype /Image')} pictures in {len(pdf) // 1024} KiB of PDF")
    page.settle()


def check_silence(page, check, where):
    """Nothing on the console, nothing from the network."""
    said = [entry["message"] for entry in page.driver.get_log("browser")]
    check(f"the console stays empty ({where})", not said, said[:3] or "")
    asked = set()
    for entry in page.driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            asked.add(message["params"]["request"]["url"])
    asked = [url for url in asked if not url.startswith(("data:", "blob:", "chrome"))]
    check(f"nothing is asked of a network ({where})", len(asked) == 1 and asked[0].startswith("file:"), asked if len(asked) != 1 else "")


def phone(driver):
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 390, "height": 844, "deviceScaleFactor": 3, "mobile": True})
    driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 5})


def check_phone(page, check):
    width = page.script("return [innerWidth, document.scrollingElement.scrollWidth]")
    check("a phone shows one panel and does not scroll sideways", width == [390, 390] and len(page.canvases()) == 1, width)

    def touch(kind, *points):
        page.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {
            "type": kind, "touchPoints": [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]})

    page.script("document.querySelector('.viewer-frame canvas').scrollIntoView({block: 'center', behavior: 'instant'})")
    box = page.script("const b = document.querySelector('.viewer-frame canvas').getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]")
    before = page.state()
    x, y = box
    touch("touchStart", (x - 30, y), (x + 30, y))
    for i in range(1, 11):
        touch("touchMove", (x - 30 - 6 * i, y), (x + 30 + 6 * i, y))
    touch("touchEnd")
    after = page.state()
    grown = float(after["scale"]) / float(before["scale"])
    check("two fingers enlarge", abs(grown - 3) < 0.05, f"{grown:.3f} times")
    touch("touchStart", (x, y))
    for i in range(1, 11):
        touch("touchMove", (x + 4 * i, y))
    touch("touchEnd")
    moved = (float(after["x"]) - float(page.state()["x"])) * float(after["scale"])
    # A browser keeps the first pixels to itself, to tell a tap.
    check("one finger moves what is enlarged", 20 <= moved <= 41, f"{moved:.1f} of 40")
    touch("touchStart", (x + 20, y + 10))
    touch("touchEnd")
    page.driver.execute_async_script("setTimeout(arguments[0], 200)")
    told = page.script("return {...document.querySelector('.inspector').dataset}")
    check("a tap sends the pixel to the inspector", told["pixel"] == page.state()["cursor"], told["pixel"])
    width = page.script("return [innerWidth, document.scrollingElement.scrollWidth]")
    check("nor sideways after that", width == [390, 390], width)


def press_fit(page):
    page.click("[data-do=fit]")


Page.press_fit = press_fit


def on_desk(*parts):
    """Drives the page at a desk: `parts`, checks of a page, a folder and results."""
    def drive(report, folder, check):
        with browser() as driver:
            page = Page(driver, report)
            for part in parts:
                part(page, check, folder)
            check_silence(page, check, "desk")
    return drive


def on_phone(report, folder, check):
    with browser() as driver:
        phone(driver)
        page = Page(driver, report)
        check_phone(page, check)
        check_silence(page, check, "phone")


def run(report, folder, check):
    on_desk(check_opens, check_values, check_keys, check_keys_are_not_stolen, check_pointer, check_flicker,
            check_inspector, check_themes, check_print)(report, folder, check)
    on_phone(report, folder, check)


# ---- planted defects ----------------------------------------------------------------------

def one_bit(text):
    """The lowest byte of a channel's first pixel, in the first picture."""
    data = json.loads(re.search(r'<script[^>]* id="viewer-data"[^>]*>(.*?)</script>', text, re.S)[1])
    blob = data["scenes"][0]["pictures"][0]["pixels"]
    found = re.search(rf'(id="{blob}"[^>]*>)(.*?)(</script>)', text, re.S)
    raw = bytearray(zlib.decompress(base64.b64decode(found[2]), -15))
    raw[-data["scenes"][0]["width"] * data["scenes"][0]["height"]] ^= 2
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = base64.b64encode(packer.compress(bytes(raw)) + packer.flush()).decode()
    return text[:found.start(2)] + packed + text[found.end(2):]


def letters(text):
    """Forty letters of a packed picture, turned round: a single one may change a single pixel."""
    found = re.search(r'id="viewer-blob-1"[^>]*>(.*?)</script>', text, re.S)
    at = found.start(1) + 200
    return text[:at] + text[at:at + 40][::-1] + text[at + 40:]


def replaced(old, new):
    def plant(text):
        assert old in text, old
        return text.replace(old, new, 1)
    return plant


# What is planted, how, which checks look at it, and which of them must fail.
PLANTS = [
    ("one bit of one pixel", one_bit, on_desk(check_values), "values of "),
    ("letters of a packed picture", letters, on_desk(check_opens, check_values), "nothing failed to decode|values of "),
    ("an error on the console", replaced("</body>", "<script>console.error('planted')</script></body>"),
     on_desk(check_opens), "the console stays empty"),
    ("a picture from the network", replaced("</body>", "<img src='http://127.0.0.1:9/a.png' alt=''></body>"),
     on_desk(check_opens), "nothing is asked of a network"),
    ("something wide", replaced("</body>", "<div style='width:600px'>wide</div></body>"), on_phone, "does not scroll sideways"),
    ("a dead key", replaced("    s: setEncoding,\n", ""), on_desk(check_keys), "key s "),
    ("flipping that moves", replaced("  function step(panel, by) {", "  function step(panel, by) { state.view.x += 1;"),
     on_desk(check_pointer), "flipping keeps"),
    ("a panel that empties", replaced("    panel.wanted = wanted;\n", "    panel.wanted = wanted; panel.shown = null; invalidate(); await new Promise((r) => setTimeout(r, 50));\n"),
     on_desk(check_flicker), "flipping does not flicker"),
    ("pixels drawn aside", replaced("context.drawImage(shown.as(look()).canvas, left,", "context.drawImage(shown.as(look()).canvas, left + 9,"),
     on_desk(check_values), "colours of "),
    ("keys taken from lists", replaced("'input, select, textarea", "'input, textarea"),
     on_desk(check_keys_are_not_stolen), "keys are the page's"),
    ("grey on grey", replaced("</head>", "<style>.viewer-legend{color:#888!important;background:#777}</style></head>"),
     on_desk(check_themes), "text is readable"),
    ("controls on paper", replaced("</head>", "<style>.viewer .viewer-controls{display:flex!important}</style></head>"),
     on_desk(check_print), "on paper"),
    ("a wrong story", replaced("colour.map((v) => exactText(Math.fround(v)))", "colour.map((v) => exactText(Math.fround(v) + 1e-6))"),
     on_desk(check_inspector), "the inspector tells"),
]


def self_test(report, folder):
    text, failures = report.read_text(encoding="utf-8"), 0
    for name, plant, drive, expected in PLANTS:
        with tempfile.TemporaryDirectory() as scratch:
            # Without the defect the same checks pass.
            sound, check = Checks(quiet=True), Checks(quiet=True)
            drive(report, folder, sound)
            copy = Path(scratch) / "report.html"
            copy.write_text(plant(text), encoding="utf-8")
            drive(copy, folder, check)
        caught = not sound.failed and any(re.search(expected, f) for f in check.failed)
        failures += not caught
        print(f"{'ok  ' if caught else 'FAIL'} planted {name}: {len(check.failed)} of {check.count} checks failed"
              f"{', ' + check.failed[0] if check.failed else ''}", flush=True)
    print(f"{len(PLANTS) - failures} of {len(PLANTS)} planted defects were found")
    return failures == 0


# ---- pictures of the page ------------------------------------------------------------------

def screenshots(report, out):
    out.mkdir(parents=True, exist_ok=True)

    def shot(page, name, selector="#viewer"):
        page.settle()
        page.driver.execute_async_script("setTimeout(arguments[0], 200)")
        box = page.script("""const b = document.querySelector(arguments[0]).getBoundingClientRect();
            return {x: 0, y: b.top + scrollY, width: innerWidth, height: b.height}""", selector)
        data = page.driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": {**box, "scale": 1}})
        (out / f"{name}.png").write_bytes(base64.b64decode(data["data"]))

    with browser(1400, 1100) as driver:
        page = Page(driver, report)
        for scheme in ("light", "dark"):
            driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
            page.hover(66, 60)
            shot(page, scheme)
        for mode in ("signed", "absolute", "flip"):
            page.press("e")
            shot(page, mode, ".viewer-panels")
        page.press("e")
        for _ in range(6):
            page.press("+")
        shot(page, "enlarged", ".viewer-panels")
        for _ in range(6):
            page.press("+")
        shot(page, "values", ".viewer-panels")
        page.press("f", "?")
        for index in range(len(page.data["scenes"])):
            page.choose(".viewer-scene", str(index))
            for at in range(len(page.data["scenes"][index]["pictures"])):
                page.choose(".inspector h3 select", str(at))
                shot(page, f"inspector-{index}-{at}", ".inspector")
        page.choose(".viewer-scene", "0")
        (out / "print.pdf").write_bytes(base64.b64decode(driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": False})["data"]))
    with browser() as driver:
        phone(driver)
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True})
        page = Page(driver, report)
        shot(page, "phone")
        page.choose(".viewer-scene", str(len(page.data["scenes"]) - 1))
        shot(page, "phone-last")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path)
    parser.add_argument("exr_folder", type=Path)
    parser.add_argument("--self-test", action="store_true", help="plant defects and expect them to be found")
    parser.add_argument("--screenshots", type=Path, metavar="FOLDER", help="only write pictures of the page")
    arguments = parser.parse_args()
    if arguments.screenshots:
        screenshots(arguments.report, arguments.screenshots)
        return 0
    if arguments.self_test:
        return 0 if self_test(arguments.report, arguments.exr_folder) else 1
    check = Checks()
    run(arguments.report, arguments.exr_folder, check)
    print(f"{check.count - len(check.failed)} of {check.count} checks passed")
    return 1 if check.failed else 0


if __name__ == "__main__":
    sys.exit(main())
