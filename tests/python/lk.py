"""Replays a trace through the design `lk`, written from docs/EXACT_RULES.md and
docs/TRACE_FORMAT.md alone: lk.py TRACE SAMPLES SEED OUTPUT

OUTPUT is pixel by pixel, row by row, little-endian: the colour (3 float32), the surface (uint32), the
held samples (uint64), then each sample's depth (uint32) and colour (3 float32)."""

import sys

import numpy as np
import pyarrow as pa

WORD = 0xFFFFFFFF


def scatter(word):
    if word == 0:
        return 0
    h = word ^ 0xE6FE3BEB
    h = (h ^ h >> 16) * 0x7FEB352D & WORD
    h = (h ^ h >> 15) * 0x846CA68B & WORD
    return h ^ h >> 16


def reference(n, pixel, surface, seed, samples):
    index = n + pixel * samples
    x = int(f"{index & WORD:032b}"[::-1], 2)
    x = x + surface + scatter(seed) + scatter(index >> 32) & WORD
    for factor in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6):
        x ^= x * factor & WORD
    return x


def hilbert(x, y, bits):
    pixel = 0
    for bit in reversed(range(bits)):
        right, down = x >> bit & 1, y >> bit & 1
        pixel = 4 * pixel + (3 * right ^ down)
        if down == 0:
            if right == 1:
                x, y = ~x, ~y
            x, y = y, x
    return pixel


def read(path):
    reader = pa.ipc.open_file(path)
    said = {k.decode(): v.decode() for k, v in reader.schema.metadata.items()}
    said = {k.removeprefix("screendoor."): v for k, v in said.items()}
    assert said["version"].split(".")[0] == "1"
    assert said["depth"] == "unorm32 near=0 far=4294967295 less-equal"
    table = reader.read_all()

    def column(name):
        real = name in ("r", "g", "b", "alpha")
        if name in table.column_names:
            values = table[name].to_numpy()
            return values.astype(np.float32) if real else values.tolist()
        value = said[f"constant.{name}"]
        return [np.float32(value) if real else int(value)] * len(table)

    columns = [column(n) for n in "x y coverage z dzdx dzdy alpha r g b".split()]
    return said, zip(*columns[:7], np.array(columns[7:], np.float32).T.reshape(-1, 3))


def replay(path, samples, seed):
    said, fragments = read(path)
    width, height = int(said["width"]), int(said["height"])
    own = int(said["samples"])
    assert samples == own or samples < own and said["nested"] == "true"
    positions = [tuple(map(int, p.split(","))) for p in said["positions"].split()][:samples]
    background = np.array([np.float32(c) for c in said["background"].split()])
    bits = (max(width, height) - 1).bit_length()

    layout = [("surface", "<u4"), ("held", "<u8"),
              ("samples", [("depth", "<u4"), ("colour", "<f4", 3)], samples)]
    state = np.zeros((height, width), layout)
    state["samples"]["depth"] = WORD
    state["samples"]["colour"] = background
    for x, y, coverage, z, dzdx, dzdy, alpha, colour in fragments:
        covered = [s for s in range(samples) if coverage >> s & 1]
        pixel = state[y, x]
        depth = pixel["samples"]["depth"].tolist()
        at = {s: z + (dzdx * positions[s][0] + dzdy * positions[s][1]) // 16 for s in covered}
        at = {s: min(max(d, 0), WORD) for s, d in at.items()}
        passed = [s for s in covered if at[s] <= depth[s]]
        if not passed:
            continue
        mask, held = sum(1 << s for s in passed), int(pixel["held"])
        if mask & held:
            pixel["surface"] = int(pixel["surface"]) + 1 & WORD
            held = 0
        number, surface = hilbert(x, y, bits), int(pixel["surface"])
        threshold = np.ceil(np.float64(alpha) * 2.0**32)
        passed.sort(key=lambda s: (depth[s], s))
        for n, s in enumerate(passed, held.bit_count()):
            if reference(n, number, surface, seed, samples) < threshold:
                pixel["samples"][s] = (at[s], colour)
        pixel["held"] = held | mask
    return state


def resolve(state):
    colours = state["samples"]["colour"]
    samples = colours.shape[2]
    total = np.zeros(colours.shape[:2] + (3,), np.float32)
    shares = total.copy()
    with np.errstate(over="ignore", invalid="ignore"):
        for s in range(samples):
            total += colours[:, :, s]
            shares += colours[:, :, s] / np.float32(samples)
    mean = np.where(np.isfinite(total), total / np.float32(samples), shares)
    bits = np.ascontiguousarray(colours).view(np.uint32)
    same = (bits == bits[:, :, :1]).all(axis=(2, 3))
    return np.where(same[..., None], colours[:, :, 0], mean).astype("<f4")


def main(path, samples, seed, output):
    state = replay(path, int(samples), int(seed))
    picture = resolve(state)
    with open(output, "wb") as file:
        for row, colours in zip(state, picture):
            for pixel, colour in zip(row, colours):
                file.write(colour.tobytes() + pixel.tobytes())


if __name__ == "__main__":
    main(*sys.argv[1:])
