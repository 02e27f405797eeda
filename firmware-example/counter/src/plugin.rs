//! QEMU's plugin interface, version 1 (QEMU 4.2 to 8.2), of which a few functions are declared here by hand.
//!
//! ```text
//! a block is translated   decode it, ask to be told when it runs and where its instructions store
//! it runs, it stores      calls.rs
//! the emulator ends       write the counts
//! ```

use crate::calls::{Block, Counter, Function};
use crate::instruction::{Decoder, whole};
use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::fmt::Write;
use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

type PluginId = u64;
/// A block under translation; QEMU's own.
type Translation = c_void;
/// An instruction of it; QEMU's own.
type Translated = c_void;

/// No access to registers from callbacks.
const NO_REGISTERS: c_int = 0;
/// Stores only.
const STORES: c_int = 2;

// SAFETY: as qemu-plugin.h of version 1 declares them. QEMU, which loads this library, defines them.
unsafe extern "C" {
    fn qemu_plugin_register_vcpu_tb_trans_cb(id: PluginId, callback: extern "C" fn(PluginId, *mut Translation));
    fn qemu_plugin_register_vcpu_tb_exec_cb(
        block: *mut Translation,
        callback: extern "C" fn(c_uint, *mut c_void),
        flags: c_int,
        data: *mut c_void,
    );
    fn qemu_plugin_register_vcpu_mem_cb(
        instruction: *mut Translated,
        callback: extern "C" fn(c_uint, u32, u64, *mut c_void),
        flags: c_int,
        access: c_int,
        data: *mut c_void,
    );
    fn qemu_plugin_register_atexit_cb(id: PluginId, callback: extern "C" fn(PluginId, *mut c_void), data: *mut c_void);
    fn qemu_plugin_tb_n_insns(block: *const Translation) -> usize;
    fn qemu_plugin_tb_get_insn(block: *const Translation, index: usize) -> *mut Translated;
    fn qemu_plugin_insn_vaddr(instruction: *const Translated) -> u64;
    fn qemu_plugin_insn_size(instruction: *const Translated) -> usize;
    fn qemu_plugin_insn_data(instruction: *const Translated) -> *const u8;
}

/// The version of the interface that this is written for.
// SAFETY: QEMU looks for this name, and nothing else defines it.
#[unsafe(no_mangle)]
pub static qemu_plugin_version: c_int = 1;

struct Session {
    counter: Counter,
    out: PathBuf,
    failure: Option<String>,
}

static SESSION: Mutex<Option<Session>> = Mutex::new(None);

thread_local! {
    /// Of the thread that translates.
    static DECODER: Option<Decoder> = Decoder::new().ok();
}

fn session() -> MutexGuard<'static, Option<Session>> {
    SESSION.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads the arguments and asks to be called; not 0 where it refuses them.
///
/// # Safety
/// `arguments` must point to `count` strings, as QEMU sees to.
// SAFETY: QEMU looks for this name, and nothing else defines it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn qemu_plugin_install(id: PluginId, _: *const c_void, count: c_int, arguments: *const *const c_char) -> c_int {
    let count = usize::try_from(count).unwrap_or(0);
    // SAFETY: QEMU hands over `count` pointers to strings, which live until this function returns.
    let arguments = (0..count).map(|k| unsafe { CStr::from_ptr(*arguments.add(k)) }.to_string_lossy().into_owned());
    match read(arguments) {
        Ok(new) => *session() = Some(new),
        Err(reason) => {
            eprintln!("counter: {reason}");
            return 1;
        }
    }
    // SAFETY: `id` is ours, and the callbacks have the signatures that QEMU calls them by.
    unsafe {
        qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
        qemu_plugin_register_atexit_cb(id, ended, std::ptr::null_mut());
    }
    0
}

/// `out=FILE`, and `call=NAME:ADDRESS` once or more.
fn read(arguments: impl Iterator<Item = String>) -> Result<Session, String> {
    let (mut out, mut functions) = (None, Vec::new());
    for argument in arguments {
        let function = |text: &str| {
            let (name, address) = text.split_once(':')?;
            let address = u32::from_str_radix(address.strip_prefix("0x")?, 16).ok()?;
            Some(Function { name: name.to_owned(), address: address & !1 })
        };
        match argument.split_once('=') {
            Some(("out", file)) => out = Some(PathBuf::from(file)),
            Some(("call", text)) => functions.push(function(text).ok_or_else(|| format!("{text}: not NAME:0xADDRESS"))?),
            _ => return Err(format!("unknown argument {argument}")),
        }
    }
    let out = out.ok_or("no out=FILE")?;
    Ok(Session { counter: Counter::new(functions), out, failure: None })
}

extern "C" fn translated(_: PluginId, block: *mut Translation) {
    let mut guard = session();
    let Some(Session { counter, failure, .. }) = guard.as_mut() else { return };
    // SAFETY: QEMU keeps the block, its instructions and their bytes until this callback returns.
    let parts: Vec<(*mut Translated, u64, &[u8])> = unsafe {
        let part = |k| {
            let part = qemu_plugin_tb_get_insn(block, k);
            let bytes = std::slice::from_raw_parts(qemu_plugin_insn_data(part), qemu_plugin_insn_size(part));
            (part, qemu_plugin_insn_vaddr(part), whole(bytes))
        };
        (0..qemu_plugin_tb_n_insns(block)).map(part).collect()
    };
    let bytes: Vec<u8> = parts.iter().flat_map(|(.., bytes)| *bytes).copied().collect();
    let Some((_, start, _)) = parts.first() else { return };
    let code = DECODER.with(|decoder| decoder.as_ref()?.decode(&bytes, *start).ok()).unwrap_or_default();
    if code.len() != parts.len() {
        failure.get_or_insert_with(|| format!("unknown instruction among {bytes:02x?} at {start:#x}"));
    }
    for ((part, ..), instruction) in parts.iter().zip(&code) {
        // SAFETY: as above; the words pushed travel in the pointer, which nobody follows.
        unsafe { qemu_plugin_register_vcpu_mem_cb(*part, stored, NO_REGISTERS, STORES, number(instruction.pushed as usize)) };
    }
    if let Some(made) = Block::new(*start as u32, *start as u32 + bytes.len() as u32, &code) {
        let data = number(counter.add(made));
        // SAFETY: as above; the number of the block travels in the pointer, which nobody follows.
        unsafe { qemu_plugin_register_vcpu_tb_exec_cb(block, ran, NO_REGISTERS, data) };
    }
}

/// A number as the pointer that a callback is given.
fn number(value: usize) -> *mut c_void {
    std::ptr::without_provenance_mut(value)
}

extern "C" fn ran(_: c_uint, block: *mut c_void) {
    if let Some(session) = session().as_mut() {
        session.counter.run(block.addr());
    }
}

extern "C" fn stored(_: c_uint, _: u32, address: u64, pushed: *mut c_void) {
    if let Some(session) = session().as_mut() {
        session.counter.store(address as u32, pushed.addr() as u32);
    }
}

/// Writes the counts; no file where an instruction was unknown.
extern "C" fn ended(_: PluginId, _: *mut c_void) {
    let Some(Session { counter, out, failure, .. }) = session().take() else { return };
    let mut text = String::new();
    for call in counter.calls() {
        let _ = writeln!(text, "{call}");
    }
    for (name, starts) in counter.code() {
        let _ = write!(text, "{name} code");
        for start in starts {
            let _ = write!(text, " {start:#x}");
        }
        text.push('\n');
    }
    let outcome = failure.map_or_else(|| fs::write(&out, text).map_err(|error| format!("{}: {error}", out.display())), Err);
    if let Err(reason) = outcome {
        eprintln!("counter: {reason}");
    }
}
