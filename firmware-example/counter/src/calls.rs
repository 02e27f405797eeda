//! From blocks of instructions as they run, to counts per call.
//!
//! ```text
//! block    what runs from its first instruction to its last; its inner cost is summed once, for a jump taken and not
//! cost     of a block is added when it is left: only then is known whether its jump was taken
//! call     from the block at a counted function's entry until the block at the address where its caller goes on
//! stack    the stack pointer at the entry is where the first push of the call ends; the depth goes down to the lowest store
//! code     where the blocks begin that calls of a function ran
//! ```
//!
//! The addresses that callers go on at are kept for all calls, counted or not, so that a function that ends by jumping into
//! another ends where it should.

use crate::instruction::Instruction;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// Stores further below the entry's stack pointer than this are none to a stack.
const LARGEST_STACK: u32 = 1 << 20;

/// A piece of straight code.
#[derive(Clone, Debug)]
pub struct Block {
    start: u32,
    end: u32,
    instructions: u64,
    first: Instruction,
    last: Instruction,
    /// Cycles of all but the first instruction, if the last is no taken jump and if it is
    rest: [u64; 2],
}

impl Block {
    /// From `start` to `end`; `None` where there is no instruction.
    pub fn new(start: u32, end: u32, code: &[Instruction]) -> Option<Self> {
        let (first, last) = (*code.first()?, *code.last()?);
        let rest = [false, true].map(|taken| {
            let pairs = code.iter().zip(code.iter().skip(1)).enumerate();
            pairs.map(|(k, (before, i))| u64::from(i.cost(Some(before), taken && k + 2 == code.len()))).sum()
        });
        Some(Self { start, end, instructions: code.len() as u64, first, last, rest })
    }

    fn cost(&self, before: Option<&Instruction>, taken: bool) -> u64 {
        let only = self.instructions == 1;
        u64::from(self.first.cost(before, taken && only)) + self.rest[usize::from(taken)]
    }
}

/// A function to be counted.
#[derive(Clone, Debug)]
pub struct Function {
    /// What its calls are reported as
    pub name: String,
    /// Of its first instruction
    pub address: u32,
}

/// What one call has cost.
#[derive(Clone, Debug)]
pub struct Call {
    name: String,
    instructions: u64,
    cycles: u64,
    /// The stack pointer at the entry, once known
    top: Option<u32>,
    lowest: u32,
    /// Depth of the calls under way at its entry
    depth: usize,
    /// The last instruction before the block that runs
    before: Option<Instruction>,
    /// The block that runs
    block: usize,
    /// Where the blocks begin that ran
    code: BTreeSet<u32>,
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stack = self.top.map_or(0, |top| top - self.lowest);
        write!(f, "{} {} {} {stack}", self.name, self.instructions, self.cycles)
    }
}

/// All blocks met, and the calls among them.
#[derive(Debug, Default)]
pub struct Counter {
    functions: Vec<Function>,
    blocks: Vec<Block>,
    /// Where the callers under way go on
    returns: Vec<u32>,
    running: Option<Call>,
    done: Vec<Call>,
    /// Of every function
    code: BTreeMap<String, BTreeSet<u32>>,
}

impl Counter {
    /// Counts calls of `functions`.
    pub fn new(functions: Vec<Function>) -> Self {
        Self { functions, ..Self::default() }
    }

    /// Remembers a block; its number.
    pub fn add(&mut self, block: Block) -> usize {
        self.blocks.push(block);
        self.blocks.len() - 1
    }

    /// The block `number` begins to run.
    pub fn run(&mut self, number: usize) {
        let Self { functions, blocks, returns, running, done, code } = self;
        let Some(block) = blocks.get(number) else { return };
        if returns.last() == Some(&block.start) {
            returns.pop();
            if let Some(mut call) = running.take_if(|call| returns.len() < call.depth) {
                call.leave(blocks, true);
                code.entry(call.name.clone()).or_default().append(&mut call.code);
                done.push(call);
            }
        }
        if let Some(call) = running {
            let taken = blocks.get(call.block).is_some_and(|left| left.end != block.start);
            call.leave(blocks, taken);
            call.block = number;
        } else if let Some(function) = functions.iter().find(|f| f.address == block.start) {
            let name = function.name.clone();
            let (depth, before, block) = (returns.len(), None, number);
            let code = BTreeSet::new();
            *running = Some(Call { name, instructions: 0, cycles: 0, top: None, lowest: 0, depth, before, block, code });
        }
        if let Some(call) = running {
            call.code.insert(block.start);
        }
        if block.last.calls {
            returns.push(block.end);
        }
    }

    /// A store to `address`, by an instruction that pushes that many words, lowest address first.
    pub fn store(&mut self, address: u32, pushed: u32) {
        let Some(call) = &mut self.running else { return };
        match call.top {
            None if pushed > 0 => (call.top, call.lowest) = (Some(address + 4 * pushed), address),
            Some(top) if address < call.lowest && top - address < LARGEST_STACK => call.lowest = address,
            _ => {}
        }
    }

    /// The calls that have ended.
    pub fn calls(&self) -> &[Call] {
        &self.done
    }

    /// Where the blocks begin that these calls ran, by function.
    pub fn code(&self) -> &BTreeMap<String, BTreeSet<u32>> {
        &self.code
    }
}

impl Call {
    /// Adds the cost of the block that has run.
    fn leave(&mut self, blocks: &[Block], taken: bool) {
        let Some(block) = blocks.get(self.block) else { return };
        self.instructions += block.instructions;
        self.cycles += block.cost(self.before.as_ref(), taken);
        self.before = Some(block.last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruction::Decoder;

    /// A program of blocks: the address of each, and its code.
    fn counter(entry: u32, program: &[(u32, &[u16])]) -> Option<Counter> {
        let mut counter = Counter::new(vec![Function { name: "f".to_owned(), address: entry }]);
        let decoder = Decoder::new().ok()?;
        for (start, halves) in program {
            let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
            let code = decoder.decode(&bytes, u64::from(*start)).ok()?;
            counter.add(Block::new(*start, start + bytes.len() as u32, &code)?);
        }
        Some(counter)
    }

    const BL: [u16; 2] = [0xf000, 0xf800];
    const BX_LR: u16 = 0x4770;
    const PUSH_LR: u16 = 0xb500;
    const POP_PC: u16 = 0xbd00;
    const MOV: u16 = 0x4608;

    #[test]
    fn a_call_holds_its_callees_and_ends_where_its_caller_goes_on() {
        let program: [(u32, &[u16]); 5] = [
            (0x100, &BL),                      // 0: the caller
            (0x104, &[MOV]),                   // 1: where it goes on
            (0x200, &[PUSH_LR, BL[0], BL[1]]), // 2: f
            (0x206, &[MOV, POP_PC]),           // 3: the rest of f
            (0x300, &[MOV, BX_LR]),            // 4: what f calls
        ];
        let lines = counter(0x200, &program).map(|mut counter| {
            for _ in 0..2 {
                counter.run(0);
                counter.run(2);
                counter.store(0x2000_0ffc, 1);
                counter.run(4);
                counter.store(0x2000_0ff0, 0);
                counter.store(0x2000_0100 - (1 << 21), 0);
                counter.run(3);
                counter.run(1);
            }
            assert!(counter.code()["f"].iter().eq(&[0x200, 0x206, 0x300]));
            counter.calls().iter().map(ToString::to_string).collect::<Vec<_>>()
        });
        // 2 + 3 of push and bl, 1 + 3 of mov and bx, 1 + 4 of mov and pop; stack from 0x1000 down to 0xff0.
        assert_eq!(lines, Some(vec!["f 6 14 16".to_owned(); 2]));
    }

    #[test]
    fn a_jump_into_another_function_ends_where_that_returns() {
        let program: [(u32, &[u16]); 4] = [
            (0x100, &BL),            // 0: the caller
            (0x104, &[MOV]),         // 1: where it goes on
            (0x200, &[MOV, 0xe07d]), // 2: f, ending in b 0x300
            (0x300, &[MOV, BX_LR]),  // 3: what it jumps into
        ];
        let lines = counter(0x200, &program).map(|mut counter| {
            [0, 2, 3, 1].into_iter().for_each(|block| counter.run(block));
            counter.calls().iter().map(ToString::to_string).collect::<Vec<_>>()
        });
        assert_eq!(lines, Some(vec!["f 4 8 0".to_owned()]));
    }
}
