//! What the cycle model has to know of an instruction.
//!
//! Cycles, by the tables 3-1 and 7-1 of the Cortex-M4 Technical Reference Manual, without wait states:
//!
//! ```text
//! integer, compare, move, VADD, VSUB, VMUL, VCMP, VCVT   1     VMOV of two words   2
//! VMLA, VMLS, VFMA, VFMS   3     VDIV, VSQRT   14     UDIV, SDIV   7, between 2 and 12
//! load of a word    2, or 1 right after another whose result is not its address
//! store of a word   1; with an index register 2, or 1 right after a load
//! several words     1 + words
//! jump              1, and 2 more to refill the pipeline where it is taken
//! + 1               where floating point arithmetic has made an operand just before; the addend of VMLA has time
//! + 1               where integer arithmetic has made the address just before
//! ```
//!
//! Conditional instructions count as executed, jumps excepted: the emulator does not tell.

use capstone::arch::DetailsArchInsn;
use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmCC, ArmInsn, ArmInsnDetail, ArmOperandType, ArmReg};
use capstone::prelude::*;

/// Cycles to refill the pipeline after a jump.
const REFILL: u32 = 2;
const SP: u16 = 1 << 13;
const PC: u16 = 1 << 15;

/// One instruction, as far as its cost and that of the next depend on it. Registers are bit sets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instruction {
    /// Cycles on its own, not taken where it is a jump
    cycles: u32,
    /// A load of one word, which the next access may overlap
    is_load: bool,
    /// An access that may overlap a load before it
    overlaps: bool,
    /// Core registers that it loads, if it is a load of one word
    loaded: u16,
    /// Core registers that its integer arithmetic writes
    computed: u16,
    /// Core registers that its address is made of
    address: u16,
    /// Words of the registers that its floating point arithmetic writes
    fp_computed: u32,
    /// Words of the floating point registers that it needs at once
    fp_read: u32,
    jumps: bool,
    conditional: bool,
    /// Whether it calls a function
    pub calls: bool,
    /// Words that it pushes onto the stack
    pub pushed: u32,
}

impl Instruction {
    /// Cycles after `before`.
    pub fn cost(&self, before: Option<&Self>, taken: bool) -> u32 {
        if self.jumps && self.conditional && !taken {
            return 1;
        }
        let refill = if self.jumps && taken { REFILL } else { 0 };
        let Some(before) = before else { return self.cycles + refill };
        let overlap = self.overlaps && before.is_load && before.loaded & self.address == 0;
        let stalls = u32::from(before.fp_computed & self.fp_read != 0) + u32::from(before.computed & self.address & !PC != 0);
        self.cycles - u32::from(overlap) + stalls + refill
    }
}

/// Takes machine code apart.
pub struct Decoder(Capstone);

impl Decoder {
    /// For the Thumb code of an M-profile core.
    pub fn new() -> CsResult<Self> {
        let builder = Capstone::new().arm().mode(ArchMode::Thumb).extra_mode([ArchExtraMode::MClass].into_iter());
        builder.detail(true).build().map(Self)
    }

    /// The instructions of a piece of straight code at `address`, up to one that this decoder does not know.
    pub fn decode(&self, code: &[u8], address: u64) -> CsResult<Vec<Instruction>> {
        let found = self.0.disasm_all(code, address)?;
        let described = found.iter().map(|i| Ok(describe(ArmInsn::from(i.id().0), self.0.insn_detail(i)?.arch_detail().arm())));
        described.collect()
    }
}

/// The bytes of the one instruction that `bytes` begin with. QEMU may append what it has read twice, at the end of a page.
pub fn whole(bytes: &[u8]) -> &[u8] {
    let wide = bytes.get(1).is_some_and(|high| high >> 3 >= 0b11101);
    bytes.get(..if wide { 4 } else { 2 }).unwrap_or(bytes)
}

/// An operand: the core registers and the floating point words in it, and whether it is in memory.
#[derive(Clone, Copy, Default)]
struct Operand {
    core: u16,
    fp: u32,
    memory: bool,
    indexed: bool,
}

impl Operand {
    fn new(operand: &ArmOperandType) -> Self {
        match operand {
            ArmOperandType::Reg(id) => register(*id),
            ArmOperandType::Mem(place) => {
                let (base, index) = (register(place.base()), register(place.index()));
                Self { core: base.core | index.core, memory: true, indexed: index.core != 0, ..Self::default() }
            }
            _ => Self::default(),
        }
    }
}

/// A register as a bit set: core, single or double.
fn register(id: RegId) -> Operand {
    let id = u32::from(id.0);
    let number = |first: u32, count: u32| id.checked_sub(first).filter(|n| *n < count);
    let core = |n: u32| Operand { core: 1 << n, ..Operand::default() };
    match id {
        ArmReg::ARM_REG_SP => core(13),
        ArmReg::ARM_REG_LR => core(14),
        ArmReg::ARM_REG_PC => core(15),
        _ => {
            if let Some(n) = number(ArmReg::ARM_REG_R0, 13) {
                core(n)
            } else if let Some(n) = number(ArmReg::ARM_REG_S0, 32) {
                Operand { fp: 1 << n, ..Operand::default() }
            } else if let Some(n) = number(ArmReg::ARM_REG_D0, 16) {
                Operand { fp: 3 << (2 * n), ..Operand::default() }
            } else {
                Operand::default()
            }
        }
    }
}

fn describe(code: ArmInsn, detail: Option<&ArmInsnDetail>) -> Instruction {
    use ArmInsn::*;
    let Some(detail) = detail else { return Instruction::default() };
    let operands: Vec<Operand> = detail.operands().map(|o| Operand::new(&o.op_type)).collect();
    let first = operands.first().copied().unwrap_or_default();
    let all = |part: &[Operand]| part.iter().fold(Operand::default(), |a, o| Operand { core: a.core | o.core, fp: a.fp | o.fp, ..a });
    let (rest, every) = (all(operands.get(1..).unwrap_or_default()), all(&operands));
    let memory = operands.iter().find(|o| o.memory).copied().unwrap_or_default();
    // What the base of a post-indexed access is moved by stands behind it.
    let behind = operands.iter().skip_while(|o| !o.memory).fold(0, |set, o| set | o.core);
    let conditional = !matches!(detail.cc(), ArmCC::ARM_CC_AL | ArmCC::ARM_CC_INVALID);
    let plain = Instruction { cycles: 1, conditional, ..Instruction::default() };
    let arithmetic = |cycles| Instruction { cycles, fp_computed: first.fp, fp_read: rest.fp, ..plain };
    let several = |words: u32| Instruction { cycles: 1 + words, ..plain };
    let words = |set: Operand| set.core.count_ones() + set.fp.count_ones();
    match code {
        ARM_INS_B | ARM_INS_BX | ARM_INS_CBZ | ARM_INS_CBNZ => {
            Instruction { jumps: true, conditional: conditional || matches!(code, ARM_INS_CBZ | ARM_INS_CBNZ), ..plain }
        }
        ARM_INS_BL | ARM_INS_BLX => Instruction { jumps: true, calls: true, ..plain },
        ARM_INS_TBB | ARM_INS_TBH => Instruction { cycles: 3, jumps: true, ..plain },

        ARM_INS_VADD | ARM_INS_VSUB | ARM_INS_VMUL | ARM_INS_VNMUL | ARM_INS_VCVT | ARM_INS_VCVTR | ARM_INS_VCVTB | ARM_INS_VCVTT => {
            arithmetic(1)
        }
        ARM_INS_VMLA | ARM_INS_VMLS | ARM_INS_VNMLA | ARM_INS_VNMLS | ARM_INS_VFMA | ARM_INS_VFMS | ARM_INS_VFNMA | ARM_INS_VFNMS => {
            arithmetic(3)
        }
        ARM_INS_VDIV | ARM_INS_VSQRT => arithmetic(14),
        ARM_INS_VCMP | ARM_INS_VCMPE => Instruction { fp_read: every.fp, ..plain },
        ARM_INS_VMOV | ARM_INS_VNEG | ARM_INS_VABS => {
            let two_words = every.core != 0 && every.fp.count_ones() == 2;
            let read = if first.core != 0 { every.fp } else { rest.fp };
            Instruction { cycles: if two_words { 2 } else { 1 }, fp_read: read, ..plain }
        }

        ARM_INS_LDR | ARM_INS_LDRB | ARM_INS_LDRH | ARM_INS_LDRSB | ARM_INS_LDRSH => {
            let jumps = first.core & PC != 0;
            Instruction { cycles: 2, is_load: true, overlaps: true, loaded: first.core, address: behind, jumps, ..plain }
        }
        ARM_INS_STR | ARM_INS_STRB | ARM_INS_STRH => {
            let pushed = u32::from(detail.writeback() && memory.core == SP);
            Instruction { cycles: 1 + u32::from(memory.indexed), overlaps: memory.indexed, address: behind, pushed, ..plain }
        }
        ARM_INS_VLDR if words(first) == 1 => Instruction { cycles: 2, is_load: true, overlaps: true, address: memory.core, ..plain },
        ARM_INS_VLDR => Instruction { address: memory.core, ..several(2) },
        ARM_INS_VSTR => {
            let cycles = if words(first) == 1 { 1 } else { 3 };
            Instruction { cycles, fp_read: first.fp, address: memory.core, ..plain }
        }
        ARM_INS_LDRD => Instruction { address: behind, ..several(2) },
        ARM_INS_STRD => {
            let pushed = if detail.writeback() && memory.core == SP { 2 } else { 0 };
            Instruction { address: behind, pushed, ..several(2) }
        }
        ARM_INS_POP | ARM_INS_VPOP => Instruction { jumps: every.core & PC != 0, ..several(words(every)) },
        ARM_INS_PUSH | ARM_INS_VPUSH => Instruction { fp_read: every.fp, pushed: words(every), ..several(words(every)) },
        ARM_INS_LDM | ARM_INS_LDMDB | ARM_INS_VLDMIA | ARM_INS_VLDMDB => {
            Instruction { address: first.core, jumps: rest.core & PC != 0, ..several(words(rest)) }
        }
        ARM_INS_STM | ARM_INS_STMDB | ARM_INS_VSTMIA | ARM_INS_VSTMDB => {
            let down = matches!(code, ARM_INS_STMDB | ARM_INS_VSTMDB) && detail.writeback() && first.core == SP;
            let pushed = if down { words(rest) } else { 0 };
            Instruction { address: first.core, fp_read: rest.fp, pushed, ..several(words(rest)) }
        }

        ARM_INS_UDIV | ARM_INS_SDIV => Instruction { cycles: 7, computed: first.core, ..plain },
        ARM_INS_UMULL | ARM_INS_SMULL | ARM_INS_UMLAL | ARM_INS_SMLAL | ARM_INS_UMAAL => {
            let high = operands.get(1).copied().unwrap_or_default();
            Instruction { computed: first.core | high.core, ..plain }
        }
        ARM_INS_CMP | ARM_INS_CMN | ARM_INS_TST | ARM_INS_TEQ | ARM_INS_VMRS | ARM_INS_VMSR | ARM_INS_MSR => plain,
        _ => Instruction { computed: first.core, jumps: first.core & PC != 0, ..plain },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cycles of straight code, without what its first instruction may save by standing after another.
    fn cycles(halves: &[u16], taken: bool) -> Option<u32> {
        let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        let code = Decoder::new().ok()?.decode(&bytes, 0x1000).ok()?;
        let before = std::iter::once(None).chain(code.iter().map(Some));
        Some(code.iter().zip(before).map(|(i, before)| i.cost(before, taken)).sum())
    }

    // The expected cycles are read off the manual's tables by hand.

    #[test]
    fn arithmetic_costs_what_the_manual_says() {
        assert_eq!(cycles(&[0xee30, 0x0a81], false), Some(1)); // vadd.f32 s0, s1, s2
        assert_eq!(cycles(&[0xeea0, 0x0a81], false), Some(3)); // vfma.f32 s0, s1, s2
        assert_eq!(cycles(&[0xee80, 0x0a81], false), Some(14)); // vdiv.f32 s0, s1, s2
        assert_eq!(cycles(&[0xeeb1, 0x0ae0], false), Some(14)); // vsqrt.f32 s0, s1
        assert_eq!(cycles(&[0xfbb1, 0xf0f2], false), Some(7)); // udiv r0, r1, r2
        assert_eq!(cycles(&[0xfba2, 0x0103], false), Some(1)); // umull r0, r1, r2, r3
    }

    #[test]
    fn a_result_that_is_used_at_once_costs_one_more() {
        // vmul.f32 s0, s1, s2, then vadd.f32 with s0, or without
        assert_eq!(cycles(&[0xee20, 0x0a81, 0xee30, 0x2a22], false), Some(3));
        assert_eq!(cycles(&[0xee20, 0x0a81, 0xee31, 0x2aa2], false), Some(2));
        // vmul.f32 s0, s1, s2, then vfma.f32 s0, s1, s2: s0 is the addend
        assert_eq!(cycles(&[0xee20, 0x0a81, 0xeea0, 0x0a81], false), Some(4));
        // adds r1, #4, then ldr r0, [r1]
        assert_eq!(cycles(&[0x3104, 0x6808], false), Some(4));
    }

    #[test]
    fn loads_overlap_unless_one_is_the_address_of_the_next() {
        assert_eq!(cycles(&[0x6808, 0x684a], false), Some(3)); // ldr r0, [r1]; ldr r2, [r1, #4]
        assert_eq!(cycles(&[0x6809, 0x684a], false), Some(4)); // ldr r1, [r1]; ldr r2, [r1, #4]
        assert_eq!(cycles(&[0x6008], false), Some(1)); // str r0, [r1]
        assert_eq!(cycles(&[0xed91, 0x0a00], false), Some(2)); // vldr s0, [r1]
        assert_eq!(cycles(&[0xed91, 0x0b00], false), Some(3)); // vldr d0, [r1]
    }

    #[test]
    fn several_words_cost_one_more_than_their_number_and_jumps_a_refill() {
        assert_eq!(cycles(&[0xb5f0], false), Some(6)); // push {r4-r7, lr}
        assert_eq!(cycles(&[0xed2d, 0x8b04], false), Some(5)); // vpush {d8, d9}
        assert_eq!(cycles(&[0xbdf0], true), Some(8)); // pop {r4-r7, pc}
        assert_eq!((cycles(&[0xd0fe], true), cycles(&[0xd0fe], false)), (Some(3), Some(1))); // beq
        assert_eq!(cycles(&[0x4770], true), Some(3)); // bx lr
    }

    #[test]
    fn what_is_pushed_and_what_calls_is_told() {
        let decode = |halves: &[u16]| {
            let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
            Decoder::new().ok()?.decode(&bytes, 0x1000).ok()?.first().map(|i| (i.pushed, i.calls))
        };
        assert_eq!(decode(&[0xb5f0]), Some((5, false)));
        assert_eq!(decode(&[0xf84d, 0x4d04]), Some((1, false))); // str r4, [sp, #-4]!
        assert_eq!(decode(&[0xe92d, 0x0700]), Some((3, false))); // push.w {r8-r10}
        assert_eq!(decode(&[0xed2d, 0x8b04]), Some((4, false)));
        assert_eq!(decode(&[0xf000, 0xf800]), Some((0, true))); // bl
        assert_eq!(decode(&[0x4798]), Some((0, true))); // blx r3
    }

    #[test]
    fn an_instruction_is_as_long_as_its_first_half_says() {
        assert_eq!(whole(&[0x06, 0x46, 0x06, 0x46]), [0x06, 0x46]);
        assert_eq!(whole(&[0xa8, 0xf1, 0x01, 0x0c]), [0xa8, 0xf1, 0x01, 0x0c]);
    }
}
