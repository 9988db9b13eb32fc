//! What lies where in SRAM, in the words of the program.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use rustc_demangle::demangle;

use crate::image::{Image, Place};
use crate::trace::kernel::Kept;
use crate::trace::{TaskState, Wait};

/// The variables of a program.
pub(super) struct Names {
    /// By where they begin: how far they reach, and the last part of their path.
    variables: BTreeMap<u16, (u16, Arc<str>)>,
    /// By their whole paths.
    places: HashMap<String, (u16, u16)>,
    /// Names of addresses, as far as they were asked for.
    known: HashMap<u16, Arc<str>>,
}

impl Names {
    pub fn of(image: &Image) -> Self {
        let (mut variables, mut places) = (BTreeMap::new(), HashMap::new());
        for (mangled, symbol) in image.symbols() {
            if let Place::Data(start) = symbol.place
                && symbol.size > 0
            {
                let path = format!("{:#}", demangle(mangled));
                let name = path.rsplit("::").next().unwrap_or(&path).into();
                variables.insert(start, (symbol.size, name));
                places.insert(path, (start, symbol.size));
            }
        }
        Self { variables, places, known: HashMap::new() }
    }

    /// Where the variable of this path lies, and how many bytes it takes.
    pub fn place(&self, path: &str) -> Option<(u16, u16)> {
        self.places.get(path).copied()
    }

    /// Where the control blocks of tasks lie, and their names: each begins its stack, which is in a module
    /// `stack`.
    pub fn tasks(&self) -> impl Iterator<Item = (u16, &str)> {
        self.places.iter().filter_map(|(path, &(start, _))| {
            let (module, name) = path.rsplit_once("::")?;
            module.ends_with("::stack").then_some((start, name))
        })
    }

    /// What a task does that is not ready; `None` if there is none on the stack.
    pub fn state(&mut self, kept: Kept) -> Option<TaskState> {
        match kept {
            Kept::Absent => None,
            Kept::Suspended => Some(TaskState::Suspended),
            Kept::Killed => Some(TaskState::Killed),
            Kept::Waiting { on, ticks } => {
                let on = on.into_iter().map(|semaphore| self.name(semaphore)).collect();
                Some(TaskState::Waiting(Wait { on, ticks }))
            }
        }
    }

    /// What the program calls what lies at `address`: a variable, or a place so many bytes from its start.
    pub fn name(&mut self, address: u16) -> Arc<str> {
        let Self { variables, known, .. } = self;
        known.entry(address).or_insert_with(|| named(variables, address)).clone()
    }
}

fn named(variables: &BTreeMap<u16, (u16, Arc<str>)>, address: u16) -> Arc<str> {
    match variables.range(..=address).next_back() {
        Some((&start, (_, name))) if start == address => name.clone(),
        Some((&start, (size, name))) if address - start < *size => {
            format!("{name}+{}", address - start).into()
        }
        _ => format!("{address:#06x}").into(),
    }
}
