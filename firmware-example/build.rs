//! Puts the board's `memory.x` where the linker looks and passes the linker scripts.

use std::{env, fs, path::PathBuf};

/// Images that log through defmt.
const WITH_DEFMT: [&str; 1] = ["demo"];
/// Images that print plain text, or nothing.
const WITHOUT_DEFMT: [&str; 2] = ["budget", "selftest"];

/// A library built with defmt support leaves sections that only defmt's script places.
const NO_DEFMT_X: &str = "SECTIONS { /DISCARD/ : { *(.defmt .defmt.*); } }\n";

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("../memory.x", out.join("memory.x")).expect("memory.x is at the repository root");
    fs::write(out.join("no-defmt.x"), NO_DEFMT_X).expect("OUT_DIR is writable");
    println!("cargo:rerun-if-changed=../memory.x");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-link-search={}", out.display());

    // FLASH and RAM segments are not page-aligned.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    for bin in WITH_DEFMT {
        println!("cargo:rustc-link-arg-bin={bin}=-Tdefmt.x");
    }
    for bin in WITHOUT_DEFMT {
        println!("cargo:rustc-link-arg-bin={bin}=-Tno-defmt.x");
    }
}
