"""Translucent points and markers of datoviz (Vulkan), offscreen: python markers.py OUT.png"""

import sys

import datoviz as dvz
import numpy as np

random = np.random.default_rng(5)


def places(n):
    return random.uniform(-0.8, 0.8, (n, 3)).astype(np.float32)


def colours(n, alpha):
    rgba = random.integers(0, 255, (n, 4)).astype(np.uint8)
    rgba[:, 3] = alpha
    return rgba


app = dvz.App(offscreen=True, background="black")
figure = app.figure(320, 240)
panel = figure.panel()
sizes = random.uniform(20, 60, 80).astype(np.float32)
panel.add(app.point(position=places(80), color=colours(80, 110), size=sizes))
sizes = random.uniform(25, 50, 24).astype(np.float32)
hearts = app.marker(
    position=places(24), color=colours(24, 150), size=sizes,
    shape="heart", aspect="outline", linewidth=3.0,
)
panel.add(hearts)
app.screenshot(figure, sys.argv[1])
app.destroy()
