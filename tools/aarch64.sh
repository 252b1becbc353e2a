#!/usr/bin/env bash
# tools/aarch64.sh [FOLDER]: a cross toolchain for 64-bit Arm. Afterwards
#
#     . FOLDER/env && cargo test --target aarch64-unknown-linux-gnu
#
# builds for aarch64 and runs there under qemu. FOLDER is target/aarch64 if not given; a folder that is complete is
# left as it is.
#
# The standard library comes from rustup where its target is installed. Elsewhere Debian's rustc-web and its
# aarch64 standard library are unpacked below FOLDER: apt works on lists and a status of its own there, so that
# the machine need not take arm64 in as a foreign architecture. Only the linker, its C library and qemu are
# installed on the machine itself.
set -euo pipefail

triple=aarch64-unknown-linux-gnu
folder=${1:-$(dirname "$0")/../target/aarch64}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)

fail() {
  echo "aarch64.sh: $*" >&2
  exit 1
}

machine_tools() {
  command -v aarch64-linux-gnu-gcc && command -v qemu-aarch64 && [[ -e /usr/aarch64-linux-gnu/lib/libc.so.6 ]]
}

unpack_compiler() {
  local packages package
  mkdir -p "$folder"/apt/{state/lists/partial,cache/archives/partial} "$folder"/{debs,root}
  : >"$folder/apt/status"
  cat >"$folder/apt/conf" <<CONF
Dir::State "$folder/apt/state";
Dir::State::status "$folder/apt/status";
Dir::Cache "$folder/apt/cache";
APT::Architecture "amd64";
APT::Architectures { "amd64"; "arm64"; };
APT::Sandbox::User "root";
CONF
  export APT_CONFIG=$folder/apt/conf
  apt-get -qq update
  # What an installation would bring in is the dependencies' exact names, versions of LLVM and std included. All
  # but the compiler's own libraries are on any machine that builds Rust.
  packages=$(apt-get -s --no-install-recommends install rustc-web libstd-rust-web-dev:arm64 |
    sed -n 's/^Inst \([^ ]*\) .*/\1/p' |
    grep -E '^(rustc-web|libstd-rust-web-(dev|dev:arm64|[0-9.]+)|libllvm[0-9.]+|libz3-4)$')
  (cd "$folder/debs" && xargs apt-get -qq download <<<"$packages")
  for package in "$folder"/debs/*.deb; do dpkg -x "$package" "$folder/root"; done
  rm -r "$folder"/{apt,debs}
  unset APT_CONFIG

  cat >"$folder/rustc" <<WRAPPER
#!/bin/sh
LD_LIBRARY_PATH='$folder/root/usr/lib/x86_64-linux-gnu' exec '$folder/root/usr/bin/rustc' "\$@"
WRAPPER
  chmod +x "$folder/rustc"
}

if [[ ! -f $folder/env ]]; then
  if ! machine_tools >/dev/null; then
    packages=(gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user)
    command -v apt-get >/dev/null || fail "there is no apt-get to install ${packages[*]}"
    ((EUID == 0)) || fail "${packages[*]} must be installed: only root may"
    apt-get -qq update
    DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends "${packages[@]}" >/dev/null
  fi
  compiler=
  if ! compgen -G "$(rustc --print target-libdir --target $triple)/libstd-*.rlib" >/dev/null; then
    command -v apt-get >/dev/null || fail "rustup target add $triple, or run this on Debian"
    unpack_compiler
    compiler="export RUSTC='$folder/rustc'"
  fi
  cat >"$folder/env.part" <<ENV
$compiler
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER='qemu-aarch64 -L /usr/aarch64-linux-gnu'
ENV
  mv "$folder/env.part" "$folder/env" # last: it stands for a complete folder
fi
# shellcheck disable=SC1091 # it is written above
. "$folder/env"
"${RUSTC:-rustc}" --version
