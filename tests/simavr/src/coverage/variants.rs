//! The kernel's functions, merged from all images.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use rustc_demangle::demangle;
use simavr_harness::{Code, Form, Image, Kind, Place, Ways};

use super::functions::{is_assembly, name_in_kernel};
use super::gap::{Gap, What};

/// The kernel's functions, with the executed instructions of each of their variants.
#[derive(Default)]
pub struct Functions {
    variants: BTreeMap<(String, Vec<Form>), Variant>,
}

/// The image that makes every call of the kernel, in random order.
const GOES_ALL_WAYS: &str = "model.elf";

/// One variant of a function.
struct Variant {
    /// The first image that has the variant; `code` and `end` are from there.
    image: String,
    /// Whether an image that has it should take all paths.
    is_to_go_all_ways: bool,
    code: Vec<Code>,
    end: u32,
    /// The ways taken in all images together.
    ways: Vec<Ways>,
}

/// A gap, and where to look at it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    pub gap: Gap,
    pub image: String,
    /// Byte address in that image's flash.
    pub address: u32,
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} (at {:#x} of {})", self.gap, self.address, self.image)
    }
}

impl Functions {
    /// Adds the functions of an image, with its record. An image without a record has executed nothing.
    pub fn add(&mut self, name: &str, image: &Image) {
        let mut starts = BTreeSet::new();
        for (mangled, symbol) in image.symbols().filter(|(_, symbol)| symbol.is_function && symbol.size > 0) {
            let Place::Flash(start) = symbol.place else { continue };
            let Some(function) = name_in_kernel(&format!("{:#}", demangle(mangled))) else { continue };
            if !starts.insert(start) {
                continue; // another name of the same function
            }
            let end = start + u32::from(symbol.size);
            let code = image.code(start..end);
            let ways = |code: &Code| image.coverage().map_or(Ways::default(), |all| all.ways(code.address));
            let ways: Vec<_> = code.iter().map(ways).collect();
            let forms = code.iter().map(|code| code.form).collect();
            let variant = self.variants.entry((function, forms)).or_insert_with(|| Variant {
                image: name.to_owned(),
                is_to_go_all_ways: false,
                ways: vec![Ways::default(); code.len()],
                code,
                end,
            });
            variant.is_to_go_all_ways |= name.ends_with(GOES_ALL_WAYS);
            for (all, here) in variant.ways.iter_mut().zip(ways) {
                *all = all.or(here);
            }
        }
    }

    /// The gaps that no test fills, sorted. A gap that several variants have is listed once.
    pub fn gaps(&self) -> Vec<Found> {
        let mut gaps: Vec<_> =
            self.counted().flat_map(|(function, variant)| variant.gaps(function)).collect();
        gaps.sort_by(|one, other| one.gap.cmp(&other.gap));
        gaps.dedup_by(|one, other| one.gap == other.gap);
        gaps
    }

    /// The variants that have to be covered. An image that tests one behaviour need not take all paths: if
    /// [`GOES_ALL_WAYS`] has a function, only its variants count. Assembly differs with the configuration and
    /// not by inlining, so all its variants count.
    fn counted(&self) -> impl Iterator<Item = (&str, &Variant)> {
        let all = || self.variants.iter().map(|((function, _), variant)| (&**function, variant));
        let to_go_all_ways: BTreeSet<_> =
            all().filter(|(_, variant)| variant.is_to_go_all_ways).map(|(function, _)| function).collect();
        all().filter(move |(function, variant)| {
            variant.is_to_go_all_ways || is_assembly(function) || !to_go_all_ways.contains(function)
        })
    }

    /// The numbers of functions and instructions, and how many are covered.
    pub fn summary(&self) -> String {
        let functions: BTreeSet<_> = self.counted().map(|(function, _)| function).collect();
        let all = || self.counted().flat_map(|(_, variant)| variant.code.iter().zip(&variant.ways));
        let forks = || all().filter(|(code, _)| matches!(code.kind, Kind::Branch | Kind::Skip));
        format!(
            "{} functions in {} variants: {} of {} instructions executed, \
             {} of {} branches and skips went both ways",
            functions.len(),
            self.counted().count(),
            all().filter(|(_, ways)| ways.is_executed()).count(),
            all().count(),
            forks().filter(|(_, ways)| ways.on && ways.away).count(),
            forks().count(),
        )
    }
}

impl Variant {
    fn gaps(&self, function: &str) -> Vec<Found> {
        let begin = self.code[0].address;
        let mut gaps: Vec<Found> = Vec::new();
        let ends = self.code.iter().skip(1).map(|code| code.address).chain([self.end]);
        for ((code, ways), end) in self.code.iter().zip(&self.ways).zip(ends) {
            let Some(what) = what(code.kind, *ways) else { continue };
            let range = code.address - begin..end - begin;
            match gaps.last_mut() {
                // Instructions that are reached only by a way that is never taken belong to that gap.
                Some(Found { gap, .. })
                    if what == What::NeverExecuted && gap.leads_nowhere() && gap.to == range.start =>
                {
                    gap.to = range.end;
                }
                _ => gaps.push(Found {
                    gap: Gap::new(function, range, what),
                    image: self.image.clone(),
                    address: code.address,
                }),
            }
        }
        gaps
    }
}

/// The gap of an instruction, if it has one.
fn what(kind: Kind, ways: Ways) -> Option<What> {
    match (kind, ways) {
        _ if !ways.is_executed() => Some(What::NeverExecuted),
        (Kind::Branch, Ways { on: false, .. }) => Some(What::AlwaysBranches),
        (Kind::Branch, Ways { away: false, .. }) => Some(What::NeverBranches),
        (Kind::Skip, Ways { on: false, .. }) => Some(What::AlwaysSkips),
        (Kind::Skip, Ways { away: false, .. }) => Some(What::NeverSkips),
        _ => None,
    }
}
