#!/usr/bin/env bash
# tools/proofs.sh [--all]: the proof of the determinism contract. examples/proof.rs runs under every build profile,
# instruction set, processor and number of threads, against the one manifest of each scene. Every run must agree with it,
# and all must print the same digest of what they rendered. --all adds the processors that take longest.
#
# tools/cross.sh brings other processors' compilers and emulators. Where it cannot, a proof is skipped with its reason;
# under CI=true that is a failure.
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TERM_COLOR=never CARGO_INCREMENTAL=0
# Flags of the machine's own would make a baseline binary another; each build below says its flags.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS BITLIGHT_THREADS

target=${CARGO_TARGET_DIR:-target}
processors=(arm64 i386 s390x)
case ${1:-} in
  '') ;;
  --all) processors+=(armhf riscv64 ppc64el) ;;
  *) echo "usage: tools/proofs.sh [--all]" >&2; exit 2 ;;
esac
failed=0 runs=0 digest=

fail() {
  echo "FAILED: $*"
  failed=1
}

skip() {
  if [[ ${CI:-} == true ]]; then fail "$*"; else echo "skipped: $*"; fi
}

# As an example of this package the proof would bring what tests and benchmarks need into each build, a quarter of its
# time. So it is a program of a package of its own, with this one's versions and profiles. Below one target folder both
# share all crates but this one.
package=$target/proofs/package
mkdir -p "$package"
cp Cargo.lock "$package"
cat >"$package/Cargo.toml" <<MANIFEST
[package]
name = "proof"
edition = "2024"

[[bin]]
name = "proof"
path = "$PWD/examples/proof.rs"

[features]
threads = ["bitlight/threads"]

[dependencies]
bitlight = { path = "$PWD", default-features = false }
blake3 = { version = "*", default-features = false }

[workspace]

$(sed -n '/^\[profile/,$p' Cargo.toml)
MANIFEST

# What is built with other flags or for another processor shares nothing with the machine's own builds. There the crates
# that compute are optimised, and the rest is not: it reads files or is not called.
separate=(--release --config profile.release.debug=false --config 'profile.release.package."*".opt-level=0')
for crate in bitlight blake3 crossbeam-deque crossbeam-epoch crossbeam-utils glam libm obvhs pxfm rayon rayon-core; do
  separate+=(--config "profile.release.package.$crate.opt-level=3")
done

# build TEXT FOLDER ARGUMENT...: builds the proof below FOLDER.
build() {
  local text=$1 folder=$2 began=$SECONDS
  shift 2
  cargo build --quiet --manifest-path "$package/Cargo.toml" --target-dir "$folder" "$@"
  printf 'built %-40s %4d s\n' "$text" $((SECONDS - began))
}

# prove TEXT COMMAND...: runs the proof, and holds its digest against the first run's.
prove() {
  local text=$1 began=${EPOCHREALTIME/[.,]/} output status=0 last milliseconds
  shift
  output=$("$@" 2>&1) || status=$?
  milliseconds=$(((${EPOCHREALTIME/[.,]/} - began) / 1000))
  last=${output##*$'\n'}
  if ((runs == 0)); then
    echo "$output"
    digest=$last
  fi
  runs=$((runs + 1))
  if ((status != 0)); then
    echo "$output"
    fail "$text: exit status $status"
  elif [[ $last != "$digest" ]]; then
    fail "$text: $last, but the first run had $digest"
  else
    printf 'same  %-40s %4d.%03d s\n' "$text" $((milliseconds / 1000)) $((milliseconds % 1000))
  fi
}

# toolchain ARCH: whether tools/cross.sh has it, perhaps now. Its environment is taken over.
toolchain() {
  local status=0
  tools/cross.sh "$target/cross" "$1" || status=$?
  case $status in
    0)
      # shellcheck disable=SC1090 # it is written by cross.sh
      . "$target/cross/$1.env"
      read -ra emulator <<<"$CROSS_RUN"
      ;;
    3) skip "$1: this machine cannot have it, for the reason above" ;;
    *) fail "$1: there is no toolchain, for the reason above" ;;
  esac
  return "$status"
}

# elsewhere ARCH ARGUMENT...: builds the proof for that processor and runs it.
elsewhere() {
  local program
  toolchain "$1" || return 0
  build "$1" "$target/proofs" --target "$CROSS_TARGET" "${separate[@]}" "${@:2}"
  program=$target/proofs/$CROSS_TARGET/release/proof
  [[ -e $program ]] || program+=.wasm
  prove "$1" "${emulator[@]}" "$program"
  unset RUSTC RUSTDOC
}

# runs_here CPU: whether this processor has every feature that rustc knows of CPU.
runs_here() {
  features() { rustc --print cfg -C target-cpu="$1" | grep ^target_feature | sort; }
  [[ -z $(comm -23 <(features "$1") <(features native)) ]]
}

rustc -vV | sed -n '1p; /^LLVM/p'
grep -m 1 '^model name' /proc/cpuinfo || true

# The tests have built the example for debugging, with all that the command has.
cargo build --locked --quiet --workspace --example proof
prove debug "$target/debug/examples/proof"

build "release, one thread and no pool" "$target" --release
prove "release, one thread and no pool" "$target/release/proof"

build release "$target" --release --features threads
prove release "$target/release/proof"
for number in 1 2 3 7; do
  prove "release, threads: $number" env BITLIGHT_THREADS=$number "$target/release/proof"
done

if [[ $(uname -m) == x86_64 ]]; then
  # Without flags rustc builds for x86-64 as such: the release build is the proof of that.
  [[ $(rustc --print cfg) == "$(rustc --print cfg -C target-cpu=x86-64)" ]] ||
    fail "rustc builds for another processor than x86-64 by itself"

  # The target is named, so that the flags are not those of build scripts.
  RUSTFLAGS="-C target-cpu=x86-64-v3" build x86-64-v3 "$target/proofs" \
    --target x86_64-unknown-linux-gnu "${separate[@]}" --features threads
  v3=$target/proofs/x86_64-unknown-linux-gnu/release/proof
  here=false
  ! runs_here x86-64-v3 || here=true
  ! $here || prove x86-64-v3 "$v3"

  if toolchain amd64; then
    $here || prove "x86-64-v3, Haswell under qemu" "${emulator[@]}" -cpu Haswell "$v3"
    # A processor with AVX-512 takes the widest side of every loop: here the middle one runs.
    prove "release, Haswell under qemu" "${emulator[@]}" -cpu Haswell "$target/release/proof"
    # No AVX and no FMA there: the very binary that ran with both must find other ways to the same bits.
    prove "release, Nehalem under qemu" "${emulator[@]}" -cpu Nehalem "$target/release/proof"
  fi
else
  skip "x86-64: this machine is none"
fi

# One thread is all that programs for WebAssembly have.
elsewhere wasm32-wasip1
for processor in "${processors[@]}"; do elsewhere "$processor" --features threads; done

# A proof that cannot fail proves nothing: with one digit of one digest turned in every manifest, it must fail.
copy=$(mktemp -d)
trap 'rm -r "$copy"' EXIT
proof=$(realpath "$target/release/proof")
cp -r scenes golden "$copy"
find "$copy/golden" -name '*.json' -exec \
  sed -i -E '0,/"digest": "/ { s/("digest": ")0/\11/; t; s/("digest": ")[1-9a-f]/\10/ }' {} +
status=0
output=$(cd "$copy" && "$proof") || status=$?
if ((status == 1)) && [[ $output == *"differs first"* ]]; then
  echo "noticed: a turned digit (${output%%$'\n'*})"
else
  fail "a turned digit of a digest goes unnoticed: exit status $status, $output"
fi

((failed == 0)) || exit 1
echo "ok: $runs runs, one digest: $digest"
