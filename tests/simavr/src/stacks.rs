//! How much of each stack an MCU uses, and the bound by `stack-bound`.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use simavr_harness::{Image, Mcu, Part, Place};
use stack_bound::Annotations;
use stack_bound::effect::{Effect, effect};

/// The byte that fills an unused stack: the kernel's `WATERMARK`.
const WATERMARK: u8 = 0xa5;

/// The size of a task's control block, which lies before its stack, in bytes.
const CONTROL_BLOCK: u16 = 6;

/// The offset of the stack pointer in it.
const STACK_POINTER: u16 = 1;

/// How many bytes above the stack pointer a first context has the address of the task's code, a word address.
/// Below it are Y, which is the address of the task's captures, and the program counter.
fn entry_offset(part: &Part) -> u16 {
    1 + 2 + part.return_address
}

/// The most cycles from power-up until the first task runs.
const START_UP: u64 = 1_000_000;

/// A stack of an image, and its addresses.
pub struct Stack {
    pub bound: stack_bound::Stack,
    /// The name of its `static`, or "kernel".
    pub name: String,
    addresses: Range<u16>,
}

impl Stack {
    /// How many bytes have been used: those above the last byte that has never been used.
    pub fn used(&self, mcu: &Mcu) -> u32 {
        let first = self.addresses.clone().find(|&address| mcu.read(address) != Some(WATERMARK));
        first.map_or(0, |first| u32::from(self.addresses.end - first))
    }
}

/// The stacks of an image. Tasks are found by the contents of their control blocks before the first task
/// runs; tasks that others start later are left out.
///
/// # Panics
/// When a bound cannot be computed.
pub fn stacks(part: &'static Part, image: &Path, notes: Option<&Path>) -> Vec<Stack> {
    let program = stack_bound::Image::load(image).expect("the image can be read");
    let annotations = notes.map_or_else(Annotations::default, |notes| {
        let text = std::fs::read_to_string(notes).expect("the notes can be read");
        // One file of notes serves many images, and each image has only some of the functions.
        let is_here =
            |note: &&str| note.split("=>").all(|function| program.function(function.trim()).is_some());
        let notes: Vec<&str> = text.lines().filter(is_here).collect();
        Annotations::parse(&notes.join("\n"), &program).expect("the notes are well-formed")
    });
    let bounds = stack_bound::stacks(&program, &annotations)
        .unwrap_or_else(|problems| panic!("{}: {problems:?}", image.display()));

    let image = Arc::new(Image::load(image).expect("the image can be read"));
    let mut mcu = Mcu::new(part, image.clone(), 1).expect("the image fits the MCU");
    if bounds.len() > 1 {
        run_to(&mut mcu, "kernel_run_head");
    }
    let find = |bound: stack_bound::Stack| {
        let (name, addresses) = if bound.entry == 0 {
            let Some(Place::Data(end)) = image.symbol("_end").map(|symbol| symbol.place) else {
                panic!("the image does not say where its variables end");
            };
            ("kernel", end..part.ram_end + 1)
        } else {
            task_stack(&mcu, &image, &bound)?
        };
        assert_eq!(addresses.len(), bound.size.into(), "{name}");
        let name = format!("{:#}", rustc_demangle::demangle(name));
        Some(Stack { name: name.rsplit("::").next().unwrap_or_default().to_owned(), bound, addresses })
    };
    bounds.into_iter().filter_map(find).collect()
}

/// The static that has the first context of a task.
fn task_stack<'a>(mcu: &Mcu, image: &'a Image, bound: &stack_bound::Stack) -> Option<(&'a str, Range<u16>)> {
    let word = |low: u16, high: u16| Some(u16::from_le_bytes([mcu.read(low)?, mcu.read(high)?]));
    let offset = entry_offset(mcu.part());
    let is_it = |addresses: &Range<u16>| {
        let block = addresses.start - CONTROL_BLOCK;
        let saved = block + STACK_POINTER;
        let entry = word(saved, saved + 1)
            .filter(|stack_pointer| addresses.contains(stack_pointer))
            .and_then(|stack_pointer| word(stack_pointer + offset, stack_pointer + offset + 1));
        entry.is_some_and(|entry| is_function(image, u32::from(entry) * 2, bound.entry))
    };
    image.symbols().find_map(|(name, symbol)| {
        let Place::Data(start) = symbol.place else { return None };
        // An array of stacks is one symbol.
        let blocks = (start..start.saturating_add(symbol.size)).step_by((CONTROL_BLOCK + bound.size).into());
        let mut stacks = blocks.map(|block| block + CONTROL_BLOCK..block + CONTROL_BLOCK + bound.size);
        Some((name, stacks.find(is_it)?))
    })
}

/// Whether a call of `address` reaches the function at `entry`, in bytes of flash. If the function lies
/// beyond 128 KB, the linker puts a `jmp` to it at `address`.
fn is_function(image: &Image, address: u32, entry: u32) -> bool {
    let jumps_there = || effect(image.flash(), address) == Some((Effect::Jump(entry), 4));
    address == entry || jumps_there()
}

/// Runs an MCU that has just powered up to its `main`, and writes the watermark into the kernel's stack. The
/// kernel writes it into the stacks of tasks when they are started.
///
/// # Panics
/// When the image has no `main`.
pub fn paint(mcu: &mut Mcu, stacks: &[Stack]) {
    run_to(mcu, "main");
    let in_use = mcu.stack_pointer() + 1..mcu.part().ram_end + 1;
    for address in
        stacks.iter().filter(|stack| stack.bound.entry == 0).flat_map(|stack| stack.addresses.clone())
    {
        if !in_use.contains(&address) {
            mcu.write(address, WATERMARK);
        }
    }
}

fn run_to(mcu: &mut Mcu, symbol: &str) {
    let place = mcu.image().symbol(symbol).map(|symbol| symbol.place);
    while place != Some(Place::Flash(mcu.pc())) {
        assert!(mcu.cycle() < START_UP, "{symbol} was not reached");
        mcu.step();
    }
}
