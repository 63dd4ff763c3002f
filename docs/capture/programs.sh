#!/usr/bin/env bash
# Captures programs of different kinds and prints a table of docs/VULKAN.md: fragments, what is missing of
# them, how far a replay is from each program's picture, and the time of the program alone and captured.
# From the root of a checkout, on Debian 12 or newer; installs what it lacks. Not part of the tests.
set -euo pipefail
cd "$(dirname "$0")/../.."

packages=(mesa-vulkan-drivers libvulkan1 vulkan-tools xvfb xauth mesa-utils glmark2-x11 gfxreconstruct extremetuxracer
    qml-qt6 qml6-module-qtquick qml6-module-qtquick-window qml6-module-qtqml-workerscript python3-venv)
if ! dpkg --status "${packages[@]}" >/dev/null 2>&1; then
    as_root=$([ "$(id -u)" = 0 ] || echo sudo)
    $as_root apt-get update --quiet --quiet
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install --quiet --quiet --yes --no-install-recommends "${packages[@]}"
fi
python=target/programs/bin/python
[ -x $python ] || python3 -m venv target/programs
target/programs/bin/pip install --quiet --disable-pip-version-check pygfx rendercanvas pillow datoviz pyvista

screendoor=${SCREENDOOR:-target/release/screendoor}
[ -n "${SCREENDOOR:-}" ] || cargo build --locked --release --workspace
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-$(mktemp -d)}
# Without a display there is one of our own.
[ -n "${DISPLAY:-}" ] || exec xvfb-run --auto-servernum --server-args="-screen 0 1280x1024x24 -noreset" "$0"

out=$(mktemp -d)
here=docs/capture/programs
echo '| program | interface | fragments | not in the trace | replay, of 255 at most | alone, s | captured, s |'
echo '|---|---|---|---|---|---|---|'
# NAME, INTERFACE, what is given to capture, --, the program.
try() {
    local name=$1 interface=$2 given=()
    shift 2
    while [ "$1" != -- ]; do given+=("$1") && shift; done
    shift
    local alone=() start middle end
    # Mesa's own driver of OpenGL on a software driver of Vulkan.
    [[ " ${given[*]} " != *" --opengl "* ]] || alone=(env LIBGL_ALWAYS_SOFTWARE=1 MESA_LOADER_DRIVER_OVERRIDE=zink)
    start=$(date +%s.%N)
    timeout 60 "${alone[@]}" "$@" >"$out/alone.txt" 2>&1 || true
    middle=$(date +%s.%N)
    if ! LIBGL_ALWAYS_SOFTWARE=1 timeout 120 "$screendoor" capture --vulkan -q --check "${given[@]}" \
        --json "$out/$name.json" -o "$out/$name.arrow" -- "$@" >"$out/$name.txt" 2>&1; then
        echo "| $name | $interface | failed: $(grep error "$out/$name.txt" | head -n 1) | | | | |"
        return
    fi
    end=$(date +%s.%N)
    $python - "$out/$name.json" "$name" "$interface" "$start" "$middle" "$end" <<'P'
import json, sys
document = json.load(open(sys.argv[1]))
name, interface = sys.argv[2:4]
start, middle, end = map(float, sys.argv[4:])
lost = [f"{r['fragments']} ({r['why']})" for r in document["refused"] if r["fragments"]]
lost += [f"{n} ({why.replace('_', ' ')})" for why, n in document["dropped"].items()
         if n and why in ("additive", "coloured", "beyond")]
check = document["check"]
greatest = check["incomparable"] or f"{check['greatest']:.2f}"
print(f"| {name} | {interface} | {document['fragments']} | {'; '.join(lost) or 'none'} | {greatest} "
      f"| {middle - start:.1f} | {end - middle:.1f} |")
P
}
try vkcube Vulkan -- vkcube --c 60
try glxgears "OpenGL, zink" --opengl --stop -- timeout 8 glxgears
try glmark2-desktop "OpenGL, zink" --opengl --stop -- glmark2 -b desktop:duration=2
try extremetuxracer "OpenGL, zink" --opengl --stop -- timeout 15 /usr/games/etr
try shells "VTK, OpenGL, zink" --opengl -- $python $here/shells.py "$out/shells.png"
try glass "pygfx, WebGPU" -- $python $here/glass.py "$out/glass.png"
try markers "datoviz, Vulkan" -- $python $here/markers.py "$out/markers.png"
QSG_RHI_BACKEND=vulkan try cards "Qt Quick, Vulkan" -- /usr/lib/qt6/bin/qml $here/cards.qml
try gfxrecon-replay "a recorded stream" -- gfxrecon-replay traces/programs/markers.gfxr
rm -rf "$out"
