#!/usr/bin/env bash
# Cargo's runner for the images: ELF [--timeout SECONDS] [-- QEMU ARGUMENTS].
# Builds the host program in runner/ and lets it run the image in QEMU.
set -euo pipefail
manifest="$(dirname "${BASH_SOURCE[0]}")/runner/Cargo.toml"
# The config here makes the microcontroller the default target: name the host.
host=$(rustc -vV | sed -n 's/^host: //p')
exec cargo run --quiet --target "$host" --manifest-path "$manifest" -- "$@"
