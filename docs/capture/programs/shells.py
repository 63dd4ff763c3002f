"""Nested isosurfaces of VTK (OpenGL), offscreen: python shells.py OUT.png"""

import sys

import pyvista as pv

pv.OFF_SCREEN = True
plotter = pv.Plotter(off_screen=True, window_size=(320, 240))
plotter.disable_anti_aliasing()
colours = ["#e05040", "#e0a040", "#60b060", "#4080d0"]
for radius, colour in zip((0.3, 0.5, 0.7, 0.9), colours):
    for side in (-0.5, 0.5):
        shell = pv.Sphere(radius=radius, center=(side, 0.2 * side, 0.3 * side))
        plotter.add_mesh(shell, color=colour, opacity=0.3)
plotter.add_mesh(pv.Cube(x_length=0.3, y_length=0.3, z_length=0.3), color="white")
# VTK's own order-independent transparency writes sums and weights, which are no layers.
plotter.renderer.SetUseOIT(False)
plotter.set_background("#203040")
plotter.show(screenshot=sys.argv[1])
