#!/usr/bin/env bash
# The bunny's G-buffer at 1024 × 1024 by bitlight and by Mesa llvmpipe, side by side, as a table in Markdown:
#
#   BITLIGHT_ASSETS=… tests/peers/llvmpipe/run.sh >tests/peers/llvmpipe/result.md
#
# tests/peers/README.md says what to install.
set -euo pipefail
cd "$(dirname "$0")/../../.."
target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target/peers"
cc -O2 -Wall -o "$target/peers/llvmpipe" tests/peers/llvmpipe/llvmpipe.c -lEGL -lGL
cargo build --locked --quiet --release --example llvmpipe
# value KEY: of the first processor.
value() { awk -F '[[:space:]]*: ' -v key="$1" '$1 == key && !found { print $2; found = 1 }' /proc/cpuinfo; }
echo "Measured on $(date -u +%F), on $(value "model name") (family $(value "cpu family"), model $(value model)) with" \
  "$(nproc) cores, by \`tests/peers/llvmpipe/run.sh\`."
echo
"$target/release/examples/llvmpipe" "$target/peers/llvmpipe"
