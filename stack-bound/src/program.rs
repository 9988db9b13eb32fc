//! The whole program: every way through each function, and what its calls add.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use crate::instruction::{self, Instruction, decode};
use crate::problem::Problem;
use crate::registers::StackPointer;
use crate::state::State;
use crate::{Annotations, Image, Step};

/// The function that leaves a stack for another task's.
pub const SWITCH: &str = "kernel_switch";

/// The function that moves to the idle task's stack, perhaps below what that holds. Nothing but these two may load a stack
/// pointer that is not known.
const EXPIRY: &str = "kernel_expire_timers";

/// What is used of a stack at most, and by what, from the top down.
#[derive(Clone, Default)]
pub struct Use(pub Vec<Step>);

impl Use {
    pub fn of(name: &str, bytes: u32) -> Self {
        Use(vec![Step { name: name.to_owned(), bytes }])
    }

    pub fn bytes(&self) -> u32 {
        self.0.iter().map(|step| step.bytes).sum()
    }

    /// What is used when another use comes on top of this one.
    pub fn then(&self, other: &Use) -> Self {
        Use(self.0.iter().chain(&other.0).cloned().collect())
    }

    pub fn raise_to(&mut self, other: &Use) {
        if other.bytes() > self.bytes() {
            self.clone_from(other);
        }
    }
}

/// What a function uses, with all that it calls.
#[derive(Default)]
pub struct Function {
    /// Of the stack on which it is called, without its return address.
    pub own: Use,
    /// Of the kernel's stack, when it moves there.
    pub kernel: Use,
    returns: bool,
}

/// A place and a stack pointer: how a function gets to a place with different stack pointers is kept apart.
type Place = (u32, StackPointer);

pub struct Program<'a> {
    image: &'a Image,
    annotations: &'a Annotations,
    functions: BTreeMap<u32, Rc<Function>>,
    /// The functions that are being looked at, each called by the one before.
    calls: Vec<u32>,
    pub problems: BTreeSet<Problem>,
}

impl<'a> Program<'a> {
    pub fn new(image: &'a Image, annotations: &'a Annotations) -> Self {
        Program {
            image,
            annotations,
            functions: BTreeMap::new(),
            calls: Vec::new(),
            problems: BTreeSet::new(),
        }
    }

    /// What the code from the reset on uses.
    pub fn start_up(&mut self) -> Function {
        self.explore(0, StackPointer::Fixed(self.image.stack))
    }

    /// What the function that begins there uses.
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
            return Rc::new(Function { returns: true, ..Function::default() });
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
        Function { own: Use::of(&name, bytes.into()), kernel: Use::default(), returns: true }
    }

    /// Goes all ways from `entry`, until nothing new is found out.
    fn explore(&mut self, entry: u32, stack_pointer: StackPointer) -> Function {
        let mut function = Function::default();
        let mut known: BTreeMap<Place, State> = BTreeMap::new();
        let mut due = vec![((entry, stack_pointer), State::unknown())];
        while let Some((place, state)) = due.pop() {
            let state = match known.entry(place) {
                Entry::Vacant(entry) => entry.insert(state).clone(),
                Entry::Occupied(mut entry) => {
                    let mut joined = entry.get().clone();
                    joined.join(&state);
                    if joined == *entry.get() {
                        continue;
                    }
                    entry.insert(joined).clone()
                }
            };
            match self.step(place, state, &mut function) {
                Ok(next) => due.extend(next),
                Err(problem) => {
                    self.problems.insert(problem);
                    function.returns = true; // more problems may follow
                }
            }
        }
        function
    }

    /// Does one instruction, and returns where it leads.
    fn step(
        &mut self,
        place: Place,
        mut state: State,
        function: &mut Function,
    ) -> Result<Vec<(Place, State)>, Problem> {
        let (address, stack_pointer) = place;
        let image = self.image;
        let name = image.name(address);
        self.note(place, 0, &Function::default(), function)?;
        let Some((instruction, length)) = decode(&image.flash, address) else {
            return Err(Problem::NoCode { function: name.to_owned(), address });
        };
        let next = address + length;
        Ok(match instruction {
            Instruction::Return => {
                function.returns |= match stack_pointer {
                    StackPointer::Own(0) => true,
                    StackPointer::Own(_) => {
                        return Err(Problem::Return { function: name.to_owned(), address });
                    }
                    StackPointer::Fixed(_) | StackPointer::Elsewhere => state.is_saved,
                };
                Vec::new()
            }
            Instruction::Jump(0) => Vec::new(), // the program starts anew
            Instruction::Jump(target) => vec![((target, stack_pointer), state)],
            Instruction::JumpIndirect => {
                let targets = self.targets(address, &state)?;
                targets.into_iter().map(|target| ((target, stack_pointer), state.clone())).collect()
            }
            Instruction::Branch(target) => {
                vec![((next, stack_pointer), state.clone()), ((target, stack_pointer), state)]
            }
            Instruction::Skip => {
                let after = next + instruction::skipped(&image.flash, next);
                vec![((next, stack_pointer), state.clone()), ((after, stack_pointer), state)]
            }
            Instruction::LoadAboveY(_, bytes) if self.is_return_address(&state, bytes) => {
                return Err(Problem::ReturnAddress { function: name.to_owned(), address });
            }
            // A call to the next instruction makes room on the stack.
            Instruction::Call(target) if target == next => {
                let stack_pointer = state.push_unknown(stack_pointer, image.return_address);
                vec![((next, stack_pointer), state)]
            }
            Instruction::Call(target) => self.call(place, next, &[target], state, function)?,
            Instruction::CallIndirect => {
                let targets = self.targets(address, &state)?;
                self.call(place, next, &targets, state, function)?
            }
            other => {
                let after = state.apply(other, stack_pointer);
                let is_switch = after == StackPointer::Elsewhere && stack_pointer != StackPointer::Elsewhere;
                if is_switch && ![SWITCH, EXPIRY].contains(&name) {
                    return Err(Problem::StackPointer { function: name.to_owned(), address });
                }
                vec![((next, after), state)]
            }
        })
    }

    /// Whether so many bytes above Y lies the return address.
    fn is_return_address(&self, state: &State, bytes: u8) -> bool {
        let first = state.depth_at_y().map(|depth| depth + 1);
        first.is_some_and(|first| {
            (first..first + i32::from(self.image.return_address)).contains(&i32::from(bytes))
        })
    }

    /// Calls one of `targets`, whichever uses most.
    fn call(
        &mut self,
        place: Place,
        next: u32,
        targets: &[u32],
        state: State,
        function: &mut Function,
    ) -> Result<Vec<(Place, State)>, Problem> {
        let mut returns = false;
        for &target in targets {
            let callee = self.function(target);
            self.note(place, self.image.return_address, &callee, function)?;
            returns |= callee.returns;
        }
        Ok(if returns { vec![((next, place.1), state.after_call())] } else { Vec::new() })
    }

    /// Where Z points: known, or noted.
    fn targets(&self, address: u32, state: &State) -> Result<Vec<u32>, Problem> {
        let name = self.image.name(address);
        let noted = || self.annotations.calls.get(name).map(|callees| callees.iter().copied().collect());
        state.targets().or_else(noted).ok_or_else(|| Problem::Indirect { function: name.to_owned(), address })
    }

    /// At a place `bytes` more are on the stack, and then what `callee` uses.
    fn note(
        &self,
        (address, stack_pointer): Place,
        bytes: u16,
        callee: &Function,
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
        // Names are long, and most places are not the deepest.
        if bytes + callee.own.bytes() > stack.bytes() {
            *stack = Use::of(name, bytes).then(&callee.own);
        }
        Ok(())
    }
}
