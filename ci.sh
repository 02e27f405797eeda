#!/usr/bin/env bash
# Every check of the project, for people and for CI.
#
#   ./ci.sh                all steps, in this order:
#   ./ci.sh setup          the microcontroller target, QEMU, ARM compiler and binutils
#   ./ci.sh fmt            formatting
#   ./ci.sh clippy         lints, host and microcontroller
#   ./ci.sh test           unit, integration and documentation tests on the host
#   ./ci.sh doc            documentation without warnings
#   ./ci.sh thumb          library and firmware images for the microcontroller, with their sizes
#   ./ci.sh qemu           run the images in QEMU
#   ./ci.sh capi           the C library: tests, its header, the example in C in QEMU and under the host's sanitizers
#   ./ci.sh miri           only when named: the border to C under Miri, where the nightly toolchain has it
#   ./ci.sh symbols        no allocator, no soft double, no new panic path in the images, built for speed and for size
#   ./ci.sh budget         instructions, stack, flash and RAM against those published in firmware-example/README.md
# Several steps may be named: ./ci.sh fmt clippy
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "$root"

readonly steps=(setup fmt clippy test doc thumb qemu capi symbols budget)
readonly on_request=(miri)
readonly target=thumbv7em-none-eabihf
readonly images=(budget coupled demo fusion glmb kernels selftest)
readonly image_dir=firmware-example/target/$target

# Panic symbols that an image of a profile may contain, and why.
panics_allowed() {
    case $1/$2 in
        */demo) echo 3 ;;     # defmt-semihosting: "taken reentrantly" and alike; the next line's two
        */selftest) echo 2 ;; # cortex-m-semihosting: RefCell around its output handles
        *) echo 0 ;;          # print nothing
    esac
}

# The steps rely on cargo's default places.
unset CARGO_TARGET_DIR CARGO_BUILD_TARGET
PATH=$PATH:${CARGO_HOME:-${HOME:-/root}/.cargo}/bin

# --- setup ---------------------------------------------------------------------------------

have() { command -v "$1" >/dev/null; }

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi
}

# Installs those Debian packages that are missing; fails where that is impossible.
apt_install() {
    local package missing=()
    have apt-get || return 1
    for package in "$@"; do
        dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed ||
            missing+=("$package")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    echo "installing ${missing[*]}"
    as_root apt-get update -qq &&
        as_root env DEBIAN_FRONTEND=noninteractive \
            apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

host() { "${1:-rustc}" -vV | sed -n 's/^host: //p'; }

# Can this compiler (default: the one in force here) build for the target, with
# link-time optimisation? That needs a `core` which carries LLVM bitcode.
compiles_for_target() {
    local out rc=0
    out=$(mktemp -d)
    "${1:-rustc}" --target $target --crate-type staticlib -C lto=fat -o "$out/lib.a" - \
        2>/dev/null <<'RUST' || rc=1
#![no_std]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! { loop {} }
RUST
    rm -r "$out"
    return $rc
}

rust_ready() {
    have cargo && cargo fmt --version >/dev/null 2>&1 && cargo clippy --version >/dev/null 2>&1 &&
        compiles_for_target
}

rustup_rust() {
    have rustup && rustup target add $target && rustup component add rustfmt clippy
}

# Where rustup has no `core` for the target: Debian's compiler, and `core` built from Debian's
# sources, installed where that compiler looks for it. After that no build needs a special flag.
debian_rust() {
    echo "no $target from rustup; trying Debian's compiler"
    apt_install rustc-web cargo-web rust-web-src rust-web-clippy rustfmt-web lld || return 1
    local crate lib=/usr/lib/rustlib/$target/lib bin
    bin=/usr/lib/rustlib/$(host /usr/bin/rustc)/bin
    [ -e "$bin/rust-lld" ] ||
        { as_root mkdir -p "$bin" && as_root ln -sf "$(command -v lld)" "$bin/rust-lld"; } || return 1
    if ! compiles_for_target /usr/bin/rustc; then
        echo "building core for $target"
        crate=$(mktemp -d)
        mkdir "$crate/src"
        echo '#![no_std]' >"$crate/src/lib.rs"
        printf '[package]\nname = "empty"\nedition = "2024"\n[workspace]\n' >"$crate/Cargo.toml"
        (cd "$crate" && RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 \
            RUSTFLAGS="-C embed-bitcode=yes -C codegen-units=1" \
            /usr/bin/cargo build --quiet --release --target $target -Zbuild-std=core) || return 1
        as_root rm -rf "$lib" && as_root mkdir -p "$lib" &&
            as_root cp "$crate"/target/$target/release/deps/lib{core,comp}*.rlib "$lib/" || return 1
        rm -r "$crate"
    fi
    if have rustup; then
        rustup toolchain link thumb /usr && rustup override unset --nonexistent &&
            rustup override set thumb --path "$root"
    fi
}

step_setup() {
    if rust_ready || { rustup_rust && rust_ready; } || { debian_rust && rust_ready; }; then
        echo "compiler: $(rustc -V), builds for $target"
    else
        echo "MISSING: cargo with rustfmt, clippy and $target; steps that need them will fail"
    fi
    have qemu-system-arm || apt_install qemu-system-arm || true
    have arm-none-eabi-nm || apt_install binutils-arm-none-eabi || true
    have arm-none-eabi-gcc || apt_install gcc-arm-none-eabi || true
    have cc || apt_install gcc libc6-dev || true # the counter's disassembler is C, and so is an example
    have make || apt_install make || true
    have qemu-system-arm || echo "MISSING: qemu-system-arm; steps qemu and budget will fail"
    have arm-none-eabi-nm || echo "MISSING: ARM binutils; steps thumb and symbols will fail"
    have arm-none-eabi-gcc || echo "MISSING: arm-none-eabi-gcc; steps capi and symbols will fail"
}

# --- checks --------------------------------------------------------------------------------

# All are workspaces of their own; cargo reads `.cargo/config.toml` of the current directory.
in_firmware() { (cd firmware-example && "$@"); }
in_capi() { (cd capi && "$@"); }
in_runner() { (cd firmware-example/runner && "$@"); }
# From the root, no configuration makes the microcontroller the target.
for_counter() { cargo "$1" --manifest-path firmware-example/counter/Cargo.toml "${@:2}"; }

step_fmt() {
    cargo fmt --all --check
    in_firmware cargo fmt --check
    in_capi cargo fmt --all --check
    in_runner cargo fmt --check
    for_counter fmt --check
}

step_clippy() {
    cargo clippy --workspace --all-targets -- -D warnings
    # Separate calls: in one, the features of all packages would unify.
    cargo clippy -p boresight --lib --target $target -- -D warnings
    cargo clippy -p boresight --lib --target $target --features defmt,link -- -D warnings
    in_firmware cargo clippy --release --lib --bins -- -D warnings
    in_runner cargo clippy --target "$(host)" -- -D warnings
    for_counter clippy --release --all-targets -- -D warnings
}

# The program that the tests have been built with: `cargo run` would build its dependencies anew, with other features.
host_tests() {
    cargo test --release --workspace --features host-tests/count --no-run
    target/release/host-tests "$@"
}

step_test() { cargo test --release --workspace --features host-tests/count; }

step_doc() { RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --workspace; }

step_thumb() {
    cargo build --release -p boresight --lib --target $target
    cargo build --release -p boresight --lib --target $target --features defmt,link
    in_firmware cargo build --release --bins
    (cd $image_dir/release && arm-none-eabi-size "${images[@]}")
}

step_qemu() {
    local image
    for image in "${images[@]}"; do in_firmware cargo run --release --bin "$image"; done
    # Compiled for size, the same bits.
    in_firmware cargo run --profile small --bin selftest
    # What the target has recorded, the desk must do again to the same bits.
    mkdir -p target
    in_firmware cargo run --release --bin record >target/record.log
    host_tests replay-log target/record.log
}

step_capi() {
    in_capi cargo clippy --all-targets -- -D warnings
    in_capi cargo test
    in_capi cargo run -p headers -- --check
    in_capi cargo build --release --lib
    RUSTFLAGS="-C target-cpu=cortex-m4" in_capi cargo build --release --lib --target $target
    make -C capi/example run record
    # What C has recorded, the desk must do again to the same bits.
    host_tests replay-log capi/example/build/target.log
}

# Miri knows no assembly: an ARM without floating point unit, where the square root is the library's own code.
step_miri() {
    if ! have rustup || ! rustup +nightly component list 2>/dev/null | grep -q '^miri.*(installed)'; then
        echo "no Miri: rustup toolchain install nightly --component miri,rust-src"
        return 1
    fi
    in_capi cargo +nightly miri test --target arm-unknown-linux-gnueabi --test border
}

# Says what an image of a profile has that it should not, and whether that is more than allowed.
is_clean() {
    # What brings allocation, double arithmetic in software, or a panic; on demangled names.
    local allocator='__rust_(alloc|dealloc|realloc)|__r(g|dl)_|^(m|c|re)alloc$|^free$|^<?alloc::'
    local double='__aeabi_(c?d[a-z0-9]+|[a-z]+2d)$|__[a-z]+df([23]|[sd]i|sf2)?$'
    local panic='^core::.*(panic|_fail)'
    local elf=$image_dir/$1/$2 symbols calls pattern name allowed row=()
    [ "$2" != capi ] || elf=capi/example/build/track.elf
    allowed=$(panics_allowed "$1" "$2")
    # core::panic only describes a panic, it does not raise one.
    symbols=$(arm-none-eabi-nm -C --defined-only "$elf" | cut -d' ' -f3- |
        grep -v '^core::panic::' | sort -u) || return 1
    calls=$(arm-none-eabi-objdump -dC "$elf" | grep '>$') || return 1
    for pattern in "$allocator" "$double" "$panic"; do
        row+=("$(grep -cE "$pattern" <<<"$symbols" || true)")
    done
    printf '%-8s %-9s allocator %d, soft double %d, panic %d of %d allowed\n' "$1" "$2" "${row[@]}" "$allowed"
    grep -E "$allocator|$double|$panic" <<<"$symbols" | while read -r name; do
        printf '%8d calls  %s\n' "$(grep -cF "<$name>" <<<"$calls" || true)" "$name"
    done || true
    [ "${row[0]}${row[1]}" = 00 ] && [ "${row[2]}" -le "$allowed" ]
}

step_symbols() {
    local profile image failed=0
    in_firmware cargo build --profile small --bins
    for profile in release small; do
        for image in "${images[@]}" tracker; do
            is_clean $profile "$image" || failed=1
        done
    done
    is_clean release capi || failed=1
    [ $failed = 0 ] || { echo "symbols: more than allowed, see above" >&2; return 1; }
}

step_budget() {
    for_counter test --release
    host_tests budget --check
}

# --- run -----------------------------------------------------------------------------------

[ $# -gt 0 ] || set -- "${steps[@]}"
for step in "$@"; do
    [[ " ${steps[*]} ${on_request[*]} " == *" $step "* ]] || { echo "steps: ${steps[*]} ${on_request[*]}" >&2; exit 2; }
done
trap '[ $? = 0 ] || echo "FAILED: $step" >&2' EXIT
for step in "$@"; do
    printf '\n==== %s ====\n' "$step"
    start=$SECONDS
    "step_$step"
    echo "---- $step: $((SECONDS - start)) s"
done
