//! The program's names for addresses in SRAM.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use rustc_demangle::demangle;

use crate::image::{Image, Place};

/// The variables of a program.
pub(crate) struct Names {
    /// By their addresses: their sizes, and the last part of their paths.
    variables: BTreeMap<u16, (u16, Arc<str>)>,
    /// By their whole paths: their addresses and sizes.
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

    /// The address of the variable of this path, and its size in bytes.
    pub fn place(&self, path: &str) -> Option<(u16, u16)> {
        self.places.get(path).copied()
    }

    /// The tasks: the address of each control block, the task's name, and the bytes of the control block and
    /// its stack together. The path of such a variable is in a module `stack`.
    pub fn tasks(&self) -> impl Iterator<Item = (u16, &str, u16)> {
        self.places.iter().filter_map(|(path, &(start, size))| {
            let (module, name) = path.rsplit_once("::")?;
            module.ends_with("::stack").then_some((start, name, size))
        })
    }

    /// The program's name for `address`: that of a variable, followed by the distance from its start if that
    /// is not 0.
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
