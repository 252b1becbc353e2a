#!/usr/bin/env bash
# Which crates and features are in the build. A dependency that switches a feature on switches it on for everybody,
# and with some features bits depend on the processor (ARCHITECTURE.md, "Dependencies").
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TERM_COLOR=never

failed=0
fail() {
  echo "FAILED ($features): $*" >&2
  failed=1
}

# Each crate once for every set of features it is built with, as "name vVERSION ,feature,feature,".
crates() {
  cargo tree --locked --workspace --target all --prefix none --no-dedupe --format '{p} ,{f},' "$@" |
    sed -E 's/ \((proc-macro|\/[^)]*)\)//g' | sort -u
}

versions() { # CRATE: how many of it there are
  awk -v crate="$1" '$1 == crate { print $2 }' <<<"$tree" | sort -u | wc -l
}

features_of() { # CRATE: a line for each set of features it is built with
  awk -v crate="$1" '$1 == crate { print $3 }' <<<"$tree"
}

absent() { # CRATE REASON
  (($(versions "$1") == 0)) || fail "$1 is among the dependencies: $2"
}

with() { # CRATE FEATURE...
  local crate=$1 feature
  for feature in "${@:2}"; do
    if features_of "$crate" | grep -vF ",$feature," >/dev/null; then
      fail "$crate is without its feature $feature"
    fi
  done
}

without() { # CRATE FEATURE...
  local crate=$1 feature
  for feature in "${@:2}"; do
    if features_of "$crate" | grep -F ",$feature," >/dev/null; then
      fail "$crate has its feature $feature; cargo tree -e features -i $crate says who asks for it"
    fi
  done
}

# The command, the golden path alone, and everything: a feature may be missing in one or be forbidden in another.
for features in "" "--no-default-features --features threads" "--all-features"; do
  read -ra arguments <<<"$features"
  tree=$(crates "${arguments[@]}")
  features=${features:-default features}

  (($(versions glam) == 1)) || fail "there are $(versions glam) versions of glam, and one must be all"
  with glam std scalar-math libm # obvhs asks for its default features too: std alone
  without glam core-simd fast-math nostd-libm
  with blake3 pure
  without tobj ahash
  without obvhs parallel
  without nalgebra std
  without tiny-skia simd
  without gltf import
  absent matrixmultiply "it picks FMA at run time"

  # With exr and what is below it cut off, nothing may be left of pulp.
  if (($(versions exr) > 0)); then
    rest=$(crates "${arguments[@]}" --prune exr)
    ! grep -q "^pulp " <<<"$rest" || fail "pulp is used by another crate than exr: it picks FMA at run time"
  fi

  if [[ $features == *--no-default-features* ]]; then
    for crate in pulp faer gemm fearless_simd ndarray; do
      absent "$crate" "it may not be on a golden path, since it picks instructions at run time"
    done
  fi
done

((failed == 0)) || exit 1
echo "ok: one glam, with $(features_of glam | sed "s,^\,\|\,$,,g"); no forbidden crate or feature"
