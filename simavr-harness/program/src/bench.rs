//! The program behind `./x bench`: the kernel's figures beside those of its peers.

use std::error::Error;
use std::fmt;
use std::path::Path;

use serde::{Serialize, Serializer};
use simavr_harness::bench::{self, Counted, FIGURES, Figure, Measured, PEERS};

use super::arguments::Subject;
use super::json::{Destination, tell};
use super::{arguments, concurrency, listing, module, simulator};

/// Measures and prints.
pub fn run(options: &arguments::Bench) -> Result<(), Box<dyn Error>> {
    let destination = Destination::of(options.json.as_deref(), None)?;
    if options.svg.is_some() && options.subject != Subject::Concurrency {
        return Err("only concurrency has a plot: leave --svg out".into());
    }
    if options.subject != Subject::Kernel && (options.listing.is_some() || options.windows) {
        return Err("only the kernel's figures have listings: leave --listing and --windows out".into());
    }
    if options.seconds.is_some() && matches!(options.subject, Subject::Kernel | Subject::Simulator) {
        return Err("only module and concurrency have a length: leave --seconds out".into());
    }
    match options.subject {
        Subject::Kernel => {}
        Subject::Module => return module::run(options, destination),
        Subject::Simulator => return simulator::run(options, destination),
        Subject::Concurrency => return concurrency::run(options, destination),
    }
    let images = options.images.join("tests");
    if options.windows {
        return listing::print_windows(&images);
    }
    let report = Report::new(&images)?;
    match &options.listing {
        Some(name) => listing::print(&images, report.named(name)?),
        None => tell(destination, &report),
    }
}

struct Report {
    measured: Vec<Measured>,
    /// The places where the longest masked windows begin, a line each.
    masked: Vec<String>,
}

impl Report {
    fn new(images: &Path) -> Result<Self, Box<dyn Error>> {
        let measured = bench::measure(images)?;
        let mut masked = Vec::new();
        for Measured { name, counted, .. } in &measured {
            if let (true, Counted::Cycles(stretch)) = (name.starts_with("masked"), counted) {
                masked.push(format!("{name}: {}", listing::place(images, stretch)?));
            }
        }
        Ok(Report { measured, masked })
    }

    fn named(&self, name: &str) -> Result<&Measured, String> {
        let found = self.measured.iter().find(|measured| measured.name == name);
        found.ok_or_else(|| format!("there is no figure {name}; `./x bench` prints their names"))
    }

    /// Each figure with its measured value.
    fn lines(&self) -> impl Iterator<Item = (&'static Figure, &Measured)> {
        FIGURES.iter().filter_map(|figure| Some((figure, self.named(figure.name).ok()?)))
    }
}

/// One object: each figure's name and value.
impl Serialize for Report {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.lines().map(|(figure, measured)| (figure.name, measured.value)))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:34}{:>5}  {:17}", "", "here", "to reach")?;
        for peer in PEERS {
            write!(f, "{:>9}", peer.name)?;
        }
        writeln!(f)?;
        for (figure, measured) in self.lines() {
            let value = measured.value;
            let aim = figure.limit.map(|limit| {
                let verdict = if value > limit { "MISSED" } else { "reached" };
                format!("<= {limit:4} {verdict}")
            });
            write!(f, "{:34}{value:>5}  {:17}", figure.name, aim.unwrap_or_default())?;
            for peer in figure.peers {
                let peer = peer.map_or("-".into(), |value| value.to_string());
                write!(f, "{peer:>9}")?;
            }
            writeln!(f)?;
        }
        writeln!(f)?;
        for line in &self.masked {
            writeln!(f, "{line}")?;
        }
        writeln!(f, "\nPeers: {}.", PEERS.map(|peer| peer.version).join("; "))
    }
}
