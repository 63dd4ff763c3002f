#!/bin/sh
# Measures all that is to be known of a GPU in one go, from a fresh checkout:
#
#     benches/gpu.sh [FRAGMENTS] [OUT] [ADAPTER]
#
# draws a trace of about FRAGMENTS fragments (50 million where not given; 2 million are enough to try it
# on a processor) with every ported design, both kinds of threads, measures the device's peaks and
# its power, and writes OUT.json and OUT.md (`gpu` where not given). ADAPTER is a part of the name
# of the GPU or of its driver. RUNS replays are measured of each (5 where not given).
#
# Ends with an error where there is no adapter.
set -eu

fragments=${1:-50000000}
out=${2:-gpu}
case $out in /*) ;; *) out=$PWD/$out ;; esac
cd "$(dirname "$0")/.."
runs=${RUNS:-5}
target=${CARGO_TARGET_DIR:-target}
set -- ${3:+--adapter "$3"}

case $fragments in
'' | *[!0-9]*)
    echo "$0: '$fragments' is no number of fragments" >&2
    exit 2
    ;;
esac

# Beside the build: 50 million fragments are 2 GB.
mkdir -p "$target"
work=$(mktemp -d "$target/gpu.XXXXXX")
sampler=
# Also when it is broken off.
clean() {
    if [ -n "$sampler" ]; then kill "$sampler" 2>/dev/null || true; fi
    rm -rf "$work"
}
trap clean EXIT
trap 'exit 1' HUP INT TERM

# Joules that processors have taken so far, in millionths.
energy() {
    cat /sys/class/powercap/intel-rapl:?/energy_uj 2>/dev/null | awk '{ sum += $1 } END { if (NR) print sum }'
}

# Prints watts again and again, by whoever tells; nothing where nobody does.
watts() {
    if command -v nvidia-smi >/dev/null 2>&1; then
        exec nvidia-smi --query-gpu=power.draw --format=csv,noheader,nounits -lms 200
    elif command -v rocm-smi >/dev/null 2>&1; then
        while :; do
            rocm-smi --showpower --csv | sed -n 's/^card0,\([0-9.]*\).*/\1/p'
            sleep 0.2
        done
    elif [ -n "$(energy)" ]; then
        before=$(energy)
        while sleep 1; do
            after=$(energy)
            echo "$before $after" | awk '{ if ($2 > $1) print ($2 - $1) / 1e6 }'
            before=$after
        done
    fi
}

# measure NAME ARGUMENT...: a run of `throughput`, with the watts meanwhile.
measure() {
    name=$1
    shift
    echo "measuring: $name" >&2
    watts >"$work/$name.watts" 2>/dev/null &
    sampler=$!
    "$target/release/screendoor" throughput "$work/trace.arrow" --engines gpu --runs "$runs" \
        --json "$work/$name.json" "$@" >&2
    kill "$sampler" 2>/dev/null || true
    wait "$sampler" 2>/dev/null || true
    sampler=
}

cargo build --locked --release --bin screendoor
# First what may be refused: without an adapter nothing else is begun.
cargo bench --locked --bench gpu -- peaks "$work/peaks.json" "$@"

# `builtin:engine` has 2.27 million fragments at 512 × 512 pixels.
side=$(awk -v n="$fragments" 'BEGIN { printf "%d", 512 * sqrt(n / 2.27e6) + 1 }')
echo "drawing a trace of $side × $side pixels" >&2
"$target/release/screendoor" capture builtin:engine --size "${side}x$side" -o "$work/trace.arrow" >&2

designs=$(cargo bench --locked --bench gpu -- designs)
measure all --designs "$designs,enderton:mask=naive" --samples 8 "$@"
measure pixel --designs lk --samples 4,8,16 --gpu-threads pixel "$@"
measure sample --designs lk --samples 4,8,16 --gpu-threads sample "$@"

cargo bench --locked --bench gpu -- table "$work" "$out"
echo "written: $out.json $out.md" >&2
