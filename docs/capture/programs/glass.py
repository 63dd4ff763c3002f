"""Panes and a cloud of points of pygfx (WebGPU), offscreen: python glass.py OUT.png"""

import sys

import numpy as np
import pygfx as gfx
from PIL import Image
from rendercanvas.offscreen import OffscreenRenderCanvas

canvas = OffscreenRenderCanvas(size=(320, 240), pixel_ratio=1)
renderer = gfx.renderers.WgpuRenderer(canvas, pixel_ratio=1)
random = np.random.default_rng(7)
scene = gfx.Scene()
scene.add(gfx.Background.from_color("#1b2838"))
solid = gfx.MeshPhongMaterial(color="#c08040")
scene.add(gfx.Mesh(gfx.torus_knot_geometry(0.9, 0.25, 96, 12), solid))
# Blended as they come, over what is opaque: the order is the program's.
blended = {"alpha_mode": "blend", "depth_write": False}
for place in random.uniform(-1.4, 1.4, (8, 3)):
    glass = gfx.MeshPhongMaterial(color=(*random.random(3), 0.35), **blended)
    ball = gfx.Mesh(gfx.sphere_geometry(0.7, 24, 16), glass)
    ball.local.position = place
    scene.add(ball)
places = random.uniform(-2, 2, (300, 3)).astype(np.float32)
dots = gfx.PointsMaterial(color=(0.3, 0.9, 0.7, 0.5), size=8, **blended)
scene.add(gfx.Points(gfx.Geometry(positions=places), dots))
scene.add(gfx.AmbientLight(0.6))
light = gfx.DirectionalLight(2)
light.local.position = (3, 4, 5)
scene.add(light)
camera = gfx.PerspectiveCamera(50, 320 / 240)
camera.local.position = (0, 0, 5)
camera.look_at((0, 0, 0))
canvas.request_draw(lambda: renderer.render(scene, camera))
picture = np.asarray(canvas.draw())[..., :3].copy()
Image.fromarray(picture).save(sys.argv[1])
