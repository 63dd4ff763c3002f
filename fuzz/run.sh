#!/usr/bin/env bash
# Runs every fuzz target and writes docs/fuzzing/figures.toml, which STABILITY.md is written from.
#
#   fuzz/run.sh [executions of each target, 2000000 where not given] [targets …]
#
# It needs cargo-fuzz (`cargo install cargo-fuzz`) and, where the toolchain is no nightly one,
# does without a sanitizer. What is found lies in fuzz/artifacts, the corpus in fuzz/corpus.
set -euo pipefail
cd "$(dirname "$0")/.."

executions=${1:-2000000}
shift || true
targets=("$@")
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <(cargo fuzz list)

# Small inputs are drawn by one thread soonest.
export RAYON_NUM_THREADS=1
cargo fuzz build --sanitizer none --release
built=${CARGO_TARGET_DIR:-fuzz/target}/$(rustc -vV | sed -n 's/^host: //p')/release

figures=$(mktemp)
echo "# Written by fuzz/run.sh." >"$figures"
for target in "${targets[@]}"; do
    corpus=fuzz/corpus/$target artifacts=fuzz/artifacts/$target
    mkdir -p "$corpus" "$artifacts"
    log=$(mktemp)
    start=$SECONDS
    # It stops at the first failure.
    "$built/$target" -runs="$executions" -max_len=16384 -timeout=5 \
        -rss_limit_mb=1024 -print_final_stats=1 \
        -artifact_prefix="$artifacts/" "$corpus" "fuzz/seeds/$target" >"$log" 2>&1 || true
    last=$(grep -E '^#[0-9]+' "$log" | tail -n 1)
    {
        echo
        echo "[[target]]"
        echo "name = \"$target\""
        echo "executions = $(sed -n 's/^stat::number_of_executed_units: *//p' "$log")"
        echo "seconds = $((SECONDS - start))"
        echo "covered = $(sed -E 's/.* cov: ([0-9]+).*/\1/' <<<"$last")"
        echo "corpus = $(sed -E 's/.* corp: ([0-9]+).*/\1/' <<<"$last")"
        echo "failures = $(find "$artifacts" -type f | wc -l)"
    } >>"$figures"
    tail -n +2 "$figures" | tail -n 8
done
mkdir -p docs/fuzzing
mv "$figures" docs/fuzzing/figures.toml
