//! The whole program: every path through each function, and the use of its calls.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use crate::effect::{self, Effect, effect};
use crate::enables::enables_interrupts;
use crate::flow::{Flow, Masking, Place};
use crate::problem::Problem;
use crate::registers::{PRESERVED, StackPointer};
use crate::state::{Interrupts, State};
use crate::usage::{Usage, Use};
use crate::{Annotations, Image, timing};

/// The function that switches to another task's stack. No other function may load an unknown stack pointer.
pub const SWITCH: &str = "kernel_switch";

/// A function that reaches an instruction with more depths of the stack than these pushes without end.
const MOST_DEPTHS: usize = 256;

/// Whose stack an interrupt finds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Found {
    Task,
    Kernel,
}

/// The stack use of a function and all its callees.
#[derive(Default)]
pub struct Function {
    /// The use of the stack on which it is called, without its return address.
    pub own: Usage,
    /// The use of the kernel's stack, if it moves there.
    pub kernel: Usage,
    /// How it returns, if it does.
    returns: Option<Return>,
    /// Its control flow.
    flow: Flow,
}

/// What holds at every return of a function.
#[derive(Clone, Copy)]
struct Return {
    /// The registers that it preserves, a bit each.
    preserved: u32,
    /// Whether an interrupt may occur before the caller's next instruction.
    interrupts: Interrupts,
}

impl Return {
    /// The return of a function about which nothing else is known.
    const UNKNOWN: Return = Return { preserved: PRESERVED, interrupts: Interrupts::Masked };

    /// What holds at either of two returns.
    fn or(self, other: Option<Return>) -> Self {
        let other = other.unwrap_or(self);
        Return {
            preserved: self.preserved & other.preserved,
            interrupts: self.interrupts.max(other.interrupts),
        }
    }
}

pub struct Program<'a> {
    pub image: &'a Image,
    annotations: &'a Annotations,
    /// The stack that an interrupt finds when it compares SP.
    found: Found,
    functions: BTreeMap<u32, Rc<Function>>,
    /// The functions that are being followed, each called by the one before.
    calls: Vec<u32>,
    pub problems: BTreeSet<Problem>,
}

impl<'a> Program<'a> {
    pub fn new(image: &'a Image, annotations: &'a Annotations, found: Found) -> Self {
        Program {
            image,
            annotations,
            found,
            functions: BTreeMap::new(),
            calls: Vec::new(),
            problems: BTreeSet::new(),
        }
    }

    /// The use of the code from the reset on.
    pub fn start_up(&mut self) -> Function {
        self.explore(0, StackPointer::Fixed(self.image.stack))
    }

    /// The use of the function that begins at `entry`.
    pub fn function(&mut self, entry: u32) -> Rc<Function> {
        if let Some(function) = self.functions.get(&entry) {
            return function.clone();
        }
        let function = Rc::new(if let Some(&bytes) = self.annotations.bytes.get(&entry) {
            self.believed(entry, bytes)
        } else if let Some(first) = self.calls.iter().position(|&call| call == entry) {
            let circle =
                self.calls[first..].iter().chain([&entry]).map(|&entry| self.image.name(entry).to_owned());
            self.problems.insert(Problem::Recursion(circle.collect()));
            return Rc::new(Function { returns: Some(Return::UNKNOWN), ..Function::default() });
        } else {
            self.calls.push(entry);
            let function = self.explore(entry, StackPointer::Own(0));
            self.calls.pop();
            function
        });
        self.functions.insert(entry, function.clone());
        function
    }

    fn believed(&self, entry: u32, bytes: u16) -> Function {
        let name = format!("{} (as noted)", self.image.name(entry));
        let bytes = Use::of(&name, bytes.into());
        let mut own = Usage::only(bytes.clone());
        let mut returns = Return::UNKNOWN;
        if enables_interrupts(self.image, self.annotations, entry) {
            own.open_window((None, entry), bytes);
            returns.interrupts = Interrupts::Enabled;
        }
        Function { own, returns: Some(returns), ..Function::default() }
    }

    /// The control flow of the functions requested so far, and of their callees.
    pub fn into_flows(self) -> BTreeMap<u32, Flow> {
        self.functions.into_iter().map(|(entry, function)| (entry, function.flow.clone())).collect()
    }

    /// Follows all paths from `entry` until no state changes any more.
    fn explore(&mut self, entry: u32, stack_pointer: StackPointer) -> Function {
        let mut function = Function::default();
        function.flow.entry = Some((entry, stack_pointer));
        let mut known: BTreeMap<Place, State> = BTreeMap::new();
        let mut depths: BTreeMap<u32, usize> = BTreeMap::new();
        let mut due = vec![((entry, stack_pointer), State::at_start())];
        while let Some((place, state)) = due.pop() {
            let state = match known.entry(place) {
                Entry::Vacant(entry) => {
                    let depths = depths.entry(place.0).or_default();
                    *depths += 1;
                    if *depths > MOST_DEPTHS {
                        let name = self.image.name(place.0).to_owned();
                        self.problems.insert(Problem::Depth { function: name, address: place.0 });
                        function.returns = Some(Return::UNKNOWN);
                        break; // the other paths are as endless
                    }
                    entry.insert(state).clone()
                }
                Entry::Occupied(mut entry) => {
                    let mut joined = entry.get().clone();
                    joined.join(&state);
                    if joined == *entry.get() {
                        continue;
                    }
                    entry.insert(joined.clone());
                    joined
                }
            };
            let masking = self.masking(place.0, &state);
            match self.step(place, state, &mut function) {
                Ok(next) => {
                    self.record(place, &next, masking, &mut function.flow);
                    due.extend(next);
                }
                Err(problem) => {
                    self.problems.insert(problem);
                    function.returns = Some(Return::UNKNOWN); // more problems may follow
                }
            }
        }
        function
    }

    /// Records where an instruction leads. A later visit overwrites an earlier one: its joined state covers
    /// the earlier.
    fn record(&self, place: Place, next: &[(Place, State)], masking: Masking, flow: &mut Flow) {
        let (flash, address) = (&self.image.flash, place.0);
        let Some((effect, length)) = effect(flash, address) else { return };
        let behind = address + length;
        let node = flow.nodes.entry(place).or_default();
        node.next = next.iter().map(|&(to, _)| (to, timing::more_cycles(effect, behind, to.0))).collect();
        node.names = effect::named_address(flash, address);
        node.masking = masking;
        let parts = std::iter::successors(Some(address), |at| Some(at + effect::length(flash, *at)));
        let parts = parts.take_while(|&at| at < behind);
        let cycles = |at| timing::cycles(flash, at, self.image.return_address);
        let waits = |at| timing::waits_for_eeprom(flash, at, self.image.mcu());
        node.cycles = parts.map(|at| Some(cycles(at)? + waits(at))).sum();
        if timing::is_sleep(flash, address) {
            node.wakes = node.next.drain(..).next().map(|(to, _)| to);
        }
    }

    /// What the instruction at an address does to the interrupt flag.
    fn masking(&self, address: u32, state: &State) -> Masking {
        let flash = &self.image.flash;
        match effect(flash, address).map(|(effect, _)| effect) {
            Some(Effect::DisableInterrupts) => Masking::Masks,
            Some(Effect::EnableInterrupts) => Masking::Enables,
            Some(Effect::Return) if timing::is_return_from_interrupt(flash, address) => Masking::Enables,
            Some(Effect::ReadStatus(register)) => Masking::Reads(register),
            Some(Effect::WriteStatus(register)) => match state.written_flag(register) {
                Some(true) => Masking::Enables,
                Some(false) => Masking::Masks,
                None => Masking::Restores(register),
            },
            _ => Masking::Nothing,
        }
    }

    /// Applies one instruction, and returns where it leads.
    fn step(
        &mut self,
        place: Place,
        mut state: State,
        function: &mut Function,
    ) -> Result<Vec<(Place, State)>, Problem> {
        let (address, stack_pointer) = place;
        let image = self.image;
        let name = image.name(address);
        self.note(place, 0, &Function::default(), state.is_interruptible(), function)?;
        let compared = state.begin();
        let Some((effect, length)) = effect(&image.flash, address) else {
            return Err(Problem::NoCode { function: name.to_owned(), address });
        };
        // SPH alone was written, so the stack lies elsewhere.
        if state.is_half_written() && effect.moves() {
            return Err(Problem::StackPointer { function: name.to_owned(), address });
        }
        let next = address + length;
        Ok(match effect {
            Effect::Return => {
                let preserved = match stack_pointer {
                    StackPointer::Own(0) => state.preserved(),
                    // What lies there is no return address of a call: it leads anywhere.
                    StackPointer::Own(_) | StackPointer::Fixed(_) => {
                        return Err(Problem::Return { function: name.to_owned(), address });
                    }
                    StackPointer::Elsewhere if state.is_saved => PRESERVED,
                    StackPointer::Elsewhere => return Ok(Vec::new()),
                };
                let is_reti = timing::is_return_from_interrupt(&image.flash, address);
                let here = Return { preserved, interrupts: state.after_return(is_reti) };
                function.returns = Some(here.or(function.returns));
                Vec::new()
            }
            Effect::Jump(0) => Vec::new(), // the program starts anew
            Effect::Jump(target) => vec![((target, stack_pointer), state)],
            Effect::JumpIndirect => {
                let targets = self.targets(address, &state)?;
                targets.into_iter().map(|target| ((target, stack_pointer), state.clone())).collect()
            }
            // Here an interrupt finds out whether it has preempted a task's stack: those lie below the end of
            // the variables, and the kernel's stack above it.
            Effect::BranchIfSameOrHigher(target) if compared == Some(image.variables_end) => {
                let next = if self.found == Found::Kernel { target } else { next };
                vec![((next, stack_pointer), state)]
            }
            Effect::Branch(target) | Effect::BranchIfSameOrHigher(target) => {
                vec![((next, stack_pointer), state.clone()), ((target, stack_pointer), state)]
            }
            Effect::Skip => {
                let after = next + effect::length(&image.flash, next);
                vec![((next, stack_pointer), state.clone()), ((after, stack_pointer), state)]
            }
            Effect::LoadAboveY(_, bytes) if self.is_return_address(&state, bytes) => {
                return Err(Problem::ReturnAddress { function: name.to_owned(), address });
            }
            // A call to the next instruction makes room on the stack.
            Effect::Call(target) if target == next => {
                let stack_pointer = state.push_unknown(stack_pointer, image.return_address);
                vec![((next, stack_pointer), state)]
            }
            Effect::Call(target) => self.call(place, next, &[target], state, function)?,
            Effect::CallIndirect => {
                let targets = self.targets(address, &state)?;
                self.call(place, next, &targets, state, function)?
            }
            other => {
                // The value comes from a caller, perhaps from before it masked interrupts. The switch takes
                // that of a context, which it leaves by RETI.
                if let Effect::WriteStatus(from) = other
                    && name != SWITCH
                    && state.is_foreign_status(from)
                {
                    state.may_enable();
                }
                let after = state.apply(other, stack_pointer);
                let is_switch = after == StackPointer::Elsewhere && stack_pointer != StackPointer::Elsewhere;
                if is_switch && name != SWITCH {
                    return Err(Problem::StackPointer { function: name.to_owned(), address });
                }
                vec![((next, after), state)]
            }
        })
    }

    /// Whether the byte at this displacement above Y is part of the return address.
    fn is_return_address(&self, state: &State, bytes: u8) -> bool {
        let first = state.depth_at_y().map(|depth| depth + 1);
        first.is_some_and(|first| {
            (first..first + i32::from(self.image.return_address)).contains(&i32::from(bytes))
        })
    }

    /// Calls one of `targets`; the one with the most use counts.
    fn call(
        &mut self,
        place: Place,
        next: u32,
        targets: &[u32],
        state: State,
        function: &mut Function,
    ) -> Result<Vec<(Place, State)>, Problem> {
        let mut returns = None;
        function.flow.nodes.entry(place).or_default().calls = targets.to_vec();
        for &target in targets {
            let callee = self.function(target);
            // In a function that is called with interrupts enabled, they count as enabled at every place.
            self.note(place, self.image.return_address, &callee, state.enables_interrupts(), function)?;
            returns = callee.returns.map(|callee| callee.or(returns)).or(returns);
        }
        let after = |returns: Return| state.after_call(returns.preserved, returns.interrupts);
        Ok(returns.map(|returns| ((next, place.1), after(returns))).into_iter().collect())
    }

    /// Where Z points, from the registers' known values or from the notes.
    fn targets(&self, address: u32, state: &State) -> Result<Vec<u32>, Problem> {
        let name = self.image.name(address);
        let noted = || self.annotations.calls.get(name).map(|callees| callees.iter().copied().collect());
        state.targets().or_else(noted).ok_or_else(|| Problem::Indirect { function: name.to_owned(), address })
    }

    /// Counts `bytes` more on the stack at a place, and the use of `callee` on top of that, with interrupts
    /// enabled throughout if `is_interruptible`.
    fn note(
        &self,
        (address, stack_pointer): Place,
        bytes: u16,
        callee: &Function,
        is_interruptible: bool,
        function: &mut Function,
    ) -> Result<(), Problem> {
        let name = self.image.name(address);
        let top = self.image.stack;
        function.kernel.raise_to(&callee.kernel);
        let (stack, depth) = match stack_pointer {
            StackPointer::Own(depth) => (&mut function.own, u16::try_from(depth).ok()),
            StackPointer::Fixed(at) => (&mut function.kernel, top.checked_sub(at)),
            StackPointer::Elsewhere => return Ok(()),
        };
        let depth = depth
            .filter(|&depth| depth <= top)
            .ok_or_else(|| Problem::Depth { function: name.to_owned(), address })?;
        let bytes = u32::from(depth) + u32::from(bytes);
        stack.raise_to_call(name, bytes, &callee.own);
        if is_interruptible {
            let window = (None, self.image.start(address));
            stack.open_window(window, Use::of(name, bytes).then(&callee.own.deepest));
        }
        Ok(())
    }
}
